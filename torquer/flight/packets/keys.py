"""Keys of a link, and their files: 32 random bytes, readable by their owner only.

Commands have two keys: one for all that is commanded, which may be changed, and a recovery key, by
which nothing is done but that. A new key does not travel: both ends derive it from the recovery key
and its number, as NIST SP 800-108 has it (counter mode, one block of HMAC-SHA-256).
"""

import hmac
import os
import secrets
import stat
import struct
from pathlib import Path
from typing import NamedTuple

from torquer.flight.packets.security import KEY_BYTES

#: Keys where a software file names none. Everybody knows them: they are for simulations only.
DEMONSTRATION_UP, DEMONSTRATION_DOWN, DEMONSTRATION_RECOVERY = (
    bytes(range(begin, begin + KEY_BYTES)) for begin in (0, 32, 64)
)
#: The command by which the key of commands is changed: the only one that the recovery key allows.
KEY_COMMAND = "change_key"
_LABEL = b"torquer key of commands"


class Keys(NamedTuple):
    """Keys of a protected link, their indices and the number of the spacecraft.

    `up`: of commands as delivered, `spi`: its index and that of the keys that follow it; `recovery`
    and `recovery_spi`: the one by which it is changed; `down`: of telemetry, index `spi`.
    """

    up: bytes = DEMONSTRATION_UP
    down: bytes = DEMONSTRATION_DOWN
    spi: int = 1
    spacecraft: int = 77
    recovery: bytes = DEMONSTRATION_RECOVERY
    recovery_spi: int = 2

    @property
    def are_known(self) -> bool:
        """Whether everybody knows one of them."""
        known = {DEMONSTRATION_UP, DEMONSTRATION_DOWN, DEMONSTRATION_RECOVERY}
        return bool(known & {self.up, self.down, self.recovery})

    def command_key(self, number: int) -> bytes:
        """The key of commands with a number; 0: the delivered one."""
        if number == 0:
            return self.up
        block = struct.pack(">I", 1) + _LABEL + b"\0" + struct.pack(">II", number, 8 * KEY_BYTES)
        return hmac.digest(self.recovery, block, "sha256")


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
