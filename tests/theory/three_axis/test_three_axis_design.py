"""Search on grids, margins, and the gain design."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from attitude_holds import CUBESAT, at_strength, damping, gains_of, hold

from torquer.compile import engine
from torquer.computer.laws.periodic_gains import PeriodicGains
from torquer.computer.laws.projected_pd import ProjectedPd
from torquer.theory.three_axis.averaged import channel_factors, plateau_edge
from torquer.theory.three_axis.feedback import attitude_keys
from torquer.theory.three_axis.gain_search import (
    DesignTask,
    assess,
    design_gains,
    error_text,
    least_held,
)
from torquer.theory.three_axis.margins import (
    best_factors,
    degrees_with_margin,
    delay_margin_s,
    find_margins,
    gain_margins,
    inertia_margin,
    mixed_family,
    scaled_family,
)
from torquer.theory.three_axis.response import Noise
from torquer.theory.three_axis.sampled import Cycle, SampledHold, delayed_degree, sampled_family
from torquer.theory.three_axis.search import first_crossing, greatest

ALONE = np.empty((1, 0))

# search


def test_the_search_finds_a_corner():
    """The least of three planes, whose greatest value is where they meet; a wall beside it."""
    corner, normals = np.array([0.3137, -0.7718]), np.array([[1.0, 0.5], [-1.0, 2.0], [0.2, -1.0]])

    def roof(points):
        values = -((points - corner) @ normals.T).max(axis=1)
        return np.where(points[:, 0] > 0.9, -np.inf, values)

    found = greatest(roof, (-2.0, -2.0), (2.0, 1.5), 21, 1e-6)
    assert found.point == pytest.approx(corner, abs=1e-5)
    assert -1e-5 < found.value <= 0.0
    assert (found.spacing <= 1e-6).all()
    assert found.evaluations < 20_000


def test_search_takes_higher_of_two_tops_and_follows_a_ridge():
    def two(points):
        x, y = points.T
        ridge = -np.abs(y - x) - 0.01 * np.abs(x - 1.234)
        return np.maximum(ridge, 0.5 - 30.0 * np.hypot(x + 1.5, y - 1.7))

    found = greatest(two, (-2.0, -2.0), (2.0, 2.0), 41, 1e-5)
    assert found.point == pytest.approx([-1.5, 1.7], abs=1e-4)
    assert found.value == pytest.approx(0.5, abs=1e-3)
    assert found.ends == (0, 0)
    on_the_rim = greatest(lambda p: p.sum(axis=1), (0.0, 0.0), (1.0, 2.0), 5, 1e-3)
    assert on_the_rim.point == pytest.approx([1.0, 2.0]) and on_the_rim.ends == (1, 1)
    least = greatest(lambda p: p[:, 0] - p[:, 1], (0.0, 0.0), (1.0, 2.0), 5, 1e-3)
    assert least.ends == (1, -1)
    with pytest.raises(ArithmeticError, match="a point of the box must be allowed"):
        greatest(lambda p: np.full(len(p), -np.inf), (0.0,), (1.0,), 5, 0.1)


def test_the_first_crossing_is_the_first():
    wave = np.linspace(0.0, 10.0, 41)
    assert first_crossing(np.cos, wave) == pytest.approx(0.5 * math.pi, abs=1e-5)
    assert math.isnan(first_crossing(np.cosh, wave))
    assert first_crossing(lambda x: -x - 1.0, wave) == 0.0


# margins


@pytest.fixture(scope="module")
def sampled():
    """A hold near its best gains, in an inertial attitude with gravity gradient."""
    return SampledHold(at_strength(hold(70.0, gravity_gradient=True), 2.7, 1.6), Cycle(20.0))


def test_gain_margins_are_where_the_degree_vanishes(sampled):
    low, high = gain_margins(sampled)
    degrees = scaled_family(sampled).degrees(np.array([[low], [high], [1.02 * low], [0.98 * high]]))
    assert 0.2 < low < 0.6 and 1.2 < high < 3.0
    assert np.abs(degrees[:2]).max() < 1e-5 and (degrees[2:] > 1e-3).all()
    # a factor of the dipole is one of both gains
    k, k_a = gains_of(sampled.hold)
    more = sampled.hold.with_parameters(rate_gain=1.4 * k, angle_gain=1.4 * k_a)
    same = sampled_family(replace(sampled, hold=more)).degrees(ALONE)[0]
    assert scaled_family(sampled).degrees(np.array([[1.4]]))[0] == pytest.approx(same, abs=1e-12)


def test_the_delay_margin_is_where_delayed_loops_become_unstable(sampled):
    """Against short cycles with whole ones of delay; their own hold counts by half."""
    found = delay_margin_s(sampled)
    fine = replace(sampled, cycle=Cycle(found / 40.5))
    late = [delayed_degree(fine, round(part * 40)) for part in (0.9, 1.0, 1.1)]
    assert late[0] > 0.01 and late[2] < -0.01 and abs(late[1]) < 0.3 * late[0]


def test_the_inertia_margin_is_that_of_the_worst_corner(sampled):
    tight = SampledHold(at_strength(hold(**CUBESAT), 1.0), Cycle(20.0))
    found = inertia_margin(tight)
    assert found < 0.1  # two moments are nearly equal: gravity turns against the law
    found, moments = inertia_margin(sampled), np.array([1.0, 2.0, 1.5])
    assert 0.1 < found <= 0.5
    rng = np.random.default_rng(6)
    for _ in range(10):
        trial = moments * (1.0 + found * rng.choice([-1.0, 1.0], 3))
        if 2.0 * trial.max() < trial.sum():
            other = replace(sampled, hold=sampled.hold.with_inertia(trial))
            assert sampled_family(other).degrees(ALONE)[0] > 0.0


def test_factors_of_laws_make_the_loop_of_their_sum(sampled):
    """A damper and a spring as two laws: the three-axis law."""
    zero, one, keys = np.zeros((3, 3)).tolist(), np.eye(3).tolist(), attitude_keys(sampled.hold)
    damper = PeriodicGains(rate_gains_n_m_s_per_t2=[one], angle_gains_n_m_per_t2=[zero], **keys)
    spring = PeriodicGains(rate_gains_n_m_s_per_t2=[zero], angle_gains_n_m_per_t2=[one], **keys)
    family = mixed_family(sampled, [damper.law(), spring.law()])
    pair = np.array([gains_of(sampled.hold)])
    own = sampled_family(sampled).degrees(ALONE)
    assert family.degrees(pair) == pytest.approx(own, rel=1e-9)
    most = gain_margins(sampled)[1]
    within, beyond = (degrees_with_margin(family, pair, f * most)[0] for f in (0.99, 1.01))
    assert within == pytest.approx(own[0]) and beyond == -np.inf
    low, high = 0.2 * pair[0], 5.0 * pair[0]
    best = best_factors(family, low, high, gain_margin=1.5, count=9, spacing=0.02)
    assert best.value > own[0] and (best.point > low).all() and (best.point < high).all()
    trials = low * (high / low) ** np.random.default_rng(5).random((100, 2))
    assert degrees_with_margin(family, trials, 1.5).max() < best.value * 1.01


def test_an_unstable_loop_has_no_margins():
    weak = SampledHold(at_strength(hold(70.0, gravity_gradient=True), 0.5), Cycle(60.0))
    assert all(map(math.isnan, find_margins(weak)))


# design


@pytest.fixture(scope="module")
def task(sampled):
    return DesignTask(sampled, limit_a_m2=0.2, noise=Noise(1e-3, 1e-5))


@pytest.fixture(scope="module")
def made(task):
    return design_gains(task)


def pair_of(candidate):
    values = candidate.law.values()
    return values["rate_gain"], values["angle_gain"]


def test_the_formula_is_on_the_edge_of_the_plateau(made, task):
    k, k_a = pair_of(made.formula)
    mu = channel_factors((1.0, 2.0, 1.5), damping(task.sampled.hold))
    assert k_a == pytest.approx(float(plateau_edge(mu, k)), rel=1e-4)
    assert made.strengths[0] == pytest.approx(1.0)
    assert made.formula.error is None
    assert made.formula.verdict.lines() == ["doubtful: the loop is unstable"]


def test_a_notebook_shows_a_row_for_each_law(made):
    shown = made._repr_html_()
    assert shown.count("<tr>") == 4
    assert "<td>formula</td>" in shown and "the loop is unstable" in shown
    assert f"<td>{made.refined.settling_s / 3600.0:.3g}</td>" in shown


def test_no_gains_nearby_or_far_beat_the_refined_ones(made, task):
    """With the same margin and within the same limit, in the sampled loop of the search."""
    quick = replace(task.sampled, cycle=Cycle(22.0))
    best, rng = np.array(pair_of(made.refined)), np.random.default_rng(3)
    spreads = np.repeat([0.02, 1.0], 150)[:, None]
    trials = best * np.exp(spreads * rng.normal(size=(300, 2)))
    corners = dict(zip(("rate_gain", "angle_gain"), ((1e3, 1e8), (1.0, 1e5)), strict=True))
    family = sampled_family(quick, corners)
    own, others = family.degrees(best[None])[0], family.degrees(trials)
    better = trials[others > own * (1.0 + 5e-3)]
    with_margin = [family.degrees(factor * better) > 0.0 for factor in (math.sqrt(2.0), 2.0)]
    assert len(better) > 3 and not np.logical_and(*with_margin).any()
    assert made.refined.margins.greatest_gain == pytest.approx(2.0, abs=0.01)
    assert made.search.value == pytest.approx(own, abs=5e-3)


def test_any_law_that_holds_the_attitude_can_be_assessed(task):
    """That of Lovera and Astolfi, without a field's strength; what is doubtful is reported."""
    keys, n = attitude_keys(task.sampled.hold), task.sampled.hold.rate_rad_s
    law = ProjectedPd(rate_gain_n_m_s=3.0 * n, angle_gain_n_m=6.0 * n * n, **keys).law()
    found = assess(task, law)
    again = sampled_family(task.sampled.with_law(law)).degrees(ALONE)[0]
    assert found.degree == pytest.approx(again) and found.degree > 0.0
    assert found.error.greatest_rad == pytest.approx(
        task.error_of(task.sampled.with_law(law)).greatest_rad
    )
    assert any("averaged equations do not hold" in note for note in found.notes)
    lost = assess(task, ProjectedPd(rate_gain_n_m_s=1e-3 * n, angle_gain_n_m=0.0, **keys).law())
    assert lost.margins is None and lost.settling_s == math.inf
    assert "doubtful: the loop is unstable" in lost.verdict.lines()


