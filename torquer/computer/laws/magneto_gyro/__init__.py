"""Magneto-gyroscopic system: a magnetometer, coils and a pitch wheel point a satellite.

MGS, after the satellites Meteor-M. In axes t, w, s: t along the motion, w along the orbit normal, s
up, which is X of `torquer.base.conventions`; the body's axes coincide with them when it is pointed.
`stage_1` from any attitude, by the field and its derivative; `stage_2` for small angles, by an
estimator, with a compensator of the satellite's own dipole; `relay` for coils that are on or off;
`kernel` both stages and the switch between them; `law` the keys.
"""
