"""The Python files of a board's scenario, as its page edits them.

Only files that the command line's scenario names are read or written: they are those that the board
executes anyway. One that was edited elsewhere since the page read it is not replaced.
"""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Container
from pathlib import Path

from torquer.base.replaced_files import replacing
from torquer.base.text_files import MOST_BYTES, limited_text
from torquer.pages.board.text import files_in


class OwnFiles:
    """The files by their names, relative to `folder` where they are in it."""

    def __init__(self, data: dict, folder: Path, code: Container[Path]):
        root = folder.resolve()
        named = dict.fromkeys(file for _, file in files_in(data, folder) if file in code)
        self._files = {
            str(file.relative_to(root) if file.is_relative_to(root) else file): file
            for file in named
            if file.suffix == ".py"
        }

    def read(self) -> list[dict[str, str]]:
        """Name, text and mark of each; ValueError for one that cannot be read."""
        return [{"name": name, **_read(name, file)} for name, file in self._files.items()]

    def write(self, name: str, text: str, mark: str) -> dict[str, str]:
        """Replace the file that had this mark when it was read; its text and its new mark.

        ValueError for a name that is none of the files, for a file that has another mark by now,
        and for one that cannot be written.
        """
        file = self._files.get(name)
        if file is None:
            these = ", ".join(self._files) or "none"
            raise ValueError(f"name: must be a file of the scenario ({these}); received {name!r}")
        if _read(name, file)["mark"] != mark:
            raise ValueError(
                f"{name}: must be as the page has read it, but was edited elsewhere; read it again"
            )
        ending = "\r\n" if b"\r\n" in file.read_bytes() else "\n"
        content = text.replace("\r\n", "\n").replace("\n", ending).encode()
        if len(content) > MOST_BYTES:
            raise ValueError(f"{name}: must have at most {MOST_BYTES} bytes; received more")
        try:
            with replacing(file) as unfinished:
                unfinished.write_bytes(content)
                shutil.copymode(file, unfinished)
        except OSError as error:
            raise ValueError(
                f"{name}: must be a file that can be written; received {error.strerror or error}"
            ) from None
        return _read(name, file)


def _read(name: str, file: Path) -> dict[str, str]:
    try:
        text = limited_text(file)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise ValueError(f"{name}: must be a file that can be read; received {reason}") from None
    return {"text": text, "mark": hashlib.sha256(text.encode()).hexdigest()}
