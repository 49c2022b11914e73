"""Positions of an orbit at given instants: checked, turned to inertial axes, interpolated.

Between two instants a polynomial passes through those around them. Its error is estimated by the
difference to the polynomial of two instants less, which is above the error wherever polynomials
converge, and by the rounding of the file. Velocities that are not the derivative of the positions,
as those of mean elements are not, would bend it: where positions alone tell more, they alone count.
Noise of the positions is no part of the estimate.
"""

import math
import re
from typing import NamedTuple

import numpy as np

from torquer.base.conventions import EARTH_RADIUS_M, MU_EARTH_M3_S2
from torquer.environment.orbit.kepler import FARTHEST_KM

#: Instants that a polynomial passes through, with velocities at them and without.
_LEAST = 4
_WITH_VELOCITIES, _POSITIONS_ONLY = 6, 10
#: Decimals beyond which no file is rounded.
_MOST_DECIMALS = 13
#: By how much a polynomial in the middle of its instants enlarges the rounding of positions.
_ENLARGED = 1.5
#: Places between two instants where the error is estimated.
_PLACES = np.array([0.25, 0.5, 0.75])
#: Interval over which accelerations are taken from positions, if they are not further apart [s].
_BASE_S = 60.0
#: Part by which accelerations may differ from that of a point mass; in turning axes they differ by
#: a tenth in low orbits. Velocities likewise.
_MOST_OFF = 0.03
#: The Earth's Hill sphere [m]: nothing orbits the Earth beyond it.
_FARTHEST_M = 1e3 * FARTHEST_KM
#: Axes by the names that files give them.
AXES = {
    "GCRF": "GCRF", "ICRF": "GCRF", "EME2000": "EME2000", "J2000": "EME2000", "TEME": "TEME",
    "TEMEOFDATE": "TEME", "ECEF": "ECEF",
}  # fmt: skip
#: Realisations of ITRS, a decimetre from one another at most: ITRF2020, ITR20, IGb14, SLRF2014; and
#: TDR, from which they differ by polar motion, which is neglected. WGS before 1984 and PZ-90 are
#: metres away, ETRF moves with Europe.
_REALISATION = re.compile(
    r"(ITRF?|IG[BCS]R?|[DJ]TRF?|SLRF?|SLF|GTRF?|CGCS|CGS)[0-9]*[A-Z]?|WGS(84.*)?|TDR"
)


class States(NamedTuple):
    """Positions (n, 3) [m] at instants (n,), TAI as datetime64[ns]; velocities [m/s] or None.

    `axes`: a value of `AXES`; `lines`: of the file, for messages; `rounding_m`: greatest error of a
    position by the digits that are written.
    """

    tai: np.ndarray
    r: np.ndarray
    v: np.ndarray | None
    axes: str
    lines: np.ndarray
    rounding_m: float

    @property
    def t_s(self) -> np.ndarray:
        """Seconds after the first instant (n,)."""
        return (self.tai - self.tai[0]) / np.timedelta64(1, "s")


def axes_named(name: str) -> str:
    """The axes that a file names; of the many realisations of ITRS none in particular."""
    word = re.sub(r"[-_ .]", "", name.upper())
    word = re.sub(r"^ICRF[1-3]$", "ICRF", word)
    if word in AXES:
        return AXES[word]
    if _REALISATION.fullmatch(word) is None:
        raise ValueError(
            f"axes must be one of {', '.join(AXES)}, or a realisation of ITRS such as ITRF2020, "
            f"IGS20 or WGS84; received {name!r}"
        )
    return "ECEF"


def rounding(numbers: np.ndarray, unit: float = 1.0) -> float:
    """Greatest error [m] of vectors (n, k) by rounding to the digits that their numbers have.

    `unit`: of the numbers [m]. The number with most digits tells how many the largest one has.
    """
    sizes = np.abs(numbers[numbers != 0.0])
    if not sizes.size:
        return 0.0
    decimals = np.full(sizes.shape, _MOST_DECIMALS)
    for fewer in range(_MOST_DECIMALS - 1, -1, -1):
        scaled = sizes * 10.0**fewer
        whole = np.abs(scaled - np.rint(scaled)) <= 2.0 * np.spacing(scaled)
        decimals = np.where(whole, fewer, decimals)
    before = np.floor(np.log10(sizes)) + 1
    last = before.max() - (before + decimals).max()
    return 0.5 * 10.0**last * math.sqrt(numbers.shape[1]) * unit


