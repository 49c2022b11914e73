"""The ground's end of a link: bytes for commands, frames from the bytes that come down."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple, Protocol

from torquer.packets.dictionary import Dictionary
from torquer.packets.frames import Frame, Stream
from torquer.packets.protected import CommandSender, TelemetryReceiver


class KeysOfLink(Protocol):
    """Keys of a protected link, their index and the number of the spacecraft."""

    @property
    def up(self) -> bytes: ...
    @property
    def down(self) -> bytes: ...
    @property
    def spi(self) -> int: ...
    @property
    def spacecraft(self) -> int: ...


class Protection(NamedTuple):
    """Sender of commands and receiver of telemetry."""

    commands: CommandSender
    telemetry: TelemetryReceiver


class Station:
    """A ground station; historical frames where `keys` is None, else protected ones.

    `stream`: counts what was lost or rejected of the frames; `protection`: of what is around them.
    """

    def __init__(self, dictionary: Dictionary, keys: KeysOfLink | None):
        self.stream = Stream(dictionary, "down")
        self.protection: Protection | None = None
        if keys is not None:
            self.protection = Protection(
                CommandSender(keys.up, keys.spi, keys.spacecraft),
                TelemetryReceiver({keys.spi: keys.down}, keys.spacecraft),
            )

    def command(self, frame: bytes) -> bytes:
        """Bytes to send for the frame of a command."""
        return frame if self.protection is None else self.protection.commands.wrap(frame)

    def receive(self, data: bytes) -> Iterator[Frame]:
        """The frames that are complete with these bytes."""
        parts = [data] if self.protection is None else self.protection.telemetry.feed(data)
        for part in parts:
            yield from self.stream.feed(part)

    def finish(self) -> Iterator[Frame]:
        """Frames still waiting at the end of a recording."""
        if self.protection is not None:
            for part in self.protection.telemetry.flush():
                yield from self.stream.feed(part)
        yield from self.stream.finish()
