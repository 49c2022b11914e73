"""FIELD Fig. 6: greatest angle between direct-dipole and averaged vectors, against inclination."""

import math

import numpy as np

from gallery.cones import angle_between_deg, averaged_y, dipole_y
from gallery.drawing import BLUE, RED, label, level, new_figure
from gallery.entry import Answer, Entry, Grade, Verdict, near, within
from torquer.environment.field.averaged import cos_to_direct_dipole

PLATEAU_FROM_DEG = 35.0


def by_formula_deg(u_deg, inclination_deg: float) -> float:
    """The greatest angle by (1.12)."""
    turn = math.radians(inclination_deg)
    least = min(cos_to_direct_dipole(u, turn) for u in np.radians(u_deg))
    return math.degrees(math.acos(min(least, 1.0)))


def compute() -> Answer:
    """By the published formula and by the vectors of the two models themselves."""
    inclination_deg = np.linspace(0.0, 90.0, 181)
    u_deg = np.linspace(0.0, 90.0, 361)
    formula = np.array([by_formula_deg(u_deg, i) for i in inclination_deg])
    vectors = np.array(
        [angle_between_deg(dipole_y(u_deg, i), averaged_y(u_deg, i)).max() for i in inclination_deg]
    )
    on_plateau = inclination_deg > PLATEAU_FROM_DEG + 0.5
    checks = (
        near("greatest angle by (1.12)", "19", formula.max(), "deg"),
        near("(1.12) is on its plateau from", "35", plateau_start(), "deg"),
        within("vectors themselves: rise over the plateau", "constant above 35 deg",
               np.ptp(vectors[on_plateau]), high=0.5, unit="deg"),
        near("vectors themselves at i = 52 deg", "19", np.interp(52.0, inclination_deg, vectors),
             "deg"),
    )  # fmt: skip
    figure, (axes,) = new_figure("Greatest angle between direct-dipole and averaged vectors")
    axes.plot(inclination_deg, formula, color=RED, ls="--", label="formula (1.12), Theta = i")
    axes.plot(inclination_deg, vectors, color=BLUE, label="the vectors, Theta of MAG (1.2.1)")
    label(axes, "inclination [deg]", "greatest angle [deg]")
    level(axes, formula.max(), "19.47 deg")
    axes.set(xlim=(0.0, 90.0), ylim=(0.0, 21.5))
    return Answer(checks, {"": figure})


def plateau_start() -> float:
    """Inclination from which (1.12) has its greatest angle before u = 90 deg."""
    u = np.radians(np.linspace(0.0, 90.0, 1801))
    for inclination_deg in np.arange(30.0, 40.0, 0.05):
        cosines = [cos_to_direct_dipole(each, math.radians(inclination_deg)) for each in u]
        if np.argmin(cosines) < len(u) - 1:
            return float(inclination_deg)
    return math.nan


ENTRY = Entry(
    ids=("FIELD-6",),
    compute=compute,
    declared=Verdict.DIFFERS,
    grade=Grade.REFUTED,
    reason=(
        "(1.12) sets Theta = i, exact on equatorial and polar orbits only. With Theta of "
        "MAG (1.2.1) the vectors themselves have no plateau: the angle rises all the way to "
        "19.47 deg at the pole"
    ),
)
