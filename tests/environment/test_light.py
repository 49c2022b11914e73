"""Sunlight along an orbit: its pressure, and when the Earth's shadow changes it."""

from itertools import pairwise

import numpy as np
import pytest

from torquer.base.conventions import ASTRONOMICAL_UNIT_M, EARTH_RADIUS_M
from torquer.base.time import parse_utc
from torquer.environment import Environment, OrbitEnvironment
from torquer.environment.light import (
    Light,
    between_edges,
    light_along,
    light_at,
    next_edge,
    shadow_edges,
)
from torquer.environment.orbit import Circular
from torquer.environment.sun import find_shadow


def orbit_environment(eclipse="conical", **orbit):
    keys = {"altitude_km": 500.0, "inclination_deg": 51.6} | orbit
    start = parse_utc("2025-03-20T00:00:00Z", "start")
    environment = Environment(field={"kind": "averaged"}, eclipse=eclipse)
    return OrbitEnvironment(environment, Circular(**keys), start)


def tables_of(environment, duration_s):
    return environment.orbit_table(duration_s, 1.0).table, environment.sun_table(duration_s)


def edges(environment, duration_s):
    orbit, sun = tables_of(environment, duration_s)
    return shadow_edges(environment.shadow, orbit, sun, 0.0, duration_s, environment.orbit.period_s)


def test_pressure_at_one_astronomical_unit_and_twice_as_far():
    """1361 W/m^2 by the speed of light: 4.54 uN on a black square metre."""
    r = (EARTH_RADIUS_M + 5e5, 0.0, 0.0)
    for distance, expected in ((1.0, 4.5398e-6), (2.0, 4.5398e-6 / 4.0)):
        sun = (r[0] + distance * ASTRONOMICAL_UNIT_M, 0.0, 0.0)
        assert light_at(find_shadow(), r, sun) == pytest.approx((expected, 0.0, 0.0), rel=1e-4)
    behind = (-r[0], 0.0, 0.0)
    assert light_at(find_shadow(), behind, (ASTRONOMICAL_UNIT_M, 0.0, 0.0)) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(("eclipse", "each"), [("conical", 4), ("oblate", 4), ("cylindrical", 2)])
def test_edges_are_where_light_begins_to_change(eclipse, each):
    """Four a revolution, of umbra and penumbra; the light is of one kind between them."""
    environment = orbit_environment(eclipse)
    found = edges(environment, 3.0 * environment.orbit.period_s)
    assert len(found) == 3 * each
    lasted = np.diff(found)
    assert (lasted > 5.0).all() and (each == 2 or (lasted < 30.0).sum() == 6)
    kinds = []
    for edge, other in pairwise(found):
        t = np.linspace(edge, other, 202)[1:-1]
        sunlit_fraction = environment.sunlit_fraction(t, environment.state(t)[0])
        kinds.append({-1 if x == 0.0 else (1 if x == 1.0 else 0) for x in sunlit_fraction})
    assert all(len(kind) == 1 for kind in kinds)
    assert all(kind != other for kind, other in pairwise(kinds))


def test_without_a_shadow_there_are_no_edges():
    environment = orbit_environment("none")
    assert len(edges(environment, environment.orbit.period_s)) == 0
    polar = orbit_environment(inclination_deg=97.4, raan_deg=90.0)  # dawn to dusk
    assert len(edges(polar, polar.orbit.period_s)) == 0


def test_edges_of_a_later_piece_are_those_of_the_whole():
    environment = orbit_environment()
    whole = edges(environment, 2.0 * environment.orbit.period_s)
    start, duration = environment.orbit.period_s, environment.orbit.period_s
    orbit = environment.orbit_table(duration, 1.0, start).table
    sun = environment.sun_table(duration, start)
    later = shadow_edges(
        environment.shadow, orbit, sun, start, duration, environment.orbit.period_s
    )
    assert later == pytest.approx(whole[whole > start], abs=1e-4)


def test_the_next_edge_is_the_first_after_a_time():
    light = Light(None, None, np.array([10.0, 20.0, 35.0]))
    times = (0.0, 9.9, 10.0, 15.0, 34.9, 35.0, 50.0)
    assert [next_edge(light, t) for t in times] == [10, 10, 20, 20, 35, np.inf, np.inf]
    assert next_edge(Light(None, None, np.empty(0)), 3.0) == np.inf


@pytest.mark.parametrize("eclipse", ["conical", "cylindrical"])
def test_between_edges_the_light_is_kept_up_to_them(eclipse):
    environment = orbit_environment(eclipse)
    orbit, sun = tables_of(environment, environment.orbit.period_s)
    found = edges(environment, environment.orbit.period_s)
    light = Light(sun, environment.shadow, found)
    for early, late in pairwise(found):
        held = between_edges(light, orbit, 0.5 * (early + late))
        t = np.array([early, 0.5 * (early + late), late])
        r, s = environment.state(t)[0], environment.sun(t)
        pushes = np.linalg.norm(light_along(held.shadow, r, s), axis=1)
        if pushes[1] == 0.0 or pushes[1] > 4.3e-6:  # umbra, full sunlight
            assert pushes == pytest.approx([pushes[1]] * 3, rel=1e-3)
        else:
            assert held.shadow == light.shadow
