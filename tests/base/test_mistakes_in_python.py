"""A mistake in a spec that is made in Python is a line of ours, as in a file."""

import importlib
import pkgutil
import re

import pytest

import torquer
from torquer.base.explain import ScenarioError
from torquer.base.spec import Spec, check_spec
from torquer.computer.laws.law_spec import LawSpec
from torquer.environment.field import FIELDS
from torquer.spacecraft.actuators.coils import Coils
from torquer.spacecraft.body import Body
from torquer.spacecraft.sensors.devices import Sensors
from torquer.spacecraft.sensors.gyro import Gyro
from torquer.theory.slow.spinner import Spinner

WRONG = (-1, float("nan"), float("inf"), "text", True, None, [], {"a": 1}, object(), 10**400)
#: How pydantic writes of a mistake.
RAW = re.compile(r"validation error|Input should|\[type=|errors\.pydantic\.dev|^\s", re.MULTILINE)


def every_spec() -> list[type[Spec]]:
    """All specs of the package but the bases of laws, which nobody makes."""
    for module in pkgutil.walk_packages(torquer.__path__, "torquer."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)
    found, left = {}, [Spec]
    while left:
        left += (spec := left.pop()).__subclasses__()
        is_made = not issubclass(spec, LawSpec) or "kind" in spec.model_fields
        if is_made and spec is not Spec and spec.__module__.startswith("torquer."):
            found[f"{spec.__module__}.{spec.__qualname__}"] = spec
    return [found[name] for name in sorted(found)]


def mistakes(make) -> list[str]:
    """What is said, a line each; nothing where nothing is wrong."""
    try:
        make()
    except ScenarioError as error:
        return str(error).split("\n")
    return []


def test_every_wrong_key_of_every_spec_is_a_line_of_its_own():
    specs = every_spec()
    assert {Coils, Body, Spinner, *FIELDS.values(), torquer.Scenario} <= {*specs}
    for spec in specs:
        lines = mistakes(lambda spec=spec: spec(no_such_key=1))
        assert any(x.startswith("no_such_key: must be a known key; received 1") for x in lines), (
            spec
        )
        for key in spec.model_fields:
            for value in WRONG:
                for line in mistakes(lambda spec=spec, k=key, v=value: spec(**{k: v})):
                    assert not RAW.search(line), (spec, line)
                    assert re.match(r"[\w.\[\]]+: .*\bmust\b.*", line), (spec, line)


@pytest.mark.parametrize(
    ("make", "line"),
    [
        (lambda: Coils(limit_a_m2=-1), "limit_a_m2: must be greater than 0; received -1"),
        (lambda: Coils(limit_a_m2=float("nan")), "limit_a_m2: must be finite; received nan"),
        (lambda: Coils(limit_a_m2="big"), "limit_a_m2: must be a number; received 'big'"),
        (lambda: Coils(limit=1.0), "limit: must be a known key; received 1.0 "
         "(did you mean limit_a_m2?)"),
        (lambda: Coils(limit_a_m2=1.0).model_copy(update={"lag_s": -1.0}),
         "lag_s: must be greater than or equal to 0; received -1.0"),
        (lambda: Gyro(noise_deg_s=()), "noise_deg_s: must be a number; received ()"),
        (lambda: Sensors(magnetometers=[{"bias_nt": 1.0}]),
         "magnetometers[0].name: must be given, text, for each of several sensors; "
         "received {'bias_nt': 1.0}"),
        (lambda: Sensors(sun_sensors=[]),
         "sun_sensors: must hold a table for each of several sensors; received none"),
        (lambda: setattr(Coils(limit_a_m2=1.0), "lag_s", 2.0),
         "lag_s: must stay as it is: only a copy can have another, "
         "model_copy(update={'lag_s': ...}); received 2.0"),
        (lambda: check_spec(Coils(limit_a_m2=1.0).model_construct(limit_a_m2=-1.0)),
         "limit_a_m2: must be greater than 0; received -1.0"),
    ],
)  # fmt: skip
def test_the_line_names_argument_requirement_and_value(make, line):
    assert mistakes(make)[:1] == [line]


def test_specs_within_a_spec_are_made_by_compiled_code(monkeypatch):
    """Their constructor is not called, so a file with many is loaded as fast."""

    class Whole(Spec):
        inner: Coils

    made = []
    monkeypatch.setattr(Coils, "__init__", lambda self, **keys: made.append(keys))
    assert Whole(inner={"limit_a_m2": 1.0}).inner.limit_a_m2 == 1.0
    assert made == [] and not Coils.__pydantic_custom_init__
