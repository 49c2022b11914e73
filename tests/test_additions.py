"""The table 'to add X, touch these files' of ARCHITECTURE.md tells the truth.

For each X one that is there: how many files of the package name it? `test_added.py` adds new ones.
"""

import re
from pathlib import Path

import pytest
from made_code import MADE

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "torquer"
#: How files name what each row is counted by.
NAMED = {
    "law": r"panel_tracking|PanelTracking",
    "estimator": r"rate_from_field|RateFromField",
    "sensor": r"fine_sun|FineSun|FINE_SUN|sun_tangents",
    "disturbance torque": r"eddy_current|EddyCurrents",
    "telecommand": r"shift_clock",
    "report panel": r"speeds_or_shares",
    "scenario key": r"co_rotating_atmosphere",
    "signal": r"momentum_rate",
    "command option": r"check_steps|check-steps",
    "field model": r"helmholtz_coils|HelmholtzCoils",
    "orbit": r"\"bench\"|orbit\.bench|\bBench\b",
    "command": r"def completion|\"completion\"|torquer completion",
}
#: Files that name things for other reasons: made, or examples of what can be chosen.
ASIDE = ("stored_tables.json", "presets")
ROW = re.compile(r"^\| ([a-z ]+) \| (\d+) \| `[^`]+`(?: \((\d+)\))? \|", re.MULTILINE)


def files_that_name(pattern: str) -> list[str]:
    """Files of the package whose text has the pattern."""
    endings = {".py", ".toml", ".json"}
    files = (path for path in PACKAGE.rglob("*") if path.suffix in endings)
    return sorted(
        path.relative_to(PACKAGE).as_posix()
        for path in files
        if path.relative_to(ROOT).as_posix() not in MADE
        and not set(ASIDE) & {*path.relative_to(PACKAGE).parts}
        and re.search(pattern, path.read_text(encoding="utf-8"))
    )


def table() -> dict[str, tuple[int, int]]:
    """By what is added: files to touch, files that name the one that is there."""
    text = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8").partition("## To add X")[2]
    return {name: (int(few), int(named or few)) for name, few, named in ROW.findall(text)}


def test_each_row_of_the_table_is_counted():
    assert table().keys() == NAMED.keys()


@pytest.mark.parametrize("addition", NAMED)
def test_one_that_is_there_is_named_by_as_many_files_as_the_table_says(addition):
    found = files_that_name(NAMED[addition])
    assert len(found) == table()[addition][1], found


def test_a_row_that_nothing_has_is_noticed():
    assert files_that_name(r"no_such_law|NoSuchLaw") == []
