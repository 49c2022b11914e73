"""What the author of a scenario with B-dot should know: what sampling and the coils' lag allow."""

import contextlib
import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from torquer.analysis.notes.uses import Use, notes_on_laws
from torquer.base.conventions import STRONG_FIELD_T
from torquer.computer.laws.bdot import Bdot, BdotDerivative, BdotModel, BdotRate
from torquer.computer.laws.nutation_damping import (
    NutationDamping,
    NutationDampingDerivative,
    NutationDampingRate,
)
from torquer.scenario.mission import ORBITAL_RATES
from torquer.scenario.resolution import momentum_at_start
from torquer.scenario.spec import Scenario
from torquer.theory.averaged.sampling import DIFFERENCES, law_sampling
from torquer.theory.slow.detumbling import (
    ABOVE_TURNING,
    EVENLY_BRAKED,
    Tumbling,
    detumbling_time_s,
    least_braked,
    mean_turning_rad_s,
)
from torquer.theory.slow.gains import (
    MOST_LAG,
    Sampling,
    bdot_gain,
    bdot_greatest_gain,
    damping_efficiency,
    driven_rate_rad_s,
    sampling_limit_rad_s,
)

#: From this part of the limit on little braking is left, and a body in nutation may have none: over
#: the directions normal to the momentum its mean vanishes at 0.87 of the limit at the earliest.
_NEAR = 0.85
#: The part of a dipole that may come back as a command by way of the magnetometer.
_HEARD = 0.05
_DAY_S = 86400.0
#: Places along the orbit at which the field is taken.
_FIELDS = 300
BDOT = (Bdot, BdotRate, BdotDerivative, BdotModel)
_NUTATION = (NutationDamping, NutationDampingRate, NutationDampingDerivative)


class _Turn(NamedTuple):
    """The rotation that a law has to damp: its rate [rad/s], and words for it."""

    rate_rad_s: float
    text: str
    law: str
    what: str


def bdot_notes(scenario: Scenario) -> list[str]:
    """Notes on the laws that damp rotation by the field's rate of change, one line each.

    Notes that depend on the initial rate are given only for the laws active at the start.
    """
    return [*notes_on_laws(scenario, _CHECKS)]


def _turn(scenario: Scenario, law) -> _Turn:
    """The initial absolute rate; for nutation damping the rate of precession, L/A."""
    omega = scenario.motion_at_start()[4:]
    if isinstance(law, BDOT):
        rate = float(np.linalg.norm(omega))
        return _Turn(rate, "the initial rate", "B-dot", "rotation")
    inertia, axis = np.array(scenario.spacecraft.body.inertia), np.array(law.axis)
    momentum = momentum_at_start(scenario.spacecraft, omega)
    transverse = 0.5 * (np.trace(inertia) - axis @ inertia @ axis)
    rate = float(np.linalg.norm(momentum) / transverse)
    return _Turn(rate, "the initial precession", "nutation damping", "nutation")


def _rate_notes(scenario: Scenario, use: Use) -> Iterator[str]:
    law = use.law
    if not (use.at_start and isinstance(law, BDOT + _NUTATION)):
        return
    sampling, turn = law_sampling(scenario, law), _turn(scenario, law)
    limit = sampling.limit_rad_s
    if turn.rate_rad_s > _NEAR * limit:
        side = "above" if turn.rate_rad_s > limit else "near"
        yield (
            f"{turn.text} of {math.degrees(turn.rate_rad_s):.3g} deg/s is {side} the "
            f"{math.degrees(limit):.3g} deg/s that {turn.law} can brake with {sampling.in_words}: "
            f"{_outcome(law, turn, sampling)}"
        )


def _outcome(law, turn: _Turn, sampling: Sampling) -> str:
    """What happens to a rotation near the limit or above it."""
    steady, times = isinstance(law, BDOT), sampling.times
    driven = driven_rate_rad_s(*times)
    if turn.rate_rad_s <= sampling_limit_rad_s(*times):
        left = damping_efficiency(turn.rate_rad_s, *times)
        text = f"{100.0 * left:.2g} % of its damping is left"
        return f"{text}, perhaps none for a nutating body" if steady else text
    if turn.rate_rad_s >= driven:
        return f"the law will not stop the {turn.what}"
    to = f", a steady one up to {math.degrees(driven):.3g} deg/s" if steady else ""
    return f"the law will drive the {turn.what}{to}"


def most_gain(scenario: Scenario, sampling: Sampling, field_t: float) -> float:
    """Gain of B-dot [A m^2 s/T] beyond which a hold overshoots in a field [T].

    Infinite where no bound is known: coils too slow to follow, readings not at control steps.
    """
    if sampling.lag_s > MOST_LAG * sampling.hold_s or not sampling.is_in_step:
        return math.inf
    least = float(scenario.spacecraft.body.principal()[0][0])
    return bdot_greatest_gain(
        least, field_t, sampling.hold_s, difference_s=sampling.difference_s,
        lag_s=sampling.lag_s, measure_s=sampling.measure_s,
    )  # fmt: skip


