"""The filter without a gyro: a twin, statistics, wheels, residual dipole, the field alone."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from filter_cases import DISTURBANCE, DYNAMICS, SCENARIO, without
from filter_twin import DynamicsTwin
from scipy.spatial.transform import Rotation
from slow_cases import slow_after

from torquer import simulate
from torquer.analysis.filters.filter_flights import fly_filter
from torquer.analysis.filters.filter_members import make_members
from torquer.analysis.filters.filter_statistics import consistency, nees, nis
from torquer.base.user_source import plain_function
from torquer.compile import engine
from torquer.computer.estimation.kalman_dynamics import linearise
from torquer.maths.geometry.quaternion import angle_between
from torquer.scenario.load import scenario_from_data

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
FIELD = {**without(DYNAMICS, "sun_noise_deg"), "sensors": ["magnetometer"]}
#: All states that may be estimated in addition: the filter is compiled for them once.
DIPOLE_AND_BIAS = {"dipole_sigma_a_m2": 0.05, "magnetometer_bias_sigma_nt": 300.0}
WHEELS = {
    "layout": {"kind": "orthogonal"},
    "momentum_limit_n_m_s": 0.5,
    "torque_limit_n_m": 0.005,
    "initial_speed_rpm": 1500.0,
}


def scenario(estimator=DYNAMICS, spacecraft=None, law=None, **changes):
    return scenario_from_data(
        {
            **SCENARIO,
            "spacecraft": SCENARIO["spacecraft"] | (spacecraft or {}),
            "disturbance": DISTURBANCE,
            "control": {"law": law or {"kind": "off"}, "estimator": estimator},
            "simulation": {**SCENARIO["simulation"], **changes},
        }
    )


@pytest.mark.parametrize(
    ("sample_s", "rate_deg_s", "first", "last", "within"),
    slow_after(
        1, [(1, (0.1, -0.06, 0.08), 0, 100, 0.01), (8, (2, -1.2, 1.6), 50, 300, 0.5)], names=5
    ),
)
def test_estimates_are_those_of_the_twin(sample_s, rate_deg_s, first, last, within):
    """To a hundredth of sigma: the twin integrates by DOP853, linearises by differences.

    To a half where the body turns by 22 deg from sample to sample, from a sample on at which the
    rate has been found. The filter does that in steps of 3 deg, to second order: with half of them
    it is four times as near to the twin.
    """
    estimator = DYNAMICS | {"record_covariance": True, "rate_sigma_deg_s": 0.2 * sample_s}
    flown = scenario(estimator, record_s=float(sample_s), duration_s=float(last * sample_s))
    flown = flown.replace("initial.rate_deg_s", list(map(float, rate_deg_s)))
    found = simulate(flown.replace("control.sample_s", float(sample_s)))
    covariance = found["estimator.covariance"].values
    inertia = np.array(DYNAMICS["inertia_kg_m2"])
    q, omega = (found[f"{name}_estimated"].values for name in ("q", "omega"))
    twin = DynamicsTwin(q[first], omega[first], covariance[first], inertia, 1e-6)
    names = ("position_inertial", "b_inertial", "sun_inertial", "b_measured", "sun_measured")
    r, b, sun, b_read, sun_read = (found[name].values for name in names)
    for k in range(first + 1, last):
        for part in range(sample_s):
            twin.propagate(r[k - 1] + part / sample_s * (r[k] - r[k - 1]), 1.0)
        twin.update(b[k], b_read[k], 50e-9)
        if sun_read[k].any():
            twin.update(sun[k], sun_read[k], math.radians(0.1))
        sigma = np.sqrt(np.diag(twin.p))
        assert angle_between(q[k], twin.attitude.as_quat()) < within * sigma[:3].min()
        assert np.abs(omega[k] - twin.others).max() < within * sigma[3:].min()
        assert covariance[k] == pytest.approx(twin.p, abs=within * sigma.max() ** 2)


@pytest.mark.parametrize(
    ("estimator", "states"),
    [
        (DYNAMICS, 6),
        (DYNAMICS | DIPOLE_AND_BIAS, 12),
    ],
    ids=["plain", "dipole and bias"],
)
def test_errors_are_as_large_as_the_filter_says(estimator, states):
    """40 runs of 40 minutes, half of them in the shadow."""
    changes = {} if states == 6 else {"coils": {"limit_a_m2": 3.2}}
    runs = fly_filter(
        make_members(scenario(estimator, changes, duration_s=2400.0, record_s=20.0), 40)
    )
    found = consistency(nees(runs), states)
    assert found.consistent and found.inside > 0.8
    for innovations in runs.innovations.values():
        assert consistency(*nis(innovations)).consistent


@pytest.mark.parametrize("factor", [10.0, 0.1])
@pytest.mark.parametrize("key", ["torque_noise_n_m_sqrt_s", "magnetometer_noise_nt"])
def test_noise_wrong_by_ten_is_found_out(key, factor):
    wrong = DYNAMICS | {key: factor * DYNAMICS[key]}
    runs = fly_filter(make_members(scenario(wrong, duration_s=2400.0, record_s=20.0), 40))
    assert not consistency(nees(runs), 6).consistent


def test_the_residual_dipole_is_found():
    estimator = DYNAMICS | DIPOLE_AND_BIAS | {"record_covariance": True}
    coils = {"limit_a_m2": 3.2, "residual_dipole_a_m2": [0.03, -0.05, 0.04]}
    result = simulate(scenario(estimator, {"coils": coils}, duration_s=6000.0))
    names = {"estimator.state": [f"residual_dipole_{c}" for c in "xyz"]}
    found = result["estimator.states"].sel(names).values[-2]
    assert found == pytest.approx([0.03, -0.05, 0.04], abs=0.01)


def test_wheels_are_known_by_their_tachometers():
    """A wheel law turns the body while the filter follows: consistent, as with wheels at rest."""
    law = {
        "kind": "wheel_pd", "inertia_kg_m2": DYNAMICS["inertia_kg_m2"],
        "bandwidth_rad_s": 0.02, "euler_deg": [40.0, 0.0, 0.0],
    }  # fmt: skip
    changed = scenario(DYNAMICS, {"wheels": WHEELS}, law, duration_s=1200.0, record_s=20.0)
    runs = fly_filter(make_members(changed, 30))
    found = consistency(nees(runs), 6)
    assert found.consistent and found.inside > 0.8


BDOT = {"kind": "bdot_rate", "gain_a_m2_s_per_t": 3e6}
GYRO = {"gyro": {"noise_deg_s": 0.01}}


@pytest.mark.parametrize("polarity", [(1, 1, 1), (1, -1, 1)])
def test_coils_are_known_by_their_command(polarity):
    """Torques a thousand times the noise that the filter believes in; with one coil wired the
    wrong way round the same statistics fail."""
    coils = {"limit_a_m2": 0.3, "polarity": polarity}
    changed = scenario(DYNAMICS, {"coils": coils} | GYRO, BDOT, duration_s=1200.0, record_s=20.0)
    found = consistency(nees(fly_filter(make_members(changed, 30))), 6)
    assert (found.consistent and found.inside > 0.8) == (polarity == (1, 1, 1))


def test_coils_and_wheels_are_known_together():
    """Wheels hold the attitude, coils with a lag unload them."""
    laws = {
        "hold": {
            "kind": "wheel_pd", "inertia_kg_m2": DYNAMICS["inertia_kg_m2"],
            "bandwidth_rad_s": 0.02, "euler_deg": [40.0, 0.0, 0.0],
        },
        "unload": {"kind": "unloading", "gain_per_s": 0.003},
    }  # fmt: skip
    coils = {"coils": {"limit_a_m2": 3.2, "lag_s": 0.3}}
    changed = scenario(DYNAMICS, coils | {"wheels": WHEELS}, duration_s=1200.0, record_s=20.0)
    data = changed.model_dump(mode="json", exclude_unset=True)
    del data["control"]["law"]
    data["control"]["laws"] = laws
    flown = scenario_from_data(data)
    found = consistency(nees(fly_filter(make_members(flown, 30))), 6)
    assert found.consistent and found.inside > 0.8


@pytest.mark.slow
def test_the_magnetometer_alone_finds_the_attitude_in_an_orbit():
    """From any attitude that fits the field to within 5 deg, as flights have shown."""
    result = simulate(scenario(FIELD, duration_s=9000.0, record_s=60.0))
    q, true = result["q_estimated"].values, result["q_body_to_inertial"].values
    error = np.degrees(angle_between(q, true))
    assert error[0] > 50.0
    assert np.quantile(error[95:-1], 0.95) < 5.0


def test_rate_error_turns_the_attitude_by_its_integral():
    """To the square of the turn; the rate of a sphere stays as it is, and so does its error."""
    omega, dt = np.array([0.006, -0.004, 0.007]), 1.0
    one, zero = (1.0, 1.0, 1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    sphere, around = (
        SimpleNamespace(inertia=one, inverse=one),
        SimpleNamespace(gravity=zero, b=zero),
    )
    own = plain_function(linearise)
    found = own(sphere, (0.0, 0.0, 0.0, 1.0), tuple(omega), zero, around, zero, dt)
    parts = np.linspace(0.5e-3, 1.0 - 0.5e-3, 1000)
    exact = np.mean([Rotation.from_rotvec(-omega * dt * s).as_matrix() for s in parts], axis=0)
    by_rate = np.array(found.attitude_by_rate)
    assert by_rate == pytest.approx(dt * exact, abs=np.dot(omega, omega) * dt**3 / 5.0)
