"""Requests of `torquer.design`: help with units, ranges and an example; mistakes by their keys."""

import importlib
import inspect
import pkgutil
import re
from dataclasses import MISSING, fields, is_dataclass
from typing import get_args

import pytest

import torquer.design
from torquer.base.limits import Range, RequestError
from torquer.cli.answer import in_words
from torquer.design.requests import CoilRequest, DetumbleRequest, Key
from torquer.scenario.keys import key_unit


def _requests() -> list[type]:
    """All request classes in the files of the room."""
    places = pkgutil.walk_packages(torquer.design.__path__, "torquer.design.")
    kinds = {
        kind
        for place in places
        for kind in vars(importlib.import_module(place.name)).values()
        if inspect.isclass(kind) and is_dataclass(kind) and kind.__name__.endswith("Request")
    }
    return sorted(kinds, key=lambda kind: kind.__name__)


REQUESTS = _requests()
#: Numbers without a unit.
PURE = {"dipole_ratio", "gain_ratio", "gain_margin", "confidence", "core_permeability"}


def test_each_function_has_a_request():
    names = {kind.__name__ for kind in REQUESTS}
    functions = ("Bench", "Coil", "Detumble", "MagnetoGyro", "ThreeAxis")
    assert {f"{function}Request" for function in functions} <= names <= {*torquer.design.__all__}


def numbers_of(kind: type) -> list:
    """Fields that take numbers."""
    return [field for field in fields(kind) if re.search(r"\b(float|int)\b", str(field.type))]


@pytest.mark.parametrize("kind", REQUESTS)
def test_help_names_keys_units_ranges_and_an_example(kind):
    text = inspect.getdoc(kind)
    assert not re.search(r"--\w", text), "options are spelled as keys"
    about = dict(re.findall(r"^    (\w+): (.*)$", text, re.M))
    assert list(about) == [field.name for field in fields(kind)]
    for field in numbers_of(kind):
        assert re.search(r"(Must .+|As [\w.]+ of scenarios)\.$", about[field.name]), field.name
        if "float" in str(field.type) and field.name not in PURE:
            assert key_unit(field.name) or re.search(r"\[[\w ^]+\]|per 1/|deg C", about[field.name])


@pytest.mark.parametrize("kind", REQUESTS)
def test_the_example_in_the_help_is_a_request(kind):
    (call,) = re.findall(rf"{kind.__name__}\((?:[^()]|\([^()]*\))*\)", kind.__doc__)
    made = eval(call, {kind.__name__: kind})
    assert any(getattr(made, field.name) != field.default for field in fields(kind))


def _outside(kind: type) -> list[tuple[type, str, float]]:
    """Each ranged key with a number that its range does not hold."""
    cases = []
    for field in fields(kind):
        ranges = [x for x in getattr(field.type, "__metadata__", ()) if isinstance(x, Range)]
        cases += [(kind, field.name, x) for x in (-1.0, -1e9) if ranges and not ranges[0].holds(x)]
    return cases


@pytest.mark.parametrize(("kind", "key", "value"), [x for kind in REQUESTS for x in _outside(kind)])
def test_python_and_the_command_line_read_the_same_rule(kind, key, value):
    keys = {field.name: 1.0 for field in fields(kind) if field.default is MISSING}
    with pytest.raises(RequestError, match=rf"^{key}: must .*; received -1") as error:
        kind(**(keys | {key: value}))
    option = f"--{key.replace('_', '-')}"
    assert in_words(error.value) == str(error.value).replace(key, option, 1)


def test_every_key_of_the_satellite_has_its_place():
    three_axis = next(kind for kind in REQUESTS if kind.__name__ == "ThreeAxisRequest")
    places = {
        field.name: each.place
        for field in fields(three_axis)
        for each in getattr(field.type, "__metadata__", ())
        if isinstance(each, Key)
    }
    assert places["altitude_km"] == "orbit.altitude_km" and len(places) == 14


def test_a_problem_may_name_several_keys():
    error = RequestError("filter_rate_rad_s", "must brake 5 deg/s (tip_off_deg_s)", "tip_off_deg_s")
    assert str(error) == "filter_rate_rad_s: must brake 5 deg/s (tip_off_deg_s)"
    assert in_words(error) == "--filter-rate-rad-s: must brake 5 deg/s (--tip-off-deg-s)"
    ours = RequestError("initial.rate_deg_s", "must be low, or rate_deg_s be given", "rate_deg_s")
    assert in_words(ours) == "initial.rate_deg_s: must be low, or --rate-deg-s be given"


def test_requests_are_frozen_and_compared_by_value():
    assert DetumbleRequest(runs=8) == DetumbleRequest(runs=8) != DetumbleRequest()
    with pytest.raises(AttributeError):
        DetumbleRequest().runs = 3
    assert "copper" in get_args(CoilRequest.__dataclass_fields__["metal"].type)
