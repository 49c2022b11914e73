"""The control cycle: when readings are taken, when coils are on, and what each sensor then sees."""

import itertools

import numpy as np
import pytest

from torquer import Law, law, simulate
from torquer.compile import engine

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")

#: Readings at 0, 2, 4, 6 s of the window, then 4 s of actuation; five steps of 2 s.
WINDOW = {
    "control.sample_s": 2.0,
    "control.measure_s": 6.0,
    "control.actuate_s": 4.0,
    "simulation.step_s": 1.0,
    "simulation.record_s": 1.0,
    "simulation.duration_s": 60.0,
}
RESIDUAL = [0.05, -0.02, 0.03]


def phases(result, cycle_s=10.0):
    return result.time.values % cycle_s


@law(memory=1)
def counting(inputs, parameters, memory):
    """Asks for as many A m^2 along x as it was asked before."""
    memory[0] += 1.0
    return (memory[0] - 1.0, 0.0, 0.0)


def test_coils_are_off_in_window_and_hold_its_last_answer(make):
    result = simulate(make(WINDOW | {"spacecraft.coils.limit_a_m2": 100.0}), counting)
    along = result.dipole_body.values[:, 0]
    asked = result.command_body.values[:, 0]
    for k in range(6):
        in_cycle = slice(10 * k, 10 * k + 10)
        first = 4.0 * k  # four readings a cycle
        assert along[in_cycle] == pytest.approx([0.0] * 6 + [first + 3.0] * 4)
        expected = first + np.array([0, 0, 1, 1, 2, 2, 3, 3, 3, 3])
        assert np.array_equal(asked[in_cycle], expected)


def test_without_a_window_the_law_is_asked_at_every_sample(make):
    result = simulate(
        make(
            {
                "spacecraft.coils.limit_a_m2": 100.0,
                "control.sample_s": 3.0,
                "simulation.record_s": 1.0,
                "simulation.duration_s": 30.0,
            }
        ),
        counting,
    )
    assert np.array_equal(result.dipole_body.values[:-1, 0], np.repeat(np.arange(10.0), 3))


def test_the_residual_dipole_is_always_there_and_no_command(make):
    scenario = make(WINDOW | {"spacecraft.coils.residual_dipole_a_m2": RESIDUAL})
    result = simulate(scenario, counting)
    off = phases(result) < 6.0
    off[-1] = False  # the run ends before the next window begins
    assert np.array_equal(result.dipole_body.values[off], np.tile(RESIDUAL, (off.sum(), 1)))
    on = result.dipole_body.values[6]
    assert on == pytest.approx(np.add(RESIDUAL, [3.0, 0.0, 0.0]))
    assert float(result.peak_coil_dipole) == pytest.approx(3.0)  # of a coil: without residual


@law(memory=4)
def difference_of_last_two(inputs, parameters, memory):
    """-1e5 dB/dt from the last two readings, whenever they were taken."""
    m = (0.0, 0.0, 0.0)
    b = inputs.b_body_t
    if memory[0] > 0.0:
        f = -1e5 / (inputs.t_s - memory[0] + 1.0)
        m = (f * (b[0] - memory[1]), f * (b[1] - memory[2]), f * (b[2] - memory[3]))
    memory[0] = inputs.t_s + 1.0
    memory[1], memory[2], memory[3] = b
    return m


def test_bdot_uses_the_last_two_readings_of_the_window(make):
    scenario = make(WINDOW | {"control.law": {"kind": "bdot", "gain_a_m2_s_per_t": 1e5}})
    result = simulate(scenario)
    b = result.b_body.values
    for start in range(0, 60, 10):
        expected = -1e5 * (b[start + 6] - b[start + 4]) / 2.0
        assert result.dipole_body.values[start + 6] == pytest.approx(expected, rel=1e-7)
    assert np.abs(result.dipole_body.values).max() > 0.01
    own = simulate(scenario, difference_of_last_two)
    assert own.dipole_body.values == pytest.approx(result.dipole_body.values, rel=1e-9, abs=1e-15)


@pytest.mark.parametrize("windowed", [True, False])
def test_coils_disturb_the_magnetometer_only_while_they_are_on(make, windowed):
    changes = {
        "spacecraft.magnetometer.coil_disturbance_nt_per_a_m2": 500.0,
        "spacecraft.coils.residual_dipole_a_m2": RESIDUAL,
        "control.law": {"kind": "bdot_rate", "gain_a_m2_s_per_t": 1e6},
        "control.sample_s": 2.0,
        "simulation.record_s": 1.0,
        "simulation.duration_s": 60.0,
    }
    result = simulate(make(changes | WINDOW if windowed else changes))
    phase = phases(result)
    read = (phase <= 6) & (phase % 2 == 0) if windowed else phase % 2 == 0
    read[0], read[-1] = False, False  # the end of the run is no reading
    error = (result.b_measured.values - result.b_body.values)[read]
    before = result.dipole_body.values[np.flatnonzero(read) - 1]
    if windowed:
        assert np.abs(error - 500e-9 * np.array(RESIDUAL)).max() < 1e-15
    else:
        assert np.abs(before).max() > 0.3
        assert np.abs(error - 500e-9 * before).max() < 1e-15


