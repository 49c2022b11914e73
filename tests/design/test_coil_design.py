"""Sizing of coils against an integrated winding, published data, and independent formulas."""

import math

import numpy as np
import pytest

from torquer.base.limits import RequestError
from torquer.design.bench_scaling import scaling
from torquer.design.coil_design import (
    CONDUCTORS,
    MELTS_A_MM2,
    Conductor,
    coil,
    coil_power,
    fitting_gauges,
    greatest_dipole,
    inductance_h,
    wind_coil,
    wire_diameter_m,
)
from torquer.design.requests import CoilRequest

COPPER, ALUMINIUM = CONDUCTORS["copper"], CONDUCTORS["aluminium"]


def test_formula_is_that_of_a_winding_integrated_piece_by_piece():
    """Dipole 1/2 int r x I dl, mass and Joule heat of a wire, summed over its pieces."""
    turns, diameter, wire, current, pieces = 7, 0.25, 4e-4, 0.3, 20000
    angle = np.linspace(0.0, 2.0 * math.pi * turns, pieces * turns + 1)
    r = 0.5 * diameter * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    piece, middle = np.diff(r, axis=0), 0.5 * (r[1:] + r[:-1])
    length, section = np.linalg.norm(piece, axis=1).sum(), 0.25 * math.pi * wire**2
    dipole = 0.5 * current * np.cross(middle, piece).sum(axis=0)
    mass = COPPER.density_kg_m3 * section * length
    power = current**2 * COPPER.resistivity_ohm_m * length / section
    assert power == pytest.approx(coil_power(dipole[2], diameter, mass, COPPER), rel=2e-6)
    assert np.abs(dipole[:2]).max() < 1e-12


@pytest.mark.parametrize("awg", (16, 24, 36))
def test_a_gauge_takes_the_power_of_the_formula(awg):
    coil = wind_coil(3.2, 0.3, 0.4, COPPER, awg)
    assert coil.mass_kg == pytest.approx(0.4, rel=0.02)
    assert coil.power_w == pytest.approx(coil_power(3.2, 0.3, coil.mass_kg, COPPER), rel=1e-12)
    assert coil.turns * coil.current_a * math.pi * 0.15**2 == pytest.approx(3.2, rel=1e-12)
    assert coil.voltage_v * coil.current_a == pytest.approx(coil.power_w, rel=1e-12)
    assert coil.time_constant_s == coil.inductance_h / coil.resistance_ohm


def test_aluminium_needs_half_the_power_of_copper():
    """The introduction of MAG: half, at equal mass, diameter and dipole."""
    share = coil_power(3.2, 0.3, 0.4, ALUMINIUM) / coil_power(3.2, 0.3, 0.4, COPPER)
    assert 0.45 < share < 0.55


def test_wire_is_that_of_published_tables():
    """AWG 10, 24 and 36: 2.588, 0.511, 0.127 mm; resistance of AWG 24 copper 84.2 ohm/km."""
    assert [round(1e3 * wire_diameter_m(n), 3) for n in (10, 24, 36)] == [2.588, 0.511, 0.127]
    per_m = COPPER.resistivity_ohm_m / (0.25 * math.pi * wire_diameter_m(24) ** 2)
    assert 1e3 * per_m == pytest.approx(84.2, rel=2e-3)


def test_inductance_is_that_of_neumanns_integral():
    """Flux linkage of filaments spread over the section, by mutual inductances of pairs."""
    from scipy.special import ellipe, ellipk

    radius, section = 0.15, 0.008
    # equal areas in rings about the centre of the section
    rings, spokes = 14, 24
    rho = section * np.sqrt((np.arange(rings) + 0.5) / rings)
    phi = 2.0 * math.pi * np.arange(spokes) / spokes
    a = (radius + np.outer(rho, np.cos(phi))).ravel()
    z = np.outer(rho, np.sin(phi)).ravel()
    i, j = np.triu_indices(len(a), 1)
    m = 4.0 * a[i] * a[j] / ((a[i] + a[j]) ** 2 + (z[i] - z[j]) ** 2)
    k = np.sqrt(m)
    mutual = (
        4e-7 * math.pi * np.sqrt(a[i] * a[j]) * ((2.0 / k - k) * ellipk(m) - 2.0 / k * ellipe(m))
    )
    # a filament's own part: a wire of its share of the section
    own = section / math.sqrt(len(a))
    alone = 4e-7 * math.pi * a * (np.log(8.0 * a / own) - 1.75)
    total = (2.0 * mutual.sum() + alone.sum()) / len(a) ** 2
    assert total == pytest.approx(inductance_h(1, 2.0 * radius, 2.0 * section), rel=5e-3)


