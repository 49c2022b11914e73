"""FIELD Fig. 5, MAG Fig. 1.2.2: how far the direct dipole's vector leaves the averaged cone."""

import numpy as np
from scipy.optimize import minimize_scalar

from gallery.cones import deviation_deg
from gallery.drawing import BLUE, label, level, new_figure
from gallery.entry import Answer, Entry, Grade, Verdict, near, uncertain, within


def greatest_deg(inclination_deg: float) -> float:
    """The greatest deviation along the orbit, between the arguments of latitude of a grid, too."""
    u_deg = np.linspace(0.0, 180.0, 181)
    near_deg = u_deg[deviation_deg(u_deg, inclination_deg).argmax()]
    found = minimize_scalar(lambda u: -deviation_deg([u], inclination_deg)[0],
                            bounds=(near_deg - 1.0, near_deg + 1.0), method="bounded",
                            options={"xatol": 1e-7})  # fmt: skip
    return -float(found.fun)


def optimum_deg() -> float:
    """The inclination of the greatest deviation of all."""
    found = minimize_scalar(lambda i: -greatest_deg(i), bounds=(40.0, 60.0), method="bounded",
                            options={"xatol": 1e-7})  # fmt: skip
    return float(found.x)


def compute() -> Answer:
    """The greatest deviation along the orbit, for inclinations from 0 to 90 deg."""
    inclination_deg = np.linspace(0.0, 90.0, 361)
    u_deg = np.linspace(0.0, 180.0, 721)
    deviation = np.array([deviation_deg(u_deg, i) for i in inclination_deg])
    greatest = deviation.max(axis=1)
    best = optimum_deg()
    checks = (
        uncertain(near("inclination of the maximum", "52", best, "deg"), 2e-3),
        within("least deviation: the round cone lies inside", "the round cone lies inside",
               deviation.min(), low=-1e-9, unit="deg"),
    )  # fmt: skip
    figure, (axes,) = new_figure("Direct dipole's vector: greatest deviation from the cone")
    axes.plot(inclination_deg, greatest, color=BLUE)
    axes.axvline(52.0, color="#767676", lw=0.9, ls=(0, (5, 3)))
    axes.annotate("52 deg, as printed", (53.0, 0.03), fontsize=9.5, color="#555555")
    label(axes, "inclination [deg]", "deviation [deg]", legend=False)
    level(axes, greatest.max(), f"{greatest.max():.2f} deg")
    axes.set(xlim=(0.0, 90.0), ylim=(0.0, 1.2))
    share = greatest_deg(52.0) / greatest_deg(best)
    note = (
        f"The greatest deviation of all is {greatest_deg(best):.3f} deg, at {best:.2f} deg; at 52 "
        f"deg {share:.4f} of it."
    )
    return Answer(checks, {"": figure}, note)


ENTRY = Entry(
    ids=("FIELD-5", "MAG-1.2.2"),
    compute=compute,
    declared=Verdict.DIFFERS,
    grade=Grade.ROUNDING,
    reason=(
        "the maximum is at 51.2 deg, which rounds to 51; it is so flat that the deviation at the "
        "printed 52 deg (MAG; FIELD prints none) is the same to a thousandth"
    ),
)
