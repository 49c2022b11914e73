"""The gate for numbers and the base of specs: what passes, and what is said about the rest."""

import math

import numpy as np
import pytest
from pydantic import Field, ValidationError
from scipy.spatial.transform import Rotation

from torquer.base import validate
from torquer.base.explain import ScenarioError
from torquer.base.spec import Inertia, Moments, Spec, Vector


def test_finite_gives_float64_arrays():
    array = validate.finite("x", [1, 2, 3], (3,))
    assert array.dtype == np.float64 and array.tolist() == [1.0, 2.0, 3.0]
    assert validate.finite("x", 2).shape == ()
    one = validate.finite("x", 2.5, ())
    assert (one.dtype, one.shape, float(one)) == (np.float64, (), 2.5)


@pytest.mark.parametrize(
    ("value", "shape", "expected"),
    [
        ("some", None, "x: must be numbers; received 'some'"),
        ([1.0, [2.0]], None, r"x: must be numbers; received \[1.0, \[2.0\]\]"),
        ([1.0 + 2.0j], None, r"x: must be numbers; received \[\(1\+2j\)\]"),
        ([1.0, 2.0], (3,), r"x: must have shape \(3,\); received shape \(2,\)"),
        ([1.0, np.nan], None, r"x: must be finite; received \[1.0, nan\]"),
        ([np.inf], (1,), r"x: must be finite; received \[inf\]"),
        (math.nan, None, "x: must be finite; received nan"),
        (-math.inf, (), "x: must be finite; received -inf"),
        (1.0, (1,), r"x: must have shape \(1,\); received shape \(\)"),
        (None, None, "x: must be finite; received None"),
        (["500"], None, r"x: must be numbers; received \['500'\]"),
        ([1.0, True], None, r"x: must be numbers; received \[1.0, True\]"),
        (True, None, "x: must be numbers; received True"),
        (np.array([True]), None, r"x: must be numbers; received array\(\[ True\]\)"),
        ([[1.0, 2.0], [3.0, False]], None, r"x: must be numbers; received \[.*False\]\]"),
    ],
)
def test_finite_tells_what_is_wrong(value, shape, expected):
    with pytest.raises(ValueError, match=f"^{expected}$"):
        validate.finite("x", value, shape)


def test_inertia_of_three_moments_is_diagonal():
    assert validate.inertia_tensor("J", (1, 2, 3)).tolist() == np.diag([1.0, 2.0, 3.0]).tolist()


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        ((1.0, 2.0), r"J: must be 3 moments or a 3x3 tensor; received shape \(2,\)"),
        (np.ones((3, 2)), r"J: must be 3 moments or a 3x3 tensor; received shape \(3, 2\)"),
        ([[1, 1e-3, 0], [0, 1, 0], [0, 0, 1]], "J: must be symmetric; received .*"),
        (
            (1.0, -2.0, 3.0),
            r"J: must be positive definite; received principal moments -2, 1, 3 kg m\^2",
        ),
        (
            (1.0, 1.0, 2.001),
            r"J: the sum of two principal moments must not be below the third "
            r"\(triangle inequality\); received 1, 1, 2.001 kg m\^2",
        ),
        ((1.0, 1.0, np.nan), "J: must be finite; received .*"),
    ],
)
def test_inertia_tells_what_is_wrong(value, expected):
    with pytest.raises(ValueError, match=f"^{expected}$"):
        validate.inertia_tensor("J", value)


def test_unit_rows_are_scaled_and_then_stay():
    rows = validate.unit_rows("axes", [[3.0, 0.0, 4.0], [0.0, -2.0, 0.0]])
    assert rows == pytest.approx(np.array([[0.6, 0.0, 0.8], [0.0, -1.0, 0.0]]))
    assert validate.unit_rows("axes", [0.0, 0.0, 7.0]).tolist() == [[0.0, 0.0, 1.0]]
    random = validate.unit_rows("axes", np.random.default_rng(1).normal(size=(1000, 3)))
    assert np.linalg.norm(random, axis=1) == pytest.approx(np.ones(1000), abs=4e-16)
    assert np.array_equal(validate.unit_rows("axes", random), random)


