"""The shadow of the ellipsoid: against rays traced through it, ray by ray; and the Sun sensors."""

import numpy as np
import pytest

from torquer.base.conventions import EARTH_FLATTENING, EARTH_RADIUS_M, SUN_RADIUS_M
from torquer.base.time import parse_utc
from torquer.environment import sun
from torquer.environment.along_orbit import Environment, OrbitEnvironment
from torquer.environment.orbit import Circular
from torquer.scenario.spec import Scenario
from torquer.simulation.setup.simulate import simulate

POLAR_RADIUS_M = EARTH_RADIUS_M * (1.0 - EARTH_FLATTENING)
RIM = np.linspace(0.0, 2.0 * np.pi, 720, endpoint=False)


def met(orbit, start, eclipse):
    return OrbitEnvironment(Environment(eclipse=eclipse), orbit, parse_utc(start))


def stopped(r, rays, pole):
    """Whether the ellipsoid stops rays [n, 3] that leave r: the discriminant of where they meet."""

    def form(x, y):
        return np.sum(x * y, axis=-1) / EARTH_RADIUS_M**2 + (x @ pole) * (y @ pole) * (
            POLAR_RADIUS_M**-2 - EARTH_RADIUS_M**-2
        )

    ahead = form(rays, r)
    return (ahead < 0.0) & (ahead**2 > form(rays, rays) * (form(r, r) - 1.0))


def rays_to_sun(r, s, part=1.0, turn=RIM):
    """Rays from r to points of the Sun's disc at parts of its radius; the first to its centre."""
    far = np.linalg.norm(s - r)
    w = (s - r) / far
    u = np.cross(w, (0.0, 0.0, 1.0))
    u /= np.linalg.norm(u)
    size = np.arcsin(SUN_RADIUS_M / far) * np.broadcast_to(part, turn.shape)[:, None]
    across = np.cos(turn)[:, None] * u + np.sin(turn)[:, None] * np.cross(w, u)
    return np.vstack([w, np.cos(size) * w + np.sin(size) * across])


#: When a contact happens: the share of rays (the first is that to the Sun's centre) that must be
#: stopped, and the lit fraction that says so.
CONTACTS = {
    "penumbra": (lambda hit: hit.any(), lambda sunlit_fraction: sunlit_fraction < 1.0),
    "half": (lambda hit: hit[0], lambda sunlit_fraction: sunlit_fraction < 0.5),
    "umbra": (lambda hit: hit.all(), lambda sunlit_fraction: sunlit_fraction < 1e-12),
}


def changes(state, times):
    """Times [s] at which a yes or no along the times changes, to a microsecond."""
    answers = [bool(state(t)) for t in times]
    found = []
    for k in np.flatnonzero(np.diff(answers)):
        low, high = times[k], times[k + 1]
        while high - low > 1e-6:
            middle = 0.5 * (low + high)
            low, high = (middle, high) if state(middle) == answers[k] else (low, middle)
        found.append(low)
    return np.array(found)


def contact_errors(orbit, start, contact):
    """Errors [s] of the contacts of a revolution by the sphere and by the ellipsoid."""
    by_rays, by_fraction = CONTACTS[contact]
    environment = met(orbit, start, "oblate")
    s, pole = environment.sun(np.zeros(1))[0], environment.dcm_to_ecef(np.zeros(1))[0, 2]
    times = np.arange(0.0, orbit.period_s, 20.0)

    def at(t):
        return orbit.state(np.array([t]))[0][0]

    true = changes(lambda t: by_rays(stopped(at(t), rays_to_sun(at(t), s), pole)), times)
    errors = []
    for shadow in (sun.find_shadow(), environment.shadow):
        found = changes(lambda t, m=shadow: by_fraction(sun.sunlit_fraction(at(t), s, m)[0]), times)
        assert len(found) == len(true)
        errors.append(np.abs(found - true))
    return errors


def orbits():
    """Circles of all inclinations at 400 to 900 km, on days of all seasons; none that the shadow's
    edge runs along."""
    rng = np.random.default_rng(3)
    for _ in range(12):
        orbit = Circular(
            altitude_km=rng.uniform(400.0, 900.0),
            inclination_deg=rng.uniform(20.0, 120.0),
            raan_deg=rng.uniform(0.0, 360.0),
        )
        yield orbit, f"2026-{rng.integers(1, 13):02d}-{rng.integers(1, 28):02d}T00:00:00Z"


@pytest.mark.parametrize("contact", CONTACTS)
def test_contacts_are_those_of_rays_through_the_ellipsoid(contact):
    every = [contact_errors(orbit, start, contact) for orbit, start in orbits()]
    sphere, oblate = (np.concatenate(errors) for errors in zip(*every, strict=True))
    assert len(oblate) > 15
    assert oblate.max() < 0.1 and oblate.mean() < 0.02
    assert 3.0 < sphere.mean() < 8.0 and sphere.max() > 8.0  # the test can tell


