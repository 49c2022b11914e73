"""Estimators while a sensor reads no number: nothing of it stays, and the sensor is named."""

import math

import numpy as np
import pytest
from filter_cases import DYNAMICS, GYRO
from law_cases import compiled, inputs
from pydantic import TypeAdapter
from scipy.spatial.transform import Rotation
from slow_cases import slow_after

from torquer.computer.estimation import AnyEstimator
from torquer.computer.estimation.isolation_states import NO_NUMBER, USED
from torquer.computer.estimation.sensor_keys import SENSOR_LABELS
from torquer.computer.interface import SENSORS

SPECS = TypeAdapter(AnyEstimator)
#: All sensors that a filter may have.
ALL = {
    "sensors": ["magnetometer", "sun", "star_tracker", "horizon", "sun_cells"],
    "star_tracker_noise_deg": 0.05,
    "horizon_noise_deg": 0.2,
    "cell_noise": 0.01,
    "cell_normals": [[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0]],
}
ALONE = {"sensors": ["magnetometer"]}
NO_TORQUE = {"inertia_kg_m2": (1.0, 1.0, 1.0), "rate_sigma_deg_s": 5.0}
CASES = {
    "triad": {"kind": "triad", "magnetometer_noise_nt": 50.0, "sun_noise_deg": 0.1},
    "triad and gyro": {
        "kind": "triad", "magnetometer_noise_nt": 50.0, "sun_noise_deg": 0.1, "rate": "gyro",
    },
    "rate_from_field": {"kind": "rate_from_field"},
    "gyro": GYRO | ALL,
    "dynamics": DYNAMICS | NO_TORQUE | ALL,
    "gyro, field alone": {k: v for k, v in GYRO.items() if k != "sun_noise_deg"} | ALONE,
    "dynamics, field alone": {k: v for k, v in DYNAMICS.items() if k != "sun_noise_deg"}
    | NO_TORQUE
    | ALONE,
}  # fmt: skip
#: Readings, by the sensors of the interface; the coils' dipole is the computer's own.
READINGS = {
    "magnetometer": "b_body_t",
    "gyro": "omega_body_rad_s",
    "sun_sensors": "sun_body",
    "attitude_sensor": "q_body_to_inertial",
    "tachometers": "wheel_momentum_body_n_m_s",
    "coils": "coil_dipole_body_a_m2",
    "horizon_sensor": "nadir_body",
    "sun_cells": "sun_cells",
}
#: What each estimator takes besides the sensors of a filter.
TAKES = {
    "triad": {"magnetometer", "sun_sensors"},
    "triad and gyro": {"magnetometer", "sun_sensors", "gyro"},
    "rate_from_field": {"magnetometer"},
    "gyro": {*READINGS} - {"tachometers", "coils"},
    "dynamics": {*READINGS} - {"gyro"},
    "gyro, field alone": {"magnetometer", "gyro"},
    "dynamics, field alone": {"magnetometer", "tachometers", "coils"},
}
#: Steps at which all components are no number, and one at which a single one is not.
LONG, ONE, STEPS = range(20, 28), 40, 60
OMEGA = np.array([0.012, -0.02, 0.016])
LABELS = {
    "magnetometer": "magnetometer", "sun_sensors": "sun", "attitude_sensor": "star_tracker",
    "horizon_sensor": "horizon", "sun_cells": "sun_cell_0",
}  # fmt: skip


def attitude(t_s):
    """The body's true attitude."""
    return Rotation.from_rotvec([1.0, -2.0, 0.5]) * Rotation.from_rotvec(t_s * OMEGA)


def rows():
    """What a computer reads each second on a body that turns at a constant rate."""
    rng, found = np.random.default_rng(4), []
    b, sun, r = np.array([2e-5, -1e-5, 3e-5]), np.array([0.6, 0.0, 0.8]), np.array([7e6, 0, 0])
    for t_s in range(STEPS):
        to_body = attitude(t_s).inv()
        seen, nadir = to_body.apply(sun), to_body.apply([-1.0, 0.0, 0.0])
        cells = np.maximum(np.array([*ALL["cell_normals"], [0, 0, 0], [0, 0, 0]]) @ seen, 0.0)
        row = inputs(
            t_s, to_body.apply(b) + 5e-8 * rng.normal(size=3),
            omega=OMEGA + 1e-4 * rng.normal(size=3), sun=seen, q=to_body.inv().as_quat(),
            nadir=nadir, cells=cells + 0.001 * rng.normal(size=6), r=r, v=(0.0, 0.0, 0.0),
            model_b=b, model_b_rate=(0.0, 0.0, 0.0), model_sun=sun,
        )  # fmt: skip
        found.append(row._replace(ephemeris=row.ephemeris._replace(sunlit_fraction=1.0)))
    return found


def spoilt(rows, sensor, value):
    """The same with readings of a sensor that are no number."""
    name, rows = READINGS[sensor], list(rows)
    for k in LONG:
        rows[k] = rows[k]._replace(**{name: (value,) * len(getattr(rows[k], name))})
    reading = list(getattr(rows[ONE], name))
    reading[2 if sensor != "sun_cells" else 0] = value
    rows[ONE] = rows[ONE]._replace(**{name: tuple(reading)})
    return rows


