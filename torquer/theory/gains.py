"""Choosing the gain of B-dot: from the damping time, and within what the sampling allows.

Sampled B-dot takes the difference of two readings `difference_s` apart, ending when the coils
are switched on, and holds the dipole for `hold_s`. For a body that turns at the rate w normal
to the field, the mean braking is that of the ideal law times

  sinc(w d/2) sinc(w a/2) cos(w (d + a)/2),   d = difference_s, a = hold_s, sinc x = sin x / x:

the difference is old by d/2 on average, and the dipole is old by another a/2 when it acts.
Above w = pi/(d + a) the sign turns, and the law drives the rotation.
"""

import math

import numpy as np

from torquer.environment.field.averaged import cone_angle


def damping_efficiency(rate_rad_s, difference_s: float, hold_s: float):
    """Braking of sampled B-dot over that of the ideal law, at rates [rad/s]; below 0: driving."""
    _check_windows(difference_s, hold_s)
    w = np.asarray(rate_rad_s, dtype=np.float64)
    turn_d, turn_a = 0.5 * w * difference_s, 0.5 * w * hold_s
    return np.sinc(turn_d / math.pi) * np.sinc(turn_a / math.pi) * np.cos(turn_d + turn_a)


def sampling_limit_rad_s(difference_s: float, hold_s: float) -> float:
    """Greatest rate [rad/s] that sampled B-dot still brakes: pi / (difference + hold)."""
    _check_windows(difference_s, hold_s)
    return math.pi / (difference_s + hold_s)


def _check_windows(difference_s: float, hold_s: float) -> None:
    _positive(difference_s=difference_s)
    if not 0.0 <= hold_s < math.inf:
        raise ValueError(f"hold_s: must be 0 or positive; received {hold_s}")


def _positive(**values: float) -> None:
    for name, value in values.items():
        if not 0.0 < value < math.inf:
            raise ValueError(f"{name}: must be positive and finite; received {value}")


def damped_share(inclination_rad: float) -> tuple[float, float, float]:
    """Share of the rate that an orbit lets B-dot brake: least, mean and greatest direction.

    Over an orbit the averaged field leaves the share 1 - beta = 1 - <(b.l)^2> of a rotation
    along l open to braking: 2p along the cone axis, 1 - p across it, 2/3 on the mean of all
    directions (p = sin^2(Theta)/2).
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
    """
    _positive(damping_time_s=damping_time_s, inertia_kg_m2=inertia_kg_m2, field_t=field_t)
    for name, part in (("share", share), ("duty", duty)):
        if not 0.0 < part <= 1.0:
            raise ValueError(f"{name}: must be above 0 and at most 1; received {part}")
    return inertia_kg_m2 / (damping_time_s * field_t**2 * share * duty)


def bdot_greatest_gain(least_inertia_kg_m2: float, greatest_field_t: float, hold_s: float) -> float:
    """Gain [A m^2 s/T] above which one hold overshoots so far that slow motion grows: 2 J/(B^2 a).

    One hold changes the rate by the part k B^2 a / J of itself; a part beyond 2 is unstable, of
    a sampled loop with and without a measurement window alike. Stay well below, at a half say.
    """
    _positive(
        least_inertia_kg_m2=least_inertia_kg_m2, greatest_field_t=greatest_field_t, hold_s=hold_s
    )
    return 2.0 * least_inertia_kg_m2 / (greatest_field_t**2 * hold_s)


def saturated_damping_time_s(
    momentum_n_m_s: float, limit_a_m2: float, field_t: float, duty: float = 1.0
) -> float:
    """Time [s] to brake a momentum with coils at their limit: L / (m B duty), a lower bound."""
    _positive(momentum_n_m_s=momentum_n_m_s, limit_a_m2=limit_a_m2, field_t=field_t, duty=duty)
    return momentum_n_m_s / (limit_a_m2 * field_t * duty)
