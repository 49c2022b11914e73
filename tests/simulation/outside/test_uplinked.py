"""Ephemeris and calibration that the ground sends up, in the loop itself and to the bit."""

import math
from datetime import timedelta

import numpy as np
import pytest
from uplink_cases import AHEAD, TLE, calm

from torquer import Flight, law, resume, simulate
from torquer.compile import engine
from torquer.environment.along_orbit import Environment, OrbitEnvironment
from torquer.environment.chosen_models import Choice, NoSuchModel, chosen_models
from torquer.environment.ephemeris import EphemerisModels
from torquer.environment.field import DirectDipole, Igrf14, TiltedDipole
from torquer.environment.orbit import Drifting, Sgp4
from torquer.environment.orbit.elements_adrift import adrift
from torquer.simulation.setup import size

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")

#: Readings at once, late, and not at every control step; none of them moves the satellite.
QUIET = {
    "spacecraft.magnetometer": {"noise_nt": 50.0, "sample_s": 1.0, "delay_s": 0.5},
    "spacecraft.gyro": {"noise_deg_s": 0.01, "sample_s": 2.0, "delay_s": 0.5,
                        "failures": [{"kind": "stuck", "from_s": 60.0, "until_s": 90.0},
                                     {"kind": "silent", "from_s": 120.0, "until_s": 140.0}]},
    "spacecraft.sun_sensors": {"axes": [[1, 0, 0], [-1, 2, 0]], "half_field_deg": 80.0},
    "spacecraft.coils": {"limit_a_m2": 3.0, "lag_s": 0.7},
    "control": {"laws": {"a": {"kind": "off"}}, "sample_s": 1.0},
    "simulation": {"duration_s": 200.0, "step_s": 0.5, "record_s": 1.0},
    "seed": 7,
}  # fmt: skip
MATRIX = (1.02, 0.01, -0.02, 0.0, 0.97, 0.03, 0.01, 0.0, -1.01)


@law(needs={"rate", "ephemeris"})
def looking(inputs, parameters, memory):
    """Needs all, does nothing."""
    return 0.0, 0.0, 0.0


def looked(make, calibrate=None, **keys):
    """What is known at each control step; `calibrate(flight)` before the first."""
    flight = Flight(make(QUIET | keys), keeps_computer=True, laws={"a": looking})
    if calibrate is not None:
        calibrate(flight)
    found = []
    while (inputs := flight.read()) is not None:
        found.append(inputs)
        flight.command()
    return found


@pytest.mark.parametrize(
    ("sensor", "field", "bias"),
    [("magnetometer", "b_body_t", (2e-6, -1e-6, 5e-7)), ("gyro", "omega_body_rad_s", (0.01, 0, 0)),
     ("sun_sensors", "sun_body", (0.0, 0.0, 0.0))],
)  # fmt: skip
def test_each_reading_is_corrected_once(make, sensor, field, bias):
    """Late, rare, stuck or missing: it is the matrix times what would have been read."""
    plain = looked(make)
    given = looked(make, lambda flight: flight.calibrate(sensor, MATRIX, bias))
    matrix, zero = np.reshape(MATRIX, (3, 3)), np.array(bias)
    changed = 0
    for a, b in zip(plain, given, strict=True):
        raw, corrected = np.array(getattr(a, field)), np.array(getattr(b, field))
        assert a.read_at == b.read_at
        if math.isfinite(a.read_at[["magnetometer", "", "gyro", "sun_sensors"].index(sensor)]):
            assert corrected == pytest.approx(matrix @ (raw - zero), rel=1e-12, abs=1e-18)
            changed += not np.array_equal(raw, corrected)
        others = {"b_body_t", "omega_body_rad_s", "sun_body"} - {field}
        assert all(getattr(a, name) == getattr(b, name) for name in others)
    assert changed > 100


def test_calibration_taken_back_leaves_no_trace(make):
    def there_and_back(flight):
        flight.calibrate("gyro", MATRIX, (0.1, 0.0, 0.0))
        flight.calibrate_coils((2.0, 1.0, 1.0))
        flight.calibrate("gyro")
        flight.calibrate_coils((1.0, 1.0, 1.0))

    assert repr(looked(make, there_and_back)) == repr(looked(make))