def test_partly_lit_discs_are_as_bright_as_rays_say():
    orbit, start = next(orbits())
    environment = met(orbit, start, "oblate")
    s, pole = environment.sun(np.zeros(1))[0], environment.dcm_to_ecef(np.zeros(1))[0, 2]
    edge = first_half_lit(environment, s)
    n = 20_000
    part, turn = np.sqrt((np.arange(n) + 0.5) / n), np.pi * (3.0 - np.sqrt(5.0)) * np.arange(n)
    t = edge + np.linspace(-6.0, 6.0, 25)
    r = orbit.state(t)[0]
    ours = sun.sunlit_fraction(r, s, environment.shadow)
    counted = [1.0 - stopped(x, rays_to_sun(x, s, part, turn)[1:], pole).mean() for x in r]
    # flat discs are off by 0.1 % (see test_sun), the round Sun by as much again
    assert np.abs(ours - counted).max() < 4e-3
    assert np.count_nonzero((ours > 0.02) & (ours < 0.98)) > 5
    sphere = sun.sunlit_fraction(r, s)
    assert np.abs(sphere - counted).max() > 0.2


def first_half_lit(environment, s):
    """Time [s] of the first half-lit instant, by the model itself."""
    times = np.arange(0.0, environment.orbit.period_s, 20.0)
    return changes(
        lambda t: (
            sun.sunlit_fraction(environment.orbit.state([t])[0], s, environment.shadow)[0] < 0.5
        ),
        times,
    )[0]


def test_where_the_pole_plays_no_part_the_shadows_are_one():
    """Rays in the equator's plane meet the ellipsoid and the sphere alike."""
    s = np.array([1.5e11, 0.0, 0.0])
    angle = np.linspace(0.0, 2.0 * np.pi, 3001)
    r = 7e6 * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    assert np.array_equal(sun.sunlit_fraction(r, s, "oblate"), sun.sunlit_fraction(r, s))
    over_the_pole = r[:, [0, 2, 1]]
    dark = [np.sum(1.0 - sun.sunlit_fraction(over_the_pole, s, m)) for m in sun.ECLIPSES[:2]]
    # the edge is 21.4 km lower over each pole: 2 * 21.4 / 7000 rad / cos(elevation)
    horizon = np.sqrt(1.0 - (EARTH_RADIUS_M / 7e6) ** 2)
    expected = 2.0 * (EARTH_RADIUS_M - POLAR_RADIUS_M) / 7e6 / horizon / (angle[1] - angle[0])
    assert dark[0] - dark[1] == pytest.approx(expected, rel=0.02)


def test_any_pole_will_do():
    rng = np.random.default_rng(8)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    r, s = rng.normal(size=(4000, 3)), np.array([1.1e11, 0.7e11, 0.6e11])
    r *= 6.9e6 / np.linalg.norm(r, axis=1)[:, None]
    plain = sun.sunlit_fraction(r, s, "oblate")
    turned = sun.sunlit_fraction(r @ turn.T, turn @ s, sun.find_shadow("oblate", turn[:, 2]))
    # rounding of a position, 1e-9 m, over the width of the penumbra
    assert turned == pytest.approx(plain, abs=1e-9)
    assert np.count_nonzero((plain > 0.0) & (plain < 1.0)) > 0


def test_pole_stays_that_of_the_start_and_hardly_strays():
    environment = met(
        Circular(altitude_km=500.0, inclination_deg=60.0), "2026-03-01T00:00:00Z", "oblate"
    )
    pole = environment.dcm_to_ecef(np.array([0.0, 365.25 * 86400.0]))[:, 2]
    assert np.array_equal(environment.shadow.pole, pole[0])
    assert np.linalg.norm(pole[1] - pole[0]) < 1.5e-4
    assert pole[0, 2] < 1.0 - 1e-6  # GCRF's third axis is not the pole of 2026


def seen(eclipse):
    """Lit part and what a Sun sensor saw, every 2 s about an entry into the shadow."""
    axes = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]
    return simulate(
        Scenario.model_validate(
            {
                "start": "2026-06-01T00:00:00Z",
                "orbit": {
                    "kind": "circular",
                    "altitude_km": 500,
                    "inclination_deg": 97.4,
                    "raan_deg": 70,
                },
                "environment": {"eclipse": eclipse, "field": {"kind": "direct_dipole"}},
                "spacecraft": {
                    "body": {"inertia_kg_m2": (1, 1.2, 1.4)},
                    "coils": {"limit_a_m2": 1},
                    "sun_sensors": {"axes": axes, "half_field_deg": 80},
                },
                "initial": {"rate_deg_s": (0, 0, 0)},
                "control": {"law": {"kind": "off"}, "sample_s": 2.0},
                "simulation": {"revolutions": 1, "record_s": 2.0},
            }
        )
    )


def test_sun_sensors_are_in_the_shadow_of_the_scenario():
    sunlit_fraction = {}
    for eclipse in ("conical", "oblate", "cylindrical"):
        result = seen(eclipse)
        sunlit_fraction[eclipse] = result["sunlit_fraction"].values[:-1]
        sees = np.linalg.norm(result["sun_measured"].values[:-1], axis=1) > 0.5
        clear = np.abs(sunlit_fraction[eclipse] - 0.5) > 0.02
        assert 0.3 < sees.mean() < 0.8
        assert np.array_equal(sees[clear], sunlit_fraction[eclipse][clear] > 0.5), eclipse
    sphere, ellipsoid = (sunlit_fraction[e] > 0.5 for e in ("conical", "oblate"))
    assert np.count_nonzero(sphere != ellipsoid) >= 2  # the test can tell
