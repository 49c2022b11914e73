"""Sun cells: the signal of each cell is a measurement of its own, with the Earth's light in it."""

import math
from typing import Annotated, NamedTuple

from pydantic import Field

from torquer.base.spec import Spec
from torquer.compile.engine import inlined
from torquer.computer.estimation.covariance import ATTITUDE, mean_variance
from torquer.computer.estimation.measurements.measured import Measured
from torquer.computer.estimation.measurements.measurement import (
    NO_MEASUREMENT,
    NO_OTHER,
    NOWHERE,
    Direction,
    Measurement,
    is_usable,
    turn_to_now,
)
from torquer.environment.albedo import earthlight
from torquer.maths.geometry.frames import transpose
from torquer.maths.geometry.quaternion import read_quaternion, rotate_inverse
from torquer.maths.geometry.vec3 import add, cross, dot, put_vector, read_vector, scale
from torquer.spacecraft.sensors.sun_cells import CELLS, Normals

#: Sunlight below which a cell is not used, as it should be; signal below which it is dark. A limit
#: for the signal near the one for the light would select its noise.
DARK = 0.1
_SIGNAL = 0.02
#: A cell is used if the Sun is in its field by so many standard deviations of the attitude.
_INSIDE = 3.0
_ZERO = (0.0, 0.0, 0.0)
_NO_ROWS = (_ZERO, _ZERO, _ZERO)


@inlined
def measure_cell(q, row, signal, light, earth, own, sigma):
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
    seen, r = sun, own.r
    if of_earth > 0.0:
        seen = add(sun, reflected)
        error = own.albedo_error * of_earth
        r += error * error
    z, h = (signal - dot(normal, seen), 0.0, 0.0), (cross(normal, seen), _ZERO, _ZERO)
    return Measurement(z, h, NO_OTHER, NOWHERE, r, 2, normal, light, 0.0)


@inlined
def keep_earthlight(inputs, own, memory):
    """Keep the light of the Earth by the computer's ephemeris for all cells: see `measure_cell`."""
    place = inputs.ephemeris
    if own.albedo > 0.0 and place.sunlit_fraction >= 0.5:
        earth = earthlight(own.albedo, place.r_inertial_m, place.sun_inertial)
        put_vector(memory.earthlight, earth)


@inlined
def measure(inputs, parameters, memory, signals, at_s, own, place, omega, walk):
    """(z, H, R) of the latest signal of a cell, if it is new and lit, outside the umbra.

    The body has turned with omega since: the cell's normal then was another direction of now.
    """
    if place.part == 0:
        keep_earthlight(inputs, own, memory)
    signal, new = signals[place.part], own.r > 0.0 and at_s > memory.read_s[place.channel]
    lit = inputs.ephemeris.sunlit_fraction >= 0.5 and _SIGNAL < signal < math.inf
    if not (new and lit):
        return NO_MEASUREMENT
    row = own.cells[place.part]
    then = turn_to_now(omega, inputs.t_s - at_s, (row[0], row[1], row[2]))
    light = scale(inputs.ephemeris.sunlit_fraction, inputs.ephemeris.sun_inertial)
    earth = read_vector(memory.earthlight)
    sigma = math.sqrt(mean_variance(memory.covariance, ATTITUDE))
    turned = (then[0], then[1], then[2], row[3])
    return measure_cell(read_quaternion(memory.q), turned, signal, light, earth, own, sigma)


@inlined
def sun_by_cells(signals, own):
    """(Direction to the Sun [body] by least squares, its variance [rad^2]); zeros if not known.

    From the cells that are lit; three in different directions are needed. Light of the Earth is in
    it: the variance includes a tenth of the Sun's.
    """
    a, b = _NO_ROWS, _ZERO
    for k in range(CELLS):
        signal, row = signals[k], own.cells[k]
        n = (row[0], row[1], row[2])
        if own.r > 0.0 and DARK < signal < math.inf and row[3] < 1.0:
            a = (add(a[0], scale(n[0], n)), add(a[1], scale(n[1], n)), add(a[2], scale(n[2], n)))
            b = add(b, scale(signal, n))
    across = (cross(a[1], a[2]), cross(a[2], a[0]), cross(a[0], a[1]))
    determinant = dot(a[0], across[0])
    if determinant < 0.01:
        return _ZERO, 0.0
    x = scale(1.0 / determinant, b)
    columns = transpose(across)
    sun = (dot(columns[0], x), dot(columns[1], x), dot(columns[2], x))
    noise = own.r * (across[0][0] + across[1][1] + across[2][2]) / determinant
    return sun, noise + (0.01 if own.albedo > 0.0 else 0.0)


