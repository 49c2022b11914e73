"""Picture of coils by gauge: voltage, current and time constant."""

from matplotlib.figure import Figure

from torquer.design.coil_design import CoilSizes
from torquer.report.common.colours import BLUE, GREEN, RED
from torquer.report.common.figure import stacked


def draw_coils(answer: CoilSizes) -> Figure:
    """Voltage, current and time constant of the gauges that fit, all at the same dipole."""
    asked = answer.request
    title = f"{asked.dipole_a_m2:g} A m^2, {asked.mass_kg:g} kg of {asked.metal}"
    figure, panels = stacked(title, 3, 5.6, sharex=True)
    gauges = [coil.awg for coil in answer.coils]
    curves = (
        ("voltage [V]", [coil.voltage_v for coil in answer.coils], BLUE, asked.voltage_v),
        ("current [A]", [coil.current_a for coil in answer.coils], RED, asked.current_a),
        ("L/R [ms]", [1e3 * coil.time_constant_s for coil in answer.coils], GREEN, None),
    )
    for axes, (label, values, colour, limit) in zip(panels, curves, strict=True):
        axes.semilogy(gauges, values, "o-", color=colour, ms=4, lw=1.3)
        axes.set_ylabel(label, fontsize=9.5)
        if limit is not None:
            axes.axhline(limit, color=colour, lw=1.0, ls="--")
    panels[-1].set_xlabel("wire gauge [AWG]", fontsize=10)
    return figure
