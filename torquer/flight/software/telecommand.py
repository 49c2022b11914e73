"""A command of the ground on its way through the software."""

from typing import NamedTuple


class Telecommand(NamedTuple):
    """A command as modules get it; `acknowledge`: whether the ground asks for an answer.

    `received`: the frame or packet that it came in; none for one that could not be read.
    """

    packet: str
    id: int
    module: int
    time_s: int
    acknowledge: bool
    values: tuple
    received: bytes = b""
