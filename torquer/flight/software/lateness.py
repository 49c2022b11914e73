"""How late control steps begin that should keep pace with a clock."""

from collections import Counter

#: Classes of lateness in a second.
_PER_S = 10_000


class Lateness:
    """Lateness of control steps, counted in classes of 0.1 ms."""

    def __init__(self) -> None:
        self._count: Counter[int] = Counter()
        self._most_s = 0.0

    def take(self, late_s: float) -> None:
        """Count a control step that began late [s]."""
        self._count[int(late_s * _PER_S)] += 1
        self._most_s = max(self._most_s, late_s)

    def within_ms(self, part: float) -> float:
        """Lateness that a part of the control steps do not exceed [ms], rounded up."""
        wanted, seen = part * self._count.total(), 0
        for number in sorted(self._count):
            seen += self._count[number]
            if seen >= wanted:
                return min((number + 1) / _PER_S, self._most_s) * 1e3
        return 0.0

    def summary(self) -> dict[str, float]:
        """Median, that of 99 % and the greatest lateness [ms]."""
        most_ms = self._most_s * 1e3
        found = {"median": self.within_ms(0.5), "99 %": self.within_ms(0.99), "most": most_ms}
        return {name: round(value, 3) for name, value in found.items()}
