"""Mean elements for SGP4: files of two-line elements, and of messages (OMM) in another module."""

import re
from collections.abc import Iterator
from datetime import datetime
from typing import NamedTuple

from sgp4.alpha5 import from_alpha5

from torquer.base.explain import ScenarioError
from torquer.environment.orbit.files.naming import is_called
from torquer.environment.orbit.files.omm import Message, is_omm, messages
from torquer.environment.orbit.mean_elements import MeanElements
from torquer.environment.orbit.numerical import tle_epoch
from torquer.environment.orbit.sgp4 import Sgp4

#: How a line of elements begins: its number, the catalogue number, the classification.
_LINE = re.compile(r"([12]) [ 0-9A-Z][ 0-9]{3}[0-9][A-Z ]", re.ASCII)
#: Column of the type of elements, from 0, and that of SGP4-XP.
_TYPE, _XP = 62, "4"
#: The sets that are listed where one must be chosen.
_MOST_LISTED = 8


class ElementSet(NamedTuple):
    """Elements of a satellite; `called`: its catalogue number and name, as the file has them."""

    orbit: Sgp4 | MeanElements
    called: str

    @property
    def epoch(self) -> datetime:
        """Epoch of the elements."""
        orbit = self.orbit
        return orbit.epoch if isinstance(orbit, MeanElements) else tle_epoch(orbit)


class TwoLines(NamedTuple):
    """A set of two lines, with their numbers in the file, and the name before them."""

    name: str
    lines: tuple[str, str]
    at: tuple[int, int]

    @property
    def number(self) -> str:
        """Catalogue number as it is written."""
        return self.lines[0][2:7].strip()

    def names(self) -> tuple[str, ...]:
        """What its satellite is called: a number beyond 99999 has a letter in two lines."""
        try:
            return self.number, str(from_alpha5(self.number)), self.name
        except ValueError:
            return self.number, self.name

    def orbit(self, without_checksums: bool) -> Sgp4:
        """Its orbit; ValueError by line."""
        if self.lines[0][_TYPE : _TYPE + 1] == _XP:
            raise ValueError(
                f"line {self.at[0]}: column {_TYPE + 1} must be that of elements for SGP4; "
                f"received {_XP!r}, which are for SGP4-XP"
            )
        try:
            return Sgp4(tle=self.lines, without_checksums=without_checksums)
        except ScenarioError as error:
            first = str(error).split("\n")[0].replace("tle: tle line", "tle line")
        raise ValueError(self._by_line(first))

    def _by_line(self, fault: str) -> str:
        """A fault of a set as one of a line in the file."""
        for line, at in enumerate(self.at, start=1):
            if fault.startswith(f"tle line {line}: "):
                return f"line {at}: {fault.partition(': ')[2]}"
        what, _, must = fault.partition(": ")
        return f"line {self.at[1]}: {must if what == 'tle' else f'{what} {must}'}"


def are_elements(text: str) -> bool:
    """Whether a file holds two-line elements or is an OMM."""
    return is_omm(text) or any(_LINE.match(line.lstrip()) for line in text.splitlines())


def read_elements(
    text: str, satellite: str | None, without_checksums: bool = False
) -> list[ElementSet]:
    """All sets of one satellite, which is chosen by name or number where there are several."""
    found: list[TwoLines | Message] = [*(messages(text) if is_omm(text) else _two_lines(text))]
    if not found:
        raise ValueError("must hold sets of elements; received none")
    wanted = [each for each in found if is_called(satellite, *each.names())]
    if len({each.number for each in wanted}) != 1:
        known = sorted(set(map(_called, found)))
        more = len(known) - _MOST_LISTED
        some = ", ".join(known[:_MOST_LISTED]) + (f" and {more} others" if more > 0 else "")
        raise ValueError(
            f"satellite: must name one of the file's by catalogue number or name ({some}); "
            f"received {satellite!r}"
        )
    return [
        ElementSet(
            each.orbit(without_checksums) if isinstance(each, TwoLines) else each.orbit(),
            _called(each),
        )
        for each in wanted
    ]


def read_neighbours(text: str, called: str, most: int) -> list[list[ElementSet]]:
    """Sets of other satellites in a text than the one that is called so, a list each.

    Of more than `most` those with the nearest catalogue numbers, which were launched with it. Sets
    with mistakes are left out.
    """
    found: dict[str, list] = {}
    for each in messages(text) if is_omm(text) else _two_lines(text):
        found.setdefault(each.number, []).append(each)
    own = next((key for key, sets in found.items() if called in map(_called, sets)), None)
    rest = [key for key in found if key != own]
    rest.sort(key=lambda key: abs(_order(key) - _order(own or "")))
    made = ([*filter(None, map(_made, found[key]))] for key in rest[:most])
    return [sets for sets in made if sets]


def _order(number: str) -> int:
    """Catalogue number; 0 of what is none."""
    try:
        return int(from_alpha5(number)) if len(number) == 5 else int(number)
    except ValueError:
        return 0


def _made(each: TwoLines | Message) -> ElementSet | None:
    try:
        orbit = each.orbit(False) if isinstance(each, TwoLines) else each.orbit()
        return ElementSet(orbit, _called(each))
    except ValueError:
        return None


def _called(each: TwoLines | Message) -> str:
    return each.name if each.name == each.number else f"{each.number} {each.name}".strip()


def _two_lines(text: str) -> Iterator[TwoLines]:
    """Sets of two lines, each with a name before it or none."""
    name, first = "", None
    for at, whole in enumerate(text.splitlines(), start=1):
        line = whole.strip()
        if not line or line.startswith("#"):
            continue
        found = _LINE.match(line)
        is_second = found is not None and found[1] == "2"
        if first is not None and not is_second:
            raise _no_second(first[0], line)
        if found is None:
            name = line.removeprefix("0 ").strip()
        elif first is not None:
            yield TwoLines(name, (first[1], line), (first[0], at))
            name, first = "", None
        elif is_second:
            raise ValueError(f"line {at}: must follow line 1 of its elements; received {line!r}")
        else:
            first = (at, line)
    if first is not None:
        raise _no_second(first[0], "the end of the file")


def _no_second(at: int, received: str) -> ValueError:
    return ValueError(
        f"line {at}: must have line 2 of its elements below it; received {received[:40]!r}"
    )
