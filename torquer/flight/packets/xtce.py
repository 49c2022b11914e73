"""The dictionary as XTCE 1.2 (CCSDS 660.0-B): telemetry and commands in their historical frames.

Telemetry: an abstract container `downlink__frame` with the header; each packet inherits it by
`msg_id`, a space packet by `apid`. Parameters are called `packet__name`; scales, offsets and
polynomials are calibrators; padding has parameters of its own. Limits are warning and critical
ranges, labels that are alarms those of enumerations, limits by another number of telemetry alarms
of a context. XTCE cannot state alarms of bits, those by a region, and latched ones: all keys of an
alarm are ancillary data of the type, as are names of bits, and that the lowest number means "not
known".
Commands: a fixed header around the argument `frame__time_stamp`, then the fields; a scale is the
calibrator from raw number to value, as the schema defines it. A reader of XTCE thus decodes the
downlink and encodes commands without this package.
"""

import re
from collections.abc import Iterator
from typing import Any
from xml.etree import ElementTree

from torquer.flight.packets.alarm_limits import AlarmKeys, Ends
from torquer.flight.packets.dictionary import Dictionary, Field, Packet
from torquer.flight.packets.frames import HEADER_BYTES, HEADERS, Uplink
from torquer.flight.packets.framing import Framing, check_framing, framing_of

_NAMESPACE = "http://www.omg.org/spec/XTCE/20180204"
_ROOT = {
    "xmlns": _NAMESPACE,
    "xmlns:xsi": "http://www.w3.org/2001/XMLSchema-instance",
    "xsi:schemaLocation": f"{_NAMESPACE} https://www.omg.org/spec/XTCE/20180204/SpaceSystem.xsd",
}
_ORDER = {"little": {"byteOrder": "leastSignificantByteFirst"}, "big": {}}
#: Names of ancillary data: that the lowest number means "not known"; the field with the time; all
#: keys of an alarm, of which other readers find what XTCE can state.
UNKNOWN, TIME, ALARM = "unknown", "time_ms", "alarm"
_LEVELS = {"warning": "warning", "alarm": "critical"}
#: Bits of the widest parameter of padding; what such parameters are called after their packet.
_PAD_BITS, PAD = 64, "pad"
#: Container that every packet of our frames inherits, and argument of every command.
FRAME = framing_of("historical").container
TIME_STAMP = "frame__time_stamp"


def xtce(dictionary: Dictionary, link: str = "historical") -> str:
    """The XTCE document of a dictionary whose packets come by a kind of link (`software_file`).

    ValueError with one line for what XTCE cannot state: little-endian numbers not of whole bytes.
    """
    check_framing(dictionary, link)
    name = re.sub(r"[./:\[\] ]", "_", dictionary.name)
    root = ElementTree.Element("SpaceSystem", {"name": name, **_ROOT})
    _add_telemetry(root, dictionary, framing_of(link))
    if dictionary.up:
        _add_commands(root, dictionary)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _add(parent: ElementTree.Element, tag: str, text: str = "", /, **attributes: Any):
    """A new element at the end of its parent."""
    shown = {key: str(value) for key, value in attributes.items() if value != ""}
    element = ElementTree.SubElement(parent, tag, shown)
    element.text = text or None
    return element


def _add_telemetry(root: ElementTree.Element, dictionary: Dictionary, framing: Framing) -> None:
    telemetry = _add(root, "TelemetryMetaData")
    sets = [_add(telemetry, f"{each}Set") for each in ("ParameterType", "Parameter", "Container")]
    _add_container(sets, framing.container, framing.header, prefix="", abstract="true")
    for packet in dictionary.down.values():
        container = _add_container(sets, packet.name, packet, prefix=f"{packet.name}__")
        base = _add(container, "BaseContainer", containerRef=framing.container)
        criteria = _add(base, "RestrictionCriteria")
        of_header = {"parameterRef": framing.id_field, "useCalibratedValue": "false"}
        _add(criteria, "Comparison", value=packet.id, **of_header)


