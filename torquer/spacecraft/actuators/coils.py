"""Magnetorquers: any axes, a limit per coil, lag, residual dipole, electrical energy."""

import math
from typing import Annotated, ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from torquer.base.spec import Spec, Vector, unit_vectors
from torquer.compile.engine import inlined, kernel, records
from torquer.maths.geometry.vec3 import as_vector
from torquer.spacecraft.data_sheet import DataSheet
from torquer.spacecraft.failures import CoilFailure, failed_dipole

#: What is done with a command beyond the limits.
SCALE, CLIP, RELAY = 0, 1, 2
MODES = {"scale": SCALE, "clip": CLIP, "relay": RELAY}


#: Constants of a coil: axis, with its polarity, the axis that the computer believes, share of a
#: commanded vector, polarity, limit [A m^2] and 1 over it, power per square of the dipole
#: [W/(A m^2)^2].
COIL = np.dtype(
    [(f"{name}_{c}", np.float64) for name in ("axis", "believed", "share") for c in "xyz"]
    + [(name, np.float64) for name in ("sense", "limit_a_m2", "per_limit", "power")]
)
#: State of a coil [A m^2]: its dipole, the one it goes to, the one it is commanded to have.
COIL_STATE = np.dtype([(f"{name}_a_m2", np.float64) for name in ("dipole", "target", "command")])


class CoilSet(NamedTuple):
    """Constants of the coils for kernels; `rows`: `COIL`, one per coil."""

    rows: np.ndarray
    residual_a_m2: tuple
    mode: int
    lag_s: float


#: A satellite without coils.
NO_COILS = CoilSet(np.zeros(0, COIL), (0.0, 0.0, 0.0), SCALE, 0.0)


class Goal(NamedTuple):
    """The coils' targets: dipole vector [A m^2] in the body, residual dipole included; power [W]
    and greatest dipole of a coil [A m^2] there."""

    dipole_a_m2: tuple
    power_w: float
    greatest_a_m2: float


@inlined
def command_coils(coils, command_a_m2, state):
    """Set the target dipole of each coil for a commanded vector [A m^2] in the body.

    The pseudo-inverse shares the vector between the coils. Then 'scale' shrinks all alike until
    the worst coil is at its limit (the direction is kept), 'clip' cuts each coil alone, 'relay'
    puts each coil at plus or minus its limit, or off where no dipole is commanded. Without lag
    the coils reach their targets at once.
    """
    rows, worst = coils.rows, 1.0
    x, y, z = command_a_m2
    nothing = 1e-12 * (abs(x) + abs(y) + abs(z))  # rounding must not fire a relay coil
    for i in range(rows.shape[0]):
        coil = rows[i]
        wanted, limit = coil.share_x * x + coil.share_y * y + coil.share_z * z, coil.limit_a_m2
        if coils.mode == RELAY:
            wanted = limit * np.sign(wanted) if abs(wanted) > nothing else 0.0
        elif coils.mode == CLIP:
            wanted = min(max(wanted, -limit), limit)
        else:
            worst = max(worst, abs(wanted) * coil.per_limit)
        state[i].target_a_m2 = wanted
    if worst > 1.0:
        part = 1.0 / worst
        for i in range(rows.shape[0]):
            wanted, limit = part * state[i].target_a_m2, rows[i].limit_a_m2
            state[i].target_a_m2 = min(max(wanted, -limit), limit)
    for i in range(rows.shape[0]):
        state[i].command_a_m2 = state[i].target_a_m2
    return coil_targets(coils, state)


@inlined
def switch_off_coils(coils, state):
    """Set the targets of all coils to zero."""
    for i in range(state.shape[0]):
        state[i].target_a_m2 = state[i].command_a_m2 = 0.0
    return coil_targets(coils, state)


@inlined
def fail_coils(coils, failures, state, t_s):
    """Let failures change the targets of the coils at t_s; `failures`: rows of `COIL_FAILURE`."""
    for i in range(state.shape[0]):
        state[i].target_a_m2 = failed_dipole(failures, i, state[i].command_a_m2, t_s)
    return coil_targets(coils, state)


