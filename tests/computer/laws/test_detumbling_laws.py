"""Laws of the literature that detumble: closed forms, the sign of their power, where they rest."""

import math

import numpy as np
import pytest
from campaign.test_outcomes import outcome
from hypothesis import given, settings, strategies as st
from law_cases import ZERO, inputs
from scipy.spatial.transform import Rotation
from slow_cases import slow_after
from tip_off import SCENARIO, campaign

import torquer
from torquer.campaign.fleet import Fleet
from torquer.campaign.sampling import member_scenario
from torquer.compile import engine
from torquer.computer.laws.bcross import Bcross, bcross
from torquer.computer.laws.bdot_normalised import (
    BdotNormalised,
    BdotWeighted,
    Brake,
    bdot_normalised,
    bdot_weighted,
)
from torquer.computer.laws.momentum_projection import MomentumProjection, momentum_projection
from torquer.computer.laws.non_monotonic import (
    NonMonotonic,
    NonMonotonicDerivative,
    impulse_now,
    non_monotonic,
    non_monotonic_derivative,
)
from torquer.scenario.load import scenario_from_text

MANY = settings(max_examples=60, deadline=None)
J = np.array([[1.49, 0.054, 0.0442], [0.054, 1.51, 0.0], [0.0442, 0.0, 1.06]])
KEYS = {"inertia_kg_m2": J.tolist()}
fields = st.tuples(*[st.integers(-60_000, 60_000).map(lambda n: 1e-9 * n)] * 3).filter(any)
rates = st.tuples(*[st.integers(-500_000, 500_000).map(lambda n: 1e-6 * n)] * 3).filter(any)


def at_start(spec):
    law = spec.law()
    return spec.parameters(), law.record_of(law.first_memory())


def turning(t, rate=(0.1, -0.2, 0.15), size=3e-5):
    """A field at rest in space, in a body that turns at a constant rate [rad/s]."""
    turn = Rotation.from_rotvec(t * np.array(rate)).inv()
    return tuple(turn.apply(size * np.array([0.48, 0.6, -0.64])))


# ------------------------------------------------------------- normalised and weighted B-dot


def test_normalised_bdot_is_the_difference_of_directions_over_the_field():
    p, memory = at_start(BdotNormalised(gain_n_m_s=3e-4))
    one, other = np.array(turning(0.0)), 1.7 * np.array(turning(0.5))
    assert bdot_normalised(inputs(0.0, b=tuple(one)), p, memory) == (0.0, 0.0, 0.0)
    found = bdot_normalised(inputs(0.5, b=tuple(other)), p, memory)
    size = np.linalg.norm(other)
    directions = other / size - one / np.linalg.norm(one)
    assert found == pytest.approx(-3e-4 / size * directions / 0.5, rel=1e-12)
    assert bdot_normalised(inputs(0.5, b=tuple(other)), p, memory) == found, "no new reading"
    assert bdot_normalised(inputs(1.0, b=ZERO), p, memory) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("size", [2e-5, 6e-5])
def test_normalised_bdot_brakes_alike_in_a_weak_and_a_strong_field(size):
    """In fast rotation its torque is -k (omega - b (b.omega))."""
    p, memory = at_start(BdotNormalised(gain_n_m_s=3e-4))
    omega, step_s = np.array([0.1, -0.2, 0.15]), 1e-4
    for t in (0.0, step_s):
        m = bdot_normalised(inputs(t, b=turning(t, omega, size)), p, memory)
    b = np.array(turning(0.5 * step_s, omega, size))
    along = b / size
    expected = -3e-4 * (omega - along * (along @ omega))
    assert np.cross(m, b) == pytest.approx(expected, rel=1e-4, abs=1e-9)


def test_weighted_bdot_has_the_gain_of_the_mean_rate_so_far():
    keys = {"weight_s": 2.0, "reference_deg_s": 6.5, "averaging_s": 4.0}
    p, memory = at_start(BdotWeighted(gain_n_m_s=3e-4, **keys))
    plain, of_plain = at_start(BdotNormalised(gain_n_m_s=3e-4))
    mean, before = None, None
    for k in range(30):
        t = 0.5 * k
        row = inputs(t, b=turning(t, (0.02 * k, 0.1, -0.3)))
        found, reference = bdot_weighted(row, p, memory), bdot_normalised(row, plain, of_plain)
        along = np.array(row.b_body_t) / np.linalg.norm(row.b_body_t)
        if before is not None:
            rate = np.linalg.norm(along - before) / 0.5
            mean = rate if mean is None else mean + 0.5 / 4.0 * (rate - mean)
            factor = 1.0 / (1.0 + 2.0 * (mean - math.radians(6.5)))
            assert found == pytest.approx(factor * np.array(reference), rel=1e-12)
        before = along


