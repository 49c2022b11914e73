"""B-dot flown with several gains from the same releases: how long, how much energy, which gain."""

import math
from collections.abc import Callable, Sequence
from datetime import timedelta
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from torquer.campaign.capture import flight
from torquer.campaign.checks import column as check
from torquer.campaign.fly import fly_campaign
from torquer.campaign.spec import Campaign
from torquer.campaign.statistics import quantile
from torquer.computer.blocks.law import Law
from torquer.scenario.spec import Scenario

_DAY_S = 86400.0
#: Longest step of RK4 [s], and greatest rotation in one [rad].
_LONGEST_S, _TURN = 2.0, 0.3
#: A settling time this much above the least of all gains is no disadvantage.
KNEE = 1.1


class Releases(NamedTuple):
    """Releases at one rate about random axes and from random attitudes; `runs` of them at each of
    `times` that divide a day evenly, so that orbit and Earth's rotation differ."""

    rate_deg_s: float
    runs: int
    times: int


class Stops(NamedTuple):
    """When releases came below a limit [deg/s]: first, and to stay to the end; else infinite."""

    below_deg_s: float
    first_s: np.ndarray
    settled_s: np.ndarray


class GainFlights(NamedTuple):
    """Flights with one gain [A m^2 s/T], one row per release.

    `first_s`, `settled_s`: time at which the rate is first below the limit, and from which it stays
    below it to the end, infinite if it does not; `energy_j` of the coils; `peak_a_m2`: greatest
    dipole of a coil; `late_deg_s`, `mean_late_deg_s`: greatest and mean rate in the last
    revolutions. `stops`: the same times for the limit and others. `damping`, `lag_deg`: what the
    steps of RK4 did by themselves, the most of all releases.
    """

    gain: float
    first_s: np.ndarray
    settled_s: np.ndarray
    energy_j: np.ndarray
    peak_a_m2: np.ndarray
    late_deg_s: np.ndarray
    mean_late_deg_s: np.ndarray
    stops: tuple[Stops, ...] = ()
    damping: float = 0.0
    lag_deg: float = 0.0

    def with_limit(self, below_deg_s: float) -> "GainFlights":
        """The same flights with another of the limits that were counted."""
        found = next(each for each in self.stops if each.below_deg_s == below_deg_s)
        return self._replace(first_s=found.first_s, settled_s=found.settled_s)

    def settled_within(self, within_s: float) -> int:
        """Number of releases settled by a time."""
        settled = np.isfinite(self.settled_s) & (self.settled_s <= within_s)
        return int(np.count_nonzero(settled))

    def settled_by(self, part: float) -> float:
        """Time [s] by which a fraction of all releases has settled; infinite if fewer do."""
        return quantile(self.settled_s, part)

    def first_by(self, part: float) -> float:
        """Time [s] by which a fraction of all releases was once below the limit, or infinite."""
        return quantile(self.first_s, part)


def fly_gains(
    scenario: Scenario,
    laws: Sequence[Law],
    releases: Releases,
    below_deg_s: Sequence[float],
    revolutions: float,
    last_revolutions: float,
    progress: Callable[[int, int], None] | None = None,
    seed: int = 1,
) -> list[GainFlights]:
    """Fly laws of B-dot's kind from the same releases, with fixed steps and without an estimator.

    `below_deg_s`: the rate that counts as stopped, then others; `last_revolutions`: the time over
    which the rate that remains is taken; `progress`: called with flights done and in total; `seed`
    of the first time, from which those of the others count.
    """
    period_s = 2.0 * math.pi / scenario.orbit.rate_rad_s(scenario.start)
    step_s = _step_s(scenario, math.radians(releases.rate_deg_s))
    simulation = {"revolutions": revolutions, "step_s": step_s, "record_s": step_s}
    scenario = scenario.replace("simulation", simulation)
    late_s = (revolutions - last_revolutions) * period_s
    campaign, total = _campaign(releases, below_deg_s, late_s), len(laws) * releases.times
    flown: list[GainFlights] = []
    for law in laws:
        parts = []
        for k in range(releases.times):
            later = timedelta(seconds=k * _DAY_S / releases.times)
            member = flight(scenario, law, revolutions, period_s).replace(
                "start", scenario.start + later
            )
            seeded = campaign.model_copy(update={"seed": seed + k})
            parts.append(fly_campaign(member, seeded))
            if progress:
                done = len(flown) * releases.times + len(parts)
                progress(done * releases.runs, total * releases.runs)
        flown.append(_join(law.values()["gain"], below_deg_s, parts))
    return flown


