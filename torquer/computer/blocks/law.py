"""Control laws as plug-ins: one kind for coils and wheels, built-in or a user's.

A law is a function `(inputs, parameters, memory)`:
  inputs      `torquer.Inputs`: all that the on-board computer knows;
  parameters  by name: `parameters.gain`, a vector as `parameters.axis`;
  memory      all that the law remembers between calls (kept across stop and resume): by name,
              `memory.t_s`, or cells, `memory[0]`, as it was declared;
  returns     three numbers in body axes, a dipole [A m^2] or, where the law is declared so, a
              torque [N m] on the body; or `torquer.Command(dipole_a_m2, torque_n_m)` for both.
"""

import functools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Literal, Self

from torquer.base.user_source import attributes_read
from torquer.compile.engine import inlined
from torquer.computer.blocks.adapter import Kind
from torquer.computer.blocks.block import Block
from torquer.computer.informed import find_waits
from torquer.computer.interface import NO_COMMAND, Command
from torquer.spacecraft.sensors.devices import DEVICES

#: Cells of memory of a function without the decorator, which cannot say how many it needs.
_PLAIN_MEMORY = 16
#: What a user's law may say that it needs.
_NEEDS = ("ephemeris", "attitude", "rate")
#: Inputs that cost a reading which the run makes only for laws that use it.
_ON_DEMAND = [device for device in DEVICES if device.need and device.stands_in]
_ALL = tuple(device.need for device in _ON_DEMAND)
_READINGS = {device.given: (device.need,) for device in _ON_DEMAND} | dict.fromkeys(
    ("read_at",), _ALL
)
_NAN3 = (math.nan, math.nan, math.nan)
_NAN33 = (_NAN3, _NAN3, _NAN3)
#: What a law may ask of the scenario, as parameters: not known before that is. `to_ecef`: matrix
#: (rows) from inertial to Earth-fixed axes at the start.
OF_SATELLITE = {"inertia_kg_m2": _NAN33, "coil_limits_a_m2": _NAN3, "to_ecef": _NAN33}
#: Estimate of a law in its memory: whether there is one (1 or 0), attitude (quaternion of the body
#: to the inertial frame), absolute rate in body axes [rad/s].
NOTHING_STATED = (0.0,) * 8


@inlined  # a host calls it, too
def _vector(answer):
    return (float(answer[0]), float(answer[1]), float(answer[2]))


@inlined
def dipole_command(answer):
    """The command of a law that answers with a dipole."""
    x, y, z = answer
    return Command((float(x), float(y), float(z)), (0.0, 0.0, 0.0))


@inlined
def torque_command(answer):
    """The command of a law that answers with a torque."""
    x, y, z = answer
    return Command((0.0, 0.0, 0.0), (float(x), float(y), float(z)))


@inlined
def whole_command(answer):
    """The command of a law that answers with one."""
    return Command(_vector(answer.dipole_a_m2), _vector(answer.torque_n_m))


@inlined
def no_number_command():
    """The answer of a law that raised an error."""
    nothing = (math.nan, math.nan, math.nan)
    return Command(nothing, nothing)


_PLAINLY = "compiled=False runs the law as plain Python"
#: How a law's answer is read, by what it answers with.
KINDS = {
    "dipole": Kind("law", "(x, y, z)", NO_COMMAND, dipole_command, no_number_command, _PLAINLY),
    "torque": Kind("law", "(x, y, z)", NO_COMMAND, torque_command, no_number_command, _PLAINLY),
    "command": Kind(
        "law", "torquer.Command", NO_COMMAND, whole_command, no_number_command, _PLAINLY
    ),
}


@dataclass(frozen=True)
class Law(Block):
    """A control law ready to fly; see `Block`.

    `answers`: "dipole" or "torque" for a law that returns three numbers, "command" for one that
    returns a `Command` and drives coils and wheels. `states`: the part of the memory in which the
    law states an estimate of its own, as `NOTHING_STATED`. `waits_for`: what of its `needs` must be
    finite numbers for it to be called; a user's law sees what sensors read. `satellite`: its
    parameters that follow from the scenario, of `OF_SATELLITE`, unless they are given.

        >>> @torquer.law(parameters={"gain": 2e4}, compiled=False)
        ... def brake(inputs, parameters, memory):
        ...     x, y, z = inputs.omega_body_rad_s
        ...     bx, by, bz = inputs.b_body_t
        ...     k = parameters.gain
        ...     return (k * (y * bz - z * by), k * (z * bx - x * bz), k * (x * by - y * bx))
        >>> stronger = brake.with_parameters(gain=4e4)
        >>> stronger.name, stronger.answers
        ('brake', 'dipole')
    """

    answers: Literal["dipole", "torque", "command"] = "dipole"
    states: str | None = None
    waits_for: frozenset[str] = frozenset({"attitude", "rate"})
    satellite: tuple[str, ...] = field(default=(), kw_only=True)

    def filled(self, satellite: Callable[[str], tuple]) -> Self:
        """This law with what it asks of the satellite, but for parameters that are given.

        `satellite(name)`: those of `OF_SATELLITE`.
        """
        known = self.values()
        missing = [name for name in self.satellite if _is_missing(known[name])]
        if not missing:
            return self
        values = {name: satellite(name) for name in missing}
        return replace(self, parameters=self.parameters._replace(**values))

    @property
    def kind(self) -> Kind:
        """How the answer is read."""
        return KINDS[self.answers]

    @property
    def states_at(self) -> int:
        """First cell of the stated estimate in the memory; -1 for a law that states none."""
        return -1 if self.states is None else self.memory_places()[self.states][0]

    @property
    def waits(self) -> int:
        """What it is not called without: bits, see `torquer.computer.informed.NEEDS`."""
        return find_waits(self.needs & self.waits_for)

    @property
    def drives_coils(self) -> bool:
        """Whether the law may ask for a dipole."""
        return self.answers != "torque"

    @property
    def drives_wheels(self) -> bool:
        """Whether the law may ask for a torque of the wheels."""
        return self.answers != "dipole"


