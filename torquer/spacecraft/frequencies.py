"""The frequencies of a body's own motion: what an integrator with fixed steps has to resolve."""

from torquer.compile.engine import inlined
from torquer.maths.geometry.vec3 import dot, sym_vec


@inlined
def nutation_square(inverse_inertia, momentum, omega):
    """Square [1/s^2] of the frequency of small changes of the rate [rad/s], body axes.

    `inverse_inertia` K of the body (without its rotors), `momentum` L of body and wheels [N m s].
    The sum of the principal minors of Euler's linearised equations, d' = K (L x d - omega x J d):
    on a steady motion their eigenvalues are 0 and +-i times the root. For a spin W about an axis
    of inertia C it is W^2 (C - A)(C - B)/(A B), for a gyrostat at rest h.J h/det J. Below zero
    the motion runs away instead of oscillating.
    """
    k, turning = inverse_inertia, sym_vec(inverse_inertia, momentum)
    trace = k[0] + k[1] + k[2]
    minors = k[0] * k[1] + k[0] * k[2] + k[1] * k[2]
    if len(k) == 6:
        minors -= k[3] * k[3] + k[4] * k[4] + k[5] * k[5]
    wheel = minors * dot(momentum, momentum) + dot(turning, turning)
    wheel -= trace * (dot(momentum, turning) + dot(omega, momentum))
    return wheel + dot(omega, turning) + dot(omega, omega)


@inlined
def libration_fourth(inverse_inertia, dipole_a_m2, b_t):
    """Fourth power [1/s^4] of the frequency at which a dipole swings about the field, at most."""
    k = inverse_inertia
    most = max(k[0], max(k[1], k[2]))
    return dot(dipole_a_m2, dipole_a_m2) * dot(b_t, b_t) * most * most
