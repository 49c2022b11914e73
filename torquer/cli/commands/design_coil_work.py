"""Work of `torquer design coil` and `torquer design bench`: their tables and JSON."""

from torquer.base.strict_json import json_text
from torquer.cli.commands.design import BenchOptions, CoilOptions
from torquer.design.bench_scaling import scaling
from torquer.design.coil_design import CONDUCTORS, gauges_of, power_of

_HEAD = ("AWG", "wire", "turns", "mass", "R", "current", "voltage", "power", "density", "L/R")
_UNITS = ("", "mm", "", "kg", "ohm", "A", "V", "W", "A/mm^2", "ms")


def show(how: CoilOptions) -> int:
    """Print the power by metal and the coils by gauge."""
    metals = {name: metal.at(how.temperature_c) for name, metal in CONDUCTORS.items()}
    powers = {
        name: power_of(how.dipole_a_m2, how.diameter_m, how.mass_kg, metal)
        for name, metal in metals.items()
    }
    try:
        coils = gauges_of(
            how.dipole_a_m2, how.diameter_m, how.mass_kg, metals[how.metal], how.voltage_v,
            how.current_a,
        )  # fmt: skip
    except ValueError as error:
        text = str(error)
        for key in ("voltage_v", "current_a", "mass_kg", "diameter_m"):
            text = text.replace(key, f"--{key.replace('_', '-')}")
        raise ValueError(text) from None
    if how.json:
        found = [each._asdict() for each in coils]
        print(json_text({"power_w": powers, "metal": how.metal, "coils": found}))
        return 0
    shares = ", ".join(f"{name} {power:.4g} W" for name, power in powers.items())
    print(
        f"{how.dipole_a_m2:g} A m^2, turns of {how.diameter_m:g} m, {how.mass_kg:g} kg of wire at "
        f"{how.temperature_c:g} deg C: {shares}"
    )
    print(f"wire of {how.metal}:")
    print(*("".join(f"{cell:>10}" for cell in row) for row in (_HEAD, _UNITS)), sep="\n")
    for each in coils:
        cells = (
            each.awg, f"{1e3 * each.wire_m:.3f}", each.turns, f"{each.mass_kg:.4g}",
            f"{each.resistance_ohm:.4g}", f"{each.current_a:.4g}", f"{each.voltage_v:.4g}",
            f"{each.power_w:.4g}", f"{each.current_density_a_mm2:.3g}",
            f"{1e3 * each.time_constant_s:.3g}",
        )  # fmt: skip
        print("".join(f"{cell:>10}" for cell in cells))
    return 0


def show_bench(how: BenchOptions) -> int:
    """Print the time in orbit that follows from the one on the bench."""
    found = scaling(
        how.inertia / how.bench_inertia, how.field_nt / how.bench_field_nt, how.dipole_ratio,
        how.gain_ratio,
    )  # fmt: skip
    if how.json:
        times = {name: factor * how.time_s for name, factor in found._asdict().items()}
        print(json_text({"factors": found._asdict(), "time_s": times}))
        return 0
    words = {"saturated": "coils at their limits", "linear": "coils below their limits"}
    for name, factor in found._asdict().items():
        time_min = factor * how.time_s / 60.0
        print(f"{words[name]}: {factor:.4g} times as long, {time_min:.4g} min in orbit")
    return 0
