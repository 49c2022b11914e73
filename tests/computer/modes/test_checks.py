"""The checks of sensors and coils reading by reading, on a body that turns at a constant rate."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from slow_cases import slow_after

from torquer.compile import engine
from torquer.computer import computer
from torquer.computer.blocks import plugin
from torquer.computer.interface import (
    ATTITUDE_SENSOR,
    GYRO,
    MAGNETOMETER,
    SENSORS,
    SUN_SENSORS,
    nothing_known,
)
from torquer.computer.modes.coil_check import (
    add_impulse,
    correct,
    first_coils,
    has_field_reversed,
)
from torquer.computer.modes.sensor_check import ANGLE, SUN_TURN
from torquer.computer.modes.spec import Modes
from torquer.computer.modes.table import CHECKS_NOW
from torquer.spacecraft.sensors.device import MOST_UNITS

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="a kernel called a thousand times")

NOISE = {
    "magnetometer_noise_nt": 100,
    "sun_noise_deg": 0.2,
    "gyro_noise_deg_s": 0.02,
    "rate_tolerance_deg_s": 0.06,
}
FIELD_T, SUN = np.array([2.5e-5, 1.2e-5, -2e-5]), np.array([0.6, 0.0, 0.8])
RATE_DEG_S = (1.5, -2.0, 1.8)
XYZ = "xyz"


def put(known, name, values):
    for component, value in zip(XYZ, values, strict=True):
        known[f"{name}_{component}"] = value


class Flight:
    """A body that turns, what its sensors read, and what the checks make of it."""

    def __init__(self, rate_deg_s=RATE_DEG_S, oldest_s=None, **noise):
        modes = Modes.model_validate({
            "noise": NOISE | noise, "inertia_kg_m2": (1.4, 1.4, 1.4),
            "states": {"idle": {"final": True}},
        })  # fmt: skip
        self.table, self.state = modes.pack({})
        if oldest_s is not None:
            self.table = self.table._replace(oldest_s=tuple(map(float, oldest_s)))
        self.known, self.t_s, self.rng = nothing_known(), 0.0, np.random.default_rng(1)
        self.omega = np.radians(rate_deg_s)
        self.check = plugin.first_class(
            computer._check, computer.switch_signature(), "must"
        ).compiled

    @property
    def to_body(self):
        return Rotation.from_rotvec(self.omega * self.t_s).inv()

    def fly(self, seconds, umbra=False, every=None, dipole=(0.0, 0.0, 0.0), **readings):
        """Steps of one second; `readings`: functions of a sound reading, by sensor, for wrong ones.

        `every`: intervals of the readings [s] by sensor, 1 unless given; 0: silent.
        """
        every = dict.fromkeys(("magnetometer", "gyro", "sun_sensors"), 1) | (every or {})
        for _ in range(seconds):
            k, t = self.known[0], self.t_s
            k["t_s"] = t
            sound = {
                "magnetometer": self.to_body.apply(FIELD_T) + 2e-8 * self.rng.normal(size=3),
                "gyro": self.omega + np.radians(0.003) * self.rng.normal(size=3),
                "sun_sensors": np.zeros(3) if umbra else self.to_body.apply(self.sun_read()),
            }
            for sensor, reading in sound.items():
                if every[sensor] and t % every[sensor] == 0:
                    number = SENSORS.index(sensor)
                    k["readings"][number, :3] = readings.get(sensor, lambda v: v)(reading)
                    k["read_s"][number] = t
            put(k, "coils", dipole)
            put(k, "model_b", FIELD_T)
            put(k, "model_b_rate", (0.0, 0.0, 0.0))
            put(k, "to_sun", SUN)
            k["sunlit_fraction"] = 0.0 if umbra else 1.0
            self.check(self.table, self.state, self.known)
            self.t_s += 1.0

    def sun_read(self):
        return Rotation.from_rotvec(np.radians(0.05) * self.rng.normal(size=3)).apply(SUN)

    @property
    def now(self):
        return self.state.checks[0]

    def suspected_since_s(self, sensor):
        """How long ago there was the last sign against a sensor."""
        last = max(self.state.sensors[sensor][name] for name in ("failed_s", "blamed_s"))
        return self.t_s - 1.0 - last


def swapped(v):
    return v[[0, 2, 1]]


def test_recovered_gyro_is_not_suspected_throughout_the_umbra():
    """The Sun's turn contradicted it last; what is not seen any more blames nobody."""
    flight = Flight()
    flight.fly(300)
    assert flight.suspected_since_s(GYRO) == np.inf
    flight.fly(120, gyro=lambda v: v + np.radians([0.0, 0.5, 0.0]))
    assert flight.suspected_since_s(GYRO) == 0.0 and flight.now["failed_for_s"][SUN_TURN] > 20.0
    flight.fly(300, umbra=True)
    assert flight.suspected_since_s(GYRO) > 180.0


