"""Fields of bits in words: the names of those that are set, the sensors of a satellite."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from torquer.flight.packets.dictionary import TABLES, Dictionary, Field, Packet

if TYPE_CHECKING:
    from torquer.scenario.spec import Scenario

#: A number of which no bit is set.
NONE = "none"


def in_words(field: Field, value: int) -> str:
    """Names of the bits that are set, "none" if none is; one without a name goes by its number."""
    places = range(value.bit_length())
    return ", ".join(_name(field, k) for k in places if value >> k & 1) or NONE


def from_words(field: Field, text: str) -> int:
    """The number of a text as `in_words` makes it; ValueError for a name that no bit has."""
    names = {each.strip() for each in text.split(",")}
    known = {_name(field, place): 1 << place for place in range(field.kind.bits)}
    if names == {NONE}:
        return known.get(NONE, 0)
    if not known.keys() >= names:
        raise ValueError(f"must be {NONE}, or of {', '.join(field.bits)}, with commas between them")
    return sum(known[name] for name in names)


def values_in_words(packet: Packet, values: tuple) -> Iterator[str]:
    """The values of a packet by their names, bits in words with the number beside; a number that
    was not known on board is 'unknown'."""
    for (name, field, _), value in zip(packet.numbers(), values, strict=True):
        words = f"{in_words(field, value)} ({value})" if field.bits else repr(value)
        yield f"{name} {'unknown' if value == field.unknown_value else words}"


def dictionary_for(scenario: Scenario, dictionary: Dictionary) -> Dictionary:
    """A dictionary whose bits for sensors name each of several that a satellite has of a kind.

    These follow the kinds of devices, in the order of the scenario, as far as there are bits.
    """
    units = tuple(each.name for each in scenario.spacecraft.units())
    named = {
        key: {name: _named(packet, units) for name, packet in getattr(dictionary, key).items()}
        for key in ("down", "up")
    }
    kept = {key: getattr(dictionary, key) for key in Dictionary.model_fields}
    return Dictionary.model_validate(kept | named) if units else dictionary


def _named(packet: Packet, units: tuple[str, ...]) -> Packet:
    """The packet with names for the bits of units; the same where it has none."""
    sensors = TABLES["sensors"]
    if not any(field.bits == sensors for field in packet.fields):
        return packet
    fields = [
        field.model_copy(update={"bits": (*sensors, *units)[: field.kind.bits]})
        if field.bits == sensors
        else field
        for field in packet.fields
    ]
    return packet.model_copy(update={"fields": fields})


def _name(field: Field, place: int) -> str:
    return field.bits[place] if place < len(field.bits) else str(place)
