"""What the statistics of a filter mean, in words."""

import math
from typing import NamedTuple

import numpy as np

from torquer.analysis.filters.filter_statistics import FilterRuns
from torquer.computer.estimation.filter import Filter
from torquer.computer.estimation.starts import NOT_STARTED, ONE_SENSOR

#: The filter's log of why it has not started, and the reasons by their numbers there.
WHY_NOT_STARTED = "not_started"
REASONS = dict(enumerate(NOT_STARTED))
#: What a filter needs to start, by its sensors: said where it gives no reason of its own.
_NEEDS = {
    ("magnetometer",): "it needs a reading of the field",
    ("sun",): REASONS[int(ONE_SENSOR)],
    ("magnetometer", "sun"): "it needs a reading of the field and one of the Sun, in different "
    "directions",
}
_NEEDS_ATTITUDE = "it needs a reading of the star tracker, or of two directions"
#: Names of the statistics of errors, and of the readings rejected; the others are of innovations.
OF_ERRORS = ("NEES of the attitude", "NEES of all states")
REJECTED = "readings rejected in a run"


class Check(NamedTuple):
    """A statistic of a filter, and whether it is that of a consistent filter."""

    name: str
    value: float
    low: float
    high: float
    inside: float
    passed: bool


class Verdict(NamedTuple):
    """A verdict on a filter: one of the words below, and the whole of it in a line.

    'consistent'; 'optimistic' or 'conservative': errors larger or smaller than stated; 'does not
    know': errors as stated, but so large that the attitude is not known; 'never started'; 'not
    consistent': anything else.
    """

    word: str
    text: str


def judge_filter(spec: Filter, flown: FilterRuns, checks: list[Check]) -> Verdict:
    """The verdict on a filter; the most severe comes first."""
    silent = int(np.count_nonzero(~flown.started))
    if silent == len(flown.started):
        return Verdict("never started", f"never started: {why_not_started(spec, flown)}")
    errors = [check for check in checks if check.name in OF_ERRORS]
    worst = max(errors, key=lambda check: check.value / check.high)
    if worst.value > worst.high:
        return Verdict("optimistic", _optimistic(worst))
    sigma_deg = stated_deg(flown)
    if sigma_deg > spec.lost_sigma_deg:
        return Verdict(
            "does not know", f"does not know the attitude: states {sigma_deg:.3g} deg, of all axes "
            f"together, in half of the cases (lost_sigma_deg is {spec.lost_sigma_deg:g})",
        )  # fmt: skip
    if silent:
        return Verdict(
            "never started", f"never started in {silent} of {len(flown.started)} runs: "
            f"{why_not_started(spec, flown)}",
        )  # fmt: skip
    least = min(errors, key=lambda check: check.value / check.low)
    if least.value < least.low:
        share = math.sqrt(least.value)
        return Verdict("conservative", f"conservative: errors are {share:.2g} times what it states")
    if failed := [check for check in checks if not check.passed]:
        return Verdict("not consistent", f"not consistent: {_in_words(failed)}")
    return Verdict("consistent", f"consistent{unseen(len(flown.started))}")


def unseen(runs: int) -> str:
    """How rare a failure may be and still be missed by this many runs, with a chance of 5 %."""
    percent = 100.0 * (1.0 - 0.05 ** (1.0 / runs))
    return (
        f"; what goes wrong in less than {percent:.2g}% of the flights may not show in {runs} runs"
    )


def _optimistic(check: Check) -> str:
    what = "of the attitude" if check.name == OF_ERRORS[0] else "of the states"
    return (
        f"optimistic: errors {what} are {math.sqrt(check.value):.3g} times as large as it states "
        "(root mean square)"
    )


def _in_words(failed: list[Check]) -> str:
    """What the statistics that failed say, the errors being as stated on average."""
    said = []
    for check in failed:
        if check.name in OF_ERRORS:
            said.append(f"{check.name} in its band at {check.inside:.0%} of instants only")
        elif check.name == REJECTED:
            said.append(f"{check.value:.3g} {REJECTED}, of which {check.high:.2g} may be chance")
        elif check.name.startswith("NIS of the "):
            sensor = check.name.removeprefix("NIS of the ")
            factor = math.sqrt(check.value)
            said.append(f"innovations of the {sensor} are {factor:.3g} times what it predicts")
        else:
            sensor = check.name.removeprefix("correlation of the ")
            said.append(f"innovations of the {sensor} are correlated in time, {check.value:.2g}")
    return "; ".join(said)


def stated_deg(flown: FilterRuns) -> float:
    """Median over runs and instants, without the first tenth of the time, of what is stated.

    Standard deviation [deg] of the attitude, of all axes together.
    """
    later = flown.t_s >= 0.1 * flown.t_s[-1]
    total = np.einsum("rkii->rk", flown.covariance[:, later, :3, :3])
    return float(np.degrees(np.sqrt(np.nanmedian(total))))


def why_not_started(spec: Filter, flown: FilterRuns) -> str:
    """Why the filter has not started in some runs: the reasons logged last, or what it needs."""
    last = flown.why_not_started[~flown.started, -1].astype(int)
    numbers = sorted({int(number) for number in last if number})
    if not numbers:
        return _NEEDS.get(tuple(sorted(spec.sensors)), _NEEDS_ATTITUDE)
    return "; ".join(REASONS.get(number, f"reason {number}") for number in numbers)
