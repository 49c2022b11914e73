"""Numerical orbits: invariants, secular rates, independent integrations, drag, every error."""

import math
import pickle
import re
import threading
from datetime import timedelta

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from slow_cases import slow_after

from torquer.base.conventions import EARTH_RADIUS_M, EARTH_RATE_RAD_S, MU_EARTH_M3_S2
from torquer.base.time import parse_utc
from torquer.compile.engine import COMPILED
from torquer.environment.earth import gravity
from torquer.environment.earth.rotation import dcm_inertial_to_ecef, teme_to_gcrf
from torquer.environment.orbit import Kepler, Numerical, Sgp4, numerical, point_mass
from torquer.environment.orbit.numerical import tle_epoch
from torquer.maths.geometry.frames import geodetic_from_ecef

START = "2007-09-21T09:10:34Z"
#: The five-day run of WHEEL.
LOW = {
    "kind": "kepler", "perigee_altitude_km": 400.0, "apogee_altitude_km": 450.0,
    "inclination_deg": 63.0, "raan_deg": 164.0, "argument_of_perigee_deg": 53.5,
    "true_anomaly_deg": -53.5,
}  # fmt: skip
GOST = {"kind": "gost", "f107": 150.0, "ap": 12.0}
DRAG = {"mass_kg": 6440.0, "area_m2": 20.0, "atmosphere": GOST}
CHIBIS = (
    "1 38051U 11062C   12058.91450162  .00007227  00000-0  32146-3 0  1024",
    "2 38051  51.6521 324.5583 0011559   6.4829  88.0894 15.22465494  5160",
)
DAY = 86400.0
long_run = pytest.mark.skipif(not COMPILED, reason="days of flight take compiled code")


def make(**changes) -> Numerical:
    return Numerical(**{"start": LOW, **changes})


def angular_rate(orbit, span_s):
    """Rate of the Earth's turn under 'sidereal', from the environment's own matrices."""
    first, last = dcm_inertial_to_ecef([0.0, span_s], START, "sidereal")
    turned = math.atan2(*(last @ first.T)[0, 1::-1])
    whole = round((EARTH_RATE_RAD_S * span_s - turned) / (2 * math.pi))
    return (turned + 2 * math.pi * whole) / span_s


def earth_fixed(orbit, times):
    """Position and velocity in the turning frame, and its rate."""
    r, v = orbit.state(times, START)
    dcm = dcm_inertial_to_ecef(times, START, orbit.earth_rotation)
    rate = angular_rate(orbit, DAY)
    turned = np.einsum("nij,nj->ni", dcm, r)
    return turned, np.einsum("nij,nj->ni", dcm, v) - np.cross([0.0, 0.0, rate], turned), rate


def test_degree_zero_is_the_kepler_orbit():
    times = np.linspace(-9000.0, 9000.0, 40)
    found = make(degree=0).state(times, START)
    for ours, exact in zip(found, Kepler(**LOW).state(times), strict=True):
        assert np.abs(ours - exact).max() < 1e-4


def test_the_start_state_is_met():
    for ours, exact in zip(make().state(0.0, START), Kepler(**LOW).state(0.0), strict=True):
        assert np.abs(ours - exact).max() < 1e-8


@long_run
def test_the_jacobi_integral_is_kept_for_five_days():
    """In the field that turns evenly, v^2/2 - U - (omega x r)^2/2 does not change."""
    orbit = make(earth_rotation="sidereal", degree=8)
    r, v, rate = earth_fixed(orbit, np.arange(0.0, 5 * DAY + 1.0, 3600.0))  # at nodes
    c_bar, s_bar = gravity.egm2008()
    lon, sin_lat = np.arctan2(r[:, 1], r[:, 0]), r[:, 2] / np.linalg.norm(r, axis=1)
    potential = MU_EARTH_M3_S2 / np.linalg.norm(r, axis=1)
    total = potential.copy()
    for n in range(2, 9):
        shrink = (gravity.REFERENCE_RADIUS_M / np.linalg.norm(r, axis=1)) ** n
        for m in range(n + 1):
            wave = c_bar[n, m] * np.cos(m * lon) + s_bar[n, m] * np.sin(m * lon)
            total += potential * shrink * wave * legendre(n, m, sin_lat)
    centrifugal = 0.5 * rate**2 * (r[:, 0] ** 2 + r[:, 1] ** 2)
    jacobi = 0.5 * np.sum(v * v, axis=1) - total - centrifugal
    assert np.ptp(jacobi) < 2e-13 * abs(jacobi[0])  # 3 micrometres of axis


