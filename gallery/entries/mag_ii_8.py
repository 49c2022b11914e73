"""MAG App. II, Fig. II.8: the field of the bench, three pairs of square coils.

The text prints the sides, and calls the field practically uniform in a ball of 650 mm; neither
their distance nor by how much. Taken: the distance at which the field is flattest in the centre,
by Biot and Savart; 'practically uniform' as within 2 % of the field in the centre.
"""

import numpy as np

from gallery.drawing import BLUE, GREEN, RED, label, new_figure
from gallery.entry import Answer, Entry, Verdict, chosen, consistent, near, within
from gallery.theory.square_coils import flattest_ratio, off_uniform, pair_field
from torquer.base.conventions import MU_0_H_M

SIDES_M, BALL_M, UNIFORM = (2.0, 1.9, 1.8), 0.65, 0.02
#: Distance over side of a square pair that textbooks give.
TEXTBOOK = 0.5445


def ball(radius_m: float) -> np.ndarray:
    """Points on a sphere, evenly."""
    n = np.arange(2000) + 0.5
    height, turn = 1.0 - 2.0 * n / len(n), np.pi * (1.0 + 5.0**0.5) * n
    across = np.sqrt(1.0 - height**2)
    return radius_m * np.stack([across * np.cos(turn), across * np.sin(turn), height], axis=1)


def compute() -> Answer:
    """The greatest departure from the field in the centre, on the surface of the ball."""
    ratio = flattest_ratio()
    edge = ball(0.5 * BALL_M)
    worst = {side: off_uniform(side, ratio * side, edge).max() for side in SIDES_M}
    # of a loop on its axis: the limit of a pair seen from afar is its dipole
    far = pair_field(1.0, ratio, [[0.0, 0.0, 100.0]])[0, 2]
    checks = (
        *(chosen(within(f"pair of {side:g} m: departure in the ball, greatest",
                        "practically uniform in a ball of 650 mm", 100.0 * worst[side],
                        high=100.0 * UNIFORM, unit="%"))
          for side in SIDES_M),
        consistent(near("distance over side, flattest", str(TEXTBOOK), ratio, printed="ours: "
                        "0.5445 of textbooks")),
        consistent(within("field from afar over that of the pair's dipole", "ours: 1",
                          far / (2.0 * MU_0_H_M * 2.0 / (4.0 * np.pi * 100.0**3)), 0.999, 1.001)),
    )  # fmt: skip
    amperes = {side: 1e-4 / pair_field(side, ratio * side, [[0.0] * 3])[0, 2] for side in SIDES_M}
    note = (
        "The distance of a pair is not printed; it is taken where the second derivative of the "
        f"field along its axis vanishes, {ratio:.4f} of the side. 1e5 nT takes "
        + ", ".join(f"{n:.0f}" for n in amperes.values()) + " ampere-turns per coil of "
        + ", ".join(f"{side:g}" for side in SIDES_M) + " m."
    )  # fmt: skip
    return Answer(checks, {"": picture(ratio)}, note)


def picture(ratio: float):
    """Departure over the radius of the ball."""
    figure, (axes,) = new_figure("Field of the bench's pairs of square coils (MAG Fig. II.8)",
                                 height=3.6)  # fmt: skip
    radii = np.linspace(0.0, 0.5, 51)
    for colour, side in zip((BLUE, GREEN, RED), SIDES_M, strict=True):
        worst = [100.0 * off_uniform(side, ratio * side, ball(r)).max() for r in radii]
        axes.plot(1e3 * radii, worst, color=colour, lw=1.3, label=f"{side:g} m")
    axes.axvline(500.0 * BALL_M, color="#555555", lw=0.9, ls=(0, (5, 3)))
    axes.axhline(100.0 * UNIFORM, color="#555555", lw=0.9, ls=(0, (5, 3)))
    axes.set(xlim=(0.0, 500.0), ylim=(0.0, 5.0))
    label(
        axes,
        "radius of the ball [mm]; dashed: printed, and what is called uniform",
        "greatest departure [%]",
    )
    return figure


ENTRY = Entry(
    ids=("MAG-II.8",),
    compute=compute,
    declared=Verdict.CHOSEN,
    reason=(
        "the text prints neither the distance of the coils of a pair nor by how much the field "
        "departs: at the flattest distance it is 1 % at the edge of the printed ball"
    ),
)
