"""What `torquer export c` refuses leaves nothing behind: no folder, no file, nothing changed."""

import shutil
from pathlib import Path

import pytest

from torquer.cli.answer import answer

EXAMPLES = Path(__file__).parents[2] / "examples"
#: Examples with their own code, by what is written into their files in place of what.
CHANGED = {
    "a law that has no translation": ("my_law", "my_law.py", "math.sqrt(", "math.hypot(bx, "),
    "a parameter that no float holds": ("my_law", "my_law.toml", "gain = 3e4", "gain = 3e40"),
    "as it is": ("my_law", "my_law.toml", "", ""),
    "an orbit of one's own": ("own_parts", "own_parts.toml", "", ""),
}
REFUSED = {
    "an unknown ephemeris": ("as it is", ["--ephemeris", "sundial"]),
    "ephemeris of one's own orbit": ("an orbit of one's own", ["--ephemeris", "kepler"]),
    "framework": ("as it is", ["--for", "vxworks"]),
    "law": ("a law that has no translation", []),
    "no steps": ("as it is", ["--steps", "0"]),
    "prefix of a header": ("as it is", ["--prefix", "stdio"]),
    "prefix that is no name": ("as it is", ["--prefix", "9x"]),
    "single precision": ("a parameter that no float holds", ["--real", "float"]),
}


def asked(case: str, folder: Path, out: Path) -> list[str]:
    """The command of a case, with the files that it reads."""
    files, options = REFUSED[case]
    name, file, text, other = CHANGED[files]
    for each in (f"{name}.toml", f"{name}.py"):
        shutil.copy(EXAMPLES / each, folder / each)
    before = (folder / file).read_text()
    assert text in before
    (folder / file).write_text(before.replace(text, other, 1) if text else before)
    return ["export", "c", str(folder / f"{name}.toml"), "--out", str(out), *options]


def seen(folder: Path) -> dict[str, bytes]:
    return {str(p): p.read_bytes() if p.is_file() else b"" for p in folder.rglob("*")}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_refused_leaves_no_folder(case, tmp_path, capsys):
    command = asked(case, tmp_path, tmp_path / "new" / "out")
    assert answer(command) == 2
    assert capsys.readouterr().err.startswith("error: ")
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_refused_changes_nothing_in_a_folder(case, tmp_path, capsys):
    out = tmp_path / "out"
    out.mkdir()
    for name in ("adcs.h", "adcs_ephemeris.c", "notes.txt"):
        (out / name).write_text("mine")
    before = seen(out)
    assert answer(asked(case, tmp_path, out)) == 2
    assert seen(out) == before


def test_a_folder_that_cannot_be_written_is_told_before_any_work(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    command = ["export", "c", str(EXAMPLES / "my_law.toml"), "--out", str(tmp_path / "file/a/b")]
    assert answer(command) == 2
    error = capsys.readouterr().err
    assert error.startswith("error: --out: must be a folder that can be written; received ")
    assert [each.name for each in tmp_path.iterdir()] == ["file"]
