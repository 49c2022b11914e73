"""Runs of SDOT 3.2, Figs. 3.11 to 3.13: Chibis-M under S-dot, from any argument of latitude.

As in the text: principal moments 1.025, 1.5393, 1.8172 kg m^2, 350 km, 51.7 deg, angles 10, 20, 30
deg (2-3-1), rates (2, 3, 4)e-3 1/s, Sun along (10, 2, 3), law (1.16) every second, no gravity
gradient, no limit of the coils; mu_e of SDOT, B0 as its integral mean. The argument of latitude at
the start is not printed.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from torquer.environment.field.averaged import cone_angle, mean_over_orbit
from torquer.environment.orbit import Circular
from torquer.maths.geometry.frames import dcm_s_to_y, dcm_z_to_y
from torquer.scenario.load import scenario_from_data
from torquer.simulation.setup.simulate import simulate
from torquer.theory.slow.evolution import SDOT
from torquer.theory.slow.evolution.model import Slow
from torquer.theory.slow.spinner import Spinner

MOMENTS = np.array([1.025, 1.5393, 1.8172])
ALTITUDE_KM, INCLINATION_DEG, MU_E_T_KM3 = 350.0, 51.7, 7.7245e6
SUN = np.array([10.0, 2.0, 3.0]) / math.sqrt(113.0)
ATTITUDE = Rotation.from_euler("YZX", [10.0, 20.0, 30.0], degrees=True)
RATE_RAD_S = np.array([2e-3, 3e-3, 4e-3])
ORBIT = Circular(altitude_km=ALTITUDE_KM, inclination_deg=INCLINATION_DEG)
CONE = cone_angle(math.radians(INCLINATION_DEG))
#: Fields, and the frame in which attitude and Sun are given.
AVERAGED = ({"kind": "averaged", "mu_e_t_km3": MU_E_T_KM3, "b0": "integral"}, dcm_z_to_y(CONE))
IGRF = ({"kind": "igrf14", "degree": 10}, dcm_s_to_y(math.radians(INCLINATION_DEG)))


@dataclass(frozen=True)
class Run:
    """One run: gain k [A m^2 s], start argument [deg], initial rate over the text's, field."""

    gain: float
    start_deg: float = 0.0
    faster: float = 1.0
    field: tuple = AVERAGED
    hours: float | None = None
    start: str = "2012-01-01T00:00:00Z"

    @property
    def length_s(self) -> float:
        """Duration: unless given that in which the momentum comes to its end at a small gain."""
        return 3600.0 * (self.hours or 720.0 / self.gain)

    @cached_property
    def sun_inertial(self) -> np.ndarray:
        """Unit vector to the Sun."""
        return np.array(self.field[1]) @ SUN

    def scenario(self):
        """The run as a scenario."""
        field, to_inertial = self.field
        attitude = Rotation.from_matrix(to_inertial) * ATTITUDE
        return scenario_from_data({
            "start": self.start,
            "orbit": {"kind": "circular", "altitude_km": ALTITUDE_KM,
                      "inclination_deg": INCLINATION_DEG,
                      "argument_of_latitude_deg": self.start_deg},
            "environment": {"field": field, "earth_rotation": "sidereal", "eclipse": "none",
                            "gravity_gradient": False, "sun_direction": self.sun_inertial.tolist()},
            "spacecraft": {"body": {"inertia_kg_m2": MOMENTS.tolist()},
                           "coils": {"limit_a_m2": 1e6}},
            "initial": {"quaternion": attitude.as_quat().tolist(),
                        "rate_deg_s": np.degrees(self.faster * RATE_RAD_S).tolist()},
            "control": {"law": {"kind": "sdot_rate", "gain_a_m2_s": self.gain}, "sample_s": 1.0},
            "simulation": {"duration_s": self.length_s, "record_s": 60.0},
        })  # fmt: skip

    def course(self) -> "Course":
        """The run flown."""
        result = simulate(self.scenario())
        axis = Rotation.from_quat(result["q_body_to_inertial"].values).as_matrix()[:, :, 2]
        momentum = result["momentum_inertial"].values / (self.faster * FIRST_MOMENTUM)
        return Course(
            result["time"].values / 3600.0,
            np.linalg.norm(momentum, axis=1),
            momentum @ self.sun_inertial,
            _angle_deg(axis @ self.sun_inertial),
        )


def _angle_deg(cosine):
    return np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))


#: Initial momentum [N m s] with the text's rates, and its direction in Z.
FIRST_MOMENTUM = float(np.linalg.norm(MOMENTS * RATE_RAD_S))
DIRECTION = ATTITUDE.apply(MOMENTS * RATE_RAD_S) / FIRST_MOMENTUM


@dataclass(frozen=True)
class Course:
    """Histories of a run: time [h], momentum over its initial length, its part along the Sun, the
    angle of the axis of greatest inertia to the Sun [deg]."""

    hours: np.ndarray
    momentum: np.ndarray
    along: np.ndarray
    axis_deg: np.ndarray

    @property
    def momentum_deg(self) -> np.ndarray:
        """Angle of the momentum to the Sun [deg]."""
        return _angle_deg(self.along / self.momentum)

    def settled_hours(self, angle_deg: float, of: str = "axis_deg") -> float:
        """When an angle to the Sun was last further from its line than this; inf if at the end."""
        angle = getattr(self, of)
        off = np.minimum(angle, 180.0 - angle) > angle_deg
        if off[-1]:
            return math.inf
        return float(self.hours[np.flatnonzero(off)[-1] + 1]) if off.any() else 0.0


def spinner(faster: float = 1.0) -> Spinner:
    """The satellite as the averaged theory takes it: its axis of greatest inertia, the mean of the
    others across it."""
    return Spinner(
        inclination_deg=INCLINATION_DEG,
        strength_t=mean_over_orbit(1e9 * MU_E_T_KM3 / ORBIT.radius_m**3,
                                   math.radians(INCLINATION_DEG)),
        transverse_kg_m2=float(MOMENTS[:2].mean()), axial_kg_m2=float(MOMENTS[2]),
        momentum_n_m_s=faster * FIRST_MOMENTUM, orbital_rate_rad_s=ORBIT.rate_rad_s(),
        sun=SUN.tolist(),
    )  # fmt: skip


def averaged_case(gain: float):
    """Averaged equations' constants, and the start."""
    rho, sigma = math.acos(DIRECTION[2]), math.atan2(DIRECTION[1], DIRECTION[0])
    theta = math.acos(MOMENTS[2] * RATE_RAD_S[2] / FIRST_MOMENTUM)
    return SDOT.case(gain, spinner()), Slow(1.0, rho, sigma, theta)


def start_arguments(count: int, span_deg: float) -> np.ndarray:
    """Evenly spaced arguments of latitude [deg]; the averaged field repeats after 180 deg."""
    return span_deg * np.arange(count) / count
