"""Files that would take all memory or time are refused before they are parsed."""

import pytest

from torquer.base import text_files as file_limits
from torquer.scenario import load
from torquer.scenario.load import ScenarioError, load_scenario, parse_toml

DEEP = [
    "a" + ".a" * 20_000 + " = 1",
    "[" + "a." * 20_000 + "a]",
    '"a"' + " . 'a'" * 20_000 + " = 1",
    "{" + "a." * 1_000_000,
]


@pytest.mark.parametrize("text", DEEP)
def test_a_key_of_thousands_of_parts_is_not_parsed(text, monkeypatch, tmp_path):
    monkeypatch.setattr(load, "tomllib", None)
    with pytest.raises(ScenarioError, match=r"^scenario: must have at most 32 levels of tables "):
        parse_toml(text, "scenario")
    path = tmp_path / "deep.toml"
    path.write_text(text)
    with pytest.raises(ScenarioError, match="at most 32 levels"):
        load_scenario(path)


def test_a_key_of_as_many_parts_as_levels_is_parsed():
    key = "a." * (file_limits.LEVELS - 1) + "a"
    assert (
        len(str(parse_toml(f"{key} = 1  # {'not.a.key. ' * 3}", "scenario")))
        > 2 * file_limits.LEVELS
    )


def test_file_of_any_size_is_read_up_to_limit(tmp_path, monkeypatch):
    monkeypatch.setattr(file_limits, "MOST_BYTES", 2_000_000)
    path = tmp_path / "long.toml"
    path.write_bytes(b"#" * 2_000_000)
    with pytest.raises(ScenarioError, match="must be given; received nothing"):
        load_scenario(path)
    path.write_bytes(b"#" * 2_000_001)
    message = rf"^scenario: must be a readable file; received {path} \(more than 2 MB\)$"
    with pytest.raises(ScenarioError, match=message):
        load_scenario(path)
