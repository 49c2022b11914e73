"""Torques and the sensor of the user's own, compiled for a run."""

import functools
import inspect
import math
from collections.abc import Callable
from types import CodeType, FunctionType
from typing import cast

from torquer.base.user_code import UserCode
from torquer.base.user_source import (
    cache_beside,
    plain_function,
    printable,
    source_file,
    source_mark,
)
from torquer.compile import engine
from torquer.computer.blocks import plugin
from torquer.computer.blocks.adapter import Shape, inlined_on_the_spot, make_inner, place_adapter
from torquer.computer.blocks.reasons import returned_in_words
from torquer.scenario.spec import Scenario
from torquer.spacecraft.disturbance.user import (
    MOST_PARAMETERS,
    OwnTorque,
    UserTorque,
    as_torque,
    no_torque,
    signature,
)
from torquer.spacecraft.sensors.own_sensor import OwnSensorSet, signature as sensor_signature


def own_torques(scenario: Scenario) -> tuple[OwnTorque, ...]:
    """Constants of the torques of a scenario that are functions of the user's own.

    ValueError for one that cannot be compiled, or that reads what the scenario does not have.
    """
    if scenario.disturbance is None or not scenario.disturbance.own:
        return ()
    start_rad, rate_rad_s = scenario.orbit_angle()
    made = []
    for name, spec in scenario.disturbance.own.items():
        spec.all_parameters()  # a function that takes nothing reads nothing
        _check(f"disturbance.own.{name}", spec, scenario)
        address, parameters = _address_and_numbers(f"disturbance.own.{name}", spec, signature)
        made.append(OwnTorque(address, start_rad, 1.0 / rate_rad_s, parameters))
    return tuple(made)


def own_sensor(scenario: Scenario) -> OwnSensorSet | None:
    """Constants of the sensor of the user's own, compiled; None for a satellite without one."""
    spec = scenario.spacecraft.own_sensor
    if spec is None:
        return None
    address, parameters = _address_and_numbers("spacecraft.own_sensor", spec, sensor_signature)
    return OwnSensorSet(address, parameters, spec.noise)


def _address_and_numbers(key: str, spec: UserCode, of_kind: Callable) -> tuple:
    """Address of a compiled function, and its parameters as so many numbers as all have."""
    given = spec.all_parameters()
    plain = spec.plain()
    _check_function(key, spec, given)
    try:
        made = compile_own(plain, tuple(given), source_mark(plain), of_kind)
    except ValueError as error:
        raise ValueError(f"{spec.must}{error} ({spec.function_in_words()})") from None
    padding = [0.0] * (MOST_PARAMETERS - len(given))
    numbers = (*map(float, given.values()), *padding)
    return made.address if engine.COMPILED else made, numbers


def _check_function(key: str, spec: UserCode, given: dict) -> None:
    """ValueError for what no compiled function can take or be."""
    for name, value in given.items():
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        if not (is_number and math.isfinite(value)):
            raise ValueError(
                f"{key}.parameters.{name}: must be a finite number, by default, too; received "
                f"{printable(value)} ({spec.function_in_words()})"
            )
    if len(given) > MOST_PARAMETERS:
        raise ValueError(
            f"{key}.function: must have {MOST_PARAMETERS} or fewer parameters; received "
            f"{len(given)} ({spec.function_in_words()})"
        )
    plain = spec.plain()
    if plain.__code__.co_flags & inspect.CO_VARKEYWORDS:
        raise spec.refusal("one that takes keywords without their names (**)")
    if plain.__code__.co_kwonlyargcount:
        raise spec.refusal("one with parameters after *")
    if plain.__code__.co_flags & plugin.NOT_PLAIN:
        raise spec.refusal("a generator or coroutine")


def needs_of_own(scenario: Scenario) -> frozenset[str]:
    """What is tabulated for torques of the user's own: of "light", "air", "up"."""
    own = scenario.disturbance.own if scenario.disturbance else {}
    return frozenset().union(*(spec.needs() for spec in own.values()))


def _check(key: str, spec: UserTorque, scenario: Scenario) -> None:
    needs = spec.needs()
    if "air" in needs and scenario.environment.atmosphere is None:
        raise ValueError(
            f"environment.atmosphere: must be given for {key}, which reads flow_body; received none"
        )
    if "up" in needs and not scenario.environment.gravity_gradient:
        raise ValueError(
            f"environment.gravity_gradient: must be true for {key}, which reads up_body; received "
            "false"
        )


def _guarded_adapter(here, parameters):
    try:
        return _unify(_spread(here, parameters))  # type: ignore[name-defined]  # noqa: F821
    except Exception:
        return _failed()  # type: ignore[name-defined]  # noqa: F821


#: The adapter; what it calls is put into the globals of each copy.
_GUARDED = cast(FunctionType, _guarded_adapter)


@functools.lru_cache(maxsize=32)
def compile_own(function: Callable, names: tuple, mark: str, of_kind: Callable):
    """A function `(here, **parameters)` of three numbers; `of_kind` gives its signature.

    ValueError for one that does not compile, which begins with what was received.
    """
    plain, shape = plain_function(function), Shape((0.0,) * len(names))
    arguments = "".join(f", {name}=p[{k}]" for k, name in enumerate(names))
    inner = make_inner(function, engine.is_own(plain), shape) if engine.COMPILED else plain
    spread = {"_function": inner}
    exec(f"def spread(here, p):\n    return _function(here{arguments})", spread)
    parts = {
        "_spread": inlined_on_the_spot(spread["spread"]),
        "_unify": as_torque,
        "_failed": no_torque,
    }
    adapter = place_adapter(_GUARDED, plain, shape, None, parts, f"{of_kind.__module__} {names}")
    if not engine.COMPILED:
        return adapter
    with cache_beside(source_file(plain)):
        try:
            made = plugin.compile_plugin(adapter, of_kind(), "", keep=True, error_model="numpy")
        except ValueError:
            _explain(spread["spread"], plain.__code__, of_kind())
            raise
    from torquer.compile.overloads import FirstClass

    return FirstClass(made, of_kind())


def _explain(spread, own: CodeType, signature) -> None:
    """Compile a function alone, so that the message is of its own mistake and names its line."""
    code = spread.__code__.replace(co_filename=own.co_filename, co_firstlineno=own.co_firstlineno)
    placed = FunctionType(code, spread.__globals__)
    alone = plugin.compile_plugin(placed, signature.args, "")
    received = returned_in_words(str(alone.nopython_signatures[0].return_type))
    raise ValueError(f"; received one that returns {received}")