def test_sun_sensors_are_suspected_only_while_seeing_sun_in_umbra():
    flight = Flight()
    flight.fly(60)
    flight.fly(60, umbra=True, sun_sensors=lambda v: flight.to_body.apply(flight.sun_read()))
    assert flight.suspected_since_s(SUN_SENSORS) == 0.0
    flight.fly(300, umbra=True)
    assert flight.suspected_since_s(SUN_SENSORS) > 180.0


def test_magnetometer_found_bad_in_sunlight_is_unused_in_umbra():
    """Its turn there is not the gyro's fault, nor is it sound because no Sun contradicts it. It is
    forgotten after four hours without a Sun."""
    flight = Flight()
    flight.fly(200, magnetometer=swapped)
    assert flight.now["liar"] == 2.0 and flight.suspected_since_s(MAGNETOMETER) == 0.0
    flight.fly(600, umbra=True, magnetometer=swapped)
    assert flight.suspected_since_s(MAGNETOMETER) == 0.0
    assert flight.suspected_since_s(GYRO) > 600.0
    flight.now["liar_s"] -= 14400.0
    flight.fly(200, umbra=True)
    assert flight.suspected_since_s(MAGNETOMETER) > 120.0


def test_wrong_sun_sensors_do_not_incriminate_gyro_between_field_readings():
    flight = Flight()
    flight.fly(200, every={"magnetometer": 3}, sun_sensors=swapped)
    assert flight.suspected_since_s(SUN_SENSORS) == 0.0 and flight.now["liar"] == -2.0
    assert flight.suspected_since_s(GYRO) > 100.0


def test_coil_findings_from_a_wrong_field_are_forgotten():
    """And nothing is learned before it has been sound for half an hour."""
    flight = Flight()
    flight.fly(200, dipole=(1.0, -1.0, 1.0))
    assert np.abs(flight.now["effect"][:3] - 1.0).max() > 0.1  # they do nothing
    flight.fly(200, dipole=(1.0, -1.0, 1.0), magnetometer=swapped)
    assert flight.now["liar"] == 2.0
    assert flight.now["effect"].tolist() == [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]
    flight.fly(200, dipole=(1.0, -1.0, 1.0))
    assert flight.now["failed_for_s"][ANGLE] == 0.0
    assert flight.now["effect"].tolist() == [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]
    flight.fly(2000, dipole=(1.0, -1.0, 1.0))
    assert np.abs(flight.now["effect"][:3] - 1.0).max() > 0.1


@pytest.mark.parametrize("sensor", ["magnetometer", "gyro"])
def test_torques_are_those_of_the_present_between_two_readings(sensor):
    """The lever e_i x B in axes that do not turn; the body turns by 27 deg between the readings."""
    flight = Flight()
    flight.fly(120, every={sensor: 9})
    flight.t_s -= 1.0
    axes = flight.to_body.inv().apply(np.eye(3))
    expected = np.cross(axes, FIELD_T)
    assert flight.now["lever_s"] == flight.t_s
    assert np.abs(flight.now["lever"] - expected).max() < 0.02 * np.linalg.norm(FIELD_T)


def oldest(**ages_s):
    return [ages_s.get(name, 1.0) for name in SENSORS] + [1.0] * MOST_UNITS


def test_a_sensor_is_silent_by_its_timetable():
    """Coils that act for a minute silence the magnetometer in every cycle."""
    flight = Flight(oldest_s=oldest(magnetometer=60.0))
    flight.fly(600, every={"magnetometer": 60})
    assert flight.suspected_since_s(MAGNETOMETER) == np.inf
    flight.fly(300, every={"magnetometer": 0})
    assert flight.suspected_since_s(MAGNETOMETER) == 0.0


def test_one_long_gap_does_not_hide_the_next():
    flight = Flight(oldest_s=oldest())
    flight.fly(100)
    flight.fly(200, every={"magnetometer": 0})
    flight.fly(1)
    last_s = flight.t_s - 1.0
    flight.fly(35, every={"magnetometer": 0})
    assert last_s + 30.0 < flight.state.sensors["failed_s"][MAGNETOMETER] == flight.t_s - 1.0


