"""The dictionary for Open MCT: a tree of packets, a telemetry point per number.

The key of a point is `packet.name`; its values have a `utc` time in milliseconds since 1970. Of a
number of bits, `bits` has their names, the lowest first; Open MCT itself shows the number.
"""

from torquer.flight.packets.dictionary import Dictionary, Field, Packet


def openmct(dictionary: Dictionary) -> dict:
    """Data of which Open MCT's objects and metadata are made; they can be written as JSON."""
    packets = [_packet(packet) for packet in dictionary.down.values()]
    return {"name": dictionary.name, "key": "satellite", "packets": packets}


def _packet(packet: Packet) -> dict:
    measurements = [_measurement(packet, name, field) for name, field, _ in packet.numbers()]
    return {
        "key": packet.name,
        "name": packet.name,
        "description": packet.description,
        "measurements": measurements,
    }


def _measurement(packet: Packet, name: str, field: Field) -> dict:
    """A point: its value, its time, and the limits beyond which it is shown as a warning."""
    value: dict = {"key": "value", "name": name, "format": _format(field), "hints": {"range": 1}}
    if field.unit:
        value["unit"] = field.unit
    if field.labels:
        value["enumerations"] = [{"value": i, "string": text} for i, text in field.texts.items()]
    if field.bits:
        value["bits"] = list(field.bits)
    time = {"key": "utc", "source": "utc", "name": "Time", "format": "utc", "hints": {"domain": 1}}
    critical = field.alarm and field.alarm.critical
    limits = {
        level: dict(zip(("low", "high"), ends, strict=True))
        for level, ends in (("WARNING", field.limits), ("CRITICAL", critical))
        if ends
    }
    return {
        "key": f"{packet.name}.{name}",
        "name": name,
        "description": field.description,
        "values": [value, time],
        **({"limits": limits} if limits else {}),
    }


def _format(field: Field) -> str:
    """Format of a value in Open MCT."""
    if field.labels:
        return "enum"
    if field.type == "bytes":
        return "string"
    return "integer" if field.is_whole else "float"
