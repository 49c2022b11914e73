"""What the entries of MAG ch. 4 share: the satellite, its orbits, gains in the text's units.

J = (1, 2, 1.5) kg m^2 in a circular orbit of 350 km, held along the axes of the averaged field Z.
The text's k multiplies omega/omega0, so that k and k_a are both in N m/T^2.
"""

import math
from datetime import UTC, datetime

import numpy as np

from torquer.computer.laws.three_axis import ThreeAxis
from torquer.environment.along_orbit import Environment, OrbitEnvironment
from torquer.environment.field.averaged import Averaged, cone_angle
from torquer.environment.orbit import Circular
from torquer.spacecraft.body import Body
from torquer.theory.three_axis.averaged import channel_factors, mean_damping, plateau_edge
from torquer.theory.three_axis.hold import AttitudeHold

INERTIA, ALTITUDE_KM = (1.0, 2.0, 1.5), 350.0
LOW_DEG, HIGH_DEG = 30.0, 70.0
START = "2012-01-01T00:00:00Z"


def along_z_deg(inclination_deg: float) -> tuple[float, float, float]:
    """Euler angles 321 of Z in the inertial frame, the node on axis 1."""
    return (0.0, 0.0, math.degrees(cone_angle(math.radians(inclination_deg))))


def hold(inclination_deg: float, inertia=INERTIA, gravity_gradient: bool = False) -> AttitudeHold:
    """The text's satellite, or another, in the averaged field; its gains are to be set."""
    law = ThreeAxis(
        rate_gain_n_m_s_per_t2=1.0, angle_gain_n_m_per_t2=1.0, reference="inertial",
        euler_deg=along_z_deg(inclination_deg),
    ).law()  # fmt: skip
    orbit = Circular(altitude_km=ALTITUDE_KM, inclination_deg=inclination_deg)
    environment = Environment(field=Averaged(), gravity_gradient=gravity_gradient)
    orbit_environment = OrbitEnvironment(
        environment, orbit, datetime.fromisoformat(START).astimezone(UTC)
    )
    return AttitudeHold(law, Body(inertia_kg_m2=inertia), orbit_environment)


def factors(held: AttitudeHold) -> np.ndarray:
    """Factors of the averaged channels [T^2/(kg m^2)]."""
    b = held.free(np.linspace(0.0, held.period, 16, endpoint=False)).b_body_t
    return channel_factors(held.body.inertia, mean_damping(b))


def strength_unit(held: AttitudeHold) -> float:
    """The text's k [N m/T^2] for K = 1: A omega0^2/((p + q) B0^2)."""
    b = held.free(np.linspace(0.0, held.period, 16, endpoint=False)).b_body_t
    return held.body.inertia[0][0] * held.rate_rad_s**2 / mean_damping(b)[0, 0]


def edge(held: AttitudeHold, k) -> np.ndarray:
    """k_a of the parabola for the text's k, both [N m/T^2]."""
    return plateau_edge(factors(held), np.asarray(k) / held.rate_rad_s)


def with_gains(held: AttitudeHold, k: float, k_a: float) -> AttitudeHold:
    """The hold with the text's gains."""
    return held.with_parameters(rate_gain=float(k) / held.rate_rad_s, angle_gain=float(k_a))
