"""The file that says where a ground serves, for the command line; a full disk may delay it."""

from __future__ import annotations

import json
import os
from contextlib import suppress
from pathlib import Path


class Announcement:
    """The file at `path`, for its owner only, which has the address with its token."""

    def __init__(self, path: Path, address: str):
        self._path, self._part = path, path.with_name(f"{path.name}.part")
        self._text = json.dumps({"address": address, "process": os.getpid()})
        self._path.unlink(missing_ok=True)
        self._is_there = False

    def write(self) -> str:
        """Write the file if it is not there; why it cannot be written, "" if it is there."""
        if self._is_there:
            return ""
        try:
            self._part.unlink(missing_ok=True)
            descriptor = os.open(self._part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
            with open(descriptor, "w", encoding="utf-8") as file:
                file.write(self._text)
            os.replace(self._part, self._path)
        except OSError as error:
            return error.strerror or str(error)
        self._is_there = True
        return ""

    def remove(self) -> None:
        """Remove the file."""
        with suppress(OSError):
            self._part.unlink(missing_ok=True)
            self._path.unlink(missing_ok=True)
