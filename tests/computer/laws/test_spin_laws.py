"""The laws of spin stabilisation: formulas, what their torques can and cannot do, relays."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from law_cases import ZERO, inputs
from scipy.spatial.transform import Rotation

from torquer.computer.laws.nutation_damping import (
    NutationDamping,
    NutationDampingDerivative,
    NutationDampingRate,
)
from torquer.computer.laws.preliminary_1 import Preliminary1
from torquer.computer.laws.preliminary_2 import Preliminary2
from torquer.computer.laws.reorientation import Reorientation
from torquer.computer.laws.spin_up import SpinUp
from torquer.spacecraft.actuators.coils import COIL_STATE, Coils, command_coils

MANY = settings(max_examples=60, deadline=None)
J = np.array([[1.49, 0.054, 0.0442], [0.054, 1.51, 0.0], [0.0442, 0.0, 1.56]])
AXIS = (0.48, -0.6, 0.64)
#: Whole nanoteslas and microradians per second: zero or not, but nothing whose square vanishes.
fields = st.tuples(*[st.integers(-60_000, 60_000).map(lambda n: 1e-9 * n)] * 3)
rates = st.tuples(*[st.integers(-500_000, 500_000).map(lambda n: 1e-6 * n)] * 3)
turns = st.integers(0, 10_000).map(lambda n: Rotation.random(random_state=n))
units = turns.map(lambda turn: tuple(turn.as_matrix()[2].tolist()))


def row(b=ZERO, omega=ZERO, q=(0.0, 0.0, 0.0, 1.0), **known):
    return inputs(b=b, omega=omega, q=q, **known)


def answer(spec, known, memory=None):
    return np.array(spec.law()(known, memory=memory))


def pointed(target=(0.0, 0.0, 1.0), axis=AXIS, gain=2e5, momentum=0.3):
    """The three laws with a target, and what each wants of the coil for given L and direction."""
    j, k = J.tolist(), gain
    precise = Reorientation(
        gain_a_m2_per_n_m_s_t=k, target=target, axis=axis, momentum_n_m_s=momentum, inertia_kg_m2=j
    )
    first = Preliminary1(gain_a_m2_per_t=k, target=target, axis=axis)
    second = Preliminary2(gain_a_m2_per_t=k, target=target, axis=axis, inertia_kg_m2=j)
    return {
        precise: lambda L, s: momentum * s - L,
        first: lambda L, s: s,
        second: lambda L, s: s - (L / np.linalg.norm(L) if L.any() else 0.0),
    }


@MANY
@given(fields, rates, units)
def test_nutation_damping_is_one_coil_b_dot_and_only_dissipates(b, omega, axis):
    spec = NutationDampingRate(gain_a_m2_s_per_t=3e5, axis=axis)
    m, e3 = answer(spec, row(b, omega)), np.array(spec.axis)
    lever = np.linalg.norm(b) * np.linalg.norm(omega)
    expected = 3e5 * np.dot(np.cross(omega, b), e3) * e3
    assert m == pytest.approx(expected, rel=0.0, abs=1e-14 * 3e5 * lever)
    power = np.dot(np.cross(m, b), omega)
    assert power == pytest.approx(-np.dot(m, m) / 3e5, rel=1e-9, abs=1e-14 * 3e5 * lever**2)


@MANY
@given(fields, fields, units)
def test_nutation_damping_from_two_readings_and_from_a_search_coil(before, b, axis):
    spec = NutationDamping(gain_a_m2_s_per_t=3e5, axis=axis)
    law, e3 = spec.law(), np.array(spec.axis)
    memory = law.record_of(law.first_memory())
    assert answer(spec, row(before, t_s=1.0), memory).tolist() == pytest.approx([0.0] * 3, abs=0.0)
    m = answer(spec, row(b, t_s=3.0), memory)
    rate = np.subtract(b, before) / 2.0
    expected = -3e5 * np.dot(rate, e3) * e3
    assert m == pytest.approx(expected, rel=0.0, abs=1e-14 * 3e5 * 1e-4)
    coil = NutationDampingDerivative(gain_a_m2_s_per_t=3e5, axis=axis)
    assert answer(coil, row(b, b_rate=rate)) == pytest.approx(m, rel=0.0, abs=3e-15 * 3e5 * 1e-4)


@MANY
@given(fields, units)
def test_spin_up_follows_its_formula_and_never_brakes_the_axis(b, axis):
    spec = SpinUp(gain_a_m2_per_t=4e4, axis=axis)
    m, e3 = answer(spec, row(b)), np.array(spec.axis)
    size = np.linalg.norm(b)
    assert m == pytest.approx(-4e4 * np.cross(e3, b), rel=0.0, abs=1e-14 * 4e4 * size)
    along = np.dot(np.cross(m, b), e3)
    open_field = np.dot(b, b) - np.dot(b, e3) ** 2
    assert along == pytest.approx(4e4 * open_field, rel=0.0, abs=1e-14 * 4e4 * size**2)
    assert along >= -1e-14 * 4e4 * size**2


def test_spin_up_in_the_axes_of_the_book():
    m = answer(SpinUp(gain_a_m2_per_t=1e5), row(b=(1e-5, 2e-5, 3e-5)))
    assert m == pytest.approx([2.0, -1.0, 0.0], rel=1e-15)


def test_spin_up_stops_at_its_target_rate_about_the_axis():
    spec = SpinUp(gain_a_m2_per_t=1e5, target_rate_deg_s=10.0, axis=(0.0, 0.0, -1.0))
    b, wanted = (1e-5, 2e-5, 3e-5), math.radians(10.0)
    for rate, runs in ((0.0, True), (-0.999 * wanted, True), (-wanted * 1.001, False)):
        assert answer(spec, row(b, (0.3, 0.3, rate))).any() == runs
    assert answer(spec, row(b, (0.0, 0.0, 5.0 * wanted))).any()  # it turns the other way


@MANY
@given(fields, rates, turns, units)
def test_target_laws_follow_their_formulas_and_leave_the_spin_alone(b, omega, turn, target):
    q, e3 = turn.as_quat(), np.array(AXIS)
    for spec, missing in pointed(target).items():
        m = answer(spec, row(b, omega, q))
        direction = turn.inv().apply(target)
        wanted = np.dot(missing(J @ omega, direction), np.cross(e3, b))
        size = 2e5 * np.linalg.norm(b) * (2.0 + np.linalg.norm(J @ omega))
        assert m == pytest.approx(2e5 * wanted * e3, rel=0.0, abs=3e-15 * size)
        assert np.dot(np.cross(m, b), e3) == pytest.approx(0.0, abs=1e-14 * size * 1e-4)


@MANY
@given(fields, st.floats(0.01, 1.0), turns, units)
def test_of_a_pure_spin_the_three_pointed_laws_are_one(b, spin, turn, target):
    """L along e3 drops out of L . (e3 x B); precise reorientation differs by |L_f| alone."""
    q, omega = turn.as_quat(), np.linalg.solve(J, spin * np.array(AXIS))
    precise, first, second = (answer(s, row(b, omega, q)) for s in pointed(target, momentum=1.0))
    assert first == pytest.approx(second, rel=1e-9, abs=1e-11)
    assert first == pytest.approx(precise, rel=1e-9, abs=1e-11)


@MANY
@given(fields, rates, turns)
def test_target_may_be_the_sun_that_the_sensors_see(b, omega, turn):
    target, q = (0.36, 0.48, 0.8), turn.as_quat()
    sun = turn.inv().apply(target)
    for by_star, by_sun in zip(pointed(target), pointed("sun"), strict=True):
        m = answer(by_sun, row(b, omega, sun=sun))
        assert m == pytest.approx(answer(by_star, row(b, omega, q)), rel=1e-9, abs=1e-10)
        assert not answer(by_sun, row(b, omega)).any()


@pytest.mark.parametrize("ratio", [0.8, 1.04, 1.14])
def test_nutation_damping_and_the_first_law_cancel_in_a_precession(ratio):
    """MAG 3.4 with its k2 = 5e6, k5 = 1e6 and 10 deg/s: free motion about the target, any field.

    The axis goes round the target at k5/k2, at the angle arccos(C omega3 k2/(A k5)).
    """
    rng = np.random.default_rng(7)
    rate, spin, b = 1e6 / 5e6, math.radians(10.0), 3e-5 * rng.normal(size=3)
    turn = Rotation.random(random_state=rng)
    direction, across = turn.as_matrix()[:2]  # in the body: the target is axis 1 of the frame
    target, angle = (1.0, 0.0, 0.0), math.acos(ratio * spin / rate)
    axis = math.cos(angle) * direction + math.sin(angle) * across
    # L along the target, of size A k5/k2: omega = L/A + (1/C - 1/A) (L.e3) e3
    omega = rate * (direction + (1.0 / ratio - 1.0) * math.cos(angle) * axis)
    assert omega @ axis == pytest.approx(spin, rel=1e-12)
    known, e3 = row(b, omega, turn.as_quat()), tuple(axis.tolist())
    damping = answer(NutationDampingRate(gain_a_m2_s_per_t=5e6, axis=e3), known)
    first = answer(Preliminary1(gain_a_m2_per_t=1e6, target=target, axis=e3), known)
    assert np.linalg.norm(first) > 0.1
    assert damping == pytest.approx(-first, rel=1e-9)


def test_body_at_rest_has_no_momentum_direction_to_subtract():
    *_, first, second = pointed((1.0, 0.0, 0.0))
    at_rest = row((1e-5, 2e-5, 3e-5))
    assert answer(first, at_rest).any()
    assert answer(second, at_rest) == pytest.approx(answer(first, at_rest), abs=1e-18)


RELAYS = (
    NutationDampingRate(relay_dipole_a_m2=0.8),
    Reorientation(
        relay_dipole_a_m2=0.8, target=(1, 1, 0), momentum_n_m_s=0.1, inertia_kg_m2=J.tolist()
    ),
    Preliminary1(relay_dipole_a_m2=0.8, target=(1, 1, 0)),
    Preliminary2(relay_dipole_a_m2=0.8, target=(1, 1, 0), inertia_kg_m2=J.tolist()),
)


@pytest.mark.parametrize("spec", RELAYS, ids=lambda s: s.kind)
def test_a_relay_keeps_the_sign_of_the_linear_law(spec):
    rng = np.random.default_rng(1)
    linear = spec.model_copy(update={"relay_dipole_a_m2": None, spec.gain_key: 7.0})
    for _ in range(50):
        known = row(3e-5 * rng.normal(size=3), 0.1 * rng.normal(size=3))
        sign = np.sign(answer(linear, known)[2])
        assert answer(spec, known).tolist() == [0.0, 0.0, 0.8 * sign]
    assert not answer(spec, row()).any()


def test_the_relays_of_spin_up_switch_each_coil_alone():
    b = (1e-5, 2e-5, 3e-5)
    assert answer(SpinUp(relay_dipole_a_m2=0.1), row(b)).tolist() == [0.1, -0.1, 0.0]
    assert answer(SpinUp(relay_dipole_a_m2=0.1), row((0.0, 2e-5, 1e-5))).tolist() == [0.1, 0.0, 0.0]
    slanted = SpinUp(relay_dipole_a_m2=0.1, first_coil=(1.0, 1.0, 0.0))
    assert answer(slanted, row(b)) == pytest.approx([0.1 * 2**0.5, 0.0, 0.0], abs=1e-16)


def test_relay_keeps_coils_off_that_a_one_coil_law_ignores():
    """Their sign is that of nothing wanted: zero, not plus."""
    coils, state = Coils(limit_a_m2=0.8, saturation="relay").pack(), np.zeros(3, COIL_STATE)
    for bx in (1e-5, -1e-5):
        m = answer(NutationDampingRate(gain_a_m2_s_per_t=1.0), row((bx, 0, 2e-5), (0.0, 0.1, 0.0)))
        command_coils(coils, tuple(m), state)
        assert state["target_a_m2"].tolist() == [0.0, 0.0, -0.8 * np.sign(bx)]


def test_axes_are_kept_as_unit_vectors():
    spec = SpinUp(gain_a_m2_per_t=1.0, axis=(0.0, 3.0, 4.0))
    assert spec.axis == (0.0, 0.6, 0.8)
    assert np.dot(spec.across(), spec.axis) == pytest.approx(0.0, abs=1e-15)
    assert SpinUp(gain_a_m2_per_t=1.0).across() == (1.0, 0.0, 0.0)


NUTATION = {"gain_a_m2_s_per_t": 1.0}
PRECISE = {"gain_a_m2_per_n_m_s_t": 1.0, "momentum_n_m_s": 1.0, "inertia_kg_m2": (1.0, 1.0, 1.5)}


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: NutationDamping(),
            "gain_a_m2_s_per_t, relay_dipole_a_m2: one of the two must be given; received neither",
        ),
        (lambda: NutationDamping(relay_dipole_a_m2=1.0, **NUTATION), "received both"),
        (lambda: NutationDamping(gain_a_m2_s_per_t=0.0), "greater than 0"),
        (lambda: SpinUp(relay_dipole_a_m2=-1.0), "greater than 0"),
        (lambda: SpinUp(gain_a_m2_per_t=1.0, axis=(0, 0, 0)), "axis: must be non-zero vectors"),
        (lambda: SpinUp(gain_a_m2_per_t=1.0, target_rate_deg_s=0.0), "greater than 0"),
        (
            lambda: SpinUp(gain_a_m2_per_t=1.0, first_coil=(0, 1, 1)),
            r"first_coil: must be at right angles to the axis \[0.0, 0.0, 1.0\]; received \[0.0, 0",
        ),
        (lambda: Reorientation(target=(0, 0, 0), **PRECISE), "target: must be non-zero vectors"),
        (lambda: Reorientation(target="moon", **PRECISE), "must be 'sun'"),
        (lambda: Reorientation(**PRECISE), "must be given; received nothing"),
        (
            lambda: Reorientation(target="sun", **(PRECISE | {"inertia_kg_m2": (1, 1, 3)})),
            "inertia_kg_m2: the sum of two principal moments",
        ),
        (
            lambda: Reorientation(target="sun", **(PRECISE | {"momentum_n_m_s": 0.0})),
            "greater than 0",
        ),
        (lambda: Preliminary1(target="sun"), "gain_a_m2_per_t, relay_dipole_a_m2: one of the two"),
        (
            lambda: Preliminary2(target="sun", gain_a_m2_per_t=1.0),
            "must be given; received nothing",
        ),
    ],
)
def test_what_makes_no_sense_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
