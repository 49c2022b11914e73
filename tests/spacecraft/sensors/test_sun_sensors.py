"""Sun sensors as hardware: fields, blind zones, biases and the Earth's light, one by one."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from torquer import simulate
from torquer.environment.albedo import earthlight
from torquer.spacecraft.sensors.sun_sensor import SunSensors, read_sun, sensor_that_sees

OFF = (0.0, 0.0, 0.0)
SIX = tuple(tuple(sign * row for row in axis) for axis in np.eye(3).tolist() for sign in (1, -1))
directions = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1)


def unit(v):
    return np.array(v) / np.linalg.norm(v)


def angle_deg(a, b):
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), np.dot(a, b)))


def reading(sun, sunlit_fraction=1.0, light=OFF, drawn=OFF, **keys):
    return read_sun(
        SunSensors(**keys).pack(), tuple(unit(sun)), sunlit_fraction, tuple(light), drawn
    )


def seeing_by_words(spec, sun):
    """The sensors that see the Sun, as the docstring tells it."""
    found = []
    for k, (axis, half) in enumerate(zip(spec.axes, spec.half_fields_deg(), strict=True)):
        blind = any(
            k in zone.of(len(spec.axes)) and angle_deg(zone.axis, sun) < zone.half_angle_deg
            for zone in spec.blind_zones
        )
        if angle_deg(axis, sun) <= half and not blind:
            found.append((angle_deg(axis, sun), k))
    return min(found)[1] if found else -1


@settings(max_examples=200, deadline=None)
@given(directions, directions, st.floats(1.0, 90.0), st.floats(5.0, 120.0), st.booleans())
def test_the_sensor_that_reads_is_the_nearest_that_sees(sun, boom, shade, half, some):
    spec = SunSensors(
        axes=SIX,
        half_field_deg=(half, half, 0.5 * half, half, 1.2 * half, half),
        blind_zones=[{"axis": boom, "half_angle_deg": shade, "sensors": [0, 3] if some else None}],
    )
    fields = zip(SIX, spec.half_fields_deg(), strict=True)
    margins = [abs(angle_deg(axis, unit(sun)) - field) for axis, field in fields]
    margins += [abs(angle_deg(boom, unit(sun)) - shade)]
    angles = sorted(angle_deg(axis, unit(sun)) for axis in SIX)
    if min([*margins, *np.diff(angles)]) > 1e-6:  # no rounding decides
        expected = seeing_by_words(spec, unit(sun))
        assert sensor_that_sees(spec.pack(), tuple(unit(sun))) == expected


def test_each_sensor_has_its_own_field():
    keys = {"axes": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), "half_field_deg": (10.0, 60.0)}
    at = np.radians(50.0)
    sun = (np.cos(at), np.sin(at), 0.0)  # 50 deg from the first, 40 from the second
    assert reading(sun, **keys) == pytest.approx(sun, abs=1e-15)
    assert reading(sun, **keys | {"half_field_deg": (60.0, 10.0)}) == pytest.approx(sun, abs=1e-15)
    assert reading(sun, **keys | {"half_field_deg": (10.0, 10.0)}) == OFF


def test_a_boom_shades_the_sensors_that_it_is_said_to():
    zone = {"axis": (0.0, 0.0, 2.0), "half_angle_deg": 10.0}
    keys = {"axes": ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0)), "half_field_deg": 100.0}
    up, beside = (0.0, 0.0, 1.0), (np.sin(np.radians(10.1)), 0.0, np.cos(np.radians(10.1)))
    assert reading(up, **keys, blind_zones=[zone]) == OFF
    assert reading(beside, **keys, blind_zones=[zone]) == pytest.approx(beside, abs=1e-15)
    # the second sensor, 90 deg off, looks past the boom
    spec = SunSensors(**keys, blind_zones=[zone | {"sensors": [0]}])
    assert sensor_that_sees(spec.pack(), up) == 1


def test_a_bias_turns_the_reading_of_the_sensor_that_reads():
    keys = {"axes": ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0)), "half_field_deg": 60.0}
    biases = ((0.1, -0.2, 0.3), (0.0, 0.5, 0.0))
    for sun, turn in (((0.1, 0.0, 1.0), biases[0]), ((1.0, 0.1, 0.2), biases[1])):
        expected = Rotation.from_rotvec(np.radians(turn)).apply(unit(sun))
        assert reading(sun, **keys, bias_deg=biases) == pytest.approx(expected, abs=1e-15)
        assert reading(sun, **keys, bias_deg=turn) == pytest.approx(expected, abs=1e-15)
        noisy = reading(sun, **keys, bias_deg=turn, noise_deg=1.0, drawn=(0.3, -0.4, 0.5))
        apart = expected + np.radians(1.0) * np.array([0.3, -0.4, 0.5])
        assert noisy == pytest.approx(unit(apart), abs=1e-15)


@settings(max_examples=50, deadline=None)
@given(directions, directions)
def test_with_albedo_readings_are_those_of_six_cosine_detectors(sun, up):
    """Each measures sunlight and the light of the Earth, pairs on opposite sides by turns."""
    sun, up = unit(sun), unit(up)
    of_earth = np.array(earthlight(0.3, tuple(6.9e6 * up), tuple(sun)))
    detectors = np.array(SIX)
    flux = np.maximum(detectors @ sun, 0.0) + np.maximum(detectors @ of_earth, 0.0)
    found = reading(sun, light=of_earth, axes=SIX, half_field_deg=90.0, albedo=0.3)
    assert found == pytest.approx(unit(flux @ detectors), abs=1e-14)


def test_without_albedo_the_earth_does_not_matter():
    keys = {"axes": SIX, "half_field_deg": 90.0}
    assert reading((0.0, 0.6, 0.8), light=(-0.2, 0.0, 0.0), **keys) == (0.0, 0.6, 0.8)


def test_in_flight_readings_err_towards_the_lit_earth(make):
    """By up to a dozen degrees, on the day side alone: compared with the model, row by row."""
    keys = {
        "spacecraft.sun_sensors": {"axes": SIX, "half_field_deg": 90.0, "albedo": 0.3},
        "simulation": {"revolutions": 1.0, "record_s": 20.0, "step_s": 5.0},
        "control": {"law": {"kind": "off"}, "sample_s": 20.0},
        "initial.rate_deg_s": [0.05, 0.02, -0.03],
    }
    result = simulate(make(keys)).isel(time=slice(0, -1))
    sunlit_fraction = result.sunlit_fraction.values > 0.5
    true, r = (
        result.sun_inertial.values[sunlit_fraction],
        result.position_inertial.values[sunlit_fraction],
    )
    to_inertial = Rotation.from_quat(result.q_body_to_inertial.values[sunlit_fraction])
    read = to_inertial.apply(result.sun_measured.values[sunlit_fraction])
    light = np.array([earthlight(0.3, tuple(a), tuple(b)) for a, b in zip(r, true, strict=True)])
    expected = true + light
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    assert np.abs(read - expected).max() < 1e-8
    error = np.array([angle_deg(a, b) for a, b in zip(read, true, strict=True)])
    assert 5.0 < error.max() < 20.0 and error.min() < 1.0


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ({"half_field_deg": (10.0, 20.0)}, r"half_field_deg: must be one number or one per sensor"),
        ({"half_field_deg": (10.0, 20.0, 0.0)}, "greater than 0"),
        ({"bias_deg": ((0.1, 0.0, 0.0),)}, r"bias_deg: must be one vector or one per sensor \(3"),
        ({"bias_deg": ()}, r"bias_deg: must be one vector or one per sensor \(3"),
        ({"albedo": 1.1}, "less than or equal to 1"),
        (
            {"blind_zones": [{"axis": (0, 0, 1), "half_angle_deg": 5, "sensors": [3]}]},
            r"blind_zones\[0\].sensors: must be numbers of sensors, 0 to 2; received 3",
        ),
        ({"blind_zones": [{"axis": (0, 0, 0), "half_angle_deg": 5}]}, "axis: must be non-zero"),
        ({"blind_zones": [{"axis": (0, 0, 1)}]}, "half_angle_deg"),
    ],
)
def test_what_cannot_be_is_reported(keys, expected):
    with pytest.raises(ValueError, match=expected):
        SunSensors(**{"axes": np.eye(3).tolist(), "half_field_deg": 60.0} | keys)
