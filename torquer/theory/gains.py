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
    w = np.asarray(rate_rad_s, dtype=np.float64)
    half_d, half_a = 0.5 * difference_s, 0.5 * hold_s
    return (
        np.sinc(w * half_d / math.pi) * np.sinc(w * half_a / math.pi) * np.cos(w * (half_d + half_a))
    )


def sampling_limit_rad_s(difference_s: float, hold_s: float) -> float:
    """Greatest rate [rad/s] that sampled B-dot still brakes: pi / (difference + hold)."""
    if not (difference_s > 0.0 and hold_s >= 0.0):
        raise ValueError(
            "difference_s and hold_s: must be positive, hold_s may be 0; "
            f"received {difference_s}, {hold_s}"
        )
    return math.pi / (difference_s + hold_s)


def damped_share(inclination_rad: float) -> tuple[float, float, float]:
    """Share of the rate that an orbit lets B-dot brake: least, mean and greatest direction.

    Over an orbit the averaged field leaves the share 1 - beta = 1 - <(b.l)^2> of a rotation
    along l open to braking: 2p along the cone axis, 1 - p across it, 2/3 on the mean of all
    directions (p = sin^2(Theta)/2).
    """
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
    for name, value in (
        ("damping_time_s", damping_time_s),
        ("inertia_kg_m2", inertia_kg_m2),
        ("field_t", field_t),
        ("share", share),
        ("duty", duty),
    ):
        if not value > 0.0:
            raise ValueError(f"{name}: must be positive; received {value}")
    return inertia_kg_m2 / (damping_time_s * field_t**2 * share * duty)


def bdot_greatest_gain(least_inertia_kg_m2: float, greatest_field_t: float, hold_s: float) -> float:
    """Gain [A m^2 s/T] above which one hold overshoots so far that slow motion grows: 2 J/(B^2 a).

    One hold changes the rate by the part k B^2 a / J of itself; a part beyond 2 is unstable, of
    a sampled loop with and without a measurement window alike. Stay well below, at a half say.
    """
    return 2.0 * least_inertia_kg_m2 / (greatest_field_t**2 * hold_s)


def saturated_damping_time_s(
    momentum_n_m_s: float, limit_a_m2: float, field_t: float, duty: float = 1.0
) -> float:
    """Time [s] to brake a momentum with coils at their limit: L / (m B duty), a lower bound."""
    return momentum_n_m_s / (limit_a_m2 * field_t * duty)
