"""The dictionary as XTCE 1.2 (CCSDS 660.0-B): telemetry and commands in their historical frames.

Telemetry: an abstract container `downlink__frame` with the header; each packet inherits it by
`msg_id`. Parameters are called `packet__name`; their raw numbers are little-endian, scales are
calibrators, limits are warning ranges; names of bits are ancillary data of their type. Commands: a
fixed header around the argument `frame__time_stamp`, then the fields; a scale is the calibrator
from raw number to value, as the schema defines it. A reader of XTCE thus decodes the downlink and
encodes commands without this package.
"""

import re
from typing import Any
from xml.etree import ElementTree

from torquer.flight.packets.dictionary import TYPES, Dictionary, Field, Packet
from torquer.flight.packets.frames import HEADER_BYTES, HEADERS, Uplink

_NAMESPACE = "http://www.omg.org/spec/XTCE/20180204"
_ROOT = {
    "xmlns": _NAMESPACE,
    "xmlns:xsi": "http://www.w3.org/2001/XMLSchema-instance",
    "xsi:schemaLocation": f"{_NAMESPACE} https://www.omg.org/spec/XTCE/20180204/SpaceSystem.xsd",
}
_ORDER = {"byteOrder": "leastSignificantByteFirst"}
#: Container that every packet of telemetry inherits, and argument of every command: no packet and
#: no field has a name with two '_'.
FRAME = "downlink__frame"
TIME_STAMP = "frame__time_stamp"


def xtce(dictionary: Dictionary) -> str:
    """The XTCE document of a dictionary."""
    name = re.sub(r"[./:\[\] ]", "_", dictionary.name)
    root = ElementTree.Element("SpaceSystem", {"name": name, **_ROOT})
    _add_telemetry(root, dictionary)
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


def _add_telemetry(root: ElementTree.Element, dictionary: Dictionary) -> None:
    telemetry = _add(root, "TelemetryMetaData")
    sets = [_add(telemetry, f"{each}Set") for each in ("ParameterType", "Parameter", "Container")]
    _add_container(sets, FRAME, HEADERS["down"], prefix="", abstract="true")
    for packet in dictionary.down.values():
        container = _add_container(sets, packet.name, packet, prefix=f"{packet.name}__")
        base = _add(container, "BaseContainer", containerRef=FRAME)
        criteria = _add(base, "RestrictionCriteria")
        of_header = {"parameterRef": "msg_id", "useCalibratedValue": "false"}
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
    entries = _add(container, "EntryList")
    for field in packet.fields:
        type_name = _add_type(types, f"{prefix}{field.name}", field, "Parameter")
        for each in field.names:
            _add(
                parameters,
                "Parameter",
                name=f"{prefix}{each}",
                parameterTypeRef=type_name,
                shortDescription=field.description,
            )
            _add(entries, "ParameterRefEntry", parameterRef=f"{prefix}{each}")
    return container


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
        for field in packet.fields:
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
        value = header[at : at + field.size].hex().upper()
        at += field.size
        if field.name == "time_stamp":
            _add(entries, "ArgumentRefEntry", argumentRef=TIME_STAMP)
        else:
            bits = {"binaryValue": value, "sizeInBits": 8 * field.size}
            _add(entries, "FixedValueEntry", name=field.name, **bits)


def _add_type(types: ElementTree.Element, name: str, field: Field, role: str) -> str:
    """A type of parameters or arguments; its name."""
    kind, bits = TYPES[field.type], 8 * TYPES[field.type].size
    group, attributes = "Integer", {"signed": str(field.type[0] == "i").lower()}
    if field.type == "bytes":
        group, attributes = "Binary", {}
    elif field.labels:
        group, attributes = "Enumerated", {}
    elif not kind.is_whole or field.scale != 1.0:
        group, attributes = "Float", {"sizeInBits": "64"}
    name = f"{name}_type"
    element = _add(types, f"{group}{role}Type", name=name, **attributes)
    if field.bits:
        bits_of = _add(element, "AncillaryDataSet")
        for place, bit in enumerate(field.bits):
            _add(bits_of, "AncillaryData", bit, name=f"bit {place}")
    if field.unit:
        _add(_add(element, "UnitSet"), "Unit", field.unit)
    if field.type == "bytes":
        size = _add(_add(element, "BinaryDataEncoding"), "SizeInBits")
        _add(size, "FixedValue", str(bits * field.count))
    elif not kind.is_whole:
        _add(element, "FloatDataEncoding", sizeInBits=bits, encoding="IEEE754", **_ORDER)
    else:
        encoding = "twosComplement" if field.type[0] == "i" else "unsigned"
        whole = _add(element, "IntegerDataEncoding", sizeInBits=bits, encoding=encoding, **_ORDER)
        _add_scale(whole, field.scale)
    labels = _add(element, "EnumerationList") if field.labels else element
    for number, label in enumerate(field.labels):
        _add(labels, "Enumeration", value=number, label=label)
    if not field.labels:
        _add_limits(element, field, role)
    return name


def _add_scale(encoding: ElementTree.Element, scale: float) -> None:
    if scale != 1.0:
        polynomial = _add(_add(encoding, "DefaultCalibrator"), "PolynomialCalibrator")
        _add(polynomial, "Term", coefficient="0", exponent="0")
        _add(polynomial, "Term", coefficient=repr(scale), exponent="1")


def _add_limits(element: ElementTree.Element, field: Field, role: str) -> None:
    """Limits: a warning range of telemetry, the valid range of a command."""
    if field.limits is None:
        return
    whole = TYPES[field.type].is_whole and field.scale == 1.0
    least, greatest = (int(x) if whole and x == int(x) else x for x in field.limits)
    ends = {"minInclusive": least, "maxInclusive": greatest}
    if role == "Argument":
        _add(_add(element, "ValidRangeSet"), "ValidRange", **ends)
    else:
        alarm = _add(_add(element, "DefaultAlarm"), "StaticAlarmRanges")
        _add(alarm, "WarningRange", **ends)
