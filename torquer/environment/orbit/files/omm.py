"""CCSDS Orbit Mean-Elements Message (502.0-B): keyword-value notation, XML, JSON, CSV.

What SGP4 needs is read with all its digits, and checked; what it does not need may be left out.
"""

import json
from collections.abc import Iterator
from datetime import UTC
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np

from torquer.environment.orbit.files.csv_rows import table_rows
from torquer.environment.orbit.files.naming import first_line
from torquer.environment.orbit.files.stamps import read_numbers, read_stamp, seconds_behind
from torquer.environment.orbit.kepler import check_farthest
from torquer.environment.orbit.mean_elements import MeanElements

_KVN = "CCSDS_OMM_VERS"
_COMMENT = "COMMENT"
_NAME, _NUMBER, _ID = "OBJECT_NAME", "NORAD_CAT_ID", "OBJECT_ID"
#: What a message may say of its elements, if it says it; 4 is SGP4-XP, 6 another theory.
_MUST = {
    "MEAN_ELEMENT_THEORY": ("SGP4", "SGP/SGP4"),
    "TIME_SYSTEM": ("UTC",),
    "CENTER_NAME": ("EARTH",),
    "REF_FRAME": ("TEME", "TEMEOFDATE"),
    "EPHEMERIS_TYPE": ("0", "2"),
}
#: Keywords of the numbers of `MeanElements` in its order: least, greatest, unit. The mean motion is
#: that of an orbit within the Earth's Hill sphere and above its surface.
_ELEMENTS = {
    "MEAN_MOTION": (0.0046, 17.1, "rev/day"),
    "ECCENTRICITY": (0.0, 0.9999999, None),
    "INCLINATION": (0.0, 180.0, "deg"),
    "RA_OF_ASC_NODE": (-360.0, 360.0, "deg"),
    "ARG_OF_PERICENTER": (-360.0, 360.0, "deg"),
    "MEAN_ANOMALY": (-360.0, 360.0, "deg"),
    "BSTAR": (-10.0, 10.0, "1/ER"),
}
#: Numbers that SGP4 does not use.
_UNUSED = ("MEAN_MOTION_DOT", "MEAN_MOTION_DDOT")


class Message(NamedTuple):
    """Values and units by keyword, and the lines of the keywords where the file has them."""

    values: dict[str, str]
    units: dict[str, str]
    lines: dict[str, int]

    @property
    def name(self) -> str:
        """Name of the object, on one line."""
        return " ".join(self.values.get(_NAME, "").split())

    @property
    def number(self) -> str:
        """Catalogue number; without one, what else tells the object from others."""
        return self.values.get(_NUMBER) or self.values.get(_ID) or self.name

    def names(self) -> tuple[str, ...]:
        """What its object is called."""
        return self.number, self.name, self.values.get(_ID, "")

    def orbit(self) -> MeanElements:
        """Its elements; ValueError by keyword."""
        for key, allowed in _MUST.items():
            if self.values.get(key, allowed[0]).upper() not in allowed:
                raise self._fault(key, f"must be {' or '.join(allowed)}", repr(self.values[key]))
        for key in _UNUSED:
            if key in self.values:
                self._number(key)
        found = MeanElements(self._epoch(), *(self._element(key) for key in _ELEMENTS))
        try:
            check_farthest(found.extent().apogee_m)
        except ValueError as error:
            must, _, received = str(error).removeprefix("orbit: ").partition("; received ")
            raise self._fault("MEAN_MOTION", f"and ECCENTRICITY {must}", received) from None
        return found

    def _epoch(self):
        """UTC to the microsecond."""
        text = self._text("EPOCH")
        try:
            tai = read_stamp(text, "UTC")
        except ValueError as error:
            raise self._fault("EPOCH", str(error).partition("; received ")[0], repr(text)) from None
        utc = tai - np.timedelta64(round(1e9 * seconds_behind(tai)), "ns")
        return utc.astype("datetime64[us]").item().replace(tzinfo=UTC)

    def _element(self, key: str) -> float:
        low, high, unit = _ELEMENTS[key]
        given = self.units.get(key, unit)
        if given is not None and given.lower() != str(unit).lower():
            raise self._fault(key, f"must be in {unit or 'no unit'}", repr(given))
        value = self._number(key)
        if not low <= value <= high:
            raise self._fault(key, f"must lie in {low:.7g}..{high:.7g}", self.values[key])
        return value

    def _number(self, key: str) -> float:
        text = self._text(key)
        try:
            return read_numbers([text], 1)[0]
        except ValueError:
            raise self._fault(key, "must be a finite number", repr(text)) from None

    def _text(self, key: str) -> str:
        if not self.values.get(key):
            raise self._fault(key, "must be given", "none")
        return self.values[key]

    def _fault(self, key: str, must: str, received: str) -> ValueError:
        where = f"line {self.lines[key]}" if key in self.lines else self.name or "OMM"
        return ValueError(f"{where}: {key} {must}; received {received}")


