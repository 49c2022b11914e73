"""What the ground sends up is used: orbit, models, calibration; what cannot be is refused."""

import math

import numpy as np
import pytest
from onboard_ground import ALL_MODES, Ground, flown, grounded, scenario
from uplink_cases import AHEAD, OTHER, SCIENCE_S, TLE, calm, errors_deg, in_bytes

from torquer.compile import engine
from torquer.environment.field import Igrf14, TiltedDipole
from torquer.flight.packets.reasons import Reason
from torquer.flight.software.core import Core
from torquer.flight.software.memory import Memory
from torquer.flight.software.services import settings_file
from torquer.maths.geometry.quaternion import from_rotation_vector, rotate
from torquer.scenario.load import load_scenario

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")

XYZ = "xyz"
ONE = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


@pytest.fixture(scope="module")
def begun():
    """A satellite that holds its attitude."""
    return flown(calm(2500.0), until=SCIENCE_S)


@pytest.fixture
def ground(begun):
    return grounded(*begun)


def extended(ground, command=None, values=(), times=40):
    """Extended packets from a command, which is carried out, or from none on."""
    ground.packets.clear()
    if command is None:
        ground.tick(times=times)
    else:
        answer = ground.command(command, *values, times=times)
        assert answer["code"] == Reason.DONE and answer["accepted"] == 1
    return ground.named("extended")


def vector(packet, name, parts=XYZ):
    return np.array([packet[f"{name}_{part}"] for part in parts])


#: Command, values, fields that change with the first packet that differs.
EFFECTS = [
    ("coils_calibration", (2.0, 0.5, 1.5), "omega"),
    ("gyro_calibration", (0.5, 0.0, 0.0), "gyro_x"),
    ("gyro_matrix", (1.0, 0.2, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.2), "gyro"),
    ("mag_calibration", (0.0, 900.0, 0.0), "b_y"),
    ("mag_matrix", (1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0), "b_y"),
    ("set_elements", in_bytes(AHEAD), "q_orbital"),
    ("set_model", (1,), "q_inertial"),
    ("set_model", (3 + (1 << 4),), "q_inertial"),
    ("sun_calibration", (0.0, 5.0, 0.0), "sun"),
    ("wheels_calibration", (0, 1.5), "wheel_momentum"),
]


@pytest.mark.verifies("REQ-MOD-002", "REQ-MOD-003", "REQ-CAL-001")
@pytest.mark.parametrize(("command", "values", "field"), EFFECTS)
def test_what_is_accepted_has_an_effect_in_telemetry(begun, command, values, field):
    """Packets are those of a flight without the command, until it is carried out."""
    core, snapshot = begun
    if command == "sun_calibration":
        core, snapshot = flown(calm(), until=600)  # the Sun is in view
    without = extended(grounded(core, snapshot), times=300)
    given = extended(grounded(core, snapshot), command, values, times=300)
    first = next(k for k, pair in enumerate(zip(without, given, strict=True)) if pair[0] != pair[1])
    assert first >= 1
    changed = {name for name in given[first] if given[first][name] != without[first][name]}
    assert any(name.startswith(field) for name in changed), changed


@pytest.mark.verifies("REQ-MOD-002")
def test_elements_of_another_satellite_are_refused(begun):
    """And change nothing: the case of a flight that was told another's."""
    core, snapshot = begun
    ground = grounded(core, snapshot)
    without = extended(grounded(core, snapshot), times=40)
    ground = grounded(core, snapshot)
    assert ground.command("set_elements", *in_bytes(OTHER), times=40)["code"] == Reason.VALUE
    assert ground.named("extended") == without
    assert "elements" not in core.memory.names()
    assert core.services.status("mod")["elements"] == 0.0


@pytest.mark.verifies("REQ-MOD-002")
@pytest.mark.parametrize(
    ("limits", "code"), [((300.0, 5.0), 4), ((400.0, 0.01), 4), ((400.0, 5.0), 0)]
)
def test_how_far_elements_may_be_is_a_setting(ground, limits, code):
    """Elements 3 deg ahead, 360 km, and off by 0.1 deg in plane."""
    assert ground.command("elements_limits", *limits)["code"] == Reason.DONE
    assert ground.command("set_elements", *in_bytes(AHEAD))["code"] == code


