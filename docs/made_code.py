"""Kernels that name each device, made of the table of devices: `python docs/made_code.py`.

What differs between kinds of devices is text, checked in, so that the compiler, the export to C and
every reader find it where code is. A test makes it again and finds nothing changed.
"""

import itertools
import subprocess
import sys
import textwrap
import types
from pathlib import Path

from jinja2 import Environment, StrictUndefined

from torquer.spacecraft.sensors.device import MOST_PARTS, MOST_UNITS, Device
from torquer.spacecraft.sensors.devices import (
    DEVICES,
    FIRST_UNIT_STREAM,
    MOST_DRAWS,
    example_of,
)

ROOT = Path(__file__).parents[1]
TEMPLATES = ROOT / "docs" / "templates"
_IN = " " * 4
#: Devices of which an ideal computer of theory knows the reading.
_EXACT = ("magnetometer", "search_coil", "gyro", "sun_sensors", "attitude_sensor")


class Row:
    """A device with what the text of kernels needs besides its declaration."""

    def __init__(self, number: int, device: Device):
        self.number, self._device = number, device

    def __getattr__(self, name: str):
        return getattr(self._device, name)

    @property
    def zeros(self) -> str:
        """A reading before the first one."""
        return "(" + ", ".join(["0.0"] * self.count) + ")"

    def padded(self, reading: str) -> str:
        """A reading as six numbers."""
        parts = [f"{reading}[{k}]" if k < self.count else "0.0" for k in range(MOST_PARTS)]
        return f"({', '.join(parts)})"

    @property
    def known_as(self) -> str:
        """A line of the docstring of the inputs."""
        frame = f", {self.frame}" if self.frame else ""
        line = f"`{self.given}`: {self.meaning} [{self.units}]{frame}."
        return "\n".join(textwrap.wrap(line, 100, initial_indent=_IN, subsequent_indent=_IN))

    @property
    def module(self) -> str:
        """The module of its kernels."""
        return self.read.__module__.rpartition(".")[2]

    @property
    def unit_kernel(self) -> str:
        """Name of the kernel of the errors of one of several."""
        return (self.read_unit or self.read).__name__

    @property
    def drawn(self) -> list:
        """Its draws, numbered."""
        return [(number, sizes) for number, (_, sizes) in enumerate(self.draws)]

    @property
    def rebuilt(self) -> str:
        """Constants of one of several, of a row of numbers."""
        places = itertools.count()

        def text(value) -> str:
            if not isinstance(value, tuple):
                return f"rows[unit, {next(places)}]"
            inner = ", ".join(map(text, value))
            return f"({inner})" if type(value) is tuple else f"{self._class(value)}({inner})"

        return text(self.to_unit(example_of(self._device)))

    def _class(self, value) -> str:
        return f"{self.module}.{type(value).__name__}"

    @property
    def sender(self) -> str:
        """What hands a reading to the computer."""
        return f"send{self.count}"

    def size_of(self, names: tuple[str, ...]) -> str:
        """The greatest of some of its constants."""
        sizes = [f"constants.{name}" for name in names]
        return sizes[0] if len(sizes) == 1 else f"max({', '.join(sizes)})"


def inputs_text() -> str:
    """Text of what the computer knows."""
    rows = table_rows()
    return render(
        "inputs.py.jinja",
        devices=rows,
        most_parts=MOST_PARTS,
        exact=[row for row in rows if row.name in _EXACT],
        units=range(len(DEVICES), len(DEVICES) + MOST_UNITS),
    )


def due_text() -> str:
    """Text of reading the devices that are due."""
    read = [row for row in table_rows() if row.read]
    return render(
        "due.py.jinja",
        devices=read,
        usual=[row for row in read if not row.need],
        seldom=[row for row in read if row.need],
        several=[row for row in read if row.several],
        count=len(DEVICES),
        first_stream=FIRST_UNIT_STREAM,
        draws_each=MOST_DRAWS,
        modules=sorted({row.module for row in read}),
        senders=sorted({row.sender for row in read}),
    )


def table_rows() -> list[Row]:
    """The devices, numbered."""
    return [Row(number, device) for number, device in enumerate(DEVICES)]


