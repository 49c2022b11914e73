"""Frozen models of the magneto-gyroscopic system next to the exact ones."""

import math

import numpy as np
import pytest

from torquer.theory.magneto_gyro import comparison
from torquer.theory.magneto_gyro.accuracy import covariances, follow_revolution, steady_motion
from torquer.theory.magneto_gyro.comparison import CaptureGains
from torquer.theory.magneto_gyro.craft import GyroCraft
from torquer.theory.magneto_gyro.frozen import STATES_1, frozen_2
from torquer.theory.magneto_gyro.loop import CONE, Satellite
from torquer.theory.magneto_gyro.own_dipole import stage_1_steady_motion
from torquer.theory.magneto_gyro.stage_1 import STAGE_1
from torquer.theory.magneto_gyro.stage_2 import stage_2_loop
from torquer.theory.magneto_gyro.stage_2_gains import Stage2Weights, stage_2_gains
from torquer.theory.periodic.floquet import degree_of_stability, monodromy, multipliers

CRAFT = GyroCraft((3800.0, 2200.0, 3600.0), 30.0, 1.0317e-3)
WEIGHTS = Stage2Weights(angle=27.7, torque=182.0, turning=109.0, constant=45.5)
GAINS = stage_2_gains(CRAFT.gyrostat, WEIGHTS)


def test_stage_1_degrees_match_those_computed_point_by_point():
    gains = CaptureGains(np.array([4.0, 9.0]), np.array([6.0, 2.0]), 40.0, 0.5)
    found = comparison.stage_1_degrees(CRAFT, gains, np.array([3.0, 8.0]), -0.1)
    for i, h in enumerate((3.0, 8.0)):
        craft = CRAFT.with_wheel(CRAFT.wheel_at(h))
        loop = STAGE_1.with_parameters(
            **craft.satellite()._asdict(), normal=-0.1, frequency=40.0, damping=0.5,
            angle_gain=gains.angle_gain[i], rate_gain=gains.rate_gain[i],
        )  # fmt: skip
        exact = degree_of_stability(multipliers(monodromy(loop, tolerance=1e-9)), 2.0 * math.pi)
        assert found.exact[i] == pytest.approx(float(exact), abs=1e-4)
        assert found.frozen[i] == pytest.approx(found.exact[i], abs=0.1)


@pytest.mark.parametrize("h", [3.0, 6.46])
def test_the_lag_of_the_filters_bounds_the_rate_gain(h):
    """In both models at about n = 2 xi omega times the least moment of inertia, over J."""
    bound = 2.0 * 0.7 * 60.0 * CRAFT.pitch_inertia
    gains = CaptureGains(4.0, np.array([0.9, 1.1]) * bound, 60.0)
    found = comparison.stage_1_degrees(CRAFT, gains, h)
    for degrees in found:
        assert degrees[0] > 0.0 > degrees[1]


def test_frozen_model_certifies_nothing_over_h_for_stage_1():
    h = np.array([-0.3, 0.3, 0.8, 1.5, 3.0])
    found = comparison.stage_1_degrees(CRAFT, CaptureGains(4.0, 6.0, 95.0), h, -0.1)
    assert (found.frozen > 0.0).tolist() == [False, True, True, True, True]
    assert (found.exact > 0.0).tolist() == [False, True, False, True, True]


def test_stage_1_is_unstable_for_two_ranges_of_h():
    """h of 0 to 0.18 and of 0.51 to 1.07, as the errata and the page on the system say."""
    gains = CaptureGains(4.0, 6.0, 0.0982 / 1.03165e-3, 0.7)
    craft = GyroCraft((3800.0, 2200.0, 3600.0), 30.0, 1.03165e-3)
    edges = {0.01: 0.02, 0.19: 0.17, 0.51: 0.53, 1.07: 1.05}
    stable = comparison.stage_1_degrees(craft, gains, np.array([*edges]), -0.1).exact
    unstable = comparison.stage_1_degrees(craft, gains, np.array([*edges.values()]), -0.1).exact
    assert (stable[1:] > 0.0).all() and (unstable < 0.0).all()
    middle = comparison.stage_1_degrees(craft, gains, np.array([0.2, 0.3, 0.5]), -0.1).exact
    assert middle == pytest.approx([0.008, 0.041, 0.085], abs=1e-3)


def test_the_degrees_of_stage_2_over_h():
    crafts = [CRAFT.with_wheel(CRAFT.wheel_at(h)) for h in (2.0, 2.1, 6.46)]
    found = comparison.stage_2_degrees(crafts, lambda craft: stage_2_gains(craft, WEIGHTS))
    assert np.isnan([found.frozen[0], found.exact[0]]).all()
    assert found.exact[1] < 0.12 and found.exact[2] > 0.25
    h, i = crafts[2].gyrostat
    frozen = frozen_2(stage_2_gains(crafts[2].gyrostat, WEIGHTS), stiffness=h, pitch_inertia=i)
    assert found.frozen[2] == pytest.approx(-np.linalg.eigvals(frozen).real.max())


