"""Steps that keep a tolerance: against exact motions, the same readings, messages, refusals."""

import json
import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from integrators import by
from scipy.integrate import RK45

from torquer import RunStopped, integration_error, simulate, summarise
from torquer.compile import engine
from torquer.maths.geometry.motion import Motion
from torquer.maths.integrate import dop853_stages, dop853_tableau, dp5_stages
from torquer.scenario.control import common_divisor
from torquer.scenario.load import ScenarioError

needs_jit = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")

#: Sensors with noise, a random torque held for 4 s: the same for every integrator.
NOISY = {
    "environment.field.kind": "igrf14",
    "spacecraft.magnetometer.noise_nt": 50.0,
    "spacecraft.gyro": {"noise_deg_s": 0.01, "bias_drift_deg_s_sqrt_s": 1e-3, "sample_s": 1.0},
    "spacecraft.attitude_sensor.noise_deg": 0.1,
    "disturbance": {"random_torque_n_m": 1e-7, "random_hold_s": 4.0},
    "control": {"law": {"kind": "bdot", "gain_a_m2_s_per_t": 1e6}, "sample_s": 2.0},
}


def adaptive(make, changes=(), **simulation):
    keys = {"duration_s": 600.0, "record_s": 10.0} | simulation
    return make(dict(changes) | {"simulation": keys})


def attitude_error(a, b):
    """Greatest angle [rad] between two attitudes over a run."""
    p, q = a.q_body_to_inertial.values, b.q_body_to_inertial.values
    apart = np.minimum(np.linalg.norm(p - q, axis=1), np.linalg.norm(p + q, axis=1))
    return 2.0 * apart.max()


@needs_jit
@pytest.mark.parametrize("tolerance_deg", [1e-4, 1e-6])
def test_the_nutation_of_a_gyrostat_stays_what_it_is(make, tolerance_deg):
    """A sphere with a wheel: in the body the rate turns about the wheel at h/A, exactly."""
    inertia, wheel, rate = 0.05, 0.0331, math.radians(1.0)
    speed = wheel / inertia
    assert math.degrees(speed) == pytest.approx(37.9, abs=0.1)
    scenario = adaptive(
        make,
        {
            "spacecraft.body": {
                "inertia_kg_m2": [inertia] * 3,
                "wheel_momentum_n_m_s": [0.0, 0.0, wheel],
            },
            "environment.gravity_gradient": False,
            "initial": {"rate_deg_s": [1.0, 0.0, 0.0]},
            "control.sample_s": 10.0,
        },
        revolutions=1.0,
        duration_s=None,
        tolerance_deg=tolerance_deg,
    )
    result = simulate(scenario)
    t = result.time.values
    # w x' = -(h/A) w_y and so on: J w' = -w x h
    exact = rate * np.stack([np.cos(speed * t), np.sin(speed * t)], axis=1)
    found = result.omega_body.values[:, :2]
    across = np.linalg.norm(found, axis=1)
    assert np.abs(across / rate - 1.0).max() < 1e-4 * tolerance_deg / 1e-4
    assert np.abs(found - exact).max() < 1e-4 * rate


#: Another integrator, whose steps are far too short to be seen in the comparison.
FINE_RK4 = {"simulation.step_s": 0.01}


@needs_jit
def test_error_falls_with_tolerance_and_stays_below_the_reported(make):
    changes = {
        "initial.rate_deg_s": [10.0, -6.0, 8.0],
        "control": {"law": {"kind": "bdot_rate", "gain_a_m2_s_per_t": 3e5}, "sample_s": 20.0},
        "spacecraft.coils.lag_s": 0.5,
    }
    exact = simulate(make(changes | FINE_RK4))
    errors = []
    for tolerance_deg in (1.0, 1e-2, 1e-4):
        result = simulate(adaptive(make, changes, tolerance_deg=tolerance_deg))
        errors.append(attitude_error(result, exact))
        assert errors[-1] < float(result.integration_error)
        assert errors[-1] < math.radians(tolerance_deg)
    assert errors[0] > 10.0 * errors[1] > 100.0 * errors[2]


