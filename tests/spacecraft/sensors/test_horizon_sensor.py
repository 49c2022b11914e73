"""The horizon sensor: field of view, noise, and where a horizon of uneven height has its centre."""

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from torquer.base import noise
from torquer.base.conventions import EARTH_RADIUS_M
from torquer.spacecraft.sensors.horizon_sensor import (
    IDEAL_HORIZON_SENSOR,
    STREAM,
    HorizonSensor,
    disc_centre,
    read_horizon,
)

AT_REST = (0.0, 0.0, 0.0)


def off_axis(axis, angle_deg):
    across = np.cross(axis, [0.3, -0.5, 0.8])
    return tuple(
        Rotation.from_rotvec(np.radians(angle_deg) * across / np.linalg.norm(across)).apply(axis)
    )


def test_an_ideal_sensor_reads_the_truth_in_all_directions():
    packed = HorizonSensor().pack()
    assert packed == IDEAL_HORIZON_SENSOR
    for v in np.eye(3):
        assert read_horizon(packed, AT_REST, tuple(-v), AT_REST) == pytest.approx(tuple(-v))


def test_earth_must_be_in_view_and_the_body_calm():
    axis = np.array([0.0, 0.6, 0.8])
    packed = HorizonSensor(axis=(0.0, 3.0, 4.0), half_field_deg=25.0, rate_limit_deg_s=2.0).pack()
    inside, outside = off_axis(axis, 24.9), off_axis(axis, 25.1)
    assert read_horizon(packed, AT_REST, inside, AT_REST) == pytest.approx(inside)
    assert read_horizon(packed, AT_REST, outside, AT_REST) == (0.0, 0.0, 0.0)
    for rate_deg_s, seen in ((1.99, True), (2.01, False)):
        read = read_horizon(packed, (0.0, 0.0, np.radians(rate_deg_s)), inside, AT_REST)
        assert any(read) == seen


def test_noise_and_mounting_error_have_their_sizes():
    packed = HorizonSensor(noise_deg=0.5, bias_deg=(1.0, 0.0, 0.0)).pack()
    nadir = np.array([0.0, 0.6, -0.8])
    found = np.array(
        [
            read_horizon(packed, AT_REST, tuple(nadir), noise.draw(1.0, 3, STREAM, i))
            for i in range(4000)
        ]
    )
    mean = Rotation.from_rotvec([np.radians(1.0), 0.0, 0.0]).apply(nadir)
    assert np.linalg.norm(found, axis=1) == pytest.approx(1.0)
    across = found @ np.array([[1.0, 0.0, 0.0], np.cross(mean, [1.0, 0.0, 0.0])]).T
    assert np.degrees(across.std(axis=0)) == pytest.approx([0.5, 0.5], rel=0.05)
    assert np.degrees(across.mean(axis=0)) == pytest.approx([0.0, 0.0], abs=0.03)


@pytest.mark.parametrize("latitude_deg", [0.0, 35.0, -70.0, 90.0])
def test_centre_is_that_of_cone_fitted_to_uneven_horizon(latitude_deg):
    """Limb points where the line of sight touches a sphere that is higher in the north."""
    higher_m, r_m, lat = 8e3, EARTH_RADIUS_M + 600e3, np.radians(latitude_deg)
    r = r_m * np.array([np.cos(lat), 0.0, np.sin(lat)])
    up, pole = r / r_m, np.array([0.0, 0.0, 1.0])
    side = np.array([0.0, 1.0, 0.0])
    central = np.arccos(EARTH_RADIUS_M / r_m)
    lines = []
    for angle in np.linspace(0.0, 2.0 * np.pi, 72, endpoint=False):
        along = np.cos(angle) * side + np.sin(angle) * np.cross(up, side)
        point = np.cos(central) * up + np.sin(central) * along
        elevated = (EARTH_RADIUS_M + higher_m * (point @ pole)) / r_m
        disc = np.arcsin(elevated)
        lines.append(-np.cos(disc) * up + np.sin(disc) * along)

    def spread(tilt):
        centre = -up + tilt[0] * side + tilt[1] * np.cross(up, side)
        angles = np.arccos(np.array(lines) @ (centre / np.linalg.norm(centre)))
        return angles - angles.mean()

    tilt = least_squares(spread, [0.0, 0.0], xtol=1e-15, ftol=1e-15, gtol=1e-15).x
    fitted = -up + tilt[0] * side + tilt[1] * np.cross(up, side)
    found = np.array(disc_centre(HorizonSensor(horizon_km=8.0).pack(), tuple(r)))
    off = np.linalg.norm(found - fitted / np.linalg.norm(fitted))
    assert off < 0.02 * higher_m / r_m
    assert found @ pole + up @ pole >= -1e-12  # to the north


def test_axis_and_field_belong_together():
    with pytest.raises(ValueError, match="half_field_deg: axis and half_field_deg must be"):
        HorizonSensor(axis=(0.0, 0.0, 1.0))
    with pytest.raises(ValueError, match="axis: axis and half_field_deg must be"):
        HorizonSensor(half_field_deg=30.0)
