"""The trim of the residual dipole, offered where the dipole breaks a hold by coils."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from torquer.base.rows import degrees_text
from torquer.scenario.toml_text import to_toml
from torquer.theory.three_axis.gain_search import Candidate, DesignTask
from torquer.theory.three_axis.response import PointingError, greatest_angle
from torquer.theory.three_axis.sampled import SOURCES
from torquer.theory.three_axis.trim import TrimDesign, design_trim
from torquer.theory.validity import LEAN

_DIPOLE = SOURCES[1]


@dataclass(frozen=True)
class TrimAnswer:
    """The trim, and by law the greatest steady error [deg] that is left with the dipole trimmed."""

    design: TrimDesign
    left_deg: Mapping[str, float]

    def data(self) -> dict:
        """Plain data, with units in the keys."""
        return {
            "law": self.design.spec.model_dump(mode="json"),
            "slowest_s": self.design.slowest_s,
            "error_deg": dict(self.left_deg),
            "verdict": self.design.verdict.data(),
        }

    def lines(self) -> list[str]:
        """The law's keys, what it leaves, and whether its conditions hold."""
        spec, hours = self.design.spec, self.design.slowest_s / 3600.0
        errors = self.left_deg.items()
        left = ", ".join(f"{name} {degrees_text(error)} deg" for name, error in errors)
        return [
            f"trim: dipole_trim, time_constant_s = {spec.time_constant_s:g}, "
            f"greatest_dipole_a_m2 = {spec.greatest_dipole_a_m2:g}, coil_duty = {spec.coil_duty:g}",
            "trim: beside a law in control.laws it takes off the residual dipole and leaves "
            f"{left}; an error of the estimate falls to 1/e in {hours:.2g} h at the slowest",
            *(f"trim: {line}" for line in self.design.verdict.lines()),
        ]

    def table(self) -> str:
        """The law as the TOML table of a scenario."""
        return to_toml({"control": {"laws": {"trim": self.design.spec.model_dump(mode="json")}}})


def offered_trim(
    task: DesignTask, candidates: Mapping[str, Candidate], within_deg: float
) -> TrimAnswer | None:
    """The trim, if some law's steady error exceeds `within_deg` most of all by the dipole.

    None where what is left without the dipole lies beyond the linear theory, too.
    """
    errors = {name: each.error for name, each in candidates.items() if each.error is not None}
    left = {
        name: _without_dipole(error) for name, error in errors.items()
        if math.degrees(error.greatest_rad) > within_deg and _is_most(error)
    }  # fmt: skip
    known = {name: math.degrees(rad) for name, rad in left.items() if LEAN.holds(rad)}
    return TrimAnswer(design_trim(task), known) if known else None


def _is_most(error: PointingError) -> bool:
    """Whether the residual dipole alone makes the greatest error of all sources."""
    each = error.by_source
    return max(each, key=lambda name: greatest_angle(each[name])) == _DIPOLE


def _without_dipole(error: PointingError) -> float:
    """Greatest error [rad] without the residual dipole: the equations are linear."""
    return greatest_angle(error.turns - error.by_source[_DIPOLE])