def as_tumbling(scenario: Scenario, law) -> Tumbling:
    """The scenario's satellite as theory of B-dot takes it, with the fields of a day of its orbit.

    Of an orbit whose models end earlier, or that decays, the fields of one revolution or, if it has
    none left, of the run.
    """
    revolution_s = 2.0 * math.pi / scenario.orbit.rate_rad_s(scenario.start)
    for span_s in (_DAY_S, revolution_s):
        with contextlib.suppress(ValueError):
            return _tumbling(scenario, law, span_s)
    return as_flown(scenario, law)


def as_flown(scenario: Scenario, law) -> Tumbling:
    """As `as_tumbling`, with the fields of the run alone, or of its first day."""
    return _tumbling(scenario, law, min(scenario.length_s, _DAY_S))


def _tumbling(scenario: Scenario, law, span_s: float) -> Tumbling:
    control, craft = scenario.control, scenario.spacecraft
    fields = _fields_t(scenario, span_s)
    inertia = float(np.trace(np.array(craft.body.inertia))) / 3.0
    return Tumbling(inertia, fields, craft.coils, law_sampling(scenario, law), control.coil_duty)


def _fields_t(scenario: Scenario, span_s: float) -> np.ndarray:
    """Strengths of the field [T] along the orbit."""
    return np.linalg.norm(_fields_inertial_t(scenario, span_s), axis=1)


def _fields_inertial_t(scenario: Scenario, span_s: float) -> np.ndarray:
    times, environment = np.linspace(0.0, span_s, _FIELDS), scenario.orbit_environment()
    return environment.field(times, *environment.state(times))


def _direction_notes(scenario: Scenario, use: Use) -> Iterator[str]:
    """An orbit along which the field hardly turns."""
    if use.at_start and isinstance(use.law, BDOT):
        yield from direction_notes(scenario)
        yield from _turning_notes(scenario)


def _turning_notes(scenario: Scenario) -> Iterator[str]:
    """A wanted rate below that at which the field itself turns along the orbit."""
    wanted = scenario.mission.rate_below_deg_s if scenario.mission else None
    if wanted is None:
        return
    span_s = min(scenario.length_s, scenario.orbit.period_s)
    fields = _fields_inertial_t(scenario, span_s)
    turning = math.degrees(mean_turning_rad_s(fields, span_s / (_FIELDS - 1)))
    if wanted < ABOVE_TURNING.least * turning:  # neither of a field at rest, nor of none
        yield (
            f"mission.rate_below_deg_s of {wanted:g} deg/s will hardly be kept: "
            f"{ABOVE_TURNING.why}, here {turning:.2g} deg/s on average"
        )


def least_braked_along(scenario: Scenario) -> float | None:
    """Braking about the direction braked least, over the mean of all, over up to a day of a run;
    None for a run of less than a revolution."""
    span_s = min(scenario.length_s, _DAY_S)
    if scenario.orbit.rate_rad_s(scenario.start) * span_s < 2.0 * math.pi:
        return None
    return least_braked(_fields_inertial_t(scenario, span_s))


def direction_notes(scenario: Scenario) -> Iterator[str]:
    """A note if rotation about one direction is braked far less than the mean of all."""
    part = least_braked_along(scenario)
    if part is not None and not EVENLY_BRAKED.holds(part):
        yield (
            f"{EVENLY_BRAKED.why}: {1.0 / max(part, 1e-6):.2g} times more slowly than the mean "
            "over directions, for which times of B-dot are stated"
        )


def _gain_notes(scenario: Scenario, use: Use) -> Iterator[str]:
    law = use.law
    if not isinstance(law, BDOT):
        return
    sampling, gain = law_sampling(scenario, law), use.gain(law.gain_a_m2_s_per_t)
    greatest = most_gain(scenario, sampling, STRONG_FIELD_T)
    if gain > greatest:
        late = f" by coils with a lag of {sampling.lag_s:g} s" if sampling.lag_s else ""
        yield (
            f"the gain of {gain:.3g} A m^2 s/T is above {greatest:.3g}, beyond which a hold of "
            f"{sampling.hold_s:g} s{late} overshoots in a field of {STRONG_FIELD_T * 1e9:.0f} nT"
        )


def _low_gain_notes(scenario: Scenario, use: Use) -> Iterator[str]:
    if use.at_start and isinstance(use.law, BDOT):
        yield from [*_weak_gain_notes(scenario, use)] or _slow_notes(scenario, use)


