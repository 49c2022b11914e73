"""Devices: power switches, readings by command, wheels one by one, currents and temperatures."""

import itertools
import math

import numpy as np
import pytest
from onboard_ground import DAY, Ground, flown, flying, grounded, scenario
from unit_cases import two_magnetometers

from torquer.compile import engine
from torquer.flight.packets.reasons import Reason
from torquer.flight.software.core import Core
from torquer.flight.software.modules.telemetry import DEVICES
from torquer.flight.software.modules.wheels import lost_axes
from torquer.scenario.load import load_scenario

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
SENSORS = {"gyro": "gyro_s", "mag": "magnetometer_s", "sun": "sun_sensors_s"}
#: Of driving one wheel of a pair until its failure is known: three windows of a minute.
FOUND_S = 260


@pytest.fixture(scope="module")
def begun():
    return flown(scenario(3000.0))


@pytest.fixture
def ground(begun):
    """The satellite after a few seconds, with a ground that begins to listen."""
    return grounded(*begun)


def events(ground, code):
    return [v["argument"] for v in ground.named("event") if v["code"] == code]


def shown(ground, packet):
    """The next packet of a kind, at once."""
    number = {"housekeeping": 4, "wheels": 5, "devices": 1}[packet]
    ground.command("set_period", number, 1.0, times=14)
    return ground.named(packet)[-1]


@pytest.mark.verifies("REQ-SVR-007")
@pytest.mark.parametrize("device", sorted(SENSORS))
def test_sensor_without_power_gives_no_readings_and_draws_nothing(ground, device):
    number = ground.dictionary.modules[device]
    place = DEVICES.index(device)
    assert ground.command("power", number, 0)["code"] == Reason.DONE
    last_s = getattr(ground.core.services.inputs.read_at, SENSORS[device])
    ground.tick(times=20)
    inputs = ground.core.services.inputs
    assert getattr(inputs.read_at, SENSORS[device]) == last_s <= inputs.t_s - 20
    others = set(SENSORS.values()) - {SENSORS[device]}
    assert all(getattr(inputs.read_at, other) > inputs.t_s - 10 for other in others)
    assert shown(ground, "housekeeping")[f"{device}_current"] == 0.0
    assert ground.named("beacon")[-1]["power_status"] == 31 - (1 << place)
    assert shown(ground, "devices")["failed"] == 1 << place
    assert events(ground, Reason.POWER_CHANGED) == [number]
    assert ground.command("power", number, 1)["code"] == Reason.DONE
    ground.tick(times=20)
    inputs = ground.core.services.inputs
    assert getattr(inputs.read_at, SENSORS[device]) > inputs.t_s - 10
    assert ground.named("housekeeping")[-1][f"{device}_current"] > 0.0


@pytest.mark.verifies("REQ-SVR-007")
def test_power_is_on_after_a_boot(ground):
    ground.command("power", 23, 0)
    ground.core.reboot()
    ground.tick(times=30)
    inputs = ground.core.services.inputs
    assert inputs.read_at.magnetometer_s > inputs.t_s - 10
    assert ground.named("beacon")[-1]["power_status"] == 31


@pytest.mark.verifies("REQ-SVR-007", "REQ-COR-003")
def test_power_goes_back_with_a_snapshot(ground):
    """Off, snapshot, on, restored: the same bytes as without what came between."""
    core = ground.core
    ground.command("power", 23, 0)
    ground.command("wheel_power", 1, 0)
    before = core.snapshot()
    first = [core.tick() for _ in range(60)]
    ground.command("power", 23, 1)
    ground.tick(times=20)
    core.restore(before)
    assert [core.tick() for _ in range(60)] == first