def legendre(n, m, x):
    """Fully normalised associated Legendre function by its derivative formula."""
    poly = np.polynomial.legendre.Legendre.basis(n).deriv(m)
    norm = math.sqrt((2 if m else 1) * (2 * n + 1) * math.factorial(n - m) / math.factorial(n + m))
    return norm * (1.0 - x * x) ** (m / 2) * poly(x)


@long_run
def test_j2_turns_node_and_perigee_at_the_closed_forms_rates():
    """First-order theory with the mean axis: right to a part in some hundreds."""
    start = LOW | {"perigee_altitude_km": 600.0, "apogee_altitude_km": 1600.0}
    orbit = Numerical(start=start, degree=2, order=0, earth_rotation="sidereal")
    revolutions = 60
    times = np.linspace(0.0, revolutions * orbit.period_s, 20 * revolutions + 1)
    r, v = orbit.state(times, START)
    h = np.cross(r, v)
    node = np.unwrap(np.arctan2(h[:, 0], -h[:, 1]))
    e = np.cross(v, h) / MU_EARTH_M3_S2 - r / np.linalg.norm(r, axis=1, keepdims=True)
    ascending = np.column_stack([np.cos(node), np.sin(node), np.zeros(len(node))])
    normal = h / np.linalg.norm(h, axis=1, keepdims=True)
    across = np.sum(np.cross(normal, ascending) * e, axis=1)
    perigee = np.unwrap(np.arctan2(across, np.sum(ascending * e, axis=1)))
    axis = 1.0 / (2.0 / np.linalg.norm(r, axis=1) - np.sum(v * v, axis=1) / MU_EARTH_M3_S2)
    a, ecc = np.mean(axis), np.mean(np.linalg.norm(e, axis=1))
    inclination = np.mean(np.arccos(normal[:, 2]))
    j2 = -math.sqrt(5.0) * gravity.egm2008()[0][2, 0]
    size = 1.5 * j2 * math.sqrt(MU_EARTH_M3_S2 / a**3)
    size *= (gravity.REFERENCE_RADIUS_M / (a * (1.0 - ecc**2))) ** 2
    node_rate = np.polyfit(times, node, 1)[0]
    perigee_rate = np.polyfit(times, perigee, 1)[0]
    assert node_rate == pytest.approx(-size * math.cos(inclination), rel=4e-3)
    expected = size * (2.0 - 2.5 * math.sin(inclination) ** 2)
    assert perigee_rate == pytest.approx(expected, rel=0.1)  # near the critical inclination


def naive_rates(t, y, dcm_at, drag):
    """Gravity to (4,4) by the derivative of the potential's plain sum, and exponential drag."""
    dcm = dcm_at(t)
    r = dcm @ y[:3]
    h = 50.0
    a = np.empty(3)
    for k in range(3):
        step = h * np.eye(3)[k]
        # 4th-order differences of the small part; the central part is exact
        values = [small_potential(r + i * step) for i in (-2, -1, 1, 2)]
        a[k] = (values[0] - 8 * values[1] + 8 * values[2] - values[3]) / (12 * h)
    total = dcm.T @ a - MU_EARTH_M3_S2 * y[:3] / np.linalg.norm(y[:3]) ** 3
    w = y[3:] - np.cross(EARTH_RATE_RAD_S * dcm[2], y[:3])
    return np.concatenate([y[3:], total - drag(r) * np.linalg.norm(w) * w])


