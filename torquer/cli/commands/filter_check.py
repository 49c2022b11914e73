"""`torquer filter-check`: statistics of a filter over many runs, or its expected accuracy."""

import math
from pathlib import Path
from typing import Annotated

from torquer.base.language import message
from torquer.base.limits import at_least
from torquer.base.strict_json import json_text
from torquer.cli.compiling import show_progress
from torquer.cli.loading import check_computer, load_usable, note_whole_flights
from torquer.cli.options import CodeOptions, Json, option, options
from torquer.cli.output import say, table, table_console, writing_to

_RUNS = 200
_WIDTH = 120


@options
class FilterOptions:
    """Options of `torquer filter-check`."""

    runs: int | None = None
    """Number of runs [200]."""
    attitude_sigma_deg: Annotated[float | None, at_least(0.0)] = None
    """Spread of the initial attitude about SCENARIO's, each axis; 180: any attitude [any; 5 if it
    is relative to the orbital frame].
    """
    rate_sigma_deg_s: Annotated[float | None, at_least(0.0)] = None
    """Spread of the initial rate about SCENARIO's, each axis [the orbital rate, or a tenth of
    SCENARIO's rate].
    """
    expected: bool = False
    """Predict the accuracy, without simulating."""
    computer: Path | None = None
    """Fly the computer in C that `export c` wrote in this folder, or a library built from it."""
    out: Path | None = None
    """Folder for report, page.pdf and pictures."""
    json: Json = False


def filter_check(
    scenario: Path, *, how: FilterOptions = FilterOptions(), code: CodeOptions = CodeOptions()
) -> int:
    """Check the Kalman filter of SCENARIO: its errors over many runs against its own covariance.

    Each run draws noise, start, and errors of the sensors. NEES, NIS and whiteness with their
    chi-square bands; errors compared with linear covariance analysis; readings rejected, restarts;
    a verdict. Exit code 1 unless it is 'consistent'. With --expected, without simulating: the
    accuracy with and without the Sun in view, and gaps in observability, for the sensors of each
    filter and for each sensor alone.
    """
    from torquer.analysis.filters.filter_check import as_plain, check_filter
    from torquer.analysis.filters.filter_members import Start

    if how.expected:
        return _expect(scenario, how, code)
    check_computer(how.computer, code)
    flown = load_usable(scenario, code, how.out)
    note_whole_flights(flown)
    runs = _RUNS if how.runs is None else how.runs
    with show_progress(flown.name) as progress:
        start = Start(how.attitude_sigma_deg, how.rate_sigma_deg_s)
        found = check_filter(flown, runs, progress, start, how.computer)
    if how.out is not None:
        from torquer.report.filter import write_filter_report

        with writing_to(how.out):
            write_filter_report(found, how.out)
    if how.json:
        print(json_text(as_plain(found), None))
    else:
        say(*in_words(found))
    if how.out is not None and not how.json:
        say(how.out / "report.html")
    return 0 if found.consistent else 1


def _expect(path: Path, how: FilterOptions, code: CodeOptions) -> int:
    """Print the expected accuracy of the scenario's filters, also with fewer sensors."""
    from torquer.analysis.filters.sensor_sets import as_plain, sensor_sets

    for key in ("runs", "attitude_sigma_deg", "rate_sigma_deg_s"):
        if (value := getattr(how, key)) is not None:
            raise ValueError(f"{option(key)}: must be left out with --expected; received {value:g}")
    if how.computer is not None:
        raise ValueError(
            f"--computer: must be left out with --expected, which flies nothing; received "
            f"{how.computer}"
        )
    scenario = load_usable(path, code, how.out)
    sets = sensor_sets(scenario)
    if how.out is not None:
        from torquer.report.filter.pictures import draw_expected

        with writing_to(how.out):
            draw_expected(sets, f"Expected accuracy: {scenario.name}", how.out / "expected.png")
    if how.json:
        print(json_text({"scenario": scenario.name, "sensor_sets": as_plain(sets)}, None))
        return 0
    _show(scenario, sets)
    if how.out is not None:
        say(how.out / "expected.png")
    return 0


