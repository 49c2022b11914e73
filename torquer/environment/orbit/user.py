"""An orbit by a function of the user's own."""

from typing import Literal

import numpy as np
from pydantic import Field

from torquer.base.conventions import EARTH_RADIUS_M, EARTH_RATE_RAD_S, MU_EARTH_M3_S2
from torquer.base.time import parse_utc
from torquer.base.user_code import UserCode
from torquer.environment.earth.rotation import dcm_inertial_to_ecef
from torquer.environment.orbit.kepler import FARTHEST_KM, TWO_PI, Extent, Orbit
from torquer.environment.orbit.osculating import extent_of, mean_rate

#: Interval [s] between three positions that show how they move, and at how many places they do.
_APART_S, _PLACES = 10.0, 5
#: Part by which velocity and acceleration may differ from those of an orbit, as in a file's, and
#: `revolution_s` from the time of a revolution at the start.
_MOST_OFF, _REVOLUTION_OFF = 0.03, 0.1


class UserOrbit(UserCode, Orbit):
    """An orbit of your own: a function `(t_s, start, **parameters)` in a Python file.

    It gets the times `t_s` (n,) in seconds after `start`, a `datetime` in UTC, and returns
    positions (n, 3) in metres and velocities (n, 3) in m/s. It is called for many instants at once
    and tabulated: it need not be fast, but smooth. A run is refused where the positions do not move
    under gravity in `axes`, or the velocities are not theirs.
    """

    kind: Literal["user"]
    axes: Literal["GCRF", "TEME", "ECEF", "J"] = "GCRF"
    """Axes of positions and velocities: 'GCRF', 'TEME', 'ECEF' (turning with the Earth, velocities
    relative to it) or 'J' (the inertial axes of the run, whichever `environment.earth_rotation`
    makes them).
    """
    revolution_s: float = Field(gt=0.0)
    """Time of a revolution, to a tenth: the unit of `simulation.revolutions` and of reports."""
    place = "orbit"
    takes = 2
    returns = "a function (t_s, start) that returns positions (n, 3) m and velocities (n, 3) m/s"

    @property
    def frame(self) -> str:
        """Frame of `state`."""
        return "GCRF" if self.axes == "ECEF" else self.axes

    def rate_rad_s(self, start_utc=None) -> float:
        """Mean orbital rate [rad/s]."""
        return TWO_PI / self.revolution_s

    def extent(self, start_utc=None) -> Extent:
        """Perigee, apogee and inclination of the osculating orbit at the start."""
        r, v = self.state(np.zeros(1), start_utc)
        return extent_of(r[0], v[0])

    def state(self, t_s, start_utc, dut1_s: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Position [n, 3] m and velocity [n, 3] m/s at times [n] s after the start."""
        t_s = np.atleast_1d(np.asarray(t_s, dtype=np.float64))
        found = self.call(t_s.copy(), parse_utc(start_utc, "start"))
        if not isinstance(found, tuple | list) or len(found) != 2:
            raise self.refusal(f"{type(found).__name__}")
        r, v = (self._checked(each, t_s) for each in found)
        self._check_units(t_s, r, v)
        if self.axes != "ECEF":
            return r, v
        to_gcrf = np.swapaxes(dcm_inertial_to_ecef(t_s, start_utc, "precise", dut1_s), -1, -2)
        v = v + np.cross((0.0, 0.0, EARTH_RATE_RAD_S), r)
        return tuple(np.einsum("nij,nj->ni", to_gcrf, each) for each in (r, v))

    def check_span(self, start_utc, *times_s: float) -> None:
        """ValueError where velocities, axes or `revolution_s` are not those of the positions.

        Seen at places along a fifth of a revolution, of which a thrust may disturb some.
        """
        first_s = min(times_s)
        length_s = min(max(times_s) - first_s, 0.2 * self.revolution_s)
        begin_s = first_s + length_s * np.linspace(0.0, 1.0, _PLACES)
        t_s = (begin_s[:, None] + _APART_S * np.arange(3)).ravel()
        before, (r, v), after = self._thirds(t_s, start_utc)
        moved = (after[0] - before[0]) / (2.0 * _APART_S)
        falls = (after[0] - 2.0 * r + before[0]) / _APART_S**2
        pull = -MU_EARTH_M3_S2 * r / np.linalg.norm(r, axis=1)[:, None] ** 3
        since = f"from t = {first_s:g} s on"
        if (off := _median_off(falls, pull)) > _MOST_OFF:
            raise self.refusal(
                f"accelerations off by {100.0 * off:.3g} % {since} (other axes?)",
                f", that move under gravity in axes {self.axes}",
            )
        if (off := _median_off(v, moved)) > _MOST_OFF:
            raise self.refusal(
                f"velocities off by {100.0 * off:.3g} % {since} (another unit or frame?)",
                ", those of these positions",
            )
        if first_s < self.revolution_s:  # later it may be another, on a spiral
            self._check_revolution(*before)

    def _thirds(self, t_s, start_utc) -> list[tuple[np.ndarray, np.ndarray]]:
        """Positions and velocities at every third of some times, from the first, second, third."""
        r, v = self.state(t_s, start_utc)
        return [(r[k::3], v[k::3]) for k in range(3)]

    def _check_revolution(self, r, v) -> None:
        found_s = TWO_PI / mean_rate(r[:1], v[:1])
        if not abs(self.revolution_s / found_s - 1.0) <= _REVOLUTION_OFF:
            raise ValueError(
                f"{self.own_key}.revolution_s: must be the time of a revolution to a tenth, "
                f"{found_s:.4g} s by position and velocity at the start; received "
                f"{self.revolution_s:g} ({self.function_in_words()})"
            )

    def where(self, t_s, start) -> str:
        """Time of the first row."""
        return f"at t = {t_s[0]:g} s"

    def _check_units(self, t_s, r, v) -> None:
        """ValueError for a place within the Earth or far beyond it, and a speed beyond escape.

        Kilometres taken for metres are the first.
        """
        radius, speed = (np.linalg.norm(each, axis=1) for each in (r, v))
        near = (radius > 0.98 * EARTH_RADIUS_M) & (radius < 1e3 * FARTHEST_KM)
        bound = speed * speed * radius < 1.1 * 2.0 * MU_EARTH_M3_S2
        if not (near & bound).all():
            row = int(np.flatnonzero(~(near & bound))[0])
            raise self.refusal(
                f"{radius[row]:.6g} m from its centre and {speed[row]:.6g} m/s at "
                f"t = {t_s[row]:g} s",
                ", of an orbit about the Earth",
            )

    def _checked(self, value, t_s) -> np.ndarray:
        array = self.numbers(value)
        if array.shape != (t_s.size, 3):
            raise self.refusal(f"shape {array.shape} for n = {t_s.size}")
        if not (finite := np.isfinite(array).all(axis=1)).all():
            row = np.flatnonzero(~finite)[0]
            raise self.refusal(f"{array[row].tolist()} at t = {t_s[row]:g} s", ", finite")
        return array


def _median_off(found, expected) -> float:
    """Median of the part by which vectors [n, 3] differ from what is expected."""
    size = np.maximum(np.linalg.norm(expected, axis=1), 1e-9)
    return float(np.median(np.linalg.norm(found - expected, axis=1) / size))
