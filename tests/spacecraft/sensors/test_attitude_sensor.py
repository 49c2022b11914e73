"""The attitude sensor: what it adds is the stated turn, and noise of the stated size."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from torquer.base import noise
from torquer.base.conventions import EARTH_RADIUS_M
from torquer.spacecraft.sensors.attitude_sensor import (
    STREAM,
    AttitudeSensor,
    earth_cosine,
    is_blind,
    read_attitude,
)

Q = tuple(Rotation.from_euler("xyz", [0.3, -0.8, 1.9]).as_quat())


def read(packed, sample):
    drawn = noise.draw(1.0 if packed.noise_rad else 0.0, 7, STREAM, sample)
    return read_attitude(packed, Q, drawn)


def turns(sensor, n=4000):
    """Rotation vectors [deg], in body axes, from the true to the measured attitude."""
    packed = sensor.pack()
    read_many = Rotation.from_quat([read(packed, i) for i in range(n)])
    return np.degrees((Rotation.from_quat(Q).inv() * read_many).as_rotvec())


def test_an_ideal_sensor_reads_the_truth():
    assert read(AttitudeSensor().pack(), 5) == Q


def test_a_fixed_error_is_that_turn_about_the_body_axes():
    found = turns(AttitudeSensor(error_deg=(1.0, -2.0, 0.5)), 2)
    assert found == pytest.approx(np.array([[1.0, -2.0, 0.5]] * 2), abs=1e-12)


def test_noise_has_its_size_about_every_axis_and_no_mean():
    found = turns(AttitudeSensor(noise_deg=2.0))
    assert found.std(axis=0) == pytest.approx(np.full(3, 2.0), rel=0.05)
    assert found.mean(axis=0) == pytest.approx(np.zeros(3), abs=4 * 2.0 / np.sqrt(4000))
    assert np.abs(np.corrcoef(found.T) - np.eye(3)).max() < 0.06


def test_negative_noise_is_refused():
    with pytest.raises(ValueError, match="noise_deg"):
        AttitudeSensor(noise_deg=-1.0)


TRACKER = AttitudeSensor(
    boresight=(0.0, 3.0, 4.0),
    noise_deg=0.5,
    boresight_noise_deg=2.0,
    sun_exclusion_deg=30.0,
    moon_exclusion_deg=12.0,
    earth_exclusion_deg=20.0,
    rate_limit_deg_s=1.0,
)
AXIS = np.array([0.0, 0.6, 0.8])


def test_noise_differs_about_the_boresight():
    found = turns(TRACKER)
    along = found @ AXIS
    assert along.std() == pytest.approx(2.0, rel=0.05)
    across = found - np.outer(along, AXIS)
    assert np.sqrt(np.mean(np.sum(across**2, axis=1)) / 2.0) == pytest.approx(0.5, rel=0.05)


def off_axis(angle_deg):
    """A direction at an angle from the boresight."""
    return tuple(Rotation.from_rotvec([np.radians(angle_deg), 0, 0]).apply(AXIS))


def blind(omega=(0.0, 0.0, 0.0), sun_deg=90.0, moon_deg=90.0, nadir_deg=180.0, altitude_m=600e3):
    packed = TRACKER.pack()
    cosine = earth_cosine(packed, EARTH_RADIUS_M + altitude_m)
    sun, moon, nadir = map(off_axis, (sun_deg, moon_deg, nadir_deg))
    return is_blind(packed, omega, sun, moon, nadir, cosine)


def test_sun_moon_earth_and_its_own_rate_blind_a_tracker():
    assert not blind()
    assert blind(sun_deg=29.9) and not blind(sun_deg=30.1)
    assert blind(moon_deg=11.9) and not blind(moon_deg=12.1)
    limb_deg = np.degrees(np.arcsin(EARTH_RADIUS_M / (EARTH_RADIUS_M + 600e3)))
    assert blind(nadir_deg=limb_deg + 19.9) and not blind(nadir_deg=limb_deg + 20.1)
    one = np.radians(1.0)
    assert blind((0.0, 1.001 * one, 0.0)) and not blind((0.0, 0.999 * one, 0.0))


def test_without_limits_nothing_blinds():
    packed = AttitudeSensor(boresight=(0.0, 0.0, 1.0)).pack()
    assert not is_blind(packed, (9.0, 0.0, 0.0), *[(0.0, 0.0, 1.0)] * 3, 2.0)
    assert earth_cosine(packed, 7e6) > 1.0


@pytest.mark.parametrize(
    "key",
    ["boresight_noise_deg", "sun_exclusion_deg", "moon_exclusion_deg", "earth_exclusion_deg"],
)
def test_what_refers_to_a_boresight_needs_one(key):
    with pytest.raises(ValueError, match=f"{key}: must be left out without boresight"):
        AttitudeSensor(**{key: 5.0})


def test_a_boresight_has_a_direction():
    with pytest.raises(ValueError, match="boresight"):
        AttitudeSensor(boresight=(0.0, 0.0, 0.0))