def test_coils_are_driven_by_calibrated_commands_and_laws_know_what_comes_out(make):
    keys = {"spacecraft.coils": {"limit_a_m2": 3.0}}
    flights = [Flight(make(QUIET | keys), keeps_computer=True, laws={"a": looking}) for _ in "ab"]
    flights[1].calibrate_coils((2.0, 0.5, 1.25))
    for flight in flights:
        for _ in range(3):
            flight.read()
            flight.command(dipole_a_m2=(1.0, -1.0, 0.4))
    known = [flight.read().coil_dipole_body_a_m2 for flight in flights]
    assert known[0] == known[1] == pytest.approx((1.0, -1.0, 0.4))
    given = [flight.result().dipole_body.values[2] for flight in flights]
    assert given[1] == pytest.approx(given[0] * (2.0, 0.5, 1.25))
    assert np.array_equal(*(flight.result().command_body.values for flight in flights))


def test_coils_at_their_limit_make_less_than_laws_ask_for_and_these_know(make):
    keys = {"spacecraft.coils": {"limit_a_m2": 3.0, "saturation": "clip"}}
    flight = Flight(make(QUIET | keys), keeps_computer=True, laws={"a": looking})
    flight.calibrate_coils((2.0, 1.0, 1.0))
    for _ in range(2):
        flight.read()
        flight.command(dipole_a_m2=(2.0, 1.0, 0.0))
    assert flight.read().coil_dipole_body_a_m2 == pytest.approx((1.5, 1.0, 0.0))


