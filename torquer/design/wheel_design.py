"""Analysis of a wheel design as plain data, with units in the keys."""

import math
import time
from itertools import permutations

import numpy as np

from torquer.base.strict_json import finite_or_none
from torquer.design.wheel_file import WheelDesign
from torquer.design.wheel_nearest import greater_limits, layouts_that_meet
from torquer.spacecraft.wheel_array import angles, layout, search
from torquer.spacecraft.wheel_array.allocation import allocate
from torquer.spacecraft.wheel_array.demand import (
    Box,
    greatest_momentum,
    greatest_norm,
    greatest_share,
)
from torquer.spacecraft.wheel_array.envelope import Envelope, momentum_envelope, torque_envelope
from torquer.spacecraft.wheel_array.failures import (
    failure_table,
    least_squares_against_minimax,
    least_squares_half_spaces,
)
from torquer.spacecraft.wheel_array.layout import WheelArray
from torquer.spacecraft.wheel_array.rates import rate_about, required_momenta, worst_case
from torquer.theory.slow.wheel_accumulation import Growth, cyclic_bounds, saturation_time

METHODS = ("minimax", "least_squares")
_NAMES = ("x1", "x2", "x3")
_HOUR, _DAY = 3600.0, 86400.0
#: Vectors of the benchmark of allocation.
_VECTORS = 20_000


def analyse(design: WheelDesign) -> dict:
    """All results; parts that were not requested are None."""
    array, inertia = design.wheels.array(), np.array(design.body.inertia)
    growth = design.accumulation and design.accumulation.growth(inertia)
    others = candidates(design)
    return {
        "name": design.name,
        "description": design.description,
        "axes": [list(axis) for axis in array.axes],
        "lost": list(array.lost),
        "momentum": _momentum(array, inertia),
        "torque": None if array.torque_limit_n_m is None else _torque(array, inertia),
        "demand": _demand(design, array, inertia),
        "nearest": _nearest(design, array, inertia, others),
        "least_squares": _comparison(array),
        "allocation": _cost(array),
        "failures": _failures(design, array, inertia, growth),
        "layouts": _layouts(design, array, inertia, growth, others),
        "only_given_layout": _only_given(array),
        "accumulation": growth and _accumulation(array, growth),
    }


def _by_axis(values) -> dict:
    return dict(zip(_NAMES, map(float, values), strict=True))


def _momentum(array, inertia) -> dict:
    envelope = momentum_envelope(array)
    rates, worst = _turns(envelope, inertia)
    normals, bounds = envelope.half_spaces
    return {
        "volume_n3_m3_s3": envelope.volume,
        "vertices": len(envelope.vertices),
        "edges": len(envelope.edges),
        "faces": len(envelope.faces),
        "greatest_n_m_s": _by_axis(envelope.extent(np.eye(3))),
        "worst_direction_n_m_s": envelope.inner_radius,
        "worst_direction": normals[np.argmin(bounds)].tolist(),
        "rate_deg_s": rates,
        "worst_rate_deg_s": math.degrees(worst.rate),
        "worst_rate_axis": worst.axis.tolist(),
    }


def _torque(array, inertia) -> dict:
    envelope = torque_envelope(array)
    rates, worst = _turns(envelope, inertia)
    return {
        "greatest_n_m": _by_axis(envelope.extent(np.eye(3))),
        "worst_direction_n_m": envelope.inner_radius,
        "acceleration_deg_s2": rates,
        "worst_acceleration_deg_s2": math.degrees(worst.rate),
        "worst_acceleration_axis": worst.axis.tolist(),
    }


def _turns(envelope: Envelope, inertia):
    """Rates about the body axes by name, and the worst case."""
    return _by_axis(np.degrees(rate_about(envelope, inertia, np.eye(3)))), worst_case(
        envelope, inertia
    )


def demand_shares(design: WheelDesign, array: WheelArray, inertia) -> dict[str, float]:
    """Share of the envelope that each demand takes: met up to 1, infinite if unreachable."""
    demand, held = design.demand, momentum_envelope(array)
    shares = {}
    if demand.rate_deg_s is not None:
        shares["rate"] = greatest_share(
            held, required_momenta(inertia, math.radians(demand.rate_deg_s))
        )
    if demand.acceleration_deg_s2 is not None:
        needed = required_momenta(inertia, math.radians(demand.acceleration_deg_s2))
        shares["acceleration"] = greatest_share(torque_envelope(array), needed)
    if demand.momentum_n_m_s is not None:
        shares["momentum"] = greatest_share(held, Box(np.array(demand.momentum_n_m_s)))
    return shares


