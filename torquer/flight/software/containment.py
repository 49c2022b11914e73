"""What the code of a module may do to the flight: nothing but lose its own work.

Whatever it raises is caught, `SystemExit` and `KeyboardInterrupt` too, and the text of an exception
is code of the module as well.
"""

from __future__ import annotations

import traceback
from pathlib import Path
from typing import Any

from torquer.flight.software.modules.module import Module


def brief(error: BaseException) -> str:
    """An error of a module's code: kind and first line, without a line that cannot be made."""
    kind = type(error).__name__
    try:
        return f"{kind}: {error}".splitlines()[0][:200]
    except BaseException:
        return kind


def where(error: BaseException) -> str:
    """File and line in which it was raised, as far as it says so."""
    try:
        place = traceback.extract_tb(error.__traceback__)[-1]
    except BaseException:
        return "in an unknown place"
    return f"{Path(place.filename).name}, line {place.lineno}"


class Unmade(Module):
    """In place of a module whose constructor failed: it does not start, and refuses commands."""

    def __init__(self, name: str, settings: Any, error: BaseException):
        super().__init__(settings)
        self.name = name  # type: ignore[misc]
        self.reason = brief(error)

    def start(self, core) -> None:
        """It cannot."""
        raise RuntimeError(f"not made: {self.reason}")
