"""Magnetorquers: any axes, a limit per coil, lag, residual dipole, electrical energy."""

import math
from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from torquer import validate
from torquer.engine import inlined
from torquer.geometry.vec3 import as_vector
from torquer.spec import Spec, Vector

#: What is done with a command beyond the limits.
SCALE, CLIP, RELAY = 0, 1, 2
MODES = {"scale": SCALE, "clip": CLIP, "relay": RELAY}


class CoilSet(NamedTuple):
    """Constants of the coils for kernels; one row per coil."""

    axes: np.ndarray
    allocation: np.ndarray
    limit_a_m2: np.ndarray
    power_at_limit_w: np.ndarray
    residual_a_m2: tuple
    mode: int
    lag_s: float


@inlined
def drive(coils, command_a_m2, target):
    """Write the dipole [A m^2] that each coil is to take for a commanded vector in the body.

    The pseudo-inverse shares the vector between the coils. Then 'scale' shrinks all alike until
    the worst coil is at its limit (the direction is kept), 'clip' cuts each coil alone, 'relay'
    puts each coil at plus or minus its limit.
    """
    worst = 1.0
    for i in range(target.size):
        a, limit = coils.allocation[i], coils.limit_a_m2[i]
        wanted = a[0] * command_a_m2[0] + a[1] * command_a_m2[1] + a[2] * command_a_m2[2]
        if coils.mode == RELAY:
            wanted = limit * np.sign(wanted)
        elif coils.mode == CLIP:
            wanted = min(max(wanted, -limit), limit)
        else:
            worst = max(worst, abs(wanted) / limit)
        target[i] = wanted
    for i in range(target.size):
        target[i] /= worst


@inlined
def dipole_of(coils, strengths):
    """Dipole vector [A m^2] in the body of the coils' strengths, residual dipole included."""
    x, y, z = coils.residual_a_m2
    for i in range(strengths.size):
        x += coils.axes[i, 0] * strengths[i]
        y += coils.axes[i, 1] * strengths[i]
        z += coils.axes[i, 2] * strengths[i]
    return (x, y, z)


@inlined
def remaining(lag_s, t_s):
    """Part of the way to the target that is still to go after t_s: first-order lag."""
    if lag_s == 0.0:
        return 0.0
    return math.exp(-t_s / lag_s)


@inlined
def energy_j(coils, strengths, target, t_s):
    """Electrical energy [J] of t_s seconds in which the coils go from `strengths` to `target`.

    Power goes with the square of the dipole, target + way exp(-t/lag); exact integral.
    """
    total = 0.0
    to_go = remaining(coils.lag_s, t_s)
    for i in range(target.size):
        way = strengths[i] - target[i] if coils.lag_s > 0.0 else 0.0
        cross_term = 2.0 * target[i] * way * coils.lag_s * (1.0 - to_go)
        own_term = 0.5 * way * way * coils.lag_s * (1.0 - to_go * to_go)
        square = target[i] * target[i] * t_s + cross_term + own_term
        total += coils.power_at_limit_w[i] * square / (coils.limit_a_m2[i] * coils.limit_a_m2[i])
    return total


def _checked_axes(value):
    rows = validate.unit_rows("axes", value)
    return tuple(as_vector(row) for row in rows)


class Coils(Spec):
    """Coil set. Default: three coils along the body axes.

    `limit_a_m2`: greatest dipole, one number or one per coil. `saturation`: 'scale', 'clip' or
    'relay'. `lag_s`: time constant of the first-order lag. `power_at_limit_w`: electrical power
    of a coil at its limit, for the energy balance (left out: energy is not reported).
    """

    limit_a_m2: Annotated[float, Field(gt=0.0)] | tuple[Annotated[float, Field(gt=0.0)], ...]
    axes: Annotated[tuple[Vector, ...], AfterValidator(_checked_axes)] = (
        (1.0, 0.0, 0.0),
        (0.0, 1.0, 0.0),
        (0.0, 0.0, 1.0),
    )
    saturation: Literal["scale", "clip", "relay"] = "scale"
    lag_s: float = Field(default=0.0, ge=0.0)
    residual_dipole_a_m2: Vector = (0.0, 0.0, 0.0)
    power_at_limit_w: float | None = Field(default=None, gt=0.0)

    @model_validator(mode="after")
    def _one_limit_per_coil(self):
        if isinstance(self.limit_a_m2, tuple) and len(self.limit_a_m2) != len(self.axes):
            raise ValueError(
                f"limit_a_m2: must be one number or one per coil ({len(self.axes)} axes); "
                f"received {len(self.limit_a_m2)} numbers"
            )
        return self

    def pack(self) -> CoilSet:
        """Constants for kernels."""
        axes = np.array(self.axes)
        n = len(axes)
        return CoilSet(
            axes,
            np.ascontiguousarray(np.linalg.pinv(axes.T)),
            np.broadcast_to(np.float64(self.limit_a_m2), n).copy(),
            np.full(n, self.power_at_limit_w or 0.0),
            as_vector(self.residual_dipole_a_m2),
            MODES[self.saturation],
            self.lag_s,
        )
