"""MAG, introduction: dipole of a coil by its power and mass, and aluminium against copper.

The introduction prints the formula (d/4) sqrt(P M/(g rho)) without a number, and says that for the
same size and dipole aluminium takes half the power of copper. Coils wound of whole turns of every
gauge are compared with it. Copper and aluminium are those of IEC 60028 and IEC 60889.
"""

import math

import numpy as np

from gallery.drawing import BLUE, ORANGE, label, new_figure
from gallery.entry import Answer, Entry, consistent, near, within
from torquer.design.coil_design import CONDUCTORS, coil_power, fitting_gauges

DIPOLE, DIAMETER_M, MASS_KG = 3.2, 0.3, 0.4


def compute() -> Answer:
    """Power of wound coils against the formula, and the ratio of the metals."""
    copper, aluminium = (CONDUCTORS[name] for name in ("copper", "aluminium"))
    ratio = coil_power(DIPOLE, DIAMETER_M, MASS_KG, aluminium) / coil_power(
        DIPOLE, DIAMETER_M, MASS_KG, copper)  # fmt: skip
    coils = fitting_gauges(DIPOLE, DIAMETER_M, MASS_KG, copper)
    off = [
        0.25 * DIAMETER_M * math.sqrt(
            each.power_w * each.mass_kg / (copper.density_kg_m3 * copper.resistivity_ohm_m)
        ) / DIPOLE - 1.0
        for each in coils
    ]  # fmt: skip
    area = 0.25 * math.pi * DIAMETER_M**2
    product = [each.turns * each.current_a * area / DIPOLE for each in coils]
    checks = (
        near("power of aluminium over that of copper, same size, mass and dipole", "0.5", ratio,
             printed="half"),
        within(f"N I S over the dipole less 1, greatest of {len(coils)} gauges", "N I S",
               np.abs(np.array(product) - 1.0).max(), high=1e-12),
        within("(d/4) sqrt(P M/(g rho)) over the dipole less 1, greatest of the gauges",
               "(d/4) sqrt(P M/(g rho))", np.abs(off).max(), high=1e-12),
        consistent(near("twice the mass: power", "0.5",
                        coil_power(DIPOLE, DIAMETER_M, 2.0 * MASS_KG, copper)
                        / coil_power(DIPOLE, DIAMETER_M, MASS_KG, copper), tolerance=1e-9)),
    )  # fmt: skip
    note = (
        f"Coils of {DIPOLE:g} A m^2, {DIAMETER_M:g} m, {MASS_KG:g} kg, chosen. The introduction "
        "has turns about a core, its formulas none. The coils of Chibis-M have a core of "
        "permalloy; nothing about it is printed that could be compared, see what is left out."
    )
    return Answer(checks, {"": picture()}, note)


def picture():
    """Power over mass of both metals."""
    figure, (axes,) = new_figure("Power of a coil of 3.2 A m² and 0.3 m (MAG, introduction)",
                                 height=3.4)  # fmt: skip
    masses = np.linspace(0.1, 1.5, 100)
    for colour, (name, metal) in zip((ORANGE, BLUE), CONDUCTORS.items(), strict=True):
        axes.plot(masses, [coil_power(DIPOLE, DIAMETER_M, m, metal) for m in masses], color=colour,
                  lw=1.4, label=name)  # fmt: skip
    axes.set(xlim=(0.0, 1.5), ylim=(0.0, None))
    label(axes, "mass of the wire [kg]", "power [W]")
    return figure


ENTRY = Entry(ids=("MAG-coil",), compute=compute)
