"""Picture of coils by gauge: voltage and current."""

from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from torquer.design.coil_design import CoilSizes
from torquer.report.common.colours import BLUE, RED
from torquer.report.common.figure import stack_panels


def draw_coils(answer: CoilSizes) -> Figure:
    """Voltage and current of the gauges that fit, all at the same dipole; limits are dashed."""
    asked, gauges = answer.request, [coil.awg for coil in answer.coils]
    title = f"{asked.dipole_a_m2:g} A m² with {asked.mass_kg:g} kg of {asked.metal}"
    figure, panels = stack_panels(title, 2, 4.6, sharex=True)
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
