"""Fine Sun sensor: tangents in the head's frame, its square field, noise, quanta, mounting."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st
from scipy import stats
from scipy.spatial.transform import Rotation

from torquer.compile.when_compiling import plainly
from torquer.spacecraft.sensors.fine_sun_sensor import FineSunSensor, read_tangents

OFF = (0.0, 0.0, 0.0)
MANY = settings(max_examples=100, deadline=None)
#: A head whose frame is the body's.
PLAIN = {"boresight": (0.0, 0.0, 1.0), "up": (0.0, 1.0, 0.0), "half_field_deg": 60.0}
HEAD = {"boresight": (1.0, -2.0, 0.5), "up": (0.3, 0.2, 1.0), "half_field_deg": 60.0}
#: Chance that a right sensor fails a statistical test, on each side.
CHANCE = 1e-7

directions = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1)


def unit(v):
    return np.array(v) / np.linalg.norm(v)


def read(sun, sunlit_fraction=1.0, drawn=OFF, **keys):
    """A reading of a head; `sun`: of any length."""
    sensor = FineSunSensor(**PLAIN | keys).pack()
    return read_tangents(sensor, tuple(unit(sun).tolist()), sunlit_fraction, drawn)


def at(a_deg, b_deg):
    """A direction by its two angles in a head whose frame is the body's."""
    return math.tan(math.radians(a_deg)), math.tan(math.radians(b_deg)), 1.0


def test_readings_are_the_tangents_of_the_two_angles():
    assert read((0.0, 0.0, 1.0)) == (0.0, 0.0, 1.0)
    assert read(at(30.0, -45.0)) == pytest.approx((1.0 / math.sqrt(3.0), -1.0, 1.0), rel=1e-14)


def test_the_frame_is_right_handed_along_boresight_and_up():
    """Boresight along the body's x, up along its z: x of the head is the body's y."""
    keys = {"boresight": (2.0, 0.0, 0.0), "up": (0.0, 0.0, 0.5), "half_field_deg": 60.0}
    assert FineSunSensor(**keys).frame() == ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))
    assert read((1.0, 0.2, 0.0), **keys) == pytest.approx((0.2, 0.0, 1.0), abs=1e-15)
    assert read((1.0, 0.0, 0.3), **keys) == pytest.approx((0.0, 0.3, 1.0), abs=1e-15)


@MANY
@given(directions, directions)
def test_the_frame_is_one_of_any_boresight_and_up(boresight, up):
    assume(np.linalg.norm(np.cross(unit(boresight), unit(up))) > 0.02)
    rows = np.array(FineSunSensor(boresight=boresight, up=up, half_field_deg=60.0).frame())
    assert rows @ rows.T == pytest.approx(np.eye(3), abs=1e-14)
    assert np.linalg.det(rows) > 0.0 and rows[2] == pytest.approx(unit(boresight), abs=1e-15)
    assert rows[1] @ unit(up) > 0.0 and rows[0] @ unit(up) == pytest.approx(0.0, abs=1e-14)


@MANY
@given(directions, st.floats(1.0, 89.0))
def test_a_reading_gives_the_direction_back(sun, half):
    spec = FineSunSensor(**HEAD | {"half_field_deg": half})
    frame = np.array(spec.frame())
    reading = read_tangents(spec.pack(), tuple(unit(sun).tolist()), 1.0, OFF)
    x, y, z = frame @ unit(sun)
    angles = np.degrees([np.arctan2(abs(x), z), np.arctan2(abs(y), z)])  # above 90 deg behind it
    if np.abs(angles - half).min() > 1e-9:  # no rounding decides
        assert reading[2] == float(angles.max() < half)
    if reading[2] == 0.0:
        assert reading == OFF
    else:
        assert unit(np.array(reading) @ frame) == pytest.approx(unit(sun), abs=1e-14)


