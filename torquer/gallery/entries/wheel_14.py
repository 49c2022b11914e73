"""WHEEL Fig. 14: the norm of four wheels' momenta over the angles of the pyramid."""

import numpy as np

from torquer.gallery.drawing import new_figure
from torquer.gallery.entry import Answer, Entry, lost, near, within
from torquer.wheel_array import angles, layout
from torquer.wheel_array.demand import Box, Series, greatest_momentum, greatest_norm

#: H2 [N m s] at which f_min is 19.4; H1 = H2 and H3 = 6.4 H2 as printed.
H2 = 4.62
DEMAND = Box((H2, H2, 6.4 * H2))


def norm(alpha: float, beta: float) -> float:
    """f(alpha, beta) [N m s]."""
    return greatest_norm(layout.four_sided_pyramid(alpha, beta), DEMAND)


def compute() -> Answer:
    """The function on a grid; its least value and where it is."""
    alpha, beta = np.linspace(20.0, 88.0, 69), np.linspace(4.0, 86.0, 83)
    values = np.array([[norm(a, b) for a in alpha] for b in beta])
    at = angles.least_four_sided(DEMAND.half)
    row, column = np.unravel_index(np.argmin(values), values.shape)
    before, after = peak(80.5, 45.5), peak(70.0, 21.5)
    checks = (
        lost("H2 that f_min = 19.4 implies", H2, "N m s"),
        within("f_min over (H1 + H2 + H3)/2", "our own: 1",
               norm(*at) / (0.5 * DEMAND.half.sum()), 1.0 - 1e-9, 1.0 + 1e-9),
        within("grid: least alpha off the closed form", "one minimum, at (6.10)",
               abs(alpha[column] - at[0]), high=1.0, unit="deg"),
        within("grid: least beta off the closed form", "one minimum, at (6.10)",
               abs(beta[row] - at[1]), high=1.0, unit="deg"),
        within("greatest of a wheel at 80.5, 45.5, by that H2", "practically 18 N m s", before,
               17.5, 18.0, "N m s"),
        near("over that at 70.0, 21.5", "1.4", before / after, printed="about 1.4"),
    )  # fmt: skip
    note = (
        "(7.3) is lost. With H1 = H2 and H3/H2 = 6.4 as printed, f_min = 19.4 N m s says "
        "H2 = 4.62 N m s, no check of ours; but the wheels' momenta that follow from it, with H1 "
        "and H2 on a circle as in (6.8), are those of Figs 12 and 13."
    )
    return Answer(checks, {"": picture(alpha, beta, values, at)}, note)


def peak(alpha: float, beta: float) -> float:
    """Greatest momentum of a wheel [N m s] by the pseudo-inverse, H1 and H2 going round."""
    u = np.radians(np.arange(0.0, 360.0, 0.5))
    going_round = np.column_stack([H2 * np.cos(u), H2 * np.sin(u), np.full(len(u), 6.4 * H2)])
    return greatest_momentum(layout.four_sided_pyramid(alpha, beta), Series(going_round))


def picture(alpha, beta, values, at):
    """Contours, with the least value and the angles of section 3."""
    figure, (axes,) = new_figure("Norm of four wheels' momenta [N m s]", height=4.4)
    levels = [19.6, 20, 21, 22, 24, 26, 28, 32, 36, 40, 50, 60]
    drawn = axes.contour(alpha, beta, values, levels=levels, cmap="viridis", linewidths=1.1)
    axes.clabel(drawn, fmt="%g", fontsize=8.5)
    marks = ((at, f"least: {norm(*at):.1f}"),
             ((80.5, 45.5), f"balanced rates: {norm(80.5, 45.5):.1f}"))  # fmt: skip
    for (a, b), told in marks:
        axes.plot(a, b, "o", ms=5, color="#222222")
        axes.annotate(told, (a, b), xytext=(-6, 6), textcoords="offset points", fontsize=9.5,
                      ha="right")  # fmt: skip
    axes.set_xlabel("alpha [deg]", fontsize=10)
    axes.set_ylabel("beta [deg]", fontsize=10)
    return figure


ENTRY = Entry(ids=("WHEEL-14",), compute=compute)
