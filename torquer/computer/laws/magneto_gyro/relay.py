"""Coils that are on or off, for the first stage of the magneto-gyroscopic system."""

import math

from torquer.compile.engine import inlined
from torquer.maths.geometry.vec3 import dot

#: How a wanted dipole is given by coils: as it is; each coil beyond a threshold; the combination of
#: coils nearest in angle.
LINEAR, EACH_COIL, NEAREST_ANGLE = 0.0, 1.0, 2.0
COILS = {"linear": LINEAR, "each_coil": EACH_COIL, "nearest_angle": NEAREST_ANGLE}


@inlined
def _switch(component, least, dipole_a_m2):
    """One coil: on, with the sign of the component, where that is at least `least`."""
    return math.copysign(dipole_a_m2, component) if abs(component) >= least else 0.0


@inlined
def _nearest_least(wanted):
    """The least component that is on in the combination of 0, +1 and -1 nearest in angle.

    It has the greatest components, one to three of them: those whose sum over the root of their
    number is greatest.
    """
    x, y, z = abs(wanted[0]), abs(wanted[1]), abs(wanted[2])
    first, last = max(x, y, z), min(x, y, z)
    middle = x + y + z - first - last
    least, best = first, first
    if (first + middle) / math.sqrt(2.0) > best:
        least, best = middle, (first + middle) / math.sqrt(2.0)
    return last if (x + y + z) / math.sqrt(3.0) > best else least


@inlined
def relay_dipole(wanted, how, threshold_a_m2, dipole_a_m2):
    """Dipole [A m^2] of relay coils along the body's axes for a wanted one.

    `EACH_COIL`: a coil is on where its component exceeds the threshold. `NEAREST_ANGLE`: where the
    whole vector exceeds it, the combination with the least angle to it.
    """
    if how == LINEAR:
        return wanted
    least = threshold_a_m2
    if how == NEAREST_ANGLE:
        if not dot(wanted, wanted) > threshold_a_m2 * threshold_a_m2:
            return (0.0, 0.0, 0.0)
        least = _nearest_least(wanted) * (1.0 - 1e-12)
    x = _switch(wanted[0], least, dipole_a_m2)
    y = _switch(wanted[1], least, dipole_a_m2)
    return x, y, _switch(wanted[2], least, dipole_a_m2)