def test_the_coils_bound_the_gains(sampled):
    """A tenth of the dipole that the best gains would ask for at the linear range."""
    quiet = replace(sampled, hold=hold(70.0))
    free = pair_of(design_gains(DesignTask(quiet, 10.0)).refined)
    b = np.linalg.norm(quiet.maps.b_body_t, axis=1).max()
    asked = b * (2.0 * free[1] + quiet.hold.rate_rad_s * free[0]) * math.radians(10.0)
    tight = design_gains(DesignTask(quiet, 0.1 * asked))
    for each in (tight.formula, tight.refined):
        k, k_a = pair_of(each)
        size = b * (2.0 * k_a + quiet.hold.rate_rad_s * k) * math.radians(10.0)
        assert size <= 0.1 * asked * (1.0 + 1e-6)
    assert 0.0 < tight.refined.degree < tight.formula.degree * 1.5
    assert tight.refined.degree >= tight.formula.degree * (1.0 - 1e-3)


def test_the_regulator_points_better(made):
    assert isinstance(made.regulator.law.spec, PeriodicGains)
    assert made.regulator.margins.greatest_gain > 2.0
    assert made.regulator.error.rms_rad < 0.6 * made.refined.error.rms_rad
    assert made.regulator.settling_s == pytest.approx(
        math.log(50.0) / made.regulator.degree / 1.1443e-3, rel=1e-3
    )


