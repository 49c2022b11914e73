"""Magnetorquers: any axes, a limit per coil, lag, residual dipole, electrical energy."""

import math
from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from torquer import validate
from torquer.engine import inlined, kernel
from torquer.geometry.vec3 import as_vector
from torquer.spec import Spec, Vector

#: What is done with a command beyond the limits.
SCALE, CLIP, RELAY = 0, 1, 2
MODES = {"scale": SCALE, "clip": CLIP, "relay": RELAY}


#: Columns of `CoilSet.rows`: axis, share of a commanded vector, limit [A m^2], power per square of
#: the dipole [W/(A m^2)^2].
AXIS, SHARE, LIMIT, POWER = 0, 3, 6, 7
#: Rows of the coils' state: dipole of each coil now, and the one it goes to [A m^2].
NOW, TARGET = 0, 1


class CoilSet(NamedTuple):
    """Constants of the coils for kernels; `rows` has one row per coil."""

    rows: np.ndarray
    residual_a_m2: tuple
    mode: int
    lag_s: float


#: A satellite without coils.
NO_COILS = CoilSet(np.zeros((0, 8)), (0.0, 0.0, 0.0), SCALE, 0.0)


@inlined
def drive(coils, command_a_m2, state):
    """Set the dipole that each coil is to take for a commanded vector [A m^2] in the body.

    The pseudo-inverse shares the vector between the coils. Then 'scale' shrinks all alike until
    the worst coil is at its limit (the direction is kept), 'clip' cuts each coil alone, 'relay'
    puts each coil at plus or minus its limit, or off where nothing is asked of it. Without lag
    the coils are there at once.
    """
    rows, worst = coils.rows, 1.0
    x, y, z = command_a_m2
    nothing = 1e-12 * (abs(x) + abs(y) + abs(z))  # rounding must not fire a relay coil
    for i in range(rows.shape[0]):
        wanted = rows[i, SHARE] * x + rows[i, SHARE + 1] * y + rows[i, SHARE + 2] * z
        limit = rows[i, LIMIT]
        if coils.mode == RELAY:
            wanted = limit * np.sign(wanted) if abs(wanted) > nothing else 0.0
        elif coils.mode == CLIP:
            wanted = min(max(wanted, -limit), limit)
        elif abs(wanted) > worst * limit:
            worst = abs(wanted) / limit
        state[TARGET, i] = wanted
    for i in range(rows.shape[0]):
        if worst > 1.0:
            limit = rows[i, LIMIT]
            state[TARGET, i] = min(max(state[TARGET, i] / worst, -limit), limit)
        if coils.lag_s == 0.0:
            state[NOW, i] = state[TARGET, i]


@inlined
def dipole_of(coils, state, row):
    """Dipole vector [A m^2] in the body, residual dipole included; row NOW or TARGET."""
    x, y, z = coils.residual_a_m2
    for i in range(coils.rows.shape[0]):
        x += coils.rows[i, AXIS] * state[row, i]
        y += coils.rows[i, AXIS + 1] * state[row, i]
        z += coils.rows[i, AXIS + 2] * state[row, i]
    return (x, y, z)


@inlined
def remaining(lag_s, t_s):
    """Part of the way to the target that is still to go after t_s: first-order lag."""
    if lag_s == 0.0:
        return 0.0
    return math.exp(-t_s / lag_s)


@inlined
def follow(coils, state, t_s):
    """Let the coils go to their targets for t_s; return (energy [J], greatest dipole of a coil).

    Power goes with the square of the dipole.
    """
    if coils.lag_s > 0.0:
        return _follow_with_lag(coils, state, t_s)
    energy = greatest = 0.0
    for i in range(coils.rows.shape[0]):
        dipole = state[TARGET, i]
        energy += coils.rows[i, POWER] * dipole * dipole * t_s
        greatest = max(greatest, abs(dipole))
    return energy, greatest


@kernel
def _follow_with_lag(coils, state, t_s):
    """The same with target + way exp(-t/lag): exact integral of the square."""
    energy = greatest = 0.0
    gone = -math.expm1(-t_s / coils.lag_s)
    for i in range(coils.rows.shape[0]):
        target, way = state[TARGET, i], state[NOW, i] - state[TARGET, i]
        mixed = 2.0 * target * way * coils.lag_s * gone
        own = 0.5 * way * way * coils.lag_s * gone * (2.0 - gone)
        energy += coils.rows[i, POWER] * (target * target * t_s + mixed + own)
        state[NOW, i] = target + way * (1.0 - gone)
        greatest = max(greatest, abs(target + way), abs(state[NOW, i]))
    return energy, greatest


def _checked_axes(value):
    rows = validate.unit_rows("axes", value)
    return tuple(as_vector(row) for row in rows)


class Coils(Spec):
    """Coil set. Default: three coils along the body axes.

    `limit_a_m2`: greatest dipole, one number or one per coil. `saturation`: 'scale', 'clip' or
    'relay'. `lag_s`: time constant of the first-order lag. `power_at_limit_w`: electrical power
    of a coil at its limit (left out: energies are those of coils of 1 W).
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
        rows = np.zeros((len(axes), 8))
        rows[:, AXIS:SHARE], rows[:, SHARE:LIMIT] = axes, np.linalg.pinv(axes.T)
        rows[:, LIMIT] = self.limit_a_m2
        rows[:, POWER] = (self.power_at_limit_w or 1.0) / rows[:, LIMIT] / rows[:, LIMIT]
        residual = as_vector(self.residual_dipole_a_m2)
        return CoilSet(rows, residual, MODES[self.saturation], self.lag_s)
