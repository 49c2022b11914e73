"""Which gain for B-dot? The case from a scenario, theory, and flights with gains around it."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from torquer.analysis.notes.bdot_notes import BDOT, as_tumbling, law_sampling, most_gain
from torquer.base.limits import RequestError
from torquer.design.detumble_failure import explain_stop, fails
from torquer.design.gain_flights import Releases, fly_gains
from torquer.design.gain_sweep import ANY, SAFE, GainSweep, Raised, Wanted
from torquer.design.requests import DetumbleRequest
from torquer.design.residual_rate import LAST_REVOLUTIONS, clear_limit, limits_from
from torquer.scenario.mission import ORBITAL_RATES
from torquer.scenario.spec import Scenario
from torquer.theory.slow.detumbling import Tumbling, knee_gain, turning_gain
from torquer.theory.slow.gains import Sampling

#: Revolutions flown without a limit of time: at least, theory's times to stop, at most.
_LEAST, _TIMES, _MOST = 10.0, 4.0, 60.0
#: Gains flown reach from the theory's over this factor to the theory's times it.
_FACTOR = 10.0
#: Logarithm of the ratio of two gains that are one in a table of three digits, and in flight.
_SAME = 0.01


def detumble(
    scenario: Scenario,
    request: DetumbleRequest = DetumbleRequest(),
    progress: Callable[[int, int], None] | None = None,
) -> GainSweep:
    """Which gain for B-dot? By theory with saturation, sampling and lag, then flown.

        sweep = detumble(torquer.load_scenario("my_satellite.toml"), DetumbleRequest(runs=8))
        sweep.chosen.gain           # A m^2 s/T
        sweep.with_gain()           # the scenario with that gain
        torquer.plot(sweep)

    The same releases are flown with each gain, among them the scenario's own. With `within_s` the
    least gain is chosen with which most stop in time; without it the least with which most stop,
    nine in ten of them at most 10 % later than with any other. Where no rate that counts as stopped
    is given and three orbital rates lie within the motion that remains with every gain, the flights
    are counted with the least limit that is half as much again above it: `sweep.raised`. Where the
    gain chosen leaves more than a tenth tumbling, `sweep.failure` says why, by flights.

    `progress`: called with flights done and in total. ValueError for a scenario without coils, with
    modes, or with another law; RequestError for a rate that B-dot cannot brake.
    """
    case = without_flights(scenario, request)
    law = case.law or ANY
    laws = [
        law.model_copy(update={"gain_a_m2_s_per_t": each}).law()
        for each in gains_flown(case, request.gains)
    ]
    releases = Releases(math.degrees(case.wanted.tip_off_rad_s), request.runs, request.times)
    limits = limits_from(math.degrees(case.wanted.below_rad_s), releases.rate_deg_s)
    flights = fly_gains(
        scenario, laws, releases, limits, case.revolutions, LAST_REVOLUTIONS, progress
    )
    swept = _above_residual(replace(case, flights=tuple(flights)), limits)
    if not fails(swept):
        return swept
    asked = replace(request, rate_below_deg_s=swept.below_deg_s)

    def theory_gain(changed: Scenario) -> float:
        return without_flights(changed, asked).theory_gain

    return replace(swept, failure=explain_stop(swept, theory_gain))


def gains_flown(case: GainSweep, count: int) -> list[float]:
    """Gains [A m^2 s/T] in order: the scenario's own, that of theory, and `count` around it.

    Of gains so near to each other that they show the same one is left: the own before others.
    """
    own, gain = case.law, case.theory_gain
    most = min(gain * _FACTOR, case.most_gain)
    kept = [] if own is None else [own.gain_a_m2_s_per_t]
    for each in (gain, *np.geomspace(gain / _FACTOR, most, count).tolist()):
        if all(abs(math.log(each / other)) > _SAME for other in kept):
            kept.append(float(f"{each:.4g}"))
    return sorted(kept)


def _above_residual(case: GainSweep, limits: list[float]) -> GainSweep:
    """The case with a limit above the motion that remains, if it lies within; a given one stays."""
    residual = case.common_residual()
    if residual is None or case.wanted.is_given:
        return case
    limit = clear_limit(residual, limits)
    if limit is None:
        return case
    wanted = case.wanted._replace(below_rad_s=math.radians(limit))
    flights = tuple(each.with_limit(limit) for each in case.flights)
    return replace(case, wanted=wanted, flights=flights, raised=Raised(limits[0], residual))


def without_flights(scenario: Scenario, request: DetumbleRequest) -> GainSweep:
    """What theory says of a scenario: `theory_gain`, `theory_s(gain)`; nothing is flown."""
    own, wanted = _bdot_law(scenario), _choose_gain(scenario, request)
    sampling = law_sampling(scenario, own or ANY)
    _check_rate(wanted, sampling)
    tumbling = as_tumbling(scenario, own or ANY)
    most = most_gain(scenario, sampling, float(tumbling.fields_t.max()))
    turning = _turning_gain(scenario, tumbling)
    gain = min(knee_gain(tumbling, *wanted[:2]), turning, SAFE * most)
    case = GainSweep(scenario, own, wanted, tumbling, sampling, gain, most, turning, 1.0)
    return replace(case, revolutions=_revolutions(case))


def _check_rate(wanted: Wanted, sampling: Sampling) -> None:
    limit = sampling.limit_rad_s
    if wanted.tip_off_rad_s >= limit:
        raise RequestError(
            "tip_off_deg_s",
            f"must be below {math.degrees(limit):.3g} deg/s, the greatest rate that B-dot brakes "
            f"with {sampling.in_words}; received {math.degrees(wanted.tip_off_rad_s):.3g}",
        )


def _turning_gain(scenario: Scenario, tumbling: Tumbling) -> float:
    r, v = (x[0] for x in scenario.orbit_environment().state(np.zeros(1)))
    normal = np.cross(r, v)
    inclination = math.acos(normal[2] / np.linalg.norm(normal))
    least = float(scenario.spacecraft.body.principal()[0][0])
    field_t = math.sqrt(np.mean(tumbling.fields_t**2))
    rate = scenario.orbit.rate_rad_s(scenario.start)
    return turning_gain(least, field_t, rate, inclination, tumbling.duty)


def _bdot_law(scenario: Scenario):
    """The scenario's law if it is of B-dot's kind; None if it has none."""
    laws, modes = scenario.control.named()
    specs = list(laws.values())
    if scenario.spacecraft.coils is None:
        raise ValueError("spacecraft.coils: must be given; received none")
    if modes is not None or len(specs) > 1:
        raise ValueError("control: must have one law, without modes or stages; received more")
    if not specs or specs[0].kind == "off":
        return None
    if not isinstance(specs[0], BDOT):
        raise ValueError(f"control.law.kind: must be bdot or one like it; received {specs[0].kind}")
    return specs[0]


def _choose_gain(scenario: Scenario, request: DetumbleRequest) -> Wanted:
    mission, orbital = scenario.mission, scenario.orbit.rate_rad_s(scenario.start)
    tip_off = request.tip_off_deg_s or float(np.linalg.norm(scenario.initial.rate_deg_s))
    below = request.rate_below_deg_s or (mission and mission.rate_below_deg_s)
    is_given, below = bool(below), below or math.degrees(ORBITAL_RATES * orbital)
    if tip_off <= below:
        raise RequestError(
            "tip_off_deg_s",
            f"must be above {below:.3g} deg/s, the rate that counts as stopped; received "
            f"{tip_off:.3g}",
        )
    within_s = request.within_s or (mission.within_s if mission else None)
    return Wanted(math.radians(tip_off), math.radians(below), within_s, is_given)


def _revolutions(case: GainSweep) -> float:
    """Revolutions flown: beyond the time allowed, to see that the rate stays low."""
    period_s = 2.0 * math.pi / case.scenario.orbit.rate_rad_s(case.scenario.start)
    if case.wanted.within_s is not None:
        return float(math.ceil(case.wanted.within_s / period_s) + 2)
    needed = _TIMES * case.theory_s(case.theory_gain) / period_s
    return float(math.ceil(min(max(_LEAST, needed), _MOST)))