def _demand(design: WheelDesign, array: WheelArray, inertia) -> dict:
    return {
        name: {"share": finite_or_none(share), "met": bool(share <= 1.0)}
        for name, share in demand_shares(design, array, inertia).items()
    }


def _nearest(design: WheelDesign, array: WheelArray, inertia, others) -> dict | None:
    """What would meet the demands; None where all are met."""
    shares = demand_shares(design, array, inertia)
    if all(share <= 1.0 for share in shares.values()):
        return None
    meet = layouts_that_meet(array, others, lambda each: demand_shares(design, each, inertia))
    return {
        "limits": [change._asdict() for change in greater_limits(design.wheels, shares)],
        "layouts": [{"name": name, "angles": angles} for name, angles in meet],
    }


def _comparison(array: WheelArray) -> dict | None:
    """Share of the envelope that least squares reaches; None for a flat envelope."""
    if momentum_envelope(array).rank < 3:
        return None
    found = least_squares_against_minimax(array)
    return {
        "volume": found.volume,
        "inner_radius": found.inner_radius,
        "least_extent": found.least_extent,
        "direction": found.direction.tolist(),
    }


def _cost(array: WheelArray) -> dict:
    """Microseconds per vector: the best of a few repetitions, after compilation."""
    demands = np.random.default_rng(0).normal(size=(_VECTORS, 3))
    cost = {}
    for method in METHODS:
        allocate(array, demands[:2], method)
        spent = []
        for _ in range(3):
            began = time.perf_counter()
            allocate(array, demands, method)
            spent.append(time.perf_counter() - began)
        cost[f"{method}_us"] = 1e6 * min(spent) / _VECTORS
    return cost


def half_spaces(array: WheelArray, method: str) -> np.ndarray:
    """Rows (m, 3): with that allocation the array can store H while all |row . H| <= 1."""
    if method == "least_squares":
        return least_squares_half_spaces(array)
    normals, bounds = momentum_envelope(array).half_spaces
    return normals / np.maximum(bounds, 1e-300)[:, None]


def saturation_h(array: WheelArray, growth: Growth | None, method="minimax") -> float | None:
    """Hours; None for never, or without data on accumulation."""
    if growth is None:
        return None
    return finite_or_none(saturation_time(growth, half_spaces(array, method)) / _HOUR)


def _failures(design, array: WheelArray, inertia, growth) -> list[dict]:
    cases = []
    for case in failure_table(array, inertia):
        worst = case.worst_acceleration_rad_s2
        left = array.without(*case.lost)
        cases.append(
            {
                "lost": list(case.lost),
                "rank": case.rank,
                "volume": case.volume,
                "worst_direction_n_m_s": case.inner_radius_n_m_s,
                "worst_rate_deg_s": math.degrees(case.worst_rate_rad_s),
                "worst_acceleration_deg_s2": None if worst is None else math.degrees(worst),
                "demand_met": all(one["met"] for one in _demand(design, left, inertia).values()),
                "saturation_h": saturation_h(left, growth),
            }
        )
    return cases


def candidates(design: WheelDesign) -> list[tuple[str, str, np.ndarray]]:
    """The given layout and others of the same number of wheels: name, angles, axes (n, 3).

    Pyramids for rates are aligned with the principal axes; `*` marks where those differ from the
    body's.
    """
    array = design.wheels.array()
    label, count = _describe_angles(design.wheels.layout), array.count
    found = [("given", label, np.array(array.axes))]
    if _only_given(array):
        return found
    moments, turn = _principal(np.array(design.body.inertia))
    found.append(("balanced rates", *_turn(_pyramid(count, _balance(count, moments)), turn)))
    best = search.find_layout(
        lambda p: _pyramid(count, p)[1], search.greatest_worst_rate(moments),
        *(([1.0] * _free(count)), [89.0] * _free(count)), starts=6,
    )  # fmt: skip
    name = "best worst-case rate" if best.is_optimal else "good worst-case rate"
    found.append((name, *_turn(_pyramid(count, best.parameters), turn)))
    if design.demand.momentum_n_m_s is not None:
        least = angles.least_four_sided if count == 4 else angles.least_regular
        found.append(("minimum momentum", *_pyramid(count, least(design.demand.momentum_n_m_s))))
    return [*found, ("maximum volume", *_greatest_volume(count))]


