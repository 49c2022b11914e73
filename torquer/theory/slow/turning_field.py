"""How long B-dot takes to stop a tumbling body in a field that turns: times of many releases.

The mean over directions of `detumbling` leaves out that rotation about the field is braked only as
the field turns, and is too short where a body stops within a part of an orbit. Here each release
has its momentum L, that of the rate w0 about a random axis of the body. B-dot damps nutation first:
most of the time the body turns about the axis of its greatest moment J, with w = L/J. Then

  J dw/dt = -duty E(w) / |sinc(w d/2)| f(k |u| B |sinc(w d/2)|) B u/|u|,

u the part of w - w_B across the field B(t), w_B the rate at which the field's direction turns; f,
E and d as in `detumbling`.
"""

import math

import numpy as np

from torquer.theory.slow.detumbling import Tumbling, mean_dipole_a_m2
from torquer.theory.slow.gains import damping_efficiency

#: Sizes of dipoles, over the limit of a coil, between which their means are interpolated.
_SIZES = np.geomspace(1e-3, 1e5, 600)
_SEED = 1


def releases_stop_s(
    case: Tumbling,
    gain: float,
    b_inertial_t,
    step_s: float,
    moments_kg_m2,
    from_rad_s: float,
    below_rad_s: float,
    releases: int = 256,
) -> np.ndarray:
    """Times [s] (releases,) from which releases stay below a rate; infinite beyond the fields.

    `gain` [A m^2 s/T]; `b_inertial_t` [n, 3]: fields along the orbit at steps [s], of which the
    first half has the starts; `moments_kg_m2`: principal moments. Times are whole steps.
    """
    if not 0.0 < below_rad_s < from_rad_s < math.inf:
        raise ValueError(
            f"below_rad_s: must be positive and below from_rad_s; received {below_rad_s:g}"
        )
    b = np.asarray(b_inertial_t, dtype=np.float64)
    if b.ndim != 2 or b.shape[1:] != (3,) or len(b) < 4:
        raise ValueError(f"b_inertial_t: must be 4 or more rows of 3; received shape {b.shape}")
    strength = np.linalg.norm(b, axis=1)
    along = b / strength[:, None]
    turning = np.cross(along[:-1], np.diff(along, axis=0)) / step_s
    random = np.random.default_rng(_SEED)
    starts, moments = random.integers(0, len(b) // 2, releases), np.asarray(moments_kg_m2)
    w = _first_rates(random, releases, moments, from_rad_s)
    dipoles = _mean_dipoles(case)
    stopped_s = np.full(releases, np.inf)
    for step in range(len(b) // 2 - 1):
        at = starts + step
        slowed = _slowed(
            case, gain, dipoles, w, along[at], strength[at], turning[at], moments.max(), step_s
        )
        w, is_below = slowed, np.linalg.norm(slowed, axis=1) < below_rad_s
        stopped_s = np.where(is_below, np.minimum(stopped_s, (step + 1) * step_s), np.inf)
        if is_below.all() and (step + 1) * step_s > 2.0 * stopped_s.max():
            break
    return stopped_s


def _first_rates(random, releases: int, moments, rate_rad_s: float) -> np.ndarray:
    """Rates [rad/s] (releases, 3) about the axis of the greatest moment, along the momentum."""
    in_space, in_body = (_directions(random, releases) for _ in range(2))
    momentum = rate_rad_s * np.linalg.norm(in_body * moments, axis=1)
    return in_space * (momentum / moments.max())[:, None]


def _directions(random, count: int) -> np.ndarray:
    found = random.normal(size=(count, 3))
    return found / np.linalg.norm(found, axis=1)[:, None]


def _slowed(
    case: Tumbling, gain, dipoles, w, along, strength, turning, inertia, step_s
) -> np.ndarray:
    """The rates after a step; a part that decays within it decays exponentially."""
    relative = w - turning
    across = relative - np.sum(relative * along, axis=1)[:, None] * along
    size, rate = np.linalg.norm(across, axis=1), np.linalg.norm(w, axis=1)
    read = np.abs(np.sinc(rate * case.sampling.difference_s / (2.0 * math.pi)))
    efficiency = damping_efficiency(rate, *case.sampling.times) / np.maximum(read, 1e-9)
    dipole = _mean_dipole(case, dipoles, gain * size * strength * read)
    decay = case.duty * efficiency * dipole * strength / inertia * step_s / np.maximum(size, 1e-12)
    return w + np.expm1(-decay)[:, None] * across


def _mean_dipoles(case: Tumbling) -> tuple[np.ndarray, np.ndarray]:
    """Sizes of commands, and the mean dipoles along them."""
    sizes = _SIZES * float(case.coils.limits_a_m2().min())
    return sizes, mean_dipole_a_m2(case.coils, sizes)


def _mean_dipole(case: Tumbling, dipoles, commanded) -> np.ndarray:
    """Mean dipole along commands; below the limits it is proportional to them."""
    sizes, means = dipoles
    found = np.interp(commanded, sizes, means)
    if case.coils.saturation == "relay":
        return found
    return np.where(commanded < sizes[0], commanded * means[0] / sizes[0], found)
