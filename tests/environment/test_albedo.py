"""Sunlight that the Earth reflects: against the integral over its surface, and its limits."""

import math

import numpy as np
import pytest

from torquer.base.conventions import EARTH_RADIUS_M
from torquer.environment.albedo import earthlight


def by_the_surface(albedo, r, to_sun, rings=700):
    """Light of all lit ground in sight, spot by spot: albedo/pi cos cos/d^2 (Lambert's law).

    The rings about the satellite's nadir are narrow near it, where the ground is close.
    """
    up = r / np.linalg.norm(r)
    east = np.cross(up, [0.3, -0.5, 0.8])
    east /= np.linalg.norm(east)
    edge = math.acos(EARTH_RADIUS_M / np.linalg.norm(r))
    parts = (np.arange(rings) + 0.5) / rings
    angle, width = edge * parts**2, 2.0 * edge * parts / rings
    azimuth = (np.arange(360) + 0.5) * 2.0 * np.pi / 360
    a, z = np.meshgrid(angle, azimuth, indexing="ij")
    normal = (
        np.cos(a)[..., None] * up
        + (np.sin(a) * np.cos(z))[..., None] * east
        + (np.sin(a) * np.sin(z))[..., None] * np.cross(up, east)
    )
    way = r - EARTH_RADIUS_M * normal
    far = np.linalg.norm(way, axis=-1)
    way /= far[..., None]
    seen = np.maximum(np.sum(normal * way, axis=-1), 0.0)
    sunlit_fraction = np.maximum(normal @ to_sun, 0.0)
    area = EARTH_RADIUS_M**2 * np.sin(a) * width[:, None] * 2.0 * np.pi / 360
    return -np.sum(
        (albedo / np.pi * seen * sunlit_fraction / far**2 * area)[..., None] * way, axis=(0, 1)
    )


@pytest.mark.parametrize("height_km", [300.0, 800.0, 36000.0])
@pytest.mark.parametrize("angle_deg", [0.0, 40.0, 75.0, 90.0, 100.0, 150.0])
def test_light_is_that_of_all_lit_ground_in_sight(height_km, angle_deg):
    up = np.array([0.48, -0.6, 0.64])
    across = np.cross(up, [0.0, 0.6, 0.8])
    across /= np.linalg.norm(across)
    angle = math.radians(angle_deg)
    to_sun = math.cos(angle) * up + math.sin(angle) * across
    r = (EARTH_RADIUS_M + 1e3 * height_km) * up
    found = np.array(earthlight(0.3, tuple(r), tuple(to_sun)))
    most = np.linalg.norm(by_the_surface(0.3, r, up))
    assert found == pytest.approx(by_the_surface(0.3, r, to_sun), abs=2e-3 * most)


def test_close_to_the_ground_all_light_comes_from_below():
    """Under the Sun a Lambertian plane sends back its albedo."""
    r = (EARTH_RADIUS_M + 1.0, 0.0, 0.0)
    assert earthlight(0.4, r, (1.0, 0.0, 0.0)) == pytest.approx((-0.4, 0.0, 0.0), rel=1e-3)
    assert earthlight(0.4, r, (-1.0, 0.0, 0.0)) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("phase_deg", [0.0, 60.0, 120.0])
def test_far_away_the_earth_is_lamberts_sphere(phase_deg):
    """Its light: 2/3 albedo (R/r)^2 (sin a + (pi - a) cos a)/pi at the phase angle a."""
    a, far = math.radians(phase_deg), 1e4 * EARTH_RADIUS_M
    light = earthlight(0.3, (far, 0.0, 0.0), (math.cos(a), 0.0, math.sin(a)))
    sphere = 0.2e-8 * (math.sin(a) + (math.pi - a) * math.cos(a)) / math.pi
    assert light[0] == pytest.approx(-sphere, rel=5e-3)
    assert abs(light[2]) < 1e-3 * sphere


def test_without_albedo_there_is_none():
    assert earthlight(0.0, (7e6, 0.0, 0.0), (1.0, 0.0, 0.0)) == (0.0, 0.0, 0.0)