@needs_jit
@pytest.mark.parametrize("steps", [{"tolerance_deg": 1.0}, {"step_s": 2.0}, {"step_s": 0.5}])
def test_the_measured_error_is_the_error(make, steps):
    changes = {
        "initial.rate_deg_s": [6.0, -4.0, 5.0],
        "control": {"law": {"kind": "bdot_rate", "gain_a_m2_s_per_t": 3e5}, "sample_s": 20.0},
    }
    coarse = make(changes | {"simulation": {"duration_s": 600.0, "record_s": 20.0, **steps}})
    finest = FINE_RK4 | {"simulation.record_s": 20.0}
    true = attitude_error(simulate(coarse), simulate(make(changes | finest)))
    measured = integration_error(coarse)
    assert float(measured.attitude_error.max()) == pytest.approx(true, rel=0.2)
    assert float(measured.attitude_error[0]) == float(measured.rate_error[0]) == 0.0
    assert 0.0 < float(measured.rate_error.max()) < true


@needs_jit
def test_the_error_of_steps_that_events_end_is_measured_too(make):
    """Both tolerances are kept by steps as long as the intervals: only shorter ones tell more."""
    slow = {"initial.rate_deg_s": [0.6, -0.4, 0.5], "control.sample_s": 20.0}
    result = simulate(adaptive(make, slow, tolerance_deg=10.0))
    assert 9.0 < float(result.mean_step) < 10.0  # records each 10 s; the first steps are shorter
    exact = simulate(make(slow | FINE_RK4))
    measured = float(integration_error(result).attitude_error.max())
    assert measured == pytest.approx(attitude_error(result, exact), rel=0.1)


@needs_jit
def test_no_step_is_longer_than_the_longest_allowed(make):
    slow = {"initial.rate_deg_s": [0.1, 0.0, 0.1], "control.sample_s": 10.0}
    result = simulate(adaptive(make, slow, max_step_s=4.0))
    assert 180 <= float(result.steps) < 184  # three in 10 s, the first ones shorter


@needs_jit
def test_error_of_a_prematurely_ended_run_is_not_measured(make):
    early = simulate(adaptive(make), until_s=100.0)
    message = "flown: must be a complete run; received one that stopped at t = 100 s as asked"
    with pytest.raises(ValueError, match=f"^{message}$"):
        integration_error(early)


@needs_jit
def test_readings_have_the_same_noise_whatever_the_steps(make):
    results = [
        simulate(make(NOISY | {"simulation.duration_s": 300.0} | steps))
        for steps in (
            {"simulation.step_s": 0.1},
            {"simulation.step_s": 0.25},
            by("auto") | {"simulation.tolerance_deg": 1e-7},
        )
    ]
    noises = [result.omega_measured.values - result.omega_body.values for result in results]
    assert np.abs(noises[0]).max() > math.radians(0.01)
    for noise, result in zip(noises, results, strict=True):
        assert np.abs(noise - noises[0]).max() < 1e-9
        assert attitude_error(result, results[-1]) < 1e-7


@needs_jit
def test_steps_fit_the_motion_and_fill_slow_intervals(make):
    control = {"control.sample_s": 10.0}
    fast = simulate(adaptive(make, control | {"initial.rate_deg_s": [60.0, 0.0, 10.0]}))
    slow = simulate(adaptive(make, control | {"initial.rate_deg_s": [0.1, 0.0, 0.1]}))
    assert float(fast.least_step) < 1.0
    assert float(slow.mean_step) > 8.0
    assert float(slow.steps) == pytest.approx(600.0 / float(slow.mean_step))


@needs_jit
def test_the_summary_tells_the_error_and_the_steps(make):
    summary = summarise(simulate(adaptive(make)))
    assert 0.0 < summary["integration_error_deg"] < 1e-4
    assert 0.0 < summary["least_step_s"] <= summary["mean_step_s"] <= 10.0
    assert "rk4_damping" not in summary
    assert json.dumps(summary)


@needs_jit
def test_a_motion_that_is_too_fast_ends_with_one_line(make):
    scenario = adaptive(make, {"disturbance.constant_torque_n_m": [0.0, 0.0, 1e9]})
    with pytest.raises(RunStopped) as stopped:
        simulate(scenario)
    assert "the motion is too fast for adaptive steps after t = " in str(stopped.value)
    assert "\n" not in str(stopped.value)
    assert stopped.value.result.attrs["how_it_ended"] == "failed"


def weights_of(function, row, start, h):
    """What a sum of stages weighs its derivatives with: unit derivatives tell one by one."""
    used = [k for k, weight in enumerate(row) if weight != 0.0]
    nothing = Motion((0.0,) * 4, (0.0,) * 3)
    one = Motion((0.0, 0.0, 1.0, 0.0), (0.0, 1.0, 0.0))
    weights = np.zeros(len(row))
    for k in used:
        found = function(*start, h, *(one if k == other else nothing for other in used))
        assert found.q[2] == found.omega[1]
        weights[k] = found.q[2] / h
    return weights


