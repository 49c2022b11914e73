"""Sun cells: the signal of each cell is a measurement of its own, with the Earth's light in it."""

import math

from torquer.compile.engine import inlined
from torquer.computer.estimation.covariance import ATTITUDE, mean_variance
from torquer.computer.estimation.measurements.measurement import (
    FIRST_CELL,
    NO_MEASUREMENT,
    NO_OTHER,
    NOWHERE,
    Measurement,
    turn_to_now,
)
from torquer.computer.estimation.triad import read_quaternion
from torquer.environment.albedo import earthlight
from torquer.maths.geometry.frames import transpose
from torquer.maths.geometry.quaternion import rotate_inverse
from torquer.maths.geometry.vec3 import add, cross, dot, put_vector, read_vector, scale
from torquer.spacecraft.sensors.sun_cells import CELLS

#: Sunlight below which a cell is not used, as it should be; signal below which it is dark. A limit
#: for the signal near the one for the light would select its noise.
DARK = 0.1
_SIGNAL = 0.02
#: A cell is used if the Sun is in its field by so many standard deviations of the attitude.
_INSIDE = 3.0
_ZERO = (0.0, 0.0, 0.0)
_NO_ROWS = (_ZERO, _ZERO, _ZERO)


@inlined
def measure_cell(q, row, signal, light, earth, sensing, sigma):
    """(z, H, R) of a cell's signal: one component, the second one is empty.

    `row`: normal, cosine of the half field; `light`: direction to the Sun times the visible part of
    it, `earth`: light of the Earth as `torquer.environment.albedo` gives it, both inertial;
    `sigma`: of the attitude [rad]. The Earth's light is taken off the signal, and uncertain.
    """
    normal, sun = (row[0], row[1], row[2]), rotate_inverse(q, light)
    near = dot(normal, sun)
    if near < DARK or near - _INSIDE * sigma < row[3]:
        return NO_MEASUREMENT
    reflected = rotate_inverse(q, earth)
    of_earth = dot(normal, reflected)
    seen, r = sun, sensing.r_cell
    if of_earth > 0.0:
        seen = add(sun, reflected)
        error = sensing.cell_albedo_error * of_earth
        r += error * error
    z, h = (signal - dot(normal, seen), 0.0, 0.0), (cross(normal, seen), _ZERO, _ZERO)
    return Measurement(z, h, NO_OTHER, NOWHERE, r, 2, normal, light, 0.0)


@inlined
def put_earthlight(inputs, sensing, memory):
    """Keep the light of the Earth by the computer's ephemeris for all cells: see `measure_cell`."""
    place = inputs.ephemeris
    if sensing.cell_albedo > 0.0 and place.sunlit_fraction >= 0.5:
        earth = earthlight(sensing.cell_albedo, place.r_inertial_m, place.sun_inertial)
        put_vector(memory.earthlight, earth)


@inlined
def sun_cell(inputs, parameters, memory, cell, omega):
    """(z, H, R) of the latest signal of a cell, if it is new and lit, outside the umbra.

    The body has turned with omega since: the cell's normal then was another direction of now.
    """
    signal, at_s, sensing = inputs.sun_cells[cell], inputs.read_at.sun_cells_s, parameters.sensing
    new = sensing.r_cell > 0.0 and at_s > memory.read_s[FIRST_CELL + cell]
    lit = inputs.ephemeris.sunlit_fraction >= 0.5 and _SIGNAL < signal < math.inf
    if not (new and lit):
        return NO_MEASUREMENT
    row = sensing.cells[cell]
    then = turn_to_now(omega, inputs.t_s - at_s, (row[0], row[1], row[2]))
    light = scale(inputs.ephemeris.sunlit_fraction, inputs.ephemeris.sun_inertial)
    earth = read_vector(memory.earthlight)
    sigma = math.sqrt(mean_variance(memory.covariance, ATTITUDE))
    turned = (then[0], then[1], then[2], row[3])
    return measure_cell(read_quaternion(memory.q), turned, signal, light, earth, sensing, sigma)


@inlined
def sun_by_cells(inputs, sensing):
    """(Direction to the Sun [body] by least squares, its variance [rad^2]); zeros if not known.

    From the cells that are lit; three in different directions are needed. Light of the Earth is in
    it: the variance includes a tenth of the Sun's.
    """
    a, b = _NO_ROWS, _ZERO
    for k in range(CELLS):
        signal, row = inputs.sun_cells[k], sensing.cells[k]
        n = (row[0], row[1], row[2])
        if sensing.r_cell > 0.0 and DARK < signal < math.inf and row[3] < 1.0:
            a = (add(a[0], scale(n[0], n)), add(a[1], scale(n[1], n)), add(a[2], scale(n[2], n)))
            b = add(b, scale(signal, n))
    across = (cross(a[1], a[2]), cross(a[2], a[0]), cross(a[0], a[1]))
    determinant = dot(a[0], across[0])
    if determinant < 0.01:
        return _ZERO, 0.0
    x = scale(1.0 / determinant, b)
    columns = transpose(across)
    sun = (dot(columns[0], x), dot(columns[1], x), dot(columns[2], x))
    noise = sensing.r_cell * (across[0][0] + across[1][1] + across[2][2]) / determinant
    return sun, noise + (0.01 if sensing.cell_albedo > 0.0 else 0.0)