@pytest.mark.parametrize("half", [5.0, 45.0, 64.0, 85.0])
def test_the_field_is_a_square(half):
    """In its corners the Sun is farther from the boresight than on its sides."""
    inside, outside = half - 1e-7, half + 1e-7
    for a, b in ((inside, 0.0), (0.0, -inside), (inside, -inside), (-inside, inside)):
        assert read(at(a, b), half_field_deg=half)[2] == 1.0
    for a, b in ((outside, 0.0), (0.0, outside), (-outside, 1.0), (1.0, -outside)):
        assert read(at(a, b), half_field_deg=half) == OFF


def test_the_edge_of_the_field_belongs_to_it_and_no_direction_does_not():
    sensor = FineSunSensor(**PLAIN).pack()
    edge = math.tan(math.radians(60.0))
    for sun in ((edge, 0.0, 1.0), (0.0, -edge, 1.0)):
        assert read_tangents(sensor, sun, 1.0, OFF) == sun
    assert read_tangents(sensor, OFF, 1.0, OFF) == OFF


@MANY
@given(directions, st.floats(1.0, 89.9))
def test_nothing_behind_the_detector_is_seen(sun, half):
    behind = (sun[0], sun[1], -abs(sun[2]))
    assert read(behind, half_field_deg=half) == OFF


def test_half_of_the_disc_is_enough():
    for fraction, seen in ((1.0, 1.0), (0.5, 1.0), (0.49, 0.0), (0.0, 0.0)):
        assert read(at(10.0, 20.0), fraction)[2] == seen
    assert read(at(10.0, 20.0), 0.0) == OFF


def test_a_mounting_error_turns_the_reading():
    """+1 deg about the body's x takes a direction along z towards -y."""
    turned = read((0.0, 0.0, 1.0), bias_deg=(1.0, 0.0, 0.0))
    assert turned == pytest.approx((0.0, -math.tan(math.radians(1.0)), 1.0), abs=1e-15)
    bias, sun = (0.4, -0.3, 0.7), (-0.7, 1.9, -0.6)
    frame = np.array(FineSunSensor(**HEAD).frame())
    seen = frame @ Rotation.from_rotvec(np.radians(bias)).apply(unit(tuple(-x for x in sun)))
    reading = read(tuple(-x for x in sun), **HEAD, bias_deg=bias)
    assert reading == pytest.approx((seen[0] / seen[2], seen[1] / seen[2], 1.0), rel=1e-13)


def test_a_mounting_error_turns_the_field_as_well():
    bias = {"bias_deg": (1.0, 0.0, 0.0)}
    assert read(at(0.0, -58.5), **bias)[2] == 1.0 and read(at(0.0, -59.5), **bias) == OFF
    assert read(at(0.0, 60.5), **bias)[2] == 1.0 and read(at(0.0, 61.5), **bias) == OFF


def test_noise_is_that_of_each_tangent_over_the_whole_field():
    """Normal, of the size at the boresight, independent in both."""
    rng, count = np.random.default_rng(4), 2000
    for a, b in ((0.0, 0.0), (50.0, -40.0)):
        sensor = FineSunSensor(**PLAIN, noise_deg=0.02).pack()
        sun = tuple(unit(at(a, b)).tolist())
        drawn = [tuple(row) for row in rng.normal(size=(count, 3)).tolist()]
        readings = np.array([read_tangents(sensor, sun, 1.0, row) for row in drawn])
        errors = (readings[:, :2] - at(a, b)[:2]) / np.radians(0.02)
        low, high = stats.chi2.ppf([CHANCE, 1.0 - CHANCE], 2 * count) / (2 * count)
        assert low < np.mean(errors**2) < high
        limit = stats.norm.isf(CHANCE) / math.sqrt(count)
        assert np.abs(errors.mean(axis=0)).max() < limit
        assert abs(np.mean(errors[:, 0] * errors[:, 1])) < limit
        assert stats.kstest(errors[:, 1], "norm").pvalue > CHANCE
        assert (readings[:, 2] == 1.0).all()