@pytest.mark.verifies("REQ-SES-001")
def test_flight_with_commands_to_devices_flies_again_to_the_same_bytes():
    def fly():
        ground = flying(150.0)
        ground.tick(times=5)
        for name, *values in (
            *(("power", 23, 0), ("wheel_power", 3, 0), ("adc_limits", 0.0, 10.0, 0.05)),
            *(("wheel_manual", 1, 1e-4, 20.0), ("power", 23, 1), ("read_sensor", 22, 0)),
        ):
            ground.command(name, *values, times=20)
        return ground.sent

    assert fly() == fly()


def test_a_sensor_switched_off_and_on_before_its_reading_changes_nothing():
    plain, switched = (load_scenario(DAY).replace("simulation.duration_s", 60.0) for _ in range(2))
    one, two = Core(plain).flight, Core(switched).flight
    for flight in (one, two):
        while flight.read() is not None:
            if flight is two:
                flight.silence("gyro")
                flight.silence("gyro", False)
            flight.command()
    assert one.result().equals(two.result())


def test_what_cannot_be_silenced_is_refused(ground):
    flight = ground.core.flight
    with pytest.raises(ValueError, match=r"sensor: must be one of magnetometer, .*'compass'"):
        flight.silence("compass")
    with pytest.raises(ValueError, match=r"in_use: must be 6 truths, one a wheel"):
        flight.use_wheels([True])


@pytest.mark.verifies("REQ-ADC-001")
def test_currents_follow_from_commands(ground):
    assert shown(ground, "housekeeping")["wheels_current"] == pytest.approx(0.15, abs=0.01)
    ground.command("coils_manual", 3.2, 0.0, -1.6, 60.0)
    ground.tick(times=10)
    found = ground.named("housekeeping")[-1]
    assert found["coils_current"] == pytest.approx(1.5 / 12.0, abs=1e-3)
    assert found["mag_current"] == 0.027 and found["gyro_current"] == 0.073
    ground.command("coils_manual", 0.0, 0.0, 0.0, 60.0)
    ground.tick(times=10)
    assert ground.named("housekeeping")[-1]["coils_current"] == 0.0


@pytest.mark.verifies("REQ-ADC-001")
@pytest.mark.slow
def test_it_is_warmer_in_light_than_in_shadow():
    """An orbit and a half: the temperature falls while the Sun is not seen, and rises after."""
    ground = flying(9000.0)
    ground.command("set_period", 4, 20.0)
    ground.tick(times=8900)
    light = {t: v["flags"] & 1 for n, t, v in ground.packets if n == "extended"}
    warm = [(t, v["temperature"]) for n, t, v in ground.packets if n == "housekeeping"]
    rates = {0: [], 1: []}
    for (t0, before), (t1, after) in itertools.pairwise(warm):
        if t1 in light and light.get(t0) == light[t1]:
            rates[light[t1]].append((after - before) / (t1 - t0))
    assert np.median(rates[0]) < -1e-3 < 1e-3 < np.median(rates[1])
    assert 0.0 < np.ptp([value for _, value in warm]) < 40.0


@pytest.mark.verifies("REQ-ADC-002")
def test_device_beyond_its_current_is_switched_off_and_comes_back_by_command(ground):
    assert ground.command("adc_limits", -40.0, 85.0, 0.05)["code"] == Reason.DONE
    ground.tick(times=20)
    off = {"wheels", "gyro", "sun"} & {
        name for name in DEVICES if not ground.core.services.status(name)["power"]
    }
    assert off == {"wheels", "gyro", "sun"}
    assert {21, 22, 24} <= set(events(ground, Reason.OVER_CURRENT))
    found = shown(ground, "housekeeping")
    assert found["switched_off"] & 0b10110 == 0b10110 and found["gyro_current"] == 0.0
    assert found["current_max"] == pytest.approx(0.05)
    assert not ground.named("beacon")[-1]["power_status"] & 0b10110
    ground.command("power", 22, 1)  # still beyond: off again
    ground.tick(times=12)
    assert not ground.core.services.status("gyro")["power"]
    ground.command("adc_limits", -40.0, 85.0, 2.0)
    for number in (20, 21, 22, 24):
        assert ground.command("power", number, 1)["code"] == Reason.DONE
    found = ground.tick(times=40)
    assert ground.named("beacon")[-1]["power_status"] == 31
    assert shown(ground, "housekeeping")["switched_off"] == 0


