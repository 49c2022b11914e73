"""SDOT Table 2.1: stable rotations along the Sun's line, by the order of the moments of inertia.

The table is that of 2.4, whose domain is |B - A| << C: bodies with B - A = 0 and 0.05 C, either
way, are compared with it. Beyond it the eigenvalues of the linear motion are taken for all orders
of three different moments, those of Chibis-M, with Floquet's multipliers for comparison; there
|B - A|/C is 0.27 to 0.51, and the table claims nothing.
"""

import math
from itertools import permutations

import numpy as np

from gallery.drawing import new_figure
from gallery.entry import Answer, Entry, consistent, within
from gallery.sdot_runs import CONE, MOMENTS, SUN, averaged_case, spinner
from torquer.theory.periodic.floquet import exponents, monodromy, multipliers
from torquer.theory.slow.evolution import SDOT
from torquer.theory.slow.evolution.sdot import sun_weight
from torquer.theory.slow.gain_and_time import gain_at
from torquer.theory.slow.sun_spin import axis_equilibria, mean_matrix, stable_axes, sun_spin_system

ORDERS = list(permutations(MOMENTS.tolist()))
#: |B - A|/C of these orders; the table is for values far below one.
ASYMMETRIES = [abs(b - a) / c for a, b, c in ORDERS]
#: Rotation over omega0, k B0/(omega0 J_i), |B - A|/C and C/A of nearly axisymmetric bodies.
SPIN, EPS, ASYMMETRY, RATIOS = 5.0, 0.02, 0.05, (0.75, 1.4)
_STABLE, _GROWS, _FREE = ("attracts", "#bfe3d4"), ("repels", "#f4cdbd"), ("unstable", "#fbe8bf")


def printed_axis(a: float, b: float, c: float) -> int:
    """The axis that attracts by the table, for unequal moments."""
    if c > a:
        return 2
    return 1 if b > a else 0


def rows_of_nearly_equal() -> dict:
    """Stable (theta, phi) [deg] for C/A and the sign of B - A, by (2.20), (2.21)."""
    found = {}
    for ratio in RATIOS:
        here = spinner().model_copy(update={"axial_kg_m2": ratio, "transverse_kg_m2": 1.0})
        for sign in (1, -1, 0):
            case = SDOT.case(gain_at(SDOT, here, EPS), here)
            points = axis_equilibria(case, ASYMMETRY * sign, here.eta)
            found[ratio > 1.0, sign] = {_degrees(p) for p in points if p.stable}
    return found


def _degrees(point):
    phi = None if point.phi is None else round(math.degrees(point.phi))
    return round(math.degrees(point.theta)), phi


#: The table's rows: C > A, sign of B - A -> stable (theta, phi) [deg].
PRINTED = {
    **{(True, sign): {(0, None), (180, None)} for sign in (1, -1, 0)},
    (False, 1): {(90, 0), (90, 180)},
    (False, -1): {(90, 90), (90, 270)},
    (False, 0): {(90, None)},
}


def off_by_multipliers() -> float:
    """Greatest difference of Floquet's exponents from the mean eigenvalues, over eps^2."""
    worst, weight = 0.0, sun_weight(averaged_case(1.0)[0])
    for axis in range(3):
        here, second, third = np.roll(MOMENTS, -axis)
        turn = monodromy(sun_spin_system, spin=SPIN, second=second / here, third=third / here,
                         eps=EPS, cone=CONE, sun=math.acos(SUN[2]))  # fmt: skip
        found = np.sort(exponents(multipliers(turn), math.pi).real)
        mean = np.linalg.eigvals(mean_matrix(MOMENTS, axis, SPIN, EPS * weight * here))
        worst = max(worst, float(np.abs(found - np.sort(mean.real)).max()))
    return worst / EPS**2


def compute() -> Answer:
    """The rows of the table, and all orders of the moments."""
    stable = {order: stable_axes(order) for order in ORDERS}
    greatest = sum(stable[o] == tuple(x == max(o) for x in o) for o in ORDERS)
    as_printed = sum(stable[o] == tuple(k == printed_axis(*o) for k in range(3)) for o in ORDERS)
    found = rows_of_nearly_equal()
    rows = sum(found[key] == PRINTED[key] for key in PRINTED)
    checks = (
        within("rows reproduced for B - A = 0 and 0.05 C, either way, of 6", "all", rows, low=6),
        within("orders of the moments for which the axis of the greatest attracts, and no other, "
               "of 6", "always (text after the table)", greatest, low=6),
        consistent(within("beyond the table's domain: orders of the moments for which its axis "
                          "attracts, of 6", "no claim; all but A < C < B", as_printed, 5, 5)),
        consistent(within("Floquet's exponents less the mean eigenvalues, over eps^2",
                          "of the second order", off_by_multipliers(), high=0.1)),
    )  # fmt: skip
    note = (
        "The table is that of 2.4, for |B - A| << C, and all its rows come out there. Chibis-M's "
        f"moments lie outside that domain in any order: |B - A|/C is {min(ASYMMETRIES):.2f} to "
        f"{max(ASYMMETRIES):.2f}. The row 'C > A, any B' does not extend to all of them: for A < C "
        "< B axis 2 attracts, and axis 3, the intermediate one, is unstable. With the momentum "
        "along the Sun's line the kinetic energy falls, on average, while the momentum stays: for "
        "any body only the axis of the greatest moment can attract. Towards the Sun and away from "
        "it the linear motion is the same. Eigenvalues for 5 orbital rates, "
        f"k B0/(omega0 J) = {EPS:g}."
    )
    return Answer(checks, {"": picture(stable)}, note)


def picture(stable):
    """All orders and axes as a table."""
    figure, (axes,) = new_figure("Rotation along the Sun's line (SDOT Table 2.1)", height=3.3)
    axes.axis("off")
    rows, labels = [], []
    for order, here in stable.items():
        middle = sorted(order)[1]
        kinds = [_STABLE if ok else _FREE if x == middle else _GROWS
                 for x, ok in zip(order, here, strict=True)]  # fmt: skip
        rows.append([*kinds, (f"axis {printed_axis(*order) + 1}", "#eeeeee")])
        labels.append(" < ".join(np.array(list("ABC"))[np.argsort(order)]))
    cells = axes.table(
        cellText=[[text for text, _ in row] for row in rows],
        cellColours=[[colour for _, colour in row] for row in rows],
        rowLabels=labels, colLabels=["axis 1", "axis 2", "axis 3", "Table 2.1"],
        cellLoc="center", bbox=(0.16, 0.14, 0.84, 0.86),
    )  # fmt: skip
    cells.auto_set_font_size(False)
    cells.set_fontsize(10)
    for cell in cells.get_celld().values():
        cell.set_edgecolor("#ffffff")
        cell.set_linewidth(1.5)
    legend = (
        "attracts: nutation decays   repels: it grows   unstable: without S-dot, too\n"
        "Table 2.1 is for |B - A| ≪ C; here |B - A|/C is "
        f"{min(ASYMMETRIES):.2f} to {max(ASYMMETRIES):.2f}"
    )
    axes.text(0.16, 0.05, legend, transform=axes.transAxes, fontsize=9.5, color="#555555",
              va="top", linespacing=1.5)  # fmt: skip
    return figure


ENTRY = Entry(
    ids=("SDOT-2.1t",),
    compute=compute,
)