@law
def full_ahead(inputs, parameters, memory):
    """The same dipole always."""
    return (2.0, 0.0, -1.0)


def test_lag_rises_and_falls_exponentially(make):
    lag_s = 1.5
    scenario = make(WINDOW | {"spacecraft.coils.lag_s": lag_s, "simulation.duration_s": 200.0})
    result = simulate(scenario, full_ahead)
    t, dipole = result.time.values[-60:], result.dipole_body.values[-60:]
    rising = (1.0 - np.exp(-4.0 / lag_s)) / (1.0 - np.exp(-10.0 / lag_s))  # at the end of a cycle
    phase = t % 10.0
    lower = rising * np.exp(-6.0 / lag_s)
    on = phase >= 6.0
    expected = np.where(
        on, 1.0 + (lower - 1.0) * np.exp(-(phase - 6.0) / lag_s), rising * np.exp(-phase / lag_s)
    )
    assert dipole == pytest.approx(expected[:, None] * np.array([2.0, 0.0, -1.0]), abs=1e-12)


def test_lagging_coils_still_disturb_the_first_reading_of_the_window(make):
    scenario = make(WINDOW | {
        "spacecraft.coils.lag_s": 1.5,
        "spacecraft.magnetometer.coil_disturbance_nt_per_a_m2": 500.0,
    })  # fmt: skip
    result = simulate(scenario, full_ahead)
    at = result.sel(time=[10.0, 12.0, 14.0, 16.0, 30.0])
    error = at.b_measured.values - at.b_body.values
    now = result.dipole_body.values[[10, 12, 14, 16, 30]]
    # at 16 s the coils have just been switched on: they are where they were
    assert np.abs(error - 500e-9 * now).max() < 1e-15
    assert np.abs(error[0]).max() > 500e-9


def test_energy_of_the_coils_is_power_times_time(make):
    scenario = make(WINDOW | {
        "spacecraft.coils.power_at_limit_w": 2.0,
        "spacecraft.coils.limit_a_m2": 4.0,
    })  # fmt: skip
    result = simulate(scenario, full_ahead)
    watts = 2.0 * (2.0**2 + 1.0**2) / 4.0**2
    assert float(result.coil_energy) == pytest.approx(6 * 4.0 * watts, rel=1e-12)
    assert float(result.peak_coil_dipole) == 2.0


def test_gyro_drift_walks_with_the_time_between_readings(make):
    scenario = make({
        "spacecraft.gyro.bias_drift_deg_s_sqrt_s": 0.01,
        "spacecraft.gyro.bias_deg_s": [0.1, 0.2, -0.3],
        "initial.rate_deg_s": [0.0, 0.0, 0.0],
        "environment.gravity_gradient": False,
        "control.sample_s": 1.0,
        "control.measure_s": 2.0,
        "control.actuate_s": 14.0,
        "simulation": {"duration_s": 16000.0, "step_s": 1.0, "record_s": 1.0},
    })  # fmt: skip
    result = simulate(scenario)
    reading = np.degrees(result.omega_measured.values - result.omega_body.values)
    assert reading[0] == pytest.approx([0.1, 0.2, -0.3], abs=1e-12)  # the bias at the start
    short = reading[1:16000:16] - reading[0:16000:16]
    long = reading[16:16000:16] - reading[2:15990:16][: len(reading[16:16000:16])]
    assert np.std(short) == pytest.approx(0.01, rel=0.05)
    assert np.std(long) == pytest.approx(0.01 * np.sqrt(14.0), rel=0.05)
    assert abs(np.mean(short)) < 4.0 * 0.01 / np.sqrt(short.size)


def test_the_law_sees_measurements_and_never_the_truth(make):
    """A biased magnetometer and gyro: the dipole follows the readings exactly."""
    scenario = make({
        "spacecraft.magnetometer.bias_nt": [5000.0, -3000.0, 2000.0],
        "spacecraft.magnetometer.noise_nt": 100.0,
        "spacecraft.gyro.bias_deg_s": [0.5, -0.5, 0.2],
        "control.law": {"kind": "bdot_rate", "gain_a_m2_s_per_t": 1e5},
        "simulation.record_s": 1.0,
    })  # fmt: skip
    result = simulate(scenario).isel(time=slice(0, -1))
    seen = 1e5 * np.cross(result.omega_measured.values, result.b_measured.values)
    truth = 1e5 * np.cross(result.omega_body.values, result.b_body.values)
    assert result.dipole_body.values == pytest.approx(seen, rel=1e-12)
    assert np.abs(seen - truth).max() > 0.1 * np.abs(truth).max()
    noise = result.b_measured.values - result.b_body.values - [5e-6, -3e-6, 2e-6]
    assert np.std(noise) == pytest.approx(100e-9, rel=0.1)