@pytest.mark.verifies("REQ-MOD-002")
def test_elements_turn_the_orbital_frame_on_board(ground):
    """3 deg ahead: the attitude to the orbital frame turns by that about the orbit's normal."""
    before = vector(extended(ground, times=5)[-1], "q_orbital", range(4))
    place = np.array(ground.core.services.inputs.ephemeris.r_inertial_m)
    after = vector(extended(ground, "set_elements", in_bytes(AHEAD), 3)[-1], "q_orbital", range(4))
    now = np.array(ground.core.services.inputs.ephemeris.r_inertial_m)
    turned = 2.0 * math.degrees(math.acos(min(1.0, abs(before @ after))))
    assert turned == pytest.approx(3.0, abs=0.3)
    assert np.linalg.norm(now - place) == pytest.approx(math.radians(3.0) * 6878e3, rel=0.1)


@pytest.mark.verifies("REQ-MOD-002")
def test_true_elements_end_a_stated_error():
    """A computer 100 km off has a wrong attitude until it is told its orbit."""
    orbit = {"kind": "sgp4", "tle": list(TLE)}
    made = calm(5000.0, orbit=orbit, control__ephemeris={"along_track_error_m": 100e3})
    core, _ = flown(made, until=2300)
    ground = Ground(core)
    assert ground.command("set_elements", *in_bytes(TLE))["code"] == Reason.DONE
    while core.tick() is not None:
        pass
    result = core.result()
    away_m = np.linalg.norm((result.position_believed - result.position_inertial).values, axis=1)
    t_s, error = result.time.values, errors_deg(result)
    assert away_m[t_s <= 2300] == pytest.approx(100e3, rel=1e-3)
    assert away_m[t_s >= 2310].max() < 1e-2
    before, after = (t_s > 900) & (t_s <= 2290), t_s > 4200  # between them it is dark
    assert np.median(error[before]) > 1.0
    assert np.median(error[after]) < 0.3


@pytest.mark.verifies("REQ-MOD-003")
@pytest.mark.parametrize(
    ("flags", "field"),
    [(1, TiltedDipole()), (3, Igrf14(degree=10)), (3 | 1 << 4, Igrf14(degree=1)),
     (3 | 13 << 4, Igrf14(degree=13))],
)  # fmt: skip
def test_the_field_on_board_is_that_of_the_model_chosen(ground, flags, field):
    assert ground.command("set_model", flags)["code"] == Reason.DONE
    made = ground.core.flight._run.scenario.orbit_environment()
    model = made.environment.model_copy(update={"field": field})
    place, t_s = ground.core.services.inputs.ephemeris, np.array([ground.core.services.t_s])
    own = type(made)(model, made.orbit, made.start)
    assert place.b_inertial_t == pytest.approx(own.field(t_s, *own.state(t_s))[0], abs=1e-12)


@pytest.mark.verifies("REQ-MOD-003")
def test_kepler_is_within_kilometres_of_sgp4(ground):
    """The same elements by both: J2 within a revolution is the difference."""
    core = ground.core.services
    extended(ground, "set_elements", in_bytes(TLE), 3)
    by_sgp4 = np.array(core.inputs.ephemeris.r_inertial_m)
    velocity, t_s = np.array(core.inputs.ephemeris.v_inertial_m_s), core.t_s
    extended(ground, "set_model", (2,), 3)
    kepler = np.array(core.inputs.ephemeris.r_inertial_m)
    moved = velocity * (core.t_s - t_s)  # and by 40 m more
    assert 100.0 < np.linalg.norm(kepler - moved - by_sgp4) < 20e3


