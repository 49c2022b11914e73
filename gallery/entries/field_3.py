"""FIELD Fig. 3: two rules for the averaged field's strength, against inclination."""

import math

import numpy as np

from gallery.drawing import BLUE, RED, label, new_figure
from gallery.entry import Answer, Entry, Grade, Verdict, near, within
from torquer.base.conventions import EARTH_RADIUS_M, FIELD_RADIUS_M
from torquer.environment.field.averaged import mean_of_extremes, mean_over_orbit

MU_E_T_M3, ALTITUDE_M = 7.812e15, 350e3
RADIUS_M = EARTH_RADIUS_M + ALTITUDE_M


def compute() -> Answer:
    """Both B0 from 0 to 90 deg, their greatest difference."""
    inclination_deg = np.linspace(0.0, 90.0, 181)
    equatorial_nt = 1e9 * MU_E_T_M3 / RADIUS_M**3
    arithmetic, integral = (
        np.array([rule(equatorial_nt, math.radians(i)) for i in inclination_deg])
        for rule in (mean_of_extremes, mean_over_orbit)
    )
    difference = np.abs(arithmetic - integral)
    percent = 100.0 * (difference / integral).max()
    checks = (
        near("greatest difference, above the equatorial radius", "1250", difference.max(), "nT"),
        near("greatest difference, above the mean radius of 6371.2 km", "1250",
             difference.max() * (RADIUS_M / (FIELD_RADIUS_M + ALTITUDE_M)) ** 3, "nT"),
        near("greatest difference", "3", percent, "%"),
        within("inclination of the greatest", "near-polar orbits",
               inclination_deg[difference.argmax()], low=80.0, unit="deg"),
    )  # fmt: skip
    figure, (upper, lower) = new_figure("Strength of the averaged field at 350 km", 2, 5.0)
    upper.plot(inclination_deg, 1e-3 * arithmetic, color=BLUE, label="mean of extremes (1.10)")
    upper.plot(inclination_deg, 1e-3 * integral, color=RED, label="integral mean (1.11)")
    label(upper, "", "B0 [µT]")
    lower.plot(inclination_deg, difference, color="#222222")
    label(lower, "inclination [deg]", "difference [nT]", legend=False)
    for axes in (upper, lower):
        axes.set_xlim(0.0, 90.0)
    most = float(difference.max())
    lower_km = 1e-3 * RADIUS_M * (1.0 - (most / 1250.0) ** (1.0 / 3.0))
    note = (
        f"On a polar orbit the difference is {most / equatorial_nt:.4f} mu_e/r^3. 1250 nT would "
        f"need an orbit {lower_km:.0f} km lower, or {1250.0 / most:.2f} times mu_e."
    )
    return Answer(checks, {"": figure}, note)


ENTRY = Entry(
    ids=("FIELD-3",),
    compute=compute,
    declared=Verdict.DIFFERS,
    grade=Grade.REFUTED,
    reason=(
        "the formulas (1.10) and (1.11) give 0.0420 mu_e/r^3 on a polar orbit, 1076 nT with the "
        "height above the equatorial radius and 1080 nT above the mean one. 1250 nT would need an "
        "orbit 327 km lower, or mu_e a sixth greater. The printed 3 % holds"
    ),
)
