"""Magnetorquers: any axes, a limit per coil, lag, residual dipole, electrical energy."""

import math
from typing import Annotated, ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from torquer.base.spec import Spec, Vector, unit_vectors
from torquer.compile.engine import inlined, kernel, records
from torquer.maths.geometry.vec3 import as_vector
from torquer.spacecraft.actuators.winding import Winding, greatest_multiple
from torquer.spacecraft.data_sheet import DataSheet
from torquer.spacecraft.failures import CoilFailure, failed_dipole

#: What is done with a command beyond the limits.
SCALE, CLIP, RELAY = 0, 1, 2
MODES = {"scale": SCALE, "clip": CLIP, "relay": RELAY}


#: Constants of a coil: axis, with its polarity, the axis that the computer believes, share of a
#: commanded vector, polarity, limit [A m^2] and 1 over it, power per square of the dipole
#: [W/(A m^2)^2]; of its driver: greatest dipole, step, dead band [A m^2], relative error.
COIL = np.dtype(
    [(f"{name}_{c}", np.float64) for name in ("axis", "believed", "share") for c in "xyz"]
    + [(name, np.float64) for name in ("sense", "limit_a_m2", "per_limit", "power")]
    + [(name, np.float64) for name in ("most_a_m2", "step_a_m2", "dead_band_a_m2", "error")]
)
#: State of a coil [A m^2]: its dipole; the one it goes to now, and on average; the one that its
#: driver makes of the command; the one it is commanded to have.
COIL_STATE = np.dtype(
    [(f"{name}_a_m2", np.float64) for name in ("dipole", "target", "mean", "given", "command")]
)


class CoilSet(NamedTuple):
    """Constants of the coils for kernels; `rows`: `COIL`, one per coil.

    `driver`: 1 for one that does not give each command as it is, else 0; `errs`: 1 for one with
    random errors, else 0; `pwm_period_s`: 0 for coils that are not switched; `pwm_place`: part of
    the rest of the period that comes before the pulse.
    """

    rows: np.ndarray
    residual_a_m2: tuple
    mode: int
    lag_s: float
    driver: int
    errs: int
    pwm_period_s: float
    pwm_place: float


#: Places of a pulse in its period: the part of the rest that comes before it.
PLACES = {"begin": 0.0, "middle": 0.5, "end": 1.0}
#: A satellite without coils.
NO_COILS = CoilSet(np.zeros(0, COIL), (0.0, 0.0, 0.0), SCALE, 0.0, 0, 0, 0.0, 0.0)


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
        state[i].command_a_m2 = state[i].given_a_m2 = state[i].target_a_m2
    return coil_targets(coils, state)


@inlined
def switch_off_coils(coils, state):
    """Set the targets of all coils to zero."""
    for i in range(state.shape[0]):
        state[i].target_a_m2 = state[i].given_a_m2 = state[i].command_a_m2 = 0.0
    return coil_targets(coils, state)


@inlined
def fail_coils(coils, failures, state, t_s):
    """Let failures change the targets of the coils at t_s; `failures`: rows of `COIL_FAILURE`."""
    for i in range(state.shape[0]):
        state[i].target_a_m2 = failed_dipole(failures, i, state[i].given_a_m2, t_s)
    return coil_targets(coils, state)


@inlined
def coil_targets(coils, state):
    """The coils' targets; without lag they are reached at once.

    Coils that are switched only go off at once: `torquer.simulation.propagate` switches them on.
    """
    for i in range(coils.rows.shape[0]):
        target = state[i].mean_a_m2 = state[i].target_a_m2
        if coils.lag_s == 0.0 and (coils.pwm_period_s == 0.0 or target == 0.0):
            state[i].dipole_a_m2 = target
    return find_goal(coils, state)


@inlined
def find_goal(coils, state):
    """What the coils go to now."""
    x, y, z = coils.residual_a_m2
    power = greatest = 0.0
    for i in range(coils.rows.shape[0]):
        coil, dipole = coils.rows[i], state[i].target_a_m2
        x, y, z = x + coil.axis_x * dipole, y + coil.axis_y * dipole, z + coil.axis_z * dipole
        power += coil.power * dipole * dipole
        greatest = max(greatest, abs(dipole))
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
        total += abs(state[i].mean_a_m2)
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


