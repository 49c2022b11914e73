"""Conventions: frames, symbols, units, and what a control law sees. Read this page first.

Units. SI inside (m, s, rad, T, A m^2, kg m^2, N m). A name carries its unit wherever that
is not obvious, and always wherever it is not SI (`altitude_km`, `rate_deg_s`). Degrees,
kilometres and nanoteslas live at the edges only: scenario files, tables, plots.

Vectors are columns; `b_body` holds the components of the vector b in the body frame.
In kernels a vector is a tuple of three floats, a matrix a tuple of three row tuples.

Rotations. A quaternion is scalar-last (x, y, z, w) and takes body components to reference
components: `v_inertial = rotate(q_body_to_inertial, v_body)`. Direction cosines follow the
same order of words: `v_inertial = dcm_body_to_inertial @ v_body`. omega is the absolute
angular velocity in body axes: dq/dt = 1/2 q (omega, 0).

Frames (right-handed; O_a = centre of the Earth):
  J  inertial: GCRF (J2000). Under plain sidereal Earth rotation: equator and equinox of date.
  E  Earth-fixed: ITRF without polar motion.
  Y  Y3 along the Earth's axis (north), Y1 to the orbit's ascending node.
  Z  Y turned by Theta about Y1: Z3 = (0, -sin Theta, cos Theta) in Y, axis of the field cone.
  S  S3 along the orbit normal, S1 to the ascending node: Y turned by i about Y1.
  X  orbital: X3 along the radius vector (up), X2 along the orbit normal (the orbital angular
     momentum), X1 completes: along the motion on a circular orbit.
     (FIELD has X1 up, X2 along the motion, X3 normal; MAG and WHEEL have the X of this page
     up to the sign of X2; converted at the edge of each reproduced case.)
  x  body: where the inertia tensor is given; not necessarily principal axes.
  L  L3 along the angular momentum, L2 normal to L3 and parallel to the plane Z1 Z2.

Time. Civil times carry a zone. Inside, time is seconds since the start of the run (SI
seconds, so that no leap second bends an equation of motion). A field model's date is the
decimal year: year + (UTC seconds since 1 January 00:00) / (length of that year), at every instant
of a run; it runs on through a leap second, too. The model on board has the same date.

Symbols. u argument of latitude; omega0 orbital rate; i inclination; q0 = (x, y, z, w).
"""

import math
from typing import NamedTuple

#: Geocentric gravitational constant of EGM2008 [m^3/s^2].
MU_EARTH_M3_S2 = 3.986004415e14
#: Equatorial radius of WGS84 [m] and its flattening.
EARTH_RADIUS_M = 6378137.0
EARTH_FLATTENING = 1.0 / 298.257223563
#: Reference radius of geomagnetic field models [m].
FIELD_RADIUS_M = 6371200.0
#: Sidereal rotation rate of the Earth [rad/s].
EARTH_RATE_RAD_S = 7.292115146706979e-5
#: Radius of the Sun [m] and the astronomical unit [m].
SUN_RADIUS_M = 6.957e8
ASTRONOMICAL_UNIT_M = 149597870700.0


class Measured(NamedTuple):
    """All that an on-board computer knows at a sampling instant: never the truth.

    `b_rate_body_t_s` is what a search coil reads (the field's rate of change as the body
    sees it); the other vectors come from the models of magnetometer, gyro and Sun sensors.
    `sun_body` is a unit vector, or zeros when no sensor sees the Sun; a satellite whose Sun sensors
    are left out has an ideal one, which sees all the sky. The attitude comes from an
    attitude sensor (a star tracker, or what stands for a filter). Position, velocity and what
    the on-board field model says there are navigation, all inertial; they are not numbers unless
    the law says that it `navigates`. `wheel_momentum_body_n_m_s` is the vector sum of the wheels'
    momenta relative to the body, as their tachometers tell it (a fixed momentum of the body is
    not in it).
    """

    t_s: float
    b_body_t: tuple
    b_rate_body_t_s: tuple
    omega_body_rad_s: tuple
    sun_body: tuple
    q_body_to_inertial: tuple = (0.0, 0.0, 0.0, 1.0)
    r_inertial_m: tuple = (math.nan, math.nan, math.nan)
    v_inertial_m_s: tuple = (math.nan, math.nan, math.nan)
    b_inertial_t: tuple = (math.nan, math.nan, math.nan)
    b_rate_inertial_t_s: tuple = (math.nan, math.nan, math.nan)
    wheel_momentum_body_n_m_s: tuple = (0.0, 0.0, 0.0)
