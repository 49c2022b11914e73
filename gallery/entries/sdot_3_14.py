"""SDOT Figs. 3.14 to 3.16: S-dot with disturbances, with errors of sensors, through eclipses.

The text shows one run of each; here 200 starts of three days, over argument of latitude, node (but
for Fig. 3.16, whose node is the worst one) and seed. Angles are those to the Sun's line: half of
the starts may end away from the Sun, which these rungs do not mend. Numbers and pictures are of all
starts; the text's run is one that is captured, so that those of the starts captured before the last
day are given, too. The gain of the damping and the size of the unknown torque are chosen (see
`sdot_ladder`).
"""

import numpy as np

from gallery import sdot_ladder
from gallery.drawing import COLOURS, label, new_figure
from gallery.entry import (
    Answer,
    Entry,
    Grade,
    Verdict,
    chosen,
    consistent,
    near,
    percent,
    ratio_of_shares,
    share,
    uncertain,
    within,
)

CAPTURED_DEG, FAR_DEG = 20.0, 20.0
TICKS_DEG = (2, 5, 10, 20, 45, 90)
LAST_DAY_H = sdot_ladder.HOURS - 24.0
RUNGS = {
    "Fig. 3.14": (sdot_ladder.disturbed, True),
    "Fig. 3.15": (sdot_ladder.measured, True),
    "Fig. 3.15, gyro bias of the text": (lambda: sdot_ladder.measured(0.573), True),
    "Fig. 3.16": (sdot_ladder.shaded, False),
}


def off_line(flown, name: str) -> np.ndarray:
    """Angle [deg] `[start, time]` of an axis to the Sun's line."""
    angle = flown[f"series.{name}"].values
    return np.minimum(angle, 180.0 - angle)


def captured(flown, hours: float = LAST_DAY_H) -> np.ndarray:
    """Which starts have x3 within 20 deg of the line in the mean of the 6 h before that time."""
    t_h = flown["time"].values / 3600.0
    window = (t_h > hours - 6.0) & (t_h <= hours)
    return off_line(flown, "x3")[:, window].mean(axis=1) < CAPTURED_DEG


def last_day(flown, name: str) -> np.ndarray:
    """Angle [deg] `[start, time]` of an axis to the Sun's line in the last day."""
    return off_line(flown, name)[:, flown["time"].values / 3600.0 > LAST_DAY_H]


def angle(flown, name: str, part: float, *, every: bool = True) -> float:
    """A percentile [deg] over the last day: of every start, or of those captured before it."""
    angles = last_day(flown, name)
    return float(np.percentile(angles if every else angles[captured(flown)], part))


def compute() -> Answer:
    """Accuracy of both axes, and how many starts are captured."""
    flown = {name: sdot_ladder.fly(make(), node=node) for name, (make, node) in RUNGS.items()}
    first, second, literal, third = flown.values()
    far = (last_day(third, "x3")[captured(third)] > FAR_DEG).any(axis=1)
    checks = (
        uncertain(near("Fig. 3.14: angle of x3 to the Sun's line, median", "8",
                       angle(first, "x3", 50), "deg", 1.0, "about 8 deg"), 0.1),
        uncertain(chosen(within("Fig. 3.14: angle of x3, 90 %", "about 10 deg while damping",
                                angle(first, "x3", 90), 5.0, 10.5, "deg")), 0.5),
        uncertain(consistent(within("Fig. 3.14: angle of the axis of greatest inertia, median",
                                    "the tensor is what disturbs most",
                                    angle(first, "principal", 50), high=3.0, unit="deg")), 0.1),
        uncertain(within("Fig. 3.15: angle of x3, 99 %", "up to 15 deg while damping",
                         angle(second, "x3", 99), high=15.5, unit="deg"), 3.0),
        uncertain(ratio_of_shares("Fig. 3.15: captured after 72 h with the printed bias of the "
                                  "gyro, over that with its data sheet's", "damps despite the bias",
                                  captured(literal, sdot_ladder.HOURS),
                                  captured(second, sdot_ladder.HOURS), low=0.95), 0.03),
        uncertain(within("Fig. 3.16: angle of x3, median", "mainly 8 to 10 deg",
                         angle(third, "x3", 50), 7.5, 10.5, "deg"), 0.1),
        uncertain(chosen(share("Fig. 3.16: share of the starts captured by 48 h that are beyond 20 "
                               "deg at some time of the last day", "beyond 20 deg at times", far,
                               low=0.05)), 0.03),
    )  # fmt: skip
    return Answer(checks, {"": picture(flown)}, note(flown))


