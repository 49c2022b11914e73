"""Columns in place of numbers: the bits of each alone, or a refusal; never a third."""

import math
from typing import NamedTuple

import numpy as np
import pytest
from pydantic import Field

from torquer.base.checked_columns import checked_columns, opened
from torquer.base.columns import (
    Column,
    Mixed,
    Own,
    Records,
    Refused,
    array_of,
    as_column,
    number,
    put_numbers,
    root,
    stacked,
    unstacked,
)
from torquer.base.computing import Computing, joined, spread
from torquer.base.spec import Inertia, Spec, Vector, unit_vector
from torquer.maths.geometry.quaternion import multiply, normalise
from torquer.maths.geometry.vec3 import as_vector, scale

COUNT = 40
rng = np.random.default_rng(5)
A, B = rng.normal(size=(2, COUNT)) * 10.0 ** rng.integers(-12, 12, (2, COUNT))


def present(count=COUNT):
    computing = Computing(count, set())
    return computing, computing.present()


FORMULAS = [
    lambda a, b: a + b, lambda a, b: a - b, lambda a, b: a * b, lambda a, b: a / b,
    lambda a, b: -a, lambda a, b: abs(a) + 2, lambda a, b: 1.0 - a, lambda a, b: 3 * b,
    lambda a, b: 1e-9 / b, lambda a, b: np.float64(0.1) * a + np.float64(3.0),
    lambda a, b: root(abs(a)), lambda a, b: scale(1e-9, (a, b, 1.0))[1],
    lambda a, b: multiply((a, b, 0.5, 2.0), (0.1, b, a, 1.0))[2],
    lambda a, b: as_vector([a, b, 3])[0] + number(b),
]  # fmt: skip


@pytest.mark.parametrize("formula", FORMULAS)
def test_a_column_has_the_bits_of_each_number(formula):
    alone = [formula(float(a), float(b)) for a, b in zip(A, B, strict=True)]
    _, here = present()
    with here:
        found = formula(Column(A), Column(B))
    assert [x.hex() for x in found.values.tolist()] == [float(x).hex() for x in alone]


REFUSED = [
    math.sin, float, int, math.sqrt, math.isfinite, hash, str, repr, lambda a: f"{a:g}",
    lambda a: np.array([a, 1.0]), lambda a: np.array([a, 1.0], float), np.sqrt, np.isfinite,
    lambda a: np.array([[1.0, 2.0]]) @ (a, a), lambda a: np.eye(3) * a, lambda a: np.sum([a, a]),
    lambda a: a**2, lambda a: a % 1.0, lambda a: a // 1.0, lambda a: a / 0.0, lambda a: round(a),
    lambda a: np.dot((a, a), (a, a)), lambda a: np.linalg.norm((a, a)), lambda a: 1.0 / (a - a),
    lambda a: [*a], lambda a: a[0], lambda a: np.maximum(a, 0.0), lambda a: np.asarray((a,)),
    math.floor, lambda a: math.hypot(a, a), lambda a: np.float64(a), lambda a: np.zeros(1) + a,
]  # fmt: skip


@pytest.mark.parametrize("function", REFUSED)
def test_what_might_round_in_another_way_refuses(function):
    _, here = present()
    with here, pytest.raises((Refused, TypeError, ValueError)):
        function(Column(A))


def test_a_condition_holds_for_all_or_tells_for_which():
    a = Column(np.array([1.0, 2.0, 3.0]))
    assert a > 0.0
    assert not a > 3.0
    assert a == a
    assert a != (1.0,)
    with pytest.raises(Mixed) as mixed:
        max(a, 2.0)
    assert mixed.value.one.tolist() == [False, True, False] or mixed.value.one.any()
    with pytest.raises(Mixed) as mixed:
        bool(a - 2.0)
    assert mixed.value.one.tolist() == [True, False, True]


class Parts(NamedTuple):
    """A result with parts."""

    number: float
    vector: tuple
    fixed: str
    array: np.ndarray


def in_sines(a, b):
    return Parts(math.sin(a), (b, math.cos(b), 1.0), "fixed", np.array([a, 1.0]))


def test_what_refuses_columns_is_done_one_by_one():
    computing, here = present()
    with here:
        found = spread("sines", in_sines, (Column(A), Column(B)))
    for k in range(COUNT):
        alone = in_sines(A[k], B[k])
        assert found.number.values[k] == alone.number
        assert [found.vector[0].values[k], found.vector[1].values[k]] == [*alone.vector[:2]]
        assert found.array[0].values[k] == A[k]
    assert (found.vector[2], found.fixed, found.array[1].values[0]) == (1.0, "fixed", 1.0)
    assert not computing.has_refused


def test_a_refusal_that_is_caught_is_not_forgotten():
    def caught(a):
        try:
            return float(a)
        except Exception:
            return 7.0

    _, here = present()
    with here:
        found = spread("caught", caught, (Column(A),))
    assert np.array_equal(found.values, A)


def test_errors_of_some_tell_which_are_sound():
    def positive(a):
        if float(a) <= 0.0:
            raise ValueError("must be positive")
        return a

    _, here = present()
    with here:
        with pytest.raises(Mixed) as mixed:
            spread("positive", positive, (Column(A),))
        assert np.array_equal(mixed.value.one, A > 0.0)
        with pytest.raises(Refused, match="no scenario"):
            spread("positive", positive, (Column(-np.abs(A)),))


