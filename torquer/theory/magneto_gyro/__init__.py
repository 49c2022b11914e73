"""Linear theory of the magneto-gyroscopic system: exact and frozen models, limits, design.

In units of the satellite: time 1/nu0, torque J nu0^2, field A = 1.5 B0, with the orbital rate nu0,
J the root of the product of the moments of inertia about roll and yaw, B0 the part of the equator's
field in the orbit's plane. `stage_1` and `stage_2`: the exact periodic loops, linear about the
orbital attitude; `frozen` the constant models of the text, `derivation` those in symbols from the
laws, `text` its rows as printed, `astatism` why a constant dipole leaves no error, `comparison`
frozen next to exact, `models` all of these for a scenario; `satellite` that of a scenario, `craft`
its limits; `accuracy` and `along_orbit` the error;
`capture` and `design` the gains of both stages; `times` from tip-off to pointing; `wheels` and
`day` the wheels and the orbits for which it works.
"""
