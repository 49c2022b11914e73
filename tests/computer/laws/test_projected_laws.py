"""Laws that ask for a torque of which the coils give the part across the field."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from attitude_holds import hold
from law_cases import inputs
from pydantic import TypeAdapter
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import torquer
from torquer.base.conventions import MU_EARTH_M3_S2
from torquer.computer.laws import AnyLaw
from torquer.computer.laws.projected_pd import ProjectedPd
from torquer.computer.laws.sliding_mode import SlidingMode
from torquer.computer.laws.three_axis import ThreeAxis
from torquer.theory import exact_stability, mean_projection

RADIUS_M = 7e6
N = math.sqrt(MU_EARTH_M3_S2 / RADIUS_M**3)
TILT = Rotation.from_euler("x", 70.0, degrees=True)
B = (1e-5, -2e-5, 3e-5)
INERTIA = np.array([[1.4, 0.05, 0.02], [0.05, 1.6, -0.03], [0.02, -0.03, 0.9]])
KEYS = {
    "projected_pd": {"rate_gain_n_m_s": 2e-3, "angle_gain_n_m": 3e-6},
    "sliding_mode": {
        "manifold_rate_rad_s": 2e-3,
        "reaching_rate_per_s": 4e-3,
        "inertia_kg_m2": INERTIA.tolist(),
    },
}
SPECS = {"projected_pd": ProjectedPd, "sliding_mode": SlidingMode}


def on_orbit(t_s):
    """Position, velocity, orbital axes to inertial ones, their rate; a circular orbit."""
    u = N * t_s
    r = TILT.apply(RADIUS_M * np.array([math.cos(u), math.sin(u), 0.0]))
    v = TILT.apply(N * RADIUS_M * np.array([-math.sin(u), math.cos(u), 0.0]))
    normal = TILT.apply([0.0, 0.0, 1.0])
    axes = np.column_stack([np.cross(normal, r / RADIUS_M), normal, r / RADIUS_M])
    return r, v, Rotation.from_matrix(axes), N * normal


def dipole(law, t_s, attitude, omega, b=B):
    r, v, _, _ = on_orbit(t_s)
    return np.array(law(inputs(b=b, omega=omega, q=attitude.as_quat(), r=r, v=v)))


def whole_torque(law, t_s, attitude, omega):
    """What is asked for, of which a field shows the part across it: from those along the axes."""
    parts = [
        np.cross(dipole(law, t_s, attitude, omega, tuple(1e-5 * each)), 1e-5 * each)
        for each in np.eye(3)
    ]
    return 0.5 * sum(parts)


def state_off(turn_deg=(40.0, -60.0, 30.0), rate=(1e-3, -2e-3, 1.5e-3), t_s=0.0):
    """Attitude and absolute rate, off the orbital frame."""
    _, _, axes, turning = on_orbit(t_s)
    attitude = axes * Rotation.from_rotvec(turn_deg, degrees=True)
    return attitude, attitude.inv().apply(turning) + np.array(rate)


@pytest.mark.parametrize("kind", SPECS)
def test_torque_is_across_the_field_and_independent_of_its_strength(kind):
    law, state = SPECS[kind](**KEYS[kind]).law(), state_off()
    for b in (np.array(B), 3.0 * np.array(B)):
        m = dipole(law, 0.0, *state, tuple(b))
        torque = np.cross(m, b)
        assert abs(m @ b) < 1e-14 * np.linalg.norm(m) * np.linalg.norm(b) * 10.0
        asked = whole_torque(law, 0.0, *state)
        across = asked - b * (b @ asked) / (b @ b)
        assert torque == pytest.approx(across, rel=1e-9, abs=1e-9 * np.linalg.norm(asked))


def test_pd_is_the_published_law_at_the_fields_strength():
    """(4.1.7), less the part along B: k = k_v/B^2, k_a = k_p/(4 e4 B^2)."""
    attitude, omega = state_off()
    square, e4 = np.dot(B, B), math.cos(math.radians(np.linalg.norm([40.0, 60.0, 30.0])) / 2.0)
    text = ThreeAxis(
        rate_gain_n_m_s_per_t2=2e-3 / square, angle_gain_n_m_per_t2=3e-6 / (4.0 * e4 * square)
    ).law()
    own = dipole(ProjectedPd(**KEYS["projected_pd"]).law(), 0.0, attitude, omega)
    assert own == pytest.approx(dipole(text, 0.0, attitude, omega), rel=1e-9)


def test_the_spring_takes_the_short_way_round():
    law = ProjectedPd(**KEYS["projected_pd"]).law()
    for sign in (1.0, -1.0):
        attitude, _ = state_off((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        turned = attitude * Rotation.from_euler("y", 190.0, degrees=True)
        r, v, _, turning = on_orbit(0.0)
        known = inputs(b=B, omega=turned.inv().apply(turning), q=sign * turned.as_quat(), r=r, v=v)
        torque = np.cross(law(known), B)
        assert torque[1] > 0.0  # 190 deg are 170 the other way: onwards


@pytest.mark.parametrize("angles", [(0.0, 0.0, 0.0), (30.0, -40.0, 70.0)])
def test_weighting_by_mean_projection_gives_full_torque_on_average(angles):
    """In an inertial attitude J theta'' + k_v theta' + k_p/2 theta = 0 on the average, any J."""
    held = hold(50.0, inertia=(1.2, 1.2, 1.2), euler_deg=angles)
    b = held.free(np.linspace(0.0, held.period, 64, endpoint=False)).b_body_t
    mean = mean_projection(b)
    assert np.trace(mean) == pytest.approx(2.0)
    k_v, k_p = 0.3 * held.rate_rad_s * 1.2, 0.2 * held.rate_rad_s**2 * 1.2
    keys = {"reference": "inertial", "euler_deg": angles, "mean_projection": mean.tolist()}
    law = ProjectedPd(rate_gain_n_m_s=k_v, angle_gain_n_m=k_p, **keys).law()
    found = exact_stability(held.with_law(law))
    roots = np.roots([1.0, 0.3, 0.1])
    assert found.averaged_degree == pytest.approx(-roots.real.max(), rel=1e-9)
    assert found.degree == pytest.approx(found.averaged_degree, rel=0.1)