def in_words(found) -> list[str]:
    """The statistics of a `FilterCheck`, line by line."""
    from torquer.analysis.filters.filter_check import (
        as_plain,
        drawn_in_words,
        replaced_in_words,
        restarts_in_words,
    )

    plain = as_plain(found)
    lines = [
        f"{plain['scenario']}: {plain['estimator']}, {plain['runs']} runs",
        f"each run draws {drawn_in_words(found)}",
    ]
    if replaced := replaced_in_words(found):
        lines.append(f"not flown, as each run draws its own: the scenario's {replaced}")
    for each in found.checks:
        lines.append(_check_line(each))
    most, restarts = plain["rejected_most"], restarts_in_words(plain)
    lines.append(f"at most {most} readings rejected in a run; restarts: {restarts}")
    if math.isfinite(plain["error_deg"]):
        lines.append(
            f"error per axis {plain['error_deg']:.3g} deg rms, stated "
            f"{plain['sigma_deg']:.3g}, expected by linear covariance {plain['expected_deg']:.3g}; "
            f"total error below {plain['error_95_deg']:.3g} deg in 95 % of cases"
        )
    return [*lines, plain["verdict_text"], *(f"note: {note}" for note in plain["notes"])]


def _check_line(check) -> str:
    """A statistic and its band, with a mark whether it passed."""
    mark = message("ok") if check.passed else message("FAIL")
    numbers = {"value": check.value, "low": check.low, "high": check.high}
    if math.isnan(check.inside):
        return message(
            "{mark:<4} {name}: {value:.3f} (band {low:.3f} to {high:.3f})",
            mark=mark, name=check.name, **numbers,
        )  # fmt: skip
    return message(
        "{mark:<4} {name}: {value:.3f} (band {low:.3f} to {high:.3f}, "
        "{inside:.0%} of instants inside)",
        mark=mark, name=check.name, inside=check.inside, **numbers,
    )  # fmt: skip


def _show(scenario, sets: list) -> None:
    from torquer.analysis.filters.sensor_sets import REACHED_DEG
    from torquer.report.flight.budget_rows import models_in_words

    after = f"worst instant after {sets[0].settled_s / 60.0:.0f} min"
    title = f"{scenario.name}: 95th percentile of the attitude error, {after}"
    head: tuple[str, ...]
    head = ("sensors", "Sun seen", "no Sun seen", f"below {REACHED_DEG:g} deg after", "gaps", "of")
    rows: list[tuple[str, ...]] = [
        (each.name, _degrees(each.light_deg), _degrees(each.dark_deg), _time_reached(each),
         *gaps_in_words(each.observability))
        for each in sets
    ]  # fmt: skip
    models = scenario.model_errors()
    if models is not None:
        head = (*head[:3], "of models", *head[3:])
        rows = [
            (*row[:3], _degrees(each.systematic_deg), *row[3:])
            for each, row in zip(sets, rows, strict=True)
        ]
    table_console(_WIDTH).print(table(head, rows, title, left=(0, len(head) - 1)))
    if any(each.reached_s is None for each in sets):
        say("-: a start from a single direction is not linear; flights show how long it takes")
    seen = sets[0].observability
    window_min = (seen.to_s[0] - seen.from_s[0]) / 60.0
    say(
        f"gaps: share of windows of {window_min:.1f} min whose readings leave some combination of "
        "states as unknown as it was at the start; of: the states that dominate it"
    )
    if models is not None:
        say("of models: the greatest part that their errors cause, which filters do not state")
        say(models_in_words(models))


def _time_reached(each) -> str:
    if each.reached_s is None:
        return "-"
    return f"{each.reached_s / 60.0:.0f} min" if math.isfinite(each.reached_s) else "never"


def _degrees(value: float) -> str:
    """An angle; NaN (no such instant) as "-", 45 deg or more as "unknown"."""
    if not math.isfinite(value):
        return "-"
    return f"{value:.2g} deg" if value < 45.0 else "unknown"


def gaps_in_words(seen) -> tuple[str, str]:
    """Share of the windows that are gaps, and the states that most of them leave unknown."""
    gaps = [k for k, is_gap in enumerate(seen.gaps) if is_gap]
    if not gaps:
        return "none", ""
    states = [seen.weakest_state(k) for k in gaps]
    most = max(dict.fromkeys(states), key=states.count)
    return f"{len(gaps) / len(seen.gaps):.0%}", most
