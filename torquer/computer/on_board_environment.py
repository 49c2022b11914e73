"""The ephemeris as an on-board computer works it out at one time, by kernels alone.

The satellite's place is given, or comes from elements that the ground sends up: of a Kepler orbit
that drifts by J2, or of SGP4. Rotation of the Earth and Sun are short series; the field is a sum of
spherical harmonics, with its change by the year.
"""

from typing import NamedTuple

import numpy as np

from torquer.base.time import DAY_S
from torquer.compile.engine import kernel, records
from torquer.computer.interface import Ephemeris
from torquer.environment.earth.concise import J2000_DAY, earth_at
from torquer.environment.earth.harmonics import Harmonics, gradient
from torquer.environment.earth.rotation_table import ERA_RATE_RAD_S
from torquer.environment.orbit.near_earth import sgp4_state
from torquer.environment.orbit.secular import drifting_state
from torquer.environment.sun import Shadow, sunlit_fraction_at
from torquer.maths.geometry.vec3 import (
    add_scaled,
    cross,
    mat_t_vec,
    mat_vec,
    put_vector,
    read_vector,
    scale,
    sub,
    unit,
)

_YEAR_DAYS = 365.25
#: The field is taken so long before and after [s]: half the sum is the field within 1e-12 T, the
#: difference gives its rate.
_ASIDE_S = 0.1
_SPIN = (0.0, 0.0, ERA_RATE_RAD_S)

_CLOCK = ("start_day", "start_fraction", "ut1_minus_utc_s", "tt_minus_utc_s")
_EPOCH = ("epoch_day", "epoch_fraction")
_ANGLES = ("inclination_deg", "raan_deg", "argument_of_perigee_deg", "mean_anomaly_deg")
#: Numbers of an ephemeris.
NUMBERS = 16
#: Numbers that the ground may send up, for each way to find the satellite's place. The clock is
#: last: no record is the beginning of another, of which Numba would warn.
ELEMENTS = {
    name: np.dtype([(each, np.float64) for each in (*own, *_CLOCK)])
    for name, own in {
        "given": (),
        "kepler": (*_EPOCH, "semi_major_axis_m", "eccentricity", *_ANGLES, "j2"),
        "sgp4": (*_EPOCH, "mean_motion_rev_day", "eccentricity", *_ANGLES, "drag_term"),
    }.items()
}


class Models(NamedTuple):
    """Constants: the field [T] at `epoch_year` and its change [T/yr], the Earth's shadow;
    `is_precise`: whether inertial axes are GCRF, else those of TEME."""

    field: Harmonics
    change: Harmonics
    epoch_year: float
    shadow: Shadow
    is_precise: bool


@kernel
def _earth_now(models, elements, t):
    """The Earth's rotation and the Sun at t seconds after the start."""
    days = elements.start_fraction + (t + elements.ut1_minus_utc_s) / DAY_S
    days += elements.start_day - J2000_DAY
    return earth_at(days, elements.tt_minus_utc_s - elements.ut1_minus_utc_s, models.is_precise)


@kernel
def _since_epoch(elements, t):
    """Seconds since the epoch of elements at t seconds after the start."""
    days = elements.start_day - elements.epoch_day
    return t + DAY_S * (days + (elements.start_fraction - elements.epoch_fraction))


@kernel
def _field_at(models, years, r_ecef):
    """Field [T] at an Earth-fixed position [m], so many years after the epoch of the model."""
    return add_scaled(gradient(models.field, r_ecef), years, gradient(models.change, r_ecef))


@kernel
def _around(models, elements, t, earth, r, v):
    """The ephemeris at a position [m] and a velocity [m/s]."""
    days = elements.start_day - (J2000_DAY - 0.5) + elements.start_fraction + t / DAY_S
    years = 2000.0 + days / _YEAR_DAYS - models.epoch_year
    r_ecef = mat_vec(earth.to_ecef, r)
    v_ecef = sub(mat_vec(earth.to_ecef, v), cross(_SPIN, r_ecef))
    before = _field_at(models, years, add_scaled(r_ecef, -_ASIDE_S, v_ecef))
    after = _field_at(models, years, add_scaled(r_ecef, _ASIDE_S, v_ecef))
    b = scale(0.5, (before[0] + after[0], before[1] + after[1], before[2] + after[2]))
    b_rate = add_scaled(cross(_SPIN, b), 0.5 / _ASIDE_S, sub(after, before))
    return Ephemeris(
        r,
        v,
        mat_t_vec(earth.to_ecef, b),
        mat_t_vec(earth.to_ecef, b_rate),
        unit(sub(earth.sun, r)),
        sunlit_fraction_at(models.shadow, r, earth.sun),
    )


@kernel
def given_ephemeris(models, elements, t, r, v):
    """The ephemeris at t seconds after the start, position [m] and velocity [m/s] given."""
    return _around(models, elements, t, _earth_now(models, elements, t), r, v)


@kernel
def kepler_ephemeris(models, elements, t):
    """The ephemeris at t seconds after the start, by a Kepler orbit that drifts by J2."""
    r, v = drifting_state(elements, _since_epoch(elements, t))
    return _around(models, elements, t, _earth_now(models, elements, t), r, v)


@kernel
def sgp4_ephemeris(models, elements, t):
    """The ephemeris at t seconds after the start, by SGP4."""
    earth = _earth_now(models, elements, t)
    r, v = sgp4_state(elements, _since_epoch(elements, t))
    return _around(
        models, elements, t, earth, mat_t_vec(earth.to_teme, r), mat_t_vec(earth.to_teme, v)
    )


@kernel
def _put(cells, e):
    """Write an ephemeris into the cells of a row."""
    put_vector(cells, e.r_inertial_m)
    put_vector(cells[3:], e.v_inertial_m_s)
    put_vector(cells[6:], e.b_inertial_t)
    put_vector(cells[9:], e.b_rate_inertial_t_s)
    put_vector(cells[12:], e.sun_inertial)
    cells[15] = e.sunlit_fraction


@kernel
def _given_along(models, elements, t_s, r, v, out):
    for k in range(t_s.size):
        position, velocity = read_vector(r[k]), read_vector(v[k])
        _put(out[k], given_ephemeris(models, elements[0], t_s[k], position, velocity))


@kernel
def _kepler_along(models, elements, t_s, r, v, out):
    for k in range(t_s.size):
        _put(out[k], kepler_ephemeris(models, elements[0], t_s[k]))


@kernel
def _sgp4_along(models, elements, t_s, r, v, out):
    for k in range(t_s.size):
        _put(out[k], sgp4_ephemeris(models, elements[0], t_s[k]))


#: The kernel that C is made of, and the one for many times, for each way to find the place.
KINDS = {
    "given": (given_ephemeris, _given_along),
    "kepler": (kepler_ephemeris, _kepler_along),
    "sgp4": (sgp4_ephemeris, _sgp4_along),
}


def ephemeris_along(kind: str, models: Models, elements: np.ndarray, t_s, r_m, v_m_s) -> np.ndarray:
    """Ephemerides [n, 16] at times [n] s: position, velocity, field, its rate, Sun, its light.

    `elements`: one row of `ELEMENTS[kind]`; positions [n, 3] m and velocities [n, 3] m/s are those
    of the satellite where they are given, else they do not matter.
    """
    arrays = [np.ascontiguousarray(each, dtype=np.float64) for each in (t_s, r_m, v_m_s)]
    out = np.empty((len(arrays[0]), NUMBERS))
    KINDS[kind][1](models, records(elements), *arrays, out)
    return out
