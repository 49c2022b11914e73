"""Torques and the sensor of the user's own, compiled for a run."""

import functools
from collections.abc import Callable
from types import FunctionType
from typing import cast

from torquer.base.user_code import UserCode
from torquer.base.user_source import cache_beside, plain_function, source_file, source_mark
from torquer.compile import engine
from torquer.computer.blocks import plugin
from torquer.computer.blocks.adapter import Shape, inlined_on_the_spot, make_inner, place_adapter
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
    for name, value in given.items():
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise ValueError(
                f"{key}.parameters.{name}: must be a number, by default, too; received {value!r}"
            )
    numbers = [*map(float, given.values())]
    if len(numbers) > MOST_PARAMETERS:
        raise ValueError(
            f"{key}: its function must have {MOST_PARAMETERS} or fewer parameters; received "
            f"{len(numbers)}"
        )
    plain = spec.plain()
    made = compile_own(plain, len(numbers), source_mark(plain), spec.must, of_kind)
    padding = [0.0] * (MOST_PARAMETERS - len(numbers))
    return made.address if engine.COMPILED else made, (*numbers, *padding)


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


def _plain_adapter(here, parameters):
    return _unify(_spread(here, parameters))  # type: ignore[name-defined]  # noqa: F821


def _guarded_adapter(here, parameters):
    try:
        return _unify(_spread(here, parameters))  # type: ignore[name-defined]  # noqa: F821
    except Exception:
        return _failed()  # type: ignore[name-defined]  # noqa: F821


#: Adapters; what they call is put into the globals of each copy.
_PLAIN, _GUARDED = cast(FunctionType, _plain_adapter), cast(FunctionType, _guarded_adapter)


@functools.lru_cache(maxsize=32)
def compile_own(function: Callable, count: int, mark: str, must: str, of_kind: Callable):
    """A function `(here, **parameters)` of three numbers; `of_kind` gives its signature."""
    plain, shape = plain_function(function), Shape((0.0,) * count)
    arguments = "".join(f", p[{k}]" for k in range(count))
    inner = make_inner(function, engine.is_own(plain), shape) if engine.COMPILED else plain
    spread = {"_function": inner}
    exec(f"def spread(here, p):\n    return _function(here{arguments})", spread)
    parts = {
        "_spread": inlined_on_the_spot(spread["spread"]),
        "_unify": as_torque,
        "_failed": no_torque,
    }
    if not engine.COMPILED:
        return place_adapter(_PLAIN, plain, shape, None, parts)
    with cache_beside(source_file(plain)):
        adapter = place_adapter(_GUARDED, plain, shape, None, parts, of_kind.__module__)
        made = plugin.compile_plugin(adapter, of_kind(), must, keep=True, error_model="numpy")
    from torquer.compile.overloads import FirstClass

    return FirstClass(made, of_kind())
