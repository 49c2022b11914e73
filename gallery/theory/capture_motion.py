"""Steady motion of the exact model of stage 1 of the magneto-gyroscopic system."""

import math

import numpy as np
from scipy.linalg import expm

from torquer.theory.magneto_gyro.comparison import CaptureGains
from torquer.theory.magneto_gyro.craft import GyroCraft
from torquer.theory.magneto_gyro.stage_1 import STAGE_1, stage_1_driven_by


def stage_1_steady_motion(
    craft: GyroCraft, gains: CaptureGains, push: np.ndarray, normal: float = 0.0
) -> np.ndarray:
    """Periodic state `[steps, 12]` of the exact model of stage 1 under inputs `[steps, 6]`, torque
    and error of the magnetometer about t, w, s, in the middles of equal steps of a revolution.

    By the exponential of the middle of each step: of second order, stable for fast filters.
    """
    loop = STAGE_1.with_parameters(**craft.satellite()._asdict(), **gains._asdict(), normal=normal)
    step = 2.0 * math.pi / len(push)
    taus = (np.arange(len(push)) + 0.5) * step
    size = np.zeros((len(push), 13, 13))
    size[:, :12, :12] = [loop.matrix(tau) for tau in taus]
    driven = np.array([stage_1_driven_by(loop, tau) for tau in taus])
    size[:, :12, 12] = np.einsum("nij,nj->ni", driven, push)
    parts, whole = expm(step * size), np.eye(13)
    for part in parts:
        whole = part @ whole
    start = np.linalg.solve(np.eye(12) - whole[:12, :12], whole[:12, 12])
    path = [np.append(start, 1.0)]
    for part in parts[:-1]:
        path.append(part @ path[-1])
    return np.array(path)[:, :12]
