"""Sunlight that the Earth reflects, as a flat detector in orbit meets it.

The Earth as a Lambertian sphere of one albedo: T. Flatley, W. Moore, 'An Earth Albedo Model', NASA
Technical Memorandum 104596 (1994). Clouds, ice and oceans make the true albedo anything from 0.05
to 0.8 in places, about 0.3 on average.
"""

import math

from torquer.base.conventions import EARTH_RADIUS_M
from torquer.compile.engine import kernel
from torquer.maths.geometry.vec3 import add_scaled, dot, norm, scale

#: Nodes and weights of the Gauss-Legendre rule of order 16 on [0, 1].
_NODES = (
    0.01985507175123188, 0.10166676129318664, 0.2372337950418355, 0.40828267875217511,
    0.59171732124782489, 0.7627662049581645, 0.89833323870681336, 0.98014492824876812,
)  # fmt: skip
_WEIGHTS = (
    0.05061426814518813, 0.11119051722668724, 0.15685332293894364, 0.18134189168918099,
    0.18134189168918099, 0.15685332293894364, 0.11119051722668724, 0.05061426814518813,
)  # fmt: skip


@kernel
def _around(a, b):
    """Integrals of max(a + b cos x, 0) and of that times cos x over a turn; b >= 0."""
    if a >= b:
        return 2.0 * math.pi * a, math.pi * b
    if a <= -b:
        return 0.0, 0.0
    edge = math.acos(-a / b)
    s = math.sin(edge)
    return 2.0 * (a * edge + b * s), a * s + b * (edge + s * math.cos(edge)) + a * s


@kernel
def earthlight(albedo, r_m, to_sun):
    """Reflected light at a position [m], in parts of the Sun's: a vector towards its source.

    A flat detector with the normal n receives the part n . e of what sunlight along its normal
    would give, if all of the sunlit Earth is in front of it. `to_sun`: unit vector, same frame.
    """
    size = norm(r_m)
    up = scale(1.0 / size, r_m)
    along = dot(up, to_sun)
    across = math.sqrt(max(1.0 - along * along, 0.0))
    radius = min(EARTH_RADIUS_M / size, 1.0)
    down = level = 0.0
    for k in range(len(_NODES)):
        # half a chord through the Earth, in parts of the distance to its centre: over it, light
        # has no edge at the limb
        half = radius * _NODES[k]
        sine = math.sqrt(radius * radius - half * half)  # of the angle from nadir
        cosine = math.sqrt(1.0 - sine * sine)
        ground = cosine - half
        sum_1, sum_2 = _around((1.0 - ground * cosine) * along, ground * sine * across)
        weight = albedo / math.pi * _WEIGHTS[k] * _NODES[k] * radius
        down += weight * sum_1
        level += weight * sine / cosine * sum_2
    light = scale(-down, up)
    if across < 1e-9:
        return light
    return add_scaled(light, level / across, add_scaled(to_sun, -along, up))
