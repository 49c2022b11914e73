"""What RK4 does to the motion by itself is reported; what its step cannot follow ends the run."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import torquer
from torquer import RunStopped, simulate
from torquer.analysis.notes.notes import write_notes
from torquer.compile import engine
from torquer.maths.integrate.rk4 import MOST_NUTATION, MOST_TURN
from torquer.scenario.load import ScenarioError
from torquer.scenario.resolution import QUIET_DAMPING, speeds_at_start, step_that_keeps

needs_jit = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")

#: A gyrostat whose nutation takes 5.4 s, without control and without gravity.
GYROSTAT = {
    "spacecraft.body": {
        "inertia_kg_m2": [0.03, 0.03, 0.01],
        "wheel_momentum_n_m_s": [0.0, 0.02, 0.0],
    },
    "environment.gravity_gradient": False,
    "initial": {"rate_deg_s": [1.0, 0.0, 0.5]},
}
#: A sphere that a torque spins up by 0.57 deg/s a second.
SPUN_UP = {
    "disturbance.constant_torque_n_m": [0.0, 0.0, 0.01],
    "spacecraft.body.inertia_kg_m2": [1.0, 1.0, 1.0],
    "initial": {"rate_deg_s": [0.0, 0.0, 1.0]},
}
NUTATION = 0.02 / np.sqrt(0.03 * 0.01)


def gyrostat(make, step_s, **simulation):
    keys = {"revolutions": 1.0, "step_s": step_s, "record_s": 10.0} | simulation
    return make({**GYROSTAT, "simulation": keys})


def amplitude(result):
    """Amplitude of the nutation: A w_x^2 + C w_z^2 about its mean is constant in free motion."""
    omega = result.omega_body.values[:, [0, 2]] - result.omega_body.values[:, [0, 2]].mean(axis=0)
    return np.sqrt(0.03 * omega[:, 0] ** 2 + 0.01 * omega[:, 1] ** 2)


@needs_jit
@pytest.mark.parametrize("step_s", [0.2, 0.25, 0.5])
def test_the_damping_that_is_reported_is_the_damping_that_happened(make, step_s):
    result = simulate(gyrostat(make, step_s))
    lost = np.log(amplitude(result)[:30].mean() / amplitude(result)[-30:].mean())
    answer = -np.log1p(-float(result.rk4_damping))
    z = NUTATION * step_s  # the next term of RK4's polynomial: -(1 - z^2/8) z^6/144
    whole = 1.0 - 30.0 / result.sizes["time"]  # from the middle of the first 30 rows to the last
    assert lost == pytest.approx(answer * whole * (1.0 - z * z / 8.0), rel=0.03)


@needs_jit
def test_adaptive_steps_keep_the_nutation_and_tell_of_no_damping(make):
    result = simulate(gyrostat(make, None))
    assert amplitude(result)[-30:].mean() == pytest.approx(amplitude(result)[:30].mean(), rel=2e-3)
    assert "rk4_damping" not in result
    assert not any("nutation" in note for note in write_notes(gyrostat(make, None)))


def test_a_step_that_cannot_follow_the_nutation_is_refused(make):
    with pytest.raises(ScenarioError) as error:
        gyrostat(make, 1.0)
    assert str(error.value) == (
        "simulation.step_s: must be at most 0.866 s for RK4 to follow the nutation of 66.2 deg/s, "
        "or left out for adaptive steps; received 1 s"
    )


def test_a_step_that_cannot_follow_the_initial_rate_is_refused(make):
    with pytest.raises(ScenarioError) as error:
        make({"spacecraft.body.inertia_kg_m2": [1, 1, 1], "initial.rate_deg_s": [0, 0, 130]})
    assert str(error.value) == (
        "simulation.step_s: must be at most 0.881 s for RK4 to follow the initial rate of "
        "130 deg/s, or left out for adaptive steps; received 1 s"
    )


def test_initial_speeds_of_wheels_count(make):
    wheels = {
        "layout": {"kind": "orthogonal"}, "momentum_limit_n_m_s": 20.0, "torque_limit_n_m": 0.1,
        "speed_limit_rpm": 6000.0, "initial_speed_rpm": 3000.0,
    }  # fmt: skip
    scenario = make({"spacecraft.wheels": wheels, "simulation.step_s": 0.05})
    momentum = np.full(3, 10.0)
    inertia = np.array(scenario.spacecraft.body.inertia_kg_m2)
    inertia = inertia - np.eye(3) * 20.0 / (6000.0 * np.pi / 30.0)
    alone = np.sqrt(momentum @ inertia @ momentum / np.linalg.det(inertia))
    speeds = speeds_at_start(scenario.spacecraft, scenario.initial)
    assert speeds.nutation == pytest.approx(alone, rel=0.01)  # the body's own rate is small
    with pytest.raises(ScenarioError, match="to follow the nutation of"):
        make({"spacecraft.wheels": wheels})


@needs_jit
def test_the_note_names_a_step_that_keeps_the_nutation(make):
    (note,) = write_notes(gyrostat(make, 0.5))
    assert note == (
        "RK4 with a step of 0.5 s damps a nutation of 66.2 deg/s numerically, by 94.8 % of its "
        "amplitude in this run: take steps of 0.16 s or less, or adaptive ones (no step_s)"
    )
    duration_s = gyrostat(make, 0.5).steps() * 0.5
    assert step_that_keeps(QUIET_DAMPING, NUTATION, duration_s) == pytest.approx(0.16, abs=0.005)
    result = simulate(gyrostat(make, 0.1))
    assert write_notes(gyrostat(make, 0.1)) == []
    assert float(result.rk4_damping) < QUIET_DAMPING


@needs_jit
@pytest.mark.parametrize("rate_deg_s", [30.0, 60.0])
def test_the_lag_that_is_reported_is_the_lag_that_happened(make, rate_deg_s):
    changes = {
        "spacecraft.body.inertia_kg_m2": [1.0, 1.0, 1.0],
        "environment.gravity_gradient": False,
        "initial": {"rate_deg_s": [0.0, rate_deg_s, 0.0]},
    }
    result = simulate(make(changes))
    turned = Rotation.from_quat(result.q_body_to_inertial.values[-1])
    exact = Rotation.from_rotvec([0.0, np.radians(rate_deg_s) * 600.0, 0.0])
    z = np.radians(rate_deg_s)
    behind = (exact * turned.inv()).as_rotvec()[1]
    assert behind == pytest.approx(float(result.rk4_lag), rel=0.1 * z * z)


@needs_jit
def test_motion_outgrowing_the_step_ends_run_and_keeps_the_record(make):
    changes = SPUN_UP | {
        "simulation.step_s": 2.0,
        "control.sample_s": 2.0,
    }
    with pytest.raises(RunStopped) as error:
        simulate(make(changes))
    result = error.value.result
    rate = np.linalg.norm(result.omega_body.values, axis=1)
    assert rate[-1] * 2.0 > MOST_TURN >= rate[-2] * 2.0
    assert str(error.value).startswith(
        "simulation.step_s: must be shorter for RK4 to follow the motion from t = 100 s on, or "
        "left out for adaptive steps; received 2 s; quaternion and rate: "
    )


@needs_jit
def test_motion_outgrowing_step_after_last_record_ends_run_too(make):
    changes = SPUN_UP | {
        "simulation": {"duration_s": 600.0, "step_s": 1.0, "record_s": 600.0},
    }
    with pytest.raises(RunStopped, match=r"^simulation\.step_s: .* from t = 600 s on") as error:
        simulate(make(changes))
    result = error.value.result
    assert result.sizes["time"] == 2 and result.attrs["how_it_ended"] == "failed"
    with pytest.raises(RunStopped, match="from t = 600 s on"):
        torquer.resume(simulate(make(changes), until_s=100.0))


@needs_jit
def test_report_and_summary_tell_what_the_steps_did(make):
    from torquer.report.flight.notes import notes
    from torquer.report.flight.view import make_view

    result = simulate(gyrostat(make, 0.5))
    summary = torquer.summarise(result)
    assert summary["rk4_damping"] == float(result.rk4_damping) > 0.9
    assert any(
        "of the amplitude of nutation or libration" in note for note in notes(make_view(result))
    )
    assert "rk4_damping" not in torquer.summarise(
        simulate(gyrostat(make, None, revolutions=None, duration_s=60.0))
    )


def test_the_limits_are_what_their_comment_says():
    assert -np.expm1(-(MOST_NUTATION**6) / 144.0) == pytest.approx(0.007, abs=5e-4)
    assert np.degrees(MOST_TURN**5 / 1920.0) == pytest.approx(1.0, abs=0.05)
