"""Names by which software outside, or a ground station, commands the computer on board."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from torquer.computer.modes.spec import Condition

#: First part of the parameter that a threshold of the mode tables is.
MODES = "modes."


class Names(NamedTuple):
    """Names of a run's computer and their places: regions with their states, flags, parameters of
    laws (first place, count), thresholds with the conditions and their places; states by number.
    `fixed`: parameters that shape their blocks and are not set in flight.
    """

    regions: dict[str, tuple[int, dict[str, int]]]
    flags: tuple[str, ...]
    parameters: dict[str, tuple[int, int]]
    thresholds: dict[str, list[tuple[int, Condition]]]
    states: tuple[str, ...]
    fixed: frozenset[str] = frozenset()

    def all_parameters(self) -> list[str]:
        """Names for `set_parameter`: parameters of laws and estimators, then thresholds."""
        return [*self.parameters, *(MODES + name for name in self.thresholds)]
