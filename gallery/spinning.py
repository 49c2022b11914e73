"""Quantities of a spinning satellite's run: angles of axis, momentum and target."""

import math
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation


@dataclass(frozen=True)
class Course:
    """Time histories of a run; the spin axis is the body's third.

    Angles [deg]: `axis` and `momentum` to the target, `nutation` between the two. Rates [deg/s]:
    `spin` about the axis, `across` it.
    """

    time_s: np.ndarray
    axis: np.ndarray
    momentum: np.ndarray
    nutation: np.ndarray
    spin: np.ndarray
    across: np.ndarray

    def at(self, time_s: float, name: str) -> float:
        """A quantity at a time."""
        return float(np.interp(time_s, self.time_s, getattr(self, name)))

    def last_above(self, name: str, limit: float) -> float:
        """Last time at which a quantity was above a limit [s]; NaN if it never was."""
        above = np.flatnonzero(getattr(self, name) > limit)
        return float(self.time_s[above[-1]]) if len(above) else math.nan

    def end(self, name: str) -> float:
        """Mean over the last tenth of the run."""
        return float(np.mean(getattr(self, name)[-(len(self.time_s) // 10) :]))


def course_of(result, target) -> Course:
    """Time histories of a result's axis 3 relative to an inertial target."""
    axis = Rotation.from_quat(result["q_body_to_inertial"].values).as_matrix()[:, :, 2]
    momentum = result["momentum_inertial"].values
    momentum = momentum / np.linalg.norm(momentum, axis=1)[:, None]
    target = np.asarray(target, float) / np.linalg.norm(target)
    omega = np.degrees(result["omega_body"].values)
    return Course(
        result["time"].values,
        _angle_deg(axis @ target),
        _angle_deg(momentum @ target),
        _angle_deg(np.sum(axis * momentum, axis=1)),
        omega[:, 2],
        np.hypot(omega[:, 0], omega[:, 1]),
    )


def _angle_deg(cosine):
    return np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))


def aside(angle_deg: float, azimuth_deg: float) -> list[float]:
    """Unit vector at an angle from axis 3 of the frame, at an azimuth from axis 1."""
    away, around = math.radians(angle_deg), math.radians(azimuth_deg)
    across = math.sin(away)
    return [across * math.cos(around), across * math.sin(around), math.cos(away)]