@pytest.mark.parametrize(
    "value",
    [[0.0, 0.0, 0.0], [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0]], [1.0, 2.0], [], np.ones((2, 3, 2))],
)
def test_unit_rows_tell_what_is_wrong(value):
    with pytest.raises(ValueError, match=r"^axes: must be non-zero vectors of 3 numbers; received"):
        validate.unit_rows("axes", value)


def test_rotation_matrices_pass():
    matrix = Rotation.random(random_state=1).as_matrix()
    assert np.array_equal(validate.rotation_matrix("R", matrix.tolist()), matrix)


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (np.diag([1.0, 1.0, -1.0]), "off by 0 with determinant -1"),
        (1.001 * np.eye(3), "off by 0.002 with determinant 1.003"),
        (np.ones((3, 3)), "off by 3 with determinant 0"),
    ],
)
def test_what_is_no_rotation_is_reported(value, expected):
    message = f"^R: must be a right-handed rotation matrix; received one that is {expected}$"
    with pytest.raises(ValueError, match=message):
        validate.rotation_matrix("R", value)


def test_directions_of_any_size_become_unit_vectors():
    for size in (1e-320, 1e-300, 1e-150, 1e150, 1e200, 1.7e308):
        with np.errstate(all="raise", under="ignore"):
            rows = validate.unit_rows("axes", [[size, 0.0, -size], [0.0, size, 0.0]])
        assert rows == pytest.approx(np.array([[0.5**0.5, 0.0, -(0.5**0.5)], [0.0, 1.0, 0.0]]))


def test_numbers_beyond_floats_and_inertia_beyond_bodies():
    with pytest.raises(ValueError, match=r"^x: must be numbers that a float can hold$"):
        validate.finite("x", [10**400])
    for moments, message in (
        ((1e13, 1e13, 1e13), r"J: must be at most 1e\+12 kg m\^2; received 1e\+13"),
        ((1e-13, 1e-13, 1e-13), "J: principal moments must be at least 1e-12 kg m\\^2; received 1"),
    ):
        with pytest.raises(ValueError, match=f"^{message}"):
            validate.inertia_tensor("J", moments)


@pytest.mark.parametrize(
    ("key", "unit"),
    [
        ("limit_a_m2", "a_m2"),
        ("a_m2", "a_m2"),
        ("inertia_kg_m2", "kg_m2"),
        ("area_m2", "m2"),
        ("rate_deg_s", "deg_s"),
        ("sample_s", "s"),
        ("gain_per_s", "per_s"),
        ("viscous_friction_n_m_s", "n_m_s"),
        ("rate_gain_n_m_s_per_t2", "n_m_s_per_t2"),
        ("altitude_km", "km"),
        ("scale_height_km", "height_km"),
        ("bias_deg_h", "deg_h"),
        ("angle_random_walk_deg_sqrt_h", "deg_sqrt_h"),
        ("rate_random_walk_deg_h_sqrt_h", "deg_h_sqrt_h"),
        ("quantum_arcsec", "arcsec"),
        ("quantum_deg", "quantum_deg"),
        ("damping", ""),
        ("atoms", ""),
    ],
)
def test_a_key_has_the_range_of_its_unit(key, unit):
    assert validate.quantity_range(key) is validate.RANGES[unit]


def test_ranges_are_ranges():
    for least, greatest in validate.RANGES.values():
        assert 0.0 <= least < greatest < np.inf


