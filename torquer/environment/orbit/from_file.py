"""An orbit from a file: positions at given instants, or elements for SGP4."""

from datetime import UTC
from functools import lru_cache
from typing import Annotated, Literal, NamedTuple

import erfa
import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from torquer.base.conventions import EARTH_RATE_RAD_S
from torquer.base.time import parse_utc, tai_minus_utc
from torquer.base.user_code import OwnFile
from torquer.environment.earth.rotation import dcm_inertial_to_ecef, teme_to_gcrf
from torquer.environment.orbit.files import Asked, in_file, read_orbit_file
from torquer.environment.orbit.files.elements import ElementSet
from torquer.environment.orbit.files.stamps import seconds_behind
from torquer.environment.orbit.files.states import Interpolation, States, checked, interpolate
from torquer.environment.orbit.kepler import TWO_PI, Extent, Orbit
from torquer.environment.orbit.osculating import extent_of, mean_rate

#: Instants of a file after its last, or before its first, for which it may still be asked:
#: a table's last segment goes beyond the run.
_BEYOND = 1.0
#: Julian date of the epoch J2000, to which the axes EME2000 belong.
_J2000 = (2451545.0, 0.0)


class _Known(NamedTuple):
    """What a file says of an orbit, in GCRF: its instants, their polynomials, a mean rate."""

    states: States
    polynomials: Interpolation
    rate_rad_s: float


def _checked_name(value) -> str | None:
    """A name, or a catalogue number, which may be written as a number."""
    if type(value) in (int, float) and value == value // 1 and value >= 0:
        return str(int(value))
    if value is not None and not (isinstance(value, str) and value.strip()):
        raise ValueError(
            f"satellite: must be a name or a catalogue number, a whole one; received {value!r}"
        )
    return value


