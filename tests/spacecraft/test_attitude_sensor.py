"""The attitude sensor: what it adds is the stated turn, and noise of the stated size."""

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.spatial.transform import Rotation

from torquer import noise
from torquer.spacecraft.attitude_sensor import STREAM, AttitudeSensor, read_attitude

Q = tuple(Rotation.from_euler("xyz", [0.3, -0.8, 1.9]).as_quat())


def read(packed, sample):
    return read_attitude(packed, Q, noise.drawn(packed.noise_rad, 7, STREAM, sample))


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
    with pytest.raises(ValidationError, match="noise_deg"):
        AttitudeSensor(noise_deg=-1.0)
