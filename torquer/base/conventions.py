"""Conventions: frames, symbols, units, terms. Read this page first.

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

Terms.
  control cycle       a window of measurement, coils off, then one of actuation; or plain
                      sample and hold
  control step        the on-board computer's turn: estimator, modes, laws, command
  timetable           when each sensor is read and the computer controls, in steps
  inputs              what the computer knows: latest readings with their times, estimate,
                      ephemeris; never the truth
  ephemeris           the computer's own position, velocity, model field, direction to the Sun,
                      visible part of its disc
  estimate            attitude, rate and gyro bias that the computer believes, with their sigma
  law                 a function of the inputs that answers with a command
  command             dipole of the coils and torque on the body by the wheels
  allocation          how a torque is shared among the wheels, a dipole among the coils
  mode, region        a state of a state machine of the computer; machines run side by side
  host                a program outside the loop that takes the control step
  disturbance torque  torque that no actuator makes: gravity gradient, air, sunlight, residual
                      dipole, eddy currents, magnets and rods, energy sink, constant, random,
                      unmodelled
  gravity-gradient    radius vector with the length sqrt(3 mu/r^3), of which the torque is made
    vector
  local environment   field, gravity-gradient vector, air flow and sunlight at one instant
  environment tables  position, field, Sun and air along the orbit, tabulated before the run
  residual dipole     the satellite's own magnetic dipole, coils off
"""

#: A strong field in low orbit [T], for what coils can do at best.
STRONG_FIELD_T = 5e-5
#: Geocentric gravitational constant of EGM2008 [m^3/s^2].
MU_EARTH_M3_S2 = 3.986004415e14
#: Equatorial radius of WGS84 [m] and its flattening.
EARTH_RADIUS_M = 6378137.0
EARTH_FLATTENING = 1.0 / 298.257223563
#: Magnetic constant [H/m].
MU_0_H_M = 1.25663706212e-6
#: Reference radius of geomagnetic field models [m].
FIELD_RADIUS_M = 6371200.0
#: Sidereal rotation rate of the Earth [rad/s].
EARTH_RATE_RAD_S = 7.292115146706979e-5
#: Radius of the Sun [m] and the astronomical unit [m].
SUN_RADIUS_M = 6.957e8
ASTRONOMICAL_UNIT_M = 149597870700.0