@pytest.mark.parametrize(
    ("stages", "tableau", "sums"),
    [
        (
            dop853_stages,
            (dop853_tableau.A, dop853_tableau.C),
            {
                "sum_8": dop853_tableau.B,
                "error_5": dop853_tableau.ERROR_5[:12],
                "error_3": dop853_tableau.ERROR_3[:12],
            },
        ),
        (dp5_stages, (RK45.A, RK45.C), {"sum_5": RK45.B, "error_4": -RK45.E}),
    ],
    ids=["8(5,3)", "5(4)"],
)
def test_the_stages_written_out_are_those_of_the_tableau(stages, tableau, sums):
    """Of order 5(4): as SciPy has it."""
    start = (Motion((0.0,) * 4, (0.0,) * 3),)
    a, c = tableau
    for s in range(1, len(c)):
        found = weights_of(getattr(stages, f"stage_{s}"), a[s, :s], start, 0.5)
        assert np.abs(found - a[s, :s]).max() < 1e-14
    for name, row in sums.items():
        found = weights_of(getattr(stages, name), row, start if "sum" in name else (), 0.5)
        assert np.abs(found - row).max() < 1e-14
    assert stages.C[: len(c)] == pytest.approx(tuple(c), abs=1e-16)


TIMES = st.lists(st.integers(1, 10**7), min_size=1, max_size=5)


@settings(max_examples=200, deadline=None)
@given(TIMES, st.sampled_from([1.0, 0.1, 0.25, 1e-3, 1e-6]))
def test_every_time_is_a_multiple_of_the_grid(counts, unit_s):
    times = {str(k): count * unit_s for k, count in enumerate(counts)}
    grid_s = common_divisor(times)
    for time_s in times.values():
        assert time_s / grid_s == pytest.approx(round(time_s / grid_s), rel=1e-9)
    assert grid_s >= unit_s * (1.0 - 1e-9) or any(len(repr(t)) > 15 for t in times.values())


def test_grid_is_the_fixed_step_or_common_divisor_of_times(make):
    assert make({"simulation.step_s": 0.5}).grid_s == 0.5
    times = {
        "control": {"law": {"kind": "off"}, "sample_s": 3.0, "measure_s": 6.0, "actuate_s": 4.0}
    }
    assert adaptive(make, times, record_s=7.0).grid_s == 1.0
    late = times | {"spacecraft.gyro": {"sample_s": 2.0, "delay_s": 0.3}}
    assert adaptive(make, late, record_s=7.0).grid_s == pytest.approx(0.1)


def test_a_step_means_rk4_and_none_adaptive_steps(make):
    assert make({"simulation.step_s": 0.5}).simulation.integrator == "rk4"
    assert adaptive(make).simulation.integrator == "auto"
    assert make({"simulation.integrator": "splitting"}).simulation.step_s == 1.0


@pytest.mark.parametrize(
    ("simulation", "line"),
    [
        ({"integrator": "auto", "step_s": 0.5},
         "simulation.step_s: must be left out with integrator 'auto', whose accuracy is "
         "tolerance_deg; received 0.5 s"),
        ({"integrator": "rk4"},
         "simulation.step_s: must be given with integrator 'rk4'; received none"),
        ({"integrator": "splitting"},
         "simulation.step_s: must be given with integrator 'splitting'; received none"),
        ({"step_s": 0.5, "tolerance_deg": 1e-3},
         "simulation.tolerance_deg: must be left out except with integrator 'auto'; received 0.001 "
         "with 'rk4'"),
        ({"step_s": 0.5, "max_step_s": 2.0},
         "simulation.max_step_s: must be left out except with integrator 'auto'; received 2 s "
         "with 'rk4'"),
        ({"record_s": 10.0000000001},
         "scenario.simulation.record_s: must have a common divisor of 1e-9 s or more with the "
         "other times; received 10.0000000001 s"),
    ],
)  # fmt: skip
def test_what_makes_no_sense_about_steps_is_one_line(make, simulation, line):
    with pytest.raises(ScenarioError) as error:
        adaptive(make, **simulation)
    assert str(error.value).removeprefix("scenario.") == line.removeprefix("scenario.")
