"""Mean elements for SGP4: files of two-line elements, CCSDS Orbit Mean-Elements Messages (OMM)."""

import csv
import io
import json
import re
from collections.abc import Iterator
from typing import NamedTuple

from sgp4 import exporter, omm
from sgp4.api import Satrec

_LINE = re.compile(r"^([12]) [ 0-9A-Z]")
_KVN = "CCSDS_OMM_VERS"
_NAME, _NUMBER = "OBJECT_NAME", "NORAD_CAT_ID"
#: Part by which elements may differ after they have been written as two lines.
_ROUNDING = 1e-7
_KEPT = ("no_kozai", "ecco", "inclo", "nodeo", "argpo", "mo", "bstar")


#: What an OMM may say of its elements, if it says it.
_MUST = {
    "MEAN_ELEMENT_THEORY": ("SGP4", "SGP/SGP4"),
    "TIME_SYSTEM": ("UTC",),
    "CENTER_NAME": ("EARTH",),
    "REF_FRAME": ("TEME",),
}


class Elements(NamedTuple):
    """A set of elements: name and catalogue number of its satellite, its two lines."""

    name: str
    number: str
    tle: tuple[str, str]
    line: int


def are_elements(text: str) -> bool:
    """Whether a file holds two-line elements or is an OMM."""
    head = text.lstrip()
    is_omm = head.startswith((_KVN, "<", "{", "[")) or _NAME in head.partition("\n")[0]
    return is_omm or any(_LINE.match(line) for line in text.splitlines())


def read_elements(text: str, satellite: str | None) -> list[Elements]:
    """All sets of one satellite, which is chosen by name or number where there are several."""
    found = list(_all_sets(text))
    if not found:
        raise ValueError("must hold sets of elements; received none")
    wanted = [each for each in found if _is(each, satellite)]
    if len({each.number for each in wanted}) != 1:
        known = sorted({f"{each.number} {each.name}".strip() for each in found})
        some = ", ".join(known[:8]) + (f" and {len(known) - 8} others" if len(known) > 8 else "")
        raise ValueError(
            f"satellite: must name one of the file's by catalogue number or name ({some}); "
            f"received {satellite!r}"
        )
    return wanted


def _is(each: Elements, satellite: str | None) -> bool:
    if satellite is None:
        return True
    word = satellite.strip().upper()
    return word.lstrip("0") == each.number.strip().lstrip("0") or word == each.name.upper()


def _all_sets(text: str) -> Iterator[Elements]:
    head = text.lstrip()
    if head.startswith(_KVN):
        yield from map(_from_fields, _kvn(head))
    elif head.startswith("<"):
        if "<omm" not in head:
            raise ValueError(
                "must be an OMM where it is XML (an OEM is read in keyword-value notation); "
                "received another"
            )
        yield from map(_from_fields, _xml(head))
    elif head.startswith(("{", "[")):
        yield from map(_from_fields, _json(head))
    elif _NAME in head.partition("\n")[0]:
        yield from map(_from_fields, csv.DictReader(io.StringIO(head)))
    else:
        yield from _two_lines(text)


def _two_lines(text: str) -> Iterator[Elements]:
    """Sets of two lines, each with a name before it or none."""
    name, first = "", None
    for number, whole in enumerate(text.splitlines(), start=1):
        line = whole.rstrip()
        found = _LINE.match(line)
        if found is None:
            name = line.removeprefix("0 ").strip()
        elif found[1] == "1":
            first = (number, line)
        elif first is not None:
            yield Elements(name, line[2:7], (first[1], line), first[0])
            name, first = "", None


def _kvn(text: str) -> Iterator[dict[str, str]]:
    fields: dict[str, str] = {}
    for line in text.splitlines():
        key, is_keyword, value = line.partition("=")
        if key.strip() == _KVN and fields:
            yield fields
            fields = {}
        if is_keyword:
            fields[key.strip()] = value.partition("[")[0].strip()
    yield fields


def _xml(text: str) -> list[dict[str, str]]:
    try:
        return list(omm.parse_xml(io.StringIO(text)))
    except (SyntaxError, AttributeError, TypeError) as error:  # of its parser; of what is missing
        raise ValueError(f"must be the XML of an OMM; received another ({error})") from None


def _json(text: str) -> list[dict[str, str]]:
    try:
        found = json.loads(text)
    except ValueError as error:
        raise ValueError(f"must be JSON that can be read; received {error}") from None
    rows = found if isinstance(found, list) else [found]
    if not all(isinstance(row, dict) for row in rows):
        raise ValueError("must be a list of tables; received another JSON text")
    return [{key: str(value) for key, value in row.items()} for row in rows]


def _from_fields(fields: dict) -> Elements:
    """The set of an OMM's fields, as two lines."""
    name = str(fields.get(_NAME, ""))
    for key, allowed in _MUST.items():
        if fields.get(key, allowed[0]).upper() not in allowed:
            raise ValueError(f"{key} must be {' or '.join(allowed)}; received {fields[key]!r}")
    satellite, again = Satrec(), Satrec()
    try:
        omm.initialize(satellite, fields)
        lines = exporter.export_tle(satellite)
        again = Satrec.twoline2rv(*lines)
    except (KeyError, ValueError, TypeError) as error:
        raise ValueError(f"{name or 'OMM'}: must hold all elements; received {error}") from None
    for key in _KEPT:
        given, kept = getattr(satellite, key), getattr(again, key)
        if abs(given - kept) > _ROUNDING * max(abs(given), 1e-3):
            raise ValueError(
                f"{name or 'OMM'}: must have elements of as many digits as two lines hold; "
                f"received {given!r} ({key})"
            )
    return Elements(name, str(fields[_NUMBER]), lines, 1)