@pytest.mark.verifies("REQ-MOD-003")
def test_the_sun_stays_where_it_is(ground):
    core = ground.core.services
    before = core.inputs.ephemeris.sun_inertial
    extended(ground, "set_model", (7,), 3)
    held = core.inputs.ephemeris.sun_inertial
    assert held == pytest.approx(before, abs=5e-5)
    ground.core.reboot()
    ground.tick(times=20)
    # a place on the orbit moves it by 7000 km of 1 au
    assert core.inputs.ephemeris.sun_inertial == pytest.approx(held, abs=2e-5)
    assert ground.core.flight._run.uplinked[-1].models.sun_direction == pytest.approx(
        before, abs=1e-6
    )


@pytest.mark.verifies("REQ-MOD-003")
@pytest.mark.parametrize("flags", [8, 11, 1 | 2 << 4, 3 | 14 << 4, 256, 65535])
def test_models_that_there_are_not(ground, flags):
    assert ground.command("set_model", flags)["code"] == Reason.VALUE
    assert ground.core.services.status("mod")["flags"] == 3
    assert not ground.core.flight._run.uplinked


@pytest.mark.verifies("REQ-CAL-001")
def test_the_bias_of_the_field_is_subtracted(begun):
    """Telemetry has corrected readings: to a step of its numbers."""
    core, snapshot = begun
    without = extended(grounded(core, snapshot), times=8)
    given = extended(grounded(core, snapshot), "mag_calibration", (500.0, -300.0, 200.0), 8)
    differ = [vector(a, "b") - vector(b, "b") for a, b in zip(without, given, strict=True)]
    first = next(d for d in differ if d.any())
    assert first == pytest.approx([500.0, -300.0, 200.0], abs=2.1)


@pytest.mark.verifies("REQ-CAL-001")
def test_the_direction_to_the_sun_is_turned():
    core, snapshot = flown(calm(), until=600)
    without = extended(grounded(core, snapshot), times=6)
    given = extended(grounded(core, snapshot), "sun_calibration", (0.0, 4.0, 0.0), 6)
    pair = next((a, b) for a, b in zip(without, given, strict=True) if a != b)
    turn = from_rotation_vector((0.0, math.radians(4.0), 0.0))
    assert vector(pair[1], "sun") == pytest.approx(
        rotate(turn, tuple(vector(pair[0], "sun"))), abs=1e-4
    )


@pytest.mark.verifies("REQ-CAL-001")
def test_calibrated_sensors_fly_as_perfect_ones():
    """Bias, scale and misalignment of three sensors, and the calibration that removes them."""
    perfect = calm()
    wrong = calm(
        spacecraft__magnetometer__bias_nt=(2000.0, -1500.0, 800.0),
        spacecraft__magnetometer__scale_error=(0.05, -0.04, 0.03),
        spacecraft__gyro__bias_deg_s=(0.32, -0.215, 0.11),
        spacecraft__gyro__scale_error=(0.02, 0.03, -0.02),
    )
    scales = tuple(np.diag([1 / 1.05, 1 / 0.96, 1 / 1.03]).ravel().tolist())
    gyro = tuple(np.diag([1 / 1.02, 1 / 1.03, 1 / 0.98]).ravel().tolist())
    software = {
        "modules": {
            "mag": {"settings": {"bias": [2000.0, -1500.0, 800.0], "matrix": scales}},
            # what is left is the bias of the example
            "gyro": {"settings": {"bias": [0.3, -0.2, 0.1], "matrix": gyro}},
        }
    }
    results = []
    for made, given in ((perfect, None), (wrong, software), (wrong, None)):
        core, _ = flown(made, given, 1500)
        results.append(core.result())
    good, mended, bad = (errors_deg(r)[-40:] for r in results)
    read = [r.b_measured.values[1:] for r in results]
    assert np.abs(read[1][:20] - read[0][:20]).max() < 3e-8  # noise that is scaled by 5 %
    assert np.median(mended) < 1.5 * np.median(good) + 0.1
    assert not np.median(bad) < 3.0 * np.median(mended)  # wrong, or unknown


