"""Choosing the gain of B-dot: from the damping time, and within what sampling and lag allow.

Sampled B-dot takes the difference of two readings `difference_s` apart, ending when the coils
are switched on, and holds the command for `hold_s`; the coils follow with a first-order lag. For
a sphere that turns at the rate w the mean braking is that of the ideal law times the real part of

  G(w) = sinc(w d/2) sinc(w a/2) exp(-i w (d + a)/2) / (1 + i w lag),   sinc x = sin x / x,

with d = difference_s, a = hold_s: the difference lags by d/2 on average, the held command by
another a/2, and the coils lag behind it. Readings that are D old when the command is given
(`delay_s`) multiply G by exp(-i w D). The dipole that remains after the hold, in a measurement
window or in the next hold, is included: E = Re G does not depend on the cycle. It changes sign
where w ((d + a)/2 + D) + atan(w lag) = pi/2; above, the law spins the satellite up. d = 0 stands
for the forms that take no difference (gyro, search coil, field model).

Coils that are switched give each command in pulses. A pulse that fills its period acts as the held
command does. The centre of a short one stands `pulse_s` after the middle of the period, half a
period before it at the most and half a period after it: that much is added to D.
"""

import math
from typing import NamedTuple

import numpy as np

from torquer.environment.field.averaged import cone_angle
from torquer.theory.slow.slow_loop import greatest_step

#: Greatest lag over hold for which the map of a cycle is not lost in rounding.
MOST_LAG = 1e9


class Sampling(NamedTuple):
    """Timing [s] of a sampled law: difference (0: none), hold, lag of the coils, coils off.

    `delay_s`: age of the newest reading when the command is given. `pulse_s`: how much later than
    in the middle of its period a short pulse of switched coils acts; negative: earlier.
    """

    difference_s: float
    hold_s: float
    lag_s: float = 0.0
    measure_s: float = 0.0
    delay_s: float = 0.0
    pulse_s: float = 0.0

    @property
    def limits_rad_s(self) -> tuple[float, float]:
        """Greatest rates [rad/s] that are still damped: without pulses, and by short ones."""
        pulsed = self.hold_s + 2.0 * self.pulse_s  # half a hold is its delay
        both = ((each, self.lag_s, self.delay_s) for each in (self.hold_s, max(pulsed, 0.0)))
        whole, short = (sampling_limit_rad_s(self.difference_s, *each) for each in both)
        return whole, short

    @property
    def limit_rad_s(self) -> float:
        """The lesser of both: up to it every command damps."""
        return min(self.limits_rad_s)

    @property
    def times(self) -> tuple[float, float, float, float]:
        """Difference, hold, lag, delay: what the efficiency and the limit depend on."""
        return self.difference_s, self.hold_s, self.lag_s, self.delay_s

    @property
    def is_in_step(self) -> bool:
        """Whether readings are taken at control steps: then `bdot_greatest_gain` knows the case."""
        if self.delay_s > 0.0:
            return False
        if self.measure_s > 0.0:
            return self.difference_s <= self.measure_s
        return self.difference_s in (0.0, self.hold_s)

    @property
    def in_words(self) -> str:
        """In words: differences over 3 s held for 3 s by coils with a lag of 0.5 s."""
        taken = f"differences over {self.difference_s:g} s" if self.difference_s else "readings"
        late = f" by coils with a lag of {self.lag_s:g} s" if self.lag_s else ""
        old = f", {self.delay_s:g} s old," if self.delay_s else ""
        at_end = " in pulses at the end of each period" if self.pulse_s > 0.0 else ""
        return f"{taken}{old} held for {self.hold_s:g} s{late}{at_end}"


def damping_efficiency(
    rate_rad_s, difference_s: float, hold_s: float, lag_s: float = 0.0, delay_s: float = 0.0
):
    """Damping by sampled B-dot over that by the ideal law, at rates [rad/s]; negative: spin-up."""
    _check_times(difference_s=difference_s, hold_s=hold_s, lag_s=lag_s, delay_s=delay_s)
    w = np.asarray(rate_rad_s, dtype=np.float64)
    turn_d, turn_a, late = 0.5 * w * difference_s, 0.5 * w * hold_s, w * lag_s
    turn = turn_d + turn_a + w * delay_s
    in_phase = np.cos(turn) - late * np.sin(turn)
    return np.sinc(turn_d / math.pi) * np.sinc(turn_a / math.pi) * in_phase / (1.0 + late**2)


def sampling_limit_rad_s(
    difference_s: float, hold_s: float, lag_s: float = 0.0, delay_s: float = 0.0
) -> float:
    """Greatest rate [rad/s] that sampled B-dot still damps; without lag pi/(d + a + 2 delay).

    Infinite where d + a = 0 without a delay.

        >>> import math
        >>> limit_rad_s = torquer.sampling_limit_rad_s(difference_s=3.0, hold_s=3.0)
        >>> round(math.degrees(limit_rad_s), 9)
        30.0
    """
    return _turn_rate(0.5 * math.pi, difference_s, hold_s, lag_s, delay_s)


def driven_rate_rad_s(
    difference_s: float, hold_s: float, lag_s: float = 0.0, delay_s: float = 0.0
) -> float:
    """Rate [rad/s] to which sampled B-dot spins up one above its limit: E changes sign again."""
    longest = max(difference_s, hold_s)
    aliased = 2.0 * math.pi / longest if longest > 0.0 else math.inf
    return min(aliased, _turn_rate(1.5 * math.pi, difference_s, hold_s, lag_s, delay_s))


