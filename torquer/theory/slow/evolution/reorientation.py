"""Averaged motion under precise reorientation, m = k ((L_f - L) . (e3 x B)) e3, theta = 0 (Z)."""

import math

import numpy as np

from torquer.compile.engine import inlined, kernel
from torquer.theory.slow.evolution.model import Evolution, Slow
from torquer.theory.validity import RHO, Limit, within


def small_parameter(gain, spinner):
    """eps = k B0^2/omega0."""
    return gain * spinner.strength_t**2 / spinner.orbital_rate_rad_s


@inlined
def _target_across(target, rho, sigma):
    """First two components of the target in L: towards larger rho, and larger sigma."""
    cs, ss = math.cos(sigma), math.sin(sigma)
    a = math.cos(rho) * (target[0] * cs + target[1] * ss) - target[2] * math.sin(rho)
    return a, target[1] * cs - target[0] * ss


@kernel
def reorientation_rates(slow, case):
    """Derivatives by u with theta = 0: rho' = eps p a/l, sigma' = eps <B_1^2> b/(l sin rho).

    <B_1^2> = p cos^2 rho + q sin^2 rho is the field's part normal to the plane of L and the cone
    axis turned into it. Source: MAG (3.3.2), which prints p in its place.
    """
    p, q = case.moments[0], case.moments[2]
    a, b = _target_across(case.target, slow.rho, slow.sigma)
    c, s = math.cos(slow.rho), math.sin(slow.rho)
    around = (p * c * c + q * s * s) * b / s
    return Slow(0.0, case.eps * p * a / slow.l, case.eps * around / slow.l, 0.0)


@kernel
def reorientation_rates_as_printed(slow, case):
    """The system that MAG prints, with p in both equations: for comparison only."""
    p = case.moments[0]
    a, b = _target_across(case.target, slow.rho, slow.sigma)
    unit = case.eps * p / slow.l
    return Slow(0.0, unit * a, unit * b / math.sin(slow.rho), 0.0)


def node_integral(slow, case):
    """sin rho sin sigma / |cos rho|^(q/p), for a target along Z1 (the ascending node); not in MAG.

    Where p = q it is tan rho sin sigma, that of the system as printed.
    """
    power = case.moments[2] / case.moments[0]
    return np.sin(slow.rho) * np.sin(slow.sigma) / np.abs(np.cos(slow.rho)) ** power


def node_integral_as_printed(slow, case):
    """tan rho sin sigma: of the system as printed alone. Source: MAG (3.3.3)."""
    return np.tan(slow.rho) * np.sin(slow.sigma)


_ACROSS = Limit("target across the cone axis", 0.0, 1e-9, "the solution is for one along it")


def to_cone_axis(u, case, rho0):
    """rho for a target along the cone axis, from l = 1: tan(rho/2) falls with exp(-eps p L3 u)."""
    within(RHO, rho0)
    within(_ACROSS, np.hypot(case.target[0], case.target[1]))
    turn = case.eps * case.moments[0] * case.target[2] * np.asarray(u)
    across, along = np.exp(-np.maximum(turn, 0.0)), np.exp(np.minimum(turn, 0.0))
    return 2.0 * np.arctan2(across * np.sin(0.5 * rho0), along * np.cos(0.5 * rho0))


def _to_node(case):
    """Whether the target lies along Z1, for which the integrals are."""
    return case.target[1] == case.target[2] == 0.0


def _reach(length, case):
    """`reach` of a torque proportional to target less momentum."""
    return (float(np.linalg.norm(case.target)) + length) / length


REORIENTATION = Evolution(
    "reorientation",
    reorientation_rates,
    small_parameter,
    {"node": node_integral},
    integrals_hold=_to_node,
    pure_spin=True,
    reach=_reach,
)
REORIENTATION_AS_PRINTED = Evolution(
    "reorientation_as_printed",
    reorientation_rates_as_printed,
    small_parameter,
    {"node": node_integral_as_printed},
    integrals_hold=_to_node,
    pure_spin=True,
    reach=_reach,
)
