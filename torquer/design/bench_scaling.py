"""What a B-dot test on a bench says of the time in orbit: MAG, section 5.2."""

from dataclasses import dataclass
from typing import NamedTuple

from torquer.base.rows import Row, as_data, as_html
from torquer.design.requests import BenchRequest

#: What coils do by each of the two laws of scaling.
_WORDS = ("at their limits", "below their limits")


class Scaling(NamedTuple):
    """Time in orbit over that on the bench, by how the coils work.

    `saturated`: coils at their limit, J dw/dt ~ m B, so that the time goes with J/(m B): the text's
    own argument. `linear`: below the limit, J dw/dt ~ k B^2 w, so that it goes with J/(k B^2).
    """

    saturated: float
    linear: float


def scaling(
    inertia_ratio: float, field_ratio: float, dipole_ratio: float = 1.0, gain_ratio: float = 1.0
) -> Scaling:
    """Scaling of the time for ratios of orbit to bench: inertia, field, dipole limit, gain.

    Both hold for the same initial rate and the same directions of rotation and field. A bench field
    is constant: rotation about it is not braked, and the mean sine of the angle to the field is
    another than in orbit, where the field turns.
    """
    return Scaling(
        inertia_ratio / (dipole_ratio * field_ratio), inertia_ratio / (gain_ratio * field_ratio**2)
    )


@dataclass(frozen=True)
class TimeInOrbit:
    """The factors on the time, and the times in orbit [s]."""

    factors: Scaling
    time_s: Scaling

    def table(self) -> list[list[Row]]:
        """A line for coils at their limits, one for coils below them."""
        cases = zip(self.factors._asdict().items(), _WORDS, self.time_s, strict=True)
        return [
            [
                Row("", "coils", text=words),
                Row(f"factors/{name}", "factor", factor, "", f"{factor:.4g}"),
                Row(f"time_s/{name}", "in orbit", time_s, "min", f"{time_s / 60.0:.4g}"),
            ]
            for (name, factor), words, time_s in cases
        ]

    def data(self) -> dict:
        """Plain data, with units in the keys."""
        return as_data([row for line in self.table() for row in line])

    def lines(self) -> list[str]:
        """The answer as text."""
        return [
            f"coils {case.text}: {factor.text} times as long, {time.text} {time.unit} in orbit"
            for case, factor, time in self.table()
        ]

    def _repr_html_(self) -> str:
        return as_html(self.table())


def bench(request: BenchRequest) -> TimeInOrbit:
    """From a B-dot test on a bench to the time in orbit [s], for the same initial rate.

    bench(BenchRequest(time_s=600.0, bench_inertia=0.4, inertia=1.6, bench_field_nt=1e5,
                       field_nt=1e4)).time_s.saturated      # 24000.0
    """
    factors = scaling(
        request.inertia / request.bench_inertia, request.field_nt / request.bench_field_nt,
        request.dipole_ratio, request.gain_ratio,
    )  # fmt: skip
    return TimeInOrbit(factors, Scaling(*(factor * request.time_s for factor in factors)))