def test_limits_choose_the_gauges():
    every = fitting_gauges(3.2, 0.3, 0.4, COPPER)
    fit = fitting_gauges(3.2, 0.3, 0.4, COPPER, voltage_v=5.0, current_a=0.3)
    assert [coil.awg for coil in fit] == [
        coil.awg for coil in every if coil.voltage_v <= 5.0 and coil.current_a <= 0.3
    ]
    assert 0 < len(fit) < len(every)
    volts = [coil.voltage_v for coil in every]
    assert volts == sorted(volts)


def test_warm_wire_takes_more_power():
    """Copper at 70 deg C has 1.1965 times the resistance of 20 deg C."""
    warm = coil_power(3.2, 0.3, 0.4, COPPER.at(70.0)) / coil_power(3.2, 0.3, 0.4, COPPER)
    assert warm == pytest.approx(1.1965, rel=1e-12)
    assert Conductor(1.0, 2.0, 0.5).at(20.0).resistivity_ohm_m == 2.0


@pytest.mark.parametrize(
    ("keys", "message"),
    (
        ({"mass_kg": 1e-9}, "mass_kg: must be at least one turn of AWG 40, 4.2e-05 kg; received"),
        ({"mass_kg": 4000.0}, "mass_kg: must leave a winding no thicker than a quarter of"),
        ({"voltage_v": 1e-3}, "voltage_v, current_a: must allow one of AWG 10 to 40, of which the "
                              "thickest takes 0.14 V and the finest .* received 0.001 V$"),
        ({"current_a": 1e-6, "voltage_v": 2.0}, "received 2 V and 1e-06 A$"),
    ),
)  # fmt: skip
def test_mistakes_are_one_line(keys, message):
    given = {"dipole": 3.2, "diameter_m": 0.3, "mass_kg": 0.4, "conductor": COPPER} | keys
    with pytest.raises(ValueError, match=message) as error:
        fitting_gauges(**given)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("metal", CONDUCTORS)
def test_current_density_does_not_depend_on_the_gauge(metal):
    """4 m g/(d M), which `greatest_dipole` turns around."""
    conductor, most = CONDUCTORS[metal], greatest_dipole(0.3, 0.4, CONDUCTORS[metal])
    for each in fitting_gauges(0.999 * most, 0.3, 0.4, conductor):
        assert each.current_density_a_mm2 * each.mass_kg / 0.4 == pytest.approx(
            0.999 * MELTS_A_MM2, rel=1e-12
        )


@pytest.mark.parametrize(
    ("dipole", "diameter_m", "mass_kg"),
    [(1e4, 0.05, 0.01), (0.2, 0.05, 0.01), (35.0, 0.3, 0.4), (1e9, 10.0, 1.0), (3.2, 0.3, 0.03)],
)
def test_a_coil_that_melts_is_no_coil(dipole, diameter_m, mass_kg):
    asked = CoilRequest(dipole_a_m2=dipole, diameter_m=diameter_m, mass_kg=mass_kg)
    most = greatest_dipole(diameter_m, mass_kg, COPPER)
    for make in (
        lambda: coil(asked),
        lambda: fitting_gauges(dipole, diameter_m, mass_kg, COPPER),
        lambda: wind_coil(dipole, diameter_m, mass_kg, COPPER, 30),
    ):
        with pytest.raises(RequestError, match=r"^dipole_a_m2: must be at most") as error:
            make()
        assert f"{most:.3g} A m^2 with" in str(error.value)
        assert "there is no such coil" in str(error.value)


def test_the_mass_that_is_named_is_enough():
    with pytest.raises(RequestError) as error:
        coil(CoilRequest(dipole_a_m2=35.0, diameter_m=0.3, mass_kg=0.4))
    needed_kg = float(str(error.value).rpartition(" or ")[2].removesuffix(" kg"))
    found = coil(CoilRequest(dipole_a_m2=35.0, diameter_m=0.3, mass_kg=1.01 * needed_kg))
    assert 9.5 < found.coils[-1].current_density_a_mm2 < MELTS_A_MM2


def test_a_metal_that_melts_has_no_power():
    """Aluminium of a mass has three times the section of copper."""
    asked = CoilRequest(dipole_a_m2=50.0, diameter_m=0.3, mass_kg=0.4, metal="aluminium")
    found = coil(asked)
    assert [*found.power_w] == ["aluminium"] == [*found.data()["power_w"]]
    assert "copper would melt, aluminium 84.89 W" in found.lines()[0]


def test_scaling_is_that_of_the_text():
    """MAG, section 5.2: a tenth of the field and four times the inertia: 10 min become 400."""
    found = scaling(4.0, 0.1)
    assert 10.0 * found.saturated == pytest.approx(400.0)
    assert found.linear == pytest.approx(400.0)
    assert scaling(4.0, 0.1, dipole_ratio=2.0).saturated == pytest.approx(20.0)
    assert scaling(4.0, 0.1, gain_ratio=4.0).linear == pytest.approx(100.0)