def small_potential(r):
    c_bar, s_bar = gravity.egm2008()
    size = np.linalg.norm(r)
    lon, sin_lat, total = math.atan2(r[1], r[0]), r[2] / size, 0.0
    for n in range(2, 5):
        for m in range(n + 1):
            wave = c_bar[n, m] * math.cos(m * lon) + s_bar[n, m] * math.sin(m * lon)
            total += (gravity.REFERENCE_RADIUS_M / size) ** n * wave * legendre(n, m, sin_lat)
    return MU_EARTH_M3_S2 / size * total


@pytest.mark.parametrize("mode", slow_after(1, ["precise", "sidereal"]))
def test_a_revolution_equals_an_integration_of_its_own(mode):
    """SciPy's integrator, another gravity, another turn of the Earth, another air."""
    drag = {"mass_kg": 3.0, "area_m2": 1.0, "drag_coefficient": 2.0}
    drag["atmosphere"] = {
        "kind": "exponential", "density_kg_m3": 4e-12, "at_height_km": 400.0,
        "scale_height_km": 60.0,
    }  # fmt: skip
    orbit = make(degree=4, drag=drag, earth_rotation=mode)
    span = 5600.0
    grid = np.linspace(0.0, span, 3)
    turns = dcm_inertial_to_ecef(grid, START, mode)

    def dcm_at(t):
        k = min(int(t / (0.5 * span)), 1)
        slow = turns[k]
        angle = angular_rate(orbit, DAY) * (t - grid[k])
        c, s = math.cos(angle), math.sin(angle)
        return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) @ slow

    def air(r):
        height_km = geodetic_from_ecef(r)[2] / 1e3
        return 4e-12 * math.exp(-(height_km - 400.0) / 60.0) / 3.0

    r, v = orbit.state([0.0, span], START)
    start = np.concatenate([r[0], v[0]])
    done = solve_ivp(
        naive_rates, (0.0, span), start, "DOP853", rtol=1e-10, atol=1e-6, args=(dcm_at, air)
    )
    assert np.abs(done.y[:3, -1] - r[1]).max() < 5e-3
    plain, _ = make(degree=4, earth_rotation=mode).state([span], START)
    assert np.abs(plain[0] - r[1]).max() > 100.0  # drag was there


@long_run
def test_five_days_of_16_by_16_equal_another_package():
    """Taylor integration in the turning frame, with EGM2008 of its own: below 1 m a day."""
    heyoka = pytest.importorskip("heyoka")
    orbit = make(earth_rotation="sidereal")
    times = np.linspace(0.0, 5 * DAY, 500)
    r, v, _ = earth_fixed(orbit, times)
    w = angular_rate(orbit, 5 * DAY)
    x, y, z, vx, vy, vz = heyoka.make_vars("x", "y", "z", "vx", "vy", "vz")
    a = heyoka.model.egm2008_acc(
        [x, y, z], n=16, m=16, mu=MU_EARTH_M3_S2, a=gravity.REFERENCE_RADIUS_M
    )
    system = [(x, vx), (y, vy), (z, vz), (vx, a[0] + 2 * w * vy + w * w * x)]
    system += [(vy, a[1] - 2 * w * vx + w * w * y), (vz, a[2])]
    theirs = heyoka.taylor_adaptive(system, np.concatenate([r[0], v[0]]), compact_mode=True)
    grid = theirs.propagate_grid(times)[-1]
    assert np.linalg.norm(grid[:, :3] - r, axis=1).max() < 2e-3
    assert np.linalg.norm(grid[:, 3:] - v, axis=1).max() < 5e-6


@long_run
def test_interpolation_between_nodes_is_good_to_tenth_of_millimetre(monkeypatch):
    orbit = make(drag=DRAG)
    times = np.linspace(0.0, 6000.0, 777)
    r, v = orbit.state(times, START)
    monkeypatch.setattr(point_mass, "NODE_S", 7.5)
    anchor = orbit.anchor(START)
    start = orbit._start_state(anchor)
    finer_r, finer_v = point_mass.Trajectory(orbit.forces(), anchor, "precise", start).states(times)
    assert np.abs(finer_r - r).max() < 1e-4
    assert np.abs(finer_v - v).max() < 1e-5