def test_search_coil_reads_the_field_rate_in_the_body(make):
    scenario = make({
        "environment.field.kind": "igrf14",
        "control.law": {"kind": "bdot_derivative", "gain_a_m2_s_per_t": 1e5},
        "simulation.record_s": 1.0,
        "simulation.duration_s": 300.0,
    })  # fmt: skip
    result = simulate(scenario)
    b = result.b_body.values
    rate = (b[:-4] - 8.0 * b[1:-3] + 8.0 * b[3:-1] - b[4:]) / 12.0  # per second, order 4
    dipole = result.dipole_body.values[2:-2]
    assert np.abs(dipole + 1e5 * rate).max() < 1e-7 * np.abs(dipole).max() + 1e-12


def test_sun_sensors_see_sun_in_their_cone_outside_the_shadow(make):
    changes = {
        "spacecraft.sun_sensors": {"axes": [[1, 0, 0], [0, -1, 0]], "half_field_deg": 60.0},
        "orbit.inclination_deg": 10.0,
        "simulation": {"revolutions": 1, "step_s": 2.0, "record_s": 10.0},
        "control.sample_s": 10.0,
    }
    result = simulate(make(changes)).isel(time=slice(0, -1))
    matrix = rotation_of(result)
    sun = matrix.inv().apply(result.sun_inertial.values)
    inside = np.maximum(sun[:, 0], -sun[:, 1]) > np.cos(np.radians(60.0))
    sunlit_fraction = result.sunlit_fraction.values >= 0.5
    sees = np.any(result.sun_measured.values != 0.0, axis=1)
    assert np.array_equal(sees, inside & sunlit_fraction)
    assert sees.any() and (~inside & sunlit_fraction).any() and (inside & ~sunlit_fraction).any()
    assert np.abs(result.sun_measured.values[sees] - sun[sees]).max() < 1e-6


def rotation_of(result):
    from scipy.spatial.transform import Rotation

    return Rotation.from_quat(result.q_body_to_inertial.values)


def test_saturation_is_kept_by_every_law(make):
    for kind in ("bdot", "bdot_rate", "bdot_derivative"):
        scenario = make({
            "control.law": {"kind": kind, "gain_a_m2_s_per_t": 1e9},
            "spacecraft.coils.saturation": "clip",
            "spacecraft.coils.limit_a_m2": [0.5, 1.0, 2.0],
        })  # fmt: skip
        dipole = np.abs(simulate(scenario).dipole_body.values)
        assert np.all(dipole.max(axis=0) == [0.5, 1.0, 2.0])


def test_a_law_can_be_tried_by_hand():
    assert isinstance(counting, Law)
    memory = np.zeros(1)
    assert counting(None, np.zeros(0), memory) == (0.0, 0.0, 0.0)
    assert counting(None, np.zeros(0), memory) == (1.0, 0.0, 0.0)


@law(memory={"calls": 0.0, "stated": (0.0, 0.0, 0.0)}, log={"stated": "A m2"})
def asking_more(inputs, parameters, memory):
    """Asks for a longer dipole from call to call; logs what its coils have done."""
    memory.stated[0], memory.stated[1], memory.stated[2] = inputs.coil_dipole_body_a_m2
    memory.calls += 1.0
    return (0.02 * memory.calls, -0.01 * memory.calls, 0.15)


@pytest.mark.parametrize("lag_s", [0.0, 0.7])
@pytest.mark.parametrize("measure_s", [0.0, 6.0])
def test_the_computer_knows_the_mean_dipole_between_its_control_steps(make, lag_s, measure_s):
    """Of oblique coils that saturate, it is that of the plant, less the residual dipole."""
    coils = {
        "limit_a_m2": 0.2, "axes": [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]],
        "saturation": "clip", "lag_s": lag_s, "residual_dipole_a_m2": RESIDUAL,
    }  # fmt: skip
    changes = WINDOW | {
        "spacecraft.coils": coils,
        "control.measure_s": measure_s,
        "control.actuate_s": 4.0 if measure_s else 2.0,
        "simulation.step_s": 0.02,
        "simulation.record_s": 0.02,
    }
    result = simulate(make(changes), asking_more)
    stated = result["law.stated"].values
    acting = result.dipole_body.values - RESIDUAL
    if lag_s:  # it goes on smoothly, else it is held
        acting[:-1] = 0.5 * (acting[:-1] + acting[1:])
    assert np.array_equal(stated[0], [0.0, 0.0, 0.0])
    control = [k for k in range(0, 3000, 100) if measure_s == 0.0 or k % 500 <= 300]
    for before, now in itertools.pairwise(control):
        assert stated[now] == pytest.approx(
            acting[before:now].mean(axis=0), abs=1e-4 * lag_s + 1e-12
        )
    assert np.abs(stated).max() > 0.19


def test_computer_does_not_know_that_a_coil_is_wired_backwards(make):
    found = {}
    for polarity in ([1, 1, 1], [1, -1, 0]):
        coils = {"limit_a_m2": 3.0, "polarity": polarity}
        result = simulate(make(WINDOW | {"spacecraft.coils": coils}), asking_more)
        found[tuple(polarity)] = result
    right, wrong = found.values()
    assert np.array_equal(right["law.stated"], wrong["law.stated"])
    assert np.abs(right.dipole_body - wrong.dipole_body).max() > 0.1
