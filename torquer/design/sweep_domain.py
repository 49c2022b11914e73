"""Whether the gain that a sweep of B-dot chooses, and its time by theory, hold."""

from torquer.analysis.notes.bdot_notes import least_braked_along
from torquer.design.flown_pace import doubts_by_flights, is_confirmed
from torquer.design.gain_flights import GainFlights
from torquer.design.residual_rate import CLEAR, Residual
from torquer.scenario.spec import Scenario
from torquer.theory.slow.detumbling import EVENLY_BRAKED
from torquer.theory.validity import Limit, Verdict, judge

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


def judge_sweep(
    scenario: Scenario,
    chosen: GainFlights,
    theory_s: float,
    turning_gain: float,
    residual: Residual | None,
    below_deg_s: float,
) -> Verdict:
    """The verdict on the gain chosen: `residual`: the motion within which the limit lies."""
    settled_s, goal = chosen.settled_s, f"stay below {below_deg_s:.3g} deg/s"
    rest = judge((ABOVE_REST, None if residual is None else below_deg_s / residual.greatest)).doubts
    if is_confirmed(settled_s, theory_s):
        return Verdict(rest)
    part, turning = least_braked_along(scenario), chosen.gain / turning_gain
    of_theory = judge((EVENLY_BRAKED, part), (BELOW_TURNING, turning)).doubts
    return Verdict((*rest, *of_theory, *doubts_by_flights(settled_s, theory_s, goal)))
