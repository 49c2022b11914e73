"""MAG Figs. 2.1.2, 2.1.3: momentum after 2 and 10 revolutions of B-dot over (i, rho0).

eps, C/A and theta0 are lost here; taken from Fig. 2.1.4: eps = 0.1, A = 3, C = 2, theta0 = 1. What
the text says is also checked for other C/A and for other eps.
"""

import math

import numpy as np

from gallery.drawing import label, new_figure, shaded_map
from gallery.entry import Answer, Entry, Grade, Verdict, near, within
from torquer.theory.slow.evolution import BDOT
from torquer.theory.slow.slow_motion import map_evolution
from torquer.theory.slow.spinner import Spinner

GRID = np.linspace(0.0, 90.0, 100)
#: Where the inclination of 45.58 deg is.
MIDDLE = np.searchsorted(GRID, 45.58)
EPS, THETA_DEG, RATIO = 0.1, math.degrees(1.0), 2.0 / 3.0
#: Other C/A, other eps.
RATIOS, OTHER_EPS = (1.0 / 3.0, 2.0 / 3.0, 0.9, 1.0, 1.1, 1.5, 1.9), (0.03, 0.3)


def momentum_after(revolutions, theta_deg=THETA_DEG, ratio=RATIO, eps=EPS) -> np.ndarray:
    """l `[inclination, rho0]` over the grid."""
    axes = {"inclination_deg": GRID, "rho_deg": np.clip(GRID, 1e-6, 90.0 - 1e-6)}
    fixed = {"sigma_deg": 0.0, "theta_deg": theta_deg, "eps": eps}
    satellite = Spinner(inclination_deg=0.0, transverse_kg_m2=3.0, axial_kg_m2=3.0 * ratio)
    end = 2.0 * math.pi * revolutions
    return map_evolution(BDOT, axes, fixed, end, spinner=satellite).l


def mean_of_directions(values) -> np.ndarray:
    """Mean `[inclination]` over directions of the momentum spread evenly over the sphere."""
    return np.average(values, axis=1, weights=np.sin(np.radians(GRID)))


def pole_over_middle(**keys) -> float:
    """Mean l after 10 revolutions at 90 deg over that at 45.6 deg."""
    mean = mean_of_directions(momentum_after(10.0, **keys))
    return float(mean[-1] / mean[MIDDLE])


def spread_with_theta(ratio: float) -> float:
    """Greatest change of l after 2 revolutions with theta0 from 10 to 80 deg."""
    return float(np.abs(momentum_after(2.0, 10.0, ratio) - momentum_after(2.0, 80.0, ratio)).max())


def compute() -> Answer:
    """Two maps, and what the text reads from them."""
    two, ten = momentum_after(2.0), momentum_after(10.0)
    mean = mean_of_directions(ten)
    checks = (
        within("2 revolutions, rho0 = 90 deg: least rise of l from one inclination to the next",
               "damped faster at lower inclination", np.diff(two[:, -1]).min(), low=0.0),
        within("10 revolutions, mean over directions: l at 45.6 deg over l at 10 deg",
               "faster at higher inclination", mean[MIDDLE] / mean[11], high=1.0),
        within("10 revolutions, mean over directions: l at 90 deg over l at 45.6 deg",
               "faster at higher inclination", mean[-1] / mean[MIDDLE], high=1.0),
        near("inclination at which the dependence reverses", "46", even_inclination_deg(), "deg"),
    )  # fmt: skip
    best = GRID[mean.argmin()]
    others = [pole_over_middle(ratio=ratio) for ratio in RATIOS]
    others += [pole_over_middle(eps=eps) for eps in OTHER_EPS]
    spreads = ", ".join(f"{spread_with_theta(r):.2f} at {r:.2f}" for r in RATIOS)
    note = (
        f"Mean l after 10 revolutions: {mean[11]:.3f} at 10 deg, {mean[MIDDLE]:.3f} at 45.6 deg, "
        f"{mean[-1]:.3f} at 90 deg, least at {best:.0f} deg. With C/A from 1/3 to 1.9 and eps from "
        f"0.03 to 0.3 l at 90 deg is {min(others):.2f} to {max(others):.2f} times that at 45.6 "
        "deg. The text says that the figures hardly change with theta0: from 10 to 80 deg l after "
        f"2 revolutions changes by up to {spreads} (C/A, which the text does not give)."
    )
    return Answer(checks, pictures(two, ten), note)


def even_inclination_deg() -> float:
    """Inclination where 3p = 1: sin^2(Theta) = 2/3."""
    from scipy.optimize import brentq

    from torquer.environment.field.averaged import cone_angle

    return math.degrees(brentq(lambda i: 1.5 * math.sin(cone_angle(i)) ** 2 - 1.0, 0.3, 1.2))


def pictures(two, ten) -> dict:
    """Isolines of l."""
    figures = {}
    for name, values, levels in (
        ("2-revolutions", two, np.arange(0.1, 1.0, 0.1)),
        ("10-revolutions", ten, (0.02, 0.03, 0.04, 0.05, 0.06, 0.08, 0.1, 0.2, 0.4, 0.6, 0.8)),
    ):
        number = "2.1.2" if name.startswith("2") else "2.1.3"
        title = f"B-dot: momentum L / L₀ after {name.replace('-', ' ')} (MAG Fig. {number})"
        figure, (axes,) = new_figure(title, height=4.4)
        shaded_map(axes, GRID, GRID, values, levels, "L / L₀")
        label(axes, "inclination [deg]", "rho₀ [deg]", legend=False)
        axes.set(xticks=range(0, 91, 15), yticks=range(0, 91, 15))
        figures[name] = figure
    return figures


ENTRY = Entry(
    ids=("MAG-2.1.2", "MAG-2.1.3"),
    compute=compute,
    declared=Verdict.DIFFERS,
    grade=Grade.REFUTED,
    reason=(
        "in the long run the momentum decays as exp(-2p eps u) below i0 = 45.58 deg and as "
        "exp(-(1 - p) eps u) above it, as by (2.1.11) for a sphere. It is faster with inclination "
        "up to i0 only, and slower from there to the pole, except for momenta that start near the "
        "cone axis. This holds for every C/A and eps tried"
    ),
    slow=True,
)
