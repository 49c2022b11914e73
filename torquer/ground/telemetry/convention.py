"""Which conventions logged quaternions and vectors follow, found from the field and the Sun.

Every order, sense and frame of the quaternion with every signed permutation of a sensor's axes is
tried: 12 times 48 ways. The right one turns the directions read into those of the models. The
margin to the next best way says whether the telemetry tells them apart.
"""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from torquer.environment.along_orbit import OrbitEnvironment
from torquer.environment.earth.rotation import teme_to_gcrf
from torquer.environment.field.along import angles_deg
from torquer.ground.telemetry.axes import SIGNED_PERMUTATIONS, axis_names
from torquer.ground.telemetry.environment import environments_at_rows
from torquer.maths.geometry.attitudes import dcm_body_to_reference

if TYPE_CHECKING:
    import xarray as xr

#: The next best way must be worse than the best by this factor, and the best not worse than
#: this angle [deg], or the telemetry does not tell.
_LEAST_MARGIN, _GREATEST_DEG = 1.5, 20.0
#: Lengths of quaternions that are taken as such.
_LEAST_LENGTH, _GREATEST_LENGTH = 0.9, 1.1
_LEAST_ROWS = 3
#: Angles beyond so many medians are of wrong rows: of normal errors one in half a million is.
_FAR = 4.5
#: Visible part of the Sun's disc above which its direction is compared.
_LIT = 0.99


#: The way in which sessions hold quaternions.
STATED = ("last", "body to reference", "J2000", ("x", "y", "z"))
#: Ways that are shown, best first.
WAYS_SHOWN = 5
_WORDS = {"field": "field", "sun": "Sun"}


class Way(NamedTuple):
    """A way to read the telemetry.

    `scalar`: "last" or "first"; `sense`: "body to reference" or "reference to body"; `frame`:
    reference of the quaternion: "J2000", "TEME" or "ECEF"; `axes`: body axes in terms of those of
    the sensor, such as ("x", "-z", "y"); `is_reflection`: axes of the other hand. `error_deg`: root
    mean square of the angles to the models' directions, without `far_rows` far beyond their median.
    """

    scalar: str
    sense: str
    frame: str
    axes: tuple[str, str, str]
    is_reflection: bool
    error_deg: float
    far_rows: int

    @property
    def text(self) -> str:
        """The way in words."""
        return f"scalar {self.scalar}, {self.sense}, {self.frame}, axes {' '.join(self.axes)}"


class Found(NamedTuple):
    """Ways of one sensor, best first, from `rows` usable rows; see `find_convention`."""

    sensor: str
    ways: tuple[Way, ...]
    rows: int

    @property
    def margin(self) -> float:
        """Error of the next best way over that of the best."""
        best, following = self.ways[0].error_deg, self.ways[1].error_deg
        return following / best if best > 0.0 else math.inf

    @property
    def stated(self) -> Way:
        """The way of the package: scalar last, body to J2000, axes as they are."""
        return next(way for way in self.ways if way[:4] == STATED)

    @property
    def agrees(self) -> bool:
        """Whether the telemetry agrees with the way of the package no worse than with the best."""
        stated = self.stated.error_deg
        return stated <= min(_GREATEST_DEG, _LEAST_MARGIN * self.ways[0].error_deg)

    @property
    def rivals(self) -> list[Way]:
        """The best way and those that the telemetry does not tell from it."""
        best = self.ways[0].error_deg
        return [way for way in self.ways if way.error_deg <= _LEAST_MARGIN * best]

    @property
    def is_wrong(self) -> bool:
        """Whether another way than that of the package is right, the reference frame aside."""
        ways = {(way.scalar, way.sense, way.axes) for way in self.rivals}
        return not self.agrees and len(ways) == 1 and self.ways[0].error_deg <= _GREATEST_DEG

    @property
    def verdict(self) -> str:
        """How well the way of the package fits, or which does, or that it is not known."""
        best, rivals = self.ways[0], self.rivals
        others = [way for way in self.ways if way not in rivals]
        then = f", next {others[0].error_deg:.2f} deg with {others[0].text}" if others else ""
        about = f"quaternions and {_WORDS[self.sensor]}"
        stated = f"{self.stated.error_deg:.2f} deg as they are"
        shown = self.stated if self.agrees else best
        if shown.far_rows:
            then += f"; {shown.far_rows} of {self.rows} rows are far off and left out"
        if self.agrees:
            alike = [way.text for way in rivals if way[:4] != STATED]
            rest = f"; {' and '.join(alike[:2])} cannot be ruled out" if alike else ""
            return f"{about} agree to {stated}{then}{rest}"
        if self.is_wrong:
            frames = " or ".join(way.frame for way in rivals)
            text = f"scalar {best.scalar}, {best.sense}, {frames}, axes {' '.join(best.axes)}"
            return f"{about} agree to {best.error_deg:.2f} deg with {text}{then}, {stated}"
        best_said = f"best {best.error_deg:.2f} deg with {best.text}"
        return f"{about}: do not know, {len(rivals)} ways fit alike; {best_said}{then}, {stated}"