@pytest.mark.verifies("REQ-ADC-003")
def test_temperature_beyond_its_limits_is_reported_once(ground):
    assert ground.command("adc_limits", 100.0, 101.0, 2.0)["code"] == Reason.DONE
    ground.tick(times=60)
    assert sorted(events(ground, Reason.TEMPERATURE)) == [20, 21, 22, 23, 24, 27]
    assert ground.named("housekeeping")[-1]["beyond"] == 63
    assert ground.core.services.status("adc")["beyond"] == 1.0
    assert ground.named("beacon")[-1]["power_status"] == 31
    ground.command("adc_limits", -40.0, 85.0, 2.0)
    ground.tick(times=10)
    assert shown(ground, "housekeeping")["beyond"] == 0


@pytest.mark.parametrize(
    "limits",
    [(10.0, 10.0, 1.0), (20.0, 10.0, 1.0), (0.0, 10.0, 0.0), (math.nan, 10.0, 1.0)],
)
def test_limits_that_cannot_be_are_refused(ground, limits):
    before = ground.core.state.modules["adc"].settings
    assert ground.command("adc_limits", *limits)["code"] == Reason.VALUE
    assert ground.core.state.modules["adc"].settings == before


@pytest.mark.verifies("REQ-DEV-002")
@pytest.mark.parametrize(
    ("device", "field"), [(22, "omega_body_rad_s"), (23, "b_body_t"), (24, "sun_body")]
)
def test_sensor_is_read_by_command(ground, device, field):
    ground.tick(ground.frame("read_sensor", device, 0), 1)
    ground.tick(times=1)
    inputs = ground.core.services.inputs
    ground.tick(times=2)
    (found,) = ground.named("reading")
    values = [found[f"value_{k}"] for k in "xyz"]
    assert (found["device"], found["unit"], found["power"], found["numbers"]) == (device, 0, 1, 3)
    assert 0.0 <= found["age"] <= 10.0
    now = getattr(inputs, field)
    assert np.allclose(values, now, rtol=0.5, atol=1e-5) and any(values) == any(now)


@pytest.mark.verifies("REQ-DEV-002")
def test_each_of_several_sensors_is_read_by_command():
    ground = Ground(Core(two_magnetometers()))
    ground.tick(times=10)
    found = {}
    for unit in (0, 1, 2):
        assert ground.command("read_sensor", 23, unit)["code"] == Reason.DONE
        found[unit] = [ground.named("reading")[-1][f"value_{k}"] for k in "xyz"]
    assert 1e-5 < np.linalg.norm(found[1]) < 1e-4 and found[1] != found[2]
    assert ground.command("read_sensor", 23, 3)["code"] == Reason.VALUE


@pytest.mark.verifies("REQ-DEV-002")
def test_what_cannot_be_read_is_refused(ground):
    assert ground.command("read_sensor", 99, 0)["code"] == Reason.VALUE
    assert ground.command("read_sensor", 8, 0)["code"] == Reason.NOT_AVAILABLE
    assert ground.command("read_sensor", 23, 1)["code"] == Reason.VALUE
    assert ground.command("read_sensor", 21, 7)["code"] == Reason.VALUE


