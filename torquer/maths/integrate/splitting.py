"""Free-rotation splitting: exact free motion between kicks by the torque at two Gauss nodes.

For a torque that is small against the gyroscopic terms the error is O(eps h^4 + eps^2 h^2),
whatever the spin rate does between the kicks: a fast spinner needs no small steps, as long as
the torque itself is resolved.
"""

from torquer.compile.engine import kernel
from torquer.maths.geometry.motion import Motion
from torquer.maths.geometry.quaternion import conjugate, multiply, rotate, rotate_inverse
from torquer.maths.geometry.vec3 import add, add_scaled, cross, scale, solve, sym_vec
from torquer.maths.integrate.free_body import free_rotation

#: Nodes of the two-point Gauss-Legendre rule on [0, 1]; the weights are 1/2.
NODES = (0.21132486540518713, 0.7886751345948129)


@kernel
def drift(moments, q_principal_to_body, x, t):
    """Free motion of a body over t seconds; moments ascending, with their axes' attitude."""
    to_body = q_principal_to_body
    q, omega = free_rotation(moments, multiply(x.q, to_body), rotate_inverse(to_body, x.omega), t)
    return Motion(multiply(q, conjugate(to_body)), rotate(to_body, omega))


@kernel
def kick(inertia, wheel_momentum, torque, x, t):
    """Rate after the torque and the wheels have acted for t seconds at a frozen attitude.

    `inertia` [kg m^2] as `sym_vec` takes it.
    J d omega/dt = M + h x omega by the implicit midpoint rule, which leaves the energy alone
    when there is no torque.
    """
    h = scale(0.5 * t, wheel_momentum)
    right = add(add_scaled(sym_vec(inertia, x.omega), t, torque), cross(h, x.omega))
    xx, yy, zz = inertia[0], inertia[1], inertia[2]
    xy = xz = yz = 0.0
    if len(inertia) == 6:
        xy, xz, yz = inertia[3], inertia[4], inertia[5]
    left = (
        (xx, xy + h[2], xz - h[1]),
        (xy - h[2], yy, yz + h[0]),
        (xz + h[1], yz - h[0], zz),
    )
    return Motion(x.q, solve(left, right))
