"""Observability of filters: against the covariance kernels, and where it must be lost."""

import functools

import numpy as np
import pytest
from filter_cases import DYNAMICS, GYRO, SCENARIO, without

from torquer.analysis.filters.linear_covariance import (
    expected_accuracy,
    first_variances,
    held_motion,
    nominal,
)
from torquer.analysis.filters.observability import gramians, information, observability, transitions
from torquer.analysis.filters.sensor_sets import as_plain, sensor_sets
from torquer.scenario.load import scenario_from_data

FULL_DYNAMICS = DYNAMICS | {"dipole_sigma_a_m2": 0.05, "magnetometer_bias_sigma_nt": 300.0}
#: As good as no noise of the motion: the least that is accepted.
QUIET = {
    "kalman_gyro": {
        "angle_random_walk_deg_sqrt_s": 1e-9,
        "rate_random_walk_deg_s_sqrt_s": 0.0,
    },
    "kalman_dynamics": {"torque_noise_n_m_sqrt_s": 1e-9},
}


def scenario(estimator, sample_s=1.0, **changes):
    return scenario_from_data(
        {
            **SCENARIO,
            "control": {"law": {"kind": "off"}, "estimator": estimator, "sample_s": sample_s},
            "simulation": {**SCENARIO["simulation"], "duration_s": 3000.0, **changes},
        }
    )


def difference(estimator, sample_s):
    """Of covariances by the filter's kernels and by the Gramian, over the standard deviations.

    Without noise of the motion P(k) = Phi (P0^-1 + G)^-1 Phi^T.
    """
    estimator = estimator | QUIET[estimator["kind"]]
    quiet = scenario(estimator, sample_s, step_s=0.5, duration_s=400.0)
    spec, last = quiet.control.estimator, expected_accuracy(quiet).covariance[-1]
    seen = nominal(quiet, held_motion(quiet))
    phi, steps = transitions(spec, seen), len(seen.t_s)
    gained = gramians(phi, information(spec, seen), np.array([0]), steps)[0]
    prior = first_variances(spec)
    carried = functools.reduce(np.matmul, phi[::-1])
    found = carried @ np.linalg.inv(np.diag(1.0 / prior) + gained) @ carried.T
    sigma = np.sqrt(np.diag(last))
    return np.abs((found - last) / np.outer(sigma, sigma)).max()


@pytest.mark.parametrize(
    "estimator",
    [GYRO, GYRO | {"magnetometer_bias_sigma_nt": 300.0}],
    ids=["gyro", "gyro and magnetometer bias"],
)
def test_the_gramian_is_the_information_that_the_covariance_gains(estimator):
    """Steps of a second, series against rotation matrices: (omega dt)^3 a step."""
    assert difference(estimator, 1.0) < 2e-3


def test_kernel_and_gramian_differ_to_first_order_without_gyro():
    """The kernel lets a torque act on the attitude from the next step on only."""
    one, half = (difference(FULL_DYNAMICS, sample_s) for sample_s in (1.0, 0.5))
    assert half == pytest.approx(0.5 * one, rel=0.1) and one < 0.02


def test_one_direction_at_one_instant_leaves_turn_about_it_unknown():
    """Two readings of the field: about the field nothing is known, across it its noise says how
    much, and the gyro's bias not at all."""
    field = {**without(GYRO, "sun_noise_deg"), "sensors": ["magnetometer"]}
    found = observability(scenario(field), 2.0)
    seen = nominal(scenario(field), held_motion(scenario(field)))
    size = np.linalg.norm(seen.b[0])
    across = 2.0 * (size / 50e-9) ** 2 * first_variances(scenario(field).control.estimator)[0]
    assert found.gaps.all()
    assert found.singular[0, :2] == pytest.approx([across, across], rel=0.01)
    assert found.singular[0, -1] < 1e-3


def test_visible_sun_closes_the_gaps_of_the_field_alone():
    """Of two minutes, lit until about 1500 s, then in the umbra."""
    both = observability(scenario(GYRO), 120.0)
    alone = observability(
        scenario({**without(GYRO, "sun_noise_deg"), "sensors": ["magnetometer"]}), 120.0
    )
    sunlit_fraction = both.to_s < 1400.0
    dark = both.from_s > 1800.0
    assert np.all(both.singular[sunlit_fraction, -1] > 30.0 * alone.singular[sunlit_fraction, -1])
    assert both.singular[dark] == pytest.approx(alone.singular[dark], rel=1e-6)
    assert alone.weakest_state(0) == "gyro bias" and both.states == ("attitude", "gyro bias")


def test_longer_windows_see_more():
    short, long = (observability(scenario(FULL_DYNAMICS), each) for each in (60.0, 600.0))
    assert np.all(long.singular[0] > short.singular[0])
    assert np.all(short.gaps) and short.states[2:] == ("residual dipole", "magnetometer bias")


@pytest.mark.parametrize("window_s", [0.5, 4000.0])
def test_windows_must_fit(window_s):
    with pytest.raises(ValueError, match="window_s: must hold two control steps or more"):
        observability(scenario(GYRO), window_s)


def test_sensor_sets_are_the_filter_and_its_parts():
    """More sensors are never worse; Sun and gyro alone never find the turn about the Sun."""
    sets = sensor_sets(scenario(GYRO, duration_s=9000.0, step_s=1.0))
    names = [each.name for each in sets]
    assert names == [
        "magnetometer + Sun sensors + gyro", "magnetometer + gyro", "Sun sensors + gyro",
    ]  # fmt: skip
    whole, field, sun = sets
    assert whole.light_deg < 0.3 < whole.dark_deg < 3.0
    assert whole.light_deg <= field.light_deg and whole.dark_deg <= field.dark_deg
    assert whole.reached_s >= 0.0 and field.reached_s is None and sun.reached_s is None
    assert sun.light_deg > 90.0
    plain = as_plain(sets)
    assert plain[0]["windows"][0]["weakest"] in ("attitude", "gyro bias")


def test_an_estimator_without_covariance_is_refused():
    with pytest.raises(
        ValueError, match=r"control.estimator.kind: must be one of kalman_gyro, kalman_dynamics"
    ):
        sensor_sets(scenario({"kind": "rate_from_field"}))
