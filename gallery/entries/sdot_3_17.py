"""SDOT Fig. 3.17: an axis caught the wrong way round, and a law reversed for ten minutes at a time.

The text reverses 'the damping algorithm (1.16)': damping is (1.14), S-dot (1.16). Both are flown,
from starts that spin about the axis of greatest inertia, away from the Sun.
"""

import numpy as np

from gallery import sdot_ladder
from gallery.drawing import BLUE, GREY, RED, label, new_figure
from gallery.entry import Answer, Entry, Verdict, consistent, uncertain, within

STARTS, HOURS = 100, 48.0
LAWS = {"S-dot (1.16) reversed": "sdot", "damping (1.14) reversed": "damping",
        "nothing reversed": "none"}  # fmt: skip


def compute() -> Answer:
    """How often, when, and after how many attempts the axis turns over."""
    flown = {name: sdot_ladder.turnovers(law, STARTS, HOURS) for name, law in LAWS.items()}
    sdot, damping, nothing = flown.values()
    once, twice = (float(np.mean(np.isfinite(sdot[0]) & (sdot[1] <= n))) for n in (1, 2))
    checks = (
        uncertain(within("reversed S-dot: part that turns over at the first or second attempt",
                         "turns over after the second", twice, low=0.5), 0.05),
        uncertain(within("reversed S-dot: part that turns over within 48 h", "turns over",
                         part_turned(sdot), low=0.95), 0.03),
        uncertain(consistent(within("reversed damping: part that turns over within 48 h, less that "
                                    "with nothing reversed", "it hinders",
                                    part_turned(damping) - part_turned(nothing), high=-0.2)),
                  0.08),
    )  # fmt: skip
    most = int(sdot[1][np.isfinite(sdot[0])].max())
    percent = [100 * share for share in (once, twice, part_turned(damping), part_turned(nothing))]
    note = (
        f"{STARTS} starts over argument of latitude and seed. Reversed S-dot turns "
        f"{percent[0]:.0f} % over at the first attempt, {percent[1]:.0f} % by the second, the last "
        f"ones at attempt {most}; median time {np.median(sdot[0]):.1f} h. Reversed damping turns "
        f"{percent[2]:.0f} % over, of {np.median(damping[1]):.0f} attempts in the median; with "
        f"nothing reversed {percent[3]:.0f} % turn over. Turned over: within 30 deg of the Sun for "
        "an hour."
    )
    return Answer(checks, {"": picture(flown)}, note)


def part_turned(flown) -> float:
    """Part of the starts that turn over."""
    return float(np.isfinite(flown[0]).mean())


def picture(flown: dict):
    """Part of the starts that have turned over, over time."""
    figure, (axes,) = new_figure("Turned over to the Sun (SDOT Fig. 3.17)", height=3.6)
    share = np.arange(1, STARTS + 1) / STARTS
    for colour, (name, (hours, _)) in zip((BLUE, RED, GREY), flown.items(), strict=True):
        axes.step(np.minimum(np.sort(hours), 2 * HOURS), share, where="post", color=colour,
                  label=name)  # fmt: skip
    axes.set(xlim=(0.0, HOURS), ylim=(0.0, 1.0))
    label(axes, "time [h]", "part of the starts")
    return figure


ENTRY = Entry(
    ids=("SDOT-3.17",),
    compute=compute,
    declared=Verdict.AGREES,
    slow=True,
)