def test_weighted_bdot_at_its_reference_rate_is_the_normalised_one():
    chord = 2.0 * math.sin(0.05) / 0.5  # of a direction that turns by 0.1 rad in 0.5 s
    keys = {"weight_s": 3.0, "reference_deg_s": math.degrees(chord), "averaging_s": 10.0}
    p, memory = at_start(BdotWeighted(gain_n_m_s=3e-4, **keys))
    plain, of_plain = at_start(BdotNormalised(gain_n_m_s=3e-4))
    for k in range(5):
        b = (3e-5 * math.cos(0.1 * k), 3e-5 * math.sin(0.1 * k), 0.0)
        row = inputs(0.5 * k, b=b)
        found, same = bdot_weighted(row, p, memory), bdot_normalised(row, plain, of_plain)
        assert found == pytest.approx(same, rel=1e-9, abs=1e-12)


def test_a_weight_that_would_turn_the_gain_over_is_refused():
    with pytest.raises(ValueError, match=r"weight_s: must be below 9\.549 s .* received 9\.6"):
        BdotWeighted(gain_n_m_s=1.0, weight_s=9.6, reference_deg_s=6.0, averaging_s=50.0)


# ------------------------------------------------------------- B-cross and the projection


@MANY
@given(fields, rates, st.floats(1e-6, 1.0))
def test_power_of_bcross_is_never_above_zero(b, omega, gain):
    torque = np.cross(bcross(inputs(b=b, omega=omega), Brake(gain), ()), b)
    along = np.array(b) / np.linalg.norm(b)
    size = gain * np.dot(omega, omega)
    across = np.sum(np.cross(omega, along) ** 2)
    assert np.dot(torque, omega) == pytest.approx(-gain * across, rel=0.0, abs=1e-13 * size)
    assert np.dot(torque, b) == pytest.approx(0.0, abs=1e-13 * gain * np.linalg.norm(omega))


def test_gain_of_avanzini_and_giulietti():
    """2 n (1 + sin xi) J_min."""
    law = Bcross(least_inertia_kg_m2=0.5, orbit_rate_deg_s=0.06, field_inclination_deg=30.0)
    assert law.parameters().gain == pytest.approx(2.0 * math.radians(0.06) * 1.5 * 0.5, rel=1e-14)
    assert Bcross(gain_n_m_s=0.25).parameters().gain == 0.25


@pytest.mark.parametrize(
    ("keys", "received"),
    [
        ({}, "none"),
        ({"gain_n_m_s": 1.0, "orbit_rate_deg_s": 0.06}, "gain_n_m_s and orbit_rate_deg_s"),
        ({"least_inertia_kg_m2": 1.0}, "least_inertia_kg_m2"),
    ],
)
def test_bcross_has_one_gain(keys, received):
    with pytest.raises(ValueError, match=rf"gain_n_m_s: must be given.*received {received}"):
        Bcross(**keys)


@MANY
@given(fields, rates, st.floats(0.0, 8.0))
def test_projection_takes_momentum_only_across_the_field(b, omega, slope):
    """d|h|^2/dt = -2 k' |h x b|^2 with k' = k exp(-c |b.h|/|h|)."""
    p = MomentumProjection(gain_per_s=0.02, slope=slope, **KEYS).parameters()
    torque = np.cross(momentum_projection(inputs(b=b, omega=omega), p, ()), b)
    along, h = np.array(b) / np.linalg.norm(b), J @ omega
    gain = 0.02 * math.exp(-slope * abs(along @ h) / np.linalg.norm(h))
    expected = -2.0 * gain * np.sum(np.cross(h, along) ** 2)
    assert 2.0 * h @ torque == pytest.approx(expected, rel=0.0, abs=1e-12 * (h @ h))


def test_projection_without_field_or_momentum_asks_for_nothing():
    p = MomentumProjection(gain_per_s=0.02, **KEYS).parameters()
    for row in (inputs(b=ZERO, omega=(0.1, 0.0, 0.0)), inputs(b=(1e-5, 0.0, 0.0), omega=ZERO)):
        assert momentum_projection(row, p, ()) == (0.0, 0.0, 0.0)


# ------------------------------------------------------------- non-monotonic


def least_squares(h, b1, b2, a):
    """s1 of the minimum by a solver of linear least squares."""
    one, two = (np.cross(b, np.eye(3)).T for b in (b1, b2))  # s -> b x s
    zero, root = np.zeros((3, 3)), math.sqrt(a)
    rows = np.block([[root * one, root * two], [one, zero], [np.eye(3), zero], [zero, np.eye(3)]])
    right = np.concatenate([root * h, h, np.zeros(6)])
    return np.linalg.lstsq(rows, right, rcond=None)[0][:3]


@MANY
@given(st.integers(0, 2**32 - 1), st.floats(0.1, 1000.0))
def test_impulse_is_that_of_the_least_squares(seed, a):
    rng = np.random.default_rng(seed)
    h, (b1, b2) = rng.normal(size=3), rng.normal(size=(2, 3))
    b1, b2 = b1 / np.linalg.norm(b1), b2 / np.linalg.norm(b2)
    found = impulse_now(tuple(h), tuple(b1), tuple(b2), a)
    assert found == pytest.approx(least_squares(h, b1, b2, a), abs=1e-9 * np.linalg.norm(h))


