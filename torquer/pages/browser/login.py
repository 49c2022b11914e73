"""How a browser is opened at a page without its token in the list of processes.

All users of a machine see with which arguments a program was started. So the browser is given a
file that only its owner can read. It leads to the page by a code that opens once, within a minute:
what the file, or the browser's history, still holds later is worth nothing.
"""

from __future__ import annotations

import os
import secrets
import time
from pathlib import Path
from urllib.parse import urlsplit

#: How long a code opens [s].
_VALID_S = 60.0
_PAGE = """<!doctype html>
<html lang="en">
  <head>
    <meta charset="utf-8" />
    <meta name="referrer" content="no-referrer" />
    <meta http-equiv="refresh" content="0; url={address}" />
    <title>torquer</title>
  </head>
  <body><p>The page of torquer opens.</p></body>
</html>
"""


class Login:
    """The code by which the browser that is opened gets the token; at first there is none."""

    def __init__(self) -> None:
        self._code, self._until_s = "", 0.0
        self._file: Path | None = None

    def write_file(self, folder: Path, address: str) -> Path:
        """A private file in a folder that leads to the page at an address; OSError if it cannot be.

        The code in it takes the place of one before.
        """
        self.close()
        port = urlsplit(address).port  # several pages may be opened from one folder
        path = (folder / f"open_in_browser_{port}.html").resolve()
        path.unlink(missing_ok=True)
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        self._file, self._code = path, secrets.token_urlsafe(32)
        self._until_s = time.monotonic() + _VALID_S
        with open(descriptor, "w", encoding="utf-8") as file:
            file.write(_PAGE.format(address=f"{address}?code={self._code}"))
        return path

    def redeem(self, code: bytes) -> bool:
        """Whether this is the code, in time; it is none from then on."""
        is_right = bool(self._code) and secrets.compare_digest(code, self._code.encode())
        if not is_right or time.monotonic() > self._until_s:
            return False
        self.close()
        return True

    def close(self) -> None:
        """Void the code, and remove the file."""
        self._code = ""
        if self._file is not None:
            self._file.unlink(missing_ok=True)
            self._file = None
