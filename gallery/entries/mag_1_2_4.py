"""MAG Figs. 1.2.4, 1.2.5: the cone's half-angle against inclination, and their difference."""

import math

import numpy as np

from gallery.drawing import BLUE, GREY, label, level, new_figure
from gallery.entry import Answer, Entry, within
from torquer.environment.field.averaged import cone_angle


def compute() -> Answer:
    """Theta by (1.2.1) from 0 to 90 deg."""
    inclination_deg = np.linspace(0.0, 90.0, 901)
    theta = np.degrees([cone_angle(math.radians(i)) for i in inclination_deg])
    ahead = theta - inclination_deg
    checks = (
        within("greatest Theta - i", "does not exceed 10 deg", ahead.max(), high=10.0, unit="deg"),
    )
    figure, (upper, lower) = new_figure("Half-angle of the averaged field's cone", 2, 5.0)
    upper.plot(inclination_deg, theta, color=BLUE, label="Theta")
    upper.plot(inclination_deg, inclination_deg, color=GREY, ls="--", label="Theta = i")
    label(upper, "", "Theta [deg]")
    lower.plot(inclination_deg, ahead, color=BLUE)
    label(lower, "inclination [deg]", "Theta - i [deg]", legend=False)
    level(lower, 10.0, "10 deg")
    for axes in (upper, lower):
        axes.set_xlim(0.0, 90.0)
    note = f"The greatest difference is at i = {inclination_deg[ahead.argmax()]:.1f} deg."
    return Answer(checks, {"": figure}, note)


ENTRY = Entry(ids=("MAG-1.2.4", "MAG-1.2.5"), compute=compute)