def moving(law, attitude, omega, span_s):
    """Euler's equations under the whole torque and gravity, integrated independently."""
    inverse = np.linalg.inv(INERTIA)

    def rates(t_s, y):
        q, w = Rotation.from_quat(y[:4]), y[4:]
        up = q.inv().apply(on_orbit(t_s)[0] / RADIUS_M)
        gravity = 3.0 * N**2 * np.cross(up, INERTIA @ up)
        torque = gravity + whole_torque(law, t_s, q, w) - np.cross(w, INERTIA @ w)
        (x, y_, z, s), (a, b, c) = y[:4], w
        turning = [s * a + y_ * c - z * b, s * b + z * a - x * c, s * c + x * b - y_ * a,
                   -x * a - y_ * b - z * c]  # fmt: skip
        return np.concatenate([0.5 * np.array(turning), inverse @ torque])

    start = np.concatenate([attitude.as_quat(), omega])
    times = np.linspace(0.0, span_s, 7)
    return times, solve_ivp(rates, (0.0, span_s), start, t_eval=times, rtol=1e-9, atol=1e-12).y


def errors(t_s, y):
    """Vector part of the turn from the orbital frame, its angle, and the relative rate."""
    _, _, axes, turning = on_orbit(t_s)
    q = Rotation.from_quat(y[:4])
    turn = (axes.inv() * q).as_rotvec()
    angle = np.linalg.norm(turn)
    return math.sin(0.5 * angle) * turn / angle, angle, y[4:] - q.inv().apply(turning)


def test_a_whole_torque_takes_the_distance_from_the_manifold_out():
    """s(t) = s(0) exp(-lambda t) whatever the motion: rotating reference, gravity, any tensor."""
    law = SlidingMode(**KEYS["sliding_mode"]).law()
    times, states = moving(law, *state_off(), 900.0)
    found = []
    for t_s, y in zip(times, states.T, strict=True):
        e, _, relative = errors(t_s, y)
        found.append(INERTIA @ (relative + 2e-3 * e))
    expected = np.exp(-4e-3 * times)[:, None] * found[0]
    assert np.array(found) == pytest.approx(expected, abs=1e-6 * np.linalg.norm(found[0]))