def _step_s(scenario: Scenario, rate_rad_s: float) -> float:
    """The scenario's fixed step [s], or a part of its control step that follows the rotation."""
    sample_s = scenario.control.sample_s
    longest = min(_LONGEST_S, _TURN / rate_rad_s)
    return scenario.simulation.step_s or sample_s / math.ceil(sample_s / longest)


def _campaign(releases: Releases, below_deg_s: Sequence[float], late_s: float) -> Campaign:
    rate = releases.rate_deg_s
    vary = {
        "initial.attitude": "uniform",
        "initial.rate_deg_s": {"direction": "uniform", "magnitude": {"uniform": [rate, rate]}},
    }
    outcomes = {
        "late_deg_s": {"signal": "rate_deg_s", "what": {"greatest_after_s": late_s}},
        "mean_late_deg_s": {"signal": "rate_deg_s", "what": {"mean_after_s": late_s}},
        "energy_j": {"signal": "coil_energy_j"},
        "peak_a_m2": {"signal": "peak_dipole_a_m2"},
    }
    for k, limit in enumerate(below_deg_s):
        outcomes |= {
            f"first_{k}_s": {"signal": "rate_deg_s", "what": {"first_below": limit}},
            f"settled_{k}_s": {"signal": "rate_deg_s", "what": {"settles_below": limit}},
        }
    return Campaign.model_validate({"runs": releases.runs, "vary": vary, "outcomes": outcomes})


def _join(gain: float, below_deg_s: Sequence[float], parts) -> GainFlights:
    def column(name: str) -> np.ndarray:
        return np.concatenate([part[name].values for part in parts])

    def time(name: str) -> np.ndarray:
        found = column(name)
        return np.where(np.isnan(found), np.inf, found)

    stops = tuple(
        Stops(limit, time(f"first_{k}_s"), time(f"settled_{k}_s"))
        for k, limit in enumerate(below_deg_s)
    )
    names = ("energy_j", "peak_a_m2", "late_deg_s", "mean_late_deg_s")
    steps = [float(column(check(name)).max()) for name in ("rk4_damping", "rk4_lag_deg")]
    return GainFlights._make([gain, *stops[0][1:], *map(column, names), stops, *steps])


def usable_flights(flights: Sequence[GainFlights], most: float) -> list[GainFlights]:
    """Those with gains up to `most`, in order; with the least gain if there are none."""
    ordered = sorted(flights, key=attrgetter("gain"))
    return [each for each in ordered if each.gain <= most] or ordered[:1]


def choose(flights: Sequence[GainFlights], within_s: float | None, most: float) -> GainFlights:
    """The least gain that does best, of those up to `most` (the least of all, if none is).

    With `within_s`: as many releases settle by then as with any gain. Without it: as many settle as
    with any gain, and nine in ten of these by at most `KNEE` times the least time of such gains.
    """
    usable = usable_flights(flights, most)
    within = math.inf if within_s is None else within_s
    greatest = max(each.settled_within(within) for each in usable)
    best = [each for each in usable if each.settled_within(within) == greatest]
    if within_s is not None:
        return best[0]
    times = [_nine_in_ten(each) for each in best]
    return next(each for each, t in zip(best, times, strict=True) if t <= KNEE * min(times))


def _nine_in_ten(each: GainFlights) -> float:
    """Time by which nine in ten of the releases that settle have settled; infinite if none does."""
    arrived = each.settled_s[np.isfinite(each.settled_s)]
    return quantile(arrived, 0.9) if len(arrived) else math.inf
