"""Keys of a link, and their files: 32 random bytes, readable by their owner only."""

import os
import secrets
import stat
from pathlib import Path
from typing import NamedTuple

from torquer.flight.packets.security import KEY_BYTES

#: Keys where a software file names none. Everybody knows them: they are for simulations only.
DEMONSTRATION_UP, DEMONSTRATION_DOWN = bytes(range(32)), bytes(range(32, 64))


class Keys(NamedTuple):
    """Keys of a protected link, their index and the number of the spacecraft."""

    up: bytes = DEMONSTRATION_UP
    down: bytes = DEMONSTRATION_DOWN
    spi: int = 1
    spacecraft: int = 77

    @property
    def are_known(self) -> bool:
        """Whether everybody knows one of them."""
        return self.up == DEMONSTRATION_UP or self.down == DEMONSTRATION_DOWN


def new_key(path: Path | str) -> bytes:
    """Make a key and write it into a new file; FileExistsError if there is one."""
    key = secrets.token_bytes(KEY_BYTES)
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    with open(descriptor, "wb") as file:
        file.write(key)
    return key


def read_key(path: Path | str) -> bytes:
    """The key in a file; ValueError unless it has 32 bytes, for nobody but the owner to touch."""
    try:
        # not to wait for a pipe to be opened at its other end
        descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
    except OSError as error:
        raise ValueError(f"key: {path} must be a file; {error.strerror}") from None
    try:
        mode = os.fstat(descriptor).st_mode
        key = os.read(descriptor, KEY_BYTES + 1) if stat.S_ISREG(mode) else b""
    finally:
        os.close(descriptor)
    if not stat.S_ISREG(mode):
        raise ValueError(f"key: {path} must be a file; received something else")
    if os.name == "posix" and mode & 0o077:
        raise ValueError(
            f"key: {path} must be accessible to its owner only (chmod 600); "
            f"received mode {stat.S_IMODE(mode):03o}"
        )
    if len(key) != KEY_BYTES:
        received = "more" if len(key) > KEY_BYTES else len(key)
        raise ValueError(f"key: {path} must have {KEY_BYTES} bytes; received {received}")
    return key
