"""Numerical averaging of any control law over the fast angles psi, phi, u (and the Earth's day).

The law is the very kernel that the simulation runs, handed over as a first-class function. It is
given exact measurements: field, its rate of change, angular rate, attitude, the Sun (always seen);
its models of field and Sun are exact, too. Coils do not saturate or lag. The trapezoid rule is
exact for trigonometric polynomials of a degree below the number of nodes: for every law that is a
polynomial in field, rate and direction cosines. For others the error is seen by taking more nodes
(`converged_nodes`).

Laws with memory cannot be averaged (a difference of two readings is no function of independent
angles: use the form with the rate or the field's derivative), nor laws that use the position.
"""

import math
from typing import NamedTuple

import numpy as np

from torquer.compile.engine import inlined, kernel
from torquer.computer.blocks.law import Law
from torquer.computer.inputs import ideal_inputs
from torquer.computer.interface import NO_UNITS_ISOLATED, NONE_ISOLATED, Ephemeris, Estimate
from torquer.maths.geometry.quaternion import multiply, rotate, rotate_inverse
from torquer.maths.geometry.vec3 import add, cross, norm, scale, sub
from torquer.maths.integrate.dop853 import rates_of
from torquer.theory.slow.evolution.model import Slow
from torquer.theory.slow.orbit_field import TILTED_DIPOLE, field_at, field_rate
from torquer.theory.slow.spinner import Spinner
from torquer.theory.validity import OFF_POLES, Limit, check_slow, within

NONE = (0.0, 0.0, 0.0)


class Nodes(NamedTuple):
    """Nodes of the quadrature: cos and sin of psi/2 and of phi/2 (rows), u, day angle."""

    half_psi: np.ndarray
    half_phi: np.ndarray
    u: np.ndarray
    day: np.ndarray


class AveragedMotion(NamedTuple):
    """The averaged motion under a law as a problem for DOP853, in u; state l, rho, sigma, theta."""

    law: object
    parameters: np.ndarray
    memory: np.ndarray
    setting: NamedTuple
    nodes: Nodes


@inlined
def inside(y):
    """Whether l, rho, sigma, theta are where averaged equations hold: l > 0, theta in 0..pi.

    Theta may exceed its range by a thousandth, as an integrator's stages do near its ends.
    """
    return y[0] > 0.0 and -1e-3 <= y[3] <= math.pi + 1e-3


@inlined
def l_to_reference(rho, sigma):
    """Quaternion L to the field's frame."""
    cs, ss = math.cos(0.5 * sigma), math.sin(0.5 * sigma)
    cr, sr = math.cos(0.5 * rho), math.sin(0.5 * rho)
    return (-ss * sr, cs * sr, ss * cr, cs * cr)


@inlined
def body_to_l(half_psi, half_theta, half_phi):
    """Quaternion body to L of (cos, sin) of the half angles."""
    turn = multiply((half_theta[1], 0.0, 0.0, half_theta[0]), (0.0, 0.0, half_phi[1], half_phi[0]))
    return multiply((0.0, 0.0, half_psi[1], half_psi[0]), turn)


@inlined
def exact_inputs(t_s, q, omega, models):
    """What a computer with perfect sensors knows, but for its place.

    `models`: field [T], its own rate of change [T/s], unit vector to the Sun (zeros: not seen),
    all in the field's frame.
    """
    b_reference, b_rate_reference, sun_reference = models
    b, sun = rotate_inverse(q, b_reference), rotate_inverse(q, sun_reference)
    b_rate = sub(rotate_inverse(q, b_rate_reference), cross(omega, b))
    estimate = Estimate(t_s, q, omega, NONE, math.nan, math.nan, NONE_ISOLATED, NO_UNITS_ISOLATED)
    unknown = (math.nan, math.nan, math.nan)
    ephemeris = Ephemeris(unknown, unknown, b_reference, b_rate_reference, sun_reference, 1.0)
    return ideal_inputs(b, b_rate, omega, sun, q, t_s, estimate, ephemeris)


@inlined
def commanded_dipole(law, parameters, memory, t_s, q, omega, models):
    """Field [T] and the law's dipole [A m^2] in the body frame; see `exact_inputs`."""
    inputs = exact_inputs(t_s, q, omega, models)
    return inputs.b_body_t, law(inputs, parameters, memory).dipole_a_m2


@inlined
def models_at(setting, u, day):
    """Field [T], its own rate of change [T/s] where it counts, the Sun: in the field's frame."""
    b, rate = field_at(setting.field, u, day), NONE
    if setting.field_turn != 0.0:
        by_u = field_rate(setting.field, u, day, setting.days_per_orbit)
        rate = scale(setting.orbital_rate, by_u)
    return b, rate, setting.sun


@inlined
def spin_rate(setting, momentum_body):
    """Angular rate [rad/s] of a momentum [N m s] in the body."""
    x, y, z = momentum_body
    return (x / setting.transverse, y / setting.transverse, z / setting.axial)


