"""MAG Figs. 4.3.1, 4.3.2: averaged degree of stability over both gains, with the parabola.

The figures' axes are lost: gains here up to twice those printed for Fig. 4.4.3, k = 20 and
k_a = 0.015.
"""

import math

import numpy as np

from gallery.drawing import RED, label, new_figure, shaded_map
from gallery.entry import Answer, Entry, Grade, Verdict, consistent, near, within
from gallery.holding import HIGH_DEG, LOW_DEG, edge, factors, hold
from torquer.theory.three_axis.averaged import averaged_degree, plateau_edge

K = np.linspace(0.2, 40.0, 200)
K_A = np.linspace(3e-4, 0.06, 200)
CASES = 60


def degrees(held) -> np.ndarray:
    """Averaged degree [1/rad of u] `[k, k_a]` over the grid."""
    k, k_a = np.meshgrid(K, K_A, indexing="ij")
    return averaged_degree(factors(held), k / held.rate_rad_s, k_a) / held.rate_rad_s


def edge_of_degrees(mu) -> float:
    """Least k_a with the greatest degree for k = 1, by bisection on the degree."""
    low, high = 0.0, 1.0 / mu.min()
    plateau = averaged_degree(mu, 1.0, high)
    while high - low > 1e-13 / mu.min():
        middle = 0.5 * (low + high)
        below = averaged_degree(mu, 1.0, middle) < plateau * (1.0 - 1e-13)
        low, high = (middle, high) if below else (low, middle)
    return high


def worst_edge() -> float:
    """Greatest relative error of the one formula for random bodies and inclinations."""
    draw, worst, count = np.random.default_rng(20), 0.0, 0
    while count < CASES:
        moments = tuple(draw.uniform(0.3, 2.5, 3).tolist())
        if 2.0 * max(moments) < 0.98 * sum(moments):
            mu = factors(hold(float(draw.uniform(5.0, 175.0)), moments))
            mu = mu / mu.max()
            worst = max(worst, abs(edge_of_degrees(mu) / float(plateau_edge(mu, 1.0)) - 1.0))
            count += 1
    return worst


def ratio(held, k_part: float, k_a_part: float) -> float:
    """Degree with parts of k = 20 and of its k_a on the parabola, over the degree with those."""
    mu, k, k_a = factors(held), 20.0 / held.rate_rad_s, float(edge(held, 20.0))
    return float(averaged_degree(mu, k_part * k, k_a_part * k_a) / averaged_degree(mu, k, k_a))


def damping_share(held) -> float:
    """k over the root of k_a on the parabola, both times B0^2: as torques, in any unit."""
    b0 = np.linalg.norm(held.free(np.zeros(1)).b_body_t)
    return 20.0 * b0 / math.sqrt(edge(held, 20.0))


def compute() -> Answer:
    """Both maps, and what the text says of them."""
    both = low, high = hold(LOW_DEG), hold(HIGH_DEG)
    at_20 = [float(edge(held, 20.0)) for held in both]
    checks = (
        near("30 deg: k_a of the parabola for k = 20", "0.015", at_20[0], "N m/T^2",
             printed="0.015 (gains of Fig. 4.4.3)"),
        within("k_a a quarter of the parabola's: degree over that on it, both orbits",
               "falls if the damping part prevails", max(ratio(held, 1.0, 0.25) for held in both),
               high=0.9),
        within("k_a four times the parabola's: the same", "falls if the position part prevails",
               max(ratio(held, 1.0, 4.0) for held in both), high=0.999),
        within("share of the damping torque on the parabola, 70 deg over 30 deg",
               "somewhat more at high inclination", damping_share(high) / damping_share(low),
               1.0, 1.3),
        consistent(within(f"one formula for any order of moments: worst of {CASES} random bodies "
                          "and inclinations, relative to the edge of the plateau",
                          "three formulas for three cases", worst_edge(), high=1e-9)),
    )  # fmt: skip
    note = (
        "The three printed parabolas are one: K_a = K^2 (2 r_max - r_min)/(8 r_max^2), r over 1, "
        "rho1, rho2. It is the lower edge of a plateau, not a ridge: for a given k the degree "
        f"stays K/(2 r_max) above it. For k = 20 N m/T^2 it has k_a = {at_20[0]:.4f} at 30 deg and "
        f"{at_20[1]:.4f} at 70 deg, where the field is stronger."
    )
    figures = {
        "30-deg": picture(low, "30 deg (MAG Fig. 4.3.1)"),
        "70-deg": picture(high, "70 deg (MAG Fig. 4.3.2)"),
    }
    return Answer(checks, figures, note)


def picture(held, title: str):
    """Isolines over (k, k_a) and the parabola."""
    figure, (axes,) = new_figure(f"Averaged degree of stability, inclination {title}", height=4.4)
    found = 1e3 * degrees(held)
    levels = np.arange(0.5, 1e3 * found.max(), 0.5)
    shaded_map(axes, K, 1e3 * K_A, found, levels[levels < found.max()], "10³ degree [1/rad]")
    axes.plot(K, 1e3 * edge(held, K), color=RED, lw=1.8, label="parabola: edge of the plateau")
    label(axes, "k [N m/T²], of ω/ω₀", "10³ k_a [N m/T²]")
    axes.set_ylim(0.3, 60.0)
    return figure


ENTRY = Entry(
    ids=("MAG-4.3.1", "MAG-4.3.2"),
    compute=compute,
    declared=Verdict.DIFFERS,
    grade=Grade.REFUTED,
    reason=(
        "for a given k the averaged degree does not fall as k_a grows beyond the parabola: it "
        "stays as it is (the exact one does change, MAG-4.4.1). The rest is as printed"
    ),
    slow=True,
)