def test_a_locus_follows_every_root():
    factors = np.geomspace(0.2, 5.0, 200)
    h, i = CRAFT.gyrostat
    matrices = [frozen_2(comparison.with_factor(GAINS, f), stiffness=h, pitch_inertia=i)
                for f in factors]  # fmt: skip
    found = comparison.locus(matrices)
    for matrix, roots in zip(matrices[::40], found[::40], strict=True):
        assert np.sort_complex(roots) == pytest.approx(np.sort_complex(np.linalg.eigvals(matrix)))
    # of the estimator and compensator at b = 0: not moved by these gains, and never exchanged
    still = np.abs(found - found[0]).max(axis=0) < 1e-6
    assert still.sum() == 9


def test_frozen_error_along_orbit_is_exact_in_computed_field():
    h, i = CRAFT.gyrostat
    satellite, noise = Satellite(1.0, i, 1.0, h + 2.0 - i, 0.0), [0.3] * 3 + [1.0] * 3
    loop = stage_2_loop(satellite, CRAFT.gyrostat, GAINS, normal=0.2, field=CONE)
    path = covariances(follow_revolution(loop, 1440), noise)
    want = np.sqrt(np.einsum("nii->ni", path)[:, :3])
    tau = np.linspace(0.0, 2.0 * math.pi, 1440, endpoint=False)
    frozen = comparison.frozen_covariance(GAINS, CRAFT.gyrostat, noise, 0.2)
    found = comparison.frozen_error(frozen, tau)
    assert found == pytest.approx(want, rel=5e-3)
    assert np.ptp(found[:, 0]) > 1e-2 * found[0, 0]  # roll and yaw change along the orbit


def test_there_is_no_covariance_of_an_unstable_model():
    with pytest.raises(ArithmeticError, match="the model must be stable"):
        comparison.frozen_covariance(comparison.with_factor(GAINS, -1.0), CRAFT.gyrostat, [1.0] * 6)


def test_angles_have_zeros_at_the_frequencies_of_constant_dipole():
    bare = GAINS._replace(e1=0.0, e2=0.0, e3=0.0)
    for words, at in (("along pitch", 0.0), ("across pitch", 1.0)):
        near = np.array([at + 1e-4, at + 1e-2])
        torque = comparison.dipole_torque(near, 0.2)[words]
        with_it = comparison.dipole_response(GAINS, CRAFT.gyrostat, near, torque, 0.2).max(axis=1)
        without = comparison.dipole_response(bare, CRAFT.gyrostat, near, torque, 0.2).max(axis=1)
        assert with_it[1] / with_it[0] == pytest.approx(100.0, rel=0.1)  # of first order
        assert without[1] / without[0] == pytest.approx(1.0, rel=0.1)
        assert with_it[0] < 1e-3 * without[0]


def test_response_is_the_loops_steady_motion_in_computed_field():
    """A torque about the pitch axis that oscillates with twice the orbital rate."""
    h, i = CRAFT.gyrostat
    satellite = Satellite(1.0, i, 1.0, h + 2.0 - i, 0.0)
    loop = stage_2_loop(satellite, CRAFT.gyrostat, GAINS, normal=0.2, field=CONE)
    around = follow_revolution(loop, 1440)
    tau = (np.arange(1440) + 0.5) * 2.0 * math.pi / 1440
    push = np.zeros((1440, 6))
    push[:, 1] = np.cos(2.0 * tau)
    pitch = steady_motion(around, push)[:, 1]
    (want,) = comparison.dipole_response(GAINS, CRAFT.gyrostat, [2.0], (0, 1, 0), 0.2)
    assert np.sqrt(2.0 * np.mean(pitch**2)) == pytest.approx(want[1], rel=1e-3)


def test_exact_stage_1_steady_motion_equals_frozen_in_computed_field():
    """A torque about pitch that oscillates with twice the orbital rate; filters of high frequency,
    whose derivative of the calculated field is nearly the exact one."""
    h, i = CRAFT.gyrostat
    gains, tau = CaptureGains(4.0, 6.0, 2000.0), (np.arange(720) + 0.5) * 2.0 * math.pi / 720
    push = np.zeros((720, 6))
    push[:, 1] = np.cos(2.0 * tau)
    loop = STAGE_1.with_parameters(
        x=1.0, y=i, z=1.0, wheel=h + 2.0 - i, gravity=0.0, **CONE, **gains._asdict()
    )
    pitch = stage_1_steady_motion(loop, push)[:, 1]
    matrix = comparison.stage_1_frozen(CRAFT, gains)
    driven = np.zeros(12)
    driven[STATES_1.index("theta'")] = 1.0 / i
    answer = np.linalg.solve(2.0j * np.eye(12) - matrix, driven)[STATES_1.index("theta")]
    assert np.sqrt(2.0 * np.mean(pitch**2)) == pytest.approx(abs(answer), rel=1e-2)
