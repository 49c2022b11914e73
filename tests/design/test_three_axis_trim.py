"""The trim of the residual dipole is offered where its promise lies within the linear theory."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from torquer.design import three_axis_answer, three_axis_trim
from torquer.theory.three_axis.response import greatest_angle
from torquer.theory.three_axis.sampled import SOURCES
from torquer.theory.validity import LEAN, VALID


def candidate(dipole_rad: float, rest_rad: float):
    """A law whose error is that of the residual dipole and of the source before it."""
    axis = np.array([[1.0, 0.0, 0.0]])
    by_source = {name: np.zeros((1, 3)) for name in SOURCES}
    by_source |= {SOURCES[0]: rest_rad * axis, SOURCES[1]: dipole_rad * axis}
    turns = sum(by_source.values())
    error = SimpleNamespace(
        turns=turns, by_source=by_source, greatest_rad=float(greatest_angle(turns))
    )
    return SimpleNamespace(error=error)


@pytest.mark.parametrize(
    ("rest_rad", "offered"), [(0.1, True), (0.9 * LEAN.most, True), (1.1 * LEAN.most, False)]
)
def test_what_it_leaves_is_told_within_the_linear_theory_alone(monkeypatch, rest_rad, offered):
    monkeypatch.setattr(three_axis_trim, "design_trim", lambda task: None)
    laws = {"hold": candidate(2.0, rest_rad), "other": candidate(2.0, 1.5 * LEAN.most)}
    found = three_axis_trim.offered_trim(None, laws, within_deg=1.0)
    assert (found is not None) == offered
    if offered:
        assert found.left_deg == {"hold": pytest.approx(math.degrees(rest_rad))}


def test_what_it_leaves_is_none_where_only_rounding_is_left():
    spec = SimpleNamespace(time_constant_s=1450.0, greatest_dipole_a_m2=0.1, coil_duty=1.0)
    design = SimpleNamespace(spec=spec, slowest_s=4000.0, verdict=VALID)
    told = three_axis_trim.TrimAnswer(design, {"refined": 3.28e-15, "own": 0.125}).lines()[1]
    assert "leaves refined 0 deg, own 0.125 deg;" in told


@pytest.mark.parametrize("trim_helps", [True, False])
def test_the_trim_is_advised_where_it_helps_alone(trim_helps):
    """Air turns a PocketQube at 300 km further than the linear theory goes, whatever its dipole."""
    error = candidate(2.0, 0.1 if trim_helps else 1.9).error
    shares, remedy = three_axis_answer._shares(error, trim_helps)
    assert f"{SOURCES[1]} " in shares
    assert ("let the law dipole_trim" in remedy) == trim_helps
    assert ("make the other causes less, too" in remedy) != trim_helps


def answer(laws, failed=None):
    """An answer with these laws; the trim helps the first of them."""
    trim = three_axis_trim.TrimAnswer(None, {next(iter(laws)): 1.0})
    return three_axis_answer.ThreeAxisAnswer(
        None, None, None, laws, {}, 30.0, (), trim, failed=failed
    )


def test_advice_is_for_the_law_that_the_trim_helps():
    laws = {"refined": candidate(2.0, 0.1), "formula": candidate(2.0, 1.9)}
    for each in laws.values():
        each.notes = ()
    found = answer(laws)
    assert "let the law dipole_trim" in found._notes_on("refined")[-1]
    assert "make the other causes less, too" in found._notes_on("formula")[-1]


def test_a_law_of_use_is_better_than_a_faster_one():
    laws = {"fast": candidate(2.0, 0.1), "unstable": SimpleNamespace(error=None, degree=9.0),
            "of use": candidate(0.1, 0.1)}  # fmt: skip
    laws["fast"].degree, laws["of use"].degree = 0.9, 0.5
    assert answer(laws).best() == "of use"
    assert answer(laws, failed="fast").best() == "fast"