@inlined
def direction(inputs, parameters, signals, at_s, own):
    """The direction to the Sun by all cells together."""
    sun, r = sun_by_cells(signals, own)
    usable = is_usable(r, sun, inputs.t_s - at_s, parameters.sensing.gap)
    return Direction(own.r > 0.0, usable, at_s, sun, inputs.ephemeris.sun_inertial, r)


@inlined
def expected(parameters, along, k, own, assumed, cell):
    """(z, H, R) of the expected signal of a cell: z is zero."""
    if along.sunlit[k] < 0.5:
        return NO_MEASUREMENT
    q, row = read_quaternion(along.q[k]), own.cells[cell]
    light = scale(along.sunlit[k], read_vector(along.sun[k]))
    earth = read_vector(along.earthlight[k])
    dark = measure_cell(q, row, 0.0, light, earth, own, 0.0)
    return measure_cell(q, row, -dark.z[0], light, earth, own, 0.0)


def visible(craft, seen):
    """Whether there is light for cells along a motion (k,)."""
    return seen.sunlit >= 0.5


class SunCellKeys(Spec):
    """A filter's keys of the Sun cells."""

    cell_noise: Annotated[float, Field(gt=0.0, lt=1.0)] | None = None
    """Standard deviation of the signal of a Sun cell, in parts of full sunlight, errors of its
    scale included; given if the filter uses Sun cells.
    """
    cell_normals: Normals | None = None
    """Normals of the Sun cells in the body, at most six; given if the filter uses them."""
    cell_half_field_deg: float = Field(default=90.0, gt=0.0, le=90.0)
    """Angle from its normal up to which a Sun cell is used."""
    cell_albedo: float = Field(default=0.0, ge=0.0, le=1.0)
    """Albedo of the Earth by which its light is taken off the signals of Sun cells; 0: it is not.
    """
    cell_albedo_error: float = Field(default=0.0, ge=0.0)
    """Relative standard deviation of the Earth's light on a Sun cell, by which its signal is
    trusted less.
    """

    def cells(self) -> tuple[tuple[float, float, float, float], ...]:
        """Normal and cosine of the half field of each Sun cell; 2 where there is none."""
        cosine, normals = math.cos(math.radians(self.cell_half_field_deg)), self.cell_normals or ()
        missing = ((0.0, 0.0, 1.0, 2.0),) * (CELLS - len(normals))
        return (*((*normal, cosine) for normal in normals), *missing)


def check(keys) -> None:
    """The normals are given with the noise, and only then."""
    if (keys.cell_normals is not None) != (keys.cell_noise is not None):
        received = "none" if keys.cell_normals is None else f"{len(keys.cell_normals)}"
        must = "given" if keys.cell_normals is None else "left out"
        raise ValueError(
            f"cell_normals: must be {must} with sensors = {list(keys.sensors)}; received {received}"
        )


class CellNoise(NamedTuple):
    """Variance of a signal; albedo of the Earth and the relative error of its light by it; normal
    and cosine of the half field of each cell."""

    r: float
    albedo: float
    albedo_error: float
    cells: tuple


def constants(keys) -> CellNoise:
    """Constants for kernels."""
    return CellNoise(
        (keys.cell_noise or 0.0) ** 2, keys.cell_albedo, keys.cell_albedo_error, keys.cells()
    )


MEASURED = Measured(
    "sun_cells",
    said="Sun cells",
    keys=SunCellKeys,
    noise="cell_noise",
    check=check,
    constants=constants,
    measure=measure,
    expected=expected,
    visible=visible,
    missing="fewer than three Sun cells in the light",
    direction=direction,
    says={"axes": "cell_normals", "albedo": "cell_albedo"},
    channels=CELLS,
    parts=lambda keys: len(keys.cell_normals or ()),
    colour="ORANGE",
)
