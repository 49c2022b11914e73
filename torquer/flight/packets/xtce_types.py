"""Parameter types of XTCE as fields of a dictionary: the part of XTCE that a dictionary can hold.

Whole numbers, floats, enumerations, truth values, binary data and texts of a fixed size, in either
byte order; polynomials as calibrators. Whatever else there is gets one line that names it.
"""

from collections.abc import Iterator
from xml.etree import ElementTree

from pydantic import ValidationError

from torquer.flight.packets.alarm_limits import AlarmKeys
from torquer.flight.packets.fields import Order
from torquer.flight.packets.number_types import TYPES
from torquer.flight.packets.xtce import ALARM, UNKNOWN

_BYTE_ORDERS: dict[str, Order] = {
    "mostSignificantByteFirst": "big",
    "leastSignificantByteFirst": "little",
}
_SIGNS = {"unsigned": "u", "twosComplement": "i", "twosCompliment": "i"}
_FLOATS = ("IEEE754", "IEEE754_1985")
_GROUPS = ("Integer", "Float", "Enumerated", "Boolean", "Binary", "String")
#: Most coefficients of a polynomial.
_MOST_TERMS = 12
#: Ranges of alarms with what they are in a dictionary; levels of alarms.
_RANGES = {"WarningRange": "limits", "CriticalRange": "critical"}
_SEVERITIES = {"watch": "warning", "warning": "warning"} | dict.fromkeys(
    ("distress", "critical", "severe"), "alarm"
)


def tag_of(element: ElementTree.Element) -> str:
    """The tag of an element, in whichever namespace it is."""
    return str(element.tag).rpartition("}")[2]


def children(element: ElementTree.Element, *path: str) -> list[ElementTree.Element]:
    """The elements at the end of a path of tags."""
    found = [element]
    for tag in path:
        found = [child for each in found for child in each if tag_of(child) == tag]
    return found


def must(place: str, what: str, received: object) -> ValueError:
    """The mistake of an element: one line."""
    return ValueError(f"{place}: must {what}; received {received}")


def read_type(element: ElementTree.Element, notes: list[str]) -> dict:
    """What a field has of a parameter type: all but its name and description.

    `notes`: grows by what was left out. ValueError for what a dictionary cannot hold.
    """
    place = f"{tag_of(element)} {element.get('name')}"
    group = tag_of(element).removesuffix("ParameterType")
    if group not in _GROUPS or element.get("baseType"):
        received = "a baseType" if element.get("baseType") else tag_of(element)
        raise must(place, f"be one of {', '.join(_GROUPS)}, complete in itself", received)
    found = _read_encoding(place, element)
    if unit := " ".join(each.text or "" for each in children(element, "UnitSet", "Unit")).strip():
        found["unit"] = clean_text(unit)
    if group in ("Enumerated", "Boolean"):
        found |= _read_labels(place, group, element)
    found |= _read_bits(element)
    return found | _read_limits(place, element, found, notes)


def clean_text(text: str) -> str:
    """A text as a dictionary has it: one line, without quotation marks and backslashes."""
    line = " ".join(text.split()).replace('"', "'").replace("\\", "/")
    return "".join(each for each in line if each.isprintable())


def _read_encoding(place: str, element: ElementTree.Element) -> dict:
    encodings = [each for each in element if tag_of(each).endswith("DataEncoding")]
    if len(encodings) != 1:
        raise must(place, "have one DataEncoding", len(encodings))
    (encoding,) = encodings
    for tag in ("ContextCalibratorList", "ByteOrderList", "ErrorDetectCorrect"):
        if children(encoding, tag):
            raise must(place, "be encoded without it", tag)
    if encoding.get("bitOrder", "mostSignificantBitFirst") != "mostSignificantBitFirst":
        raise must(place, "have bitOrder mostSignificantBitFirst", encoding.get("bitOrder"))
    kind = tag_of(encoding).removesuffix("DataEncoding")
    if kind in ("Binary", "String"):
        return {"type": "bytes", "count": _fixed_bytes(place, encoding)}
    if kind not in ("Integer", "Float"):
        raise must(place, "be encoded as a number, binary data or text", tag_of(encoding))
    found = _read_number(place, kind, encoding)
    return found | _read_calibrator(place, encoding, found["type"])


