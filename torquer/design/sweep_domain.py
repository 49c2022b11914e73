"""Whether the gain that a sweep of B-dot chooses, and its time by theory, hold."""

from torquer.analysis.notes.bdot_notes import least_braked_along
from torquer.design.flown_pace import PACE, doubts_by_flights, is_confirmed
from torquer.design.gain_flights import GainFlights
from torquer.design.residual_rate import CLEAR, Residual
from torquer.scenario.spec import Scenario
from torquer.theory.averaged.conditions import FLOWN
from torquer.theory.slow.detumbling import EVENLY_BRAKED
from torquer.theory.validity import Limit, Verdict, judge

AS_PROMISED = PACE._replace(
    least=FLOWN.least, most=FLOWN.most,
    why="theory leaves out what disturbs, and nutation: go by the flights",
    of="design detumble: time by theory of half of the releases",
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
    residual: Residual | None,
    below_deg_s: float,
) -> Verdict:
    """The verdict on the gain chosen: `theory_s`: by theory half of the releases take so long;
    `residual`: the motion within which the limit lies."""
    settled_s, goal = chosen.settled_s, f"stay below {below_deg_s:.3g} deg/s"
    rest = judge((ABOVE_REST, None if residual is None else below_deg_s / residual.greatest)).doubts
    if is_confirmed(settled_s, theory_s):
        return Verdict(rest)
    braked = judge((EVENLY_BRAKED, least_braked_along(scenario))).doubts
    return Verdict((*rest, *braked, *doubts_by_flights(settled_s, theory_s, goal, AS_PROMISED)))
