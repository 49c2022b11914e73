"""Where the theory does not hold: refused with one line, or noted; wide ranges of arguments."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from torquer.compile import engine
from torquer.computer.laws.bdot import BdotRate
from torquer.theory.periodic.floquet import degree_of_stability, exponents
from torquer.theory.periodic.poincare import (
    equidistant_points,
    forced_response,
)
from torquer.theory.slow.averaging import averaged_rates, converged_nodes, nodes
from torquer.theory.slow.comparison import compare, resonances
from torquer.theory.slow.evolution import EVOLUTIONS, bdot, nutation_damping, reorientation, spin_up
from torquer.theory.slow.evolution.model import Case, Slow, compile_rates
from torquer.theory.slow.full_motion import Fast, by_euler, osculating, slow_variables
from torquer.theory.slow.orbit_field import OrbitField
from torquer.theory.slow.second_moments import averaged_moments, closed_moments
from torquer.theory.slow.slow_motion import (
    ClosedMotion,
    evolve,
    follow_path,
    map_evolution,
)
from torquer.theory.slow.spinner import Spinner
from torquer.theory.slow.wheel_accumulation import (
    Held,
    air_torque,
    cyclic_bounds,
    held_torque,
    momentum_growth,
    momentum_under,
    orbital_axes,
    saturation_time,
)
from torquer.theory.validity import Limit, broken_limits, within

START, UP = Slow(1.0, 0.9, 0.4, 1.1), (0.0, 0.0, 1.0)
U = np.linspace(0.0, 60.0, 21)


def case_of(inclination_deg=60.0, ratio=0.7, eps=0.05, target=UP):
    return Case(eps, ratio, averaged_moments(math.radians(inclination_deg)), target)


def one_line(error) -> bool:
    return "\n" not in str(error) and 0 < len(str(error)) < 400


# ------------------------------------------------------------ the mechanism


def test_a_limit_in_words():
    assert Limit("x", 1.0, 2.0).must == "must lie within 1..2"
    assert Limit("x", 1.0, 2.0, open=True).must == "must lie within 1..2, ends left out"
    assert Limit("x", 0.0, open=True).must == "must be above 0"
    assert Limit("x", most=3.0).must == "must be at most 3"
    assert broken_limits((Limit("x", 0.0, 1.0, "why"), 2.5), (Limit("y", 0.0), 1.0)) == (
        "x = 2.5: must lie within 0..1 (why)",
    )


@given(st.floats(allow_nan=True, allow_infinity=True))
def test_what_is_within_is_finite_and_between(x):
    closed, strict = Limit("x", -1.0, 2.0), Limit("x", -1.0, 2.0, open=True)
    assert closed.holds(x) == (-1.0 <= x <= 2.0) and strict.holds(x) == (-1.0 < x < 2.0)
    if closed.holds(x):
        within(closed, x)
    else:
        with pytest.raises(ValueError, match=r"^x: must (lie within -1\.\.2|be finite); received"):
            within(closed, [0.0, x])


# ------------------------------------------------------------ one line for each mistake

BDOT, FIELD = EVOLUTIONS["bdot"], OrbitField(1, 1.0, 1.0, 0.0)
NORMAL = np.array([0.0, 0.0, 1.0])
GROWTH = momentum_growth(Held(1e-3, NORMAL, np.tile([0.0, 0.0, 1e-5], (24, 1))))
SPINNER = Spinner(inclination_deg=60.0)
RATE_LAW = BdotRate(gain_a_m2_s_per_t=0.1).law()
WRONG = [
    (lambda: evolve(BDOT, case_of(), START._replace(l=-0.5), U), r"l: must be above 0 .* -0.5"),
    (lambda: evolve(BDOT, case_of(), START._replace(rho=-0.1), U), r"rho: must lie within 0\.\."),
    (lambda: evolve(BDOT, case_of(), START._replace(theta=4.0), U), "theta: must lie within 0"),
    (lambda: evolve(BDOT, case_of(), START._replace(sigma=math.inf), U), "sigma: must be finite"),
    (lambda: evolve(BDOT, case_of(eps=math.nan), START, U), "eps: must be finite"),
    (lambda: evolve(BDOT, case_of(ratio=2.5), START, U), r"ratio: must lie within 0\.\.2 \(C/A"),
    (lambda: evolve(BDOT, case_of(), START, U, rtol=0.0), "rtol: must lie within 1e-14"),
    (
        lambda: evolve(BDOT, Case(0.1, 0.7, (0.5, 0.6, 0.2, 0.0, 0.0, -0.2)), START, U),
        r"moments: must be those of the averaged field for bdot, \(p, p, 1 - 2p, 0, 0, 0\)",
    ),
    (
        lambda: evolve(EVOLUTIONS["preliminary_1"], case_of(target=(1.0, 0.0, 0.0)), START, U),
        r"target: must lie along the cone axis, \(0, 0, 1\), for preliminary_1; received",
    ),
    (lambda: evolve(EVOLUTIONS["reorientation"], case_of(), START, U), "theta: .*spin along the"),
    (lambda: BDOT.case(math.inf, SPINNER), "gain: must be finite"),
    (lambda: BDOT.case(1e305, Spinner(inclination_deg=1.0, strength_t=1e3)), "eps: must be finite"),
    (lambda: averaged_rates(RATE_LAW, SPINNER, Slow(1.0, 0.0, 0.0, 1.0)), "rho: .*third axis"),
    (lambda: averaged_rates(RATE_LAW, SPINNER, Slow(1.0, math.pi, 0.0, 1.0)), "rho: .*third axis"),
    (lambda: converged_nodes(RATE_LAW, SPINNER, math.nan), "tolerance: must be finite"),
    (lambda: nodes(phi=2.5), "nodes: phi must be at least 1; received 2.5"),
    (lambda: bdot.sphere(U, case_of(ratio=0.7), 0.5), r"ratio: .*\(the solution is that of a sph"),
    (lambda: bdot.even_field(U, case_of(60.0), 0.5), r"3p: .* 45\.577 deg\); received"),
    (lambda: nutation_damping.special_case(U, case_of(), -0.1), "theta: must lie within"),
    (lambda: spin_up.special_case([-1e3], case_of()), "l: must be above 0 .*zero momentum"),
    (
        lambda: reorientation.to_cone_axis(U, case_of(target=(0.1, 0.0, 1.0)), 0.5),
        "target across the cone axis: must lie",
    ),
    (
        lambda: map_evolution(
            BDOT,
            {"rho_deg": [10.0, 200.0]},
            {"inclination_deg": 1.0, "sigma_deg": 0.0, "theta_deg": 1.0, "eps": 0.1},
            1.0,
        ),
        r"rho_deg: must lie within 0\.\.180; received 200",
    ),
    (
        lambda: osculating(RATE_LAW, SPINNER, START._replace(theta=0.0), Fast(0, 0), U),
        "theta: must",
    ),
    (lambda: osculating(RATE_LAW, SPINNER, START._replace(rho=0.0), Fast(0, 0), U), "rho: .*third"),
    (lambda: by_euler(RATE_LAW, SPINNER, START, Fast(math.nan, 0), U), "fast: must be finite"),
    (lambda: resonances(SPINNER, START, width=math.nan), "width: must be finite"),
    (lambda: compare(RATE_LAW, SPINNER, START, Fast(0, 0), 1.0, points=1), "points: must be at"),
    (lambda: exponents([2.0, 0.5], 0.0), "period: must be above 0; received 0"),
    (lambda: degree_of_stability(np.array([2.0, 0.5]), -1.0), "period: must be above 0"),
    (lambda: closed_moments(FIELD, -1.0), r"inclination: must lie within 0"),
    (lambda: closed_moments(FIELD._replace(model=7), 1.0), r"model: must lie within 0\.\.2"),
    (lambda: closed_moments(FIELD._replace(strength_t=0.0), 1.0), "strength_t: must be above 0"),
    (lambda: equidistant_points(0.0, 5), "period: must be above 0"),
    (lambda: equidistant_points(1.0, 0), "samples: must be at least 1"),
    (lambda: forced_response([[-1.0]], np.ones((8, 1)), math.nan), "period: must be finite"),
    (lambda: momentum_under((1.0, 0.0, 0.0), NORMAL, 0.0, [1.0]), "rate_rad_s: must be above 0"),
    (lambda: cyclic_bounds((1.0, 0.0, 0.0), 2.0 * NORMAL, 1.0), "length of the normal: must lie"),
    (lambda: orbital_axes([math.nan, 0.0, 0.0]), "offset_rad: must be finite"),
    (lambda: held_torque(np.eye(3), -1.0, np.eye(3)), "rate_rad_s: must be above 0; received -1"),
    (lambda: air_torque(None, -1.0, 7e6, 1e-3, np.eye(3)), "density_kg_m3: must be at least 0"),
    (lambda: saturation_time(GROWTH, [[math.nan, 0.0, 0.0]]), "half_spaces: must be finite"),
    (
        lambda: momentum_growth(Held(1e-3, NORMAL, np.ones((2, 3)))),
        "instants of a revolution: must be",
    ),
]


@pytest.mark.parametrize(("action", "message"), WRONG, ids=[message for _, message in WRONG])
def test_one_line(action, message):
    with pytest.raises(ValueError, match=f"^{message}") as caught:
        action()
    assert one_line(caught.value)


def test_a_run_into_a_singular_point_is_one_line():
    problem = ClosedMotion(compile_rates(spin_up.spin_up_rates), case_of(90.0, eps=0.1))
    with pytest.raises(
        RuntimeError, match=r"^motion: must stay away from the singular points"
    ) as caught:
        follow_path(problem, (1.0, 0.0, 0.0, math.pi), [0.0, 5.0, 40.0])
    assert "between u = 5 and 40" in str(caught.value) and one_line(caught.value)


@pytest.mark.skipif(not engine.COMPILED, reason="a million steps take minutes in plain Python")
def test_a_motion_too_fast_for_its_points_is_one_line():
    """The message gives how far it came, and does not call that the end of its domain."""
    case, start, u = case_of(54.58, 1.935, 136.0), Slow(3e-6, 0.0245, -0.08, 0.0), [0.0, 4.5]
    law = EVOLUTIONS["preliminary_1"]
    problem = ClosedMotion(compile_rates(law.rates), case)
    for error, integrate in (
        (ValueError, lambda: evolve(law, case, start, u, rtol=1e-8)),
        (RuntimeError, lambda: follow_path(problem, start, u, rtol=1e-8)),
    ):
        with pytest.raises(error) as caught:
            integrate()
        assert "at most 1000000 steps between two points; received 0 and 4.5" in str(caught.value)
        assert "came to 0.358" in str(caught.value) and one_line(caught.value)


def test_without_momentum_there_are_no_angles():
    found = slow_variables(
        SPINNER, [[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0, 0.1, 0.0, 0.2]]
    )
    assert found.l[0] == 0.0
    assert np.isnan([found.rho[0], found.sigma[0], found.theta[0]]).all()
    assert np.isfinite(np.array(found)[:, 1]).all()


# ------------------------------------------------------------ wide ranges: right, or refused

numbers = st.one_of(st.floats(-10.0, 10.0), st.floats(allow_nan=False, allow_infinity=False))
angles = st.one_of(st.floats(0.0, math.pi), st.sampled_from([0.0, math.pi, 0.5 * math.pi]), numbers)
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
@given(
    name=st.sampled_from(list(EVOLUTIONS)),
    start=st.tuples(st.one_of(st.floats(1e-3, 10.0), numbers), angles, numbers, angles),
    eps=st.floats(-200.0, 200.0),
    ratio=st.one_of(st.floats(0.0, 2.0), numbers),
    inclination=st.floats(0.0, 180.0),
    target=st.one_of(st.just(UP), st.tuples(*3 * [st.floats(-3.0, 3.0)])),
    end=st.floats(-20.0, 20.0),
)
def test_slow_motion_is_valid_or_refused(name, start, eps, ratio, inclination, target, end):
    evolution = EVOLUTIONS[name]
    u, case = np.linspace(0.0, end, 5), case_of(inclination, ratio, eps, target)
    path = answered(lambda: evolve(evolution, case, Slow(*start), u, rtol=1e-8))
    if path is None:
        return
    ended = np.isnan(path.l)
    assert ended.any() == (path.ended is not None) and not ended[0]
    assert np.array_equal(ended, np.isnan(path.theta))
    l, rho, sigma, theta = (x[~ended] for x in path)  # noqa: E741
    assert np.all(l > 0.0) and np.all(np.isfinite(l) & np.isfinite(sigma))
    for angle in (rho, theta):
        assert np.all((angle >= 0.0) & (angle <= math.pi))
    if path.ended is not None:
        assert path.notes[0].startswith("stops at u = ")
    if abs(eps) > 1.0:  # the reach is one or more, or l has grown
        assert evolution.change(path, case) > 0.25 or np.nanmin(l) > 1.0
    if evolution.change(path, case) > 0.25:
        assert any("the averages" in note for note in path.notes)


@MANY
@given(rho=angles, theta=angles, l=numbers, inclination=st.floats(0.0, 180.0))
def test_averages_are_finite_or_refused(rho, theta, l, inclination):  # noqa: E741
    spinner = Spinner(inclination_deg=inclination)
    slow = Slow(l, rho, 0.3, theta)
    found = answered(lambda: averaged_rates(RATE_LAW, spinner, slow, nodes(3, 1, 3)))
    assert found is None or np.all(np.isfinite(found)) or l < 1e-290 or l > 1e290
