"""What a wheel array can do: one request, one report with its tables."""

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from torquer.base.limits import RequestError
from torquer.base.rows import Row, as_html
from torquer.design.requests import WheelsRequest
from torquer.design.wheel_design import analyse
from torquer.design.wheel_file import WheelDesign
from torquer.design.wheel_sweep import Sweep, as_plain, sweep_angle, sweepable_angles
from torquer.design.wheel_tables import failure_rows, layout_rows, summary_rows, sweep_rows

#: A sweep as it is written, with the number of points behind it or without.
_SWEEP = re.compile(r"^(\w+)=([^:]+):([^:]+)(?::(\d+))?$")
_POINTS, _MOST_POINTS = 61, 1001


@dataclass(frozen=True)
class WheelReport:
    """A design, all that was found about it as plain data, and the sweep if one was asked for."""

    design: WheelDesign
    found: dict
    swept: Sweep | None = None

    @property
    def title(self) -> str:
        """What the design is for, else its name."""
        return self.found["description"] or self.found["name"]

    def data(self) -> dict:
        """Plain data, with units in the keys."""
        return self.found | ({"sweep": as_plain(self.swept)} if self.swept else {})

    def tables(self) -> Iterator[tuple]:
        """Title, head, rows and number of columns of words of each table."""
        yield *failure_rows(self.found), 1
        if len(self.found["layouts"]) > 1:
            yield *layout_rows(self.found), 2
        if self.swept:
            yield *sweep_rows(self.swept), 0

    def _repr_html_(self) -> str:
        """In notebooks: the key numbers and all tables."""
        summary = _html(("", self.title), summary_rows(self.found))
        tables = (_html(head, rows, title) for title, head, rows, _ in self.tables())
        return summary + "".join(tables)


def _html(head, rows, *notes: str) -> str:
    entries = (zip(head, row, strict=True) for row in rows)
    return as_html([[Row("", name, text=text) for name, text in each] for each in entries], notes)


def wheels(design: WheelDesign, asked: WheelsRequest | None = None) -> WheelReport:
    """Capability of a wheel array, whole and with up to two failed wheels; layouts; saturation.

        from torquer.design import WheelsRequest, load_wheels, wheels
        report = wheels(load_wheels("foton.toml"), WheelsRequest(sweep="alpha_deg=40:88"))
        report.found["momentum"]["worst_rate_deg_s"]

    `RequestError` for a sweep of what is no angle of the layout. `torquer.report.wheels` draws the
    report.
    """
    text = asked.sweep if asked else None
    swept = None if text is None else sweep_angle(design, *swept_angle(design, text))
    return WheelReport(design, analyse(design), swept)


def swept_angle(design: WheelDesign, text: str) -> tuple[str, list[float]]:
    """Key and values [deg] of a sweep written `gamma_deg=20:85` or `gamma_deg=20:85:14`.

    `RequestError` for a key other than an angle of the design's layout, and for bad numbers.
    """
    angles = sweepable_angles(design)
    if not angles:
        kind = design.wheels.layout.kind
        raise RequestError("sweep", f"must name an angle of the layout; {kind} has none")
    example = f"such as {angles[0]}=20:85 or {angles[0]}=20:85:14"
    found = _SWEEP.match(text)
    if found is None or found[1] not in angles:
        raise RequestError(
            "sweep",
            f"must be ANGLE=FROM:TO, {example}, with {' or '.join(angles)}; received {text!r}",
        )
    try:
        first, last = float(found[2]), float(found[3])
    except ValueError:
        raise RequestError("sweep", f"must have numbers, {example}; received {text!r}") from None
    points = int(found[4] or _POINTS)
    if not 0.0 < first < last < 90.0:
        raise RequestError(
            "sweep", f"must increase, from above 0 to below 90 deg; received {text!r}"
        )
    if not 2 <= points <= _MOST_POINTS:
        raise RequestError("sweep", f"must have 2 to {_MOST_POINTS} points; received {points}")
    return found[1], np.linspace(first, last, points).tolist()