_Size, _SizeOrZero = Annotated[float, Field(gt=0.0)], Annotated[float, Field(ge=0.0)]
_Sizes, _SizesOrZero = _Size | tuple[_Size, ...], _SizeOrZero | tuple[_SizeOrZero, ...]


class Coils(Spec):
    """Coils (magnetorquers). Default: three along the body axes."""

    sheet: ClassVar = DataSheet(
        name="coil",
        senses="",
        unit="A m^2",
        bias="residual_dipole_a_m2",
        range="limit_a_m2",
        resolution="resolution_a_m2",
        random_scale="random_error",
        axes="axes",
        words={"bias": "residual dipole"},
    )
    limit_a_m2: _Sizes | None = None
    """Greatest dipole, one number or one per coil; left out: that of `windings`."""
    windings: Winding | tuple[Winding, ...] | None = None
    """Turns, area and greatest current, one table or one per coil, in place of `limit_a_m2`."""
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
    """Electrical power of a coil at its limit; left out: that of `windings` with a resistance, else
    energies are those of 1 W coils.
    """
    resolution_a_m2: _SizesOrZero = 0.0
    """Step to a multiple of which the driver rounds each command, one number or one per coil; 0:
    none.
    """
    dead_band_a_m2: _SizesOrZero = 0.0
    """Size of a command below which a coil stays off, one number or one per coil; 0: none."""
    random_error: float = Field(default=0.0, ge=0.0, le=1.0)
    """Standard deviation of each coil's dipole over its command, drawn at every command."""
    pwm_period_s: float | None = Field(default=None, gt=0.0)
    """Period of pulse-width modulation, counted from the start of the run: in each a coil is fully
    on for the share that the command is of the limit, then off. `lag_s` is how the dipole rises and
    falls. Readings see the dipole of their instant: of one that is switched then, that before. Left
    out: coils have the commanded dipole all the time.
    """
    pwm_place: Literal["begin", "middle", "end"] = "begin"
    """Where in each period the pulse stands, with `pwm_period_s`: 'begin' (from its beginning on),
    'middle' or 'end'. A later pulse acts on a field that has turned further since the reading.
    """
    failures: tuple[CoilFailure, ...] = ()
    """Failures in flight."""

    @model_validator(mode="after")
    def _place_of_a_pulse(self):
        if self.pwm_period_s is None and self.pwm_place != "begin":
            raise ValueError(
                f"pwm_place: must be left out without pwm_period_s; received {self.pwm_place!r}"
            )
        return self

    @model_validator(mode="after")
    def _limits_given_once(self):
        if (self.limit_a_m2 is None) == (self.windings is None):
            must = "given without" if self.windings is None else "left out with"
            received = "none" if self.windings is None else "both"
            raise ValueError(f"limit_a_m2: must be {must} windings; received {received}")
        given = self.each_winding()
        missing = [k for k, each in enumerate(given) if each.resistance_ohm is None]
        if missing and len(missing) < len(given):
            raise ValueError(
                f"windings[{missing[0]}].resistance_ohm: must be given for all coils or for none; "
                "received none"
            )
        if given and not missing and self.power_at_limit_w is not None:
            raise ValueError(
                "power_at_limit_w: must be left out with windings that have resistance_ohm; "
                f"received {self.power_at_limit_w:g}"
            )
        return self

    @model_validator(mode="after")
    def _one_of_each_per_coil(self):
        keys = ("limit_a_m2", "windings", "resolution_a_m2", "dead_band_a_m2")
        for key in (key for key in keys if isinstance(getattr(self, key), tuple)):
            what, count = "table" if key == "windings" else "number", len(getattr(self, key))
            if count != len(self.axes):
                raise ValueError(
                    f"{key}: must be one {what} or one per coil ({len(self.axes)} axes); "
                    f"received {count} {what}s"
                )
        if self.polarity is not None and len(self.polarity) != len(self.axes):
            raise ValueError(
                f"polarity: must have one number per coil ({len(self.axes)} axes); "
                f"received {len(self.polarity)} numbers"
            )
        return self

    @model_validator(mode="after")
    def _driver_gives_something(self):
        limits = self.limits_a_m2()
        for key in ("resolution_a_m2", "dead_band_a_m2"):
            sizes = self.per_coil(key)
            for k in np.flatnonzero(sizes > limits):
                raise ValueError(
                    f"{key}: must not exceed the limit of coil {k}, {limits[k]:g} A m^2, or it "
                    f"has no dipole at all; received {sizes[k]:g} A m^2"
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

    def each_winding(self) -> tuple[Winding, ...]:
        """The windings as given, one or one per coil; () for coils given by their limits."""
        given = self.windings
        return given if isinstance(given, tuple) else (given,) if given is not None else ()

    def per_coil(self, key: str) -> np.ndarray:
        """The numbers of a key (n,), which may be one for all."""
        return np.full(len(self.axes), getattr(self, key), dtype=np.float64)

    def short_pulse_s(self) -> float:
        """How much later than the middle of its period a short pulse stands [s]; 0 without any."""
        return (PLACES[self.pwm_place] - 0.5) * self.pwm_period_s if self.pwm_period_s else 0.0

    def limits_a_m2(self) -> np.ndarray:
        """Limit of each coil (n,) [A m^2], given or of its winding."""
        limits = [each.limit_a_m2() for each in self.each_winding()] or self.limit_a_m2
        return np.full(len(self.axes), limits, dtype=np.float64)

    def powers_w(self) -> np.ndarray | None:
        """Electrical power of each coil at its limit (n,) [W]; None if it is not known."""
        powers = [each.power_w() for each in self.each_winding()]
        if not powers or None in powers:
            powers = self.power_at_limit_w
        return None if powers is None else np.full(len(self.axes), powers, dtype=np.float64)

    def power_w(self) -> float | None:
        """Mean of the coils' electrical powers at their limits [W]; None if they are not known."""
        powers = self.powers_w()
        return None if powers is None else float(powers.mean())

    def shares(self) -> np.ndarray:
        """Dipole of each coil (n, 3) per component of a commanded vector: the pseudo-inverse."""
        return np.linalg.pinv(np.array(self.axes).T)

    def check_axes(self, purpose: str) -> None:
        """ValueError unless the coils can give a dipole along every direction."""
        spanned = int(np.linalg.matrix_rank(np.array(self.axes)))
        if spanned < 3:
            raise ValueError(
                f"spacecraft.coils.axes: must span all three axes for {purpose}, whose linear "
                "theory has coils that give the dipole that a law asks for; received "
                f"{len(self.axes)} that span {spanned}"
            )

    def reach_a_m2(self) -> np.ndarray:
        """Greatest dipole (3,) [A m^2] along each body axis by itself."""
        shares = np.abs(self.shares())
        with np.errstate(divide="ignore"):
            return np.min(
                self.limits_a_m2()[:, None] / np.where(shares < 1e-12, 0.0, shares), axis=0
            )

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
        powers = self.powers_w()
        rows["power"] = polarity**2 * (1.0 if powers is None else powers) / limits / limits
        rows["step_a_m2"] = step = self.per_coil("resolution_a_m2")
        rows["most_a_m2"] = greatest_multiple(limits, step)
        rows["dead_band_a_m2"] = self.per_coil("dead_band_a_m2")
        rows["error"] = self.random_error
        errs = self.random_error > 0.0
        driver = errs or bool(np.any(rows["step_a_m2"]) or np.any(rows["dead_band_a_m2"]))
        return CoilSet(
            records(rows),
            as_vector(self.residual_dipole_a_m2),
            MODES[self.saturation],
            self.lag_s,
            int(driver),
            int(errs),
            self.pwm_period_s or 0.0,
            PLACES[self.pwm_place],
        )
