"""Picture of gains of B-dot that were flown: time to stop, energy, greatest dipole."""

import numpy as np
from matplotlib.figure import Figure

from torquer.design.gain_sweep import GainSweep
from torquer.report.common.colours import BLUE, GREEN, ORANGE, RED
from torquer.report.common.figure import INK, legend_at_left, stack_panels

_TIMES = ((0.5, "half", BLUE), (0.9, "90 %", ORANGE), (1.0, "last", RED))


def draw_gains(sweep: GainSweep) -> Figure:
    """Flights over their gains."""
    gains = np.array([each.gain for each in sweep.flights])
    title = f"{sweep.scenario.name}: gain of B-dot".lstrip(": ")
    figure, (upper, middle, lower) = stack_panels(title, 3, 7.2, sharex=True)
    for part, name, colour in _TIMES:
        hours = np.array([each.settled_by(part) for each in sweep.flights]) / 3600.0
        upper.plot(gains, np.where(np.isfinite(hours), hours, np.nan), "o-", color=colour, ms=4,
                   lw=1.3, label=name)  # fmt: skip
    theory = np.array([sweep.theory_s(gain) for gain in gains]) / 3600.0
    upper.plot(gains, theory, color=INK, lw=1.0, ls="--", label="theory, mean")
    upper.set_ylabel("stopped after [h]", fontsize=9.5)
    upper.set_ylim(0.0, 1.05 * sweep.duration_s / 3600.0)
    if sweep.wanted.within_s is not None:
        upper.axhline(sweep.wanted.within_s / 3600.0, color=GREEN, lw=1.2, label="wanted")
    middle.plot(gains, [each.energy_j.mean() for each in sweep.flights], "o-", color=BLUE, ms=4,
                lw=1.3)  # fmt: skip
    middle.set_ylabel("energy [J], mean", fontsize=9.5)
    limit = sweep.tumbling.coils.limits_a_m2().min()
    shares = [100.0 * each.peak_a_m2.max() / limit for each in sweep.flights]
    lower.plot(gains, shares, "o-", color=BLUE, ms=4, lw=1.3)
    lower.set_ylim(0.0, 1.05 * max(100.0, *shares))
    lower.set_ylabel("peak dipole [% of limit]", fontsize=9.5)
    lower.set_xscale("log")
    for axes in (upper, middle, lower):
        axes.axvline(sweep.chosen.gain, color=GREEN, lw=1.6, label="chosen")
    legend_at_left(upper, 6)
    label = "gain_a_m2_s_per_t"
    if not all(np.isfinite(each.settled_s).all() for each in sweep.flights):
        label += "\nmissing points: fewer stop during the flight"
    lower.set_xlabel(label, fontsize=10)
    return figure