class Ranged(Spec):
    """Numbers of every sign."""

    limit_a_m2: float = Field(default=1.0, gt=0.0)
    noise_nt: float = Field(default=0.0, ge=0.0)
    bias_nt: Vector = (0.0, 0.0, 0.0)
    angle_deg: float = Field(default=1.0, gt=0.0, le=180.0)
    axis: Vector = (0.0, 0.0, 1.0)
    either_s: float | tuple[float, ...] = 1.0
    number: int = 1


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ({"limit_a_m2": 2e-301}, "at least 1e-12"),
        ({"limit_a_m2": 1e200}, r"at most 1e\+09"),
        ({"limit_a_m2": 10**400}, r"at most 1e\+09"),
        ({"limit_a_m2": 0.0}, "greater than 0"),
        ({"limit_a_m2": -1.0}, "greater than 0"),
        ({"noise_nt": 1e-10}, "at least 1e-09"),
        ({"bias_nt": (0.0, -1e13, 0.0)}, r"within -1e\+12..1e\+12"),
        ({"bias_nt": (0.0, 0.0, -(10**400))}, r"within -1e\+12..1e\+12"),
        ({"angle_deg": 1e200}, "less than or equal to 180"),
        ({"either_s": 1e20}, r"within -1e\+10..1e\+10"),
        ({"either_s": (1.0, 1e20)}, r"within -1e\+10..1e\+10"),
        ({"number": 10**400}, "an integer of 64 bits"),
    ],
)
def test_what_is_out_of_range_is_reported(keys, expected):
    for spec, data in ((Ranged, keys), (Within, {"ranged": keys}), (Within, {"all": [keys]})):
        with pytest.raises(ValueError, match=expected):
            spec.model_validate(data)


class Within(Spec):
    """Specs within a spec, whose checks are done once."""

    ranged: Ranged = Ranged()
    all: tuple[Ranged, ...] = ()


def test_zero_and_numbers_lost_to_rounding_are_not_too_small():
    made = Ranged(noise_nt=0, bias_nt=(1e-300, -5e-324, 1e12), axis=(1e300, -1e-300, 0))
    assert made.bias_nt == (1e-300, -5e-324, 1e12) and made.noise_nt == 0.0


class Thing(Spec):
    """A spec as the rooms have them."""

    length_m: float
    axis: Vector = (0.0, 0.0, 1.0)
    count: int = Field(default=1, ge=0)
    scale: float | tuple[float, ...] = 1.0
    by_name: dict[str, float] = Field(default_factory=dict)
    gain: float | None = Field(default=None, gt=0.0)
    on: bool = False
    ons: dict[str, bool] = Field(default_factory=dict)


class Whole(Spec):
    """A spec within a spec."""

    thing: Thing
    things: tuple[Thing, ...] = ()


def test_specs_are_frozen_and_compare_by_value():
    thing = Thing(length_m=2)
    assert thing == Thing(length_m=2.0, axis=(0, 0, 1))
    with pytest.raises(ValueError, match="must stay as it is"):
        thing.length_m = 3.0


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ({"length_m": float("nan")}, "must be finite"),
        ({"length_m": float("inf")}, "must be finite"),
        ({"length_m": 1.0, "axis": (0.0, 0.0, float("inf"))}, "must be finite"),
        ({"length_m": 1.0, "axis": (0.0, 1.0)}, "axis"),
        ({"length_m": 1.0, "width_m": 1.0}, "must be a known key"),
        ({"length_m": "long"}, "must be a number"),
        ({"length_m": 1.0, "count": 1.5}, "must be a whole number"),
        ({"length_m": 1.0, "count": -1}, "greater than or equal to 0"),
        ({"length_m": 1.0, "gain": 0}, "greater than 0"),
        ({}, "must be given; received nothing"),
    ],
)
def test_specs_tell_what_is_wrong(keys, expected):
    with pytest.raises(ValueError, match=expected):
        Thing(**keys)