def estimated(estimator, rows):
    """The estimates, and what is in the memory after each."""
    step, memory, found, kept = compiled(estimator), estimator.first_memory(), [], []
    packed, before = estimator.pack(), rows[0].estimate._replace(t_s=-math.inf)
    for row in rows:
        before = step(row._replace(estimate=before), packed, memory)
        found.append(before)
        kept.append(memory.copy())
    return found, np.array(kept)


def error_rad(estimate, t_s):
    """Angle from the true attitude to an estimate."""
    return (attitude(t_s).inv() * Rotation.from_quat(estimate.q_body_to_inertial)).magnitude()


def numbers(estimate):
    """All numbers of an estimate."""
    return np.concatenate([np.ravel(part) for part in estimate])


@pytest.fixture(scope="module")
def sound():
    """Estimates with all sensors sound, once for each estimator."""
    kept = {}

    def once(case):
        if case not in kept:
            kept[case] = estimated(SPECS.validate_python(CASES[case]).estimator(), rows())
        return kept[case]

    return once


@pytest.mark.parametrize("value", [math.nan, math.inf])
@pytest.mark.parametrize("case", slow_after(5, CASES))
def test_no_state_is_left_without_a_number(sound, case, value):
    """What is not read changes nothing; what is read has gone from memory and estimate."""
    estimator = SPECS.validate_python(CASES[case]).estimator()
    whole, cells = sound(case)
    for sensor in READINGS:
        found, kept = estimated(estimator, spoilt(rows(), sensor, value))
        if sensor not in TAKES[case]:
            assert all(
                np.array_equal(numbers(a), numbers(b), equal_nan=True)
                for a, b in zip(found, whole, strict=True)
            ), sensor
            continue
        assert (np.isfinite(kept[-1]) >= np.isfinite(cells[-1])).all(), sensor
        assert (np.isfinite(numbers(found[-1])) >= np.isfinite(numbers(whole[-1]))).all(), sensor
        assert not np.isinf(numbers(found[LONG[3]][1:])).any(), sensor
        if place := estimator.memory_places().get("starts"):
            assert kept[-1, place[0]] == cells[-1, place[0]]  # it did not have to start again
        if "alone" not in case and case != "rate_from_field":
            assert error_rad(found[-1], STEPS - 1) < error_rad(whole[-1], STEPS - 1) + 0.01


@pytest.mark.parametrize("value", [1e300, 1e160, 7e6])
@pytest.mark.parametrize("case", slow_after(5, [each for each in CASES if "alone" not in each]))
def test_numbers_that_no_sensor_reads_are_left(sound, case, value):
    """Too large for squares, or as a position in place of a rate: nothing of it stays.

    A dipole of the coils is none of a sensor: a rate by it is left once readings have been rejected
    for long.
    """
    estimator = SPECS.validate_python(CASES[case]).estimator()
    whole, cells = sound(case)
    for sensor in TAKES[case] - {"coils"}:
        found, kept = estimated(estimator, spoilt(rows(), sensor, value))
        assert (np.isnan(kept[-1]) <= np.isnan(cells[-1])).all(), sensor
        assert (np.isfinite(numbers(found[-1])) >= np.isfinite(numbers(whole[-1]))).all(), sensor
        if case != "rate_from_field":
            assert error_rad(found[-1], STEPS - 1) < error_rad(whole[-1], STEPS - 1) + 0.02, sensor


@pytest.mark.parametrize("case", ["gyro", "dynamics"])
def test_a_filter_keeps_its_attitude_and_names_the_sensor(case):
    estimator = SPECS.validate_python(CASES[case]).estimator()
    log = estimator.memory_places()
    for sensor in TAKES[case] - {"tachometers", "coils"}:
        for value in (math.nan, math.inf):
            found, kept = estimated(estimator, spoilt(rows(), sensor, value))
            is_blinded = sensor == "attitude_sensor" and math.isnan(value)
            wrong = [k in (*([] if is_blinded else LONG), ONE) for k in range(STEPS)]
            flags = [e.isolated[SENSORS.index(sensor)] > 0.0 for e in found]
            assert flags[5:] == wrong[5:], sensor
            assert all(error_rad(e, t_s) < 0.02 for t_s, e in enumerate(found) if t_s > 5)
            if sensor != "gyro":
                place = log["isolated"][0] + SENSOR_LABELS.index(LABELS[sensor])
                states = np.where(wrong, NO_NUMBER, USED)
                assert np.array_equal(kept[5:, place], states[5:])


def test_a_filter_is_less_sure_of_its_attitude_without_the_gyro():
    estimator = SPECS.validate_python(GYRO).estimator()
    for value in (math.nan, math.inf):
        found, _ = estimated(estimator, spoilt(rows(), "gyro", value))
        assert found[LONG[-1]].sigma_rad_s > 2.0 * found[LONG[0] - 1].sigma_rad_s
        assert found[-1].sigma_rad_s == pytest.approx(found[LONG[0] - 1].sigma_rad_s, rel=0.3)


def test_the_rate_of_a_gyro_that_reads_no_number_is_not_known():
    estimator = SPECS.validate_python(CASES["triad and gyro"]).estimator()
    for value in (math.nan, math.inf):
        found, _ = estimated(estimator, spoilt(rows(), "gyro", value))
        assert np.isnan([found[k].omega_body_rad_s for k in (*LONG, ONE)]).all()
        assert np.isfinite([e.q_body_to_inertial for e in found]).all()
        assert np.isfinite(found[-1].omega_body_rad_s).all()
