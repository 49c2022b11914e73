"""What an export declares, as the frameworks' files take it."""

import math
from pathlib import Path
from string import Template
from typing import NamedTuple

from torquer.base.version import VERSION
from torquer.compile.c_library import EXACT
from torquer.computer.blocks.limits import Limits
from torquer.computer.computer import parameter_places
from torquer.computer.gate import MET, OUTCOMES
from torquer.flight.c99.computer import OnBoard
from torquer.flight.c99.interface import Input, c_constant, named_constants, say_limits

_FOLDER = Path(__file__).parent / "templates"
_PREFIX = c_constant("")


class Named(NamedTuple):
    """A constant of `adcs.h`: its name without the prefix, its number, what it is."""

    name: str
    number: int
    said: str


class Region(NamedTuple):
    """A region of the mode table and its states."""

    itself: Named
    states: list[Named]


class Parameter(NamedTuple):
    """A parameter: its numbers at the start; `place`: of the first; whether ground may set it (all
    of its numbers, which must be finite); `limits`: of each.
    """

    name: str
    place: int
    values: list[float]
    is_settable: bool
    said: str
    limits: list[Limits]


class Schedule(NamedTuple):
    """The control cycle in ticks, the longest interval of which all others are whole numbers."""

    tick_ns: int
    cycle: int
    measure: int
    sample: int
    while_acting: bool


class Declared(NamedTuple):
    """What the files of a framework are made of."""

    name: str
    inputs: list[Input]
    regions: list[Region]
    flags: list[Named]
    parameters: list[Parameter]
    met: list[Named]
    outcomes: list[Named]
    schedule: Schedule
    has_ephemeris: bool

    def general(self) -> dict[str, str]:
        """Places that every file has."""
        ephemeris = '    "${ADCS_LIBRARY}/adcs_ephemeris.c"\n' if self.has_ephemeris else ""
        exact = " ".join(EXACT)
        return {"name": self.name, "version": VERSION, "ephemeris": ephemeris, "exact": exact}


def declare(computer: OnBoard, inputs: list[Input], has_ephemeris: bool = False) -> Declared:
    """What the export of a computer declares; whether it has an ephemeris on board."""
    constants = named_constants(computer)
    modes = computer.scenario.control.named().modes

    def named(kind: str, constant: str) -> Named:
        number, said = constants[kind][constant]
        return Named(constant.removeprefix(_PREFIX), number, said)

    regions = [
        Region(
            named("regions", c_constant("region", name)),
            [named("states", c_constant("state", name, state)) for state in region.states],
        )
        for name, region in (modes.regions.items() if modes else ())
    ]
    met = [
        Named(f"MET_{name.upper()}", 1 << bit, said) for bit, (name, said) in enumerate(MET.items())
    ]
    outcomes = [Named(name.upper(), k, said) for k, (name, said) in enumerate(OUTCOMES.items())]
    return Declared(
        computer.scenario.name.replace("*/", "* /"),
        inputs,
        regions,
        [named("flags", each) for each in constants["flags"]],
        _parameters(computer),
        met,
        outcomes,
        _schedule(computer),
        has_ephemeris,
    )


def _parameters(computer: OnBoard) -> list[Parameter]:
    rows, values = computer.gate.parameters, computer.board.parameters
    return [
        Parameter(
            c_constant("parameter", name).removeprefix(_PREFIX + "PARAMETER_"),
            first,
            values[first : first + count].tolist(),
            bool(rows["settable"][first : first + count].all())
            and all(map(math.isfinite, values[first : first + count].tolist())),
            f"{name}{say_limits(computer.blocks, name)}",
            [Limits(*row[1:]) for row in rows[first : first + count].tolist()],
        )
        for name, (first, count) in parameter_places(computer.blocks).items()
    ]


def _schedule(computer: OnBoard) -> Schedule:
    """The cycle of `torquer.simulation.loop.timetable`, without the sensors."""
    control, step_s = computer.scenario.control, computer.scenario.grid_s
    parts = [control.cycle_s, control.measure_s, control.sample_s]
    cycle, measure, sample = (round(each / step_s) for each in parts)
    tick = math.gcd(cycle, measure, sample)
    return Schedule(
        round(1e9 * tick * step_s), cycle // tick, measure // tick, sample // tick,
        control.control_while_actuating,
    )  # fmt: skip


def fill(file: str, places: dict[str, str]) -> str:
    """A template of the frameworks with its places (`$name`) filled."""
    return Template((_FOLDER / file).read_text(encoding="utf-8")).substitute(places)


def fill_all(files: tuple[str, ...], places: dict[str, str]) -> dict[str, str]:
    """Files of a framework, each by the template of its name in the framework's folder."""
    return {file: fill(f"{Path(file).parts[0]}/{Path(file).name}", places) for file in files}


def copied(text: str, input_: Input) -> list[str]:
    """A line for each number of an input; `$place` in it is where the number stands."""
    places = [f"[{k}]" for k in range(input_.count)] if input_.is_array else [""]
    return [text.replace("$place", place) for place in places]
