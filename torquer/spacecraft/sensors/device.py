"""What a device is that the on-board computer reads: declared once, in its own file.

The table of all of them is `torquer.spacecraft.sensors.devices`; what the computer's record, the
loop, results, telemetry and exports say of a device follows from its row.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

from torquer.compile.engine import inlined
from torquer.spacecraft.failures import TURNS_ATTITUDE, TURNS_DIRECTION, TURNS_NOTHING

#: Names of the numbers of a reading.
XYZ, XYZW = ("x", "y", "z"), ("x", "y", "z", "w")
#: Most numbers of a reading; numbers that a device may remember between its readings.
MOST_PARTS, OWN_CELLS = 6, 20
#: Most devices of kinds of which a satellite has several.
MOST_UNITS = 12


class Around(NamedTuple):
    """What there is to sense where the satellite is, the same for all members in lanes.

    `shadow`: model of it; `orbit`, `sun`, `moon`: tables of position, field and so on, and of the
    Sun's and the Moon's position; `b_inertial`: field there [T].
    """

    shadow: Any
    orbit: Any
    sun: Any
    moon: Any
    b_inertial: tuple
    t_s: float


class Here(NamedTuple):
    """What a device of one satellite is exposed to.

    `motion`: true attitude and rate; `coils`, `coil_state`: constants and state of the coils;
    `own`: what the device remembers between its readings; `t_s`: now.
    """

    motion: Any
    coils: Any
    coil_state: Any
    own: Any
    t_s: float


@inlined
def nothing_around(sensor, around):
    """What a device needs of its surroundings that feels the motion alone."""
    return 0.0


def packed(spec) -> tuple:
    """Constants of one of several devices: those of one alone."""
    return spec.pack()


@dataclass(frozen=True)
class Device:
    """A kind of sensor.

    `name`: its key in scenarios, conditions and failures. `given`: its name in `torquer.Inputs`.
    `parts`: names of the numbers of a reading. `units`, `frame`, `meaning`: of a reading, in words;
    `symbol`: beginning of the names of its variables in results. `said`: what it is called in
    sentences, singular or plural.

    `spec`: what a scenario says of it, None for one that has nothing to say. `need`: the word by
    which laws say that they read it; "" for one that satellites have in any case. `ideal`:
    constants of one that is left out and needed; without them nothing stands in for it. `absent`:
    constants of one that is not read.

    `read(constants, here, sky, *drawn) -> reading`: the kernel of its errors; `sky(constants,
    around)`: what it needs of its surroundings; `draws`: for each three random numbers, their
    stream and the constants whose greatest says whether any are needed. `by_sunlight(constants)`:
    whether it looks for the Sun, `by_moon(constants)`: for the Moon; None for one that never does.

    `several`: key of scenarios under which a satellite has several of it, by names; "" for a device
    of which there is one. `to_unit(spec)`: constants of one of several, numbers and tuples of such;
    `read_unit`: the kernel of its errors, where they are not those of one alone.

    `measurement`: the module in `torquer.computer.estimation.measurements` by which filters use it;
    "" for one that they do not measure with.

    `quantum`: the constant that a reading is rounded to; "" for one that is not.

    `nothing`: what it reads where it has nothing to read: "" (it always has), "zeros" or "nan".
    `turned`: whether an error of a reading is a rotation. `may_stay`: whether a sound one may send
    the same numbers for long. `by_coils`: whether coils that are on disturb it. `integrates`:
    whether it accumulates what a gyro reads and takes its place. `combines`: whether several become
    one that laws read.
    """

    name: str
    given: str
    said: str
    symbol: str
    units: str
    meaning: str
    frame: str = "body"
    parts: tuple[str, ...] = XYZ
    spec: Any = None
    ideal: Any = None
    absent: Any = None
    need: str = ""
    read: Callable | None = None
    sky: Callable | None = None
    draws: tuple[tuple[int, tuple[str, ...]], ...] = ()
    by_sunlight: Callable[[Any], bool] | None = None
    by_moon: Callable[[Any], bool] | None = None
    several: str = ""
    to_unit: Callable[[Any], tuple] = packed
    read_unit: Callable | None = None
    measurement: str = ""
    nothing: str = ""
    quantum: str = ""
    turned: bool = False
    may_stay: bool = False
    by_coils: bool = False
    integrates: bool = False
    combines: bool = True

    @property
    def kind(self) -> str:
        """What the computer takes its readings for: its name, or that of what it takes place of."""
        return "gyro" if self.integrates else self.name

    @property
    def stands_in(self) -> bool:
        """Whether an ideal one is read where something needs it and a satellite has none."""
        return self.ideal is not None

    def noise(self, spec) -> float:
        """Noise of a reading, of the first draw, in the unit of its constants."""
        constants = self.to_unit(spec)
        return max((getattr(constants, name) for name in self.draws[0][1]), default=0.0)

    def may_repeat(self, spec) -> bool:
        """Whether a sound one may send the same numbers for long: it is rounded above its noise."""
        rounded = getattr(self.to_unit(spec), self.quantum) if self.quantum else 0.0
        noise = self.noise(spec)
        return noise == 0.0 or noise < rounded

    def constants(self, spec) -> tuple:
        """Constants of one alone for kernels."""
        return spec.pack()

    @property
    def turns(self) -> int:
        """What an error of a reading turns."""
        if not self.turned:
            return TURNS_NOTHING
        return TURNS_ATTITUDE if self.parts == XYZW else TURNS_DIRECTION

    @property
    def count(self) -> int:
        """Numbers of a reading."""
        return len(self.parts)