class Channel:
    """A measurement with what the text of kernels needs besides its declaration."""

    def __init__(self, device: str, measured, first: int):
        self.device, self._measured, self.first = device, measured, first
        self.row = next(row for row in table_rows() if row.name == device)
        self.given = self.row.given
        self.after = self.first + measured.channels

    def __getattr__(self, name: str):
        return getattr(self._measured, name)

    @property
    def module(self) -> str:
        """The module of its kernels."""
        return self.row.measurement

    @property
    def constants_type(self) -> str:
        """Class of its constants."""
        return self.constants.__annotations__["return"].__name__

    @property
    def condition(self) -> str:
        """Whether a channel is one of its own."""
        one = f"channel == {self.first}"
        return one if self.channels == 1 else f"channel >= {self.first}"

    @property
    def condition_of_kind(self) -> str:
        """Whether a channel is served by its kernels."""
        if self.channels == 1:
            return f"kind == {self.first}"
        return f"{self.first} <= kind < {self.after}"

    @property
    def several(self) -> bool:
        """Whether there may be several of it, each a measurement of its own."""
        return bool(self.row.several)

    @property
    def padded(self) -> str:
        """Its reading as six numbers."""
        return self.row.padded(f"inputs.{self.given}")

    @property
    def cut(self) -> str:
        """Its reading out of six numbers."""
        return "(" + ", ".join(f"v[{k}]" for k in range(self.row.count)) + ")"

    @property
    def unused(self) -> str:
        """Whether the channel of the kind is not used."""
        return f"(channel == {self.first} and not sensing.{self.name}.r > 0.0)"

    @property
    def number(self) -> str:
        """Whether a reading is one of finite numbers, or means that the device is blinded."""
        total = " + ".join(f"v[{k}]" for k in range(self.row.count))
        blinded = "math.isnan(v[0]) or " if self.row.nothing == "nan" else ""
        return f"{blinded}math.isfinite({total})"

    @property
    def rebuilt(self) -> str:
        """Its constants, of a row of numbers that begins with the kind."""
        places = itertools.count(1)
        example = self.constants(self.keys())

        def text(value) -> str:
            if not isinstance(value, tuple):
                return f"u[{next(places)}]"
            inner = ", ".join(map(text, value))
            if type(value) is tuple:
                return f"({inner})"
            return f"{self.module}.{type(value).__name__}({inner})"

        return text(example)

    @property
    def is_isolated(self) -> str:
        """Whether it is judged to be wrong."""
        return f"is_isolated(memory, {self.first}, {self.after})"

    @property
    def variance(self) -> str:
        """Its variance in the constants of a filter."""
        return f"sensing.{self.name}.r"


def _stand_in_for_channels() -> None:
    """Let filters be imported while the file that they import is yet to be made, or is old."""
    name = "torquer.computer.estimation.channels"
    if name not in sys.modules:
        module = types.ModuleType(name)
        module.__getattr__ = lambda attribute: type(attribute, (tuple,), {})
        sys.modules[name] = module


def channels_text() -> str:
    """Text of the kernels of a filter's channels."""
    _stand_in_for_channels()
    from torquer.computer.estimation.measurements.table import CHANNEL_OF, MEASURED, UNITS_AT

    measurements = [
        Channel(device, measured, CHANNEL_OF[measured.name])
        for device, measured in MEASURED.items()
    ]
    of_device = {each.device: each.is_isolated for each in measurements} | {"gyro": "gyro"}
    others = [each for each in measurements if each.name != "magnetometer"]
    return render(
        "channels.py.jinja",
        measurements=measurements,
        units_at=UNITS_AT,
        units=MOST_UNITS,
        others=others,
        directions=[each for each in others if each.direction],
        isolated=[of_device.get(row.name, "0.0") for row in table_rows()],
    )


#: The files that are made, in this order.
MADE = {
    "torquer/computer/inputs.py": inputs_text,
    "torquer/simulation/loop/due.py": due_text,
    "torquer/computer/estimation/channels.py": channels_text,
}


def made_files() -> dict[str, str]:
    """Texts of the files that are made, by their paths, as the formatter leaves them."""
    return {path: make() for path, make in MADE.items()}


def render(template: str, **given) -> str:
    """A template filled in."""
    environment = Environment(undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    text = (TEMPLATES / template).read_text(encoding="utf-8")
    return formatted(environment.from_string(text).render(**given))


def formatted(text: str) -> str:
    """Text as the formatter of the project leaves it."""
    ruff = [sys.executable, "-m", "ruff", "format", "--config", str(ROOT / "pyproject.toml"), "-"]
    return subprocess.run(ruff, input=text, capture_output=True, text=True, check=True).stdout


def main() -> None:
    """Write the files."""
    for path, make in MADE.items():
        (ROOT / path).write_text(make(), encoding="utf-8")


if __name__ == "__main__":
    main()