def checked(states: States) -> States:
    """The states, if they are those of an orbit about the Earth in their axes; ValueError by line.

    The accelerations that positions show must be those of gravity: in other axes than those that
    are stated, or in other units, they are not.
    """
    count = len(states.tai)
    if count < _LEAST:
        raise ValueError(f"must hold {_LEAST} or more positions; received {count}")
    later = np.diff(states.t_s) > 0.0
    _refuse(states, 1 + np.flatnonzero(~later), "must be later than the position before it")
    radius = np.linalg.norm(states.r, axis=1)
    outside = ~((radius > 0.98 * EARTH_RADIUS_M) & (radius < _FARTHEST_M))
    _refuse(
        states, np.flatnonzero(outside), "position must lie above the Earth and within 1.5e6 km",
        lambda k: f"one {1e-3 * radius[k]:.6g} km from its centre",
    )  # fmt: skip
    if states.axes != "ECEF":
        _check_motion(states, *_from_positions(states))
    return states


def _refuse(states: States, rows: np.ndarray, must: str, received=None) -> None:
    if len(rows):
        row = int(rows[0])
        what = f"{states.tai[row]} TAI" if received is None else received(row)
        raise ValueError(f"line {states.lines[row]}: {must}; received {what}")


def _from_positions(states: States) -> tuple:
    """Rows, and at each of them velocity (m/s) and acceleration (m/s^2) that positions show.

    By differences to positions about `_BASE_S` before and after, evenly spaced or not; what they
    leave out of a motion about a point mass is put back.
    """
    t, r = states.t_s, states.r
    base = max(_BASE_S, float(np.median(np.diff(t))))
    early = np.searchsorted(t, t - base * 1.001)
    late = np.searchsorted(t, t + base * 1.001, side="right") - 1
    rows = np.arange(len(t))
    rows = rows[(early < rows) & (late > rows)]
    h1, h2 = (t[rows] - t[early[rows]])[:, None], (t[late[rows]] - t[rows])[:, None]
    before, after = (r[rows] - r[early[rows]]) / h1, (r[late[rows]] - r[rows]) / h2
    rate = MU_EARTH_M3_S2 / np.linalg.norm(r[rows], axis=1)[:, None] ** 3
    velocity = (h2 * before + h1 * after) / (h1 + h2) / (1.0 - rate * h1 * h2 / 6.0)
    acceleration = 2.0 * (after - before) / (h1 + h2)
    # of third order in uneven intervals: the jerk is the rate times the velocity
    acceleration += rate * velocity * (h2 - h1) / 3.0
    acceleration /= 1.0 - rate * (h1 * h1 - h1 * h2 + h2 * h2) / 12.0
    usable = (rate * np.maximum(h1, h2) ** 2)[:, 0] < 0.5
    return rows[usable], velocity[usable], acceleration[usable]


def _check_motion(states: States, rows, velocity, acceleration) -> None:
    if not len(rows):
        raise ValueError(
            "must hold positions close enough to one another to show how they move; received none"
        )
    r = states.r[rows]
    gravity = -MU_EARTH_M3_S2 * r / np.linalg.norm(r, axis=1)[:, None] ** 3
    off = _relative(acceleration - gravity, gravity)
    _refuse(
        states, rows[off > _MOST_OFF],
        "positions must move under gravity in the axes stated",
        lambda k: f"an acceleration that is off by {100.0 * off[rows == k][0]:.2g} % (other axes, "
        "another unit or a damaged position?)",
    )  # fmt: skip
    if states.v is not None:
        wrong = _relative(states.v[rows] - velocity, velocity)
        _refuse(
            states, rows[wrong > _MOST_OFF],
            "velocity must be that of the positions around it",
            lambda k: f"one that is off by {100.0 * wrong[rows == k][0]:.2g} %",
        )  # fmt: skip


