"""Whether a magneto-gyroscopic design holds: conditions of its theory, and what flights show."""

import math

import numpy as np

from torquer.design.flown_pace import doubts_by_flights
from torquer.design.gyro.case import GyroCase
from torquer.design.gyro.flown_scenario import POINTED_DEG
from torquer.design.pointing_flights import PointingFlights
from torquer.theory.magneto_gyro.accuracy import follow_revolution
from torquer.theory.magneto_gyro.capture import UPSIDE_DOWN, Stage1Design
from torquer.theory.magneto_gyro.own_dipole import TURNED_1, TURNED_2, turned_in_stage_2
from torquer.theory.magneto_gyro.stage_2 import stage_2_loop
from torquer.theory.magneto_gyro.stage_2_gains import Stage2Design
from torquer.theory.validity import Doubt, Limit, Verdict, judge

#: Below this h, where roll and yaw are hard to tell apart, a better wheel is looked for.
STIFF = Limit(
    "h", 3.0, why="near 2 or below it roll and yaw are hard to tell apart, and the motion is slow",
    of="design magneto-gyro: gains of stage 2",
    shown="exact degree 0.10 at h = 2.1, 0.12 at 2.5, 0.18 at 3, 0.23 at 4 (docs/theory)",
)  # fmt: skip
#: Beyond this angle [deg] a number of the linear theory means nothing.
_MEANT_DEG = 90.0


def dipole_in_stage_2(case: GyroCase, second: Stage2Design, form: str) -> float:
    """Angle [rad] by which the satellite's own dipole turns stage 2 until it is found."""
    craft, normal = case.craft, case.along.normal
    loop = stage_2_loop(craft.satellite(), craft.gyrostat, second.gains, normal=normal, form=form)
    return turned_in_stage_2(follow_revolution(loop), case.own_dipole, normal)


def judge_design(
    case: GyroCase, first: Stage1Design, turned_rad: float, theory_s: float,
    flights: PointingFlights | None,
) -> Verdict:  # fmt: skip
    """The verdict on gains and time to point; `theory_s`: until the error is small.

    `turned_rad`: by the own dipole in stage 2.
    """
    turned = {TURNED_1: math.degrees(first.turned_rad), TURNED_2: math.degrees(turned_rad)}
    conditions = judge(
        (STIFF, case.craft.stiffness), (UPSIDE_DOWN, first.upside_down), *turned.items()
    )
    doubts = [_with_remedy(case, doubt) for doubt in conditions.doubts]
    return Verdict((*doubts, *_flown(flights, theory_s)))


def _with_remedy(case: GyroCase, doubt: Doubt) -> Doubt:
    """A doubt about the dipole with the dipole that would be allowed."""
    if doubt.limit not in (TURNED_1, TURNED_2):
        return doubt
    said = doubt.text
    if doubt.value > _MEANT_DEG:
        name, must, why = doubt.limit.name, doubt.limit.must, doubt.limit.why
        said = f"{name} more than {_MEANT_DEG:g}: {must} ({why})"
    own = float(np.linalg.norm(case.coils.residual_dipole_a_m2))
    allowed = own * doubt.limit.most / doubt.value
    remedy = (
        f"of the satellite's {own:.3g} A m^2 (spacecraft.coils.residual_dipole_a_m2) at most "
        f"{allowed:.3g} may be left: measure and trim it, or take a stronger wheel"
    )
    return doubt._replace(words=f"{said}; {remedy}")


def _flown(flights: PointingFlights | None, theory_s: float) -> tuple[Doubt, ...]:
    if flights is None:
        return ()
    goal = f"stay below {POINTED_DEG:g} deg within {flights.t_s[-1] / 3600.0:.3g} h"
    return doubts_by_flights(flights.settled_s(POINTED_DEG), theory_s, goal)
