"""Picture of a gain design: exact and averaged degree of stability over both gains."""

import numpy as np
from matplotlib.figure import Figure

from torquer.report.common.colours import BLUE, GREEN, RED, UNSTABLE
from torquer.report.common.figure import INK, legend_at_left, stack_panels
from torquer.theory.three_axis.floquet import mean_degrees, tabulate
from torquer.theory.three_axis.gain_search import DesignTask, ThreeAxisDesign, coarser
from torquer.theory.three_axis.sampled import sampled_family

_GRID = 101


def draw_design(task: DesignTask, made: ThreeAxisDesign) -> Figure:
    """Isolines over (k, k_a), continuous control, with the pairs found."""
    pairs = {"formula": (made.formula, RED), "refined": (made.refined, GREEN)}
    places = {name: (*_pair(each), colour) for name, (each, colour) in pairs.items()}
    k, k_a = (np.linspace(0.01, 1.0, _GRID) * 2.0 * max(p[j] for p in places.values())
              for j in (0, 1))  # fmt: skip
    exact, averaged = _degrees(task, k, k_a)
    figure, (axes,) = stack_panels("Three axes by coils: degree of stability [1/rad]", 1, 4.6)
    axes.grid(False)
    axes.contourf(k, k_a, exact, levels=[-np.inf, 0.0], colors=[UNSTABLE])
    if exact.max() > 0.0:
        levels = _levels(exact.max())
        axes.contour(k, k_a, averaged, levels=levels, colors=BLUE, linestyles="dashed",
                     linewidths=0.7)  # fmt: skip
        lines = axes.contour(k, k_a, exact, levels=levels, colors=INK, linewidths=1.1)
        axes.clabel(lines, fontsize=9, fmt="%g")
    axes.fill_between([], [], color=UNSTABLE, label="unstable")
    axes.plot([], [], color=INK, label="exact")
    axes.plot([], [], color=BLUE, ls="--", label="averaged")
    for name, (x, y, colour) in places.items():
        axes.plot(x, y, "o", color=colour, ms=7, label=name, clip_on=False)
    axes.set_xlabel("k, rate_gain_n_m_s_per_t2", fontsize=10)
    axes.set_ylabel("k_a, angle_gain_n_m_per_t2", fontsize=10)
    legend_at_left(axes, 5, 9.5)
    return figure


def _degrees(task: DesignTask, k, k_a) -> tuple[np.ndarray, np.ndarray]:
    """Exact degrees of the sampled loop, and averaged ones, `[k_a, k]`."""
    sampled = coarser(task.sampled)
    corners = {"rate_gain": (k[0], k[-1]), "angle_gain": (k_a[0], k_a[-1])}
    values = np.stack([each.ravel() for each in np.meshgrid(k, k_a)], axis=1)
    exact = np.maximum(sampled_family(sampled, corners).degrees(values), -1e3)
    smooth = tabulate(sampled.hold, corners, round(16 * sampled.hold.period / (2.0 * np.pi)))
    duty = sampled.cycle.hold_s / sum(sampled.cycle)
    averaged = mean_degrees(smooth, duty * values)
    return exact.reshape(len(k_a), -1), averaged.reshape(len(k_a), -1)


def _pair(candidate) -> tuple[float, float]:
    values = candidate.law.values()
    return values["rate_gain"], values["angle_gain"]


def _levels(greatest: float) -> np.ndarray:
    """About eight even levels of one or two digits."""
    step = greatest / 8.0
    digit = 10.0 ** np.floor(np.log10(step))
    step = digit * next(each for each in (1.0, 2.0, 5.0, 10.0) if each * digit >= step)
    return step * np.arange(1, 20)
