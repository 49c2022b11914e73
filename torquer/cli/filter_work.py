"""Work of `filter-check`: statistics of a filter over many runs, or its expected accuracy."""

import math
from pathlib import Path

import numpy as np

from torquer.analysis.filter_check import FilterCheck, as_plain, check_filter
from torquer.analysis.observability import Observability
from torquer.analysis.sensor_sets import (
    REACHED_DEG,
    SensorSet,
    as_plain as sets_as_plain,
    sensor_sets,
)
from torquer.cli.output import json_text, make_writable, table_console, writing_to
from torquer.cli.simulate import check_surroundings, progress_of
from torquer.cli.user_code import check_code
from torquer.scenario.load import load_scenario
from torquer.scenario.spec import Scenario

_RUNS = 200
_WIDTH = 120


def check(
    path: Path,
    runs: int | None,
    out: Path | None,
    as_json: bool,
    user_code: bool = True,
    code_from_anywhere: bool = False,
) -> int:
    """Print the statistics, draw them into a folder; 1 if the filter is not consistent."""
    scenario = _loaded(path, out, user_code, code_from_anywhere)
    runs = _RUNS if runs is None else runs
    if runs < 2:
        raise ValueError(f"--runs: must be 2 or more; received {runs}")
    with progress_of(scenario.name) as progress:
        found = check_filter(scenario, runs, progress)
    if out is not None:
        from torquer.report.filter import write_filter_report

        with writing_to(out):
            write_filter_report(found, out)
    print(json_text(as_plain(found), None) if as_json else "\n".join(in_words(found)))
    if out is not None and not as_json:
        print(out / "report.html")
    return 0 if found.consistent else 1


def expect(
    path: Path,
    runs: int | None,
    out: Path | None,
    as_json: bool,
    user_code: bool = True,
    code_from_anywhere: bool = False,
) -> int:
    """Print the expected accuracy of the scenario's filters, also with fewer sensors."""
    if runs is not None:
        raise ValueError(f"--runs: must be left out with --expected; received {runs}")
    scenario = _loaded(path, out, user_code, code_from_anywhere)
    sets = sensor_sets(scenario)
    if out is not None:
        from torquer.report.filter.expected import draw_expected

        with writing_to(out):
            draw_expected(sets, f"Expected accuracy: {scenario.name}", out / "expected.png")
    if as_json:
        print(json_text({"scenario": scenario.name, "sensor_sets": sets_as_plain(sets)}, None))
        return 0
    _show(scenario, sets)
    if out is not None:
        print(out / "expected.png")
    return 0


def _loaded(path: Path, out: Path | None, user_code: bool, code_from_anywhere: bool) -> Scenario:
    scenario = load_scenario(path)
    check_code(scenario, path, user_code, code_from_anywhere)
    check_surroundings(scenario)
    if out is not None:
        make_writable(out)
    return scenario


def in_words(found: FilterCheck) -> list[str]:
    """The statistics, line by line."""
    plain = as_plain(found)
    lines = [f"{plain['scenario']}: {plain['estimator']}, {plain['runs']} runs"]
    for each in found.checks:
        inside = "" if math.isnan(each.inside) else f", {each.inside:.0%} of instants inside"
        lines.append(
            f"{'ok  ' if each.passed else 'FAIL'} {each.name}: {each.value:.3f} "
            f"(band {each.low:.3f} to {each.high:.3f}{inside})"
        )
    lines.append(
        f"error per axis {plain['error_deg']:.3g} deg rms, stated "
        f"{plain['sigma_deg']:.3g}, expected by linear covariance {plain['expected_deg']:.3g}; "
        f"total error below {plain['error_95_deg']:.3g} deg in 95 % of cases"
    )
    return [*lines, "consistent" if found.consistent else "not consistent"]


def _show(scenario: Scenario, sets: list[SensorSet]) -> None:
    from rich.box import SIMPLE
    from rich.table import Table

    after = f"worst instant after {sets[0].settled_s / 60.0:.0f} min"
    title = f"{scenario.name}: 95th percentile of the attitude error, {after}"
    table = Table(title=title, title_justify="left", box=SIMPLE)
    head = ("sensors", "Sun seen", "no Sun seen", f"below {REACHED_DEG:g} deg after", "gaps", "of")
    for k, name in enumerate(head):
        table.add_column(name, justify="right" if 0 < k < 5 else "left", no_wrap=True)
    for each in sets:
        reached = f"{each.reached_s / 60.0:.0f} min" if math.isfinite(each.reached_s) else "never"
        cells = (_degrees(each.light_deg), _degrees(each.dark_deg), reached)
        table.add_row(each.name, *cells, *gaps_in_words(each.observability))
    table_console(_WIDTH).print(table)
    seen = sets[0].observability
    window_min = (seen.to_s[0] - seen.from_s[0]) / 60.0
    print(
        f"gaps: share of windows of {window_min:.1f} min whose readings leave some combination of "
        "states as unknown as it was at the start; of: the states that dominate it"
    )


def _degrees(value: float) -> str:
    """An angle; NaN (no such instant) as "-", 45 deg or more as "unknown"."""
    if not math.isfinite(value):
        return "-"
    return f"{value:.2g} deg" if value < 45.0 else "unknown"


def gaps_in_words(seen: Observability) -> tuple[str, str]:
    """Share of the windows that are gaps, and the states that most of them leave unknown."""
    gaps = np.flatnonzero(seen.gaps)
    if not len(gaps):
        return "none", ""
    states = [seen.weakest_state(int(k)) for k in gaps]
    most = max(dict.fromkeys(states), key=states.count)
    return f"{len(gaps) / len(seen.gaps):.0%}", most