def test_nothing_can_be_done_with_what_each_has_for_itself():
    _, here = present(2)
    with here:
        for use in (bool, len, list, str, lambda v: v + 1, lambda v: v == 1, lambda v: v < 1):
            with pytest.raises((Refused, TypeError)):
                use(Own([1, 2]))
        assert spread("own", lambda v: 0.5 * v, (Own([1, 2]),)).values.tolist() == [0.5, 1.0]


def test_stacks_and_nested_columns_are_the_same_numbers():
    values = rng.normal(size=(COUNT, 3, 3))
    columns = as_column(values)
    assert np.array_equal(stacked(columns), values)
    assert np.array_equal(stacked((columns[0], (1.0, 2.0, 3.0)))[:, 1], [[1.0, 2.0, 3.0]] * COUNT)
    assert unstacked(stacked(((1.0, 2.0), (3.0, 4.0))), 2) == ((1.0, 2.0), (3.0, 4.0))
    back = unstacked(values, 2)
    assert np.array_equal(back[2][1].values, values[:, 2, 1])


def test_records_of_each_have_their_own_numbers():
    kind = np.dtype([("a", float), ("b", float), ("c", float)])
    one = np.zeros(1, kind)
    assert put_numbers(one, 1, array_of([5.0])) is one
    made = put_numbers(one, 0, array_of([Column(A), 2.0]))
    assert np.array_equal(made.values["a"][:, 0], A)
    assert set(made.values["b"][:, 0].tolist()) == {2.0}
    assert [len(made), len(made.columns())] == [1, 3]
    again = joined([each.copy() for each in made.values])
    assert isinstance(again, Records)
    assert again.values.tobytes() == made.values.tobytes()


@pytest.mark.parametrize(
    "results", [[1.0, 1], [(1.0,), (1.0, 2.0)], [np.zeros(1), np.zeros(2)], [{}, {"a": 1}],
                [np.zeros(1, bool), np.ones(1, bool)]],
)  # fmt: skip
def test_results_of_different_forms_are_not_joined(results):
    with pytest.raises(Refused):
        joined(results)


class Inner(Spec):
    """A part."""

    rate_deg_s: Vector = (0.0, 0.0, 0.0)
    """A vector."""
    share: float | None = 0.5
    """A number, or none."""


class Thing(Spec):
    """What has numbers of all kinds."""

    inertia_kg_m2: Inertia = (1.0, 1.0, 1.0)
    """Moments, or a tensor."""
    axis: unit_vector("axis") = (1.0, 0.0, 0.0)
    """A direction."""
    size_m: float | tuple[float, ...] = 1.0
    """A number or several."""
    inner: Inner = Inner()
    """A part."""
    parts: tuple[Inner, ...] = (Inner(), Inner())
    """Parts."""
    named: dict[str, Inner] = Field(default_factory=lambda: {"a": Inner()})
    """Parts by name."""
    count: int = 3
    """A whole number."""


BOUNDS = rng.normal(size=(COUNT, 9)) * 10.0 ** rng.integers(-14, 14, (COUNT, 1))
PLACES = {
    ("inner", "share"): BOUNDS[:, 0],
    ("size_m",): BOUNDS[:, 0],
    ("inner", "rate_deg_s"): BOUNDS[:, :3],
    ("parts", 1, "rate_deg_s"): BOUNDS[:, :3],
    ("named", "a", "share"): BOUNDS[:, 0],
    ("axis",): np.where(np.arange(COUNT)[:, None] % 3, BOUNDS[:, :3], 0.0),
    ("inertia_kg_m2",): np.abs(BOUNDS[:, :3]),
}


def value_in(spec, place):
    for name in place:
        spec = getattr(spec, name) if isinstance(spec, Spec) else spec[name]
    return spec


def plain(values):
    return tuple(map(plain, values)) if np.ndim(values) else float(values)


@pytest.mark.parametrize("place", PLACES)
def test_columns_are_checked_as_pydantic_checks_each_number(place):
    values, base, alone = PLACES[place], Thing(), []
    for value in values:
        data = base.model_dump()
        inner = value_in(data, place[:-1])
        inner[place[-1]] = plain(value)
        try:
            alone.append(value_in(Thing.model_validate(data), place))
        except ValueError:
            alone.append(None)
    rows = [np.arange(COUNT)]
    found: dict[int, object] = {}
    while rows:
        part = rows.pop()
        computing, here = present(len(part))
        with here:
            try:
                made = checked_columns(computing, opened(base, {place: as_column(values[part])}))
            except Mixed as mixed:
                rows += [part[mixed.one], part[~mixed.one]]
                continue
            except (Refused, ValueError):
                continue
            for row, spec in zip(part, computing.each(made), strict=True):
                found[int(row)] = value_in(spec, place)
    good = {row: value for row, value in enumerate(alone) if value is not None}
    assert good.keys() == found.keys()
    assert good == found
    assert 0 < len(good) < COUNT


@pytest.mark.parametrize(
    ("place", "value"),
    [
        (("count",), A), (("inner",), A), (("inner", "rate_deg_s"), BOUNDS[:, :2]),
        (("named", "b", "share"), A), (("parts", 5, "share"), A), (("size_m", 0), A),
    ],
)  # fmt: skip
def test_what_is_no_place_of_a_number_refuses_columns(place, value):
    computing, here = present()
    with here, pytest.raises((Refused, LookupError, ValueError)):
        checked_columns(computing, opened(Thing(), {place: as_column(value)}))


def test_kernels_take_columns_in_python():
    q = rng.normal(size=(COUNT, 4))
    q /= np.linalg.norm(q, axis=1)[:, None]
    _, here = present()
    with here:
        found = normalise(as_column(q))
    for k in range(COUNT):
        assert tuple(c.values[k] for c in found) == normalise(tuple(q[k].tolist()))
