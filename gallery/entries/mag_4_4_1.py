"""MAG Figs. 4.4.1, 4.4.2: exact exponents against the averaged ones; where they are unstable.

The figures' axes are lost. Here first gains about the parabola, K up to 4; second gains of which
the position part prevails, K_a up to 1 and K up to 0.3.
"""

import math

import numpy as np

from gallery.drawing import BLUE, RED, label, new_figure
from gallery.entry import Answer, Entry, Verdict, chosen, consistent, near, within
from gallery.holding import HIGH_DEG, LOW_DEG, edge, hold, strength_unit, with_gains
from torquer.theory.three_axis.floquet import exact_stability, stability_chart
from torquer.theory.three_axis.gain_search import DesignTask, design_gains
from torquer.theory.three_axis.sampled import Cycle, SampledHold
from torquer.theory.three_axis.search import first_crossing

STRENGTHS = (0.05, 0.5, 1.0, 2.0, 4.0)
GRID = 100


def at_strength(held, strength: float):
    """The hold on the parabola at K."""
    k = strength * strength_unit(held)
    return with_gains(held, k, float(edge(held, k)))


def parts_left(held) -> list[float]:
    """Exact degree over the averaged one on the parabola, as K grows."""
    found = (exact_stability(at_strength(held, strength)) for strength in STRENGTHS)
    return [each.degree / each.averaged_degree for each in found]


def chart(held, strengths, position_strengths):
    """Exact and averaged degree `[K_a, K]` over both strengths."""
    unit, n = strength_unit(held), held.rate_rad_s
    return stability_chart(
        held, ("rate_gain", unit / n * strengths), ("angle_gain", unit * position_strengths)
    )


def onset(held, strength: float = 0.05) -> float:
    """K_a at which the exact system becomes unstable at K."""
    strengths = np.array([strength, 1.001 * strength])

    def degree(position_strengths):
        found = chart(held, strengths, position_strengths)
        return found.degree_of_stability.values[:, 0]

    return first_crossing(degree, np.linspace(0.1, 1.0, 91))


def with_gravity():
    """The best scalar gains at 70 deg with gravity gradient: error, torque they ask for."""
    held = hold(HIGH_DEG, gravity_gradient=True)
    task = DesignTask(SampledHold(held, Cycle(10.0)), limit_a_m2=10.0, gain_margin=1.0)
    made = design_gains(task).refined
    sampled = SampledHold(held, Cycle(10.0))
    torque = np.cross(made.error.dipoles_a_m2, sampled.maps.b_body_t)
    return made.error, float(np.linalg.norm(torque, axis=1).max())


def compute() -> Answer:
    """Both charts, and the accuracy that gravity leaves."""
    low, high = hold(LOW_DEG), hold(HIGH_DEG)
    parts, onsets = parts_left(low), [onset(held) for held in (low, high)]
    strengths = np.linspace(0.02, 4.0, GRID)
    near_edge = chart(low, strengths, np.linspace(0.02, 2.0, GRID))
    prevailing = chart(low, np.linspace(0.003, 0.3, GRID), np.linspace(0.01, 1.0, GRID))
    slope = math.log((1.0 - parts[1]) / (1.0 - parts[0])) / math.log(STRENGTHS[1] / STRENGTHS[0])
    error, torque = with_gravity()
    checks = (
        within("exact degree over the averaged one on the parabola, K = 0.05 to 4: greatest step "
               "up", "diverge ever more as the gains grow", np.diff(parts).max(), high=0.0),
        consistent(near("order of the difference as the gains fall", "2", slope, tolerance=0.05,
                        printed="agree for small gains")),
        within("position part prevails: least exact degree of the chart",
               "a region of instability", prevailing.degree_of_stability.min(), high=-1e-3,
               unit="1/rad"),
        within("the same of the averaged equations", "which the averages do not have",
               prevailing.averaged_degree.min(), low=0.0, unit="1/rad"),
        chosen(within("70 deg, gravity gradient, gains of the greatest degree: greatest torque "
                      "in the steady motion", "at most 5e-6 N m", torque, high=5e-6, unit="N m")),
        chosen(within("the same: root mean square of the error", "little better than 10 deg",
                      math.degrees(error.rms_rad), 7.0, 10.0, "deg")),
    )  # fmt: skip
    text = zip(STRENGTHS, parts, strict=True)
    left = ", ".join(f"{part:.4g} at K = {strength:g}" for strength, part in text)
    note = (
        f"On the parabola at 30 deg the exact degree over the averaged one is {left}. At K = 0.05 "
        f"the region of instability begins at K_a = {onsets[0]:.3f} at 30 deg, {onsets[1]:.3f} at "
        "70 deg. In inertial space gravity has a mean torque and slope, which the text's averages "
        "leave out: on the parabola of 70 deg the loop is unstable with it up to K = 2. With the "
        f"best gains the error is up to {math.degrees(error.greatest_rad):.1f} deg, "
        f"{math.degrees(error.rms_rad):.1f} deg in the root mean square."
    )
    figures = {
        "exact-and-averaged": picture_of_both(near_edge, low),
        "instability": picture_of_instability(prevailing, low, onsets[0]),
    }
    return Answer(checks, figures, note)


