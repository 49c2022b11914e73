"""SDOT Figs. 3.14 to 3.16: S-dot with disturbances, with errors of sensors, through eclipses.

The text shows one run of each; here 200 starts of three days, over argument of latitude, node (but
for Fig. 3.16, whose node is the worst one) and seed. Angles are those to the Sun's line: half of
the starts may end away from the Sun, which these rungs do not mend.
"""

import numpy as np

from gallery import sdot_ladder
from gallery.drawing import COLOURS, label, new_figure
from gallery.entry import Answer, Entry, Verdict, consistent, near, uncertain, within

CAPTURED_DEG = 20.0
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


def captured(flown, hours: float) -> float:
    """Part of the starts whose x3 is within 20 deg of the line in the mean of the last 6 h."""
    t_h = flown["time"].values / 3600.0
    window = (t_h > hours - 6.0) & (t_h <= hours)
    return float(np.mean(off_line(flown, "x3")[:, window].mean(axis=1) < CAPTURED_DEG))


def last_day(flown, name: str, percent: float) -> float:
    """A percentile [deg] over the starts that are captured, and over their last day."""
    t_h = flown["time"].values / 3600.0
    angles = off_line(flown, name)[:, t_h > t_h[-1] - 24.0]
    return float(np.percentile(angles[angles.mean(axis=1) < CAPTURED_DEG], percent))


def compute() -> Answer:
    """Accuracy of both axes, and how many starts are captured."""
    flown = {name: sdot_ladder.fly(make(), node=node) for name, (make, node) in RUNGS.items()}
    first, second, literal, third = flown.values()
    checks = (
        uncertain(near("Fig. 3.14: angle of x3 to the Sun's line, median", "8",
                       last_day(first, "x3", 50), "deg", 1.0, "about 8 deg"), 0.1),
        uncertain(within("Fig. 3.14: angle of x3, 90 %", "about 10 deg while damping",
                         last_day(first, "x3", 90), 5.0, 10.5, "deg"), 0.5),
        uncertain(consistent(within("Fig. 3.14: angle of the axis of greatest inertia, median",
                                    "the tensor is what disturbs most",
                                    last_day(first, "principal", 50), high=3.0, unit="deg")), 0.1),
        uncertain(within("Fig. 3.15: angle of x3, 99 %", "up to 15 deg while damping",
                         last_day(second, "x3", 99), high=15.5, unit="deg"), 1.0),
        uncertain(within("Fig. 3.15: captured after 72 h with the printed bias of the gyro, over "
                         "that with its data sheet's", "damps despite the bias",
                         captured(literal, 72.0) / captured(second, 72.0), low=0.95), 0.03),
        uncertain(within("Fig. 3.16: angle of x3, median", "mainly 8 to 10 deg",
                         last_day(third, "x3", 50), 7.5, 10.5, "deg"), 0.1),
        uncertain(within("Fig. 3.16: angle of x3, greatest", "beyond 20 deg at times",
                         last_day(third, "x3", 100), low=20.0, unit="deg"), 5.0),
    )  # fmt: skip
    return Answer(checks, {"": picture(flown)}, note(flown))


def note(flown: dict) -> str:
    """Distributions in words."""
    text = []
    for name, each in flown.items():
        x3 = [last_day(each, "x3", percent) for percent in (10, 50, 90)]
        own = [last_day(each, "principal", percent) for percent in (50, 90)]
        toward = float(np.mean(each["series.x3"].values[:, -1] < 90.0))
        text.append(
            f"{name}: captured {100 * captured(each, 24.0):.0f} % after 24 h and "
            f"{100 * captured(each, 72.0):.0f} % after 72 h, {100 * toward:.0f} % towards the Sun; "
            f"x3 {x3[0]:.1f}, {x3[1]:.1f} and {x3[2]:.1f} deg off (10, 50, 90 %), axis of greatest "
            f"inertia {own[0]:.1f} and {own[1]:.1f} deg (50, 90 %)"
        )
    return (
        f"{sdot_ladder.STARTS} starts each; captured: a mean angle of x3 to the Sun's line below "
        f"{CAPTURED_DEG:g} deg in 6 h; angles are those of the last day of captured starts. "
        + "; ".join(text) + "."
    )  # fmt: skip


def picture(flown: dict):
    """Bands of the angle over time, and its distribution in the last day."""
    figure, panels = new_figure("S-dot with disturbances (SDOT Figs. 3.14 to 3.16)", 2, 5.6)
    for colour, (name, each) in zip(COLOURS, flown.items(), strict=False):
        t_h, angle = each["time"].values / 3600.0, off_line(each, "x3")
        middle, high = np.percentile(angle, [50, 90], axis=0)
        panels[0].plot(t_h, middle, color=colour, lw=1.2, label=name)
        panels[0].plot(t_h, high, color=colour, lw=0.7, ls=(0, (4, 2)))
        last = np.sort(angle[:, t_h > t_h[-1] - 24.0].ravel())
        panels[1].plot(last, np.linspace(0.0, 1.0, len(last)), color=colour)
    panels[0].set(ylim=(0.0, 90.0), xlim=(0.0, sdot_ladder.HOURS))
    panels[1].set(xlim=(0.0, 40.0), ylim=(0.0, 1.0))
    label(panels[0], "time [h]", "x₃ to the Sun's line [deg]\nmedian; 90 % dashed", columns=2)
    label(panels[1], "x₃ to the Sun's line in the last day [deg]", "part of the time", legend=False)
    return figure


ENTRY = Entry(
    ids=("SDOT-3.14", "SDOT-3.15", "SDOT-3.16"),
    compute=compute,
    declared=Verdict.DIFFERS,
    reason=(
        "x3 is 5.3 to 5.6 deg off the Sun's line in the median, little more than the 5.2 deg by "
        "which the axis of greatest inertia is tilted from it; the printed 8 deg is about its 90 % "
        "(6.7, 8.0 and 8.2 deg). While damping it goes beyond 15 deg, and with the printed bias of "
        "the gyro a tenth of the starts are not captured"
    ),
    slow=True,
)