@pytest.mark.verifies("REQ-CAL-001")
def test_coils_make_what_is_asked_for(ground):
    """Coils of half the strength get twice the command; what laws know of is what comes out."""
    core = ground.core
    answer = ground.command("coils_calibration", 2.0, 0.5, 1.25)
    assert answer["code"] == Reason.DONE
    ground.command("coils_manual", 0.5, -0.25, 0.1, 60.0)
    known, driven = [], []
    for _ in range(14):  # two cycles of measurement and control
        ground.tick()
        known.append(core.services.inputs.coil_dipole_body_a_m2)
        driven.append(core.flight._run.state.coils["command_a_m2"].tolist())
    assert core.services.commanded[0] == pytest.approx((0.5, -0.25, 0.1), abs=1e-7)
    assert driven[-7:].count(pytest.approx([1.0, -0.125, 0.125], abs=1e-6)) == 2  # of 3 s
    assert max(known[-7:], key=lambda v: v[0]) == pytest.approx((0.5, -0.25, 0.1), abs=1e-6)


@pytest.mark.verifies("REQ-CAL-001")
@pytest.mark.parametrize("wheel", [0, 5])
def test_one_tachometer_is_scaled(begun, wheel):
    core, snapshot = begun
    without, with_factor = [], []
    for found, commanded in ((without, False), (with_factor, True)):
        ground = grounded(core, snapshot)
        if commanded:
            assert ground.command("wheels_calibration", wheel, 1.5, times=1) is None
        else:
            ground.tick()
        ground.tick()
        ground.tick()
        found += core.flight._run.state.allocation.momentum.tolist()
    ratio = np.array(with_factor) / np.array(without)
    assert ratio[wheel] == pytest.approx(1.5, rel=1e-2)
    assert np.delete(ratio, wheel) == pytest.approx(1.0, rel=1e-2)


#: What no command may set.
WRONG = [
    ("coils_calibration", (0.0, 1.0, 1.0)),
    ("coils_calibration", (math.nan, 1.0, 1.0)),
    ("coils_calibration", (1.0, 1.0, -1.0)),
    ("elements_limits", (0.0, 5.0)),
    ("elements_limits", (math.inf, 5.0)),
    ("elements_limits", (1.0, math.nan)),
    ("gyro_calibration", (1e6, 0.0, 0.0)),
    ("gyro_matrix", (0.0,) * 9),
    ("mag_calibration", (math.inf, 0.0, 0.0)),
    ("mag_calibration", (math.nan, 0.0, 0.0)),
    ("mag_calibration", (0.0, 3e5, 0.0)),
    ("mag_matrix", (1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0)),
    ("mag_matrix", (math.nan, *ONE[1:])),
    ("mag_matrix", (1e30, *ONE[1:])),
    ("sun_calibration", (200.0, 0.0, 0.0)),
    ("sun_calibration", (math.nan, 0.0, 0.0)),
    ("wheels_calibration", (0, 0.0)),
    ("wheels_calibration", (0, math.inf)),
    ("wheels_calibration", (6, 1.1)),
]


@pytest.mark.verifies("REQ-CAL-002")
@pytest.mark.parametrize(("command", "values"), WRONG)
def test_calibrations_that_cannot_be(ground, command, values):
    state = ground.core.flight._run.state.calibration.tobytes()
    module = ground.core.state.modules[ground.dictionary.up[command].module]
    before = module.settings
    assert ground.command(command, *values)["code"] == Reason.VALUE
    assert ground.core.flight._run.state.calibration.tobytes() == state
    assert ground.core.state.modules[module.name].settings == before


SENT = [
    ("coils_calibration", (2.0, 0.5, 1.5)),
    ("gyro_calibration", (0.5, 0.0, 0.0)),
    ("gyro_matrix", (1.0, 0.25, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.25)),
    ("mag_calibration", (0.0, 900.0, 0.0)),
    ("mag_matrix", (1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0)),
    ("set_elements", in_bytes(AHEAD)),
    ("set_model", (1,)),
    ("sun_calibration", (0.0, 5.0, 0.0)),
    ("wheels_calibration", (3, 1.5)),
]