def _read_number(place: str, kind: str, encoding: ElementTree.Element) -> dict:
    """Type and byte order of a number."""
    name = encoding.get("encoding", "unsigned" if kind == "Integer" else "IEEE754_1985")
    known = _SIGNS if kind == "Integer" else dict.fromkeys(_FLOATS, "f")
    if name not in known:
        raise must(place, f"be encoded as {' or '.join(known)}", name)
    size = encoding.get("sizeInBits", "8" if kind == "Integer" else "32")
    number = f"{known[name]}{size}"
    if number not in TYPES:
        raise must(place, "have 1 to 64 bits, a float 16, 32 or 64", size)
    order = encoding.get("byteOrder", "mostSignificantByteFirst")
    if order not in _BYTE_ORDERS:
        raise must(place, f"have a byteOrder {' or '.join(_BYTE_ORDERS)}", order)
    kind_of = {"unknown": "none"} if number[0] == "i" else {}
    return {"type": number, "byte_order": _BYTE_ORDERS[order], **kind_of}


def _fixed_bytes(place: str, encoding: ElementTree.Element) -> int:
    sizes = children(encoding, "SizeInBits", "FixedValue")
    sizes += children(encoding, "SizeInBits", "Fixed", "FixedValue")
    text = (sizes[0].text or "").strip() if len(sizes) == 1 else "another"
    if not text.isdecimal() or not 0 < int(text) <= 2**20 or int(text) % 8:
        raise must(place, "have a fixed size of whole bytes", f"{text} bits")
    return int(text) // 8


def _read_calibrator(place: str, encoding: ElementTree.Element, kind: str) -> dict:
    """Scale and offset, or a polynomial."""
    calibrators = [each for each in children(encoding, "DefaultCalibrator") for each in each]
    if not calibrators:
        return {}
    if len(calibrators) > 1 or tag_of(calibrators[0]) != "PolynomialCalibrator":
        raise must(place, "have a PolynomialCalibrator", tag_of(calibrators[0]))
    coefficients = _coefficients(place, calibrators[0])
    if coefficients == [0.0, 1.0]:
        return {}
    if kind[0] == "f":
        raise must(place, "be a whole number where it has a calibrator", kind)
    if len(coefficients) > 2:
        return {"polynomial": tuple(coefficients)}
    offset, scale = coefficients
    return {"scale": scale, "offset": offset}


def _coefficients(place: str, calibrator: ElementTree.Element) -> list[float]:
    """Coefficients by rising powers, at least two."""
    found = {}
    for term in children(calibrator, "Term"):
        exponent, text = term.get("exponent", ""), term.get("coefficient", "")
        if not exponent.isdecimal() or int(exponent) >= _MOST_TERMS:
            raise must(place, f"have exponents from 0 to {_MOST_TERMS - 1}", repr(exponent))
        found[int(exponent)] = read_number(place, text)
    most = max((power for power, each in found.items() if each), default=0)
    if most == 0:
        raise must(place, "have a calibrator that depends on the raw number", "a constant")
    return [found.get(power, 0.0) for power in range(most + 1)]


def read_number(place: str, text: str) -> float:
    """A number; ValueError with one line for another text."""
    try:
        return float(text)
    except ValueError:
        raise must(place, "have numbers", repr(text)) from None


def _read_labels(place: str, group: str, element: ElementTree.Element) -> dict:
    if group == "Boolean":
        texts = element.get("zeroStringValue", "False"), element.get("oneStringValue", "True")
        return {"labels": tuple(map(clean_text, texts))}
    found: dict[int, str] = {}
    for each in children(element, "EnumerationList", "Enumeration"):
        text, most = each.get("value", ""), each.get("maxValue")
        if most is not None and most != text:
            raise must(place, "have an Enumeration for each number", f"maxValue {most}")
        if not text.removeprefix("-").isdecimal() or len(text) > 20:
            raise must(place, "have whole numbers for values", repr(text))
        label = clean_text(each.get("label", "")) or text
        if int(text) in found:
            raise must(place, "have one label for each value", f"{found[int(text)]} and {label}")
        found[int(text)] = f"{label} ({text})" if label in found.values() else label
    return {"labels": found}


