"""WHEEL Fig. 9: angles with the least momenta of four wheels, against H3/H2."""

import numpy as np

from gallery.drawing import BLUE, RED, label, new_figure
from gallery.entry import Answer, Entry, Grade, Verdict, near, within
from torquer.spacecraft.wheel_array import angles, layout
from torquer.spacecraft.wheel_array.demand import Box, greatest_norm
from torquer.spacecraft.wheel_array.minimise import TOLERANCE
from torquer.spacecraft.wheel_array.search import find_layout, least_norm


def compute() -> Answer:
    """The closed form with H1 = H2, and a search that knows nothing of it."""
    ratio = np.linspace(0.2, 15.0, 297)
    alpha, beta = np.array([angles.least_four_sided((1.0, 1.0, r)) for r in ratio]).T
    at = angles.least_four_sided((1.0, 1.0, 6.4))
    found = find_layout(
        lambda p: layout.four_sided_pyramid(*p), least_norm(Box((1.0, 1.0, 6.4))), (1, 1),
        (89, 89), starts=4,
    )  # fmt: skip
    norms = [greatest_norm(layout.four_sided_pyramid(*a), Box((1.0, 1.0, 6.4)))
             for a in (at, (70.0, 21.5))]  # fmt: skip
    checks = (
        near("alpha at H3/H2 = 6.4", "70.0", at[0], "deg"),
        near("beta at H3/H2 = 6.4", "21.5", at[1], "deg"),
        within("closed form off the search", "(6.10)",
               np.abs(found.parameters - at).max(), high=1e-6, unit="deg"),
        within("residual of the optimality conditions after the search", "ours: 0",
               found.residual, high=TOLERANCE),
        within("norm at the printed angles over the least", "least",
               norms[1] / norms[0], high=1.0001),
    )  # fmt: skip
    figure, (axes,) = new_figure("Four wheels: angles of least momenta, H1 = H2")
    axes.plot(ratio, alpha, color=BLUE, label="alpha")
    axes.plot(ratio, beta, color=RED, label="beta")
    axes.plot([6.4, 6.4], [70.0, 21.5], "o", ms=5, color="#222222", label="printed")
    axes.axvline(6.4, color="#8a8a8a", lw=0.9, ls=":")
    label(axes, "H3/H2", "angle [deg]")
    axes.set(xlim=(0.0, 15.0), ylim=(10.0, 90.0))
    return Answer(checks, {"": figure})


ENTRY = Entry(
    ids=("WHEEL-9",),
    compute=compute,
    declared=Verdict.DIFFERS,
    grade=Grade.ROUNDING,
    reason=(
        "by the printed (6.10) H1 = H2 and H3/H2 = 6.4 give 69.8 and 21.6 deg. The printed 70.0 "
        "and 21.5 are those of H3/H2 = 6.44 and H1/H2 = 0.986, the unrounded (7.3), which our "
        "text has lost; the momenta differ by less than 1e-4"
    ),
)
