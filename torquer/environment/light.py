"""Sunlight along an orbit as it pushes a body, and when the Earth's shadow changes it.

At the edges of shadow and penumbra the pressure jumps or bends: an integrator that keeps a
tolerance ends its steps there.
"""

import math
from typing import NamedTuple

import numpy as np

from torquer.base.conventions import ASTRONOMICAL_UNIT_M
from torquer.compile.engine import inlined, kernel
from torquer.environment.sun import Shadow, sunlit_fraction_at
from torquer.environment.table import Table, lookup3
from torquer.maths.geometry.vec3 import dot, put_vector, read_vector, scale, sub

#: Pressure of sunlight at 1 au [Pa]: 1361 W/m^2 (G. Kopp, J. Lean, 2011) by the speed of light.
PRESSURE_AT_1_AU_PA = 1361.0 / 299792458.0
#: Instants of a revolution at which the edges of the shadow are looked for.
_LOOKS = 1000


class Light(NamedTuple):
    """Sunlight for kernels: table of the Sun's position, the Earth's shadow, and the instants
    `edges_s` [s], in order, at which the satellite crosses an edge of shadow or penumbra."""

    sun: Table
    shadow: Shadow
    edges_s: np.ndarray


@kernel
def light_at(shadow, r_m, sun_m):
    """Direction from a position to the Sun with the length of the light's pressure [Pa]."""
    to_sun = sub(sun_m, r_m)
    square = dot(to_sun, to_sun)
    pressure = PRESSURE_AT_1_AU_PA * ASTRONOMICAL_UNIT_M**2 / square
    return scale(sunlit_fraction_at(shadow, r_m, sun_m) * pressure / math.sqrt(square), to_sun)


@kernel
def _fill_light(shadow, r_m, sun_m, out):
    for k in range(out.shape[0]):
        put_vector(out[k], light_at(shadow, read_vector(r_m[k]), read_vector(sun_m[k])))


def light_along(shadow: Shadow, r_m: np.ndarray, sun_m: np.ndarray) -> np.ndarray:
    """Light [n, 3] Pa as `light_at` gives it, at positions [n, 3] m of satellite and Sun."""
    out = np.empty_like(r_m)
    _fill_light(shadow, np.ascontiguousarray(r_m), np.ascontiguousarray(sun_m), out)
    return out


@kernel
def _sunlit_at(shadow, orbit, sun, t):
    return sunlit_fraction_at(shadow, lookup3(orbit, t), lookup3(sun, t))


@kernel
def _kind(sunlit_fraction):
    """-1 in the umbra, 1 in full sunlight, 0 between."""
    return -1 if sunlit_fraction == 0.0 else (1 if sunlit_fraction == 1.0 else 0)


@kernel
def _kinds(shadow, orbit, sun, t_s, out):
    for k in range(t_s.size):
        out[k] = _kind(_sunlit_at(shadow, orbit, sun, t_s[k]))


@kernel
def _edge(shadow, orbit, sun, early, late):
    """(Time, kind of light there) of the first change from the kind of light at `early`."""
    before = _kind(_sunlit_at(shadow, orbit, sun, early))
    while True:
        middle = 0.5 * (early + late)
        if not early < middle < late:
            return late, _kind(_sunlit_at(shadow, orbit, sun, late))
        if _kind(_sunlit_at(shadow, orbit, sun, middle)) == before:
            early = middle
        else:
            late = middle


def shadow_edges(
    shadow: Shadow, orbit: Table, sun: Table, start_s: float, duration_s: float, period_s: float
) -> np.ndarray:
    """Instants [s] at which a satellite crosses an edge of shadow or penumbra, in order.

    A crossing and another one back within a thousandth of a revolution is overlooked.
    """
    count = max(2, math.ceil(_LOOKS * duration_s / period_s) + 1)
    t_s = start_s + np.linspace(0.0, duration_s, count)
    kinds = np.empty(count, dtype=np.int64)
    _kinds(shadow, orbit, sun, t_s, kinds)
    found: list[float] = []
    for k in np.flatnonzero(np.diff(kinds)):
        t, kind = float(t_s[k]), kinds[k]
        while kind != kinds[k + 1]:
            t, kind = _edge(shadow, orbit, sun, t, t_s[k + 1])
            found.append(t)
    return np.array(found)


@inlined
def next_edge(light, t):
    """Time of the first edge after a time; infinite for none."""
    edges, low, high = light.edges_s, 0, light.edges_s.shape[0]
    while low < high:
        middle = (low + high) // 2
        if edges[middle] > t:
            high = middle
        else:
            low = middle + 1
    return edges[low] if low < edges.shape[0] else math.inf


@kernel
def between_edges(light, orbit, t):
    """The light [Pa] at a time t between two edges.

    Full sunlight and umbra are kept to the edges themselves, where rounding would decide.
    """
    kind = _kind(_sunlit_at(light.shadow, orbit, light.sun, t))
    if kind == 0:
        return light
    radius = 0.0 if kind == 1 else math.inf
    return Light(light.sun, Shadow(True, radius, 0.0, light.shadow.pole), light.edges_s)
