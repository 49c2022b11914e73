"""What the checker of mode tables knows, and what it finds."""

from collections.abc import Mapping
from typing import NamedTuple

from torquer.computer.interface import SENSORS


class Facts(NamedTuple):
    """What is known of the satellite around a mode table; the defaults assume nothing.

    `step_s`: interval between control steps [s]. `kinds`: laws' kinds by name; `drives`: of laws by
    name, which of `coils` and `wheels` they drive. `gives`: of estimators by name, `attitude`,
    `rate`, `sigma`; the one that works where no state chooses another is called `estimator`.
    `sensors`: those that are read.
    """

    step_s: float = 0.0
    kinds: Mapping[str, str] = {}
    drives: Mapping[str, frozenset[str]] = {}
    gives: Mapping[str, frozenset[str]] = {}
    sensors: frozenset[str] = frozenset(SENSORS)


class Finding(NamedTuple):
    """What was found, and where: region (several: with commas) and states.

    `kind`: `unreachable`; `trap`; `waits for the unknown`; `never`, `always`: a condition or
    transition; `deadlock`; `conflict`; `no effect`; `leftover`: a parameter that nothing sets back;
    `chatter`. No faults are `hysteresis` and `switching rate`, which state what prevents a cycle
    from chattering, and `bound`: how far the regions were explored together. `strip`: how it can
    come about, the states of all regions step by step, a line each.
    """

    kind: str
    region: str
    states: tuple[str, ...]
    message: str
    strip: tuple[str, ...] = ()

    @property
    def is_fault(self) -> bool:
        """Whether something is doubtful, not only explained."""
        return self.kind not in ("hysteresis", "switching rate", "bound")

    @property
    def places(self) -> list[tuple[str, str]]:
        """Regions and states, of a finding on one state in each of several regions."""
        return list(zip(self.region.split(", "), self.states, strict=True))
