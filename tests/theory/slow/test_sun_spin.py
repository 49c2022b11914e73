"""Rotation along the Sun's line: SDOT's Table 2.1, by eigenvalues, multipliers and motions."""

import math
from itertools import permutations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from torquer.compile import engine
from torquer.environment.field.averaged import b_z, cone_angle
from torquer.maths.geometry.frames import dcm_body_to_l, dcm_l_to_z, dcm_z_to_y
from torquer.simulation.setup.simulate import simulate
from torquer.theory.periodic.floquet import exponents, monodromy, multipliers
from torquer.theory.slow.evolution import SDOT
from torquer.theory.slow.evolution.model import Slow
from torquer.theory.slow.spinner import Spinner
from torquer.theory.slow.sun_spin import (
    axis_equilibria,
    mean_decay,
    mean_matrix,
    nearly_axisymmetric_rates,
    stable_axes,
    sun_spin_system,
)

CHIBIS = (1.025, 1.5393, 1.8172)
ORDERS = list(permutations(CHIBIS))
SUN = np.array([10.0, 2.0, 3.0]) / math.sqrt(113.0)
INCLINATION_DEG = 51.7
CONE = cone_angle(math.radians(INCLINATION_DEG))
P, Q = 0.5 * math.sin(CONE) ** 2, math.cos(CONE) ** 2
A = P + (Q - P) * SUN[2] ** 2
needs_jit = pytest.mark.skipif(not engine.COMPILED, reason="a flight of 30 hours")


def torque(gain, u, to_z, omega):
    """Torque of S-dot in the body, in NumPy; B0 = 1."""
    b, sun = to_z.T @ np.array(b_z(1.0, u, CONE)), to_z.T @ SUN
    return np.cross(gain * (b @ sun) * np.cross(omega, sun), b)


# ------------------------------------------------------------ all bodies


@pytest.mark.parametrize("moments", ORDERS)
def test_only_the_axis_of_the_greatest_moment_attracts(moments):
    """SDOT 2.4, last sentence: for every order of the moments, towards the Sun or away from it."""
    assert stable_axes(moments) == tuple(moment == max(moments) for moment in moments)
    assert stable_axes(moments, spin=-40.0) == stable_axes(moments)


def test_equal_moments_leave_their_axes_free():
    assert stable_axes((1.0, 1.0, 1.5)) == (False, False, True)
    assert stable_axes((1.5, 1.5, 1.0)) == (False, False, False)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_multipliers_match_the_mean_matrix_to_second_order(axis):
    here, second, third = np.roll(CHIBIS, -axis)
    off = []
    for eps in (0.08, 0.04, 0.02):
        values = {"spin": 4.7, "second": second / here, "third": third / here, "eps": eps}
        turn = monodromy(sun_spin_system, **values, cone=CONE, sun=math.acos(SUN[2]))
        found = np.sort(exponents(multipliers(turn), math.pi).real)
        mean = np.sort(np.linalg.eigvals(mean_matrix(CHIBIS, axis, 4.7, eps * here * A)).real)
        off.append(np.abs(found - mean).max())
        decay = mean_decay(CHIBIS, axis, eps * here * A)
        if axis != 1:  # the intermediate axis is unstable without any torque
            expected = np.sort(-np.repeat([decay.direction, decay.nutation], 2))
            assert mean == pytest.approx(expected, abs=0.1 * eps**2)
    assert np.all(np.array(off) < 0.05 * np.array([0.08, 0.04, 0.02]) ** 2 + 1e-9)


@needs_jit
@pytest.mark.parametrize("axis", [0, 2])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_disturbed_rotation_decays_or_grows_as_the_eigenvalues_say(axis, side, make):
    """The simulator, from a tilt of 1e-3 of the axis and of the momentum."""
    moments, spin, gain = np.array(CHIBIS), 0.025, 1.2
    to_inertial = np.array(dcm_z_to_y(CONE))
    sun = to_inertial @ SUN
    body = np.empty((3, 3))
    body[:, axis] = side * sun
    body[:, (axis + 1) % 3] = np.cross(sun, [0.0, 0.0, 1.0]) / np.hypot(*sun[:2])
    body[:, (axis + 2) % 3] = np.cross(body[:, axis], body[:, (axis + 1) % 3])
    around = {"gravity_gradient": False, "eclipse": "none", "sun_direction": sun.tolist()}
    scenario = make({
        "orbit": {"kind": "circular", "altitude_km": 350.0, "inclination_deg": INCLINATION_DEG},
        "environment": {"field": {"kind": "averaged", "b0": 3.4e-5}, "earth_rotation": "sidereal",
                        **around},
        "spacecraft": {"body": {"inertia_kg_m2": list(CHIBIS)}, "coils": {"limit_a_m2": 1e3}},
        "initial": {"quaternion": Rotation.from_matrix(body).as_quat().tolist(),
                    "rate_deg_s": np.degrees(spin * np.roll([1.0, 1e-3, 5e-4], axis)).tolist()},
        "control": {"law": {"kind": "sdot_rate", "gain_a_m2_s": gain}},
        "simulation": {"revolutions": 20.0, "record_s": 100.0, "tolerance_deg": 1e-6},
    })  # fmt: skip
    run = simulate(scenario)
    t, rate, momentum = (run[k].values for k in ("time", "omega_body", "momentum_inertial"))
    length = np.linalg.norm(momentum, axis=1)
    # what the energy has above that of a rotation about the axis: the square of the nutation
    energy = np.abs(0.5 * rate**2 @ moments - 0.5 * length**2 / moments[axis])
    off = np.linalg.norm(np.cross(momentum, sun), axis=1) / length
    decay = mean_decay(moments, axis, gain * 3.4e-5 * A)
    assert -0.5 * np.polyfit(t, np.log(energy), 1)[0] == pytest.approx(decay.nutation, rel=0.03)
    assert -np.polyfit(t, np.log(off), 1)[0] == pytest.approx(decay.direction, rel=0.03)


