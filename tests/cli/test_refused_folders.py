"""A command that is refused leaves no folder that it has made; what was there before stays."""

from pathlib import Path

import pytest

from torquer.cli.answer import answer

EXAMPLES = Path(__file__).parents[2] / "examples"
LAW, TIP_OFF = str(EXAMPLES / "my_law.toml"), str(EXAMPLES / "tip_off_campaign.toml")
#: Commands that are refused after they have seen that their folder can be written.
REFUSED = {
    "a computer that is none": ["run", LAW, "--computer", str(EXAMPLES)],
    "campaign with a computer that is none": ["campaign", TIP_OFF, "--computer", str(EXAMPLES)],
    "design of gains without coils": [
        "design", "three-axis", str(EXAMPLES / "passive_magnet.toml"),
    ],
    "design of a wheel that it lacks": ["design", "magneto-gyro", LAW],
    "export of no steps": ["export", "c", LAW, "--steps", "0"],
    "flight with a computer that is none": ["fly", LAW, "--computer", str(EXAMPLES)],
    "parts that are no campaigns": ["campaign", "join", LAW],
    "run without one to resume": ["run", LAW, "--resume"],
}  # fmt: skip


@pytest.mark.parametrize("case", sorted(REFUSED))
def test_no_folder_is_left(case, tmp_path, capsys):
    assert answer([*REFUSED[case], "--out", str(tmp_path / "new" / "out")]) == 2
    errors = capsys.readouterr().err.splitlines()
    assert len(errors) == 1 and errors[0].startswith("error: ")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("case", sorted(REFUSED))
def test_a_folder_that_was_there_stays(case, tmp_path, capsys):
    (tmp_path / "mine").mkdir()
    assert answer([*REFUSED[case], "--out", str(tmp_path / "mine" / "out")]) == 2
    assert [each.name for each in tmp_path.rglob("*")] == ["mine"]


def test_a_folder_of_a_command_that_succeeds_stays(tmp_path, capsys):
    out = tmp_path / "new" / "out"
    assert answer(["packets", "--out", str(out)]) == 0
    assert answer(["run", LAW, "--resume", "--out", str(tmp_path / "other")]) == 2
    assert out.is_dir() and [each.name for each in tmp_path.iterdir()] == ["new"]
