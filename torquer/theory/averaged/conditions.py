"""Conditions of the averaged motion of a law, and the verdict on an answer.

Each condition is a limit with the trial that gave it. True motions (`flights`) contain what most
conditions are about: where they agree with the formula, the answer is valid although a condition
is not met, and where they do not, the conditions that are not met are the reasons.
"""

import math

from torquer.theory.averaged.assumed import FLOWN_TOO, OF, TABLE
from torquer.theory.averaged.case import AveragedCase
from torquer.theory.averaged.flights import Flights
from torquer.theory.slow.axis_stability import STABLE_AXIS, nutation_growth
from torquer.theory.slow.evolution.model import Slow
from torquer.theory.slow.evolution.sdot import SUN_SEEN, sun_weight
from torquer.theory.slow.gains import damping_efficiency
from torquer.theory.validity import PRECESSION, SLOW_CHANGE, Limit, Verdict, judge

CHANGE = Limit(
    "change of the momentum per radian of the orbit", most=SLOW_CHANGE,
    why="the averages err by 0.4 of it", of=OF,
    shown="full against averaged motion, u = 1/eps, seven laws, 15 to 80 deg",
)  # fmt: skip
FAST = PRECESSION._replace(of=OF, shown="harmonic 4u of the field's products")
#: At the end of a damping: the rate that is asked for, in orbital rates.
STILL_FAST = Limit(
    "precession at the end, over the orbital rate", 10.0,
    why="the field itself turns by twice the orbital rate, and B-dot brakes relative to it", of=OF,
    shown="B-dot flown to 10 % from 6, 2, 1 and 0.5 deg/s at 51.6 deg: it takes 1, 13, 76 % "
    "longer, and never comes there",
)  # fmt: skip
INCLINED = Limit(
    "angle of the orbit to the equator [deg]", 25.0,
    why="the averaged field leaves the dipole's tilt out, which alone turns the field there",
    of=OF,
    shown="B-dot to 20 % in the field of a dipole tilted by 9.2 deg, at 5, 10, 20 deg: flown 102, "
    "65, 26 revolutions for 460, 115, 29",
)  # fmt: skip
SEES_THE_SUN = SUN_SEEN._replace(
    why="the Sun lies across the field at all times: S-dot gives no dipole", of="S-dot",
    shown="S-dot's torque, which is proportional to it", refuses=True,
)  # fmt: skip
SAMPLED = Limit(
    "damping of the sampled law over that of the ideal one", 0.9,
    why="difference, hold and lag take part of the damping", of="B-dot, nutation damping",
    shown="the closed formula of the sampled law: a tenth is lost",
)  # fmt: skip
#: Part of the momentum along the axis below which it is rounding.
_NO_SPIN = 1e-6
#: Of the median of the true motions.
FLOWN = Limit(
    "revolutions flown over those of the formula", 0.8, 1.25,
    why="the body as it is, in the field of the tilted dipole, takes another time", of=OF,
    shown=TABLE,
)  # fmt: skip
#: Of each of them.
EACH_FLOWN = FLOWN._replace(least=0.5, most=2.0, shown="")


def judge_case(case: AveragedCase, part: float, flights: Flights) -> Verdict:
    """The verdict on the times of a case until `part` of the initial value."""
    unseen, seen = judge(*_unseen(case)), judge(*_seen(case, part))
    flown = flights.doubt(FLOWN, EACH_FLOWN)
    if flown is None and (flights.ratio is not None or not flights.each):
        return unseen
    return Verdict((*(() if flown is None else (flown,)), *seen.doubts, *unseen.doubts))


def check_case(case: AveragedCase) -> None:
    """ValueError for a law about an axis whose spin is not stable, and where it does nothing."""
    if case.law == "spin_up" and abs(math.cos(case.theta)) < _NO_SPIN:
        raise ValueError(
            "rate: must have a part along the spin axis for spin_up: its times are relative to the "
            f"momentum along it; received a nutation of {math.degrees(case.theta):.6g} deg"
        )
    if case.law == "sdot" and not SEES_THE_SUN.holds(sun_weight(case.constants)):
        raise ValueError(
            f"sun: must not lie across the field all along the orbit: {SEES_THE_SUN.why}; received "
            f"one at right angles to it, at an inclination of {case.spinner.inclination_deg:g} deg"
        )
    if case.law != "bdot":  # all others turn a spin axis, or act about it
        _check_axis(case)


def _check_axis(case: AveragedCase) -> None:
    orbital_rate = case.spinner.orbital_rate_rad_s
    growth = nutation_growth(case.inertia, case.rate_rad_s, orbital_rate)
    if not STABLE_AXIS.holds(growth):
        moments = ", ".join(f"{case.inertia[k][k]:g}" for k in range(3))
        raise ValueError(
            f"inertia: {STABLE_AXIS.why}, here e-fold in {1.0 / (growth * orbital_rate):.3g} s; "
            f"received {moments} kg m^2, spin axis last"
        )


def _seen(case: AveragedCase, part: float):
    """Conditions on what true motions contain."""
    spinner = case.spinner
    precession = spinner.eta[1]
    if case.gain:
        yield CHANGE, case.evolution.change(Slow(1.0, 0.0, 0.0, 0.0), case.constants)
    yield FAST, precession
    if case.flown == "bdot_derivative":
        yield STILL_FAST, part * precession
    yield INCLINED, min(spinner.inclination_deg, 180.0 - spinner.inclination_deg)
    yield from (pair for pair in case.assumed if pair[0] in FLOWN_TOO)


def _unseen(case: AveragedCase):
    """Conditions on what they leave out."""
    yield from (pair for pair in case.assumed if pair[0] not in FLOWN_TOO)
    if case.sampling is not None:
        yield SAMPLED, float(damping_efficiency(case.damped_rate_rad_s, *case.sampling.times))
