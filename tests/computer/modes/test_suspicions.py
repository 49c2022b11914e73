"""Which sensor and which coil is suspected: flights with one failure each, and sound ones."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from torquer import simulate
from torquer.compile import engine
from torquer.scenario.change import with_values
from torquer.scenario.load import ScenarioError, scenario_from_text

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")

SENSORS, AXES = ("magnetometer", "gyro", "sun_sensors"), "xyz"
CHIBIS_M = """
start = 2012-03-04T10:31:47Z
orbit = { kind = "circular", altitude_km = 550, inclination_deg = 51.7 }
initial = { rate_deg_s = [3, -4, 2] }
spacecraft.body.preset = "chibis_m_body"
spacecraft.coils = { preset = "chibis_m_coils" }
spacecraft.magnetometer = { preset = "hmr2300r" }
spacecraft.gyro = { preset = "adis16130" }
spacecraft.sun_sensors = { preset = "dss3" }
simulation = { duration_s = 3000, record_s = 10.0 }
[control]
sample_s = 1.0
[control.laws]
damping = { kind = "bdot", gain_a_m2_s_per_t = 1e6 }
[control.modes]
inertia_kg_m2 = [[1.0255, 0.0014, -0.0724], [0.0014, 1.5393, 0.0019], [-0.0724, 0.0019, 1.8172]]
[control.modes.noise]
magnetometer_noise_nt = 100
sun_noise_deg = 0.2
gyro_noise_deg_s = 0.02
rate_tolerance_deg_s = 0.06
[control.modes.regions.main.states.damping]
laws = ["damping"]
final = true
"""
WATCH = """
[control.modes.regions.{name}.states.trusted]
transitions = [{{ to = "suspected", when = {{ {of}, above = 0.5 }} }}]
[control.modes.regions.{name}.states.suspected]
transitions = [{{ to = "trusted", when = {{ {of}, below = 0.5 }} }}]
"""
WATCHES = "".join(
    [WATCH.format(name=s, of=f'signal = "sensor_suspected", sensor = "{s}"') for s in SENSORS]
    + [WATCH.format(name=c, of=f'signal = "coil_suspected", coil = "{c}"') for c in AXES]
)
BEGIN_S = 500.0


def flown(rate_deg_s=(3, -4, 2), euler_deg=(10, 20, 30), seed=1, **changes):
    """A flight under B-dot that watches all suspicions."""
    scenario = scenario_from_text(CHIBIS_M + WATCHES).replace("seed", seed)
    for key, value in {"rate_deg_s": rate_deg_s, "euler_deg": euler_deg}.items():
        scenario = scenario.replace(f"initial.{key}", value)
    for key, value in changes.items():
        scenario = scenario.replace(f"spacecraft.{key.replace('__', '.')}", value)
    return simulate(scenario)


def suspected_s(result):
    """By the name of each device that has been suspected: the times [s] at which it was."""
    t = result.time.values
    found = {name: t[result[f"mode_{name}"].values == 1] for name in (*SENSORS, *AXES)}
    return {name: times for name, times in found.items() if times.size}


@settings(max_examples=12, deadline=None)
@given(
    st.tuples(*[st.floats(-4.0, 4.0)] * 3),
    st.tuples(*[st.integers(-180, 180)] * 3),
    st.integers(0, 999),
)
def test_sound_devices_are_not_suspected(rate_deg_s, euler_deg, seed):
    """Whatever the motion: fast and slow, Sun in view or not, with the noise of the data sheets."""
    assert suspected_s(flown(rate_deg_s, euler_deg, seed)) == {}


def test_sound_gyro_with_bias_within_tolerance_is_not_suspected():
    assert suspected_s(flown(gyro__bias_deg_s=(0.02, -0.015, 0.01))) == {}


def failure(kind, until_s=1500.0):
    return [{"kind": kind, "from_s": BEGIN_S, "until_s": until_s}]


@pytest.mark.parametrize("kind", ["silent", "stuck", "zeros"])
@pytest.mark.parametrize("sensor", SENSORS)
def test_sensor_that_fails_alone_is_the_only_one_suspected(sensor, kind):
    """Within a minute, for as long as it fails and two minutes more. Zeros of Sun sensors are none
    of theirs: no Sun is in view."""
    found = suspected_s(flown(**{f"{sensor}__failures": failure(kind)}))
    if (sensor, kind) == ("sun_sensors", "zeros"):
        assert found == {}
        return
    assert [*found] == [sensor]
    assert BEGIN_S + 30.0 <= found[sensor][0] <= BEGIN_S + 60.0
    assert 1600.0 <= found[sensor][-1] <= 1680.0


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("off_deg_s", [0.3, -0.5])
def test_a_gyro_with_a_bias_contradicts_field_and_sun(axis, off_deg_s):
    """It alone is to blame, though a field that is biased contradicts it, too."""
    bias = [off_deg_s if i == axis else 0.0 for i in range(3)]
    found = suspected_s(flown(gyro__bias_deg_s=bias))
    assert [*found] == ["gyro"] and found["gyro"][0] < 300.0


@pytest.mark.parametrize("scale_error", [(-2, -2, -2), (-2, 0, 0), (0, 0, -2)])
def test_a_gyro_of_the_wrong_sign_is_suspected(scale_error):
    found = suspected_s(flown(gyro__scale_error=scale_error))
    assert [*found] == ["gyro"] and found["gyro"][0] < 120.0


@pytest.mark.parametrize(
    "wrong",
    [
        {"scale_error": (-2, 0, 0)},
        {"misalignment_deg": (0, 0, 90)},
        {"bias_nt": (0, 10000, 0)},
    ],
)
def test_a_magnetometer_of_the_wrong_direction_is_suspected_in_sunlight(wrong):
    """Gyro and Sun agree with each other; the angle from Sun to field is not the models'."""
    ((key, value),) = wrong.items()
    found = suspected_s(flown(**{f"magnetometer__{key}": value}))
    assert found["magnetometer"][0] < 300.0
    assert not {*AXES, "sun_sensors"} & {*found}