# ------------------------------------------------------------ nearly equal moments


def spinner_of(ratio, momentum=7.0):
    return Spinner(inclination_deg=INCLINATION_DEG, transverse_kg_m2=1.3, axial_kg_m2=1.3 * ratio,
                   momentum_n_m_s=momentum, sun=SUN.tolist())  # fmt: skip


def averaged_by_hand(slow, phi, moments, gain, momentum):
    """MAG (1.3.3) with the torque of S-dot, over psi and u: the trapezoid rule in NumPy."""
    to_z, total = np.array(dcm_l_to_z(slow.rho, slow.sigma)), np.zeros(5)
    a, b, c = moments
    sine, cosine, turns = math.sin(slow.theta), math.cos(slow.theta), 2.0 * math.pi * np.arange(12)
    for psi in turns / 12:
        body = np.array(dcm_body_to_l(phi, psi, slow.theta))
        omega = momentum * slow.l * body[2] / moments
        for u in turns / 12:
            m1, m2, m3 = body @ torque(gain, u, to_z @ body, omega) / (momentum * slow.l)
            cp, sp = math.cos(psi), math.sin(psi)
            spin, whole = math.sin(phi) * math.cos(phi), momentum * slow.l
            total += [
                slow.l * m3, m1, m2 / math.sin(slow.rho),
                whole * sine * spin * (1.0 / a - 1.0 / b) + m2 * cp - m1 * sp,
                whole * cosine * (1.0 / c - math.sin(phi) ** 2 / a - math.cos(phi) ** 2 / b)
                + (m1 * cp + m2 * sp) / sine,
            ]  # fmt: skip
    return total / 144.0


@pytest.mark.parametrize("ratio", [0.75, 1.4])
def test_nearly_axisymmetric_equations_are_the_averages_to_the_first_order(ratio):
    """SDOT (2.19) as corrected; for B = A exactly."""
    spinner, slow, phi, gain = spinner_of(ratio), Slow(0.8, 0.9, 0.4, 1.1), 0.6, 0.05
    case, errors = SDOT.case(gain, spinner), []
    for asymmetry in (0.0, 0.04, 0.02, 0.01):
        rates, own = nearly_axisymmetric_rates(slow, phi, case, asymmetry, spinner.eta)
        moments = np.array([1.3, 1.3 * (1.0 + asymmetry * ratio), 1.3 * ratio])
        expected = averaged_by_hand(slow, phi, moments, gain, 7.0)
        errors.append(np.abs(np.array([*rates, own]) - expected))
    assert np.all(errors[0] < 1e-14)
    slow_part, fast_part = (np.array([e[part].max() for e in errors[1:]])
                            for part in (slice(0, 3), slice(3, 5)))  # fmt: skip
    # eps times the asymmetry is left out; of the fast terms its square
    assert slow_part[:-1] / slow_part[1:] == pytest.approx([2.0, 2.0], rel=0.05)
    assert np.all(fast_part[:-1] / fast_part[1:] > 3.0)


@pytest.mark.parametrize("ratio", [0.75, 1.4])
@pytest.mark.parametrize("asymmetry", [0.05, -0.05, 0.0])
def test_table_2_1(ratio, asymmetry):
    """Rows of the table: for C > A theta = 0, pi; else phi by the sign of B - A."""
    spinner = spinner_of(ratio)
    points = axis_equilibria(SDOT.case(0.05, spinner), asymmetry, spinner.eta)
    half = 0.5 * math.pi
    expected = {(0.0, None), (math.pi, None)}
    if ratio < 1.0:
        phis = {0.05: (0.0, math.pi), -0.05: (half, 3.0 * half), 0.0: (None,)}[asymmetry]
        expected = {(half, phi) for phi in phis}
    assert {(p.theta, p.phi) for p in points if p.stable} == expected
    assert len(points) == (3 if asymmetry == 0.0 else 6)


@pytest.mark.parametrize(("sign", "phi", "axis"), [(1.0, 0.0, 1), (-1.0, 0.5 * math.pi, 0)])
def test_their_eigenvalues_are_those_of_the_whole_body(sign, phi, axis):
    """Nutation about axis 2 (phi = 0) or 1, in the rotating body, to the first order."""
    spinner, gain, off = spinner_of(0.75), 0.0002, []
    for asymmetry in (0.04 * sign, 0.02 * sign, 0.01 * sign):
        moments = (1.3, 1.3 * (1.0 + asymmetry * 0.75), 1.3 * 0.75)
        points = axis_equilibria(SDOT.case(gain, spinner), asymmetry, spinner.eta)
        (point,) = [p for p in points if p.phi == phi]
        found = point.eigenvalues[np.argmax(point.eigenvalues.imag)]
        whole = np.linalg.eigvals(mean_matrix(moments, axis, 7.0 / moments[axis], gain * A))
        swing = whole[np.argmin(np.abs(whole - found))]
        off.append([abs(found.real / swing.real - 1.0), abs(found.imag / swing.imag - 1.0)])
    ratios = np.array(off[:-1]) / np.array(off[1:])
    assert ratios == pytest.approx(np.full((2, 2), 2.0), rel=0.15)