def _relative(difference, of) -> np.ndarray:
    return np.linalg.norm(difference, axis=1) / np.linalg.norm(of, axis=1)


class Interpolation(NamedTuple):
    """Polynomials between instants: `t_s` (n,), `middle_s` and `scale_s` (n - 1,) of the argument,
    Newton's `nodes` and `coefficients` (n - 1, degree + 1[, 3]); `error_m` (n - 1,)."""

    t_s: np.ndarray
    middle_s: np.ndarray
    scale_s: np.ndarray
    nodes: np.ndarray
    coefficients: np.ndarray
    error_m: np.ndarray

    def at(self, t_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Position [m] and velocity [m/s] at seconds after the first instant, (n, 3) each."""
        which = np.clip(np.searchsorted(self.t_s, t_s, side="right") - 1, 0, len(self.t_s) - 2)
        return self._at(which, t_s)

    def _at(self, which, t_s):
        x = ((t_s - self.middle_s[which]) / self.scale_s[which])[:, None]
        nodes, coefficients = self.nodes[which], self.coefficients[which]
        value, slope = coefficients[:, -1], np.zeros((len(x), 3))
        for k in range(coefficients.shape[1] - 2, -1, -1):
            away = x - nodes[:, k, None]
            slope = slope * away + value
            value = value * away + coefficients[:, k]
        return value, slope / self.scale_s[which][:, None]


def interpolate(states: States) -> Interpolation:
    """The polynomials of states in inertial axes, with the estimates of their errors."""
    by_positions = _estimated(states._replace(v=None), _POSITIONS_ONLY)
    found = by_positions
    if states.v is not None:
        with_velocities = _estimated(states, _WITH_VELOCITIES)
        apart = _difference(with_velocities, by_positions)
        bent = np.where(apart > by_positions.error_m, apart, 0.0)
        error = np.maximum(with_velocities.error_m, bent)
        if error.max() < by_positions.error_m.max():
            found = with_velocities._replace(error_m=error)
    return found._replace(error_m=found.error_m + _ENLARGED * states.rounding_m)


def _estimated(states: States, wanted: int) -> Interpolation:
    """Polynomials through so many instants, with what two less differ by."""
    count = min(wanted, len(states.tai) // 2 * 2)
    whole = _polynomials(states, count)
    return whole._replace(error_m=_difference(whole, _polynomials(states, count - 2)))


def _difference(a: Interpolation, b: Interpolation) -> np.ndarray:
    """Greatest distance [m] of two polynomials in each interval."""
    t, found = a.t_s, np.zeros(len(a.t_s) - 1)
    for place in _PLACES:
        at = t[:-1] + place * np.diff(t)
        which = np.arange(len(at))
        apart = a._at(which, at)[0] - b._at(which, at)[0]
        found = np.maximum(found, np.linalg.norm(apart, axis=1))
    return found


def _polynomials(states: States, count: int) -> Interpolation:
    t, n = states.t_s, len(states.tai)
    first = np.clip(np.arange(n - 1) - count // 2 + 1, 0, n - count)
    window = first[:, None] + np.arange(count)
    middle = 0.5 * (t[window[:, 0]] + t[window[:, -1]])
    scale = 0.5 * (t[window[:, -1]] - t[window[:, 0]])
    x = (t[window] - middle[:, None]) / scale[:, None]
    slopes = None if states.v is None else states.v[window] * scale[:, None, None]
    nodes, coefficients = _divided(x, states.r[window], slopes)
    return Interpolation(t, middle, scale, nodes, coefficients, np.zeros(n - 1))


def _divided(x, values, slopes):
    """Newton's divided differences through values and, unless None, slopes at each place x."""
    if slopes is not None:
        x, values = np.repeat(x, 2, axis=1), np.repeat(values, 2, axis=1)
    found, table = [values[:, 0]], values
    for order in range(1, x.shape[1]):
        away = (x[:, order:] - x[:, :-order])[:, :, None]
        same = away == 0.0
        quotient = np.diff(table, axis=1) / np.where(same, 1.0, away)
        if order == 1 and slopes is not None:
            quotient[:, ::2] = slopes
        table = quotient
        found.append(table[:, 0])
    return x, np.stack(found, axis=1)