class FileOrbit(OwnFile, Orbit):
    """An orbit from a file: OEM or OMM of CCSDS, SP3, CSV, or two-line elements.

    Positions are interpolated by polynomials through those around them, of degree 9, or of degree
    11 with velocities if that tells more. A run in which this may be in error by more than
    `greatest_error_m` is refused, and so are gaps and damaged positions. Of several sets of
    elements the one nearest to the start is taken.
    """

    kind: Literal["file"]
    satellite: Annotated[str | None, BeforeValidator(_checked_name)] = None
    """Name or catalogue number of the satellite in a file of several."""
    axes: Literal["GCRF", "EME2000", "TEME", "ECEF"] | None = None
    """Axes of the positions in a CSV file; other formats say them."""
    without_checksums: bool = False
    """Whether two-line elements may end before their checksums, as in old archives: nothing then
    shows a slip.
    """
    greatest_error_m: float = Field(default=100.0, gt=0.0)
    """Greatest error of interpolation, as it is estimated, during a run."""

    @property
    def frame(self) -> str:
        """Frame of `state`."""
        found = self._read()
        return "GCRF" if isinstance(found, States) else "TEME"

    def rate_rad_s(self, start_utc=None) -> float:
        """Mean orbital rate [rad/s]: over the first revolution of positions, or of the elements."""
        if isinstance(self._read(), States):
            return self._known(0.0).rate_rad_s
        return self.elements(start_utc).orbit.rate_rad_s()

    def extent(self, start_utc=None) -> Extent:
        """Perigee, apogee and inclination: osculating, or of the elements."""
        if not isinstance(self._read(), States):
            return self.elements(start_utc).orbit.extent()
        r, v = self.state(np.zeros(1), start_utc)
        return extent_of(r[0], v[0])

    def state(self, t_s, start_utc, dut1_s: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Position [n, 3] m and velocity [n, 3] m/s at times [n] s after the start."""
        t_s = np.atleast_1d(np.asarray(t_s, dtype=np.float64))
        if not isinstance(self._read(), States):
            return self._by_elements(t_s, start_utc)
        known, since = self._at(t_s, start_utc, dut1_s)
        self._check_covered(known, since, start_utc, _BEYOND * self.step_s)
        return known.polynomials.at(since)

    def check_span(self, start_utc, *times_s: float) -> None:
        """ValueError for a run beyond the file, or where interpolation may be too far off."""
        if not isinstance(self._read(), States):
            return
        known, since = self._at(np.array(times_s), start_utc, 0.0)
        self._check_covered(known, since, start_utc, 1e-6)
        states, within = known.states, slice(*_intervals(known, since))
        error = known.polynomials.error_m[within]
        worst = int(np.argmax(error)) + within.start
        if not error.max() <= self.greatest_error_m:
            before, after = states.lines[worst], states.lines[worst + 1]
            raise ValueError(
                f"orbit.file: {self.file.name}: between lines {before} and {after}, "
                f"{np.diff(states.t_s)[worst]:g} s apart, positions must be known to "
                f"greatest_error_m = {self.greatest_error_m:g} m; received an error of "
                f"{error.max():.2g} m (a gap or a damaged position?)"
            )

    def interpolation_error_m(self, start_utc, *times_s: float) -> float | None:
        """Estimate of the greatest error of interpolation between two times [s]; None of SGP4."""
        if not isinstance(self._read(), States):
            return None
        known, since = self._at(np.array(times_s), start_utc, 0.0)
        return float(known.polynomials.error_m[slice(*_intervals(known, since))].max())

    def in_words(self, start_utc, length_s: float) -> str:
        """What the file gives for a run of a length, in a line."""
        error_m = self.interpolation_error_m(start_utc, 0.0, length_s)
        if error_m is None:
            found = self.elements(start_utc)
            return (
                f"orbit: SGP4 with the elements of {found.called} of "
                f"{found.epoch:%Y-%m-%d %H:%M} UTC in {self.file.name}"
            )
        return (
            f"orbit: positions every {self.step_s:g} s in {self.file.name}, known between them to "
            f"{error_m:.2g} m"
        )

    @property
    def step_s(self) -> float | None:
        """Usual interval between two positions [s]; None of SGP4."""
        found = self._read()
        return float(np.median(np.diff(found.t_s))) if isinstance(found, States) else None

    def knot_s(self, start_utc) -> float:
        """Time of the first position [s]: polynomials join there, and every `step_s` on."""
        return -float(self._at(np.zeros(1), start_utc, 0.0)[1][0])

    @model_validator(mode="after")
    def _can_be_read(self):
        if self.file.is_file():  # a result may stand without it
            found = self._read_file()
            if isinstance(found, States):
                _in_gcrf(_Whole(found), 0.0, self.file.name)
        return self

    def _read(self):
        try:
            return self._read_file()
        except ValueError as error:
            raise ValueError(f"orbit.{error}") from None

    def _read_file(self):
        asked = Asked(self.satellite, self.axes, self.without_checksums)
        return read_orbit_file(self.file, asked)

    def _by_elements(self, t_s, start_utc) -> tuple[np.ndarray, np.ndarray]:
        try:
            return self.elements(start_utc).orbit.state(t_s, start_utc)
        except ValueError as error:
            when = str(error).removeprefix("sgp4: no orbit ")
            must = "must hold elements of an orbit throughout the run; received none"
            raise ValueError(f"orbit.{in_file(self.file.name, must)} {when}") from None

    def elements(self, start_utc) -> ElementSet:
        """Of several sets the one nearest to the start; the last without a start."""
        orbits = self._read()
        if start_utc is None:
            return max(orbits, key=lambda each: each.epoch)
        start = parse_utc(start_utc, "start")
        return min(orbits, key=lambda each: abs(each.epoch - start))

    def count_sets(self) -> int:
        """Sets of elements of the satellite in the file."""
        return len(self._read())

    def _known(self, dut1_s: float) -> _Known:
        return _in_gcrf(_Whole(self._read()), dut1_s, self.file.name)

    def _at(self, t_s, start_utc, dut1_s: float) -> tuple[_Known, np.ndarray]:
        """What is known; the times as seconds after its first instant."""
        known, start = self._known(dut1_s), parse_utc(start_utc, "start")
        stamp = np.datetime64(start.replace(tzinfo=None), "ns")
        tai = stamp + np.timedelta64(round(1e9 * float(tai_minus_utc(stamp))), "ns")
        return known, t_s + (tai - known.states.tai[0]) / np.timedelta64(1, "s")

    def _check_covered(self, known: _Known, since, start_utc, margin_s: float) -> None:
        end = known.states.t_s[-1]
        early, late = float(np.min(since)), float(np.max(since))
        if early < -margin_s or late > end + margin_s:
            lacks = [f"{-early:g} s at its start"] if early < -margin_s else []
            lacks += [f"{late - end:g} s at its end"] if late > end + margin_s else []
            first, last = (str(known.states.tai[k])[:19] for k in (0, -1))
            raise ValueError(
                f"orbit.file: {self.file.name}: must cover the run; received positions that lack "
                f"{' and '.join(lacks)} (they are from {first} to {last} TAI)"
            )


class _Whole:
    """States as a key: those of one reading are the same object."""

    def __init__(self, states: States):
        self.states = states

    def __hash__(self):
        return id(self.states.tai)

    def __eq__(self, other):
        return self.states.tai is other.states.tai


@lru_cache(maxsize=8)
def _in_gcrf(whole: _Whole, dut1_s: float, name: str) -> _Known:
    states = _turned(whole.states, dut1_s)
    if whole.states.axes == "ECEF":
        _checked_in(name, states)
    polynomials = interpolate(states)
    r, v = polynomials.at(states.t_s)
    once = states.t_s <= TWO_PI / mean_rate(r[:1], v[:1])
    return _Known(states, polynomials, mean_rate(r[once], v[once]))


def _checked_in(name: str, states: States) -> None:
    try:
        checked(states)
    except ValueError as error:
        raise ValueError(in_file(name, str(error))) from None


def _turned(states: States, dut1_s: float) -> States:
    """States in GCRF."""
    if states.axes == "GCRF":
        return states
    to_gcrf, spin = _to_gcrf(states, dut1_s), np.zeros(3)
    if states.axes == "ECEF":
        spin[2] = EARTH_RATE_RAD_S
    r = np.einsum("nij,nj->ni", to_gcrf, states.r)
    v = states.v
    if v is not None:
        v = np.einsum("nij,nj->ni", to_gcrf, v + np.cross(spin, states.r))
    return states._replace(r=r, v=v, axes="GCRF")


def _to_gcrf(states: States, dut1_s: float) -> np.ndarray:
    """Axes of a file to GCRF, [n, 3, 3]."""
    if states.axes == "EME2000":
        bias = erfa.bp06(*_J2000)[0]
        return np.broadcast_to(bias.T, (len(states.tai), 3, 3))
    utc = states.tai[0] - np.timedelta64(round(1e9 * seconds_behind(states.tai[0])), "ns")
    start = utc.astype("datetime64[us]")
    t_s = states.t_s + (utc - start) / np.timedelta64(1, "s")
    first = start.item().replace(tzinfo=UTC)
    if states.axes == "TEME":
        return teme_to_gcrf(t_s, first, dut1_s)
    return np.swapaxes(dcm_inertial_to_ecef(t_s, first, "precise", dut1_s), -1, -2)


def _intervals(known: _Known, since) -> tuple[int, int]:
    """The first interval between positions that a run meets, and the one after the last."""
    t = known.states.t_s
    first, last = np.searchsorted(t, [np.min(since), np.max(since)], side="right") - 1
    first = min(max(int(first), 0), len(t) - 2)
    return first, min(max(int(last), first), len(t) - 2) + 1
