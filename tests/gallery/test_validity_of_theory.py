"""Where the gallery's theory does not hold: refused with one line, or noted."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from gallery.theory.mathieu import (
    edges,
    first_tongue,
    first_tongue_of_strength,
    first_tongue_solutions,
    half_trace_series,
    mathieu_equation,
    multipliers_from_half_trace,
)
from gallery.theory.pitch_wheel import (
    free_rates,
    orbital_field,
)
from gallery.theory.planar_magnet import (
    pitch_acceleration,
    tongue_edges,
    tracking_motion,
    uniform_rotation,
)
from gallery.theory.steady_bdot import (
    PITCH,
    ROLL,
    SteadyBdot,
    gravity_rates,
    motion_from_rest,
    published_offset,
    published_swing,
    steady_bdot_response,
)
from torquer.compile import engine


def one_line(error) -> bool:
    return "\n" not in str(error) and 0 < len(str(error)) < 400


WRONG = [
    (lambda: first_tongue(3.0), r"chi: must lie within -1\.\.1 \(beyond.*\); received 3"),
    (lambda: first_tongue_solutions(-1.5, 0.0), r"chi: must lie within -1\.\.1"),
    (lambda: first_tongue_of_strength([0.1, 8.0]), r"strength: .*; received 8"),
    (lambda: half_trace_series(-1.0, 0.1), "lambda2: must lie within 0.*; received -1"),
    (lambda: orbital_field("averaged", 20.0), r"inclination: must lie within 0\.\.3\.14"),
    (lambda: pitch_acceleration(0.1, 0.2, 0.3, 0.4, -1), r"mu: must be 0 .* received -1"),
    (lambda: tracking_motion(0.5, -1.0, 1), "lambda2: must be above 0"),
    (lambda: tracking_motion(50.0, 1.0, 1), r"eta: must lie within -3\.\.3 \(3 \(A - B\)/C"),
    (lambda: tongue_edges(uniform_rotation, 5.0), r"eta: must lie within -3\.\.3"),
    (
        lambda: free_rates([0, 0, 1, 0, math.pi / 2, 0], (1, 1, 1), 0.0),
        "beta: must not be 90 deg",
    ),
    (
        lambda: gravity_rates(0.5, np.array([0, 1, 0, 0, math.pi / 2, 0])),
        "roll: must not be 90 deg",
    ),
    (
        lambda: motion_from_rest(SteadyBdot(ratio=0.5, eps=0.1, inclination_deg=1.0), 0),
        "revolutions: ",
    ),
]


@pytest.mark.parametrize(("action", "message"), WRONG, ids=[message for _, message in WRONG])
def test_a_mistake_is_one_line(action, message):
    with pytest.raises(ValueError, match=f"^{message}") as caught:
        action()
    assert one_line(caught.value)


@pytest.mark.skipif(not engine.COMPILED, reason="takes half a minute in plain Python")
def test_what_does_not_settle_is_an_arithmetic_error():
    with pytest.raises(ArithmeticError, match="edges: the transition matrix must converge at all"):
        edges(mathieu_equation.with_parameters(q=1e12), "a", [-2e6, -1e6, 0.0])


numbers = st.one_of(st.floats(-10.0, 10.0), st.floats(allow_nan=False, allow_infinity=False))
MANY = settings(max_examples=150 if engine.COMPILED else 30, deadline=None)


def answered(action):
    """The answer, or None where it is refused with one line."""
    try:
        with np.errstate(all="ignore"):
            return action()
    except (ValueError, ArithmeticError) as error:
        assert one_line(error), error
        return None


@MANY
@given(ratio=st.floats(1e-12, 1.0, exclude_max=True, exclude_min=True), eps=st.floats(1e-9, 1e9),
       inclination=st.floats(0.0, 180.0), u=numbers)  # fmt: skip
def test_leans_are_small_or_refused(ratio, eps, inclination, u):
    case = SteadyBdot(ratio=ratio, eps=eps, inclination_deg=inclination)
    offset = answered(lambda: published_offset(case))
    if offset is not None:
        assert max(abs(offset.pitch), abs(offset.roll)) <= 0.5
        assert bool(offset.notes) == (max(abs(offset.pitch), abs(offset.roll)) > 0.34)
        swing = answered(lambda: published_swing(case, [u]))
        assert swing is None or max(np.abs(swing.pitch).max(), np.abs(swing.roll).max()) <= 1.0
        assert (swing is None) == (eps * abs(u) > 10.0)
    found = answered(lambda: steady_bdot_response(case))
    if found is not None:
        swings = eps * np.abs(found.at(np.linspace(0.0, 6.0, 7))[:, [PITCH, ROLL]]).max()
        assert swings < 0.35 or found.notes


@MANY
@given(chi=numbers, strength=numbers, lambda2=numbers, half=numbers)
def test_series_are_finite_or_refused(chi, strength, lambda2, half):
    for action in (
        lambda: first_tongue(chi),
        lambda: first_tongue_of_strength(strength),
        lambda: first_tongue_solutions(chi, 0.3),
        lambda: half_trace_series(lambda2, chi),
    ):
        found = answered(action)
        assert found is None or np.all(np.abs(found) < 100.0)
    if abs(half) < 1e150:
        rho = multipliers_from_half_trace(half)
        assert np.prod(rho) == pytest.approx(1.0, rel=1e-12)


@settings(max_examples=40, deadline=None)
@given(eta=st.floats(-4.0, 4.0), lambda2=st.floats(-1.0, 400.0), mu=st.sampled_from([0, 1]))
def test_tracking_follows_or_is_refused(eta, lambda2, mu):
    found = answered(lambda: tracking_motion(eta, lambda2, mu))
    assert found is None or np.abs(found[:, 0]).max() < 0.5 * math.pi + 0.35
