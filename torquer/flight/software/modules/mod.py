"""MOD, models: which orbit, which field and which Sun the compiled computer has for its ephemeris.

Two-line elements that the ground sends are checked, in themselves and against the orbit that the
computer believes in; then they are its orbit, from the next control step on. Elements and choice
are kept in the non-volatile memory and taken up at each boot.
"""

from __future__ import annotations

import math

from pydantic import Field

from torquer.base.explain import ScenarioError
from torquer.base.spec import Spec, Vector
from torquer.environment.chosen_models import Choice, NoSuchModel
from torquer.environment.orbit.sgp4 import Sgp4, checksum
from torquer.flight.packets.reasons import Reason
from torquer.flight.software.modules.module import Supplier

#: File of the non-volatile memory that holds the elements: two lines of 69 characters.
ELEMENTS = "elements"
#: Bits of the flags, and where the field's degree begins; flags as launched.
_SGP4, _WHOLE_FIELD, _SUN_STAYS, _DEGREE = 1, 2, 4, 4
_LAUNCHED = _SGP4 | _WHOLE_FIELD


class ModSettings(Spec):
    """Settings of the models."""

    flags: int = Field(default=_LAUNCHED, ge=0, le=0xFF)
    """Models in use: bit 0: SGP4 (0: Kepler), 1: the whole field (0: a dipole), 2: the Sun stays
    where it is (0: moves), 4 to 7: degree of the field (0: the model's own).
    """
    sun_inertial: Vector | None = None
    """Direction in which the Sun stays."""
    largest_km: float = Field(default=1000.0, gt=0.0)
    """Distance from the place where the computer is now beyond which elements are refused."""
    largest_plane_deg: float = Field(default=5.0, gt=0.0)
    """Angle to the plane of its orbit beyond which they are refused."""


class Mod(Supplier):
    """Gives the computer its orbit and its models; what cannot be its orbit is rejected."""

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
        super().start(core)

    @property
    def supplies(self) -> bool:
        """Whether the computer has another orbit or other models than at launch."""
        return self.elements is not None or self.settings.flags != _LAUNCHED

    def supply(self, computer) -> None:
        """Have the ephemeris on board come from the elements and models."""
        models = computer.chosen_ephemeris(self.elements, self._choice()) if self.supplies else None
        computer.set_ephemeris(models)

    def on_set_elements(self, core, values) -> Reason:
        """Two-line elements, checked in full; CHECKSUM where a line's own sum is wrong, VALUE for
        those of another orbit than the computer's."""
        code, elements = checked_elements(*values)
        if elements is None:
            return code
        before, code = self.elements, self._plausible(core, elements)
        if code is Reason.DONE:
            self.elements = elements
            code = self.take_up(core)
        if code is not Reason.DONE:
            self.elements = before
            return code
        stored = core.memory.write(ELEMENTS, "\n".join(elements).encode())
        return Reason.DONE if stored else Reason.FAILED

    def on_elements_limits(self, core, values) -> Reason:
        """How far elements may be from the computer's present orbit."""
        if not all(map(math.isfinite, values)):
            return Reason.VALUE
        return self.change(core, largest_km=values[0], largest_plane_deg=values[1])

    def on_set_model(self, core, values) -> Reason:
        """Choose the models; VALUE for flags without a meaning, as a dipole's degree."""
        (flags,) = values
        degree, is_whole = flags >> _DEGREE, bool(flags & _WHOLE_FIELD)
        if flags > 0xFF or flags & 8 or (degree and not is_whole):
            return Reason.VALUE
        sun = core.inputs.ephemeris.sun_inertial if flags & _SUN_STAYS else None
        if sun is not None and not all(map(math.isfinite, sun)):
            return Reason.NOT_AVAILABLE
        return self.change(core, flags=flags, sun_inertial=sun)

    def in_force(self, core):
        """Choice of models, whether there are elements, their limits."""
        settings = self.settings
        limits = settings.largest_km, settings.largest_plane_deg
        return [("models", (settings.flags, self.elements is not None, *limits))]

    def status(self) -> dict[str, float]:
        """Whether there are elements, choice of models."""
        return {"elements": float(self.elements is not None), "flags": self.settings.flags}

    def _choice(self) -> Choice:
        flags, sun = self.settings.flags, self.settings.sun_inertial
        return Choice(not flags & _SGP4, not flags & _WHOLE_FIELD, flags >> _DEGREE, sun)

    def _plausible(self, core, elements: tuple[str, str]) -> Reason:
        """Whether elements are of about the orbit in which the computer believes."""
        computer = core.computer
        try:
            models = computer.chosen_ephemeris(elements, self._choice())
            away_m, angle_rad = computer.ephemeris_apart(models)
        except NoSuchModel:
            return Reason.NOT_AVAILABLE
        except ValueError:
            return Reason.VALUE
        is_near = away_m <= 1e3 * self.settings.largest_km
        in_plane = math.degrees(angle_rad) <= self.settings.largest_plane_deg
        return Reason.DONE if is_near and in_plane else Reason.VALUE


def checked_elements(*lines: bytes) -> tuple[Reason, tuple[str, str] | None]:
    """The two lines as text, if they describe an orbit; else what is wrong with them."""
    try:
        first, second = (line.decode("ascii") for line in lines)
        found = Sgp4(tle=(first, second)).tle
    except ScenarioError:
        sums = all(line[-1:].isdigit() and int(line[-1]) == checksum(line)
                   for line in (first, second))  # fmt: skip
        return Reason.VALUE if sums else Reason.CHECKSUM, None
    except ValueError:  # not two lines of ASCII
        return Reason.VALUE, None
    return Reason.DONE, found