@long_run
def test_the_answer_does_not_depend_on_what_was_asked_before():
    orbit, times = make(drag=DRAG), [-40.0, 3.0 * DAY]
    at_once = orbit.state(times, START)
    numerical._trajectory.cache_clear()
    orbit.state([10.0], START)
    orbit.state([1.5 * DAY, -DAY], START)
    for first, second in zip(at_once, orbit.state(times, START), strict=True):
        assert np.all(first == second)


@long_run
def test_threads_may_ask_at_once():
    orbit, answers = make(degree=5), []
    ask = [
        threading.Thread(target=lambda t=t: answers.append((t, orbit.state([t], START)[0][0])))
        for t in np.linspace(0.1, 3.0, 8) * DAY
    ]
    for thread in ask:
        thread.start()
    for thread in ask:
        thread.join()
    numerical._trajectory.cache_clear()
    assert len(answers) == len(ask)
    for t, r in answers:
        assert np.all(orbit.state([t], START)[0][0] == r)


def test_flight_back_returns():
    """From the state two hours ago, forwards again."""
    there, _ = make().state([0.0], START)
    r, v = make().state([-7200.0], START)
    earlier = (parse_utc(START) - timedelta(hours=2)).isoformat()
    again = Numerical(
        start={
            "kind": "state_vector",
            "position_km": tuple(r[0] / 1e3),
            "velocity_km_s": tuple(v[0] / 1e3),
        }
    )
    assert np.abs(again.state([7200.0], earlier)[0] - there).max() < 1e-3


def test_elements_of_date_are_turned_into_gcrf():
    plain, _ = make().state([0.0], START)
    of_date, _ = make(start_frame="TEME").state([0.0], START)
    turn = teme_to_gcrf([0.0], START)[0]
    assert np.abs(turn @ plain[0] - of_date[0]).max() < 1e-4
    assert np.abs(plain - of_date).max() > 1000.0
    sidereal = make(start_frame="TEME", earth_rotation="sidereal")
    assert sidereal.frame == "TEME"
    assert make().frame == "GCRF"
    assert np.abs(sidereal.state([0.0], START)[0] - plain).max() < 1e-6


def test_the_two_rotations_agree_on_the_earth():
    """From one Earth-fixed state; the frame of date turns by 0.1 arcsec a day, left out there."""
    times = np.linspace(0.0, 20000.0, 9)
    places = []
    for mode in ("precise", "sidereal"):
        r, _ = make(start_frame="TEME", earth_rotation=mode).state(times, START)
        places.append(np.einsum("nij,nj->ni", dcm_inertial_to_ecef(times, START, mode), r))
    assert np.abs(places[0] - places[1]).max() < 5.0


def test_a_tle_starts_at_its_own_epoch():
    elements, orbit = Sgp4(tle=CHIBIS), Numerical(start={"kind": "sgp4", "tle": CHIBIS})
    epoch = tle_epoch(elements)
    r, v = elements.state([0.0], epoch)
    turn = teme_to_gcrf([0.0], epoch)[0]
    ours = orbit.state([0.0], epoch)
    assert np.abs(ours[0][0] - turn @ r[0]).max() < 1e-3
    assert np.abs(ours[1][0] - turn @ v[0]).max() < 1e-6
    later = epoch + timedelta(seconds=3000.25)
    assert np.abs(orbit.state([-3000.25], later)[0] - ours[0]).max() < 1e-6
    # without drag the two theories part by kilometres a day, not more
    far = elements.state([DAY / 4], epoch)[0][0]
    there = orbit.state([DAY / 4], epoch)[0][0]
    assert np.linalg.norm(teme_to_gcrf([DAY / 4], epoch)[0] @ far - there) < 3e3


@pytest.mark.parametrize(
    ("field", "year"),
    [("57001.00000000", 1957), ("99001.00000000", 1999), ("00060.50000000", 2000)],
)
def test_epochs_of_both_centuries(field, year):
    line = CHIBIS[0][:18] + field + CHIBIS[0][32:68]
    digit = (sum(int(c) for c in line if c.isdigit()) + line.count("-")) % 10
    epoch = tle_epoch(Sgp4(tle=(line + str(digit), CHIBIS[1])))
    assert epoch.year == year
    assert (epoch.month, epoch.day) == ((2, 29) if year == 2000 else (1, 1))


