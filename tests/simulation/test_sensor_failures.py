"""Sensors that fail: silent, stuck, replaced by a value; coils wired the wrong way round.

The computer believes what it is sent.
"""

import numpy as np
import pytest
from slow_cases import slow_after

from torquer import Law, ScenarioError, simulate
from torquer.compile import engine
from torquer.simulation.loop.state import find_arrays
from torquer.simulation.setup.run import prepare
from torquer.spacecraft.actuators.coils import Coils

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")

RUN = {"duration_s": 60.0, "step_s": 1.0, "record_s": 1.0}
READINGS = {
    "magnetometer": ("b_body_t", "magnetometer_s"),
    "search_coil": ("b_rate_body_t_s", "search_coil_s"),
    "gyro": ("omega_body_rad_s", "gyro_s"),
    "sun_sensors": ("sun_body", "sun_sensors_s"),
    "attitude_sensor": ("q_body_to_inertial", "attitude_sensor_s"),
    "horizon_sensor": ("nadir_body", "horizon_sensor_s"),
    "sun_cells": ("sun_cells", "sun_cells_s"),
}
#: What each sensor needs besides, and some errors that are drawn at every reading.
KEYS = {
    "magnetometer": {"noise_nt": 50.0},
    "search_coil": {"noise_nt_s": 20.0},
    "gyro": {"noise_deg_s": 0.1, "bias_drift_deg_s_sqrt_s": 0.01},
    "sun_sensors": {"axes": [[0, 0, 1]], "half_field_deg": 180.0, "noise_deg": 0.5},
    "attitude_sensor": {"noise_deg": 0.5},
    "horizon_sensor": {"noise_deg": 0.5},
    "sun_cells": {"normals": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "noise": 0.01},
}
DELAY = {"sample_s": 1.0, "delay_s": 1.0}


def readings_of(make, sensor, delay=None, **failure):
    """(Readings, their times) at every control step."""
    seen = []

    def watch(inputs, parameters, memory):
        seen.append(inputs)
        return (0.0, 0.0, 0.0)

    keys = KEYS[sensor] | (delay or {}) | ({"failures": [failure]} if failure else {})
    changes = {f"spacecraft.{sensor}": keys, "simulation": RUN, "environment.eclipse": "none"}
    simulate(make(changes), Law("watch", watch, needs={"sun", "horizon"}, compiled=False))
    value, time = READINGS[sensor]
    return (
        np.array([getattr(inputs, value) for inputs in seen]),
        np.array([getattr(inputs.read_at, time) for inputs in seen]),
    )


@pytest.fixture(scope="module")
def sound(make):
    """What a sensor tells that does not fail, flown once."""
    kept = {}

    def once(sensor, delay=None):
        key = sensor, delay is None
        if key not in kept:
            kept[key] = readings_of(make, sensor, delay)
        return kept[key]

    return once


@pytest.mark.parametrize("sensor", READINGS)
@pytest.mark.parametrize("delay", [None, DELAY])
@pytest.mark.parametrize(("kind", "value"), [("zeros", 0.0), ("nan", np.nan), ("infinite", np.inf)])
def test_a_sensor_reads_one_value_and_recovers(make, sound, sensor, delay, kind, value):
    healthy, times = sound(sensor, delay)
    found, found_times = readings_of(make, sensor, delay, kind=kind, from_s=20.0, until_s=30.0)
    late = 1 if delay else 0
    gone = slice(20 + late, 30 + late)
    assert np.array_equal(found_times, times)
    assert np.array_equal(found[gone], np.full(found[gone].shape, value), equal_nan=True)
    assert healthy[gone].any(axis=1).all()
    found[gone] = healthy[gone]
    assert np.array_equal(found, healthy)


@pytest.mark.parametrize("sensor", READINGS)
@pytest.mark.parametrize("delay", [None, DELAY])
@pytest.mark.parametrize("kind", ["silent", "stuck"])
def test_failed_sensor_repeats_its_last_reading_flagged_or_not(make, sound, sensor, delay, kind):
    healthy, times = sound(sensor, delay)
    found, found_times = readings_of(make, sensor, delay, kind=kind, from_s=20.0, until_s=30.0)
    late = 1 if delay else 0
    last, gone = 19 + late, slice(20 + late, 30 + late)
    assert np.array_equal(found[: last + 1], healthy[: last + 1])
    assert np.array_equal(found[gone], np.tile(healthy[last], (10, 1)))
    expected = np.where(np.isin(np.arange(60), np.arange(60)[gone]) & (kind == "silent"),
                        times[last], times)  # fmt: skip
    assert np.array_equal(found_times, expected)
    assert np.ptp(found[30 + late :], axis=0).any()