@pytest.mark.parametrize(
    ("call", "arguments", "message"),
    [
        ("calibrate", ("mag",),
         "sensor: must be one of magnetometer, gyro, sun_sensors; received 'mag'"),
        ("calibrate", ("gyro", (1.0,)), "matrix: must be 9 finite numbers; received (1.0,)"),
        ("calibrate", ("gyro", (0.0,) * 9), "matrix: must have an inverse; received "),
        ("calibrate", ("gyro", MATRIX, (0.0, math.nan, 0.0)),
         "bias: must be 3 finite numbers; received "),
        ("calibrate_coils", ((1.0, 0.0, 1.0),), "factors: must be positive; received "),
        ("calibrate_tachometers", ((1.0,),),
         "calibrate_tachometers: must be left out for a satellite without wheels"),
        ("set_ephemeris", (), "set_ephemeris: must be left out where nothing needs an ephemeris"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_in_one_line(make, call, arguments, message):
    flight = Flight(make(QUIET), keeps_computer=True)
    if call == "calibrate" and arguments[0] == "gyro" and message.startswith(("bias", "matrix")):
        flight = Flight(make(QUIET), keeps_computer=True, laws={"a": looking})
    with pytest.raises(ValueError) as refused:
        getattr(flight, call)(*arguments)
    assert str(refused.value).startswith(message) and "\n" not in str(refused.value)
    with pytest.raises(ValueError, match="needs keeps_computer=True"):
        getattr(Flight(make(QUIET)), call)(*arguments)


def fly(flight, most=None):
    steps = 0
    while steps != most and flight.read() is not None:
        flight.command()
        steps += 1


def same(a, b):
    assert set(a.variables) == set(b.variables)
    for name in a.variables:
        x, y = a[name].values, b[name].values
        assert np.array_equal(x, y, equal_nan=x.dtype.kind == "f"), name
    return a.attrs["digest"] == b.attrs["digest"]


@pytest.mark.parametrize("pieces", [False, True])
def test_a_flight_told_its_orbit_goes_back_and_resumes_to_the_bit(monkeypatch, pieces):
    """From a snapshot, from a result in a new flight, by a plain run; through several tables."""
    if pieces:
        monkeypatch.setattr(size, "_PIECE_ROWS", 8)
    made = calm(600.0)
    flight = Flight(made, keeps_computer=True)
    fly(flight, 100)
    flight.set_ephemeris(flight.chosen_ephemeris(AHEAD))
    flight.calibrate("magnetometer", MATRIX, (1e-7, 0.0, 0.0))
    fly(flight, 130)
    flight.read()
    kept, middle = flight.snapshot(), flight.result()
    fly(flight)
    whole = flight.result()
    flight.restore(kept)
    fly(flight)
    assert same(flight.result(), whole)
    other = Flight(made, keeps_computer=True)
    other.resume(middle)
    fly(other)
    assert same(other.result(), whole)
    assert same(resume(middle), whole)
    assert not np.array_equal(simulate(made).omega_body.values, whole.omega_body.values)
    away = np.linalg.norm((whole.position_believed - whole.position_inertial).values, axis=1)
    t_s = whole.time.values
    assert away[t_s >= 100.0].min() > 300e3 and away[t_s < 100.0].max() < 1e-3


def test_a_result_whose_elements_were_changed_since_is_not_resumed():
    flight = Flight(calm(60.0), keeps_computer=True)
    flight.set_ephemeris(flight.chosen_ephemeris(AHEAD))
    fly(flight, 10)
    result = flight.result()
    result.attrs["uplinked"] = result.attrs["uplinked"].replace("88.6546", "88.6547")
    with pytest.raises(ValueError, match="have been changed since"):
        Flight(calm(60.0), keeps_computer=True).resume(result)


def test_models_that_do_not_hold_until_the_end_change_nothing():
    flight = Flight(calm(60.0), keeps_computer=True)
    fly(flight, 5)
    field = Igrf14(degree=5)
    with pytest.raises(ValueError):
        flight.set_ephemeris(EphemerisModels(orbit=OLD))
    assert not flight._run.uplinked
    flight.set_ephemeris(EphemerisModels(field=field))
    with pytest.raises(ValueError):
        flight.set_ephemeris(EphemerisModels(orbit=OLD))
    assert [each.models.field for each in flight._run.uplinked] == [field]
    flight.set_ephemeris(None)
    assert not flight._run.uplinked  # at the same control step: as if nothing had been sent


#: Elements of 1964, which say nothing of 2012.
OLD = Sgp4(tle=("1 00001U          64064.43873843  .00000000  00000-0  00000+0 0    03", TLE[1]))
TRUTH = OrbitEnvironment(Environment(field=Igrf14(degree=10)), Sgp4(tle=TLE), calm().start)


def test_choices_of_the_ground():
    """Each choice is the model that it names; what is not chosen stays as launched."""
    launched = EphemerisModels(along_track_error_m=5e3, clock_error_s=1.0)
    assert chosen_models(launched, TRUTH, None, Choice()) == launched
    told = chosen_models(launched, TRUTH, AHEAD, Choice())
    assert told == EphemerisModels(orbit=Sgp4(tle=AHEAD), clock_error_s=1.0)
    dipole = chosen_models(launched, TRUTH, None, Choice(dipole=True))
    assert dipole.field == TiltedDipole(source="igrf14") and dipole.along_track_error_m == 5e3
    assert chosen_models(launched, TRUTH, None, Choice(degree=3)).field == Igrf14(degree=3)
    kepler = chosen_models(launched, TRUTH, None, Choice(kepler=True)).orbit
    assert isinstance(kepler, Drifting)
    stays = chosen_models(launched, TRUTH, None, Choice(sun_inertial=(0.0, 2.0, 0.0)))
    assert stays.sun_direction == (0.0, 1.0, 0.0)
    own = EphemerisModels(field=DirectDipole())
    assert chosen_models(own, TRUTH, None, Choice(dipole=True)).field == DirectDipole()
    assert chosen_models(own, TRUTH, None, Choice(degree=2)).field == Igrf14(degree=2)


@pytest.mark.parametrize(
    ("launched", "choice"),
    [
        ({"field": {"kind": "averaged"}}, Choice(degree=3)),
        ({"field": {"kind": "averaged"}}, Choice(dipole=True)),
        ({"orbit": {"kind": "bench", "latitude_deg": 50.0}}, Choice(kepler=True)),
        ({"orbit": {"kind": "circular", "altitude_km": 500.0, "inclination_deg": 51.7}},
         Choice(kepler=True)),
    ],
)  # fmt: skip
def test_models_that_a_computer_does_not_have(launched, choice):
    with pytest.raises(NoSuchModel):
        chosen_models(EphemerisModels.model_validate(launched), TRUTH, None, choice)


@pytest.mark.parametrize("days", [-3.0, 0.0, 5.0])
def test_elements_adrift_stay_with_sgp4_for_days(days):
    """Without drag, at a start before or after the epoch: periodic terms of some 10 km are left."""
    start, t_s = calm().start + timedelta(days=days), np.linspace(0.0, 6000.0, 50)
    r, v = Sgp4(tle=TLE).state(t_s, start)
    own_r, own_v = adrift(Sgp4(tle=TLE), start).state(t_s, start)
    assert np.linalg.norm(own_r - r, axis=1).max() < 25e3
    assert np.linalg.norm(own_v - v, axis=1).max() < 30.0