def is_omm(text: str) -> bool:
    """Whether a file begins as a message."""
    head = first_line(text, (_COMMENT, "#"))
    is_table = _NAME in head.upper() and "=" not in head
    return head.startswith((_KVN, "<", "{", "[")) or is_table


def messages(text: str) -> Iterator[Message]:
    """All messages of a file."""
    head = first_line(text, (_COMMENT, "#"))
    if head.startswith(_KVN):
        return _kvn(text)
    if head.startswith("<"):
        return _xml(text)
    return _json(text) if head.startswith(("{", "[")) else _csv(text)


def _kvn(text: str) -> Iterator[Message]:
    found = Message({}, {}, {})
    for line, whole in enumerate(text.splitlines(), start=1):
        key, is_keyword, value = (part.strip() for part in whole.partition("="))
        if not is_keyword or key.startswith(_COMMENT):
            continue
        if key == _KVN and found.values:
            yield found
            found = Message({}, {}, {})
        found.values[key], _, unit = (part.strip() for part in value.partition("["))
        found.lines[key] = line
        if unit:
            found.units[key] = unit.removesuffix("]").strip()
    yield found


def _xml(text: str) -> Iterator[Message]:
    """Keywords are the tags of elements without children, in whichever namespace they are."""
    try:
        root = ElementTree.fromstring(text.strip())
    except ElementTree.ParseError as error:
        raise ValueError(f"must be XML that can be read; received an error: {error}") from None
    omms = [each for each in root.iter() if _tag(each) == "omm"]
    if not omms:
        raise ValueError(
            "must be an OMM where it is XML (an OEM is read in keyword-value notation); "
            f"received {_tag(root)!r}"
        )
    for each in omms:
        leaves = [leaf for leaf in each.iter() if not len(leaf)]
        values = {_tag(leaf): (leaf.text or "").strip() for leaf in leaves}
        units = {_tag(leaf): leaf.attrib["units"] for leaf in leaves if "units" in leaf.attrib}
        yield Message(values, units, {})


def _tag(element) -> str:
    return str(element.tag).rpartition("}")[2]


def _json(text: str) -> Iterator[Message]:
    try:
        found = json.loads(text, parse_float=str, parse_int=str)
    except ValueError as error:
        raise ValueError(f"must be JSON that can be read; received an error: {error}") from None
    except RecursionError:
        raise ValueError("must be a list of tables; received lists within lists") from None
    rows = found if isinstance(found, list) else [found]
    if not all(isinstance(row, dict) for row in rows):
        raise ValueError("must be a list of tables; received another JSON text")
    for row in rows:
        values = {key: str(value).strip() for key, value in row.items() if value is not None}
        yield Message(values, {}, {})


def _csv(text: str) -> Iterator[Message]:
    (_, names), *found = table_rows(text)
    names = [name.upper() for name in names]
    for line, row in found:
        values = {key: word for key, word in zip(names, row, strict=True) if word}
        yield Message(values, {}, dict.fromkeys(names, line))
