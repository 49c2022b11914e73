"""An angle of a layout swept: what the array can do at each value, whole and after a failure."""

import math
import re
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from torquer.analysis.wheel_design import demand_shares, saturation_h
from torquer.analysis.wheel_file import WheelDesign
from torquer.wheel_array.envelope import momentum_envelope
from torquer.wheel_array.layout import WheelArray
from torquer.wheel_array.rates import worst_case

_POINTS, _MOST_POINTS = 61, 1001
_RANGE = re.compile(r"^(\w+)=([^:]+):([^:]+)(?::(\d+))?$")


class Capability(NamedTuple):
    """What an array guarantees in any direction: momentum [N m s], rate about any axis [deg/s]."""

    momentum_n_m_s: float
    rate_deg_s: float


class Point(NamedTuple):
    """An array at one value of the angle: whole, and after the worst single failure.

    `one_failed`: momentum and rate, each after the failure that leaves least of it.
    """

    value: float
    volume_n3_m3_s3: float
    whole: Capability
    one_failed: Capability
    demand_share: float | None
    """Greatest share of the envelope that a demand takes, met up to 1; None without demands."""
    saturation_h: float | None
    """Time to saturation; None for never, or without data on accumulation."""


class Sweep(NamedTuple):
    """Points over the values of a key of the layout."""

    key: str
    points: tuple[Point, ...]

    def best(self) -> Point:
        """The point of the highest guaranteed rate."""
        return max(self.points, key=lambda point: point.whole.rate_deg_s)


def sweep_of(design: WheelDesign, text: str) -> Sweep:
    """The sweep described by a text: `gamma_deg=20:85`, or with the number of points behind it.

    The angle of the highest rate is added as a point.

    `ValueError` for a key other than an angle of the design's layout.
    """
    key, values = _asked(design, text)
    inertia = np.array(design.body.inertia_kg_m2)
    held = design.accumulation
    growth = None if held is None else held.growth(inertia)
    points = [_point(design, key, value, inertia, growth) for value in values.tolist()]
    peak = _point(design, key, _peak(design, key, points, inertia), inertia, growth)
    found = sorted({point.value: point for point in (*points, peak)}.values())
    return Sweep(key, tuple(found))


def _point(design: WheelDesign, key: str, value: float, inertia, growth) -> Point:
    array = _array(design, key, value)
    alive = [n for n in range(array.count) if n not in array.lost]
    failed = [_capability(array.without(n), inertia) for n in alive]
    shares = demand_shares(design, array, inertia).values()
    return Point(
        value,
        momentum_envelope(array).volume,
        _capability(array, inertia),
        Capability(*map(min, zip(*failed, strict=True))),
        max(shares) if shares else None,
        saturation_h(array, growth),
    )


def _peak(design: WheelDesign, key: str, points: list[Point], inertia) -> float:
    """Where the rate is highest, found between the neighbours of the best point."""
    best = max(range(len(points)), key=lambda n: points[n].whole.rate_deg_s)
    around = points[max(best - 1, 0)].value, points[min(best + 1, len(points) - 1)].value
    found = minimize_scalar(
        lambda value: -_capability(_array(design, key, value), inertia).rate_deg_s,
        bounds=around, method="bounded", options={"xatol": 1e-6},
    )  # fmt: skip
    value, highest = round(float(found.x), 6), -float(found.fun)
    return value if highest > points[best].whole.rate_deg_s else points[best].value


def _array(design: WheelDesign, key: str, value: float) -> WheelArray:
    layout = design.wheels.layout.model_copy(update={key: value})
    return design.wheels.model_copy(update={"layout": layout}).array()


def as_plain(sweep: Sweep) -> dict:
    """Plain data, with units in the keys."""
    return {
        "key": sweep.key,
        "best": sweep.best().value,
        "points": [
            {
                sweep.key: point.value,
                "volume_n3_m3_s3": point.volume_n3_m3_s3,
                "worst_direction_n_m_s": point.whole.momentum_n_m_s,
                "worst_rate_deg_s": point.whole.rate_deg_s,
                "one_failed_worst_direction_n_m_s": point.one_failed.momentum_n_m_s,
                "one_failed_worst_rate_deg_s": point.one_failed.rate_deg_s,
                "demand_share": point.demand_share,
                "saturation_h": point.saturation_h,
            }
            for point in sweep.points
        ],
    }


def _asked(design: WheelDesign, text: str) -> tuple[str, np.ndarray]:
    """Key and values of a sweep."""
    angles = [key for key in type(design.wheels.layout).model_fields if key.endswith("_deg")]
    if not angles:
        kind = design.wheels.layout.kind
        raise ValueError(f"--sweep: must name an angle of the layout; {kind} has none")
    example = f"such as {angles[0]}=20:85 or {angles[0]}=20:85:14"
    found = _RANGE.match(text)
    if found is None or found[1] not in angles:
        raise ValueError(
            f"--sweep: must be ANGLE=FROM:TO, {example}, with {' or '.join(angles)}; "
            f"received {text!r}"
        )
    try:
        first, last = float(found[2]), float(found[3])
    except ValueError:
        raise ValueError(f"--sweep: must have numbers, {example}; received {text!r}") from None
    points = int(found[4] or _POINTS)
    if not 0.0 < first < last < 90.0:
        raise ValueError(f"--sweep: must increase within 0 to 90 deg; received {text!r}")
    if not 2 <= points <= _MOST_POINTS:
        raise ValueError(f"--sweep: must have 2 to {_MOST_POINTS} points; received {points}")
    return found[1], np.linspace(first, last, points)


def _capability(array: WheelArray, inertia) -> Capability:
    envelope = momentum_envelope(array)
    rate = math.degrees(worst_case(envelope, inertia).rate)
    return Capability(envelope.inner_radius, rate)