def _is_missing(value) -> bool:
    """Whether a parameter is none yet; columns of many members are."""
    while isinstance(value, tuple):
        value = value[0]
    return isinstance(value, float) and math.isnan(value)


def as_law(law_or_function, name: str = "law") -> Law:
    """A law as it is; a function without the decorator as a law that runs as plain Python.

    Such a law is slower (the result says so), takes no parameters and has 16 cells of memory.
    """
    if isinstance(law_or_function, Law):
        return law_or_function
    if not callable(law_or_function):
        raise ValueError(
            f"{name}: must be a torquer.Law or a function; received {law_or_function!r}"
        )
    called = getattr(law_or_function, "__name__", type(law_or_function).__name__)
    needs = needed_readings(law_or_function)
    return Law(called, law_or_function, (), _PLAIN_MEMORY, needs=needs, compiled=False)


def needed_readings(function: Callable) -> frozenset[str]:
    """Readings to be made for a user's law: those that it uses, all if it hands its inputs on."""
    used = attributes_read(function)
    used = _READINGS.keys() if used is None else used
    return frozenset(reading for name in used for reading in _READINGS.get(name, ()))


def law(
    function: Callable | None = None,
    *,
    parameters: Mapping | None = None,
    limits: Mapping[str, tuple[float, float]] | None = None,
    memory: int | tuple | Mapping = 0,
    log: Mapping[str, str] | None = None,
    needs: tuple[str, ...] = (),
    answers: Literal["dipole", "torque", "command"] = "dipole",
    satellite: tuple[str, ...] = (),
    compiled: bool = True,
):
    """Decorator that makes a plain function a control law.

    `parameters` maps names to default numbers or vectors; `limits`: names to the least and the
    greatest number that a scenario or a telecommand may give them; `memory`: names with initial
    numbers or vectors, or a number of cells; `log` maps names of the memory to units: these values
    are written to the result. `needs`: "ephemeris" for position, velocity, model field and the
    direction to the Sun; "attitude", "rate" of the estimate, without which the law is not called.
    `answers`: what three returned numbers are, "dipole" or "torque"; "command" for a law that
    returns `torquer.Command` and drives coils and wheels. `satellite`: what of the satellite the
    law knows, as parameters of these names: "inertia_kg_m2", three rows, of the body with its
    wheels; "coil_limits_a_m2", the greatest dipole along each body axis. A scenario may give them
    among the law's parameters where its computer believes otherwise. `compiled`: False for a law
    that runs as plain Python (slower).

        @torquer.law(parameters={"gain": 4e4}, limits={"gain": (0, 1e6)}, memory={"t_s": 0.0})
        def my_law(inputs, parameters, memory):
            ...
            return (mx, my, mz)

        >>> @torquer.law(parameters={"gain": 2e4}, limits={"gain": (0, 1e6)}, compiled=False)
        ... def brake(inputs, parameters, memory):
        ...     x, y, z = inputs.omega_body_rad_s
        ...     bx, by, bz = inputs.b_body_t
        ...     k = parameters.gain
        ...     return (k * (y * bz - z * by), k * (z * bx - x * bz), k * (x * by - y * bx))
        >>> braked = torquer.simulate(scenario, law=brake)
        >>> bool(braked.torquer.rate()[-1] < braked.torquer.rate()[0])
        True
    """
    options = {
        "parameters": parameters, "limits": limits, "memory": memory, "log": log, "needs": needs,
    }  # fmt: skip
    if function is None:
        options |= {"answers": answers, "satellite": satellite}
        return functools.partial(law, **options, compiled=compiled)
    for need in needs:
        if need not in _NEEDS:
            raise ValueError(
                f"law {function.__name__}: needs must be of {', '.join(_NEEDS)}; received {need!r}"
            )
    for name in satellite:
        if name not in OF_SATELLITE or name in (parameters or {}):
            raise ValueError(
                f"law {function.__name__}: satellite must be of {', '.join(OF_SATELLITE)}, and "
                f"not among parameters; received {name!r}"
            )
    return Law(
        function.__name__,
        function,
        {**(parameters or {}), **{name: OF_SATELLITE[name] for name in satellite}},
        memory,
        log or {},
        frozenset(needs) | needed_readings(function),
        compiled,
        answers=answers,
        own_limits=limits or {},
        satellite=tuple(satellite),
    )
