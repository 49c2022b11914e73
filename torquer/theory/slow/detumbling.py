"""How long B-dot takes to stop a tumbling body with coils that saturate: means over directions.

A body that turns at the rate w, about an axis at the angle a to the field B, is commanded the
dipole M = k w B sin(a) |sinc(w d/2)| across the field, d the interval of the readings. Its coils
give the mean dipole f(M) along that direction over all directions in the body: f(M) = M below the
limits. Hold, age of the readings and lag leave the part E / |sinc(w d/2)| of it in phase with the
field's change (`gains.damping_efficiency`). So

  J dw/dt = -duty E(w) / |sinc(w d/2)| <f(M) B sin(a)>,

with the mean over directions of the rotation and fields along the orbit, J the mean principal
moment. This is a mean for gains below `turning_gain`: rotation about the field is not braked, and
beyond that gain it outlasts the rest. Nor does it hold near twice the orbital rate, at which the
field itself turns: B-dot leaves that rate.
"""

import math
from typing import NamedTuple

import numpy as np

from torquer.spacecraft.actuators.coils import Coils
from torquer.theory.slow.gain_and_time import even_directions
from torquer.theory.slow.gains import Sampling, damping_efficiency
from torquer.theory.validity import Limit

_DIRECTIONS, _ANGLES, _RATES = 60, 12, 80
#: Of the direction that is braked least, over the mean of all.
EVENLY_BRAKED = Limit(
    "braking about the field's mean direction, over the mean of all", 0.5,
    why="the field hardly turns along the orbit, and rotation about it is hardly braked",
    of="time of B-dot to stop a tumbling body",
    shown="gain 1e3, moments 0.01, 0.01, 0.02, 1.5 deg/s at 500 km: 7, 6, 2, 0 of 8 flights have "
    "not stopped after 48 h at 0, 5, 15, 97.5 deg, for 16, 16, 15, 8 h by the formula",
)  # fmt: skip
#: Of a rate that counts as stopped.
ABOVE_TURNING = Limit(
    "rate that counts as stopped, over the field's mean turning along the orbit", 1.0,
    why="B-dot brakes relative to the field, and keeps the rate near the field's turning",
    of="time of B-dot to stop a tumbling body",
    shown="gain 3e4, moments 0.05, 0.04, 0.03 at 500 km, 0 to 97 deg, with and without gravity "
    "gradient: from the ninth revolution on the mean rate is 0.94 to 3.1 of the field's",
)  # fmt: skip
#: Gains between which the knee is looked for, over the one that just saturates the coils.
_LOWEST, _HIGHEST = 1e-4, 1e4


class Tumbling(NamedTuple):
    """A tumbling satellite: mean principal moment, strengths of the field along its orbit (n,),
    coils, timing of the law, and the part of the time in which the coils are on."""

    inertia_kg_m2: float
    fields_t: np.ndarray
    coils: Coils
    sampling: Sampling
    duty: float = 1.0


def least_braked(b_inertial_t) -> float:
    """Braking about the direction braked least over the mean of all; fields `[n, 3]` of an orbit.

    Of a rotation about l, B-dot brakes the part 1 - <(b.l)^2>: two thirds in the mean.
    """
    b = np.asarray(b_inertial_t) / np.linalg.norm(b_inertial_t, axis=1)[:, None]
    return 1.5 * float(1.0 - np.linalg.eigvalsh(b.T @ b / len(b))[-1])


def mean_turning_rad_s(b_inertial_t, step_s: float) -> float:
    """Mean rate [rad/s] at which the field's direction turns; fields `[n, 3]` at equal steps."""
    b = np.asarray(b_inertial_t) / np.linalg.norm(b_inertial_t, axis=1)[:, None]
    chords = np.linalg.norm(np.diff(b, axis=0), axis=1)
    return float(np.mean(2.0 * np.arcsin(0.5 * chords))) / step_s


def mean_dipole_a_m2(coils: Coils, commanded_a_m2) -> np.ndarray:
    """Mean dipole [A m^2] of the coils along commands of given sizes, over their directions."""
    rho, sigma = np.array(even_directions(_DIRECTIONS)).T
    along = np.stack([np.sin(rho) * np.cos(sigma), np.sin(rho) * np.sin(sigma), np.cos(rho)])
    axes, limits = np.array(coils.axes), coils.limits_a_m2()[:, None]
    shares, polarity = np.linalg.pinv(axes.T) @ along, np.ones((len(axes), 1))
    if coils.polarity is not None:
        polarity[:, 0] = coils.polarity
    given = polarity * (axes @ along)  # of each coil along the command, per A m^2
    sizes = np.atleast_1d(np.asarray(commanded_a_m2, dtype=np.float64))[:, None, None]
    dipoles = sizes * shares
    if coils.saturation == "relay":
        dipoles = limits * np.sign(np.where(np.abs(shares) > 1e-12, dipoles, 0.0))
    elif coils.saturation == "clip":
        dipoles = np.clip(dipoles, -limits, limits)
    else:
        dipoles = dipoles / np.maximum(np.max(np.abs(dipoles) / limits, axis=1), 1.0)[:, None]
    return (dipoles * given).sum(axis=1).mean(axis=1)


