"""Coils with a core: formulas against integrals and the charges of a cylinder; the answer."""

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ellipk

from torquer.base.conventions import MU_0_H_M
from torquer.base.limits import RequestError
from torquer.design.coil_core import MIDDLE, PERMALLOY, Core, demagnetising_factor
from torquer.design.coil_design import CONDUCTORS, FILLING, coil, coil_power
from torquer.design.requests import CoilRequest

#: A rod for small satellites.
ASKED = {
    "dipole_a_m2": 1.0, "diameter_m": 0.012, "mass_kg": 0.03,
    "core_length_m": 0.2, "core_diameter_m": 0.009,
}  # fmt: skip


@pytest.mark.parametrize("slenderness", [1.001, 2.0, 10.0, 50.0, 500.0])
def test_factor_is_the_integral_of_the_ellipsoid(slenderness):
    """a b^2/2 int ds/((s + a^2)^(3/2) (s + b^2)), b = 1."""
    a = slenderness
    scale = a * a

    def slope(x):
        s = scale * x / (1.0 - x)
        return scale / (1.0 - x) ** 2 / ((s + a * a) ** 1.5 * (s + 1.0))

    integral = quad(slope, 0.0, 1.0, epsabs=0.0, epsrel=1e-10, limit=500)[0]
    assert demagnetising_factor(a) == pytest.approx(0.5 * a * integral, rel=1e-6)


def test_factor_of_a_ball_and_of_a_published_ellipsoid():
    assert demagnetising_factor(1.0001) == pytest.approx(1.0 / 3.0, rel=1e-4)
    assert round(demagnetising_factor(10.0), 4) == 0.0203