def _describe_angles(given) -> str:
    """The angles of a layout in words; its kind where it has none."""
    angles = (key for key in type(given).model_fields if key.endswith("_deg"))
    text = ", ".join(f"{key.removesuffix('_deg')} {getattr(given, key):.1f}" for key in angles)
    return text or given.kind


def _only_given(array: WheelArray) -> str | None:
    """Why no other layouts are compared; None if they are."""
    if array.lost:
        return "wheels have failed"
    return None if np.ptp(array.momentum_limits()) == 0.0 else "the limits are not equal"


def _principal(inertia) -> tuple[np.ndarray, np.ndarray]:
    """Principal moments (3,) and axes, columns (3, 3), in the order nearest to the body's."""
    moments, axes = np.linalg.eigh(inertia)
    order = max(permutations(range(3)), key=lambda p: np.abs(np.diag(axes[:, p])).sum())
    return moments[list(order)], axes[:, order] * np.sign(np.diag(axes[:, order]))


def _turn(pyramid: tuple[str, np.ndarray], turn) -> tuple[str, np.ndarray]:
    """A pyramid on the principal axes, in the body frame."""
    label, axes = pyramid
    return (label, axes) if np.all(turn == np.eye(3)) else (f"{label} *", axes @ turn.T)


def _free(count: int) -> int:
    """Number of a pyramid's angles."""
    return 2 if count == 4 else 1


def _balance(count: int, moments):
    return angles.balanced_four_sided(moments) if count == 4 else angles.balanced_regular(
        count, moments
    )  # fmt: skip


def _pyramid(count: int, parameters) -> tuple[str, np.ndarray]:
    """Angles in words, and axes, of a pyramid: four-sided for four wheels, else regular."""
    given = np.atleast_1d(parameters)
    if count == 4:
        label = f"alpha {given[0]:.1f}, beta {given[1]:.1f}"
        return label, layout.four_sided_pyramid(*given)
    return f"gamma {given[0]:.1f}", layout.regular_pyramid(count, given[0])


def _greatest_volume(count: int) -> tuple[str, np.ndarray]:
    if count < 6:
        regular = layout.regular_pyramid(count, angles.GREATEST_VOLUME_DEG)
        return f"gamma {angles.GREATEST_VOLUME_DEG:.1f}", regular
    if count == 6:
        return "icosahedral", layout.icosahedral()
    return "by search", search.greatest_volume(count).axes


def _layouts(design: WheelDesign, array: WheelArray, inertia, growth, others) -> list[dict]:
    demand, rows = design.demand.momentum_n_m_s, []
    box = None if demand is None else Box(np.array(demand))
    for name, label, axes in others:
        other = array
        if name != "given":
            limit = float(array.momentum_limits()[0])
            other = WheelArray(axes=tuple(map(tuple, axes.tolist())), momentum_limit_n_m_s=limit)
        envelope = momentum_envelope(other)
        works = axes[other.momentum_limits() > 0.0]
        reached = envelope.rank == 3
        rows.append(
            {
                "name": name,
                "angles": label,
                "axes": axes.tolist(),
                "volume_n3_m3_s3": envelope.volume,
                "worst_rate_deg_s": math.degrees(worst_case(envelope, inertia).rate),
                "norm_n_m_s": greatest_norm(works, box) if box and reached else None,
                "wheel_n_m_s": greatest_momentum(works, box) if box and reached else None,
                **{f"saturation_{m}_h": saturation_h(other, growth, m) for m in METHODS},
            }
        )
    return rows


def _accumulation(array: WheelArray, growth: Growth) -> dict:
    held = growth.held
    mean = held.torque_n_m.mean(axis=0)
    gain = growth.gain_n_m_s * _DAY / held.period_s
    along = float(gain @ held.normal)
    return {
        "period_min": held.period_s / 60.0,
        "mean_torque_n_m": mean.tolist(),
        "along_normal_n_m_s_per_day": along,
        "across_normal_n_m_s_per_day": float(np.linalg.norm(gain - along * held.normal)),
        "cyclic_n_m_s": _by_axis(cyclic_bounds(mean, held.normal, held.rate_rad_s)),
        **{f"saturation_{m}_h": saturation_h(array, growth, m) for m in METHODS},
    }
