"""How filters measure with a device: declared once, in the measurement's own file.

`torquer.computer.estimation.measurements.table` collects them from the table of devices; channels,
keys, memory, logs and the analysis of expected accuracy follow from it.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from torquer.base.spec import Spec


def always(keys) -> None:
    """Nothing that the keys of a device must hold together."""


def one_part(keys) -> int:
    """A vector is one part."""
    return 1


class Place(NamedTuple):
    """The filter's channel of a measurement, and which of the device's single components it is."""

    channel: int
    part: int


@dataclass(frozen=True)
class Measured:
    """A device as a filter sees it.

    `name`: what filters call it, in their keys and logs; `said`: what it is called in text.
    `keys`: the filter's keys of it, `noise` the one that is given if it is used, and only then;
    `constants(spec)`: constants for kernels, a NamedTuple whose first field `r` is the variance of
    a component, 0 for a device that is not used.

    `check(keys)`: ValueError unless its keys hold together, be it used or not.
    `says`: what further keys say of the device, by what of its data sheet it is.

    `measure(inputs, parameters, memory, read, read_s, own, place, omega, walk) -> Measurement`:
    (z, H, R) of a reading if it is new, as of now. `own`: its constants; `place`: see `Place`; the
    body turns with `omega` since, `walk` is the growth of the variance of the propagated rotation
    by white noise [rad^2/s].

    `direction(inputs, parameters, read, read_s, own) -> Direction`: the latest reading as a
    direction for starts, None for one that gives none; `directions`: how many it stands for where
    sensors are compared. `odd(inputs, parameters, m)`: whether a measurement cannot be, whatever
    the attitude. `missing`: why a filter has not started without a reading of it.

    `reference`: what its model gives of the surroundings, "field", "sun" or "nadir"; "" for none.

    `channels`: of a filter; more than one for single components, each a measurement of its own, of
    which a filter with these keys has `parts(keys)`.
    `expected(parameters, along, k, own, assumed, cell) -> Measurement`: what it would read at
    place k of a nominal motion, where the filter assumes another direction or field than the true
    one (in single components, of the cell); `visible(craft, seen) -> (k,)`: whether it reads
    anything along it.

    `unit_constants(keys, spec)`: constants of one of several devices, by what the filter says of
    the kind and the scenario of this one; None: those of the kind.

    `colour`: in pictures, by the names of `torquer.report.common.colours`.
    """

    name: str
    said: str
    keys: type[Spec]
    noise: str
    constants: Callable[[Any], tuple]
    measure: Callable
    expected: Callable
    visible: Callable
    missing: str
    direction: Callable | None = None
    check: Callable[[Any], None] = always
    says: Mapping[str, str] = field(default_factory=dict)
    directions: int = 1
    reference: str = ""
    odd: Callable | None = None
    channels: int = 1
    parts: Callable[[Any], int] = one_part
    unit_constants: Callable[[Any, Any], tuple] | None = None
    colour: str = "BLUE"

    def of_unit(self, keys, spec) -> tuple:
        """Constants of one of several devices."""
        return (
            self.constants(keys) if self.unit_constants is None else self.unit_constants(keys, spec)
        )
