"""Strikes: what resets of the computer speak against modules, and what the next boot gives up.

A module that makes no step any more has the watchdog reset the computer. If its defect stays, the
reset cures nothing; so each one is a strike against the modules that caused it, and the next boot
does without something more: settings, the module, the main file system. Strikes stay in the memory
of the processor over a reset, in the non-volatile memory over a failure of the power.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from typing import NamedTuple

#: File of the non-volatile memory that holds the strikes.
STRIKES = "strikes"
#: Modules without which the software cannot be commanded, or is reset.
REQUIRED = ("cdh", "com", "svr", "wdt")
#: In place of a module: resets that no module explains.
NOBODY = ""
#: Strikes from which on a module has its default settings; from which on it is kept off.
OWN_DEFAULTS, OFF = 2, 3
#: Strikes of a required module or of nobody: all modules have their default settings; the reserve
#: file system is mounted; the module is kept off.
DEFAULTS, RESERVE, REQUIRED_OFF = 4, 5, 6
#: Time without a reset after which strikes are forgotten, and required modules tried again [s].
FORGIVEN_S = 6 * 3600.0
_MOST = 1000


class Strikes(NamedTuple):
    """Strikes by module; what follows from them. Never changed, so that it may be shared."""

    modules: Mapping[str, int] = {}

    def against(self, names: Iterable[str]) -> Strikes:
        """With a strike more against each of these modules, or against nobody without any."""
        struck = dict(self.modules)
        for name in list(names) or [NOBODY]:
            struck[name] = min(struck.get(name, 0) + 1, _MOST)
        return Strikes(struck)

    def without(self, name: str) -> Strikes:
        """With none against a module."""
        return Strikes({each: n for each, n in self.modules.items() if each != name})

    def forgiven(self) -> Strikes:
        """After a long time without a reset: what is kept off stays off, but for required modules,
        which have one more try."""
        kept = {name: n for name, n in self.modules.items() if self.is_off(name)}
        return Strikes({name: n if _bound(name) == OFF else RESERVE for name, n in kept.items()})

    def is_off(self, name: str) -> bool:
        """Whether a module is kept off."""
        return self.modules.get(name, 0) >= _bound(name)

    def uses_defaults(self, name: str) -> bool:
        """Whether a module has its default settings, whatever the memory holds."""
        return self.modules.get(name, 0) >= OWN_DEFAULTS or self.all_defaults

    @property
    def all_defaults(self) -> bool:
        """Whether all modules have their default settings."""
        return self._most() >= DEFAULTS

    @property
    def from_reserve(self) -> bool:
        """Whether the reserve file system is mounted."""
        return self._most() >= RESERVE

    @property
    def is_watched(self) -> bool:
        """Whether supervisor and watchdog module do their work; else the schedule feeds."""
        return not any(self.is_off(name) for name in ("svr", "wdt", NOBODY))

    def save(self) -> bytes:
        """For the non-volatile memory."""
        return json.dumps(dict(sorted(self.modules.items()))).encode()

    def _most(self) -> int:
        """Of what is not kept off."""
        return max((n for name, n in self.modules.items() if not self.is_off(name)), default=0)


NO_STRIKES = Strikes()


def read_strikes(data: bytes) -> Strikes | None:
    """What `save` gave; None for anything else."""
    try:
        found = json.loads(data)
        valid = all(type(n) is int and 0 < n <= _MOST for n in found.values())
    except (ValueError, AttributeError, RecursionError):
        return None
    return Strikes(found) if valid else None


def _bound(name: str) -> int:
    return REQUIRED_OFF if name in REQUIRED or name == NOBODY else OFF
