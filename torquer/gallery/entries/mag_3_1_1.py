"""MAG Figs. 3.1.1, 3.1.2: nutation left after 2 revolutions from 30 deg, and 15 from 70 deg.

eps is not printed here: 0.1, as in Figs. 2.1.4 and 3.3.1.
"""

import math

import numpy as np

from torquer.gallery.drawing import label, new_figure
from torquer.gallery.entry import Answer, Entry, near, within
from torquer.report.theory_pictures import isolines
from torquer.theory.evolution import NUTATION_DAMPING
from torquer.theory.slow_motion import map_of_evolution

GRID = np.linspace(0.0, 90.0, 100)
EPS = 0.1


def nutation_deg(revolutions: float, theta_deg: float) -> np.ndarray:
    """Nutation left [deg] `[inclination, rho0]` over the grid."""
    axes = {"inclination_deg": GRID, "rho_deg": GRID}
    fixed = {"sigma_deg": 0.0, "theta_deg": theta_deg, "eps": EPS}
    end = 2.0 * math.pi * revolutions
    return np.degrees(map_of_evolution(NUTATION_DAMPING, axes, fixed, end).theta)


def compute() -> Answer:
    """Two maps, and what the text reads from them."""
    two, fifteen = nutation_deg(2.0, 30.0), nutation_deg(15.0, 70.0)
    steps = np.diff(two, axis=0)
    faster = GRID[np.all(steps < 1e-9, axis=0)].max()
    slower = GRID[np.all(steps > -1e-9, axis=0)].min()
    high = GRID >= 60.0
    worst, best = fifteen.max(axis=1), GRID[fifteen.mean(axis=1).argmin()]
    across = fifteen[:, -1]
    checks = (
        near("2 revolutions: faster with inclination for all rho0 up to", "50", faster, "deg",
             tolerance=5.0, printed="approximately 50 deg"),
        within("2 revolutions: slower with inclination for all rho0 from", "above that, slower",
               slower, 50.0, 65.0, "deg"),
        near("15 revolutions, worst rho0, inclinations from 60 deg up", "14", worst[high].max(),
             "deg", tolerance=1.0, printed="at most 14 deg (isolines)"),
        within("15 revolutions, worst rho0, i = 2 deg", "may hardly change (70 deg)", worst[2],
               low=69.0, unit="deg"),
        near("15 revolutions: inclination that leaves least, rho0 = 60 deg", "45",
             GRID[fifteen[:, 66].argmin()], "deg", tolerance=7.5, printed="about 45 deg"),
    )  # fmt: skip
    note = (
        f"At most {worst[high].max():.1f} deg are left, on the polar orbit with the momentum "
        f"across the cone axis; at 60 deg {worst[66]:.1f}. Least on the mean over rho0 at "
        f"{best:.0f} deg; with the momentum across the axis less is left at low inclination, "
        f"{across.min():.1f} deg. eps = 0.1 is chosen here."
    )
    return Answer(checks, pictures(two, fifteen), note)


def pictures(two, fifteen) -> dict:
    """Isolines of the nutation left."""
    figures = {}
    for number, name, values, levels in (
        ("3.1.1", "2-revolutions", two, np.arange(8.0, 30.0, 2.0)),
        ("3.1.2", "15-revolutions", fifteen, (2, 4, 6, 8, 10, 12, 14, 20, 30, 40, 50, 60)),
    ):
        figure, (axes,) = new_figure(
            f"Nutation after {name.replace('-', ' ')} (MAG Fig. {number})", height=4.4
        )
        isolines(axes, GRID, GRID, values, levels, "%g°")
        label(axes, "inclination [deg]", "rho₀ [deg]", legend=False)
        axes.set(xticks=range(0, 91, 15), yticks=range(0, 91, 15))
        figures[name] = figure
    return figures


ENTRY = Entry(ids=("MAG-3.1.1", "MAG-3.1.2"), compute=compute)