@pytest.mark.parametrize("value", [True, False, "500", b"5", np.True_])
@pytest.mark.parametrize(
    ("build", "places"),
    [
        (lambda v: {"length_m": v}, {("length_m",)}),
        (lambda v: {"axis": (0.0, v, 1.0)}, {("axis", 1)}),
        (lambda v: {"gain": v}, {("gain",)}),
        (lambda v: {"by_name": {"k": v}}, {("by_name", "k")}),
        (lambda v: {"count": v}, {("count",)}),
    ],
)
def test_truth_and_text_are_no_numbers(build, places, value):
    for keys, spec in (
        (build(value), Thing),
        ({"thing": {"length_m": 1.0, **build(value)}}, Whole),
    ):
        with pytest.raises(ValidationError) as caught:
            spec.model_validate({"length_m": 1.0, **keys} if spec is Thing else keys)
        (error,) = caught.value.errors()
        below = 0 if spec is Thing else 1
        assert {error["loc"][below:]} == places
        assert error["msg"] in ("Input should be a valid number", "Input should be a valid integer")


def test_truth_and_text_are_no_numbers_of_a_union_either():
    for value in (True, "5", (1.0, "5"), (1.0, False)):
        with pytest.raises(ScenarioError, match="scale"):
            Thing(length_m=1.0, scale=value)
    assert Thing(length_m=1.0, scale=2).scale == 2.0
    assert Thing(length_m=1.0, scale=[1, 2.5]).scale == (1.0, 2.5)


@pytest.mark.parametrize("value", ["yes", "true", "on", 1, 0, 1.0, b"1", None, [True]])
def test_only_true_and_false_are_truth_values(value):
    for keys in ({"on": value}, {"ons": {"k": value}}):
        with pytest.raises(ScenarioError, match=r"must be true or false; received .*$"):
            Thing(length_m=1.0, **keys)
    for true in (True, np.True_):
        thing = Thing(length_m=1.0, on=true, ons={"k": False})
        assert (thing.on, thing.ons) == (True, {"k": False})


def test_numbers_of_all_kinds_are_numbers():
    numbers = (2, 2.0, np.float32(2.0), np.int64(2))
    assert [Thing(length_m=n, count=n) for n in numbers] == 4 * [Thing(length_m=2.0, count=2)]


class Heavy(Spec):
    """A spec with inertia, both ways."""

    inertia_kg_m2: Inertia
    principal: Moments = (1.0, 1.0, 1.0)


def test_inertia_is_kept_as_a_tensor_and_moments_as_three():
    heavy = Heavy(inertia_kg_m2=(1, 2, 2.5), principal=(1, 2, 2.5))
    assert heavy.inertia_kg_m2 == ((1.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 2.5))
    assert heavy.principal == (1.0, 2.0, 2.5)
    assert Heavy(inertia_kg_m2=heavy.inertia_kg_m2) == Heavy(inertia_kg_m2=(1, 2, 2.5))
    assert Heavy.model_validate_json(heavy.model_dump_json()) == heavy
    types = {type(x) for row in heavy.inertia_kg_m2 for x in row}
    assert types == {float}


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        ((1.0, 2.0, 4.0), "the sum of two principal moments must not be below the third"),
        ((1.0, -2.0, 2.0), "must be positive definite; received principal moments -2, 1, 2"),
    ],
)
def test_what_no_body_can_have(value, expected):
    for keys in ({"inertia_kg_m2": value}, {"inertia_kg_m2": (1, 1, 1), "principal": value}):
        with pytest.raises(ValueError, match=f"inertia_kg_m2: {expected}"):
            Heavy(**keys)
    with pytest.raises(ValueError, match="must be symmetric"):
        Heavy(inertia_kg_m2=((1.0, 0.1, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))


def test_specs_go_through_json_and_back():
    whole = Whole(thing=Thing(length_m=1e-3, count=2**62 + 1, gain=3), things=[{"length_m": 2}])
    assert Whole.model_validate_json(whole.model_dump_json()) == whole
    assert Whole.model_validate(whole.model_dump()) == whole
    schema = Whole.model_json_schema()["$defs"]["Thing"]["properties"]
    assert schema["length_m"]["type"] == "number" and schema["count"]["type"] == "integer"