def test_a_failure_without_an_end_lasts(make):
    found, times = readings_of(make, "magnetometer", kind="silent", from_s=40.0)
    assert (times[40:] == 39.0).all()
    assert np.array_equal(found[40:], np.tile(found[39], (20, 1)))


#: A failure that changes readings, and what becomes of them.
CHANGES = {
    "reversed": ({"kind": "reversed"}, lambda v: v * [-1, -1, -1, 1][: v.shape[1]]),
    "one axis reversed": (
        {"kind": "reversed", "axis": "y"}, lambda v: v * [1, -1, 1, 1][: v.shape[1]],
    ),
    "swapped": ({"kind": "swapped", "axes": "xz"}, lambda v: v[:, [2, 1, 0, 3][: v.shape[1]]]),
}  # fmt: skip


@pytest.mark.parametrize("sensor", [each for each in READINGS if each != "sun_cells"])
@pytest.mark.parametrize("delay", [None, DELAY])
@pytest.mark.parametrize("name", CHANGES)
def test_a_sensor_with_wrong_axes(make, sound, sensor, delay, name):
    failure, wrong = CHANGES[name]
    healthy, times = sound(sensor, delay)
    found, found_times = readings_of(make, sensor, delay, **failure, from_s=20.0, until_s=30.0)
    gone = slice(21, 31) if delay else slice(20, 30)
    assert np.array_equal(found_times, times)
    assert np.array_equal(found[gone], wrong(healthy[gone]))
    found[gone] = healthy[gone]
    assert np.array_equal(found, healthy)


def errors_of(sensor, found, healthy):
    """Errors that a failure adds: differences; of directions and attitudes angles [deg]."""
    if sensor in ("magnetometer", "search_coil", "gyro"):
        return found - healthy
    cosine = np.abs(np.sum(found * healthy, axis=1)).clip(max=1.0)
    return np.degrees((2.0 if sensor == "attitude_sensor" else 1.0) * np.arccos(cosine))[:, None]


#: Unit of each sensor's errors in its keys, and in SI or degrees.
UNITS = {
    "magnetometer": ("nt", 1e-9), "search_coil": ("nt_s", 1e-9), "gyro": ("deg_s", np.radians(1.0)),
    "sun_sensors": ("deg", 1.0), "attitude_sensor": ("deg", 1.0), "horizon_sensor": ("deg", 1.0),
}  # fmt: skip


@pytest.mark.parametrize("sensor", UNITS)
@pytest.mark.parametrize("delay", [None, DELAY])
def test_a_bias_jumps_and_goes(make, sound, sensor, delay):
    unit, si = UNITS[sensor]
    bias = np.array([3.0, -2.0, 6.0])
    failure = {"kind": "bias", f"bias_{unit}": bias.tolist(), "from_s": 20.0, "until_s": 30.0}
    healthy, _ = sound(sensor, delay)
    found, _ = readings_of(make, sensor, delay, **failure)
    gone = slice(21, 31) if delay else slice(20, 30)
    errors = errors_of(sensor, found[gone], healthy[gone])
    if sensor in (
        "sun_sensors",
        "horizon_sensor",
    ):  # only the part across the line of sight turns it
        across = np.linalg.norm(np.cross(bias / 7.0, healthy[gone]), axis=1)
        half = 2.0 * np.degrees(np.arcsin(across * np.sin(np.radians(3.5))))
        assert errors[:, 0] == pytest.approx(half, rel=1e-9)
    else:
        expected = 7.0 if sensor == "attitude_sensor" else si * bias
        assert errors == pytest.approx(np.broadcast_to(expected, errors.shape), rel=1e-6)
    found[gone] = healthy[gone]
    assert np.array_equal(found, healthy)


@pytest.mark.parametrize("sensor", UNITS)
def test_a_burst_of_noise(make, sound, sensor):
    """Its size, over 50 readings; each has an error of its own, and none remains."""
    unit, si = UNITS[sensor]
    failure = {"kind": "noise", f"noise_{unit}": 2.0, "from_s": 5.0, "until_s": 55.0}
    healthy, _ = sound(sensor)
    found, _ = readings_of(make, sensor, **failure)
    errors = errors_of(sensor, found[5:55], healthy[5:55]) / si
    axes = {"sun_sensors": 2, "horizon_sensor": 2, "attitude_sensor": 3}.get(
        sensor, 1
    )  # that turn the reading
    assert np.sqrt(np.mean(errors**2)) == pytest.approx(2.0 * np.sqrt(axes), rel=0.25)
    assert len(np.unique(errors, axis=0)) == 50
    assert np.array_equal(np.delete(found, range(5, 55), 0), np.delete(healthy, range(5, 55), 0))


