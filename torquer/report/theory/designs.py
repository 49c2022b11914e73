"""Pictures of designs: coils by gauge, gains of B-dot that were flown, gains for three axes."""

from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure, SubFigure
from matplotlib.ticker import MaxNLocator

from torquer.design.coil_design import CoilSizes
from torquer.design.gain_sweep import GainSweep
from torquer.design.three_axis_answer import ThreeAxisAnswer
from torquer.report.common.colours import BLUE, GREEN, ORANGE, RED, UNSTABLE
from torquer.report.common.figure import INK, legend_at_left, stack_panels
from torquer.theory.three_axis.floquet import mean_degrees, tabulate
from torquer.theory.three_axis.gain_search import DesignTask, coarser
from torquer.theory.three_axis.sampled import sampled_family

_GRID = 101
_TIMES = ((0.5, "half", BLUE), (0.9, "90 %", ORANGE), (1.0, "last", RED))


def draw_coils(answer: CoilSizes, on: SubFigure | None = None) -> Figure:
    """Voltage and current of the gauges that fit, all at the same dipole; limits are dashed."""
    asked, gauges = answer.request, [coil.awg for coil in answer.coils]
    title = f"{asked.dipole_a_m2:g} A m² with {asked.mass_kg:g} kg of {asked.metal}"
    figure, panels = stack_panels(title, 2, 4.6, on, sharex=True)
    curves = (
        ("voltage [V]", [coil.voltage_v for coil in answer.coils], BLUE, asked.voltage_v),
        ("current [A]", [coil.current_a for coil in answer.coils], RED, asked.current_a),
    )
    for axes, (label, values, colour, limit) in zip(panels, curves, strict=True):
        axes.semilogy(gauges, values, "o-", color=colour, ms=4, lw=1.3)
        axes.set_ylabel(label, fontsize=9.5)
        if limit is not None:
            axes.axhline(limit, color=colour, lw=1.0, ls="--")
    panels[-1].xaxis.set_major_locator(MaxNLocator(integer=True))
    panels[-1].set_xlabel("wire gauge [AWG]", fontsize=10)
    return figure


def draw_gains(sweep: GainSweep, on: SubFigure | None = None) -> Figure:
    """Flights over their gains: times, energies, dipoles; on a page without dipoles."""
    title = f"{sweep.scenario.name}: gain of B-dot".lstrip(": ")
    title += f", stopped below {sweep.below_deg_s:.3g} deg/s"
    title += ": doubtful" * bool(sweep.verdict.doubts)
    drawn = [_draw_times, _draw_energies, _draw_dipoles][: 3 if on is None else 2]
    figure, panels = stack_panels(title, len(drawn), 7.2, on, sharex=True)
    gains = np.array([each.gain for each in sweep.flights])
    for axes, draw in zip(panels, drawn, strict=True):
        draw(axes, sweep, gains)
        axes.axvline(sweep.chosen.gain, color=GREEN, lw=1.6, label="chosen")
    legend_at_left(panels[0], 7)
    panels[-1].set_xscale("log")
    label = "gain [A m² s/T]"
    if not all(np.isfinite(each.settled_s).all() for each in sweep.flights):
        label += "\nmissing points: fewer stop during the flight"
    panels[-1].set_xlabel(label, fontsize=10)
    return figure


def _draw_times(axes, sweep: GainSweep, gains: np.ndarray) -> None:
    """Times to stop, flown and by theory."""
    for part, name, colour in _TIMES:
        hours = np.array([each.settled_by(part) for each in sweep.flights]) / 3600.0
        axes.plot(gains, np.where(np.isfinite(hours), hours, np.nan), "o-", color=colour, ms=4,
                  lw=1.3, label=name)  # fmt: skip
    first = np.array([each.first_by(0.5) for each in sweep.flights]) / 3600.0
    axes.plot(gains, np.where(np.isfinite(first), first, np.nan), "o:", color=BLUE, ms=3, lw=1.0,
              label="half, first")  # fmt: skip
    theory = np.array([*sweep.halves_by_theory_s.values()]) / 3600.0
    axes.plot(gains, np.where(np.isfinite(theory), theory, np.nan), color=INK, lw=1.0, ls="--",
              label="half, by theory")  # fmt: skip
    axes.set_ylabel("stopped after [h]", fontsize=9.5)
    axes.set_ylim(0.0, 1.05 * sweep.duration_s / 3600.0)
    if sweep.wanted.within_s is not None:
        axes.axhline(sweep.wanted.within_s / 3600.0, color=GREEN, lw=1.2, label="wanted")


def _draw_energies(axes, sweep: GainSweep, gains: np.ndarray) -> None:
    energies = [each.energy_j.mean() for each in sweep.flights]
    axes.plot(gains, energies, "o-", color=BLUE, ms=4, lw=1.3)
    axes.set_ylabel("energy [J], mean", fontsize=9.5)


def _draw_dipoles(axes, sweep: GainSweep, gains: np.ndarray) -> None:
    limit = sweep.tumbling.coils.limits_a_m2().min()
    shares = [100.0 * each.peak_a_m2.max() / limit for each in sweep.flights]
    axes.plot(gains, shares, "o-", color=BLUE, ms=4, lw=1.3)
    axes.set_ylim(0.0, 1.05 * max(100.0, *shares))
    axes.set_ylabel("peak dipole [% of limit]", fontsize=9.5)


class GainMap(NamedTuple):
    """Degrees of stability `[k_a, k]` of the sampled loop, exact and averaged, over both gains."""

    k: np.ndarray
    k_a: np.ndarray
    exact: np.ndarray
    averaged: np.ndarray


def gain_map(answer: ThreeAxisAnswer) -> GainMap:
    """Degrees of stability around the pairs of gains found; seconds of computing."""
    places = [(k, k_a) for k, k_a, _ in _places(answer).values()]
    k, k_a = (np.linspace(0.01, 1.0, _GRID) * 2.0 * max(p[j] for p in places) for j in (0, 1))
    return GainMap(k, k_a, *_degrees(answer.task, k, k_a))


def _places(answer: ThreeAxisAnswer) -> dict[str, tuple[float, float, str]]:
    """The pairs of gains by name, and their colours."""
    pairs = {"formula": (answer.design.formula, RED), "refined": (answer.design.refined, GREEN)}
    gains = {name: (each.law.values(), colour) for name, (each, colour) in pairs.items()}
    return {
        name: (values["rate_gain"], values["angle_gain"], colour)
        for name, (values, colour) in gains.items()
    }


def draw_design(
    answer: ThreeAxisAnswer, over: GainMap | None = None, on: SubFigure | None = None
) -> Figure:
    """Isolines over (k, k_a), continuous control, with the pairs found."""
    k, k_a, exact, averaged = over or gain_map(answer)
    figure, (axes,) = stack_panels("Three axes by coils: degree of stability [1/rad]", 1, 4.6, on)
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
    for name, (x, y, colour) in _places(answer).items():
        said = name + ": doubtful" * bool(answer.verdict_on(name).doubts)
        axes.plot(x, y, "o", color=colour, ms=7, label=said, clip_on=False)
    axes.set_xlabel("k, of the rate [N m s/T²]", fontsize=10)
    axes.set_ylabel("k_a, of the angle [N m/T²]", fontsize=10)
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


def _levels(greatest: float) -> np.ndarray:
    """About eight even levels of one or two digits."""
    step = greatest / 8.0
    digit = 10.0 ** np.floor(np.log10(step))
    step = digit * next(each for each in (1.0, 2.0, 5.0, 10.0) if each * digit >= step)
    return step * np.arange(1, 20)
