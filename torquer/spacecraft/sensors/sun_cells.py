"""Sun cells: single flat detectors whose signal is the cosine of the Sun's angle."""

import math
from typing import Annotated, ClassVar, NamedTuple

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from torquer.base.spec import unit_vectors
from torquer.compile.engine import inlined
from torquer.maths.geometry.quaternion import rotate_inverse
from torquer.maths.geometry.vec3 import dot
from torquer.spacecraft.data_sheet import DataSheet
from torquer.spacecraft.failures import PlainFailure
from torquer.spacecraft.sensors.device import MOST_PARTS, Device
from torquer.spacecraft.sensors.sampling import Sampled
from torquer.spacecraft.sensors.sunlight import sunlight_at

#: Number of single Sun cells that the computer can read.
CELLS = MOST_PARTS
#: Random numbers: three cells a stream.
STREAM, MORE_STREAM = 10, 11


class SunCellSet(NamedTuple):
    """Constants of the cells for kernels.

    `rows` [CELLS, 5], one per cell: normal, cosine of the half field, signal in full sunlight along
    the normal (0: no cell).
    """

    rows: np.ndarray
    noise: float
    albedo: float


@inlined
def read_cell(cells, k, sun_body, sunlit_fraction, earthlight_body, noise_sample):
    """Signal of a cell, in parts of full sunlight along its normal; 0 without such a cell.

    `sunlit_fraction`: visible part of the Sun's disc; `earthlight_body`: as
    `torquer.environment.albedo` gives it, in the body: the sunlit Earth is taken to be in front of
    a cell as a whole, or behind it. `noise_sample`: a standard normal number.
    """
    rows = cells.rows
    normal = (rows[k, 0], rows[k, 1], rows[k, 2])
    near, earth = dot(normal, sun_body), dot(normal, earthlight_body)
    sun = near * sunlit_fraction if near > max(rows[k, 3], 0.0) else 0.0
    noise = cells.noise * noise_sample if rows[k, 4] > 0.0 else 0.0
    return rows[k, 4] * (sun + max(earth, 0.0)) + noise


@inlined
def sunlight_around(cells, around):
    """Direction to the Sun, visible part of it, light of the Earth."""
    return sunlight_at(cells.albedo, around)


@inlined
def read(cells, here, sunlight, first, last):
    """Signals of the cells in this light; `first`, `last`: random numbers, three each."""
    q, (direction, sunlit, of_earth) = here.motion.q, sunlight
    sun, earth = rotate_inverse(q, direction), rotate_inverse(q, of_earth)
    return (
        read_cell(cells, 0, sun, sunlit, earth, first[0]),
        read_cell(cells, 1, sun, sunlit, earth, first[1]),
        read_cell(cells, 2, sun, sunlit, earth, first[2]),
        read_cell(cells, 3, sun, sunlit, earth, last[0]),
        read_cell(cells, 4, sun, sunlit, earth, last[1]),
        read_cell(cells, 5, sun, sunlit, earth, last[2]),
    )


def _check_count(normals):
    if len(normals) > CELLS:
        raise ValueError(f"normals: must be at most {CELLS} vectors; received {len(normals)}")
    return normals


Normals = Annotated[unit_vectors("normals"), AfterValidator(_check_count)]


class SunCells(Sampled):
    """Single Sun cells by their normals in the body, such as solar cells on the faces.

    The signal of a cell is the cosine of the angle between its normal and the Sun, times the
    visible part of the Sun, plus the light of the Earth.
    """

    sheet: ClassVar = DataSheet(
        name="Sun cell",
        senses="light",
        unit="",
        noise="noise",
        scale="scale_error",
        albedo="albedo",
        axes="normals",
    )
    failures: tuple[PlainFailure, ...] = ()
    """Intervals in which its readings are missing or wrong."""
    normals: Normals
    """Normals of the cells in the body, at most six, of any length."""
    half_field_deg: float = Field(default=90.0, gt=0.0, le=90.0)
    """Angle from the normal up to which a cell sees the Sun."""
    noise: float = Field(default=0.0, ge=0.0, lt=1.0)
    """Standard deviation of a signal, in parts of full sunlight along the normal."""
    scale_error: float | tuple[float, ...] = 0.0
    """Relative error of the signals, one number or one per cell."""
    albedo: float = Field(default=0.0, ge=0.0, le=1.0)
    """Albedo of the Earth, about 0.3, whose light cells see, too."""

    @model_validator(mode="after")
    def _one_error_per_cell(self):
        count, errors = len(self.normals), np.array(self.scale_error)
        if errors.shape not in ((), (count,)) or errors.min() <= -1.0:
            raise ValueError(
                f"scale_error: must be one number above -1, or one per cell ({count} normals); "
                f"received {self.scale_error}"
            )
        return self

    def pack(self) -> SunCellSet:
        """Constants for kernels."""
        count, rows = len(self.normals), np.zeros((CELLS, 5))
        rows[:count, :3] = self.normals
        rows[:count, 3] = math.cos(math.radians(self.half_field_deg))
        rows[:count, 4] = 1.0 + np.array(self.scale_error)
        return SunCellSet(rows, self.noise, self.albedo)


#: For kernels: no cells.
NO_SUN_CELLS = SunCellSet(np.zeros((CELLS, 5)), 0.0, 0.0)
DEVICE = Device(
    "sun_cells",
    given="sun_cells",
    said="Sun cells",
    symbol="cells",
    units="1",
    meaning="last signals of the Sun cells, in parts of full sunlight; zeros for cells that are "
    "not there",
    frame="",
    parts=tuple(str(k) for k in range(CELLS)),
    spec=SunCells,
    absent=NO_SUN_CELLS,
    need="sun_cells",
    read=read,
    sky=sunlight_around,
    by_sunlight=lambda cells: True,
    draws=((STREAM, ("noise",)), (MORE_STREAM, ("noise",))),
    nothing="zeros",
    measurement="sun_cells",
)