def test_blinded_star_tracker_is_not_suspected_but_infinite_reading_is():
    flight, nothing = Flight(), (np.nan, np.nan, np.nan, np.nan)
    for value in nothing * 25:
        flight.known["read_s"][0, ATTITUDE_SENSOR] = flight.t_s
        flight.known["readings"][0, ATTITUDE_SENSOR, :4] = value
        flight.fly(1)
    assert flight.suspected_since_s(ATTITUDE_SENSOR) == np.inf
    flight.known["read_s"][0, ATTITUDE_SENSOR] = flight.t_s
    flight.known["readings"][0, ATTITUDE_SENSOR, :4] = (0.0, 0.0, 0.0, np.inf)
    flight.fly(1)
    assert flight.suspected_since_s(ATTITUDE_SENSOR) == 0.0


def test_noise_of_a_slow_gyro_adds_up_over_its_interval():
    """An error of a reading acts for ten seconds: ten times the variance of one of a second."""
    noise = {"gyro_noise_deg_s": 0.2, "rate_tolerance_deg_s": 0.001, "sun_noise_deg": 0.1}
    flight, rng = Flight(rate_deg_s=(0.1, 0.3, 0.2), **noise), np.random.default_rng(3)
    flight.fly(3000, every={"gyro": 10}, gyro=lambda v: v + np.radians(0.2) * rng.normal(size=3))
    assert flight.suspected_since_s(GYRO) == np.inf
    assert abs(flight.now["gyro_interval_s"] - 10.0) < 1e-9


def learned(share, count, uncertain):
    """The noise that is learned from so many equations, of a share of the assumed variance."""
    checks = np.zeros(1, CHECKS_NOW)
    first_coils(checks)
    now, rng, found = engine.with_attributes(checks)[0], np.random.default_rng(5), []
    x = np.array([0.7, 1.3, 0.5, 0.4, -0.6, 0.2]) if uncertain else np.array([1.0] * 3 + [0.0] * 3)
    now.covariance[:] = np.diag([1.0 if uncertain else 1e-6] * 6)
    for _ in range(count):
        row = 3.0 * rng.normal(size=6)
        y = row @ x + np.sqrt(share) * rng.normal()
        correct.py_func(now, row, y, 1.0)
        found.append(float(now.noise))
    return np.array(found)


@pytest.mark.parametrize("share", slow_after(1, [0.9, 0.25]))
@pytest.mark.parametrize("uncertain", [False, True])
def test_the_noise_of_the_coil_check_is_learned_without_bias(share, uncertain):
    """Also while the effects are still uncertain, when innovations say little about the noise."""
    found = learned(share, 3000, uncertain)
    assert abs(found[500:].mean() - min(share, 1.0)) < 0.1 * share
    assert found[:50].min() > 0.5 * share


def test_an_impulse_is_the_torque_times_its_time():
    """Of a field at rest in the body: m x b for two seconds by the dipole, b across each axis."""
    checks = np.zeros(1, CHECKS_NOW)
    first_coils(checks)
    now, dipole = engine.with_attributes(checks)[0], np.array([0.1, -0.2, 0.3])
    now.q[3], now.lever_s = 1.0, 8.0
    for t_s in (10.0, 12.0):
        now.gyro_s, now.impulse[:] = t_s, 0.0
        read_at = SimpleNamespace(magnetometer_s=t_s)
        field, coils = tuple(FIELD_T), tuple(dipole)
        inputs = SimpleNamespace(
            t_s=t_s, read_at=read_at, b_body_t=field, coil_dipole_body_a_m2=coils
        )
        add_impulse.py_func(now, inputs)
    levers = np.cross(np.eye(3), FIELD_T).T
    assert now.impulse[:, :3] == pytest.approx(2.0 * levers * dipole, rel=1e-12)
    assert now.impulse[:, 3:] == pytest.approx(2.0 * levers, rel=1e-12)


@pytest.mark.parametrize(("effect", "known"), [(1.0, -1.0), (-1.0, 1.0), (0.0, 0.0), (0.01, 0.0)])
def test_a_field_is_reversed_or_not_only_beyond_the_uncertainty(effect, known):
    checks = np.zeros(1, CHECKS_NOW)
    now = engine.with_attributes(checks)[0]
    now.effect[:], now.covariance[:] = effect, 1e-4 * np.eye(6)
    assert has_field_reversed.py_func(now) == known
