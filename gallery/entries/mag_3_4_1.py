"""MAG Figs. 3.4.1, 3.4.2: the first preliminary reorientation, target along the cone axis.

rho after 10 revolutions from 20 deg over (i, theta0); rho over time for several inclinations.
eps is not printed here: 0.1, as in Figs. 2.1.4 and 3.3.1; theta0 of the second figure is lost.
"""

import math

import numpy as np

from gallery.drawing import COLOURS, label, new_figure, shaded_map
from gallery.entry import Answer, Entry, within
from torquer.theory.slow.equilibria import evolution_rates, find_equilibria, tends_to
from torquer.theory.slow.evolution import PRELIMINARY_1
from torquer.theory.slow.evolution.model import Slow
from torquer.theory.slow.slow_motion import evolve, map_evolution
from torquer.theory.slow.spinner import Spinner

GRID = np.linspace(0.0, 90.0, 100)
EPS, END = 0.1, 20.0 * math.pi
INCLINATIONS_DEG = (10.0, 30.0, 45.0, 60.0, 75.0, 90.0)
U = np.linspace(0.0, END, 401)


def rho_deg(evolution=PRELIMINARY_1, rho0_deg: float = 20.0) -> np.ndarray:
    """rho after 10 revolutions [deg] `[inclination, theta0]` over the grid."""
    axes = {"inclination_deg": GRID, "theta_deg": GRID}
    fixed = {"sigma_deg": 0.0, "rho_deg": rho0_deg, "eps": EPS}
    return np.degrees(map_evolution(evolution, axes, fixed, END).rho)


def courses() -> dict:
    """rho [deg] at U for each inclination, from rho = 90, theta = 30 deg."""
    start = Slow(1.0, math.radians(90.0), 0.0, math.radians(30.0))
    return {
        i: np.degrees(
            evolve(PRELIMINARY_1, PRELIMINARY_1.case(EPS, Spinner(inclination_deg=i)), start, U).rho
        )
        for i in INCLINATIONS_DEG
    }


def compute() -> Answer:
    """The map and the courses, and what the text says of them."""
    found, runs = rho_deg(), courses()
    case = PRELIMINARY_1.case(EPS, Spinner(inclination_deg=60.0))
    (attracting,) = tends_to(find_equilibria(evolution_rates(PRELIMINARY_1, case)))
    ends = np.array([course[-1] for course in runs.values()])
    checks = (
        within("greatest change of rho from one inclination to the next, all theta0",
               "faster at higher inclination", np.diff(found, axis=0).max(), high=1e-6, unit="deg"),
        within("least rho on the equatorial orbit", "hardly works there (20 deg)", found[0].min(),
               low=19.9, unit="deg"),
        within("least change of rho from one theta0 to the next, all inclinations",
               "better with smaller theta0", np.diff(found, axis=1).min(), low=-1e-6, unit="deg"),
        within("rho over time: greatest end over that of the next lower inclination",
               "faster at higher inclination", (ends[1:] / ends[:-1]).max(), high=1.0),
        within("stable equilibrium: theta", "(theta, rho) = (pi/2, 0) alone is stable",
               math.degrees(attracting.theta) + math.degrees(attracting.rho), 89.9, 90.1, "deg"),
    )  # fmt: skip
    note = (
        f"From 20 deg, 10 revolutions of the polar orbit leave {found[-1, 0]:.1f} deg of a pure "
        f"spin and {found[-1, -1]:.1f} deg without one. eps = 0.1 is chosen here, and for the "
        "courses rho0 = 90, theta0 = 30 deg."
    )
    return Answer(checks, {"map": figure_map(found), "courses": figure_courses(runs)}, note)


def figure_map(found, what="1: rho after 10 revolutions (MAG Fig. 3.4.1)"):
    """Isolines of rho over (i, theta0)."""
    figure, (axes,) = new_figure(f"Preliminary reorientation {what}", height=4.4)
    levels = (1, 2, 3, 4, 6, 8, 10, 12, 14, 16, 18, 19)
    shaded_map(axes, GRID, GRID, found, levels, "rho [deg]", "%g°")
    label(axes, "inclination [deg]", "theta₀ [deg]", legend=False)
    axes.set(xticks=range(0, 91, 15), yticks=range(0, 91, 15))
    return figure


def figure_courses(runs):
    """rho over revolutions."""
    figure, (axes,) = new_figure("Preliminary reorientation 1 (MAG Fig. 3.4.2)")
    for colour, (inclination, course) in zip(COLOURS, runs.items(), strict=True):
        axes.plot(U / (2.0 * math.pi), course, color=colour, lw=1.4, label=f"{inclination:g}°")
    label(axes, "revolutions", "rho [deg]", columns=6)
    axes.set(xlim=(0.0, 10.0), ylim=(0.0, 90.0), yticks=range(0, 91, 15))
    return figure


ENTRY = Entry(ids=("MAG-3.4.1", "MAG-3.4.2"), compute=compute)