def braking_torque_n_m(case: Tumbling, gain: float, rates_rad_s) -> np.ndarray:
    """Mean torque [N m] against rotation at rates [rad/s] (r,), with a gain [A m^2 s/T].

    Negative where the law spins the body up.
    """
    w = np.atleast_1d(np.asarray(rates_rad_s, dtype=np.float64))
    nodes, weights = np.polynomial.legendre.leggauss(_ANGLES)
    sines = np.sqrt(1.0 - (0.5 * (nodes + 1.0)) ** 2)
    read = np.abs(np.sinc(w * case.sampling.difference_s / (2.0 * math.pi)))
    across = np.multiply.outer(np.asarray(case.fields_t), sines)
    commands = gain * np.multiply.outer(w * read, across)
    # below the limits the mean is proportional: one interpolation serves all sizes
    sizes = np.geomspace(1e-3, 1e5, 600) * float(case.coils.limits_a_m2().min())
    means = mean_dipole_a_m2(case.coils, sizes)
    found = np.interp(commands, sizes, means)
    if case.coils.saturation != "relay":
        small = commands < sizes[0]
        found[small] = commands[small] * means[0] / sizes[0]
    power = (found * across) @ (0.5 * weights)
    efficiency = damping_efficiency(w, *case.sampling.times) / np.where(read > 0.0, read, np.inf)
    return case.duty * efficiency * power.mean(axis=1)


def detumbling_time_s(case: Tumbling, gain: float, from_rad_s: float, below_rad_s: float) -> float:
    """Time [s] from one rate to a lower one; infinite where the law does not brake on the way."""
    if not 0.0 < below_rad_s < math.inf:
        raise ValueError(f"below_rad_s: must be positive and finite; received {below_rad_s}")
    if not 0.0 < gain < math.inf:
        raise ValueError(f"gain: must be positive and finite; received {gain}")
    if from_rad_s <= below_rad_s:
        return 0.0
    w = np.geomspace(below_rad_s, from_rad_s, _RATES)
    torque = braking_torque_n_m(case, gain, w)
    if not (torque > 0.0).all():
        return math.inf
    return float(case.inertia_kg_m2 * np.trapezoid(w / torque, np.log(w)))


def turning_gain(
    least_inertia_kg_m2: float,
    field_t: float,
    orbital_rate_rad_s: float,
    inclination_rad: float,
    duty: float = 1.0,
) -> float:
    """Gain [A m^2 s/T] that brakes about as fast as the field turns: 2 n (1 + sin i) J/(B^2 duty).

    A greater gain stops the rotation across the field sooner, and that about the field later: it
    is braked only as the field turns away from it. `field_t`: root mean square along the orbit.
    After G. Avanzini, F. Giulietti, J. Guidance, Control, and Dynamics 35(4), 2012, with the
    geographic inclination.
    """
    turning = 2.0 * orbital_rate_rad_s * (1.0 + math.sin(inclination_rad))
    return turning * least_inertia_kg_m2 / (field_t**2 * duty)


def knee_gain(case: Tumbling, from_rad_s: float, below_rad_s: float, over: float = 0.1) -> float:
    """Gain [A m^2 s/T] with which the time exceeds that of coils always at their limits by a part.

    A greater gain hardly saves time. `over`: that part. ValueError where no gain brakes.
    """
    from scipy.optimize import brentq  # for those who look for a gain

    limit, field = float(case.coils.limits_a_m2().min()), float(np.mean(case.fields_t))
    saturating = limit / (field * below_rad_s)
    least = detumbling_time_s(case, _HIGHEST * saturating, from_rad_s, below_rad_s)
    if not 0.0 < least < math.inf:
        raise ValueError(
            "from_rad_s: must be above below_rad_s and at rates that B-dot brakes; received "
            f"{from_rad_s:g}"
        )

    def excess(log_gain: float) -> float:
        time_s = detumbling_time_s(case, math.exp(log_gain), from_rad_s, below_rad_s)
        return math.log(time_s / (least * (1.0 + over)))

    ends = (math.log(part * saturating) for part in (_LOWEST, _HIGHEST))
    return math.exp(brentq(excess, *ends, xtol=1e-4))
