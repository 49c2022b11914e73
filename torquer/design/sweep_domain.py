"""Whether the gain that a sweep of B-dot chooses, and its time by theory, hold."""

import numpy as np

from torquer.analysis.notes.bdot_notes import least_braked_along
from torquer.design.flown_pace import doubts_by_flights, is_confirmed
from torquer.design.gain_flights import GainFlights
from torquer.design.residual_rate import CLEAR, Residual
from torquer.scenario.spec import Scenario
from torquer.theory.slow.detumbling import EVENLY_BRAKED
from torquer.theory.validity import Doubt, Limit, Verdict, judge

BELOW_TURNING = Limit(
    "gain over the one that brakes as fast as the field turns", most=1.0,
    why="the time by theory is too short: rotation about the field outlasts the rest",
    of="design detumble: time by theory",
    shown="Avanzini and Giulietti 2012: the gain at which the slowest direction is fastest",
)  # fmt: skip
ABOVE_REST = Limit(
    "rate that counts as stopped, over the greatest that remains", CLEAR,
    why="it is crossed again by chance, and so is the gain chosen by it",
    of="design detumble: gain by the time to stop",
    shown="a dipole of 5 mA m^2 left: 0.19 deg/s asked for, up to 0.25 remains; gains within a "
    "factor of 10 stop in the last tenth of the flights",
)  # fmt: skip
ALL_STOP = Limit("releases flown that do not stop", most=0.0, why="theory promises all of them")


def judge_sweep(
    scenario: Scenario,
    chosen: GainFlights,
    theory_s: float,
    turning_gain: float,
    residual: Residual | None,
    below_deg_s: float,
) -> Verdict:
    """The verdict on the gain chosen: `residual`: the motion within which the limit lies."""
    settled_s, half_s = chosen.settled_s, chosen.settled_by(0.5)
    rest = judge((ABOVE_REST, None if residual is None else below_deg_s / residual.greatest)).doubts
    if never := int(np.count_nonzero(np.isinf(settled_s))):
        words = f"{never} of {len(settled_s)} releases do not stay below {below_deg_s:.3g} deg/s"
        rest = (*rest, Doubt(ALL_STOP, float(never), words))
    elif is_confirmed(half_s, theory_s):
        return Verdict(rest)
    part, turning = least_braked_along(scenario), chosen.gain / turning_gain
    of_theory = judge((EVENLY_BRAKED, part), (BELOW_TURNING, turning)).doubts
    return Verdict((*rest, *of_theory, *doubts_by_flights(half_s, theory_s)))