@long_run
def test_drag_shrinks_the_orbit_as_energy_says():
    """da/dt = -2 a^2/mu times the drag's power, for air that stands in the turning frame."""
    orbit = make(degree=0, drag=DRAG)
    times = np.arange(0.0, 12 * 3600.0, 20.0)
    r, v = orbit.state(times, START)
    dcm = dcm_inertial_to_ecef(times, START)
    w = v - EARTH_RATE_RAD_S * np.cross(dcm[:, 2], r)
    rho = orbit.drag.atmosphere.density(times, START, np.einsum("nij,nj->ni", dcm, r))
    half = 0.5 * 2.2 * 20.0 / 6440.0
    power = -half * rho * np.linalg.norm(w, axis=1) * np.sum(w * v, axis=1)
    energy = 0.5 * np.sum(v * v, axis=1) - MU_EARTH_M3_S2 / np.linalg.norm(r, axis=1)
    work = np.sum(0.5 * (power[1:] + power[:-1]) * np.diff(times))
    assert energy[-1] - energy[0] == pytest.approx(work, rel=1e-5)
    axis_lost = (energy[0] - energy[-1]) * 0.5 * MU_EARTH_M3_S2 / energy[0] ** 2
    assert 20.0 < axis_lost < 300.0


@long_run
def test_midnight_is_no_trouble(monkeypatch):
    """The standard's season jumps with the date; the steps stop there."""
    orbit = make(drag=DRAG)
    r, _ = orbit.state([3 * DAY], START)
    monkeypatch.setattr(point_mass, "NODE_S", 25.0)
    anchor = orbit.anchor(START)
    other = point_mass.Trajectory(orbit.forces(), anchor, "precise", orbit._start_state(anchor))
    assert np.abs(other.states(np.array([3 * DAY]))[0] - r).max() < 1e-3


@long_run
def test_a_falling_satellite_leaves_the_model():
    heavy = DRAG | {"area_m2": 2000.0}
    low = LOW | {"perigee_altitude_km": 200.0, "apogee_altitude_km": 220.0}
    message = r"within the atmosphere model's 120..1500 km; received one that leaves them \d"
    orbit = Numerical(start=low, drag=heavy)
    with pytest.raises(ValueError, match=message):
        orbit.state([DAY], START)
    early = orbit.state([600.0], START)[0]  # what it flew is there all the same
    assert np.linalg.norm(early) > EARTH_RADIUS_M


def test_an_orbit_through_the_ground_is_an_error():
    down = {"kind": "state_vector", "position_km": (6800, 0, 0), "velocity_km_s": (0, 0, 5.0)}
    with pytest.raises(ValueError, match="must stay above the Earth's surface"):
        Numerical(start=down, degree=2).state([7000.0], START)


