"""Slow motion under sampled B-dot as a map from command to command: the greatest stable gain.

A body turns slowly about an axis normal to the field: its rate w, the coils' torque over the
inertia -mu, and the rate v that the law has measured. The command asks for mu = kappa v, with
kappa = k B^2 / J [1/s]; it is held for a, then the coils are off for a measurement window, if there
is one; mu follows with the lag tau. The law measures the mean of w over the last d, or w itself
where it takes no difference (d = 0).
"""

import math

import numpy as np


def cycle_map(kappa_per_s: float, difference_s, hold_s, lag_s, off_s) -> np.ndarray:
    """Matrix `[3, 3]` that takes (w, mu, v) at a command to the next one."""
    times = difference_s, hold_s, lag_s, off_s
    return np.column_stack([_cycle(*unit, kappa_per_s, *times) for unit in np.eye(3)])


def _cycle(w, mu, v, kappa, difference_s, hold_s, lag_s, off_s):
    """(w, mu, v) after a hold, and after the window in which the coils are off."""
    left, lost, lost_angle = _follow(hold_s, lag_s)
    command = kappa * v
    way = mu - command
    angle = w * hold_s - 0.5 * command * hold_s**2 - way * lost_angle
    w, mu = w - command * hold_s - way * lost, command + way * left
    if off_s > 0.0:
        left, lost, lost_angle = _follow(off_s, lag_s)
        angle = w * difference_s - mu * (lost_angle - _follow(off_s - difference_s, lag_s)[2])
        w, mu = w - mu * lost, mu * left
    return w, mu, angle / difference_s if difference_s > 0.0 else w


def _follow(t_s: float, lag_s: float) -> tuple[float, float, float]:
    """exp(-t/lag), its integral over t, and that one's integral."""
    if lag_s == 0.0:
        return 0.0, 0.0, 0.0
    x = t_s / lag_s
    gone = -lag_s * math.expm1(-x)
    if x > 0.1:
        return math.exp(-x), gone, lag_s * (t_s - gone)
    series = 1.0  # of (x - 1 + exp(-x)) / (x^2/2), where the difference would cancel
    for n in range(11, 2, -1):
        series = 1.0 - x / n * series
    return math.exp(-x), gone, 0.5 * t_s**2 * series


def greatest_step(difference_s: float, hold_s: float, lag_s: float, off_s: float) -> float:
    """Least kappa a at which the map has a multiplier on the unit circle; the map is stable below.

    The map is linear in kappa through one input, so its characteristic polynomial
    z^3 + c2 z^2 + c1 z + c0 is, too, and one root goes to infinity with kappa. By Jury's conditions
    the circle is left where first -1 is a root, c0 is 1 or -1, or two roots have the product 1.
    """
    times = difference_s, hold_s, lag_s, off_s
    c2, c1, c0 = _polynomial(cycle_map(0.0, *times))
    e2, e1, e0 = _polynomial(cycle_map(1.0 / hold_s, *times))
    d2, d1, d0 = e2 - c2, e1 - c1, e0 - c0
    quadratic = d0 * (d2 - d0), d0 * c2 + c0 * d2 - 2.0 * c0 * d0 - d1, 1.0 - c1 + c0 * (c2 - c0)
    found = [
        *_positive_roots(0.0, d1 - d2 - d0, 1.0 - c2 + c1 - c0),
        *_positive_roots(0.0, d0, c0 + 1.0),
        *_positive_roots(0.0, -d0, 1.0 - c0),
        *_positive_roots(*quadratic),
    ]
    part = min(found)
    radius = np.abs(np.linalg.eigvals(cycle_map(part / hold_s, *times))).max()
    # a double multiplier moves by the root of the rounding error, which grows for short holds
    if not abs(radius - 1.0) < 1e-7 + 1e-11 * lag_s / hold_s:
        raise ArithmeticError(f"slow loop: multipliers must be within the circle; one is {radius}")
    return part


def _polynomial(matrix) -> tuple[float, float, float]:
    """c2, c1, c0 of the characteristic polynomial of a matrix `[3, 3]`."""
    trace, square = float(np.trace(matrix)), float(np.trace(matrix @ matrix))
    return -trace, 0.5 * (trace**2 - square), -float(np.linalg.det(matrix))


def _positive_roots(a: float, b: float, c: float) -> list[float]:
    """Positive roots of a x^2 + b x + c, without cancellation."""
    inside = b * b - 4.0 * a * c
    if inside < 0.0:
        return []
    half = -0.5 * (b + math.copysign(math.sqrt(inside), b))
    pairs = ((half, a), (c, half))
    return [top / low for top, low in pairs if top * low > 0.0]