def cylinder_factor(slenderness: float, panels: int = 60, nodes: int = 20) -> tuple[float, float]:
    """V over the dipole of an infinitely permeable cylinder in a field of 1; the magnetisation of
    its middle over the mean one.

    Its surface is at one potential, as that of a conductor: charges of rings on side and ends. What
    leaves one half of it has come through the middle.
    """
    at = 0.5 * slenderness * np.sin(0.5 * np.pi * np.linspace(-1.0, 1.0, panels + 1))
    out = 0.5 * np.sin(0.5 * np.pi * np.linspace(0.0, 1.0, panels // 3 + 1))
    top = 0.5 * slenderness
    lines = [np.stack([np.full_like(at, 0.5), at], axis=1)]
    lines += [np.stack([out, np.full_like(out, end)], axis=1) for end in (top, -top)]
    begin, end = (
        np.concatenate([line[cut] for line in lines]) for cut in (slice(-1), slice(1, None))
    )
    middle, length = 0.5 * (begin + end), np.linalg.norm(end - begin, axis=1)
    x, weights = np.polynomial.legendre.leggauss(nodes)
    potential = np.zeros((len(middle), len(middle)))
    for half in (-1.0, 1.0):
        for u, weight in zip(0.5 * (1.0 + x), weights, strict=True):  # dense about the middle
            ring = middle + half * u**3 * 0.5 * (end - begin)
            area = 1.5 * u**2 * weight * np.pi * ring[:, 0] * length
            far2 = (middle[:, None, 0] + ring[:, 0]) ** 2 + (middle[:, None, 1] - ring[:, 1]) ** 2
            m = np.minimum(4.0 * middle[:, None, 0] * ring[:, 0] / far2, 1.0 - 1e-15)
            potential += ellipk(m) / np.sqrt(far2) * area / (2.0 * np.pi**2)
    charge = np.linalg.solve(potential, middle[:, 1])
    charge *= 2.0 * np.pi * middle[:, 0] * length
    mean = (charge * middle[:, 1]).sum() / (0.25 * np.pi * slenderness)
    return 1.0 / mean, charge[middle[:, 1] > 0.0].sum() / (0.25 * np.pi) / mean


@pytest.mark.parametrize(
    ("slenderness", "share", "in_the_middle"),
    [(5, 1.10, 1.27), (10, 1.005, 1.32), (20, 0.93, 1.36), (50, 0.85, 1.40)],
)
def test_a_cylinder_differs_as_is_said(slenderness, share, in_the_middle):
    """Its gain over that of the ellipsoid, of high permeability; its greatest magnetisation."""
    factor, middle = cylinder_factor(slenderness)
    assert demagnetising_factor(slenderness) / factor == pytest.approx(share, abs=0.006)
    assert middle == pytest.approx(in_the_middle, abs=0.006)
    assert middle <= MIDDLE + 0.006


def test_gain_of_a_long_rod_is_that_of_its_shape():
    """(s/S)/D for high permeability; mu_r in the limit of a rod that is longer than any."""
    core = Core(0.2, 0.01, 1e7)
    shape = (0.01 / 0.013) ** 2 / demagnetising_factor(20.0)
    assert core.gain(0.013) == pytest.approx(1.0 + shape, rel=1e-4)
    endless = Core(1e4, 0.01, 300.0)
    assert endless.gain(0.01) == pytest.approx(300.0, rel=1e-6)
    assert Core(0.2, 0.01, 1.0).gain(0.013) == 1.0


def test_dipole_of_the_rod_and_of_the_winding_are_the_whole():
    core, found = CoilRequest(**ASKED).core(), coil(CoilRequest(**ASKED))
    area = 0.25 * math.pi * ASKED["diameter_m"] ** 2
    for each in found.coils:
        turns_a = each.turns * each.current_a
        field = turns_a / core.length_m
        of_core = core.effective_susceptibility * field * core.volume_m3
        assert turns_a * area + of_core == pytest.approx(1.0, rel=1e-12)
        assert MIDDLE * MU_0_H_M * of_core / core.volume_m3 == pytest.approx(
            core.polarisation_t(1.0, ASKED["diameter_m"]), rel=1e-12
        )
        assert each.power_w == pytest.approx(each.voltage_v * each.current_a, rel=1e-12)
        flux = each.inductance_h * each.current_a / each.turns
        assert flux == pytest.approx(MU_0_H_M / core.length_m, rel=1e-12)  # mu0 m/l


def test_windings_for_a_scenario_have_the_dipole_and_the_power():
    found = coil(CoilRequest(**ASKED, voltage_v=5.0))
    for winding, each in zip(found.windings(), found.coils, strict=True):
        assert winding.limit_a_m2() == pytest.approx(1.0, rel=1e-12)
        assert winding.power_w() == pytest.approx(each.power_w, rel=1e-12)


def test_power_falls_with_the_square_of_the_gain():
    found, weak = coil(CoilRequest(**ASKED)), 1.0 / coil(CoilRequest(**ASKED)).core_gain
    sizes = ASKED["diameter_m"], ASKED["mass_kg"], CONDUCTORS["copper"]
    assert found.power_w["copper"] == pytest.approx(coil_power(weak, *sizes), rel=1e-12)


def test_without_a_core_nothing_is_said_of_one():
    found = coil(CoilRequest(dipole_a_m2=3.2, diameter_m=0.3, mass_kg=0.4))
    assert found.core_gain == 1.0
    assert "core" not in found.data()
    assert not any("core" in line for line in found.lines())


def test_a_core_that_is_not_magnetic_only_weighs():
    sizes = ASKED | {"dipole_a_m2": 1e-3, "mass_kg": 1e-3}
    found = coil(CoilRequest(**sizes, core_permeability=1.0))
    assert found.core_gain == 1.0
    assert [*found.data()["core"]] == ["gain", "polarisation_t", "mass_kg"]
    assert found.lines()[1] == "core of 0.2 m, 0.009 m thick: not magnetic, mass 0.111 kg"
    bare = coil(CoilRequest(**{k: x for k, x in sizes.items() if not k.startswith("core")}))
    assert found.power_w == bare.power_w


def test_what_is_said_of_the_core():
    found = coil(CoilRequest(**ASKED))
    assert found.lines()[1] == (
        "core of 0.2 m, 0.009 m thick: gain 99.2, magnetised to 0.137 T, saturates at 5.48 A m^2, "
        "mass 0.111 kg"
    )
    core = found.data()["core"]
    assert core["gain"] == found.core_gain
    assert core["mass_kg"] == pytest.approx(PERMALLOY[2] * math.pi * 0.0045**2 * 0.2)
    assert found.coils[-1].bundle_m >= found.coils[-1].mass_kg / (
        8890.0 * math.pi * 0.012 * FILLING * 0.2
    ) * (1.0 - 1e-12)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"core_diameter_m": None}, "core_diameter_m: must be given with core_length_m"),
        ({"core_length_m": None}, "core_length_m: must be given with core_diameter_m"),
        ({"core_length_m": None, "core_diameter_m": None, "core_saturation_t": 1.0},
         "core_length_m: must be given with core_saturation_t"),
        ({"core_length_m": 0.03}, "core_length_m: must be 4 to 10000 times core_diameter_m, a long "
                                  "rod; received 0.03"),
        ({"core_diameter_m": 1e-200}, "core_length_m: must be 4 to 10000 times core_diameter_m, a "
                                      "long rod; received 0.2"),
        ({"core_length_m": 1e200}, "core_length_m: must lie within 0.0001..100; received 1e+200"),
        ({"core_saturation_t": 1e308}, "core_saturation_t: must lie within 0.001..10; received "),
        ({"core_diameter_m": 0.013}, "core_diameter_m: must be less than diameter_m, that of the "
                                     "turns, 0.012; received 0.013"),
        ({"core_permeability": 0.5}, "core_permeability: must be 1 or more; received 0.5"),
        ({"dipole_a_m2": 8.0}, "dipole_a_m2: must be at most 5.48 A m^2 with this core, which "
                               "saturates at 0.75 T; received 8"),
        ({"mass_kg": 0.3}, "mass_kg: must leave a winding no thicker than 0.003 m, as diameter_m "
                           "is that of the mean turn about core_diameter_m; received 0.3 kg, which "
                           "is 0.00746 m thick"),
        ({"dipole_a_m2": 5.0, "mass_kg": 1e-3}, "dipole_a_m2: must be at most 0.335 A m^2 with "
                                                "diameter_m = 0.012 and mass_kg = 0.001, or the "
                                                "wire melts"),
    ],
)  # fmt: skip
def test_mistakes(keys, message):
    with pytest.raises(RequestError) as error:
        coil(CoilRequest(**ASKED | keys))
    assert str(error.value).startswith(message)
