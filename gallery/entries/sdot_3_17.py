"""SDOT Fig. 3.17: an axis caught the wrong way round, and a law reversed for ten minutes at a time.

The text reverses 'the damping algorithm (1.16)': damping is (1.14), S-dot (1.16). Both are flown.
It prints neither the start nor the damping's gain. Chosen: starts that spin about the axis of
greatest inertia at 0.3 deg/s, away from the Sun; a gain of 1e6 N m s/T^2.
"""

import numpy as np

from gallery import sdot_ladder
from gallery.drawing import BLUE, GREY, RED, label, new_figure
from gallery.entry import (
    Answer,
    Entry,
    Verdict,
    chosen,
    consistent,
    percent,
    sampled,
    share,
    share_error,
    uncertain,
    within,
)

STARTS, HOURS = 100, 48.0
LAWS = {"S-dot (1.16) reversed": "sdot", "damping (1.14) reversed": "damping",
        "nothing reversed": "none"}  # fmt: skip


def compute() -> Answer:
    """How often, when, and after how many attempts the axis turns over."""
    flown = {name: sdot_ladder.turnovers(law, STARTS, HOURS) for name, law in LAWS.items()}
    sdot, damping, nothing = flown.values()
    once, twice = (turned(sdot) & (sdot[1] <= n) for n in (1, 2))
    less = turned(damping).mean() - turned(nothing).mean()
    error = np.hypot(share_error(turned(damping)), share_error(turned(nothing)))
    checks = (
        uncertain(chosen(share("reversed S-dot: part that turns over at the first or second "
                               "attempt", "turns over after the second", twice, low=0.5)), 0.05),
        uncertain(chosen(share("reversed S-dot: part that turns over within 48 h", "turns over",
                               turned(sdot), low=0.95)), 0.03),
        uncertain(consistent(sampled(within("reversed damping: part that turns over within 48 h, "
                                            "less that with nothing reversed", "it hinders", less,
                                            high=-0.2), error)), 0.08),
    )  # fmt: skip
    most = int(sdot[1][turned(sdot)].max())
    note = (
        f"{STARTS} starts, spinning at 0.3 deg/s about the axis of greatest inertia, away from the "
        "Sun, over argument of latitude and seed; start and gain of the damping, 1e6 N m s/T^2, "
        "are chosen. Shares with their standard error: reversed S-dot turns "
        f"{percent(once)} over at the first attempt, {percent(twice)} by the second, "
        f"{percent(turned(sdot))} in 48 h, the last ones at attempt {most}; median time "
        f"{np.median(sdot[0]):.1f} h. Reversed damping turns {percent(turned(damping))} over, of "
        f"{np.median(damping[1]):.0f} attempts in the median; with nothing reversed "
        f"{percent(turned(nothing))} turn over. Turned over: within 30 deg of the Sun for an hour."
    )
    return Answer(checks, {"": picture(flown)}, note)


def turned(flown) -> np.ndarray:
    """Which starts turn over."""
    return np.isfinite(flown[0])


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
    declared=Verdict.CHOSEN,
    reason=(
        "the text prints neither the start nor the gain of the damping: both are chosen. From such "
        "starts S-dot reversed turns nearly all of them over, half at the first attempt"
    ),
    slow=True,
)
