"""SDOT 3.2: S-dot by relay control does not give satisfactory results.

The run of Fig. 3.15, with errors of the sensors and 3.2 A m^2, flown with coils that keep the
direction of the dipole at their limit, as the text has it, and with coils that are fully on in one
sense or the other. Starts, seeds and torques are the same for both; see `sdot_ladder`. The text
prints no number.
"""

import numpy as np

from gallery import sdot_ladder
from gallery.drawing import BLUE, RED, label, new_figure
from gallery.entry import Answer, Entry, share, uncertain, within

STARTS, HOURS, LAST_H = 100, 48.0, 36.0
#: Angle [deg] that the text calls acceptable for charging, in principle.
ACCEPTABLE_DEG = 20.0
CASES = {"scaled to the limit": "scale", "relay": "relay"}


def angles(saturation: str) -> np.ndarray:
    """Angle of x3 to the Sun's line [deg] `[start, time]` in the last hours."""
    data = sdot_ladder.measured()
    data["spacecraft"]["coils"]["saturation"] = saturation
    flown = sdot_ladder.fly(data, STARTS, HOURS)
    found = flown["series.x3"].values[:, flown["time"].values > 3600.0 * LAST_H]
    return np.minimum(found, 180.0 - found)


def compute() -> Answer:
    """Accuracy of both, in the last 12 of 48 h."""
    scaled, relay = (angles(saturation) for saturation in CASES.values())
    bad = np.median(relay, axis=1) > ACCEPTABLE_DEG
    good = np.median(scaled, axis=1) > ACCEPTABLE_DEG
    checks = (
        uncertain(
            within(
                "median angle of x3 to the Sun's line, relay over scaled",
                "not satisfactory",
                np.median(relay) / np.median(scaled),
                low=2.0,
            ),
            0.5,
        ),
        uncertain(
            share(
                f"share of the starts beyond {ACCEPTABLE_DEG:g} deg in the median, relay",
                "not satisfactory",
                bad,
                low=0.5,
            ),
            0.06,
        ),
        share("the same, scaled", "no essential difference from (1.16)", good, high=0.05),
    )
    note = (
        f"{STARTS} starts of {HOURS:.0f} h. Angle of x3 to the Sun's line in the last 12 h, 50 and "
        f"90 %: scaled {np.percentile(scaled, 50):.1f} and {np.percentile(scaled, 90):.1f} deg, "
        f"relay {np.percentile(relay, 50):.1f} and {np.percentile(relay, 90):.1f} deg. 20 deg is "
        "what the text calls acceptable in principle."
    )
    return Answer(checks, {"": picture(scaled, relay)}, note)


def picture(scaled, relay):
    """Distribution of the angle over starts and times."""
    figure, (axes,) = new_figure("S-dot by relay control (SDOT 3.2)", height=3.6)
    for colour, name, each in zip((BLUE, RED), CASES, (scaled, relay), strict=True):
        values = np.sort(each.ravel())
        axes.plot(values, np.linspace(0.0, 1.0, values.size), color=colour, lw=1.4, label=name)
    axes.axvline(ACCEPTABLE_DEG, color="#555555", lw=0.9, ls=(0, (5, 3)))
    axes.set(xlim=(0.0, 90.0), ylim=(0.0, 1.0), xticks=range(0, 91, 15))
    label(axes, "x₃ to the Sun's line in the last 12 h [deg]", "part of starts and time")
    return figure


ENTRY = Entry(ids=("SDOT-relay",), compute=compute, slow=True)
