"""Solar radiation pressure on a body made of parts.

Sunlight is absorbed, reflected as by a mirror, or diffusely (Lambert's law); what is absorbed is
radiated evenly. Parts do not shade each other; the Earth shades all of them.
"""

from typing import NamedTuple

import numpy as np
from pydantic import Field

from torquer.base.spec import Spec
from torquer.compile.engine import inlined
from torquer.maths.geometry.vec3 import add, add_scaled, cross, dot, norm, scale
from torquer.spacecraft.parts import AnyPart


class SunlitSurface(NamedTuple):
    """Parts of a body for kernels.

    `rows` [n, 12]: area [m^2] that meets light along and against the axis, across it, and from
    anywhere; axis; centre from the centre of mass [m]; specular and diffuse reflectivity.
    """

    rows: np.ndarray


NO_SUNLIT_SURFACE = SunlitSurface(np.zeros((0, 12)))


@inlined
def _push(row, to_sun):
    """Force [m^2] on a part by light of unit pressure.

    A plate, or the end of a cylinder, of area A turned by the angle a to the light s, normal n:
    -A cos a ((1 - specular) s + 2 (specular cos a + diffuse/3) n). The integral of that over the
    side of a cylinder and over a sphere, in closed form.
    """
    axis, specular, diffuse = (row[4], row[5], row[6]), row[10], row[11]
    along = dot(axis, to_sun)
    across = add_scaled(to_sun, -along, axis)
    sine = norm(across)
    end = row[0] * max(along, 0.0) + row[1] * max(-along, 0.0)
    side = row[2]
    straight = (1.0 - specular) * (end + side * sine) + (1.0 + 4.0 / 9.0 * diffuse) * row[3]
    outwards = side * (4.0 / 3.0 * specular * sine + np.pi / 6.0 * diffuse)
    normal = 2.0 * end * (specular * abs(along) + diffuse / 3.0) * np.sign(along)
    return add(add_scaled(scale(-straight, to_sun), -outwards, across), scale(-normal, axis))


@inlined
def solar_pressure_torque(surface, local_body, omega_body):
    """Torque about the centre of mass [N m, body]; `local_body`: `LocalEnvironment` in body axes.

    Each part's force acts at its centre: for a whole cylinder or sphere of one surface this is
    exact. F. L. Markley, J. L. Crassidis, 'Fundamentals of Spacecraft Attitude Determination and
    Control' (2014), chapter 3.
    """
    return _torque_by(surface.rows, local_body.light)


@inlined
def _torque_by(rows, light):
    """Torque [N m] of light as `LocalEnvironment` has it; none without."""
    torque = (0.0, 0.0, 0.0)
    if len(light) == 0:
        return torque
    pressure = norm(light)
    if pressure == 0.0:
        return torque
    to_sun = scale(1.0 / pressure, light)
    for part in range(rows.shape[0]):
        row = rows[part]
        torque = add(torque, cross((row[7], row[8], row[9]), _push(row, to_sun)))
    return scale(pressure, torque)


class SolarPressure(Spec):
    """Solar radiation pressure on the parts of the body.

    Of the light `specular_reflectivity` of a part leaves as from a mirror, `diffuse_reflectivity`
    in all directions, and the rest is absorbed. The pressure is 4.54e-6 Pa at 1 au, less by the
    square of the distance from the Sun, and in proportion to the visible part of its disc
    (`environment.eclipse`). Adaptive steps end at the edges of the shadow, fixed ones pass over
    them.
    """

    parts: tuple[AnyPart, ...] | None = Field(default=None, min_length=1)
    """Parts of the body; left out: those of `spacecraft.aerodynamics`."""

    def pack(self, parts: tuple[AnyPart, ...]) -> SunlitSurface:
        """Constants for kernels; `parts`: those of the body, if it has none of its own."""
        rows = [
            [*row, part.specular_reflectivity, part.diffuse_reflectivity]
            for part in self.parts or parts
            for row in part.shapes()
        ]
        return SunlitSurface(np.array(rows))
