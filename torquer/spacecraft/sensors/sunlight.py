"""Sunlight where the satellite is, as sensors receive it."""

from torquer.compile.engine import kernel
from torquer.environment.albedo import earthlight
from torquer.environment.sun import sunlit_fraction_at
from torquer.environment.table import lookup3
from torquer.maths.geometry.vec3 import sub, unit


@kernel
def sun_and_light(shadow, orbit, sun, t):
    """Unit vector from the satellite to the Sun (inertial), visible part of its disc."""
    r, sun_m = lookup3(orbit, t), lookup3(sun, t)
    return unit(sub(sun_m, r)), sunlit_fraction_at(shadow, r, sun_m)


@kernel
def sunlight_at(albedo, around):
    """What Sun sensors receive: direction to the Sun, visible part of it, light of the Earth."""
    t = around.t_s
    direction, sunlit_fraction = sun_and_light(around.shadow, around.orbit, around.sun, t)
    of_earth = (0.0, 0.0, 0.0)
    if albedo > 0.0:
        of_earth = earthlight(albedo, lookup3(around.orbit, t), direction)
    return direction, sunlit_fraction, of_earth
