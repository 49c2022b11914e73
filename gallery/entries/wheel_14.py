"""WHEEL Fig. 14: the norm of four wheels' momenta over the angles of the pyramid."""

import numpy as np
from scipy.optimize import minimize_scalar

from gallery.drawing import BLUE, GREY, label, new_figure
from gallery.entry import Answer, Entry, Grade, Verdict, chosen, consistent, lost, near, within
from torquer.spacecraft.wheel_array import angles, layout
from torquer.spacecraft.wheel_array.demand import Box, Series, greatest_momentum, greatest_norm

#: As printed: H3/H2, where H1 = H2; the least norm [N m s]; beta [deg] of the section shown.
RATIO, F_MIN, SECTION = 6.4, 19.4, 21.5
#: f_min = (H1 + H2 + H3)/2.
H2 = 2.0 * F_MIN / (2.0 + RATIO)
DEMAND = Box((H2, H2, RATIO * H2))
#: What the printed angles need, see WHEEL-9.
UNROUNDED = Box((0.986 * H2, H2, 6.44 * H2))


def norm(alpha: float, beta: float, demand=DEMAND) -> float:
    """f(alpha, beta) [N m s]."""
    return greatest_norm(layout.four_sided_pyramid(alpha, beta), demand)


def least_of_section(demand):
    """Where the section has its least value [deg], and the value."""
    found = minimize_scalar(lambda alpha: norm(alpha, SECTION, demand), bounds=(1.0, 89.0),
                            method="bounded", options={"xatol": 1e-7})  # fmt: skip
    return found.x, found.fun


def minima(values) -> int:
    """How many values inside a grid are less than all eight around them."""
    rows, columns = values.shape
    shifts = [(i, j) for i in range(3) for j in range(3) if (i, j) != (1, 1)]
    around = [values[i : rows - 2 + i, j : columns - 2 + j] for i, j in shifts]
    return int((values[1:-1, 1:-1] < np.min(around, axis=0)).sum())


def compute() -> Answer:
    """The function on a grid; its least value and where it is; the section that is shown."""
    alpha, beta = np.linspace(20.0, 88.0, 69), np.linspace(4.0, 86.0, 83)
    values = np.array([[norm(a, b) for a in alpha] for b in beta])
    at = angles.least_four_sided(DEMAND.half)
    row, column = np.unravel_index(np.argmin(values), values.shape)
    before, after = peak(80.5, 45.5), peak(70.0, 21.5)
    where, least = least_of_section(DEMAND)
    checks = (
        lost("H2 that f_min = 19.4 implies", H2, "N m s"),
        consistent(within("f_min over (H1 + H2 + H3)/2", "ours: 1",
                          norm(*at) / (0.5 * DEMAND.half.sum()), 1.0 - 1e-9, 1.0 + 1e-9)),
        within("minima on the grid", "one minimum", minima(values), 1, 1),
        # the grid has steps of 1 deg
        within("grid: least alpha off the closed form", "(6.10)", abs(alpha[column] - at[0]),
               high=1.0, unit="deg"),
        within("grid: least beta off the closed form", "(6.10)", abs(beta[row] - at[1]),
               high=1.0, unit="deg"),
        chosen(near("section at beta = 21.5: least value", "19.4", least, "N m s")),
        near("section at beta = 21.5: alpha of the least", "70.0", where, "deg"),
        chosen(near("the same with H1, H2, H3 as 0.986, 1, 6.44", "70.0",
                    least_of_section(UNROUNDED)[0], "deg")),
        within("greatest of a wheel at 80.5, 45.5, by that H2", "practically 18 N m s", before,
               17.5, 18.0, "N m s"),
        near("over that at 70.0, 21.5", "1.4", before / after, printed="about 1.4"),
    )  # fmt: skip
    note = (
        "(7.3) is lost. With H1 = H2 and H3/H2 = 6.4 as printed, f_min = 19.4 N m s implies H2 = "
        f"{H2:.2f} N m s, which is therefore no check, nor is the least value of the section. But "
        "the wheels' momenta that follow from it, with H1 and H2 on a circle as in (6.8), are "
        "those of Figs 12 and 13."
    )
    return Answer(checks, {"": picture(alpha, beta, values, at)}, note)


def peak(alpha: float, beta: float) -> float:
    """Greatest momentum of a wheel [N m s] by the pseudo-inverse, H1 and H2 going round."""
    u = np.radians(np.arange(0.0, 360.0, 0.5))
    going_round = np.column_stack([H2 * np.cos(u), H2 * np.sin(u), np.full(len(u), RATIO * H2)])
    return greatest_momentum(layout.four_sided_pyramid(alpha, beta), Series(going_round))


def picture(alpha, beta, values, at):
    """Contours, with the least value and the angles of section 3."""
    title = "Norm of four wheels' momenta [N m s], and its section at beta = 21.5 deg"
    figure, (axes, cut) = new_figure(title, 2, 6.6, height_ratios=(1.8, 1.0), sharex=True)
    levels = [19.6, 20, 21, 22, 24, 26, 28, 32, 36, 40, 50, 60]
    drawn = axes.contour(alpha, beta, values, levels=levels, cmap="viridis", linewidths=1.1)
    axes.clabel(drawn, fmt="%g", fontsize=8.5)
    marks = ((at, f"least: {norm(*at):.1f}"),
             ((80.5, 45.5), f"balanced rates: {norm(80.5, 45.5):.1f}"))  # fmt: skip
    for (a, b), caption in marks:
        axes.plot(a, b, "o", ms=5, color="#222222")
        axes.annotate(caption, (a, b), xytext=(-6, 6), textcoords="offset points", fontsize=9.5,
                      ha="right", bbox={"fc": "white", "ec": "none", "pad": 0.8})  # fmt: skip
    axes.axhline(SECTION, color=BLUE, lw=0.9, ls=(0, (5, 3)))
    label(axes, "", "beta [deg]", legend=False)
    cut.plot(alpha, [norm(a, SECTION) for a in alpha], color=BLUE)
    where, least = least_of_section(DEMAND)
    cut.plot(where, least, "o", ms=5, color="#222222")
    cut.annotate(f"{least:.1f} at {where:.1f} deg", (where, least), xytext=(0, 8), ha="center",
                 textcoords="offset points", fontsize=9.5)  # fmt: skip
    cut.axhline(F_MIN, color=GREY, lw=0.9, ls=(0, (5, 3)))
    cut.annotate("printed 19.4", (21.0, F_MIN), xytext=(0, 3), textcoords="offset points",
                 fontsize=9.5, color="#555555")  # fmt: skip
    label(cut, "alpha [deg]", "f at 21.5 deg", legend=False)
    cut.set(xlim=(20.0, 88.0), ylim=(15.0, 60.0))
    return figure


ENTRY = Entry(
    ids=("WHEEL-14",),
    compute=compute,
    declared=Verdict.DIFFERS,
    grade=Grade.ROUNDING,
    reason=(
        "(7.3) is lost. With H1 = H2 and H3/H2 = 6.4 as printed the section at 21.5 deg has its "
        "least value at 69.8 deg, not 70.0, as in WHEEL-9. The least value itself, 19.4, was used "
        "to find H2; the momenta of the wheels of Figs 12 and 13 follow from it"
    ),
)