def _weak_gain_notes(scenario: Scenario, use: Use) -> Iterator[str]:
    """A gain too low to reduce even the rate about the axis of least inertia e-fold in a day."""
    control, gain = scenario.control, use.gain(use.law.gain_a_m2_s_per_t)
    least = float(scenario.spacecraft.body.principal()[0][0])
    e_fold_s = bdot_gain(1.0, least, STRONG_FIELD_T, share=1.0, duty=control.coil_duty) / gain
    duration_s = scenario.length_s
    if e_fold_s > max(duration_s, _DAY_S):
        yield (
            f"the gain of {gain:.3g} A m^2 s/T takes {e_fold_s / 3600.0:.3g} h or more to reduce "
            f"the rate e-fold in a field of {STRONG_FIELD_T * 1e9:.0f} nT, the run lasts "
            f"{duration_s / 3600.0:.3g} h: see `torquer theory bdot --design`"
        )


def _slow_notes(scenario: Scenario, use: Use) -> Iterator[str]:
    """A gain with which coils that never saturate stop the rotation too late, by theory."""
    if scenario.control.named().modes is not None or scenario.spacecraft.coils is None:
        return
    law, gain = use.law, use.gain(use.law.gain_a_m2_s_per_t)
    rate, case = float(np.linalg.norm(scenario.motion_at_start()[4:])), as_flown(scenario, law)
    read = abs(np.sinc(0.5 * rate * case.sampling.difference_s / math.pi))
    limit = float(case.coils.limits_a_m2().min())
    share = gain * rate * read * float(case.fields_t.max()) / limit
    below, allowed_s = stopped_below(scenario)
    if share >= 1.0 or rate >= sampling_limit_rad_s(*case.sampling.times):
        return
    needed_s = detumbling_time_s(case, gain, rate, below)
    if needed_s > allowed_s:
        yield (
            f"the gain of {gain:.3g} A m^2 s/T asks for at most {100.0 * share:.2g} % of the "
            f"coils' limit at the initial rate, and takes about {needed_s / 3600.0:.3g} h to brake "
            f"to {math.degrees(below):.3g} deg/s, with {allowed_s / 3600.0:.3g} h allowed: "
            "see `torquer design detumble`"
        )


def stopped_below(scenario: Scenario) -> tuple[float, float]:
    """Rate [rad/s] that counts as stopped, and the time [s] allowed for it: a day or the run, if
    the mission has no goal for the rate."""
    mission, duration_s = scenario.mission, scenario.length_s
    usual = ORBITAL_RATES * scenario.orbit.rate_rad_s(scenario.start)
    if mission is None or mission.rate_below_deg_s is None:
        return usual, max(duration_s, _DAY_S)
    return math.radians(mission.rate_below_deg_s), mission.within_s or duration_s


def _own_dipole_notes(scenario: Scenario, use: Use) -> Iterator[str]:
    """A note if the magnetometer picks up the coils' field, and with it the law."""
    law = use.law
    if not isinstance(law, BDOT + _NUTATION):
        return
    if not (use.at_start or isinstance(law, DIFFERENCES)):
        return
    craft = scenario.spacecraft
    coupling = craft.one_of("magnetometer").coupling_to(craft.coils)
    per_a_m2 = float(np.linalg.norm(coupling, 2))  # of the dipole that it hears best
    heard = use.gain(law.gain_a_m2_s_per_t or 0.0) * per_a_m2 * _rate_heard(scenario, law)
    if heard > _HEARD:
        yield (
            f"the magnetometer reads the coils' own dipole: {heard:.2g} of it returns in the next "
            f"command, which the limit stated for {_turn(scenario, law).law} does not include"
        )


def _rate_heard(scenario: Scenario, law) -> float:
    """The law's response to a unit of the coils' dipole in the readings, over its gain [1/s]."""
    sampling = law_sampling(scenario, law)
    d, lag_s, off_s = sampling.difference_s, sampling.lag_s, sampling.measure_s
    if not isinstance(law, (*DIFFERENCES, BdotRate, NutationDampingRate)):
        return 0.0  # these take no reading of the field itself
    if off_s > 0.0 and lag_s == 0.0:
        return 0.0
    if d == 0.0:
        left = math.exp(-off_s / lag_s) if off_s > 0.0 else 1.0
        return left * float(np.linalg.norm(scenario.motion_at_start()[4:]))
    changed = 1.0  # of the dipole, between the two readings
    if off_s > 0.0:
        changed = -math.exp((d - off_s) / lag_s) * math.expm1(-d / lag_s)
    return changed / d


_CHECKS = {
    "the rate that the law can brake": _rate_notes,
    "the coils' own dipole in the readings": _own_dipole_notes,
    "the greatest gain of the law": _gain_notes,
    "the time that the law takes": _low_gain_notes,
    "the directions that the law brakes": _direction_notes,
}
