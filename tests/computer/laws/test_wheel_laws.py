"""Laws of reaction wheels: what they ask for, roots of the PD loop, axes, keys."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from law_cases import ZERO
from scipy.spatial.transform import Rotation
from wheel_cases import RATE, machine, orbit_at, orbital_frame, row

from torquer.computer.laws.pointing import reference_acceleration, reference_motion
from torquer.computer.laws.wheel_lyapunov import WheelLyapunov
from torquer.computer.laws.wheel_pd import WheelPd

MANY = settings(max_examples=60, deadline=None)
EULER = (40.0, -20.0, 110.0)
J = np.array([[2.6, 0.2, -0.3], [0.2, 3.1, 0.15], [-0.3, 0.15, 1.9]])
LAWS = {
    "pd": lambda reference: WheelPd(
        bandwidth_rad_s=0.05,
        damping=0.7,
        reference=reference,
        euler_deg=EULER,
        inertia_kg_m2=J.tolist(),
    ),
    "lyapunov": lambda reference: WheelLyapunov(
        rate_gain_n_m_s=0.2,
        angle_gain_n_m=0.05,
        reference=reference,
        euler_deg=EULER,
        inertia_kg_m2=J.tolist(),
    ),
}
EVERY = pytest.mark.parametrize("kind", LAWS)
REFERENCES = pytest.mark.parametrize("reference", ["orbital", "inertial"])
turns = st.integers(0, 10_000).map(lambda n: Rotation.random(random_state=n))
seeds = st.integers(0, 10_000)


def by_hand(spec):
    law = spec.law()
    return lambda known: np.array(law(known))


@pytest.mark.parametrize("eccentricity", [0.0, 0.3])
def test_rate_and_acceleration_are_those_of_the_orbital_frame(eccentricity):
    """Against differences of the frame itself along the orbit."""
    for t in (0.0, 700.0, 4000.0):
        near = [orbit_at(t + dt, eccentricity) for dt in (-2.0, 0.0, 2.0)]
        before, now, after = (orbital_frame(*state) for state in near)
        rows = [row((0, 0, 0, 1), ZERO, ZERO, *state) for state in near]
        q, turning = reference_motion(rows[1], 1.0)
        assert (Rotation.from_quat(q).inv() * now).magnitude() < 1e-14
        by_difference = (after * before.inv()).as_rotvec() / 4.0
        assert turning == pytest.approx(by_difference, abs=1e-5 * RATE)
        rates = [np.array(reference_motion(r, 1.0)[1]) for r in rows]
        speeding = (rates[2] - rates[0]) / 4.0
        found = np.array(reference_acceleration(rows[1], 1.0))
        assert found == pytest.approx(speeding, abs=1e-5 * RATE**2)
        assert (np.linalg.norm(found) > 0.05 * RATE**2) == (eccentricity > 0.0)


@EVERY
@REFERENCES
def test_both_quaternions_of_an_attitude_get_the_same_torque(kind, reference):
    ask = machine(LAWS[kind](reference))
    rng = np.random.default_rng(4)
    r, v = orbit_at(100.0, 0.1)
    for n in range(50):
        q, omega = Rotation.random(random_state=n).as_quat(), 0.01 * rng.normal(size=3)
        one = ask(row(q, omega, (0.1, 0.2, 0.3), r, v))
        assert np.array_equal(one, ask(row(-q, omega, (0.1, 0.2, 0.3), r, v)))
        assert np.linalg.norm(one) > 1e-6


@EVERY
@REFERENCES
@MANY
@given(seed=seeds, turn=turns)
def test_torques_turn_with_the_body_axes(kind, reference, seed, turn):
    """Other body axes, the inertia and the wanted attitude given in them: the same torque."""
    rng = np.random.default_rng(seed)
    r, v = orbit_at(1000.0, 0.2)
    q, omega, h = Rotation.random(random_state=seed), 0.02 * rng.normal(size=3), rng.normal(size=3)
    spec = LAWS[kind](reference)
    one = machine(spec)(row(q.as_quat(), omega, h, r, v))
    matrix = turn.as_matrix()
    wanted = Rotation.from_euler("ZYX", EULER, degrees=True) * turn.inv()
    keys = {
        "inertia_kg_m2": (matrix @ J @ matrix.T).tolist(),
        "euler_deg": wanted.as_euler("ZYX", degrees=True).tolist(),
    }
    there = type(spec)(**(spec.model_dump() | keys))
    other = machine(there)(row((q * turn.inv()).as_quat(), turn.apply(omega), turn.apply(h), r, v))
    assert other == pytest.approx(turn.apply(one), abs=1e-12)


@EVERY
@REFERENCES
def test_plain_python_gives_the_same(kind, reference):
    spec = LAWS[kind](reference)
    ask, plain = machine(spec), by_hand(spec)
    rng = np.random.default_rng(5)
    for n in range(20):
        q = Rotation.random(random_state=n).as_quat()
        at = row(q, 0.1 * rng.normal(size=3), rng.normal(size=3), *orbit_at(100.0 * n, 0.2))
        assert ask(at) == pytest.approx(plain(at), rel=1e-12, abs=1e-15)


@EVERY
def test_an_inertial_attitude_needs_no_navigation(kind):
    spec = LAWS[kind]("inertial")
    assert "ephemeris" not in spec.law().needs
    assert "ephemeris" in LAWS[kind]("orbital").law().needs
    found = machine(spec)(row((0.0, 0.6, 0.0, 0.8), (0.01, 0.0, 0.0)))
    assert np.all(np.isfinite(found)) and np.any(found)


@pytest.mark.parametrize("damping", [1.0, 0.6, 1.5])
@REFERENCES
def test_pd_every_axis_has_the_wanted_polynomial(reference, damping):
    """Acceleration, by differences of the law: -kappa^2 per angle, -2 zeta kappa per rate."""
    kappa = 0.03
    spec = WheelPd(
        bandwidth_rad_s=kappa,
        damping=damping,
        reference=reference,
        euler_deg=EULER,
        inertia_kg_m2=J.tolist(),
    )
    ask, inverse = machine(spec), np.linalg.inv(J)
    r, v = orbit_at(500.0, 0.2)
    wanted, turning = Rotation.from_euler("ZYX", EULER, degrees=True), np.zeros(3)
    if reference == "orbital":
        wanted, turning = orbital_frame(r, v) * wanted, np.cross(r, v) / (r @ r)

    def acceleration(angles, omega):
        turned = Rotation.from_rotvec(angles)
        body = wanted * turned
        return inverse @ ask(row(body.as_quat(), body.inv().apply(turning) + omega, ZERO, r, v))

    assert acceleration(np.zeros(3), np.zeros(3)) == pytest.approx(np.zeros(3), abs=1e-15)
    step, zero = 1e-4, np.zeros(3)
    spring, damper = (
        np.array([acceleration(*at(step * e)) - acceleration(*at(-step * e)) for e in np.eye(3)]).T
        / (2.0 * step)
        for at in (lambda x: (x, zero), lambda x: (zero, x))
    )
    assert spring == pytest.approx(-(kappa**2) * np.eye(3), abs=1e-8 * kappa**2)
    assert damper == pytest.approx(-2.0 * damping * kappa * np.eye(3), abs=1e-8 * kappa)
    if damping < 1.0:
        loop = np.block([[np.zeros((3, 3)), np.eye(3)], [spring, damper]])
        roots = np.linalg.eigvals(loop)
        assert np.abs(roots) == pytest.approx(np.full(6, kappa), rel=1e-6)
        assert roots.real == pytest.approx(np.full(6, -damping * kappa), rel=1e-6)


def test_pd_meets_constant_torque_at_the_error_of_the_docstring():
    kappa, torque = 0.02, np.array([3e-7, -2e-7, 1e-7])
    spec = WheelPd(bandwidth_rad_s=kappa, reference="inertial", inertia_kg_m2=J.tolist())
    error = Rotation.from_rotvec(np.linalg.solve(J, torque) / kappa**2)
    assert machine(spec)(row(error.as_quat(), ZERO)) == pytest.approx(-torque, rel=1e-6)


@REFERENCES
def test_pd_the_wheels_momentum_is_turned_with_the_body(reference):
    ask = machine(LAWS["pd"](reference))
    r, v = orbit_at(200.0, 0.1)
    q, omega, h = Rotation.random(random_state=8).as_quat(), (0.01, -0.02, 0.03), (4.0, -5.0, 6.0)
    more = ask(row(q, omega, h, r, v)) - ask(row(q, omega, ZERO, r, v))
    assert more == pytest.approx(np.cross(omega, h), abs=1e-14)


def test_pd_constant_and_instantaneous_orbital_rates_differ_as_the_rates():
    kappa, zeta = 0.02, 0.8
    keys = {"bandwidth_rad_s": kappa, "damping": zeta, "inertia_kg_m2": J.tolist()}
    own, one = WheelPd(**keys), WheelPd(**keys, orbital_rate_rad_s=RATE)
    r, v = orbit_at(300.0, 0.1)
    normal = np.cross(r, v)
    instant = np.linalg.norm(normal) / (r @ r)
    assert abs(instant - RATE) > 0.01 * RATE
    q = Rotation.random(random_state=3)
    at = row(q.as_quat(), (1e-3, 2e-3, -1e-3), ZERO, r, v)
    axis = q.inv().apply(normal / np.linalg.norm(normal))
    expected = J @ (2.0 * zeta * kappa * (RATE - instant) * axis)
    assert machine(one)(at) - machine(own)(at) == pytest.approx(expected, rel=1e-9)
    at = row(q.as_quat(), (1e-3, 2e-3, -1e-3), ZERO, *orbit_at(300.0, 0.0))
    assert machine(one)(at) == pytest.approx(machine(own)(at), rel=1e-9)


def test_lyapunov_gains_of_the_docstring_give_the_wanted_roots():
    """About an axis of the moment J: k_a = 2 J kappa^2, k_w = 2 zeta kappa J."""
    kappa, zeta, moment = 0.05, 0.7, 3.0
    spec = WheelLyapunov(
        rate_gain_n_m_s=2.0 * zeta * kappa * moment,
        angle_gain_n_m=2.0 * moment * kappa**2,
        reference="inertial",
        inertia_kg_m2=(moment, 2.0, 2.5),
    )
    ask = machine(spec)
    angle, rate = ask(row((5e-5, 0, 0, 1.0), ZERO)), ask(row((0, 0, 0, 1.0), (1e-4, 0, 0)))
    assert angle[0] / moment == pytest.approx(-1e-4 * kappa**2, rel=1e-6)
    assert rate[0] / moment == pytest.approx(-1e-4 * 2.0 * zeta * kappa, rel=1e-6)


@pytest.mark.parametrize(
    ("keys", "gravity", "ephemeris"),
    [
        ({"reference": "orbital"}, 1.0, True),
        ({"reference": "orbital", "gravity_feedforward": False}, 0.0, True),
        ({"reference": "inertial"}, 0.0, False),
        ({"reference": "inertial", "gravity_feedforward": True}, 1.0, True),
    ],
)
def test_lyapunov_takes_gravity_on_where_the_position_is_known(keys, gravity, ephemeris):
    spec = WheelLyapunov(
        rate_gain_n_m_s=1.0, angle_gain_n_m=1.0, inertia_kg_m2=(1.0, 1.5, 2.0), **keys
    )
    law = spec.law()
    assert law.parameters.gravity == gravity and ("ephemeris" in law.needs) == ephemeris


PD = {"bandwidth_rad_s": 0.1, "inertia_kg_m2": (1.0, 1.5, 2.0)}
LYAPUNOV = {"rate_gain_n_m_s": 1.0, "angle_gain_n_m": 1.0, "inertia_kg_m2": (1.0, 1.5, 2.0)}


@pytest.mark.parametrize(
    ("make", "keys", "expected"),
    [
        (WheelPd, PD | {"bandwidth_rad_s": 0.0}, r"bandwidth_rad_s: .*greater than 0"),
        (WheelPd, PD | {"damping": -1.0}, r"damping: .*greater than 0"),
        (WheelPd, PD | {"orbital_rate_rad_s": 0.0}, r"orbital_rate_rad_s: .*greater than 0"),
        (
            WheelPd,
            PD | {"reference": "inertial", "orbital_rate_rad_s": 1e-3},
            r"orbital_rate_rad_s: must be left out unless the reference is 'orbital'; "
            r"received 0\.001",
        ),
        (WheelPd, PD | {"reference": "solar"}, r"reference: .*'orbital' or 'inertial'"),
        (WheelPd, PD | {"sequence": "112"}, r"sequence: must be three axes.*received '112'"),
        (WheelPd, {"bandwidth_rad_s": 0.1}, r"inertia_kg_m2: must be given"),
        (WheelPd, PD | {"inertia_kg_m2": (1.0, 1.0, 3.0)}, r"triangle inequality"),
        (WheelLyapunov, LYAPUNOV | {"rate_gain_n_m_s": 0.0}, r"rate_gain_n_m_s: .*greater than 0"),
        (WheelLyapunov, LYAPUNOV | {"angle_gain_n_m": 0.0}, r"angle_gain_n_m: .*greater than 0"),
        (WheelLyapunov, LYAPUNOV | {"inertia_kg_m2": (-1, 1, 1)}, r"positive definite"),
        (WheelLyapunov, LYAPUNOV | {"gravity_feedforward": "maybe"}, r"gravity_feedforward: "),
    ],
)
def test_keys_are_checked(make, keys, expected):
    with pytest.raises(ValueError, match=expected):
        make(**keys)