def _read_bits(element: ElementTree.Element) -> dict:
    """What `xtce` notes in ancillary data: names of bits, and what the lowest number means."""
    noted = _noted(element)
    found: dict = {"unknown": "lowest"} if UNKNOWN in noted else {}
    bits = [noted[f"bit {place}"] for place in range(64) if f"bit {place}" in noted]
    return found | ({"bits": tuple(bits)} if bits else {})


def _noted(element: ElementTree.Element) -> dict[str, str]:
    """The ancillary data of a type."""
    listed = children(element, "AncillaryDataSet", "AncillaryData")
    return {each.get("name", ""): each.text or "" for each in listed}


def _read_limits(place: str, element: ElementTree.Element, known: dict, notes: list[str]) -> dict:
    """Ranges of warnings and alarms, labels that are alarms; what else there is, is left out."""
    ranges = {} if known["type"] == "bytes" or "labels" in known else _read_ranges(place, element)
    critical = ranges.pop("critical", None)
    noted = _noted(element).get(ALARM)
    if noted is not None:
        return ranges | {"alarm": _read_alarm(place, noted)}
    others = list(_other_alarms(element))
    alarm = {"values": _read_values(element)} if "labels" in known else {}
    if critical and (limits := ranges.get("limits", critical)):
        if critical[0] <= limits[0] <= limits[1] <= critical[1]:
            alarm["critical"] = critical
        else:
            others.append(element)
    if others:
        notes.append(f"{place}: alarms other than of labels, and of a WarningRange and a "
                     "CriticalRange with both ends, are left out")  # fmt: skip
    if not any(alarm.values()):
        return ranges
    return ranges | {"alarm": alarm | _read_samples(place, element)}


def _read_ranges(place: str, element: ElementTree.Element) -> dict:
    found = {}
    for tag, key in _RANGES.items():
        for each in children(element, "DefaultAlarm", "StaticAlarmRanges", tag):
            ends = each.get("minInclusive"), each.get("maxInclusive")
            if None not in ends and each.get("rangeForm", "outside") == "outside":
                found[key] = tuple(read_number(place, str(end)) for end in ends)
    return found


def _read_values(element: ElementTree.Element) -> dict[str, str]:
    """Labels that are alarms, with their severities."""
    listed = children(element, "DefaultAlarm", "EnumerationAlarmList", "EnumerationAlarm")
    names = {clean_text(each.get("enumerationLabel", "")): each for each in listed}
    levels = {name: _SEVERITIES.get(each.get("alarmLevel", "")) for name, each in names.items()}
    return {name: severity for name, severity in levels.items() if severity}


def _read_samples(place: str, element: ElementTree.Element) -> dict:
    texts = [each.get("minViolations", "1") for each in children(element, "DefaultAlarm")]
    samples = [int(text) for text in texts if text.isdecimal() and len(text) < 5]
    if len(samples) < len(texts):
        raise must(place, "have whole numbers for minViolations", texts)
    return {"samples": samples[0]} if samples and samples[0] > 1 else {}


def _read_alarm(place: str, text: str) -> dict:
    try:
        return AlarmKeys.model_validate_json(text).model_dump(exclude_defaults=True)
    except ValidationError:
        raise must(place, f"have its own keys in the ancillary data {ALARM}", text[:80]) from None


def _other_alarms(element: ElementTree.Element) -> Iterator[ElementTree.Element]:
    """Alarms that are left out."""
    yield from children(element, "ContextAlarmList")
    for alarm in children(element, "DefaultAlarm"):
        for each in alarm:
            if tag_of(each) == "StaticAlarmRanges":
                yield from (x for x in each if not _is_read(x))
            elif tag_of(each) != "EnumerationAlarmList":
                yield each


def _is_read(element: ElementTree.Element) -> bool:
    has_ends = None not in (element.get("minInclusive"), element.get("maxInclusive"))
    return tag_of(element) in _RANGES and has_ends and element.get("rangeForm") != "inside"