def _add_container(sets: list, name: str, packet: Packet, prefix: str, **attributes):
    """A container of all parameters of a packet, and these with their types."""
    types, parameters, containers = sets
    container = _add(
        containers,
        "SequenceContainer",
        name=name,
        shortDescription=packet.description,
        **attributes,
    )
    if packet.time_ms:
        _add(_add(container, "AncillaryDataSet"), "AncillaryData", packet.time_ms, name=TIME)
    entries = _add(container, "EntryList")
    for at, field in enumerate(_with_parts(packet)):
        _check_order(packet, field)
        own = field.name or f"{PAD}__{at}"
        type_name = _add_type(types, f"{prefix}{own}", field, "Parameter")
        for each in field.names or (own,):
            _add(
                parameters,
                "Parameter",
                name=f"{prefix}{each}",
                parameterTypeRef=type_name,
                shortDescription=field.description,
            )
            _add(entries, "ParameterRefEntry", parameterRef=f"{prefix}{each}")
    return container


def _with_parts(packet: Packet) -> Iterator[Field]:
    """The fields, padding in parts that a parameter can have."""
    for field in packet.fields:
        left = field.count if field.type == "pad" else 0
        while left > _PAD_BITS:
            yield field.model_copy(update={"count": _PAD_BITS})
            left -= _PAD_BITS
        yield field.model_copy(update={"count": left}) if left else field


def _check_order(packet: Packet, field: Field) -> None:
    """ValueError for a little-endian number that XTCE cannot state."""
    places = [place for place in packet.places if place.field == field]
    bits = [field.bit_size] if field.type == "pad" else [p.bit | p.bits for p in places]
    if field.byte_order == "little" and any(each % 8 for each in bits):
        raise ValueError(
            f"{packet.name}.{field.name or 'padding'}: must be big-endian for XTCE, or of whole "
            f"bytes at whole bytes; received {field.bit_size} little-endian bits"
        )