def _turn_rate(
    turn: float, difference_s: float, hold_s: float, lag_s: float, delay_s: float
) -> float:
    """Root w of w ((d + a)/2 + D) + atan(w lag) = turn, by Newton's method from the left
    (concave)."""
    _check_times(difference_s=difference_s, hold_s=hold_s, lag_s=lag_s, delay_s=delay_s)
    half = 0.5 * (difference_s + hold_s) + delay_s
    if half == 0.0:
        return math.inf
    w = turn / (half + lag_s)
    for _ in range(100):
        short = (turn - 0.5 * math.pi) + math.atan2(1.0, w * lag_s) - w * half
        step = short / (half + lag_s / (1.0 + (w * lag_s) ** 2))
        w += step
        if abs(step) <= 4e-16 * w:
            return w
    raise ArithmeticError(f"sampling limit: Newton's steps must end; the last one was {step:g}")


def _check_times(**values: float) -> None:
    for name, value in values.items():
        if not 0.0 <= value < math.inf:
            raise ValueError(f"{name}: must be 0 or positive; received {value}")


def _positive(**values: float) -> None:
    for name, value in values.items():
        if not 0.0 < value < math.inf:
            raise ValueError(f"{name}: must be positive and finite; received {value}")


def damped_share(inclination_rad: float) -> tuple[float, float, float]:
    """Fraction of the rate that B-dot can damp on an orbit: least, mean and greatest by direction.

    Of a rotation about l, B-dot in the averaged field damps the fraction 1 - <(b.l)^2>: 2p about
    the cone axis, 1 - p across it, 2/3 in the mean over all directions (p = sin^2(Theta)/2).
    """
    if not 0.0 <= inclination_rad <= math.pi:
        raise ValueError(f"inclination_rad: must lie within 0..pi; received {inclination_rad}")
    p = 0.5 * math.sin(cone_angle(inclination_rad)) ** 2
    along, across = 2.0 * p, 1.0 - p
    return min(along, across), 2.0 / 3.0, max(along, across)


def bdot_gain(
    damping_time_s: float,
    inertia_kg_m2: float,
    field_t: float,
    *,
    share: float = 2.0 / 3.0,
    duty: float = 1.0,
) -> float:
    """Gain k [A m^2 s/T] that damps the rate e-fold in `damping_time_s`, away from saturation.

    k = J / (T B^2 share duty): `share` from `damped_share`, `duty` = actuation over cycle.

        >>> gain = torquer.bdot_gain(damping_time_s=5700.0, inertia_kg_m2=0.03, field_t=3e-5)
        >>> f"{gain:.0f}"
        '8772'
    """
    _positive(damping_time_s=damping_time_s, inertia_kg_m2=inertia_kg_m2, field_t=field_t)
    for name, part in (("share", share), ("duty", duty)):
        if not 0.0 < part <= 1.0:
            raise ValueError(f"{name}: must be above 0 and at most 1; received {part}")
    return inertia_kg_m2 / (damping_time_s * field_t**2 * share * duty)


def bdot_greatest_gain(
    least_inertia_kg_m2: float,
    greatest_field_t: float,
    hold_s: float,
    *,
    difference_s: float | None = None,
    lag_s: float = 0.0,
    measure_s: float = 0.0,
) -> float:
    """Gain [A m^2 s/T] above which slow motion is unstable: hold and lag make it overshoot.

    One hold changes the rate by the fraction k B^2 a / J. Without lag a fraction of 2 is the
    limit, with and without a measurement window alike; with lag the limit is that of the map of a
    cycle (`slow_loop`). `difference_s`: hold_s unless given, 0 for laws that take no difference;
    `measure_s`: window in which the coils are off. Stay well below, at half of it for instance.

        >>> torquer.bdot_greatest_gain(least_inertia_kg_m2=0.01, greatest_field_t=5e-5, hold_s=1.0)
        8000000.0
    """
    _positive(
        least_inertia_kg_m2=least_inertia_kg_m2, greatest_field_t=greatest_field_t, hold_s=hold_s
    )
    difference_s = hold_s if difference_s is None else difference_s
    _check_times(difference_s=difference_s, lag_s=lag_s, measure_s=measure_s)
    if measure_s > 0.0 and difference_s > measure_s:
        raise ValueError(f"difference_s: must not exceed measure_s; received {difference_s}")
    if measure_s == 0.0 and difference_s not in (0.0, hold_s):
        raise ValueError(f"difference_s: must be 0 or hold_s here; received {difference_s}")
    if lag_s > MOST_LAG * hold_s:
        raise ValueError(f"lag_s: must be at most {MOST_LAG:g} times hold_s; received {lag_s}")
    part = greatest_step(difference_s, hold_s, lag_s, measure_s)
    return part * least_inertia_kg_m2 / (greatest_field_t**2 * hold_s)


def saturated_damping_time_s(
    momentum_n_m_s: float, limit_a_m2: float, field_t: float, duty: float = 1.0
) -> float:
    """Time [s] to remove a momentum with saturated coils: L / (m B duty), a lower bound."""
    _positive(momentum_n_m_s=momentum_n_m_s, limit_a_m2=limit_a_m2, field_t=field_t, duty=duty)
    return momentum_n_m_s / (limit_a_m2 * field_t * duty)
