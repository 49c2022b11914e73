"""MAG Fig. 2.1.1: the momentum of a sphere under B-dot, for several inclinations.

The text has lost eps, rho0 and the inclinations of the curves: eps = 0.1 as in Fig. 2.1.4, the
momentum at first 30 deg from the cone axis.
"""

import math

import numpy as np

from gallery.drawing import COLOURS, label, new_figure
from gallery.entry import Answer, Entry, Verdict, consistent, lost, within
from torquer.computer.laws.bdot import BdotRate
from torquer.theory.slow.comparison import compare
from torquer.theory.slow.evolution import BDOT, bdot
from torquer.theory.slow.evolution.model import Slow
from torquer.theory.slow.full_motion import Fast
from torquer.theory.slow.slow_motion import evolve
from torquer.theory.slow.spinner import Spinner

EPS, RHO0 = 0.1, math.radians(30.0)
INCLINATIONS_DEG = (10.0, 30.0, 45.577, 60.0, 75.0, 90.0)
U = np.linspace(0.0, 20.0 * math.pi, 401)
SPIN = 20.0


def curves() -> dict:
    """(l by the formula, l by integration) at U, for each inclination."""
    found = {}
    for inclination in INCLINATIONS_DEG:
        case = BDOT.case(EPS, Spinner(inclination_deg=inclination))
        path = evolve(BDOT, case, Slow(1.0, RHO0, 0.0, 1.0), U)
        found[inclination] = bdot.sphere(U, case, RHO0)[0], path.l
    return found


def full_error() -> float:
    """Greatest difference of the formula from Euler's equations, of a sphere at i = 60 deg."""
    spinner = Spinner(inclination_deg=60.0, momentum_n_m_s=SPIN)
    law = BdotRate(gain_a_m2_s_per_t=EPS).law()
    found = compare(law, spinner, Slow(1.0, RHO0, 0.0, 1.0), Fast(1.0, 1.0), 10.0)
    formula = bdot.sphere(found.u, BDOT.case(EPS, spinner), RHO0)[0]
    return float(np.abs(found.full.l - formula).max())


def compute() -> Answer:
    """The closed formula against the integrated averages and against the full motion."""
    found = curves()
    apart = max(np.abs(formula - path).max() for formula, path in found.values())
    at = {i: formula[-1] for i, (formula, _) in found.items()}
    checks = (
        consistent(within("formula (2.1.11) from the integrated system (2.1.10), greatest",
                          "(2.1.11) is its solution", apart, high=1e-8)),
        consistent(within("formula from Euler's equations over u = 10, greatest, over eps",
                          "averaging errs by the order of eps", full_error() / EPS, high=1.0)),
        lost("l after 10 revolutions, i = 10 deg", at[10.0]),
        lost("l after 10 revolutions, i = 90 deg", at[90.0]),
    )  # fmt: skip
    slowest, fastest = max(at, key=at.get), min(at, key=at.get)
    note = (
        f"After 10 revolutions l = {at[slowest]:.3f} at {slowest:g} deg and {at[fastest]:.3f} at "
        f"{fastest:g} deg. Eventually l decays as exp(-2p eps u) below 45.58 deg and as "
        "exp(-(1 - p) eps u) above it: fastest there, at 2/3 eps. eps = 0.1 and rho0 = 30 deg are "
        "chosen here, the text's are lost."
    )
    return Answer(checks, {"": picture(found)}, note)


def picture(found):
    """The curves, on a logarithmic scale."""
    figure, (axes,) = new_figure("B-dot, a sphere: momentum (MAG Fig. 2.1.1)")
    for colour, (inclination, (formula, _)) in zip(COLOURS, found.items(), strict=True):
        axes.semilogy(
            U / (2.0 * math.pi), formula, color=colour, lw=1.4, label=f"{inclination:.3g}°"
        )
    label(axes, "revolutions", "angular momentum L / L₀", columns=6)
    axes.set(xlim=(0.0, 10.0), ylim=(0.01, 1.0))
    axes.set_yticks(
        [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0], ["0.01", "0.02", "0.05", "0.1", "0.2", "0.5", "1"]
    )
    axes.minorticks_off()
    return figure


ENTRY = Entry(
    ids=("MAG-2.1.1",),
    compute=compute,
    declared=Verdict.CONSISTENT,
    reason=(
        "the text has lost eps, rho0 and the inclinations of the figure and prints no number; the "
        "formula, the integrated averages and Euler's equations agree with one another"
    ),
    slow=True,
)
