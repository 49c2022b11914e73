"""The table 'to add X, touch these files' of ARCHITECTURE.md tells the truth.

For each X one that is there: how many files of the package name it?
"""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "torquer"
#: How files name what each row is counted by.
NAMED = {
    "law": r"panel_tracking|PanelTracking",
    "estimator": r"rate_from_field|RateFromField",
    "sensor": r"horizon_sensor|HorizonSensor|HORIZON|nadir_[a-z]+|_nadir|\"horizon\"|sun, nadir",
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
#: Files that name things for other reasons: generated, or examples of what can be chosen.
ASIDE = ("stored_tables.json", "presets")


def files_that_name(pattern: str) -> list[str]:
    """Files of the package whose text has the pattern."""
    endings = {".py", ".toml", ".json"}
    files = (path for path in PACKAGE.rglob("*") if path.suffix in endings)
    return sorted(
        path.relative_to(PACKAGE).as_posix()
        for path in files
        if not set(ASIDE) & {*path.relative_to(PACKAGE).parts}
        and re.search(pattern, path.read_text(encoding="utf-8"))
    )


def rows() -> dict[str, int]:
    """The table: files to touch, by what is added."""
    text = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8").partition("## To add X")[2]
    return {
        name: int(number) for name, number in re.findall(r"^\| ([a-z ]+) \| (\d+) \|", text, re.M)
    }


def test_each_row_of_the_table_is_counted():
    assert rows().keys() == NAMED.keys()


@pytest.mark.parametrize("addition", NAMED)
def test_an_addition_touches_as_many_files_as_the_table_says(addition):
    found = files_that_name(NAMED[addition])
    assert len(found) == rows()[addition], found


def test_a_row_that_nothing_has_is_noticed():
    assert files_that_name(r"no_such_law|NoSuchLaw") == []
