"""The link: what COM does with bytes of the uplink and with frames of the downlink."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from torquer.packets.dictionary import Dictionary
from torquer.packets.frames import Frame, Rejected, Stream

if TYPE_CHECKING:
    from torquer.onboard.services import Services


class Historical:
    """Frames as Chibis-M had them, without checksum and authentication. Plain state."""

    def __init__(self, dictionary: Dictionary):
        self._stream = Stream(dictionary, "up")

    @property
    def lost_bytes(self) -> int:
        """Bytes received that belong to no frame."""
        return self._stream.lost_bytes

    def receive(self, data: bytes) -> Iterator[Frame]:
        """Commands that are complete with these bytes."""
        return self._stream.feed(data)

    def take_rejected(self) -> list[Rejected]:
        """Headers that were rejected since the last call."""
        return self._stream.take_rejected()

    def save(self, core: Services) -> None:
        """Keep what must outlive a reboot: nothing."""

    def wrapped(self, frames: list[bytes]) -> list[bytes]:
        """What is transmitted for these frames."""
        return frames


def new_link(kind: str, dictionary: Dictionary) -> Historical:
    """The link of a software file."""
    return Historical(dictionary)
