"""FIELD's satellite of Figs 10 and 11: which order of its moments gravity holds, and its axes."""

import itertools
import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gallery import four_models
from gallery.entries import field_2_16, field_10, field_11
from gallery.theory.pitch_wheel import (
    EQUILIBRIUM,
    MODELS,
    PITCH,
    bdot_rates,
    free_rates,
    orbital_field,
    pitch_offset_direct_dipole,
)
from torquer.base.conventions import MU_EARTH_M3_S2
from torquer.compile import engine
from torquer.simulation.setup.simulate import simulate
from torquer.theory.periodic.poincare import derivatives, small_parameter

needs_jit = pytest.mark.skipif(not engine.COMPILED, reason="minutes without JIT")


def growth(moments):
    """Greatest real part of the free motion's exponents, per radian of the orbit."""
    jacobian = derivatives(lambda x: free_rates(x, moments, 0.0), EQUILIBRIUM)
    return np.linalg.eigvals(jacobian).real.max()


def test_one_order_of_the_printed_moments_is_stable():
    stable = [m for m in itertools.permutations(field_10.PRINTED) if growth(m) < 1e-9]
    assert stable == [field_10.STABLE]
    assert growth(field_10.PRINTED) > 0.5


def test_the_pitch_frequency_is_near_the_orbital_rate():
    """0.90 of it: sqrt(3 (B - A)/C) with the moments up, motion, normal."""
    up, motion, normal = field_10.STABLE
    assert math.sqrt(3.0 * (motion - up) / normal) == pytest.approx(0.90, abs=5e-3)
    jacobian = derivatives(lambda x: free_rates(x, field_10.STABLE, 0.0), EQUILIBRIUM)
    found = np.abs(np.linalg.eigvals(jacobian).imag)
    assert np.abs(found - math.sqrt(3.0 * (motion - up) / normal)).min() < 1e-6


def test_the_turns_of_field_in_axes_of_x():
    """1-3-2 in (up, motion, normal) is 3-2-1 in (motion, normal, up), for a body so renamed."""
    run = field_10.scenario(field_10.law_of(1e8), "averaged", revolutions=1.0)
    to_x = Rotation.from_euler("ZYX", field_10.FIRST_ANGLES_DEG, degrees=True).as_matrix()
    fields = Rotation.from_quat(four_models.attitude(field_10.FIRST_ANGLES_DEG)).as_matrix()
    # columns: body axes up, motion, normal there; motion, normal, up here
    assert to_x == pytest.approx(fields[:, [1, 2, 0]], abs=1e-14)
    assert (run.initial.sequence, run.initial.reference) == ("321", "orbital")
    assert np.diag(run.spacecraft.body.inertia_kg_m2) == pytest.approx([4000.0, 5750.0, 2450.0])


def test_the_chosen_gains():
    from gallery.theory.pitch_wheel import PitchWheel

    satellite = PitchWheel(
        inertia_kg_m2=field_10.STABLE, gain_a_m2_s_t=field_10.chosen_gain(),
        altitude_km=1000.0, inclination_deg=82.5,
    )  # fmt: skip
    assert math.degrees(pitch_offset_direct_dipole(satellite)) == pytest.approx(6.0, rel=1e-12)
    # K and K_a again, from the mean of B^2 in the orbit plane
    u, i = np.linspace(0.0, 2.0 * math.pi, 400, endpoint=False), math.radians(82.5)
    radius = 7378137.0
    in_plane = (7.812e15 / radius**3 * math.sin(i)) ** 2 * (4.0 * np.sin(u) ** 2 + np.cos(u) ** 2)
    rate, law = math.sqrt(MU_EARTH_M3_S2 / radius**3), field_11.law()
    unit = in_plane.mean() / (5750.0 * rate)
    assert law["rate_gain_n_m_s_per_t2"] * unit == pytest.approx(1.0, rel=1e-9)
    assert law["angle_gain_n_m_per_t2"] * unit / rate == pytest.approx(4.0, rel=1e-9)


@needs_jit
def test_the_angle_is_to_the_turned_frame():
    """Before anything moves: the greatest angle of FIELD's initial attitude, by hand."""
    first = field_10.course(field_11.scenario("averaged"), field_11.TURN_DEG).angle_deg[0]
    body = Rotation.from_euler("ZYX", field_10.FIRST_ANGLES_DEG, degrees=True).as_matrix()
    wanted = Rotation.from_euler("Y", 40.0, degrees=True).as_matrix()
    assert first == pytest.approx(np.degrees(np.arccos(np.sum(body * wanted, axis=0).min())))
    # a positive turn about the normal takes the third axis from up towards the motion
    assert wanted[:, 2] == pytest.approx([math.sin(math.radians(40.0)), 0.0, 0.766044], abs=1e-6)


def field_series(model):
    """Fourier coefficients `[16, 3]` of a model's field over a revolution, as `orbital_field`."""
    run = field_10.scenario(field_10.law_of(1e8), model, revolutions=1.1)
    result = simulate(run)
    up, v = result["position_inertial"].values, result["velocity_inertial"].values
    normal = np.cross(up, v)
    frame = np.stack([up, np.cross(normal, up), normal], axis=1)
    frame /= np.linalg.norm(frame, axis=2, keepdims=True)
    b = np.einsum("nij,nj->ni", frame, result["b_inertial"].values)
    t = np.arange(64) * run.orbit.period_s / 64
    rows = [np.interp(t, result["time"].values, b[:, k]) for k in range(3)]
    series = np.fft.rfft(np.stack(rows, axis=1), axis=0)[:16] / 64
    series[1:] *= 2.0
    return series / (7.812e15 / run.orbit.radius_m**3)


@needs_jit
def test_the_quadrupole_drives_pitch_near_its_resonance():
    """The small-parameter method with IGRF's field of one revolution: FIELD-10's reason."""
    satellite = field_2_16.satellite(82.5).model_copy(
        update={"gain_a_m2_s_t": field_10.chosen_gain(), "wheel_momentum_n_m_s": 0.0}
    )
    inertia = satellite.inertia_kg_m2

    def once_a_revolution(field):
        response = small_parameter(
            lambda x: free_rates(x, inertia, 0.0),
            lambda u, x: bdot_rates(u, x, field, inertia),
            EQUILIBRIUM,
            near=0.15,
        )
        return math.degrees(satellite.epsilon * response.amplitudes[1, PITCH]), response

    swing, response = once_a_revolution(field_series("IGRF-14"))
    assert swing > 2.0
    (resonance,) = response.resonances
    assert (resonance.harmonic, resonance.eigenvalue.imag) == (1, pytest.approx(0.899, abs=1e-3))
    for model in MODELS:
        assert once_a_revolution(orbital_field(model, math.radians(82.5)))[0] < 1e-9
    # the tilted dipole turns by 26 deg meanwhile: not quite a constant dipole
    assert once_a_revolution(field_series("tilted dipole"))[0] < 0.15 * swing