def picture_of_both(found, held):
    """Isolines of both degrees over (K, K_a), and the parabola."""
    title = "Exact and averaged degree of stability, inclination 30 deg (MAG Fig. 4.4.1)"
    figure, (axes,) = new_figure(title, height=4.4)
    unit, n = strength_unit(held), held.rate_rad_s
    x, y = found.rate_gain.values * n / unit, found.angle_gain.values / unit
    levels, low = np.array([0.0, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4]), {"fontsize": 9, "fmt": "%g"}
    axes.grid(False)
    for name, colour, style in (("averaged_degree", BLUE, "dashed"),
                                ("degree_of_stability", "#222222", "solid")):  # fmt: skip
        lines = axes.contour(x, y, found[name].values, levels=levels[1:], colors=colour,
                             linestyles=style, linewidths=1.1)  # fmt: skip
        axes.clabel(lines, **low)
    unstable = found.degree_of_stability.values
    axes.contourf(x, y, unstable, levels=[-np.inf, 0.0], colors=["#f3d3cf"])
    axes.plot(x, edge(held, unit * x) / unit, color=RED, lw=1.8, label="parabola")
    axes.plot([], [], color="#222222", label="exact")
    axes.plot([], [], color=BLUE, ls="--", label="averaged")
    axes.fill_between([], [], color="#f3d3cf", label="exact: unstable")
    label(axes, "K", "K_a")
    axes.set(xlim=(0.0, 4.0), ylim=(0.0, 2.0))
    return figure


def picture_of_instability(found, held, onset_low: float):
    """Degree over (K, K_a) where the position part prevails."""
    title = "Position part prevails, inclination 30 deg (MAG Fig. 4.4.2)"
    figure, (axes,) = new_figure(title, height=4.4)
    unit, n = strength_unit(held), held.rate_rad_s
    x, y = found.rate_gain.values * n / unit, found.angle_gain.values / unit
    degree = found.degree_of_stability.values
    axes.grid(False)
    axes.contourf(x, y, degree, levels=[-np.inf, 0.0], colors=["#f3d3cf"])
    levels = [-0.1, -0.05, -0.02, 0.0, 0.01, 0.02, 0.03, 0.04]
    lines = axes.contour(x, y, degree, levels=levels, colors="#222222", linewidths=1.0)
    axes.clabel(lines, fontsize=9, fmt="%g")
    axes.fill_between([], [], color="#f3d3cf", label="exact: unstable")
    axes.plot([], [], color="#222222", label="exact degree [1/rad]")
    axes.plot(0.05, onset_low, "o", color=RED, ms=7, label=f"K = 0.05: K_a = {onset_low:.3f}")
    label(axes, "K", "K_a")
    return figure


ENTRY = Entry(
    ids=("MAG-4.4.1", "MAG-4.4.2"),
    compute=compute,
    declared=Verdict.CHOSEN,
    reason=(
        "the divergence and the region of instability are as printed. The text does not "
        "give the gains for the torque of 5e-6 N m and the accuracy of 10 deg. Those of the "
        "greatest exact degree with gravity gradient are taken here, on the orbit of 70 deg"
    ),
    slow=True,
)