@MANY
@given(st.floats(-59.0, 59.0), st.floats(-59.0, 59.0), st.floats(1e-3, 5.0), st.floats(-3.0, 3.0))
def test_readings_are_whole_quanta_within_the_field(a, b, quantum_deg, drawn):
    keys = {"quantum_deg": quantum_deg, "noise_deg": 0.5}
    quantum, limit = math.tan(math.radians(quantum_deg)), math.tan(math.radians(60.0))
    reading = np.array(read(at(a, b), drawn=(drawn, -drawn, 0.0), **keys)[:2])
    expected = np.add(at(a, b)[:2], math.radians(0.5) * drawn * np.array([1.0, -1.0]))
    assert np.abs(reading).max() <= limit
    inside = np.abs(reading) < limit
    counts = reading[inside] / quantum
    assert counts == pytest.approx(np.round(counts), abs=1e-9)
    assert np.abs(reading - expected)[inside] == pytest.approx(0.0, abs=0.5 * quantum + 1e-12)
    assert (np.abs(expected)[~inside] > limit - 0.5 * quantum - 1e-12).all()


def test_a_quantum_is_its_angle_at_the_boresight():
    seen = [read(at(a, 0.0), quantum_deg=0.5)[0] for a in (0.24, 0.26, 0.74)]
    assert np.degrees(np.arctan(seen)) == pytest.approx([0.0, 0.5, 0.5], abs=1e-12)


def test_compiled_and_plain_code_agree():
    spec = FineSunSensor(**HEAD, noise_deg=0.1, quantum_deg=0.01, bias_deg=(0.1, 0.2, -0.3))
    sun, drawn = tuple(unit((0.6, -0.7, 0.2)).tolist()), (0.3, -1.2, 0.5)
    compiled = read_tangents(spec.pack(), sun, 1.0, drawn)
    with plainly():
        plain = read_tangents(spec.pack(), sun, 1.0, drawn)
    assert compiled[2] == 1.0 and compiled == pytest.approx(plain, rel=1e-14)


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ({"boresight": (0.0, 0.0, 0.0)}, "boresight: must be non-zero vectors of 3 numbers"),
        ({"up": (0.0, 0.0, 0.0)}, "up: must be non-zero vectors of 3 numbers"),
        (
            {"up": (0.0, 0.0, -3.0)},
            r"up: must not be along boresight; received \(0.0, 0.0, -1.0\) for \(0.0, 0.0, 1.0\)",
        ),
        ({"up": (0.009, 0.0, 1.0)}, "up: must not be along boresight"),
        ({"half_field_deg": 0.0}, "greater than 0"),
        ({"half_field_deg": 90.0}, "less than 90"),
        ({"noise_deg": -1.0}, "greater than or equal to 0"),
        ({"quantum_deg": -1.0}, "greater than or equal to 0"),
        ({"quantum_deg": 90.0}, "less than 90"),
        ({"quantum_deg": 1e-13}, "must be at least 1e-12"),
        ({"bias_deg": (0.0, 0.0, float("nan"))}, "must be finite"),
        ({"delay_s": 1.0}, "sample_s: must be given with delay_s; received none"),
        ({"axis": (0.0, 0.0, 1.0)}, "must be a known key"),
        (
            {"failures": [{"kind": "reversed"}]},
            "kind: must be one of silent, stuck, zeros, nan, infinite; received 'reversed'",
        ),
    ],
)
def test_what_cannot_be_is_reported(keys, expected):
    with pytest.raises(ValueError, match=expected):
        FineSunSensor(**PLAIN | keys)


@pytest.mark.parametrize("key", ["boresight", "up", "half_field_deg"])
def test_what_must_be_given_is_asked_for(key):
    keys = {name: value for name, value in PLAIN.items() if name != key}
    with pytest.raises(ValueError, match=f"{key}: must be given"):
        FineSunSensor(**keys)