def note(flown: dict) -> str:
    """Distributions in words."""
    return (
        f"{sdot_ladder.STARTS} starts each, shares with their standard error; captured: a mean "
        f"angle of x3 to the Sun's line below {CAPTURED_DEG:g} deg in 6 h. Angles are those of the "
        "last day, 50 and 90 %, of all starts (and of those captured by 48 h). The gain of the "
        "damping, 1e6 N m s/T^2, is chosen. "
        + "; ".join(_in_words(name, each) for name, each in flown.items()) + "."
    )  # fmt: skip


def _in_words(name: str, flown) -> str:
    angles = {}
    for axis in ("x3", "principal"):
        parts = [angle(flown, axis, q, every=e) for e in (True, False) for q in (50, 90)]
        angles[axis] = "{:.1f} and {:.1f} deg ({:.1f} and {:.1f})".format(*parts)
    toward = flown["series.x3"].values[:, -1] < 90.0
    shares = [percent(captured(flown, hours)) for hours in (24.0, LAST_DAY_H, sdot_ladder.HOURS)]
    return (
        f"{name}: captured after 24, 48 and 72 h {shares[0]}, {shares[1]} and {shares[2]}, "
        f"{percent(toward)} towards the Sun; x3 {angles['x3']}, axis of greatest inertia "
        f"{angles['principal']}"
    )


def picture(flown: dict):
    """Bands of the angle over time, and its distribution in the last day, of all starts."""
    figure, panels = new_figure("S-dot with disturbances (SDOT Figs. 3.14 to 3.16)", 2, 5.6)
    for colour, (name, each) in zip(COLOURS, flown.items(), strict=False):
        middle, high = np.percentile(off_line(each, "x3"), [50, 90], axis=0)
        t_h = each["time"].values / 3600.0
        panels[0].plot(t_h, middle, color=colour, lw=1.2, label=name)
        panels[0].plot(t_h, high, color=colour, lw=0.7, ls=(0, (4, 2)))
        angles = last_day(each, "x3")
        for part, style in ((angles, "-"), (angles[captured(each)], (0, (1, 1.5)))):
            share_of_time = np.linspace(0.0, 1.0, part.size)
            panels[1].plot(np.sort(part.ravel()), share_of_time, color=colour, lw=1.2, ls=style)
    panels[0].set(ylim=(0.0, 90.0), xlim=(0.0, sdot_ladder.HOURS))
    panels[1].set(xscale="log", xlim=(2.0, 90.0), ylim=(0.0, 1.0))
    panels[1].set_xticks(TICKS_DEG, [f"{x}" for x in TICKS_DEG])
    panels[1].minorticks_off()
    label(panels[0], "time [h]", "x₃ to the Sun's line [deg]\nmedian; 90 % dashed", columns=2)
    label(panels[1], "x₃ to the Sun's line in the last day [deg]",
          "part of the time, all starts;\ncaptured by 48 h dotted", legend=False)  # fmt: skip
    return figure


ENTRY = Entry(
    ids=("SDOT-3.14", "SDOT-3.15", "SDOT-3.16"),
    compute=compute,
    declared=Verdict.DIFFERS,
    grade=Grade.OPEN,
    reason=(
        "x3 is 5.3 to 5.8 deg off the Sun's line in the median, little more than the 5.2 deg by "
        "which the axis of greatest inertia is tilted from it. The printed 8 deg is near the 90 % "
        "without eclipses, 6.5 and 8.5 deg; with them 90 % is 21 deg of all starts and 9 deg of "
        "those captured by 48 h. While damping x3 goes beyond 15 deg, and with the printed bias of "
        "the gyro 86 % of the starts are captured in three days, not 98 %"
    ),
    slow=True,
)