@inlined
def coil_targets(coils, state):
    """The coils' targets; without lag they are reached at once."""
    x, y, z = coils.residual_a_m2
    power = greatest = 0.0
    for i in range(coils.rows.shape[0]):
        coil, dipole = coils.rows[i], state[i].target_a_m2
        x, y, z = x + coil.axis_x * dipole, y + coil.axis_y * dipole, z + coil.axis_z * dipole
        power += coil.power * dipole * dipole
        greatest = max(greatest, abs(dipole))
        if coils.lag_s == 0.0:
            state[i].dipole_a_m2 = dipole
    return Goal((x, y, z), power, greatest)


@inlined
def present_dipole(coils, state):
    """Dipole vector [A m^2] in the body, residual dipole included."""
    x, y, z = coils.residual_a_m2
    for i in range(coils.rows.shape[0]):
        coil, dipole = coils.rows[i], state[i].dipole_a_m2
        x, y, z = x + coil.axis_x * dipole, y + coil.axis_y * dipole, z + coil.axis_z * dipole
    return (x, y, z)


@inlined
def flowing_dipole(coils, state, i):
    """Dipole [A m^2] along its axis as given of coil i, polarity included; 0 of one too many."""
    if i < coils.rows.shape[0]:
        return coils.rows[i].sense * state[i].dipole_a_m2
    return 0.0


@inlined
def are_driven(coils, state):
    """1 while any coil is driven, else 0."""
    total = 0.0
    for i in range(coils.rows.shape[0]):
        total += abs(state[i].target_a_m2)
    return 1.0 if total > 0.0 else 0.0


@inlined
def believed_dipole(coils, state):
    """Dipole vector [A m^2] in the body that the computer has set: it does not know the residual
    dipole, the polarity and failures."""
    x, y, z = 0.0, 0.0, 0.0
    for i in range(coils.rows.shape[0]):
        coil, dipole = coils.rows[i], state[i].command_a_m2
        x += coil.believed_x * dipole
        y += coil.believed_y * dipole
        z += coil.believed_z * dipole
    return (x, y, z)


@inlined
def remaining(lag_s, t_s):
    """Fraction of the way to the target that remains after t_s: first-order lag."""
    if lag_s == 0.0:
        return 0.0
    return math.exp(-t_s / lag_s)


@inlined
def remaining_and_mean(lag_s, t_s):
    """Fraction of the way to the target that remains after t_s, and its mean until then."""
    if lag_s == 0.0 or t_s == 0.0:
        return 0.0, 0.0
    left = remaining(lag_s, t_s)
    return left, (1.0 - left) * lag_s / t_s


@kernel
def advance_coils(coils, state, t_s):
    """Let coils with a lag approach their targets for t_s; (energy [J], greatest dipole of a coil).

    Power goes with the square of the dipole, target + way exp(-t/lag); its integral is exact.
    """
    energy = greatest = 0.0
    gone = -math.expm1(-t_s / coils.lag_s)
    for i in range(coils.rows.shape[0]):
        target, way = state[i].target_a_m2, state[i].dipole_a_m2 - state[i].target_a_m2
        mixed = 2.0 * target * way * coils.lag_s * gone
        own = 0.5 * way * way * coils.lag_s * gone * (2.0 - gone)
        energy += coils.rows[i].power * (target * target * t_s + mixed + own)
        state[i].dipole_a_m2 = target + way * (1.0 - gone)
        greatest = max(greatest, abs(target + way), abs(state[i].dipole_a_m2))
    return energy, greatest


