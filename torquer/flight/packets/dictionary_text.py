"""The file of a dictionary: what `load_dictionary` reads."""

import json
from collections.abc import Iterator

from torquer.flight.packets.dictionary import ACKNOWLEDGE, COMMON, Dictionary, Field, Packet


def dictionary_toml(dictionary: Dictionary) -> str:
    """The dictionary as TOML, a line a field.

    Path("dictionary.toml").write_text(dictionary_toml(dictionary), encoding="utf-8")
    """
    lines = [f"name = {_value(dictionary.name)}", ""]
    for table in ("modules", "labels"):
        if entries := getattr(dictionary, table):
            lines += [f"[{table}]", *(f"{key} = {_value(v)}" for key, v in entries.items()), ""]
    for direction in ("down", "up"):
        for packet in getattr(dictionary, direction).values():
            lines += [f"[{direction}.{packet.name}]", *_packet(packet), ""]
    return "\n".join(lines)


def _packet(packet: Packet) -> Iterator[str]:
    yield f"id = {packet.id}"
    yield f"description = {_value(packet.description)}"
    for key in ("module", "time_ms"):
        if text := getattr(packet, key):
            yield f"{key} = {_value(text)}"
    fields = packet.fields
    if packet.module and fields[0] == ACKNOWLEDGE:
        fields = fields[1:]
    common = {key: value for key in COMMON if (value := _stated_by_all(fields, key))}
    yield from (f"{key} = {_value(value)}" for key, value in common.items())
    yield "fields = ["
    for field in fields:
        keys = field.model_dump(mode="json", exclude_defaults=True)
        left_out = {*common, *(("name", "description") if field.type == "pad" else ())}
        shown = (f"{key} = {_value(v)}" for key, v in keys.items() if key not in left_out)
        yield f"  {{ {', '.join(shown)} }},"
    yield "]"


def _stated_by_all(fields: tuple[Field, ...], key: str) -> str:
    """The value that all fields state which can state one, "" if they differ or leave it out."""
    _, letters = COMMON[key]
    values = {getattr(field, key) for field in fields if field.kind.letter in letters}
    (value,) = values if len(values) == 1 else ("",)
    return "" if value == Field.model_fields[key].default else value


def _value(value) -> str:
    """A value in TOML; texts of a dictionary need no escapes."""
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{_value(str(key))} = {_value(v)}' for key, v in value.items())} }}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_value, value))}]"
    return json.dumps(value, ensure_ascii=False) if isinstance(value, str | bool) else repr(value)
