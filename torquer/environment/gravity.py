"""Gravity-gradient torque on a rigid body, for any inertia tensor and any orbit."""

from torquer.engine import inlined
from torquer.geometry.vec3 import cross, scale, sym_vec


@inlined
def gravity_gradient_torque(inertia, up_body, three_mu_over_r3):
    """Torque [N m] in the body: 3 mu/r^3 e x J e.

    `inertia` [kg m^2] as (xx, yy, zz, xy, xz, yz), `up_body` the unit radius vector e in the
    body, `three_mu_over_r3` in 1/s^2 (3 omega0^2 on a circular orbit). Source: WHEEL (6.2).
    """
    return scale(three_mu_over_r3, cross(up_body, sym_vec(inertia, up_body)))
