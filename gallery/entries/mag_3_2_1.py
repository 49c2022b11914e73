"""MAG Fig. 3.2.1: momentum after 5 revolutions of spin-up, eps = 0.1, over (i, rho0)."""

import math

import numpy as np

from gallery.drawing import label, new_figure, shaded_map
from gallery.entry import Answer, Entry, within
from torquer.theory.slow.evolution import SPIN_UP, spin_up
from torquer.theory.slow.slow_motion import map_evolution
from torquer.theory.slow.spinner import Spinner

GRID = np.linspace(0.0, 90.0, 100)
EPS, END = 0.1, 10.0 * math.pi


def momentum() -> np.ndarray:
    """l `[inclination, rho0]` over the grid, from a pure spin with l = 1."""
    axes = {"inclination_deg": GRID, "rho_deg": GRID}
    return map_evolution(SPIN_UP, axes, {"sigma_deg": 0.0, "theta_deg": 0.0, "eps": EPS}, END).l


def special(inclination_deg: float, across: bool) -> float:
    """l at the end in the text's special cases."""
    case = SPIN_UP.case(EPS, Spinner(inclination_deg=inclination_deg))
    return float(spin_up.special_case(END, case, across))


def compute() -> Answer:
    """The map against the special cases, and what the text reads from it."""
    found = momentum()
    edges = [
        max(abs(found[k, -1 if across else 0] - special(GRID[k], across)) for k in range(len(GRID)))
        for across in (False, True)
    ]
    low, high = found[11], found[-12]
    near_axis, far = GRID <= 30.0, GRID >= 75.0
    checks = (
        within("along the cone axis: map from l = 1 + 2 p eps u, greatest", "special case 1",
               edges[0], high=1e-6),
        within("across the axis: map from l = 1 + (1 - p) eps u, greatest", "special case 2",
               edges[1], high=1e-6),
        within("rho0 up to 30 deg: least of l at i = 80 over l at 10 deg",
               "small rho0: faster at high inclination", (high / low)[near_axis].min(), low=1.0),
        within("rho0 from 75 deg: greatest of l at i = 80 over l at 10 deg",
               "rho0 near 90 deg: slower at high inclination", (high / low)[far].max(), high=1.0),
    )  # fmt: skip
    note = (
        f"From {found.min():.2f} (equatorial orbit, momentum along the axis) to {found.max():.2f}: "
        f"on the polar orbit {found[-1, 0]:.2f} along the axis, {found[-1, -1]:.2f} across it."
    )
    figure, (axes,) = new_figure(
        "Spin-up: momentum L / L₀ after 5 revolutions (MAG Fig. 3.2.1)", height=4.4
    )
    shaded_map(axes, GRID, GRID, found, np.arange(1.25, 4.25, 0.25), "L / L₀")
    label(axes, "inclination [deg]", "rho₀ [deg]", legend=False)
    axes.set(xticks=range(0, 91, 15), yticks=range(0, 91, 15))
    return Answer(checks, {"": figure}, note)


ENTRY = Entry(ids=("MAG-3.2.1",), compute=compute)