def find_convention(
    telemetry: xr.Dataset, along: OrbitEnvironment, *, sensor: str = "field"
) -> Found:
    """Ways to read `q_measured` with the readings of a sensor, ranked by their error.

    `sensor`: "field" (`b_measured`) or "sun" (`sun_measured`, rows in full sunlight). `along`: the
    environment along the orbit, which starts at the first row; its orbit is None where the
    telemetry holds positions. Rows where a number is missing, the
    quaternion is not of length one or the vector is zero are left out. ValueError for fewer than
    three rows that remain.
    """
    t_s = telemetry["time"].values
    name = {"field": "b_measured", "sun": "sun_measured"}.get(sensor)
    if name is None:
        raise ValueError(f"sensor: must be 'field' or 'sun'; received {sensor!r}")
    for each in ("q_measured", name):
        if each not in telemetry:
            raise ValueError(f"telemetry: must have {each} for its convention; received none")
    q, read = telemetry["q_measured"].values, telemetry[name].values
    length = np.linalg.norm(q, axis=1)
    usable = (length > _LEAST_LENGTH) & (length < _GREATEST_LENGTH)
    usable &= np.linalg.norm(read, axis=1) > 0.0
    reference, lit = _directions(telemetry, along, sensor)
    usable &= lit
    if usable.sum() < _LEAST_ROWS:
        raise ValueError(
            f"telemetry: must have {_LEAST_ROWS} usable rows of q_measured and {name} for their "
            f"convention; received {usable.sum()}"
        )
    q, read = (x[usable] / np.linalg.norm(x[usable], axis=1)[:, None] for x in (q, read))
    axes_of_sensor = [(axis_names(matrix), matrix) for matrix in SIGNED_PERMUTATIONS]
    ways = []
    for frame, turn in _frames(along, t_s[usable]).items():
        wanted = np.einsum("nij,nj->ni", turn, reference[usable])
        for scalar, sense in itertools.product(("last", "first"), _SENSES):
            seen = _in_body(q, scalar, sense, wanted)
            ways += [
                Way(scalar, sense, frame, axes, bool(np.linalg.det(matrix) < 0.0),
                    *_rms_angle_deg(read @ matrix.T, seen))
                for axes, matrix in axes_of_sensor
            ]  # fmt: skip
    return Found(sensor, tuple(sorted(ways, key=lambda way: way.error_deg)), int(usable.sum()))


_SENSES = ("body to reference", "reference to body")


def _directions(telemetry, along: OrbitEnvironment, sensor: str) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors (n, 3) of the field or to the Sun in J, and which rows count (n,)."""
    around = environments_at_rows(telemetry, along)
    if sensor == "sun":
        return around.sun, around.sunlit_fraction > _LIT
    found = around.b / np.linalg.norm(around.b, axis=1)[:, None]
    return found, np.full(len(found), True)


def _frames(along: OrbitEnvironment, t_s) -> dict[str, np.ndarray]:
    """Rotations (n, 3, 3) from J to each frame to which a quaternion may refer.

    Under plain sidereal rotation J is the frame of date, and TEME is that frame.
    """
    given = along.environment
    turn = teme_to_gcrf(t_s, along.start, given.ut1_minus_utc_s)
    same = np.broadcast_to(np.eye(3), turn.shape)
    precise = given.earth_rotation == "precise"
    return {
        "J2000": same if precise else turn,
        "TEME": np.swapaxes(turn, 1, 2) if precise else same,
        "ECEF": along.dcm_to_ecef(t_s),
    }


def _in_body(q: np.ndarray, scalar: str, sense: str, reference: np.ndarray) -> np.ndarray:
    """Vectors (n, 3) of a reference frame in the body, as a way to read quaternions has it."""
    last = q if scalar == "last" else np.roll(q, -1, axis=1)
    form = "nji,nj->ni" if sense == _SENSES[0] else "nij,nj->ni"
    return np.einsum(form, dcm_body_to_reference(last), reference)


def _rms_angle_deg(a: np.ndarray, b: np.ndarray) -> tuple[float, int]:
    """Root mean square of the angles between unit vectors (n, 3), without those far beyond the
    median, and how many these are: single wrong rows do not speak for another way."""
    off = angles_deg(a, b)
    kept = off <= _FAR * np.median(off)
    return float(np.sqrt(np.mean(off[kept] ** 2))), int(np.sum(~kept))