def test_rounding_is_not_printed_as_an_error(made):
    """A turn of 1e-16 is none; one of 1e-3 rad is an angle."""
    error, turn = made.refined.error, np.array([[0.0, 1.0, 0.0]])
    assert error_text(replace(error, turns=1e-16 * turn)) == "0"
    assert error_text(replace(error, turns=1e-3 * turn)) == "0.0573"
    assert error_text(replace(error, turns=turn)) == "beyond"


def test_messages(sampled):
    with pytest.raises(ValueError, match="limit_a_m2: must be above 0; received 0"):
        DesignTask(sampled, 0.0)
    with pytest.raises(ValueError, match=r"linear_range_deg: must lie within 0\.\.90"):
        DesignTask(sampled, 1.0, linear_range_deg=100.0)
    with pytest.raises(ValueError, match=r"gain_margin: must lie within 1\.\.100; received 0.5"):
        DesignTask(sampled, 1.0, gain_margin=0.5)
    with pytest.raises(ArithmeticError, match="gain margin of 50 within the coils' limit of 1e-05"):
        design_gains(DesignTask(sampled, 1e-5, gain_margin=50.0))


def test_a_field_that_does_not_turn_is_named_as_the_cause():
    """An equatorial orbit in the untilted dipole: nothing acts about the orbit's normal."""
    held = hold(0.0, field="direct_dipole", reference="orbital", gravity_gradient=True)
    with pytest.raises(ValueError, match=r"the field does not turn along this orbit.*received 0$"):
        design_gains(DesignTask(SampledHold(held, Cycle(1.0)), 3.2))