def test_two_failures_act_one_after_the_other(make):
    failures = [{"kind": "zeros"}, {"kind": "bias", "bias_deg_s": [1.0, 0.0, 0.0]}]
    changes = {"spacecraft.gyro.failures": failures, "simulation": RUN}
    read = simulate(make(changes)).omega_measured.values[1:]
    assert read == pytest.approx(np.tile(np.radians([1.0, 0.0, 0.0]), (len(read), 1)), abs=1e-15)


@pytest.mark.parametrize("integrator", slow_after(1, ["rk4", "auto"]))
def test_a_run_with_failures_is_resumed_bit_for_bit(make, integrator):
    """Stopped within failures, it goes on as if it had not been."""
    simulation = {"duration_s": 60.0, "record_s": 1.0, "integrator": integrator}
    simulation |= {"step_s": 1.0} if integrator == "rk4" else {}
    failures = [
        {"kind": "stuck", "from_s": 10.0, "until_s": 25.0},
        {"kind": "noise", "noise_nt": 900.0, "from_s": 15.0, "until_s": 40.0},
        {"kind": "zeros", "from_s": 40.0},
    ]
    scenario = make(
        {
            "spacecraft.magnetometer": {"noise_nt": 50.0, "failures": failures},
            "spacecraft.coils.failures": [
                {"coil": 0, "kind": "stuck", "dipole_a_m2": 1.0, "from_s": 15.0, "until_s": 22.0},
                {"coil": 2, "kind": "reversed", "from_s": 25.0},
            ],
            "control.failures": [{"kind": "restarted", "from_s": 17.0, "until_s": 24.0}],
            "simulation": simulation,
            "control.law": {"kind": "bdot", "gain_a_m2_s_per_t": 1e4},
        }
    )
    whole, parts = prepare(scenario), prepare(scenario)
    whole.advance_to(whole.steps)
    for end in (parts.steps // 3, parts.steps // 2, parts.steps):
        parts.advance_to(end)
    for one, other in zip(find_arrays(whole.state), find_arrays(parts.state), strict=True):
        assert one.tobytes() == other.tobytes()


@pytest.mark.parametrize(
    ("key", "value", "readings_of"),
    [
        ("failures", [{"kind": "mute"}],
         "spacecraft.gyro.failures[0].kind: must be 'silent', 'stuck', 'zeros', 'nan', 'infinite', "
         "'reversed', 'swapped', 'bias' or 'noise'; received 'mute'"),
        ("failures", [{"kind": "bias"}],
         "spacecraft.gyro.failures[0].bias_deg_s: must be given for kind 'bias'; received none"),
        ("failures", [{"kind": "zeros", "noise_deg_s": 1.0}],
         "noise_deg_s: must be left out for kind 'zeros'; received 1.0"),
        ("failures", [{"kind": "swapped"}],
         "spacecraft.gyro.failures[0].axes: must be given for kind 'swapped'; received none"),
        ("failures", [{"kind": "zeros", "axis": "x"}],
         "axis: must be left out for kind 'zeros'; received 'x'"),
        ("failures", [{"kind": "zeros", "from_s": 9.0, "until_s": 5.0}],
         "until_s: must be above from_s, 9 s; received 5 s"),
        ("failures", [{"kind": "zeros", "from_s": 60.0}],
         "spacecraft.gyro.failures[0].from_s: must be before the end of the run, 60 s;"),
    ],
)  # fmt: skip
def test_messages(make, key, value, readings_of):
    with pytest.raises(ScenarioError) as error:
        make({f"spacecraft.gyro.{key}": value, "simulation": RUN})
    assert readings_of in str(error.value)


def test_a_coil_of_the_wrong_polarity_pushes_the_other_way():
    readings_of, wrong = (
        Coils(limit_a_m2=1.0).pack(),
        Coils(limit_a_m2=1.0, polarity=(1, -1, 0)).pack(),
    )
    for c in "xyz":
        assert np.array_equal(wrong.rows[f"share_{c}"], readings_of.rows[f"share_{c}"])
        assert np.array_equal(wrong.rows[f"axis_{c}"], [1, -1, 0] * readings_of.rows[f"axis_{c}"])
    assert wrong.rows["power"].tolist() == [1.0, 1.0, 0.0]


def test_a_polarity_for_every_coil():
    with pytest.raises(ValueError, match=r"polarity: must have one number per coil \(3 axes\)"):
        Coils(limit_a_m2=1.0, polarity=(1, 1))