def test_manifold_angle_falls_as_the_reduced_equation_says():
    """da/dt = -kappa sin(a/2): tan(a/4) falls with kappa/2."""
    law, turn = SlidingMode(**KEYS["sliding_mode"]).law(), np.array([70.0, -90.0, 60.0])
    angle = math.radians(np.linalg.norm(turn))
    e = math.sin(0.5 * angle) * turn / np.linalg.norm(turn)
    times, states = moving(law, *state_off(turn, -2e-3 * e), 1800.0)
    quarter = [math.tan(errors(t, y)[1] / 4.0) for t, y in zip(times, states.T, strict=True)]
    assert quarter == pytest.approx(math.tan(angle / 4.0) * np.exp(-1e-3 * times), rel=1e-6)


def test_sliding_mode_at_equilibrium_asks_only_for_gravity_torque():
    aligned = {**KEYS["sliding_mode"], "inertia_kg_m2": [1.4, 1.6, 0.9]}
    at_rest = state_off((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    whole = whole_torque(SlidingMode(**aligned).law(), 0.0, *at_rest)
    assert whole == pytest.approx(np.zeros(3), abs=1e-18)
    attitude, omega = at_rest
    whole = whole_torque(SlidingMode(**KEYS["sliding_mode"]).law(), 0.0, attitude, omega)
    up, along = np.array([0.0, 0.0, 1.0]), np.array([0.0, N, 0.0])
    gravity = 3.0 * N**2 * np.cross(up, INERTIA @ up)
    gyroscopic = np.cross(along, INERTIA @ along)
    assert whole == pytest.approx(gyroscopic - gravity, rel=1e-9, abs=1e-12)


FLIGHT = """
start = 2025-03-01T00:00:00Z
[orbit]
kind = "circular"
altitude_km = 450
inclination_deg = 80
[environment]
field = {{ kind = "averaged" }}
table_tolerance = 1e-7
[spacecraft.body]
inertia_kg_m2 = [1.5, 1.7, 0.9]
[spacecraft.coils]
limit_a_m2 = 30.0
[initial]
reference = "orbital"
rate_relative_to = "orbital"
euler_deg = [70.0, -50.0, 60.0]
rate_deg_s = [0.05, -0.02, 0.03]
[control]
law = {{ {law} }}
sample_s = 10.0
[simulation]
revolutions = 12
step_s = 10.0
record_s = 60
"""
LAWS = {
    "plain": 'kind = "projected_pd", rate_gain_n_m_s = 1.5e-3, angle_gain_n_m = 3e-6',
    "weighted": 'kind = "projected_pd", rate_gain_n_m_s = 0.6e-3, angle_gain_n_m = 1e-6, '
    "mean_projection = [[0.515, 0, 0], [0, 0.982, 0], [0, 0, 0.503]]",
    "sliding": 'kind = "sliding_mode", manifold_rate_rad_s = 2e-3, reaching_rate_per_s = 1.5e-3, '
    "inertia_kg_m2 = [1.5, 1.7, 0.9]",
}


@pytest.mark.parametrize("name", LAWS)
def test_a_satellite_of_gravity_s_gradient_settles(name):
    result = torquer.simulate(torquer.scenario_from_text(FLIGHT.format(law=LAWS[name])))
    r, v = result.position_inertial.values, result.velocity_inertial.values
    normal = np.cross(r, v) / np.linalg.norm(np.cross(r, v), axis=1)[:, None]
    up = r / np.linalg.norm(r, axis=1)[:, None]
    frame = Rotation.from_matrix(np.stack([np.cross(normal, up), normal, up], axis=2))
    turns = frame.inv() * Rotation.from_quat(result.q_body_to_inertial.values)
    off = np.degrees(turns.magnitude())
    assert off[0] > 60.0
    assert off[-90:].max() < 0.5


def test_the_gains_of_the_comparison_are_those_of_laws():
    """What `examples/compare_magnetic_laws.py` has found and flies."""
    path = Path(torquer.__file__).parents[1] / "examples/magnetic_laws.json"
    of_file = TypeAdapter(AnyLaw).validate_python
    specs = [of_file(each) for each in json.loads(path.read_text()).values()]
    assert {spec.kind for spec in specs} == {"periodic_gains", "projected_pd", "sliding_mode"}
    assert len(specs) == 9 and all(spec.orbital for spec in specs)


@pytest.mark.parametrize(
    "rows", [[[1, 0.1, 0], [0, 1, 0], [0, 0, 1]], [[1, 0, 0], [0, 1, 0], [0, 0, 0]]]
)
def test_a_weight_must_have_an_inverse(rows):
    with pytest.raises(ValueError, match=r"mean_projection[^%]*symmetric and positive"):
        ProjectedPd(**KEYS["projected_pd"], mean_projection=rows)
