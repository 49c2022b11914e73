"""The ground's end of a link: bytes for commands, frames from the bytes that come down."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from torquer.flight.packets.codec import decoder
from torquer.flight.packets.frames import HEADER, HEADER_BYTES, Frame, Stream
from torquer.flight.packets.keys import KEY_COMMAND
from torquer.flight.packets.protected import CommandSender, TelemetryReceiver
from torquer.flight.packets.pus_user import User
from torquer.flight.packets.software_file import SpaceLink
from torquer.flight.packets.space_stream import SpaceStream

#: Counts by which a frame may come late: two seconds of a fast link, far less than a lost pass.
_LATE = 64


class Protection(NamedTuple):
    """Senders of commands and of changes of their key, receiver of telemetry."""

    commands: CommandSender
    recovery: CommandSender
    telemetry: TelemetryReceiver


class Station:
    """A ground station for a satellite with this link; with PUS frames are the same.

    `stream`: counts what was lost or rejected of the frames; `protection`: of what is around them.

        station = Station(load_link())
        frames = list(station.receive(data))
    """

    def __init__(self, link: SpaceLink):
        keys, self.stream = link.keys, _new_stream(link)
        self._keys, self._change = keys, link.dictionary.up.get(KEY_COMMAND)
        self.protection: Protection | None = None
        if link.link in ("protected", "pus"):
            self.protection = Protection(
                CommandSender(keys.up, keys.spi, keys.spacecraft),
                CommandSender(keys.recovery, keys.recovery_spi, keys.spacecraft),
                TelemetryReceiver({keys.spi: keys.down}, keys.spacecraft, late=_LATE),
            )

    def command(self, frame: bytes) -> bytes:
        """Bytes to send for the frame of a command; the recovery key protects a change of key."""
        data = self.stream.request(frame) if isinstance(self.stream, User) else frame
        return self._protect(data, is_change=self.changes_key(frame))

    def changes_key(self, frame: bytes) -> bool:
        """Whether a command's frame changes the key of commands."""
        return self._change is not None and HEADER.unpack_from(frame)[2] == self._change.id

    def key_in(self, frame: bytes) -> int:
        """The number of the key in a frame that changes it."""
        assert self._change is not None
        return decoder(self._change)(frame, HEADER_BYTES)[-1]

    def use_key(self, number: int, counter: int = 0) -> None:
        """Wrap commands by the key with this number, its last counter being known."""
        if self.protection is not None:
            self.protection.commands.key = self._keys.command_key(number)
            self.protection.commands.counter = counter

    def ping(self) -> bytes:
        """Bytes of a connection test, of PUS only; `pings_answered` counts the answers."""
        if not isinstance(self.stream, User):
            raise ValueError("ping: must be of a link with PUS; received another link")
        return self._protect(self.stream.ping())

    @property
    def pings_answered(self) -> int:
        """Number of answers to connection tests."""
        return self.stream.pings_answered if isinstance(self.stream, User) else 0

    def _protect(self, data: bytes, is_change: bool = False) -> bytes:
        if self.protection is None:
            return data
        return (self.protection.recovery if is_change else self.protection.commands).wrap(data)

    def receive(self, data: bytes) -> Iterator[Frame]:
        """The frames that are complete with these bytes."""
        parts = [data] if self.protection is None else self.protection.telemetry.feed(data)
        for part in parts:
            yield from self.stream.feed(part)

    def counts(self) -> dict[str, int]:
        """What was lost or rejected on the way down, by name."""
        around = self.protection.telemetry if self.protection else None
        return {
            "lost_bytes": self.stream.lost_bytes + (around.lost_bytes if around else 0),
            "lost_frames": around.lost_frames if around else 0,
            "lost_packets": around.lost_packets if around else 0,
            "rejected": sum(self.stream.rejected.values())
            + (around.rejected.total() if around else 0),
        }

    def finish(self) -> Iterator[Frame]:
        """Frames still waiting at the end of a recording."""
        if self.protection is not None:
            for part in self.protection.telemetry.flush():
                yield from self.stream.feed(part)
        yield from self.stream.finish()


def _new_stream(link: SpaceLink) -> Stream | User | SpaceStream:
    if link.link == "space_packets":
        return SpaceStream(link.dictionary)
    if link.link == "pus":
        return User(link.dictionary, apid=link.keys.spacecraft)
    return Stream(link.dictionary, "down")