def _add_commands(root: ElementTree.Element, dictionary: Dictionary) -> None:
    commands = _add(root, "CommandMetaData")
    types, metas = _add(commands, "ArgumentTypeSet"), _add(commands, "MetaCommandSet")
    time_stamp = next(f for f in HEADERS["up"].fields if f.name == "time_stamp")
    time_type = _add_type(types, TIME_STAMP, time_stamp, "Argument")
    frames = Uplink(dictionary)
    for packet in dictionary.up.values():
        meta = _add(metas, "MetaCommand", name=packet.name, shortDescription=packet.description)
        arguments = _add(meta, "ArgumentList")
        container = _add(meta, "CommandContainer", name=packet.name)
        entries = _add(container, "EntryList")
        empty = [b"" if field.type == "bytes" else 0 for _, field, _ in packet.numbers()]
        _add_header(entries, frames.frame(packet.name, 0, empty)[:HEADER_BYTES])
        _add_argument(arguments, TIME_STAMP, time_type, time_stamp)
        for at, field in enumerate(packet.fields):
            _check_order(packet, field)
            if field.type == "pad":
                _add_fixed(entries, f"{PAD}__{at}", bytes(-(-field.count // 8)), field.count)
                continue
            type_name = _add_type(types, f"{packet.name}__{field.name}", field, "Argument")
            for each in field.names:
                _add_argument(arguments, each, type_name, field)
                _add(entries, "ArgumentRefEntry", argumentRef=each)


def _add_argument(arguments: ElementTree.Element, name: str, type_name: str, field: Field) -> None:
    described = {"shortDescription": field.description}
    _add(arguments, "Argument", name=name, argumentTypeRef=type_name, **described)


def _add_header(entries: ElementTree.Element, header: bytes) -> None:
    """The header of a command: all fixed but its execution time."""
    at = 0
    for field in HEADERS["up"].fields:
        value = header[at : at + field.size]
        at += field.size
        if field.name == "time_stamp":
            _add(entries, "ArgumentRefEntry", argumentRef=TIME_STAMP)
        else:
            _add_fixed(entries, field.name, value, 8 * field.size)


def _add_fixed(entries: ElementTree.Element, name: str, value: bytes, bits: int) -> None:
    keys = {"binaryValue": value.hex().upper(), "sizeInBits": bits}
    _add(entries, "FixedValueEntry", name=name, **keys)


def _add_type(types: ElementTree.Element, name: str, field: Field, role: str) -> str:
    """A type of parameters or arguments; its name."""
    group, attributes = _group(field)
    name = f"{name}_type"
    element = _add(types, f"{group}{role}Type", name=name, **attributes)
    ancillary = [(f"bit {place}", bit) for place, bit in enumerate(field.bits)]
    if field.unknown_value is not None:
        ancillary.append((UNKNOWN, "the lowest raw number"))
    if field.alarm:
        ancillary.append((ALARM, field.alarm.model_dump_json(exclude_defaults=True)))
    noted = _add(element, "AncillaryDataSet") if ancillary else element
    for key, text in ancillary:
        _add(noted, "AncillaryData", text, name=key)
    if field.unit:
        _add(_add(element, "UnitSet"), "Unit", field.unit)
    _add_encoding(element, field)
    labels = _add(element, "EnumerationList") if field.labels else element
    for number, label in field.texts.items():
        _add(labels, "Enumeration", value=number, label=label)
    if not (field.labels and role == "Argument"):
        _add_limits(element, field, role)
    return name


def _group(field: Field) -> tuple[str, dict[str, str]]:
    """What begins the name of a type's element, and its attributes."""
    if field.type == "bytes":
        return "Binary", {}
    if field.labels:
        return "Enumerated", {}
    if field.kind.letter == "f" or not field.is_raw:
        return "Float", {"sizeInBits": "64"}
    wide = {"sizeInBits": "64"} if field.kind.bits > 32 else {}
    return "Integer", {"signed": str(field.kind.letter == "i").lower(), **wide}


def _add_encoding(element: ElementTree.Element, field: Field) -> None:
    """How the raw number is packed, and how the value follows from it."""
    letter, order = field.kind.letter, _ORDER[field.byte_order]
    bits = field.bit_size if letter in "sx" else field.kind.bits
    if letter == "s":
        size = _add(_add(element, "BinaryDataEncoding"), "SizeInBits")
        _add(size, "FixedValue", str(bits))
    elif letter == "f":
        _add(element, "FloatDataEncoding", sizeInBits=bits, encoding="IEEE754", **order)
    else:
        encoding = "twosComplement" if letter == "i" else "unsigned"
        whole = _add(element, "IntegerDataEncoding", sizeInBits=bits, encoding=encoding, **order)
        if not field.is_raw:
            _add_polynomial(whole, field.coefficients)


def _add_polynomial(encoding: ElementTree.Element, coefficients: tuple[float, ...]) -> None:
    polynomial = _add(_add(encoding, "DefaultCalibrator"), "PolynomialCalibrator")
    for exponent, each in enumerate(coefficients):
        _add(polynomial, "Term", coefficient=repr(each) if each else "0", exponent=exponent)


def _add_limits(element: ElementTree.Element, field: Field, role: str) -> None:
    """Limits: alarms of telemetry, the valid range of a command."""
    if role == "Argument":
        if field.limits:
            _add(_add(element, "ValidRangeSet"), "ValidRange", **_ends(field, field.limits))
        return
    keys = field.alarm or AlarmKeys()
    _add_alarm(element, "DefaultAlarm", field, field.limits, keys)
    modes = [(each, each.place) for each in keys.by_mode]
    contexts = [(each, place, state) for each, place in modes if place for state in each.states]
    listed = _add(element, "ContextAlarmList") if contexts else element
    for each, place, state in contexts:
        alarm = _add_alarm(listed, "ContextAlarm", field, each.limits, each, keys.samples)
        match = {} if alarm is None else {"parameterRef": "__".join(place), "value": state}
        if alarm is not None:
            _add(_add(alarm, "ContextMatch"), "Comparison", **match)


def _add_alarm(parent, tag: str, field: Field, limits: Ends | None, keys, samples: int = 1):
    """An alarm of a type; None where there is nothing to state by default."""
    ranges = [("WarningRange", limits), ("CriticalRange", keys.critical)]
    stated = [(name, ends) for name, ends in ranges if ends and not field.labels]
    levels = {name: _LEVELS[severity] for name, severity in keys.values.items() if field.labels}
    if tag == "DefaultAlarm" and not (stated or levels):
        return None
    samples = getattr(keys, "samples", samples)
    alarm = _add(parent, tag, minViolations=samples if samples > 1 else "")
    if field.labels:
        listed = _add(alarm, "EnumerationAlarmList")
        for label, level in levels.items():
            _add(listed, "EnumerationAlarm", alarmLevel=level, enumerationLabel=label)
        return alarm
    static = _add(alarm, "StaticAlarmRanges")
    for name, ends in stated:
        _add(static, name, **_ends(field, ends))
    return alarm


def _ends(field: Field, ends: Ends) -> dict[str, float]:
    least, greatest = (
        int(x) if field.is_whole and field.is_raw and x == int(x) else x for x in ends
    )
    return {"minInclusive": least, "maxInclusive": greatest}