def test_fall_without_lower_air_bound_ends_at_the_surface():
    drag = {"mass_kg": 1.0, "area_m2": 1.0, "atmosphere": {"kind": "exponential"}}
    start = {"kind": "circular", "altitude_km": 200.0, "inclination_deg": 60.0}
    orbit = Numerical(start=start, degree=2, drag=drag)
    message = r"above the Earth's surface; received one that is at or below it (\d\S*) s after"
    with pytest.raises(ValueError, match=message) as raised:
        orbit.state([DAY], START)
    reached = float(re.search(message, str(raised.value))[1])
    last_node = point_mass.NODE_S * (reached // point_mass.NODE_S)
    r, v = orbit.state([last_node], START)
    height = geodetic_from_ecef(dcm_inertial_to_ecef([last_node], START)[0] @ r[0])[2]
    falling = -(v[0] @ r[0]) / np.linalg.norm(r)
    assert height == pytest.approx(falling * (reached - last_node), rel=0.01)


def test_orbit_ending_elsewhere_than_at_an_air_bound_says_so():
    """Backwards in time drag accelerates: with this one beyond all bounds within 0.05 s."""
    drag = {"mass_kg": 1.0, "area_m2": 1e7, "atmosphere": {"kind": "exponential"}}
    start = {"kind": "circular", "altitude_km": 200.0, "inclination_deg": 60.0}
    message = r"steps become too small -0.043\d* s after the start state, at a height of 200.9 km"
    with pytest.raises(ValueError, match=message):
        Numerical(start=start, degree=2, drag=drag).state([-60.0], START)


def test_rate_and_period_are_those_of_the_start():
    kepler, orbit = Kepler(**LOW), make()
    assert orbit.rate_rad_s() == pytest.approx(kepler.rate_rad_s(), rel=1e-12)
    assert orbit.period_s == pytest.approx(kepler.period_s, rel=1e-12)
    tle = Numerical(start={"kind": "sgp4", "tle": CHIBIS})
    assert tle.rate_rad_s(START) == pytest.approx(Sgp4(tle=CHIBIS).rate_rad_s(), rel=5e-3)


def test_each_start_has_its_kind():
    assert all(spec.model_fields["kind"].default == k for k, spec in numerical.STARTS.items())
    for data in (
        {"kind": "circular", "altitude_km": 500.0, "inclination_deg": 98.0},
        {"kind": "state_vector", "position_km": (7000, 0, 0), "velocity_km_s": (0, 0, 7.5)},
    ):
        orbit = Numerical(start=data)
        assert type(orbit.start) is numerical.STARTS[data["kind"]]
        for ours, exact in zip(orbit.state([0.0], START), orbit.start.state([0.0]), strict=True):
            assert np.abs(ours - exact).max() < 1e-8


def test_no_times_and_no_zone():
    r, v = make().state([], START)
    assert r.shape == v.shape == (0, 3)
    with pytest.raises(ValueError, match="must be a time with a zone"):
        make().state([0.0], "2007-09-21T09:10:34")
    with pytest.raises(ValueError, match="t_s: must be finite"):
        make().state([math.nan], START)


def test_specs_survive_writing_and_reading():
    orbit = make(drag=DRAG, start_frame="TEME", order=4)
    assert Numerical.model_validate(orbit.model_dump(mode="json")) == orbit
    assert pickle.loads(pickle.dumps(orbit)) == orbit
    assert hash(pickle.loads(pickle.dumps(orbit))) == hash(orbit)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"degree": 37}, "degree"),
        ({"degree": 8, "order": 9}, "order: must lie within 0..8, the degree; received 9"),
        ({"earth_rotation": "flat"}, "earth_rotation"),
        ({"start_frame": "ECEF"}, "start_frame"),
        ({"start": {"kind": "numerical"}}, "start"),
        (
            {"drag": DRAG | {"atmosphere": {"kind": "nrlmsis", "f107": 150, "ap": 12}}},
            "must be one that compiles .gost, exponential. where the orbit is integrated",
        ),
        ({"drag": DRAG | {"mass_kg": 0.0}}, "mass_kg"),
        (
            {
                "start": {
                    "kind": "state_vector",
                    "position_km": (100, 0, 0),
                    "velocity_km_s": (0, 7, 0),
                }
            },
            "position_km: must lie above the Earth's equatorial radius; received a distance of 100",
        ),
        (
            {
                "start": {
                    "kind": "state_vector",
                    "position_km": (7000, 0, 0),
                    "velocity_km_s": (0, 11, 0),
                }
            },
            "velocity_km_s: must be below that of escape; received 11 km/s",
        ),
        *(
            (
                {
                    "start": {
                        "kind": "state_vector",
                        "position_km": (x_km, 0, 0),
                        "velocity_km_s": (0, speed_km_s, 0),
                    }
                },
                message,
            )
            for x_km, speed_km_s, message in (
                (1e30, 0.0, r"orbit: must stay within 1500000 km .* goes out to 1e\+30 km"),
                # the vis-viva speed at 7000 km of orbits out to 1.6e6 km
                (7000.0, 10.648463, r"orbit: must stay within 1500000 km .* out to 1.6\d*e\+06 km"),
                (7000.0, 1e200, "velocity_km_s: must be below that of escape; received 1e"),
            )
        ),
    ],
)
def test_wrong_orbits_are_errors(changes, message):
    with pytest.raises(ValueError, match=message):
        make(**changes)
