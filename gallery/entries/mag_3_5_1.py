"""MAG Figs. 3.5.1, 3.5.2: the second preliminary reorientation, target along the cone axis.

rho after 10 revolutions from 20 deg over (i, theta0), and theta from 40 deg over (i, rho0). The
text's letter is lost where it says 'above 45 deg'; it is theta0, as it goes on 'far from spinning
about the axis'. eps is not printed: 0.1, as in Figs. 2.1.4 and 3.3.1.
"""

import numpy as np

from gallery.drawing import label, new_figure, shaded_map
from gallery.entries.mag_3_4_1 import END, EPS, GRID, figure_map, rho_deg
from gallery.entry import Answer, Entry, Grade, Verdict, chosen, graded, near, within
from torquer.theory.slow.evolution import PRELIMINARY_2
from torquer.theory.slow.slow_motion import map_evolution


def theta_deg() -> np.ndarray:
    """theta after 10 revolutions [deg] `[inclination, rho0]` from 40 deg."""
    axes = {"inclination_deg": GRID, "rho_deg": GRID}
    fixed = {"sigma_deg": 0.0, "theta_deg": 40.0, "eps": EPS}
    return np.degrees(map_evolution(PRELIMINARY_2, axes, fixed, END).theta)


def compute() -> Answer:
    """Both maps, the first against that of the first algorithm."""
    first, second, theta = rho_deg(), rho_deg(PRELIMINARY_2), theta_deg()
    turns_over, at_last = crossing_deg(second), crossing_deg(rho_deg(PRELIMINARY_2, 1.0))
    high, spinning = GRID >= 60.0, GRID <= 45.0
    faster = first < second * (1.0 - 1e-3)  # the first algorithm
    swap, lowest = GRID[np.argmax(faster[-1])], GRID[np.argmax(faster.any(axis=1))]
    large = GRID >= 80.0
    checks = (
        graded(near("rho as far off after 10 revolutions at i = 10 as at 80 deg: theta0", "45",
                    turns_over, "deg", printed="low inclination better above 45 deg"),
               Grade.ROUNDING),
        chosen(near("the same from rho0 = 1 deg", "45", at_last, "deg", printed="45 deg")),
        within("high inclination, theta0 up to 45 deg: greatest rho over that of algorithm 1",
               "faster than the first algorithm", (second / first)[high][:, spinning].max(),
               high=1.0 + 1e-6),
        near("polar orbit: theta0 from which the first algorithm is faster", "45", swap, "deg",
             printed="take the first above 45 deg"),
        within("theta left on the polar orbit, any rho0: least",
               "high inclination: damping negligible (of 40 deg)", theta[-1].min(), low=38.0,
               unit="deg"),
        within("theta left at i up to 10 deg, rho0 from 80 deg: greatest",
               "counts near the equator at large rho0 only", theta[GRID <= 10.0][:, large].max(),
               high=10.0, unit="deg"),
    )  # fmt: skip
    note = (
        f"Above {swap:.0f} deg of theta0 the first algorithm is faster on the polar orbit; below "
        f"{lowest:.0f} deg of inclination the second is at any theta0. Its damping on the "
        f"polar orbit grows with rho0: {theta[-1, 22]:.1f}, {theta[-1, 49]:.1f} and "
        f"{theta[-1, -1]:.1f} of 40 deg are left from 20, 45 and 90 deg. eps = 0.1 is chosen here."
    )
    figures = {
        "rho": figure_map(second, "2: rho after 10 revolutions (MAG Fig. 3.5.1)"),
        "theta": figure_theta(theta),
    }
    return Answer(checks, figures, note)


def crossing_deg(rho) -> float:
    """theta0 at which rho is the same at 10 and at 80 deg of inclination."""
    ahead = rho[11] - rho[-12]
    (last,) = np.flatnonzero(np.diff(np.sign(ahead[1:]))) + 1
    return float(np.interp(0.0, -ahead[last : last + 2], GRID[last : last + 2]))


def figure_theta(theta):
    """Isolines of theta over (i, rho0)."""
    figure, (axes,) = new_figure(
        "Preliminary reorientation 2: theta after 10 revolutions (MAG Fig. 3.5.2)", height=4.4
    )
    levels = (2, 5, 10, 15, 20, 25, 30, 35, 38, 39)
    shaded_map(axes, GRID, GRID, theta, levels, "theta [deg]", "%g°")
    label(axes, "inclination [deg]", "rho₀ [deg]", legend=False)
    axes.set(xticks=range(0, 91, 15), yticks=range(0, 91, 15))
    return figure


ENTRY = Entry(
    ids=("MAG-3.5.1", "MAG-3.5.2"),
    compute=compute,
    declared=Verdict.DIFFERS,
    grade=Grade.REFUTED,
    reason=(
        "the printed 45 deg holds as rho tends to zero; from rho0 = 20 deg, as in the figure, low "
        "inclination is better above 46 deg. The advice to take the first algorithm from there on "
        "compares two inclinations of the second. The two algorithms, on one orbit, exchange rank "
        "at 60 deg on the polar one and later or never on others. Damping at high inclination is "
        "not negligible from large rho0"
    ),
)
