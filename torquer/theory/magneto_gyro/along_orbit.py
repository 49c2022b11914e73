"""The real field along an orbit, as the models of the magneto-gyroscopic system see it."""

import math
from typing import NamedTuple

import numpy as np

from torquer.environment.along_orbit import OrbitEnvironment
from torquer.theory.magneto_gyro.accuracy import STEPS, Revolution
from torquer.theory.magneto_gyro.loop import DIPOLE
from torquer.theory.magneto_gyro.stage_2 import ORDER

#: Mean square of a dipole's field in the orbit's plane, over A^2.
_MEAN_SQUARE = 0.5 * (DIPOLE["along"] ** 2 + DIPOLE["up"] ** 2)


class FieldAlong(NamedTuple):
    """A [T]; parts along the orbit normal over A, means of a revolution: all, least, greatest.

    `error` `[n, 3]`: the field less that of the model on board, over A, in t, w, s, at the steps of
    a `Revolution` from the ascending magnetic node on.
    """

    strength_t: float
    normal: float
    least: float
    greatest: float
    error: np.ndarray

    @property
    def normals(self) -> tuple[float, float, float]:
        """Parts along the orbit normal to design for, the usual one first."""
        return self.normal, self.least, self.greatest

    @property
    def mean_square_t2(self) -> float:
        """Mean square of the field in the orbit's plane [T^2]."""
        return _MEAN_SQUARE * self.strength_t**2


def field_along(truth: OrbitEnvironment, believed, revolutions: int = 15) -> FieldAlong:
    """Field of an environment over some revolutions, and the error of that which is believed."""
    count = revolutions * STEPS
    t_s = (np.arange(count) + 0.5) * truth.orbit.period_s / STEPS
    truth.check_dates(0.0, float(t_s[-1]))
    axes = _orbital_axes(*truth.state(t_s))
    b = np.einsum("nij,ni->nj", axes, truth.field(t_s, *truth.state(t_s)))
    r, v = believed.state(t_s)
    model = np.einsum("nij,ni->nj", _orbital_axes(r, v), believed.field(t_s, r, v))
    a = math.sqrt(np.mean(b[:, 0] ** 2 + b[:, 2] ** 2) / _MEAN_SQUARE)
    means = b[:, 1].reshape(revolutions, STEPS).mean(axis=1) / a
    tau = math.atan2(-b[0, 2] / DIPOLE["up"], b[0, 0] / DIPOLE["along"]) % (2.0 * math.pi)
    first = round((1.0 - tau / (2.0 * math.pi)) * STEPS)
    error = (b - model)[first:] / a
    return FieldAlong(a, float(means.mean()), float(means.min()), float(means.max()), error)


def _orbital_axes(r, v) -> np.ndarray:
    """Axes t, w, s as columns `[n, 3, 3]`."""
    up, normal = np.asarray(r), np.cross(r, v)
    up = up / np.linalg.norm(up, axis=1, keepdims=True)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return np.stack([np.cross(normal, up), normal, up], axis=2)


def model_error(around: Revolution, along: FieldAlong, settled: int = 4) -> np.ndarray:
    """Root mean square of roll, pitch, yaw [rad] `[3]` that the error of the field model leaves,
    after some revolutions."""
    x, path = np.zeros(ORDER), []
    for k, error in enumerate(along.error):
        i = k % len(around.transitions)
        x = around.transitions[i] @ x + around.step * (around.inputs[i, :, 3:] @ error)
        path.append(x[:3])
    late = np.array(path)[settled * len(around.transitions) :]
    return np.sqrt(np.mean(late**2, axis=0))