@MANY
@given(fields, rates)
def test_without_look_ahead_it_brakes_the_momentum_across_the_field(b, omega):
    """s1 = (1 + c)/(2 + c) h x b, so that d|h|^2/dt is never above 0."""
    keys = {"gain_a_m2_per_n_m_s": 60.0, "look_ahead_s": 0.0}
    p = NonMonotonicDerivative(**keys, **KEYS).parameters()
    m = non_monotonic_derivative(inputs(b=b, b_rate=(1e-6, 2e-6, 0.0), omega=omega), p, ())
    h, along, c = J @ omega, np.array(b) / np.linalg.norm(b), 100.0 / 101.0
    expected = 60.0 * (1.0 + c) / (2.0 + c) * np.cross(h, along)
    assert m == pytest.approx(expected, rel=0.0, abs=1e-12 * 60.0 * np.linalg.norm(h))
    assert h @ np.cross(m, b) <= 1e-12 * np.linalg.norm(b) * (h @ h)


def test_it_may_let_the_momentum_grow_to_brake_more_of_it_later():
    """Where the field that comes brakes more of a momentum that is turned away from it first."""
    keys = {"gain_a_m2_per_n_m_s": 60.0, "look_ahead_s": 600.0}
    p = NonMonotonicDerivative(**keys, **KEYS).parameters()
    omega = tuple(np.linalg.solve(J, [math.cos(0.63), math.sin(0.63), 0.0]))
    b, later = np.array([3e-5, 0.0, 0.0]), 3e-5 * np.array([math.cos(2.9), math.sin(2.9), 0.0])
    b_rate = tuple((later - b) / 600.0 - np.cross(omega, b))
    m = non_monotonic_derivative(inputs(b=tuple(b), b_rate=b_rate, omega=omega), p, ())
    assert (J @ omega) @ np.cross(m, b) > 0.0


def test_the_filtered_rate_of_the_field_becomes_that_of_a_search_coil():
    """A field that changes at a constant rate along the orbit, in a body that turns."""
    keys = {"gain_a_m2_per_n_m_s": 60.0, "look_ahead_s": 600.0}
    direct = NonMonotonicDerivative(**keys, **KEYS).parameters()
    p, memory = at_start(NonMonotonic(**keys, filter_s=10.0, **KEYS))
    omega = np.array([0.1, -0.2, 0.15])
    start, along = np.array([2e-5, 1e-5, -2e-5]), np.array([-1e-8, 3e-8, 2e-8])
    for k in range(1200):  # a dozen times the filter's time and more
        t = 0.2 * k
        turn = Rotation.from_rotvec(t * omega).inv()
        b, orbital = turn.apply(start + t * along), turn.apply(along)
        b_rate = tuple(orbital - np.cross(omega, b))
        row = inputs(t, b=tuple(b), b_rate=b_rate, omega=tuple(omega))
        found = non_monotonic(row, p, memory)
    assert found == pytest.approx(non_monotonic_derivative(row, direct, ()), rel=1e-6)


# ------------------------------------------------------------- flown

FLOWN = {
    "non_monotonic": {"gain_a_m2_per_n_m_s": 60.0, "inertia_kg_m2": [1.0, 1.3, 1.7]},
    "bdot_weighted": {
        "gain_n_m_s": 0.02, "weight_s": 3.0, "reference_deg_s": 2.0, "averaging_s": 60.0,
    },
    "bdot_normalised": {"gain_n_m_s": 0.02},
    "bcross": {"gain_n_m_s": 0.02},
    "momentum_projection": {"gain_per_s": 0.02, "inertia_kg_m2": [1.0, 1.3, 1.7]},
    "non_monotonic_derivative": {"gain_a_m2_per_n_m_s": 60.0, "inertia_kg_m2": [1.0, 1.3, 1.7]},
}  # fmt: skip


@pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
@pytest.mark.parametrize("kind", slow_after(2, [*FLOWN]))
def test_it_slows_every_member_side_by_side_as_alone(kind):
    """Forty tip-offs in lanes; three of them have the bits of their own runs."""
    text = SCENARIO.replace('{ kind = "bdot_rate", gain_a_m2_s_per_t = 1e5 }', '{ kind = "off" }')
    scenario = scenario_from_text(text).replace("control.law", {"kind": kind, **FLOWN[kind]})
    outcomes = {"left": outcome("rate_deg_s", at_end=True)}
    made = campaign(scenario, outcomes=outcomes, success={})
    flying = Fleet(scenario, made)
    assert flying.why_not_in_lanes == ""
    flown = flying.fly(np.arange(made.runs))
    start = np.linalg.norm(flown.drawn["initial.rate_deg_s"], axis=1)
    assert np.all(flown.outcomes["left"] < start)
    for member in (0, 17, 39):
        alone = torquer.simulate(member_scenario(scenario, made, member))
        rate = np.degrees(np.linalg.norm(alone["omega_body"].values, axis=1))[-1]
        assert flown.outcomes["left"][member] == rate
