"""An angle of a layout swept: what the array can do at each value, whole and after a failure."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from torquer.design.wheel_design import demand_shares, saturation_h
from torquer.design.wheel_file import WheelDesign
from torquer.spacecraft.wheel_array.envelope import momentum_envelope
from torquer.spacecraft.wheel_array.layout import WheelArray
from torquer.spacecraft.wheel_array.rates import worst_case


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


def sweepable_angles(design: WheelDesign) -> list[str]:
    """The keys of the layout that can be swept; empty for a layout without angles."""
    return [key for key in type(design.wheels.layout).model_fields if key.endswith("_deg")]


def sweep_angle(design: WheelDesign, key: str, values_deg: Sequence[float]) -> Sweep:
    """The design at increasing values of an angle of its layout, one of `angles_of`.

    The angle of the highest rate is added as a point.
    """
    inertia = np.array(design.body.inertia)
    held = design.accumulation
    growth = None if held is None else held.growth(inertia)
    points = [_point(design, key, value, inertia, growth) for value in values_deg]
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


def _capability(array: WheelArray, inertia) -> Capability:
    envelope = momentum_envelope(array)
    rate = math.degrees(worst_case(envelope, inertia).rate)
    return Capability(envelope.inner_radius, rate)
