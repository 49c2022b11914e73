"""MOD, models: orbital elements and choice of models, checked and kept for the ground's next pass.

The compiled computer has its own model of the orbit, which these do not change: what is stored is
there to be read back, and for modules of the user.
"""

from __future__ import annotations

from pydantic import Field, ValidationError

from torquer.base.spec import Spec
from torquer.environment.orbit.sgp4 import Sgp4, checksum
from torquer.flight.packets.reasons import Reason
from torquer.flight.software.modules.module import Module

#: File of the non-volatile memory that holds the elements: two lines of 69 characters.
ELEMENTS = "elements"


class ModSettings(Spec):
    """Settings of the models."""

    flags: int = Field(default=3, ge=0, le=3)
    """Models in use: bit 0: SGP4 (0: Kepler), bit 1: full field model (0: dipole)."""


class Mod(Module):
    """Keeps orbital elements; those that cannot describe an orbit are rejected."""

    name = "mod"
    Settings = ModSettings
    period_s = 10.0

    def __init__(self, settings: ModSettings):
        super().__init__(settings)
        self.elements: tuple[str, str] | None = None

    def start(self, core) -> None:
        """Take up the stored elements."""
        if ELEMENTS in core.memory.names():
            stored = core.memory.read(ELEMENTS) or b""
            code, self.elements = checked_elements(*stored.splitlines()[:2])
            if self.elements is None:
                core.report("mod", code)

    def on_set_elements(self, core, values) -> Reason:
        """Two-line elements, checked in full; CHECKSUM where a line's own sum is wrong."""
        code, elements = checked_elements(*values)
        if elements is None:
            return code
        self.elements = elements
        stored = core.memory.write(ELEMENTS, "\n".join(elements).encode())
        return Reason.DONE if stored else Reason.FAILED

    def on_set_model(self, core, values) -> Reason:
        """Choose the models: the computer has one set of them, so that no other is available."""
        (flags,) = values
        if flags > 3:
            return Reason.VALUE
        return Reason.DONE if flags == self.settings.flags else Reason.NOT_AVAILABLE

    def status(self) -> dict[str, float]:
        """Whether there are elements, choice of models."""
        return {"elements": float(self.elements is not None), "flags": self.settings.flags}


def checked_elements(*lines: bytes) -> tuple[Reason, tuple[str, str] | None]:
    """The two lines as text, if they describe an orbit; else what is wrong with them."""
    try:
        first, second = (line.decode("ascii") for line in lines)
        found = Sgp4(tle=(first, second)).tle
    except ValidationError:
        sums = all(line[-1:].isdigit() and int(line[-1]) == checksum(line)
                   for line in (first, second))  # fmt: skip
        return Reason.VALUE if sums else Reason.CHECKSUM, None
    except ValueError:  # not two lines of ASCII
        return Reason.VALUE, None
    return Reason.DONE, found