def what_is_sent(core):
    run = core.flight._run
    return run.state.calibration.tobytes(), [each.models for each in run.uplinked]


@pytest.mark.verifies("REQ-MOD-001", "REQ-MOD-003", "REQ-CAL-003")
@pytest.mark.parametrize("is_damaged", [False, True])
def test_what_was_sent_is_taken_up_at_each_boot(ground, is_damaged):
    """From the memory, or not at all: settings that are lost are those as delivered."""
    core, plain = ground.core, what_is_sent(ground.core)
    for command, values in SENT:
        assert ground.command(command, *values)["code"] == Reason.DONE, command
    sent = what_is_sent(core)
    assert sent != plain and sent[1]
    if is_damaged:
        for name in (*map(settings_file, core.state.modules), "elements"):
            for place in core.memory.places.values():
                if name in place:
                    place[name] = b"damaged"
    core.reboot()
    ground.tick(times=20)
    assert core.is_running
    now = what_is_sent(core)
    assert now[0] == (plain if is_damaged else sent)[0]
    stated = core.flight._run.scenario.control.ephemeris
    assert now[1][-1] == (stated if is_damaged else sent[1][-1])


@pytest.mark.verifies("REQ-SVR-008", "REQ-CAL-003")
def test_defaults_are_the_calibration_as_delivered(ground):
    core, plain = ground.core, what_is_sent(ground.core)
    for command, values in SENT:
        ground.command(command, *values)
    for module in ("coils", "gyro", "mag", "mod", "sun", "wheels"):
        number = ground.dictionary.modules[module]
        assert ground.command("restore_defaults", number)["code"] == Reason.DONE
    assert what_is_sent(core)[0] == plain[0]
    models = core.flight._run.uplinked[-1].models
    assert models.field is None and models.orbit.tle == AHEAD


@pytest.mark.verifies("REQ-COR-003")
def test_a_snapshot_has_what_was_sent(ground):
    core = ground.core
    before = core.snapshot()
    for command, values in SENT:
        ground.command(command, *values)
    kept = core.snapshot()
    first = [core.tick() for _ in range(100)]
    core.restore(kept)
    assert [core.tick() for _ in range(100)] == first
    core.restore(before)
    assert not core.flight._run.uplinked
    assert not core.flight._run.state.calibration["sensors"].any()


@pytest.mark.verifies("REQ-MOD-001")
def test_elements_of_an_earlier_flight_are_used_from_its_first_control_step_on():
    memory = Memory()
    core = Core(calm(60.0), memory=memory)
    Ground(core).command("set_elements", *in_bytes(AHEAD))
    again = Core(calm(60.0), memory=memory)
    again.tick()
    place = np.array(again.services.inputs.ephemeris.r_inertial_m)
    own, _ = calm(60.0).orbit_environment().state(np.zeros(1))
    assert np.linalg.norm(place - own[0]) == pytest.approx(math.radians(3.0) * 6878e3, rel=0.1)


@pytest.mark.verifies("REQ-CAL-002")
def test_what_a_satellite_does_not_have_is_not_calibrated():
    """No wheels, no ephemeris; several devices of a kind have no calibration in common."""
    ground = Ground(Core(load_scenario("examples/several_sensors.toml")))
    answers = {
        name: ground.command(name, *values)
        for name, values in (*SENT, ("mag_matrix", ONE), ("wheels_calibration", (0, 1.0)))
    }
    assert answers["mag_calibration"]["code"] == Reason.NOT_AVAILABLE
    assert not ground.core.flight._run.state.calibration["sensors"].any()


def test_tables_of_all_modes_take_data_from_the_first_control_step_on():
    """Elements and a calibration for a satellite in safe mode; those of another are refused."""
    ground = Ground(Core(scenario(200.0, ALL_MODES)))
    assert ground.command("set_elements", *in_bytes(AHEAD))["code"] == Reason.DONE
    assert ground.command("mag_calibration", 500.0, 0.0, 0.0)["code"] == Reason.DONE
    assert ground.command("set_elements", *in_bytes(OTHER))["code"] == Reason.VALUE
