"""Held attitudes for the tests of three-axis theory."""

import math
from datetime import UTC, datetime

import numpy as np

from torquer.computer.laws.three_axis import ThreeAxis
from torquer.environment.along_orbit import Environment, OrbitEnvironment
from torquer.environment.field import FIELDS
from torquer.environment.field.averaged import cone_angle
from torquer.environment.orbit import Circular
from torquer.spacecraft.body import Body
from torquer.theory.three_axis.averaged import channel_factors, mean_damping, plateau_edge
from torquer.theory.three_axis.hold import AttitudeHold

START = datetime(2025, 3, 1, tzinfo=UTC)
#: The body and the orbits of MAG 4.3.
INERTIA, ALTITUDE_KM = (1.0, 2.0, 1.5), 350.0
#: The public 3U CubeSat that is held by coils alone.
CUBESAT = {"inertia": (0.015, 0.014, 0.007), "inclination_deg": 52.0, "altitude_km": 470.0,
           "reference": "orbital", "gravity_gradient": True}  # fmt: skip


def along_z(inclination_deg: float) -> tuple:
    """Euler angles [deg] 321 of the frame Z of an orbit whose node is on axis 1."""
    return (0.0, 0.0, math.degrees(cone_angle(math.radians(inclination_deg))))


def hold(
    inclination_deg=30.0, inertia=INERTIA, field="averaged", reference="inertial", k=1e5, k_a=30.0,
    gravity_gradient=False, altitude_km=ALTITUDE_KM, euler_deg=None, revolutions=None, u0_deg=0.0,
):  # fmt: skip
    """A hold by the three-axis law, along Z for an inertial reference unless stated otherwise.

    `u0_deg`: argument of latitude at the start.
    """
    if euler_deg is None:
        euler_deg = along_z(inclination_deg) if reference == "inertial" else (0.0, 0.0, 0.0)
    spec = ThreeAxis(
        rate_gain_n_m_s_per_t2=k, angle_gain_n_m_per_t2=k_a, reference=reference,
        euler_deg=euler_deg,
    )  # fmt: skip
    environment = Environment(field=FIELDS[field](), gravity_gradient=gravity_gradient)
    orbit = Circular(
        altitude_km=altitude_km, inclination_deg=inclination_deg, argument_of_latitude_deg=u0_deg
    )
    orbit_environment = OrbitEnvironment(environment, orbit, START)
    return AttitudeHold(
        spec.law(), Body(inertia_kg_m2=inertia), orbit_environment, revolutions=revolutions
    )


def damping(held: AttitudeHold) -> np.ndarray:
    """S of a hold over its period."""
    return mean_damping(held.free(np.linspace(0.0, held.period, 64, endpoint=False)).b_body_t)


def at_strength(held: AttitudeHold, strength: float, ratio: float = 1.0) -> AttitudeHold:
    """The hold with MAG's K and `ratio` times the k_a of the plateau's edge."""
    s, inertia = damping(held), np.array(held.body.inertia_kg_m2)
    k = strength * held.rate_rad_s * inertia[0, 0] / s[0, 0]
    k_a = ratio * float(plateau_edge(channel_factors(inertia, s), k))
    return held.with_parameters(rate_gain=float(k), angle_gain=k_a)


def gains_of(held: AttitudeHold) -> tuple[float, float]:
    """k and k_a."""
    values = held.law.values()
    return values["rate_gain"], values["angle_gain"]
