"""Sizing of a magnetorquer: turns, wire, resistance, voltage and time constant.

A coil of N round turns of diameter d, wire of cross-section s, density g and resistivity rho has
the mass M = N pi d s g, the resistance R = N pi d rho / s and, at the current I, the power
P = I^2 R and the dipole m = N I pi d^2/4. Eliminating N, I and s gives m = (d/4) sqrt(P M/(g rho)).
The density of the current is I/s = 4 m g/(d M), whatever the wire: beyond `MELTS_A_MM2` there is no
such coil. A core in it multiplies the dipole (`torquer.design.coil_core`): the winding is that of a
coil without one, of a dipole as many times less.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from torquer.base.conventions import MU_0_H_M
from torquer.base.language import message
from torquer.base.limits import RequestError
from torquer.base.rows import Row, as_data, as_html, as_text
from torquer.design.coil_core import Core
from torquer.design.requests import CoilRequest

if TYPE_CHECKING:
    from torquer.spacecraft.actuators.winding import Winding

#: Finest and thickest wire gauge of the table (AWG).
GAUGES = range(10, 41)
#: Density of the current [A/mm^2] above which a wire in a winding melts.
MELTS_A_MM2 = 10.0


class Conductor(NamedTuple):
    """Density [kg/m^3], resistivity at 20 deg C [ohm m] and its relative change per kelvin."""

    density_kg_m3: float
    resistivity_ohm_m: float
    per_kelvin: float

    def at(self, temperature_c: float) -> "Conductor":
        """The conductor at a temperature [deg C]."""
        factor = 1.0 + self.per_kelvin * (temperature_c - 20.0)
        return self._replace(resistivity_ohm_m=factor * self.resistivity_ohm_m)


#: Annealed copper by IEC 60028; aluminium for conductors by IEC 60889 (Al 1350-O).
CONDUCTORS = {
    "copper": Conductor(8890.0, 1.7241e-8, 3.93e-3),
    "aluminium": Conductor(2703.0, 2.8264e-8, 4.03e-3),
}


class Coil(NamedTuple):
    """A coil: what it weighs and takes at its dipole; `awg`: gauge of its wire.

    `inductance_h`: of a ring of round section, with a core of a long solenoid about it;
    `time_constant_s`: L/R. `bundle_m`: diameter of the wound section with a filling of `FILLING`,
    with a core the thickness of the winding on it.
    """

    awg: int
    wire_m: float
    turns: int
    mass_kg: float
    resistance_ohm: float
    current_a: float
    voltage_v: float
    power_w: float
    current_density_a_mm2: float
    bundle_m: float
    inductance_h: float
    time_constant_s: float


#: Part of the wound section that is metal: round wire with its insulation.
FILLING = 0.6


def coil_power(dipole: float, diameter_m: float, mass_kg: float, conductor: Conductor) -> float:
    """Power [W] with which a coil of a mass [kg] has a dipole [A m^2]: (d/4) sqrt(P M/(g rho)).

    The introduction of MAG has it without a number.
    """
    product = conductor.density_kg_m3 * conductor.resistivity_ohm_m
    return (4.0 * dipole / diameter_m) ** 2 * product / mass_kg


def melts(dipole: float, diameter_m: float, mass_kg: float, conductor: Conductor) -> bool:
    """Whether the wire of a coil melts at its dipole [A m^2]."""
    return dipole > greatest_dipole(diameter_m, mass_kg, conductor)


def greatest_dipole(diameter_m: float, mass_kg: float, conductor: Conductor) -> float:
    """Dipole [A m^2] at which the wire of a coil melts: J d M/(4 g), J the density of current."""
    return 1e6 * MELTS_A_MM2 * diameter_m * mass_kg / (4.0 * conductor.density_kg_m3)


def _refuse_melting(
    dipole: float, diameter_m: float, mass_kg: float, conductor: Conductor, gain: float
) -> None:
    """RequestError, with what limits it, for a coil whose wire melts."""
    most = gain * greatest_dipole(diameter_m, mass_kg, conductor)
    if dipole <= most:
        return
    density, needed_kg = MELTS_A_MM2 * dipole / most, mass_kg * dipole / most
    raise RequestError(
        "dipole_a_m2",
        f"must be at most {most:.3g} A m^2 with diameter_m = {diameter_m:g} and mass_kg = "
        f"{mass_kg:g}, or the wire melts: there is no such coil; received {dipole:g} A m^2, which "
        f"takes {density:.3g} A/mm^2 (a wire bears some {MELTS_A_MM2:g}), or {needed_kg:.3g} kg",
        "diameter_m",
        "mass_kg",
    )


def wire_diameter_m(awg: int) -> float:
    """Diameter of bare wire [m] of a gauge, by ASTM B258: 0.127 mm times 92^((36 - n)/39)."""
    return 1.27e-4 * 92.0 ** ((36 - awg) / 39.0)


def inductance_h(turns: int, diameter_m: float, bundle_m: float) -> float:
    """Inductance [H] of a ring of round section, its current spread evenly over it.

    N^2 mu0 R (ln(8 R/a) - 7/4), R and a the radii of ring and section: for a much less than R.
    F. W. Grover, 'Inductance Calculations' (1946), chapter 16.
    """
    radius, section = 0.5 * diameter_m, 0.5 * bundle_m
    return turns**2 * MU_0_H_M * radius * (math.log(8.0 * radius / section) - 1.75)


def _gain(core: Core | None, diameter_m: float) -> float:
    """Dipole over that without a core."""
    return core.gain(diameter_m) if core else 1.0


def inductance_about_core_h(turns: int, diameter_m: float, core: Core) -> float:
    """Inductance [H] of a long solenoid about a core: mu0 N^2 S/l times the gain of the core."""
    area = 0.25 * math.pi * diameter_m**2
    return turns**2 * MU_0_H_M * area / core.length_m * core.gain(diameter_m)


def wind_coil(
    dipole: float,
    diameter_m: float,
    mass_kg: float,
    conductor: Conductor,
    awg: int,
    core: Core | None = None,
) -> Coil:
    """The coil of whole turns of a gauge that comes nearest to a mass, at its dipole.

    RequestError where the mass is less than one turn, where the winding would fill the coil or not
    leave room for the core, or where the wire would melt.
    """
    wire = wire_diameter_m(awg)
    section = 0.25 * math.pi * wire**2
    turn_m = math.pi * diameter_m
    per_turn = turn_m * section * conductor.density_kg_m3
    turns = round(mass_kg / per_turn)
    if turns < 1:
        raise RequestError(
            "mass_kg",
            f"must be at least one turn of AWG {awg}, {per_turn:.3g} kg; received {mass_kg:g}",
        )
    bundle = _thickness_m(turns * section, wire, diameter_m, mass_kg, core)
    gain = _gain(core, diameter_m)
    _refuse_melting(dipole, diameter_m, mass_kg, conductor, gain)
    resistance = turns * turn_m * conductor.resistivity_ohm_m / section
    current = dipole / (gain * turns * 0.25 * math.pi * diameter_m**2)
    inductance = (
        inductance_about_core_h(turns, diameter_m, core)
        if core
        else inductance_h(turns, diameter_m, bundle)
    )
    return Coil(
        awg, wire, turns, turns * per_turn, resistance, current, current * resistance,
        current**2 * resistance, 1e-6 * current / section, bundle, inductance,
        inductance / resistance,
    )  # fmt: skip


def _thickness_m(
    metal_m2: float, wire_m: float, diameter_m: float, mass_kg: float, core: Core | None
) -> float:
    """How thick a winding of a section of metal [m^2] is; RequestError where it has no room."""
    keys: tuple[str, ...]
    if core is None:
        thickness, most = math.sqrt(4.0 * metal_m2 / (math.pi * FILLING)), 0.25 * diameter_m
        room, keys = "a quarter of diameter_m", ("diameter_m",)
    else:
        thickness = max(wire_m, metal_m2 / (FILLING * core.length_m))
        most = diameter_m - core.diameter_m
        room = f"{most:.3g} m, as diameter_m is that of the mean turn about core_diameter_m"
        keys = ("diameter_m", "core_diameter_m")
    if thickness > most:
        raise RequestError(
            "mass_kg",
            f"must leave a winding no thicker than {room}; received {mass_kg:g} kg, which is "
            f"{thickness:.3g} m thick",
            *keys,
        )
    return thickness


def fitting_gauges(
    dipole: float,
    diameter_m: float,
    mass_kg: float,
    conductor: Conductor,
    voltage_v: float | None = None,
    current_a: float | None = None,
    core: Core | None = None,
) -> list[Coil]:
    """Coils of the gauges that keep within a voltage [V] and a current [A], thickest wire first.

    RequestError where no gauge does.
    """
    coils, why = [], None
    for awg in GAUGES:
        try:
            coils.append(wind_coil(dipole, diameter_m, mass_kg, conductor, awg, core))
        except RequestError as error:
            why = error
    if why and not coils:
        raise why
    fit = [
        coil for coil in coils
        if (voltage_v is None or coil.voltage_v <= voltage_v)
        and (current_a is None or coil.current_a <= current_a)
    ]  # fmt: skip
    if not fit:
        volts, amperes = (min(getattr(coil, key) for coil in coils)
                          for key in ("voltage_v", "current_a"))  # fmt: skip
        limits = [
            f"{limit:g} {unit}" for limit, unit in ((voltage_v, "V"), (current_a, "A")) if limit
        ]
        raise RequestError(
            "voltage_v, current_a",
            f"must allow one of AWG {GAUGES[0]} to {GAUGES[-1]}, of which the thickest takes "
            f"{volts:.3g} V and the finest {amperes:.3g} A; received {' and '.join(limits)}",
        )
    return fit


@dataclass(frozen=True)
class CoilSizes:
    """Power [W] by the metal of the wire, and the coil of each gauge that fits, of one metal.

    A metal that would melt has no power.
    """

    request: CoilRequest
    power_w: dict[str, float]
    coils: list[Coil]

    def table(self) -> list[list[Row]]:
        """A line for each gauge, thickest wire first."""
        return [_row(coil) for coil in self.coils]

    def windings(self) -> "list[Winding]":
        """For each gauge what `spacecraft.coils.windings` of a scenario takes."""
        from torquer.spacecraft.actuators.winding import Winding

        area = 0.25 * math.pi * self.request.diameter_m**2
        return [
            Winding(
                turns=each.turns,
                area_m2=area,
                current_a=each.current_a,
                core_gain=self.core_gain,
                resistance_ohm=each.resistance_ohm,
            )
            for each in self.coils
        ]

    @property
    def core_gain(self) -> float:
        """Dipole with the core over that without; 1 without one."""
        return _gain(self.request.core(), self.request.diameter_m)

    def core_rows(self) -> list[Row]:
        """Of the core: its gain, how far it is magnetised, its mass; none without one.

        A core that is not magnetic never saturates, and has no row of that.
        """
        asked = self.request
        if (core := asked.core()) is None:
            return []
        polarisation = core.polarisation_t(asked.dipole_a_m2, asked.diameter_m)
        most = core.greatest_dipole(asked.diameter_m)
        return [
            Row("gain", "gain", self.core_gain, text=f"{self.core_gain:.3g}"),
            Row("polarisation_t", "magnetised to", polarisation, "T", f"{polarisation:.3g}"),
            *([Row("saturates_at_a_m2", "saturates at", most, "A m^2", f"{most:.3g}")]
              if math.isfinite(most) else []),
            Row("mass_kg", "mass", core.mass_kg, "kg", f"{core.mass_kg:.3g}"),
        ]  # fmt: skip

    def data(self) -> dict:
        """Plain data, with units in the keys."""
        coils = [as_data(row) for row in self.table()]
        core = as_data(self.core_rows())
        found = {"power_w": self.power_w, "metal": self.request.metal, "coils": coils}
        return found | ({"core": core} if core else {})

    def lines(self) -> list[str]:
        """The answer as text."""
        asked = self.request
        found = {name: f"{power:.4g} W" for name, power in self.power_w.items()}
        shares = ", ".join(f"{name} {found.get(name, 'would melt')}" for name in CONDUCTORS)
        return [
            f"{asked.dipole_a_m2:g} A m^2, turns of {asked.diameter_m:g} m, {asked.mass_kg:g} kg "
            f"of wire at {asked.temperature_c:g} deg C: {shares}",
            *self._core_line(),
            f"wire of {asked.metal}:",
            *as_text(self.table(), 10),
        ]

    def _core_line(self) -> list[str]:
        """The core in words, if there is one."""
        found = {row.key: row.value for row in self.core_rows()}
        if not found:
            return []
        sizes = {"length": self.request.core_length_m, "thick": self.request.core_diameter_m}
        does = (
            message(
                "gain {gain:.3g}, magnetised to {polarisation_t:.3g} T, saturates at "
                "{saturates_at_a_m2:.3g} A m^2",
                **found,
            )
            if "saturates_at_a_m2" in found
            else message("not magnetic")
        )
        return [
            message(
                "core of {length:g} m, {thick:g} m thick: {does}, mass {mass_kg:.3g} kg",
                **sizes, **found, does=does,
            )
        ]  # fmt: skip

    def _repr_html_(self) -> str:
        return as_html(self.table(), self.lines()[:1] + self._core_line())


def _row(coil: Coil) -> list[Row]:
    """All about a coil; its section and inductance are for programs only."""
    density, constant = coil.current_density_a_mm2, coil.time_constant_s
    return [
        Row("awg", "AWG", coil.awg, text=f"{coil.awg}"),
        Row("wire_m", "wire", coil.wire_m, "mm", f"{1e3 * coil.wire_m:.3f}"),
        Row("turns", "turns", coil.turns, text=f"{coil.turns}"),
        Row("mass_kg", "mass", coil.mass_kg, "kg", f"{coil.mass_kg:.4g}"),
        Row("resistance_ohm", "R", coil.resistance_ohm, "ohm", f"{coil.resistance_ohm:.4g}"),
        Row("current_a", "current", coil.current_a, "A", f"{coil.current_a:.4g}"),
        Row("voltage_v", "voltage", coil.voltage_v, "V", f"{coil.voltage_v:.4g}"),
        Row("power_w", "power", coil.power_w, "W", f"{coil.power_w:.4g}"),
        Row("current_density_a_mm2", "density", density, "A/mm^2", f"{density:.3g}"),
        Row("bundle_m", value=coil.bundle_m),
        Row("inductance_h", value=coil.inductance_h),
        Row("time_constant_s", "L/R", constant, "ms", f"{1e3 * constant:.3g}"),
    ]


def coil(request: CoilRequest) -> CoilSizes:
    """A magnetorquer: its power in copper and aluminium, its wire by gauge, and what a core does.

    RequestError where no gauge keeps within voltage and current, where the wire would melt, or
    where the core would saturate.

        coil(CoilRequest(dipole_a_m2=3.2, diameter_m=0.3, mass_kg=0.4)).power_w["copper"]   # 0.7 W
    """
    core, diameter_m = request.core(), request.diameter_m
    if core:
        _refuse_saturation(request, core)
    of_winding = request.dipole_a_m2 / _gain(core, diameter_m), diameter_m, request.mass_kg
    metals = {name: metal.at(request.temperature_c) for name, metal in CONDUCTORS.items()}
    return CoilSizes(
        request,
        {
            name: coil_power(*of_winding, metal)
            for name, metal in metals.items()
            if not melts(*of_winding, metal)
        },
        fitting_gauges(
            request.dipole_a_m2, diameter_m, request.mass_kg, metals[request.metal],
            request.voltage_v, request.current_a, core,
        ),
    )  # fmt: skip


def _refuse_saturation(request: CoilRequest, core: Core) -> None:
    """RequestError where a core cannot have its part of the dipole."""
    most = core.greatest_dipole(request.diameter_m)
    if request.dipole_a_m2 > most:
        raise RequestError(
            "dipole_a_m2",
            f"must be at most {most:.3g} A m^2 with this core, which saturates at "
            f"{core.saturation_t:g} T; received {request.dipole_a_m2:g}",
        )
