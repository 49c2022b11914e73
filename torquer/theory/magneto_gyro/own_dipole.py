"""How far the satellite's own dipole turns it before it is known: linear theory of both stages.

Stage 1 has no compensator: it stays turned. Stage 2 begins with a compensator of zero and is turned
until it has found the dipole. Dipoles are in body axes, in units of J nu0^2/A.
"""

import math

import numpy as np
from scipy.linalg import expm

from torquer.computer.laws.magneto_gyro.law import MagnetoGyro
from torquer.theory.magneto_gyro.accuracy import Revolution
from torquer.theory.magneto_gyro.loop import DIPOLE
from torquer.theory.magneto_gyro.stage_1 import ORDER, stage_1_driven_by
from torquer.theory.magneto_gyro.stage_2 import ORDER as ORDER_2
from torquer.theory.periodic.periodic_systems import PeriodicSystem
from torquer.theory.validity import Limit

#: Steps of a revolution for stage 1; revolutions of stage 2, and places of its beginning.
_STEPS, _REVOLUTIONS, _BEGINNINGS = 360, 3, 8
_SHOWN = (
    "a 3U, h of 4 to 53, 0.5 to 7 mA m^2 per axis, several gains, ten releases each: within both "
    "bounds all of 100 point, at 16 and 76 deg 2 of 10"
)
#: Greatest angles [deg]: those at which the law changes its stage.
TURNED_1 = Limit(
    "angle by the own dipole in stage 1 [deg]",
    most=float(MagnetoGyro.model_fields["stage_2_angle_deg"].default),
    why="stage 2 begins below this angle only, or at a wrong one",
    of="design magneto-gyro: time to point", shown=_SHOWN,
)  # fmt: skip
TURNED_2 = Limit(
    "angle by the own dipole in stage 2 [deg]",
    most=float(MagnetoGyro.model_fields["stage_1_angle_deg"].default),
    why="before the dipole is found, stage 1 begins again",
    of="design magneto-gyro: time to point", shown=_SHOWN,
)  # fmt: skip


def stage_1_steady_motion(loop: PeriodicSystem, push: np.ndarray) -> np.ndarray:
    """Periodic state `[steps, 12]` of the exact model of stage 1 under inputs `[steps, 6]`.

    The inputs are torque and error of the magnetometer about t, w, s, in the middles of equal steps
    of a revolution. By the exponential of the middle of each step: of second order, stable for fast
    filters.
    """
    step = 2.0 * math.pi / len(push)
    taus = (np.arange(len(push)) + 0.5) * step
    size = np.zeros((len(push), ORDER + 1, ORDER + 1))
    size[:, :ORDER, :ORDER] = [loop.matrix(tau) for tau in taus]
    driven = np.array([stage_1_driven_by(loop, tau) for tau in taus])
    size[:, :ORDER, ORDER] = np.einsum("nij,nj->ni", driven, push)
    parts, whole = expm(step * size), np.eye(ORDER + 1)
    for part in parts:
        whole = part @ whole
    start = np.linalg.solve(np.eye(ORDER) - whole[:ORDER, :ORDER], whole[:ORDER, ORDER])
    path = [np.append(start, 1.0)]
    for part in parts[:-1]:
        path.append(part @ path[-1])
    return np.array(path)[:, :ORDER]


def dipole_push(dipole: np.ndarray, steps: int, normal: float) -> np.ndarray:
    """Inputs `[steps, 6]` of a loop by a dipole of the body, in the middles of equal steps."""
    tau = (np.arange(steps) + 0.5) * (2.0 * math.pi / steps)
    along, up = DIPOLE["along"] * np.cos(tau), -DIPOLE["up"] * np.sin(tau)
    push = np.zeros((steps, 6))
    push[:, :3] = np.cross(dipole, np.stack([along, np.full(steps, normal), up], axis=1))
    return push


def turned_in_stage_1(loop: PeriodicSystem, dipole: np.ndarray, normal: float) -> float:
    """Greatest angle [rad] of the motion that a dipole keeps up in a stable stage 1."""
    if not np.any(dipole):
        return 0.0
    motion = stage_1_steady_motion(loop, dipole_push(dipole, _STEPS, normal))
    return float(np.linalg.norm(motion[:, :3], axis=1).max())


def turned_in_stage_2(around: Revolution, dipole: np.ndarray, normal: float) -> float:
    """Greatest angle [rad] after stage 2 begins, wherever in orbit that is."""
    if not np.any(dipole):
        return 0.0
    steps = len(around.transitions)
    push = dipole_push(dipole, steps, normal)
    pushed = around.step * np.einsum("nij,nj->ni", around.inputs, push)
    begun = np.arange(0, steps, steps // _BEGINNINGS)
    x, greatest = np.zeros((len(begun), ORDER_2)), 0.0
    for k in range(_REVOLUTIONS * steps):
        now = (begun + k) % steps
        x = np.einsum("nij,nj->ni", around.transitions[now], x) + pushed[now]
        greatest = max(greatest, float(np.linalg.norm(x[:, :3], axis=1).max()))
    return greatest