def test_fields_of_one_plane_leave_half_of_a_torque_about_each_of_its_axes():
    u = np.linspace(0.0, 2.0 * math.pi, 12, endpoint=False)
    circle = 3e-5 * np.stack([np.cos(u), np.sin(u), 0.0 * u], axis=1)
    assert least_held(circle) == pytest.approx(0.5)
    assert least_held(circle[:1]) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.skipif(not engine.COMPILED, reason="minutes without JIT")
def test_a_torque_beyond_the_coils_is_doubtful_not_a_missing_regulator():
    """All regulators saturate: the one that errs least is given, and says so."""
    sampled = SampledHold(hold(**CUBESAT), Cycle(20.0))
    task = DesignTask(sampled, 0.1, constant_torque_n_m=(0.0, 0.0, 1e-5))
    for each in design_gains(task).candidates.values():
        assert each.degree > 0.0
        assert "the coils saturate" in " ".join(each.verdict.lines())


@pytest.mark.skipif(not engine.COMPILED, reason="minutes without JIT")
def test_the_example_of_the_docs_runs(capsys):
    """Its CubeSat: ten degrees by scalar gains, less than one by the regulator."""
    text = (Path(__file__).parents[3] / "docs/theory/three-axis.md").read_text(encoding="utf-8")
    names = {}
    exec(text.split("```python\n")[1].split("```")[0], names)
    design = names["design"]
    assert math.degrees(design.refined.error.greatest_rad) == pytest.approx(10.0, abs=0.1)
    assert math.degrees(design.regulator.error.greatest_rad) == pytest.approx(0.82, abs=0.01)
    assert "regulator" in capsys.readouterr().out
    assert names["exact"].degree > 0.6 and names["chart"].degree_of_stability.shape == (50, 50)