@pytest.mark.verifies("REQ-SVR-011")
def test_modules_stop_and_start_by_command(ground):
    modules = ground.dictionary.modules
    for name in sorted(set(ground.core.state.modules) - {"cdh", "com", "svr", "wdt"}):
        number = modules[name]
        assert ground.command("module_start", number)["code"] == Reason.STATE
        assert ground.command("module_stop", number)["code"] == Reason.DONE
        steps = ground.core.state.slots[name].steps
        ground.tick(times=20)
        assert ground.core.state.slots[name].steps == steps
        assert ground.command("module_stop", number)["code"] == Reason.STATE
        assert ground.command("module_start", number)["code"] == Reason.DONE
    ground.tick(times=80)
    assert all(slot.runs for slot in ground.core.state.slots.values())
    assert ground.core.services.reboots == 0


@pytest.mark.verifies("REQ-SVR-011")
def test_modules_that_carry_commands_are_not_stopped(ground):
    for name in ("cdh", "com", "svr", "wdt"):
        assert ground.command("module_stop", ground.dictionary.modules[name])["code"] == 7
    assert ground.command("module_stop", 99)["code"] == Reason.VALUE
    assert ground.command("module_start", 99)["code"] == Reason.VALUE


@pytest.mark.verifies("REQ-SVR-011")
def test_actuators_go_back_to_the_laws_when_their_module_stops(ground):
    ground.command("coils_manual", 1.0, 0.0, 0.0, 500.0)
    ground.command("module_stop", 20)
    core = ground.core.services
    assert core.commanded[0] == core.answer.dipole_a_m2


@pytest.mark.verifies("REQ-TM-004")
@pytest.mark.parametrize(
    ("number", "packet"),
    [
        *((0, "extended"), (1, "settings"), (1, "devices"), (3, "queues")),
        *((4, "housekeeping"), (5, "wheels")),
    ],
)
def test_telemetry_of_each_subsystem_has_a_period(ground, number, packet):
    assert ground.command("set_period", number, 20.0)["code"] == Reason.DONE
    assert [n for n, _, _ in ground.tick(times=200)].count(packet) == 10
    ground.core.reboot()
    ground.tick(times=15)  # of the boot
    assert [n for n, _, _ in ground.tick(times=200)].count(packet) == 10
    assert ground.command("set_period", number, 0.0)["code"] == Reason.DONE
    assert packet not in [n for n, _, _ in ground.tick(times=100)]


@pytest.mark.verifies("REQ-TM-004")
def test_status_of_all_modules_comes_in_a_period(ground):
    ground.command("set_period", 2, 50.0)
    ground.packets.clear()
    ground.tick(times=100)
    found = [v["module_id"] for v in ground.named("module_status")]
    assert len(found) == 2 * len(set(found)) == 2 * len(ground.core.state.modules)
    assert ground.core.services.cdh.dropped["ground"] == 0


@pytest.mark.parametrize(("number", "period_s"), [(6, 1.0), (0, -1.0), (4, math.nan)])
def test_period_that_cannot_be_is_refused(ground, number, period_s):
    assert ground.command("set_period", number, period_s)["code"] == Reason.VALUE


@pytest.mark.verifies("REQ-DEV-003")
def test_wheel_turns_alone_by_command():
    """Wheel 2, without friction, at 0.2 mN m for a minute: 12 mN m s are 12 000 rpm."""
    names = ("coulomb_friction_n_m", "viscous_friction_n_m_s")
    ground = flying(200.0, **{f"spacecraft__wheels__{name}": 0.0 for name in names})
    ground.tick(times=5)
    assert ground.command("wheel_manual", 2, 2e-4, 60.0)["code"] == Reason.DONE
    ground.tick(times=70)
    found = shown(ground, "wheels")
    speeds = [found[f"speed_{k}"] for k in range(8)]
    assert speeds[2] == pytest.approx(12000, rel=0.01)
    assert all(abs(speeds[k]) < 50 for k in (0, 1, 3, 4, 5)) and speeds[6:] == [-32768] * 2
    assert (found["in_use"], found["lost"]) == (63, 0)
    assert ground.core.services.status("wheels")["manual"] == 0.0
    assert ground.command("wheel_manual", 6, 1e-4, 60.0)["code"] == Reason.VALUE


