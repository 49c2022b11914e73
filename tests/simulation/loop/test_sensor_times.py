"""Sensors at rates of their own and with delays: what the computer knows, and from when."""

import numpy as np
import pytest
from integrators import by

from torquer import Law, law, simulate
from torquer.compile import engine

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")

#: Three sensors at rates of their own; control steps every 2 s.
RATES = {
    "spacecraft.magnetometer": {"sample_s": 3.0, "delay_s": 2.0},
    "spacecraft.gyro": {"sample_s": 4.0, "delay_s": 4.0},
    "spacecraft.attitude_sensor": {"sample_s": 5.0},
    "control.sample_s": 2.0,
    "simulation": {"duration_s": 120.0, "step_s": 1.0, "record_s": 1.0},
}
SENT = {"magnetometer_s": (3.0, 2.0), "gyro_s": (4.0, 4.0), "attitude_sensor_s": (5.0, 0.0)}


def watched(scenario):
    """What a law in plain Python receives at every control step, and the result."""
    seen = []

    def watch(inputs, parameters, memory):
        seen.append(inputs)
        return (0.0, 0.0, 0.0)

    return seen, simulate(scenario, Law("watch", watch, needs={"search_coil"}, compiled=False))


@pytest.mark.parametrize("integrator", ["rk4", "auto"])
def test_times_of_readings_are_those_of_their_sensors(make, integrator):
    """The newest that has arrived: taken at a multiple of the interval, a delay ago or more."""
    seen, _ = watched(make(RATES | by(integrator)))
    assert [inputs.t_s for inputs in seen] == np.arange(0.0, 120.0, 2.0).tolist()
    for inputs in seen:
        for sensor, (interval_s, delay_s) in SENT.items():
            newest = np.floor((inputs.t_s - delay_s) / interval_s) * interval_s
            taken = getattr(inputs.read_at, sensor)
            assert taken == (newest if newest >= 0.0 else -np.inf), (inputs.t_s, sensor)
        assert inputs.read_at.search_coil_s == inputs.t_s  # read at every control step
    ages = {inputs.t_s - inputs.read_at.gyro_s for inputs in seen[2:]}
    assert ages == {4.0, 6.0}


def test_readings_are_those_of_their_time(make):
    """Also on the way: the field, rate and attitude of the instant at which they were taken."""
    seen, result = watched(make(RATES))
    for inputs in seen[4:]:
        at = inputs.read_at
        b = result.b_body.sel(time=at.magnetometer_s).values
        assert inputs.b_body_t == pytest.approx(b, rel=1e-8)
        omega = result.omega_body.sel(time=at.gyro_s).values
        assert np.array_equal(inputs.omega_body_rad_s, omega)
        q = result.q_body_to_inertial.sel(time=at.attitude_sensor_s).values
        assert inputs.q_body_to_inertial == pytest.approx(tuple(q), abs=1e-15)
    moved = np.ptp([inputs.b_body_t for inputs in seen[4:]], axis=0)
    assert np.all(moved > 1e-6)


def test_nothing_is_known_before_the_first_reading_arrives(make):
    """With a delay of a whole interval none arrives at the start, not even one of zeros."""
    seen, _ = watched(make(RATES))
    for inputs in seen[:2]:
        assert inputs.read_at.gyro_s == -np.inf
        assert inputs.omega_body_rad_s == (0.0, 0.0, 0.0)
    assert seen[2].read_at.gyro_s == 0.0


def test_undelivered_reading_gives_b_dot_no_kick(make):
    late = {
        "spacecraft.magnetometer": {"sample_s": 2.0, "delay_s": 2.0},
        "control": {"law": {"kind": "bdot", "gain_a_m2_s_per_t": 1e5}, "sample_s": 2.0},
        "simulation": {"duration_s": 60.0, "step_s": 1.0, "record_s": 1.0},
    }
    result = simulate(make(late))
    b, asked = result.b_body.values, result.command_body.values
    assert not asked[:4].any()  # two readings are known at 4 s: those of 0 and 2 s
    for t in range(4, 60, 2):
        expected = -1e5 * (b[t - 2] - b[t - 4]) / 2.0
        assert asked[t] == pytest.approx(expected, rel=1e-6)


NOISY = {
    "spacecraft.magnetometer": {"noise_nt": 50.0},
    "spacecraft.gyro": {"noise_deg_s": 0.01, "bias_drift_deg_s_sqrt_s": 0.001},
    "spacecraft.attitude_sensor": {"noise_deg": 0.1},
    "spacecraft.sun_sensors": {"axes": [[1, 0, 0], [-1, 2, 0]], "half_field_deg": 80.0,
                               "noise_deg": 0.1},
    "control.law": {"kind": "bdot_rate", "gain_a_m2_s_per_t": 1e5},
    "simulation": {"duration_s": 300.0, "step_s": 0.5, "record_s": 1.0},
    "seed": 7,
}  # fmt: skip


@pytest.mark.parametrize("sampled", [{"sample_s": 2.5}, {"sample_s": 2.5, "delay_s": 1.5}])
def test_sensor_at_another_rate_leaves_bits_of_others_alone(make, sampled):
    usual = simulate(make(NOISY))
    sun = NOISY["spacecraft.sun_sensors"] | sampled
    other = simulate(make(NOISY | {"spacecraft.sun_sensors": sun}))
    for name in ("omega_body", "b_measured", "omega_measured", "command_body"):
        assert np.array_equal(usual[name].values, other[name].values), name
    assert not np.array_equal(usual.sun_measured.values, other.sun_measured.values)


@pytest.mark.parametrize("sampled", [{"sample_s": 2.5}, {"sample_s": 2.5, "delay_s": 1.5}])
def test_the_noise_of_a_reading_is_that_of_its_number(make, sampled):
    """Read every 2.5 s, by its own rate or as often as the computer controls."""
    free = NOISY | {"control.law": {"kind": "off"}}
    own = free | {"spacecraft.sun_sensors": NOISY["spacecraft.sun_sensors"] | sampled}
    often = simulate(make(free | {"control.sample_s": 2.5}))
    other = simulate(make(own))
    times, delay_s = np.arange(5.0, 300.0, 5.0), sampled.get("delay_s", 0.0)
    arrived = other.sun_measured.sel(time=times + np.ceil(delay_s)).values
    assert np.abs(arrived - often.sun_measured.sel(time=times).values).max() < 1e-9


def test_loop_reads_late_sensors_alike_for_compiled_and_plain_laws(make):
    def telling(inputs, parameters, memory):
        memory[0] = inputs.t_s - inputs.read_at.magnetometer_s
        return (1e4 * inputs.b_body_t[0], 1e-3 * inputs.read_at.attitude_sensor_s, 0.0)

    results = [
        simulate(make(RATES), law(telling, memory=1, compiled=compiled))
        for compiled in (True, False)
    ]
    assert np.array_equal(*(result.command_body.values for result in results))
    assert np.ptp(results[0].command_body.values[:, 1]) > 0.1