class Coils(Spec):
    """Coils (magnetorquers). Default: three along the body axes."""

    sheet: ClassVar = DataSheet(
        name="coil",
        senses="",
        unit="A m^2",
        bias="residual_dipole_a_m2",
        range="limit_a_m2",
        axes="axes",
        words={"bias": "residual dipole"},
    )
    limit_a_m2: Annotated[float, Field(gt=0.0)] | tuple[Annotated[float, Field(gt=0.0)], ...]
    """Greatest dipole, one number or one per coil."""
    axes: unit_vectors("axes") = (
        (1.0, 0.0, 0.0),
        (0.0, 1.0, 0.0),
        (0.0, 0.0, 1.0),
    )
    """Axes of the coils in the body, of any length."""
    saturation: Literal["scale", "clip", "relay"] = "scale"
    """Beyond the limits: 'scale' (the dipole keeps its direction), 'clip' (each coil by itself) or
    'relay' (every coil is fully on, in one sense or the other).
    """
    polarity: tuple[Literal[-1, 0, 1], ...] | None = None
    """One per coil: 1 as commanded, -1 wired the wrong way round, 0 failed; the on-board computer
    does not know it.
    """
    lag_s: float = Field(default=0.0, ge=0.0)
    """Time constant of the first-order lag between command and dipole."""
    residual_dipole_a_m2: Vector = (0.0, 0.0, 0.0)
    """Constant residual dipole in body axes."""
    power_at_limit_w: float | None = Field(default=None, gt=0.0)
    """Electrical power of a coil at its limit; left out: energies are those of 1 W coils."""
    failures: tuple[CoilFailure, ...] = ()
    """Failures in flight."""

    @model_validator(mode="after")
    def _one_limit_per_coil(self):
        if isinstance(self.limit_a_m2, tuple) and len(self.limit_a_m2) != len(self.axes):
            raise ValueError(
                f"limit_a_m2: must be one number or one per coil ({len(self.axes)} axes); "
                f"received {len(self.limit_a_m2)} numbers"
            )
        if self.polarity is not None and len(self.polarity) != len(self.axes):
            raise ValueError(
                f"polarity: must have one number per coil ({len(self.axes)} axes); "
                f"received {len(self.polarity)} numbers"
            )
        return self

    @model_validator(mode="after")
    def _failures_are_of_coils(self):
        count, limits = len(self.axes), self.limits_a_m2()
        for k, failure in enumerate(self.failures):
            if failure.coil >= count:
                raise ValueError(
                    f"failures[{k}].coil: must be the number of a coil, 0 to {count - 1}; "
                    f"received {failure.coil}"
                )
            if abs(failure.dipole_a_m2 or 0.0) > limits[failure.coil]:
                raise ValueError(
                    f"failures[{k}].dipole_a_m2: must not exceed the limit of coil "
                    f"{failure.coil}, {limits[failure.coil]:g} A m^2; "
                    f"received {failure.dipole_a_m2:g} A m^2"
                )
        return self

    def limits_a_m2(self) -> np.ndarray:
        """Limit of each coil (n,) [A m^2]."""
        return np.full(len(self.axes), self.limit_a_m2, dtype=np.float64)

    def shares(self) -> np.ndarray:
        """Dipole of each coil (n, 3) per component of a commanded vector: the pseudo-inverse."""
        return np.linalg.pinv(np.array(self.axes).T)

    def pack(self) -> CoilSet:
        """Constants for kernels."""
        axes = np.array(self.axes)
        rows, shares = np.zeros(len(axes), COIL), self.shares()
        polarity = np.ones(len(axes)) if self.polarity is None else np.array(self.polarity)
        for k, c in enumerate("xyz"):
            rows[f"axis_{c}"], rows[f"share_{c}"] = polarity * axes[:, k], shares[:, k]
            rows[f"believed_{c}"] = axes[:, k]
        rows["sense"] = polarity
        rows["limit_a_m2"] = limits = self.limits_a_m2()
        rows["per_limit"] = 1.0 / limits
        rows["power"] = polarity**2 * (self.power_at_limit_w or 1.0) / limits / limits
        residual = as_vector(self.residual_dipole_a_m2)
        return CoilSet(records(rows), residual, MODES[self.saturation], self.lag_s)