@inlined
def _sums_over_turns(problem, slow, q_l, t_s, models):
    """Sums over psi and phi of the torque in L and of its part that changes theta, at one u."""
    law, parameters, memory, setting, at = problem
    psi, phi = at.half_psi, at.half_phi
    half_theta = (math.cos(0.5 * slow.theta), math.sin(0.5 * slow.theta))
    momentum = (0.0, 0.0, setting.momentum * slow.l)
    torque, nutation = NONE, 0.0
    for j in range(psi.shape[0]):
        half_psi = (psi[j, 0], psi[j, 1])
        cos_psi = half_psi[0] * half_psi[0] - half_psi[1] * half_psi[1]
        sin_psi = 2.0 * half_psi[0] * half_psi[1]
        for i in range(phi.shape[0]):
            q_body = body_to_l(half_psi, half_theta, (phi[i, 0], phi[i, 1]))
            omega = spin_rate(setting, rotate_inverse(q_body, momentum))
            q = multiply(q_l, q_body)
            b, m = commanded_dipole(law, parameters, memory, t_s, q, omega, models)
            turning = rotate(q_body, cross(m, b))
            torque = add(torque, turning)
            nutation += turning[1] * cos_psi - turning[0] * sin_psi
    return torque, nutation


@kernel
def mean_rates(problem, slow):
    """Averaged derivatives of l, rho, sigma, theta by u."""
    setting, at = problem.setting, problem.nodes
    q_l = l_to_reference(slow.rho, slow.sigma)
    torque, nutation = NONE, 0.0
    for k in range(at.u.size):
        for d in range(at.day.size):
            models = models_at(setting, at.u[k], at.day[d])
            t_s = at.u[k] / setting.orbital_rate
            here = _sums_over_turns(problem, slow, q_l, t_s, models)
            torque = add(torque, here[0])
            nutation += here[1]
    count = at.half_phi.shape[0] * at.half_psi.shape[0] * at.u.size * at.day.size
    unit = 1.0 / (count * setting.momentum * setting.orbital_rate)
    m1, m2, m3 = scale(unit, torque)
    # near the third axis the rounding of m2, over sin(rho), would look like a turn
    if abs(m2) < 1e-14 * (abs(m1) + abs(m3)):
        m2 = 0.0
    turn = 1.0 / slow.l
    return Slow(m3, turn * m1, turn * m2 / math.sin(slow.rho), turn * unit * nutation)


@rates_of(AveragedMotion)
def _averaged_rates(problem, t, y, dy):
    if inside(y):
        dy[0], dy[1], dy[2], dy[3] = mean_rates(problem, Slow(y[0], y[1], y[2], y[3]))
    else:
        dy[0] = dy[1] = dy[2] = dy[3] = math.nan


