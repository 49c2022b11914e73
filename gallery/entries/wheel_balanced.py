"""WHEEL section 3: angles at which the rates about the axes are equal, and greatest volume."""

import numpy as np
from scipy.optimize import minimize_scalar

from gallery.drawing import BLUE, GREEN, RED, label, new_figure
from gallery.entry import Answer, Entry, Grade, Verdict, lost, near, uncertain, within
from gallery.wheels import INERTIA, LIMIT, worst_rate_deg_s
from torquer.spacecraft.wheel_array import angles, layout
from torquer.spacecraft.wheel_array.faces import volume

NOTE = (
    "The text's values of gamma and of the angle of greatest volume are lost; ours are from "
    "tan(gamma) = 3 I2/(2 I1) and from (6.11), which the text says gives that angle for equal "
    "momenta. The rate about every axis is greatest at a lesser angle than the balanced one, see "
    "the picture."
)


def reached(axes) -> np.ndarray:
    """Greatest components of the momentum over the moments of inertia, (3,) deg/s."""
    return np.degrees(LIMIT * np.abs(axes).sum(axis=0) / INERTIA)


def off_the_closed_form(count: int) -> float:
    """How far [deg] the angle of greatest volume is from that of (6.11) for equal momenta."""
    found = minimize_scalar(lambda gamma: -volume(layout.regular_pyramid(count, gamma)),
                            bounds=(10.0, 89.0), method="bounded",
                            options={"xatol": 1e-7})  # fmt: skip
    return abs(found.x - angles.least_regular((1.0, 1.0, 1.0)))


def compute() -> Answer:
    """Closed forms; the rates they balance; volumes of the pyramid and of another layout."""
    alpha, beta = angles.balanced_four_sided(INERTIA)
    gamma = angles.balanced_regular(6, INERTIA)
    four = reached(layout.four_sided_pyramid(alpha, beta))
    pyramid = volume(layout.regular_pyramid(6, angles.GREATEST_VOLUME_DEG))
    checks = (
        near("four wheels: alpha", "80.5", alpha, "deg"),
        near("four wheels: beta", "45.5", beta, "deg"),
        lost("six wheels: gamma", gamma, "deg"),
        within("greatest over least of the three rates, four wheels", "equal",
               four.max() / four.min(), 1.0 - 1e-12, 1.0 + 1e-12),
        lost("angle of greatest volume", angles.GREATEST_VOLUME_DEG, "deg"),
        # next to its greatest value the volume is flat: rounding, 1e-16 of it, moves the place by
        # the root of that, 1e-8 rad
        uncertain(within("angle of greatest volume, 4, 6 and 9 wheels, off that of (6.11)",
                         "the same for any number", max(map(off_the_closed_form, (4, 6, 9))),
                         high=1e-4, unit="deg"), 5e-6),
        within("six axes of an icosahedron: volume over the pyramid's",
               "none exceeds the pyramid, any n", volume(layout.icosahedral()) / pyramid,
               high=1.0 + 1e-9),
    )  # fmt: skip
    return Answer(checks, {"": picture(gamma)}, note=NOTE)


def picture(gamma: float):
    """Rates of six wheels against the angle of their pyramid."""
    steps = np.linspace(40.0, 89.0, 491)
    rates = np.array([reached(layout.regular_pyramid(6, g)) for g in steps])
    worst = [worst_rate_deg_s(layout.regular_pyramid(6, g)) for g in steps]
    figure, (axes,) = new_figure("Six wheels: rates against the angle of the pyramid")
    axes.plot(steps, rates[:, 0], color=RED, label="H1/I1")
    axes.plot(steps, rates[:, 1], color=GREEN, label="H2/I2")
    axes.plot(steps, worst, color=BLUE, label="about every axis")
    axes.axvline(gamma, color="#555555", lw=0.9, ls=":")
    label(axes, "angle gamma from height to edge [deg]", "rate [deg/s]")
    best = float(steps[int(np.argmax(worst))])
    axes.plot(best, max(worst), "o", ms=5, color=BLUE)
    axes.annotate(f"{max(worst):.3f} at {best:.1f} deg", (best, max(worst)), xytext=(-4, -14),
                  textcoords="offset points", ha="right", fontsize=9.5)  # fmt: skip
    axes.set(xlim=(40.0, 89.0), ylim=(0.0, 1.0))
    axes.annotate(f"balanced: {gamma:.1f}", (gamma, 0.9), xytext=(4, 0), fontsize=9.5,
                  textcoords="offset points")  # fmt: skip
    return figure


ENTRY = Entry(
    ids=("WHEEL-balanced",),
    compute=compute,
    declared=Verdict.DIFFERS,
    grade=Grade.REFUTED,
    reason=(
        "all angles agree. That a regular pyramid has the greatest volume for any number of "
        "wheels does not hold for six: axes of an icosahedron have 98.49 against 96.00, 2.6 % more"
    ),
)