@pytest.mark.verifies("REQ-DEV-003")
def test_the_others_do_without_a_wheel_that_is_switched_off(ground):
    assert ground.command("wheel_power", 0, 0)["code"] == Reason.DONE
    ground.command("wheels_manual", 1e-4, 0.0, 0.0, 100.0)
    ground.tick(times=10)
    _, motors = ground.core.services.wheels()
    assert motors[0] == 0.0 and motors[1] == pytest.approx(-1e-4, rel=1e-6)
    assert shown(ground, "wheels")["in_use"] == 62
    assert ground.command("wheel_manual", 0, 1e-4, 60.0)["code"] == Reason.STATE
    assert ground.command("wheel_power", 0, 1)["code"] == Reason.DONE
    ground.tick(times=10)
    assert ground.core.services.wheels()[1][0] != 0.0
    assert ground.command("wheel_power", 9, 1)["code"] == Reason.VALUE


@pytest.mark.verifies("REQ-SVR-007")
def test_wheels_without_power_turn_no_motor_and_show_no_speed(ground):
    ground.command("power", 21, 0)
    read_s = ground.core.services.inputs.read_at.tachometers_s
    ground.tick(times=20)
    assert ground.core.services.wheels()[1] == [0.0] * 6
    assert ground.core.services.inputs.read_at.tachometers_s == read_s
    assert ground.command("wheels_manual", 1e-4, 0.0, 0.0, 60.0)["code"] == Reason.STATE
    assert shown(ground, "housekeeping")["wheels_current"] == 0.0
    assert shown(ground, "wheels")["in_use"] == 0


@pytest.mark.verifies("REQ-DEV-004", "REQ-SVR-004")
def test_the_first_dead_wheel_does_not_end_the_use_of_the_others():
    """Wheel 0 is dead, unnoticed by the computer: its pair takes its part; then that dies, too."""
    dead = [{"wheel": k, "time_s": t, "noticed_after_s": 1e7} for k, t in ((0, 50.0), (1, 600.0))]
    ground = Ground(Core(scenario(1200.0, spacecraft__wheels__failures=dead)))
    ground.tick(times=60)
    core = ground.core.services
    ground.command("wheels_manual", 5e-5, 0.0, 0.0, 900.0)
    ground.tick(times=FOUND_S)
    assert events(ground, Reason.WHEEL_FAILED) == [0]
    assert core.status("wheels")["lost"] == 0.0
    # the pair is full, since all of the null space's steering was its own: the other way
    ground.command("wheels_manual", -5e-5, 0.0, 0.0, 900.0)
    assert core.wheels()[1][:2] == [0.0, pytest.approx(5e-5, rel=1e-6)]
    before = core.wheels()[0]
    ground.tick(times=20)
    gained = np.subtract(core.wheels()[0], before)
    assert gained[1] == pytest.approx(1e-3, rel=0.1) and abs(gained[0]) < 1e-4
    ground.tick(times=600 - round(core.t_s) + FOUND_S)
    assert events(ground, Reason.WHEEL_FAILED) == [0, 1]
    assert core.status("wheels")["lost_x"] == core.status("wheels")["lost"] == 1.0
    assert core.status("wheels")["lost_y"] == core.status("wheels")["lost_z"] == 0.0


@pytest.mark.verifies("REQ-DEV-004")
def test_axes_are_lost_when_no_wheel_has_a_part_of_them():
    corners = np.array([[1, 1, 1], [-1, 1, 1], [-1, -1, 1], [1, -1, 1]]) / np.sqrt(3.0)
    for k in range(4):
        assert lost_axes(corners, [n != k for n in range(4)]) == [False] * 3
    assert lost_axes(corners, [True, True, False, False]) == [False, True, True]
    assert lost_axes(np.eye(3), [True, False, True]) == [False, True, False]
    assert lost_axes(np.eye(3), [False] * 3) == [True] * 3
