"""What was left out of recordings: how many, by reason, where the first one is, and an example."""

from __future__ import annotations

from dataclasses import dataclass, field

from torquer.flight.packets.reasons import left_out_as

#: Reasons of what is there although it was left out: no loss.
HARMLESS = ("repeated", "archived")


@dataclass
class _Entry:
    count: int = 0
    first: int | None = None
    example: str = ""


@dataclass
class Tally:
    """Counts by reason; `base`: added to the places given, those of the recording now read."""

    base: int = 0
    _found: dict[str, _Entry] = field(default_factory=dict)

    def add(self, reason: str, at: int | None, example: str = "", count: int = 1) -> None:
        """Count what was left out. `at`: its place; `example`: what was found and looked for."""
        entry = self._found.setdefault(reason, _Entry())
        entry.count += count
        if at is not None and (entry.first is None or self.base + at < entry.first):
            entry.first, entry.example = self.base + at, example

    def count(self, reason: str) -> int:
        """How many were left out for a reason."""
        return self._found[reason].count if reason in self._found else 0

    @property
    def rejected(self) -> int:
        """How many were left out for a fault of theirs."""
        others = (*HARMLESS, "torn", "ambiguous")
        return sum(e.count for reason, e in self._found.items() if reason not in others)

    def entries(self) -> list[dict]:
        """All reasons, the most frequent first; `first_byte`: over all recordings, or None."""
        ordered = sorted(self._found.items(), key=lambda item: -item[1].count)
        return [
            {
                "reason": reason,
                "text": left_out_as(reason, entry.count)
                + (f": {entry.example}" if entry.example else ""),
                "count": entry.count,
                "first_byte": entry.first,
            }
            for reason, entry in ordered
        ]