@kernel
def greatest_relative_rate(problem, slow):
    """Greatest relative rate of change of the momentum by u over the nodes, |torque|/(L omega0)."""
    law, parameters, memory, setting, at = problem
    q_l = l_to_reference(slow.rho, slow.sigma)
    half_theta = (math.cos(0.5 * slow.theta), math.sin(0.5 * slow.theta))
    momentum, most = (0.0, 0.0, setting.momentum * slow.l), 0.0
    for k in range(at.u.size * at.day.size):
        u, day = at.u[k // at.day.size], at.day[k % at.day.size]
        models = models_at(setting, u, day)
        for j in range(at.half_psi.shape[0]):
            for i in range(at.half_phi.shape[0]):
                half_psi = (at.half_psi[j, 0], at.half_psi[j, 1])
                q_body = body_to_l(half_psi, half_theta, (at.half_phi[i, 0], at.half_phi[i, 1]))
                omega = spin_rate(setting, rotate_inverse(q_body, momentum))
                t_s, q = u / setting.orbital_rate, multiply(q_l, q_body)
                b, m = commanded_dipole(law, parameters, memory, t_s, q, omega, models)
                most = max(most, norm(cross(m, b)))
    return most / (momentum[2] * setting.orbital_rate)


def nodes(psi: int = 8, phi: int = 8, u: int = 8, day: int = 1) -> Nodes:
    """Evenly spaced nodes; `day` counts for the tilted dipole alone."""
    for name, count in (("psi", psi), ("phi", phi), ("u", u), ("day", day)):
        if not (isinstance(count, int | np.integer) and count >= 1):
            raise ValueError(f"nodes: {name} must be at least 1; received {count}")

    def halves(count):
        angle = math.pi * np.arange(count) / count
        return np.column_stack([np.cos(angle), np.sin(angle)])

    turns = (2.0 * math.pi * np.arange(count) / count for count in (u, day))
    return Nodes(halves(psi), halves(phi), *turns)


def averaged_motion(law: Law, spinner: Spinner, at: Nodes | None = None) -> AveragedMotion:
    """The averaged motion of a satellite under a law; ValueError if the law has no average."""
    if len(law.first_memory()):
        raise ValueError(
            f"law {law.name}: must have no memory to be averaged (use its form with the rate or "
            f"the field's derivative); received {len(law.first_memory())} cells"
        )
    setting = spinner.pack()
    _check_answer(law, setting)
    if at is None:
        at = nodes(day=6 if setting.field.model == TILTED_DIPOLE else 1)
    return AveragedMotion(law.compile(), law.pack(), np.zeros(0), setting, at)


def _check_answer(law: Law, setting) -> None:
    """ValueError for a law that asks for the position, or for a Sun that is not given."""

    def answer(sun):
        models = (*models_at(setting, 0.3, 0.0)[:2], sun)
        inputs = exact_inputs(1.0, (0.5, -0.5, 0.1, 0.7), (1e-3, 2e-3, 3e-3), models)
        found = law(inputs)
        return tuple(found.dipole_a_m2 if law.answers == "command" else found)

    here = answer(setting.sun)
    if not all(map(math.isfinite, here)):
        raise ValueError(
            f"law {law.name}: must be defined by field, Sun, rate and attitude alone to be "
            f"averaged (position and velocity are unknown); received {here}"
        )
    if setting.sun == NONE and answer((0.6, 0.0, 0.8)) != here:
        raise ValueError(f"sun: must be given for law {law.name}; received none")


def averaged_rates(law: Law, spinner: Spinner, slow: Slow, at: Nodes | None = None) -> Slow:
    """Averaged derivatives of the slow variables by u, at one point off the third axis.

    At rho = 0 and pi, where the rate of sigma is not defined, ValueError (`OFF_POLES`).
    """
    check_slow(slow)
    within(OFF_POLES, slow.rho)
    return Slow(*mean_rates(averaged_motion(law, spinner, at), Slow(*map(float, slow))))


#: Of the averages, relative to the greatest of them.
CONVERGED = Limit(
    "change of the averages by half as many nodes more", most=1e-3,
    why="the averages have not converged",
    of="averages of a law by quadrature", shown="the finer quadrature, computed at the start",
)  # fmt: skip


def convergence_note(law: Law, spinner: Spinner, slow: Slow, at: Nodes) -> tuple[str, ...]:
    """A note if 1.5 times as many nodes, an odd number against aliasing, change the averages."""
    rho = min(max(slow.rho, 0.1), math.pi - 0.1)
    here = Slow(float(slow.l), float(rho), float(slow.sigma), float(slow.theta))
    more = [(n + n // 2 + 1) | 1 for n in map(len, at)]
    finer = nodes(*more[:3], more[3] if spinner.field == "tilted_dipole" else 1)
    one, other = (np.array(averaged_rates(law, spinner, here, each)) for each in (at, finer))
    change, size = np.abs(one - other).max(), np.abs(other).max()
    if CONVERGED.holds(change / size if size > 0.0 else 0.0):
        return ()
    return (f"the averages have not converged: more nodes change them by {change / size:.2g}",)


#: Points at which convergence is tested, and an inclination at which no term vanishes by chance.
TRIED = (Slow(1.0, 0.7, 0.4, 0.5), Slow(0.6, 1.9, 2.8, 1.2), Slow(1.3, 2.6, 5.1, 2.3))
TRIED_INCLINATION_DEG = 57.0


def converged_nodes(law: Law, spinner: Spinner, tolerance: float = 1e-9, most: int = 80) -> Nodes:
    """The fewest nodes, angle by angle, that give the averages of a law to `tolerance`.

    Tested at three points, relative to the largest derivative at each: nodes are doubled until
    nothing changes, then removed where they are not needed (a law that does not single out a
    direction across the axis needs one in phi). ValueError if `most` nodes per angle do not
    suffice: a law with switching needs a coarser tolerance.
    """
    within(Limit("tolerance", 0.0, 1.0, open=True), tolerance)
    spinner = spinner.model_copy(update={"inclination_deg": TRIED_INCLINATION_DEG})
    tilted = spinner.field == "tilted_dipole"

    def averages(counts):
        return np.array([averaged_rates(law, spinner, slow, nodes(*counts)) for slow in TRIED])

    def change(now, reference):
        size = np.abs(reference).max(axis=1, keepdims=True)
        return np.max(np.abs(now - reference) / np.where(size > 0.0, size, 1.0))

    count, changed, reference = 5, math.inf, averages([5, 5, 5, 5 if tilted else 1])
    while changed > tolerance and 2 * count <= most:
        count, before = 2 * count, reference
        reference = averages([count, count, count, count if tilted else 1])
        changed = change(before, reference)
    if changed > tolerance:
        raise ValueError(
            f"law {law.name}: averages must converge to {tolerance:g} within {most} nodes per "
            f"angle; the last doubling changed them by {changed:.2g}"
        )
    counts = [count, count, count, count if tilted else 1]
    for angle, enough in enumerate(counts):
        for fewer in range(1, enough):
            trial = [*counts[:angle], fewer, *counts[angle + 1 :]]
            if change(averages(trial), reference) <= tolerance:
                counts = trial
                break
    return nodes(*counts)