def test_wrong_field_sign_shows_in_what_the_coils_do():
    """It turns as the gyro says. The Sun sensors are suspected until the coils have been tried."""
    found = suspected_s(flown(magnetometer__scale_error=(-2, -2, -2)))
    assert found["magnetometer"][0] < 900.0
    assert found["magnetometer"][-1] == 3000.0
    assert not {*AXES, "gyro"} & {*found}
    assert "sun_sensors" not in found or found["sun_sensors"][-1] < found["magnetometer"][0] + 180.0


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("polarity", [-1, 0])
def test_a_coil_that_works_otherwise_is_found_alone(axis, polarity):
    signs = [polarity if i == axis else 1 for i in range(3)]
    found = suspected_s(flown(coils__polarity=signs))
    assert [*found] == [AXES[axis]]
    assert found[AXES[axis]][0] < (1200.0 if polarity < 0 else 2400.0)


def test_two_reversed_coils_are_found():
    assert [*suspected_s(flown(coils__polarity=[1, -1, -1]))] == ["y", "z"]


@pytest.mark.parametrize("axis", range(3))
def test_dipole_that_is_always_there_is_a_stuck_coil(axis):
    dead = [0 if i == axis else 1 for i in range(3)]
    stuck = [3.2 if i == axis else 0.0 for i in range(3)]
    found = suspected_s(flown(coils__polarity=dead, coils__residual_dipole_a_m2=stuck))
    assert [*found] == [AXES[axis]] and found[AXES[axis]][0] < 1200.0


def test_the_effects_of_sound_coils_are_those_commanded():
    """Recovered from noisy readings within the stated uncertainty, in forty minutes of B-dot."""
    from torquer.simulation.setup.run import prepare

    run = prepare(scenario_from_text(CHIBIS_M).replace("initial.rate_deg_s", (3, -4, 2)))
    run.advance_to(2400)
    now = run.state.board.modes.checks[0]
    sigma = np.sqrt(np.diag(now["covariance"]))
    assert (np.abs(now["effect"][:3] - 1.0) < 2.0 * sigma[:3]).all()
    assert (sigma[:3] < 0.5).all() and (np.abs(now["effect"][3:]) < 2.0 * sigma[3:]).all()
    assert (np.linalg.eigvalsh(now["covariance"]) > 0.0).all()


def test_a_wheel_of_fixed_momentum_is_part_of_the_momentum():
    """A reversed coil is found if the checks know of the wheel, whose torques hide it else."""
    scenario = scenario_from_text(CHIBIS_M + WATCHES)
    wheel = {
        "spacecraft.coils.polarity": (1, -1, 1),
        "spacecraft.body.wheel_momentum_n_m_s": (0.0, 0.1, 0.0),
    }
    with pytest.raises(ScenarioError, match=r"control\.modes\.wheel_momentum_n_m_s: must be given"):
        with_values(scenario, wheel)
    wheel["control.modes.wheel_momentum_n_m_s"] = (0.0, 0.1, 0.0)
    assert [*suspected_s(simulate(with_values(scenario, wheel)))] == ["y"]
    wheel["control.modes.wheel_momentum_n_m_s"] = (0.0, 0.0, 0.0)
    assert suspected_s(simulate(with_values(scenario, wheel))) == {}


def test_bad_coil_is_found_despite_contradictory_sun_sensors():
    """The directions to the Sun do not turn as the gyro says: it is not the field that is wrong."""
    wrong = [{"kind": "swapped", "axes": "xy"}]
    found = suspected_s(flown(coils__polarity=(1, -1, 1), sun_sensors__failures=wrong))
    assert [*found] == ["sun_sensors", "y"] and found["y"][0] < 1200.0


def test_a_magnetometer_between_long_actuations_is_not_silent():
    """Sixty seconds without a reading are its timetable."""
    cycle = {"measure_s": 10.0, "actuate_s": 60.0, "control_while_actuating": True}
    changes = {f"control.{key}": value for key, value in cycle.items()}
    scenario = with_values(scenario_from_text(CHIBIS_M + WATCHES), changes)
    assert suspected_s(simulate(scenario)) == {}


def test_a_coil_that_a_mode_switches_off_stays_off_alone():
    text = CHIBIS_M.replace('laws = ["damping"]', 'laws = ["damping"]\ncoils_off = ["y"]')
    dipole = simulate(scenario_from_text(text)).command_body.values
    assert not dipole[:, 1].any() and dipole[:, 0].any() and dipole[:, 2].any()


def test_reversed_b_dot_brakes_with_a_wrong_sign_magnetometer():
    """And drives the rotation without the state that does so."""
    reversed_field = {"spacecraft.magnetometer.scale_error": [-2, -2, -2]}
    state = """
transitions = [{ to = "reversed", when = { signal = "coils_reversed", above = 0.5 } }]
[control.modes.regions.main.states.reversed]
laws = { damping = -1.0 }
final = true
"""
    rates = []
    for text in (CHIBIS_M, CHIBIS_M.replace("final = true\n", state)):
        result = simulate(with_values(scenario_from_text(text), reversed_field))
        rates.append(np.degrees(np.linalg.norm(result.omega_body.values[-1])))
    assert rates[1] < 4.0 < 5.4 < rates[0]
