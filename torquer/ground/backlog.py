"""What waits on board for a pass, and how much of it the pass brings down.

A satellite sends some packets all the time (`live_s`) and keeps others until it is asked for them
(`stored_s`), each with its period. In a pass the first ones take their part of the bits; what is
left brings down the others, the most wanted first.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, NamedTuple

from pydantic import Field

from torquer.base.explain import ScenarioError
from torquer.base.spec import Spec
from torquer.flight.packets.dictionary import Dictionary, Name
from torquer.flight.packets.frames import HEADER_BYTES, Downlink
from torquer.flight.packets.protected import encapsulated_bytes, telemetry_bytes
from torquer.flight.packets.pus import ApplicationProcess
from torquer.flight.packets.software_file import SpaceLink
from torquer.flight.packets.space_packets import PRIMARY_BYTES

#: Settings of module `tm` with the periods of its packets.
_SETTINGS = {"beacon": "beacon_s", "extended": "extended_s", "stored": "store_s"}
_Period = Annotated[float, Field(gt=0.0, le=1e7)]


class DownlinkTable(Spec):
    """What a satellite sends by itself, and what it keeps for a pass."""

    bit_s: float | None = Field(default=None, gt=0.0, le=1e12)
    """Bits a second of its downlink, coding taken off."""
    live_s: dict[Name, _Period] = Field(default_factory=dict)
    """Packets that it sends all the time, each with its period."""
    stored_s: dict[Name, _Period] = Field(default_factory=dict)
    """Packets that it keeps until it is asked for them, each with its period; the most wanted
    first.
    """

    def with_settings(self, settings: Mapping[str, Any], dictionary: Dictionary) -> DownlinkTable:
        """The same with periods of the settings of module `tm`, where it states none itself."""
        if self.live_s or self.stored_s:
            return self
        known = {
            packet: float(settings[key])
            for packet, key in _SETTINGS.items()
            if packet in dictionary.down
            and isinstance(settings.get(key), int | float)
            and settings[key] > 0.0
        }
        stored_s = {name: known.pop(name) for name in ("stored",) if name in known}
        return self.model_copy(update={"live_s": known, "stored_s": stored_s})

    def check(self, key: str, dictionary: Dictionary) -> None:
        """`ScenarioError` with one line for a packet that there is not; `key`: of the table."""
        for name in ("live_s", "stored_s"):
            for packet in getattr(self, name):
                if packet not in dictionary.down:
                    raise ScenarioError(
                        f"{key}.{name}: must name packets of its telemetry; received {packet!r}"
                    )


class Waiting(NamedTuple):
    """Packets of a kind that a pass finds on board, and how many of them it brings down.

    `bytes`: of all of them on the link, frames included.
    """

    packet: str
    period_s: float
    packets: int
    bytes: int
    fit: int


class Downlinked(NamedTuple):
    """What a pass can bring down: `bytes` in all, `live_bytes` of what is sent by itself."""

    bytes: int
    live: list[Waiting]
    stored: list[Waiting]

    @property
    def live_bytes(self) -> int:
        """Bytes that the packets take which the satellite sends by itself."""
        return sum(each.bytes for each in self.live)

    @property
    def left_packets(self) -> int:
        """Stored packets that stay on board."""
        return sum(each.packets - each.fit for each in self.stored)


def downlinked(
    link: SpaceLink,
    table: DownlinkTable,
    bit_s: float,
    pass_s: float,
    since_s: float,
    carried: Mapping[str, float] | None = None,
) -> Downlinked:
    """What a pass of `pass_s` brings down that begins `since_s` after the end of the last one.

    `carried`: packets that the last one left on board, by kind. A pass that is too short for what
    is sent by itself brings down nothing else.
    """
    room = int(bit_s * pass_s / 8.0)
    live = [
        Waiting(name, period_s, n, air_bytes(link, name, n), n)
        for name, period_s in table.live_s.items()
        for n in [int(pass_s / period_s)]
    ]
    left = max(room - sum(each.bytes for each in live), 0)
    stored = []
    for name, period_s in table.stored_s.items():
        count = int((carried or {}).get(name, 0.0) + (since_s + pass_s) / period_s)
        fit = most_packets(link, name, count, left)
        left -= air_bytes(link, name, fit)
        stored.append(Waiting(name, period_s, count, air_bytes(link, name, count), fit))
    return Downlinked(room, live, stored)


def most_packets(link: SpaceLink, name: str, count: int, room_bytes: int) -> int:
    """How many of `count` packets fit into a number of bytes on the link."""
    low, high = 0, count
    while low < high:
        middle = (low + high + 1) // 2
        is_fitting = air_bytes(link, name, middle) <= room_bytes
        low, high = (middle, high) if is_fitting else (low, middle - 1)
    return low


def air_bytes(link: SpaceLink, name: str, count: int) -> int:
    """Bytes on the link of a number of packets that fill its frames one after the other."""
    if link.link in ("historical", "space_packets"):
        return count * packet_bytes(link, name)
    return telemetry_bytes(count * packet_bytes(link, name))


def packet_bytes(link: SpaceLink, name: str) -> int:
    """Bytes of one packet with its headers, without the protected frames around it."""
    packet = link.dictionary.down[name]
    framed = HEADER_BYTES + packet.size
    if link.link == "space_packets":
        return PRIMARY_BYTES + packet.size
    if link.link == "historical":
        return framed
    if link.link == "protected":
        return encapsulated_bytes(framed)
    values = [b"\0" * f.count if f.type == "bytes" else 0 for _, f, _ in packet.numbers()]
    frame = Downlink(link.dictionary).frame(name, 0.0, values)
    process = ApplicationProcess(link.dictionary, link.keys.spacecraft, {}, {})
    return sum(map(len, process.reports([frame], 0)))
