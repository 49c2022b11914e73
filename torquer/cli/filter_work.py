"""Work of `filter-check`: statistics of a filter over many runs, and the verdict."""

import math
from pathlib import Path

from torquer.analysis.filter_check import check_filter
from torquer.cli.output import json_text
from torquer.cli.user_code import check_code
from torquer.scenario.load import load_scenario


def check(
    scenario_path: Path,
    runs: int,
    as_json: bool,
    user_code: bool = True,
    code_from_anywhere: bool = False,
) -> int:
    """Print the statistics; 1 if the filter is not consistent."""
    scenario = load_scenario(scenario_path)
    check_code(scenario, scenario_path, user_code, code_from_anywhere)
    if runs < 2:
        raise ValueError(f"--runs: must be 2 or more; received {runs}")
    found = check_filter(scenario, runs)
    print(json_text(found, None) if as_json else "\n".join(in_words(found)))
    return 0 if found["consistent"] else 1


def in_words(found: dict) -> list[str]:
    """The statistics, line by line."""
    lines = [f"{found['scenario']}: {found['estimator']}, {found['runs']} runs"]
    for each in found["checks"]:
        inside = "" if math.isnan(each["inside"]) else f", {each['inside']:.0%} of instants inside"
        lines.append(
            f"{'ok  ' if each['passed'] else 'FAIL'} {each['name']}: {each['value']:.3f} "
            f"(band {each['low']:.3f} to {each['high']:.3f}{inside})"
        )
    lines.append(
        f"error about each axis {found['error_deg']:.3g} deg rms, stated {found['sigma_deg']:.3g}; "
        f"whole error below {found['error_95_deg']:.3g} deg in 95 %"
    )
    return [*lines, "consistent" if found["consistent"] else "not consistent"]
