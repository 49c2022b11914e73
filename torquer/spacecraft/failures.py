"""Failures of sensors, coils and the on-board computer, each in an interval of the run.

The on-board computer does not know: it reads what a sensor sends, and believes that coils follow.
What is no number is no reading to it: see `torquer.computer.informed`.
A failure is data: rows of `Failures`, at which the loop looks.
"""

import math
from typing import Annotated, ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from torquer.base.spec import Spec, Vector
from torquer.compile.engine import inlined
from torquer.maths.geometry.vec3 import add_scaled, mat_vec

SILENT, STUCK, REPLACED, CHANGED = range(4)
HALTED, RESTARTED = range(2)
#: What an error of a reading turns.
TURNS_NOTHING, TURNS_DIRECTION, TURNS_ATTITUDE = range(3)
#: Kind for kernels, and the value that replaces all components of a reading.
KINDS = {
    "silent": (SILENT, 0.0),
    "stuck": (STUCK, 0.0),
    "zeros": (REPLACED, 0.0),
    "nan": (REPLACED, math.nan),
    "infinite": (REPLACED, math.inf),
    "reversed": (CHANGED, 0.0),
    "swapped": (CHANGED, 0.0),
    "bias": (CHANGED, 0.0),
    "noise": (CHANGED, 0.0),
}
_INTERVAL = [("from_s", np.float64), ("until_s", np.float64)]
#: A failure of a sensor: its number, kind, numbers of a reading, and whether an error turns it
#: (TURNS_NOTHING, a direction, an attitude); value that replaces; matrix, error by its constant
#: part and the standard deviation of its random part, that change a reading; instants.
SENSOR_FAILURE = np.dtype(
    [(name, np.int64) for name in ("sensor", "kind", "parts", "turns")]
    + [("value", np.float64)]
    + [(f"{row}{column}", np.float64) for row in "xyz" for column in "xyz"]
    + [(f"error_{c}", np.float64) for c in "xyz"]
    + [("sigma", np.float64), *_INTERVAL]
)
#: A failure of a coil: its number; the coil gives `factor` times its command plus a dipole [A m^2].
COIL_FAILURE = np.dtype(
    [("coil", np.int64), ("factor", np.float64), ("dipole_a_m2", np.float64), *_INTERVAL]
)
#: A failure of the computer: HALTED or RESTARTED.
COMPUTER_FAILURE = np.dtype([("kind", np.int64), *_INTERVAL])
#: First stream of the random numbers of failures; each failure of a sensor has one of its own.
FIRST_STREAM = 1 << 10


def in_words(sensor: str) -> str:
    """A sensor by its key, such as 'Sun sensors' for sun_sensors."""
    return sensor.replace("_", " ").replace("sun ", "Sun ")


class Failures(NamedTuple):
    """All failures of a run for kernels: rows of the three kinds of records above."""

    sensors: np.ndarray
    coils: np.ndarray
    computer: np.ndarray


@inlined
def failure_matrix(failure):
    """Matrix (rows) that a failure applies to the components of a reading."""
    f = failure
    return ((f.xx, f.xy, f.xz), (f.yx, f.yy, f.yz), (f.zx, f.zy, f.zz))


@inlined
def changed_vector(failure, reading):
    """The three components of a reading with axes exchanged or reversed, as a failure says."""
    return mat_vec(failure_matrix(failure), reading)


@inlined
def failure_error(failure, noise_sample):
    """Error that a failure adds to a reading; `noise_sample`: three standard normal numbers."""
    constant = (failure.error_x, failure.error_y, failure.error_z)
    return add_scaled(constant, failure.sigma, noise_sample)


@inlined
def failed_dipole(failures, coil, command_a_m2, t_s):
    """Dipole [A m^2] along its axis that a coil goes to at t_s for its command, by all failures."""
    dipole = command_a_m2
    for k in range(failures.shape[0]):
        f = failures[k]
        if f.coil == coil and f.from_s <= t_s < f.until_s:
            dipole = f.factor * dipole + f.dipole_a_m2
    return dipole


@inlined
def is_halted(failures, t_s):
    """Whether the computer does not work at t_s."""
    halted = False
    for k in range(failures.shape[0]):
        halted = halted or failures[k].from_s <= t_s < failures[k].until_s
    return halted


@inlined
def is_back(failures, before_s, t_s):
    """Whether a restart has ended since the control step before, at before_s."""
    back = False
    for k in range(failures.shape[0]):
        f = failures[k]
        back = back or (f.kind == RESTARTED and before_s < f.until_s <= t_s)
    return back


class Interval(Spec):
    """When a failure acts."""

    from_s: float = Field(default=0.0, ge=0.0)
    """Time since the start at which the failure begins."""
    until_s: float | None = None
    """Time since the start at which the failure ends; left out: it lasts to the end of the run."""

    @model_validator(mode="after")
    def _ends_after_it_begins(self):
        if self.until_s is not None and self.until_s <= self.from_s:
            raise ValueError(
                f"until_s: must be above from_s, {self.from_s:g} s; received {self.until_s:g} s"
            )
        return self

    def instants_s(self) -> tuple[float, float]:
        """Beginning and end [s]; infinite for one that lasts."""
        return self.from_s, math.inf if self.until_s is None else self.until_s

    def check_keys(self, needed: dict[str, tuple[str, ...]]) -> None:
        """ValueError unless each key is given for the kinds that need it, and for no other."""
        kind = getattr(self, "kind")  # noqa: B009
        for key, kinds in needed.items():
            received = getattr(self, key)
            if (received is None) == (kind in kinds):
                must = "given" if kind in kinds else "left out"
                shown = "none" if received is None else repr(received)
                raise ValueError(f"{key}: must be {must} for kind {kind!r}; received {shown}")


class SensorFailure(Interval):
    """A failure of a sensor in an interval of the run."""

    kind: Literal[
        "silent", "stuck", "zeros", "nan", "infinite", "reversed", "swapped", "bias", "noise"
    ]
    """'silent' (no new readings: the last one ages), 'stuck' (the last reading again and again,
    as if it were new), or one that changes the measurement. Each component becomes 'zeros', 'nan'
    (not a number) or 'infinite'; or 'reversed' (wrong sign) or 'swapped' (two axes exchanged), of
    an attitude sensor in the vector part of its quaternion. 'bias' adds a constant error of its
    own, 'noise' a random error of each reading, of its own.
    """
    axis: Literal["x", "y", "z"] | None = None
    """Axis whose sign is wrong, for 'reversed'; left out: all three."""
    axes: Literal["xy", "yz", "xz"] | None = None
    """Axes that are exchanged, for 'swapped'."""

    #: Keys of the constant and of the random error; none of a sensor whose errors have none.
    error_keys: ClassVar[tuple[str, ...]] = ()
    #: Whether a reading has components along the body's axes.
    has_axes: ClassVar[bool] = True
    #: SI units in one unit of these keys.
    si: ClassVar[float] = 1.0

    @classmethod
    def kinds(cls) -> tuple[str, ...]:
        """The kinds of failures that a sensor of this class may have."""
        without = ("bias", "noise") * (not cls.error_keys)
        without += ("reversed", "swapped") * (not cls.has_axes)
        return tuple(kind for kind in KINDS if kind not in without)

    @model_validator(mode="after")
    def _keys_of_the_kind(self):
        if self.kind not in self.kinds():
            names = ", ".join(self.kinds())
            raise ValueError(f"kind: must be one of {names}; received {self.kind!r}")
        kinds = zip(self.error_keys, ("bias", "noise"), strict=False)
        self.check_keys({"axes": ("swapped",)} | {key: (kind,) for key, kind in kinds})
        if self.axis is not None and self.kind != "reversed":
            raise ValueError(
                f"axis: must be left out for kind {self.kind!r}; received {self.axis!r}"
            )
        return self

    def _matrix(self) -> np.ndarray:
        """What is done to the components of a reading (3, 3)."""
        matrix = np.eye(3)
        if self.kind == "reversed":
            of = slice(None) if self.axis is None else "xyz".index(self.axis)
            matrix[of] *= -1.0
        elif self.axes is not None:
            a, b = ("xyz".index(c) for c in self.axes)
            matrix[[a, b]] = matrix[[b, a]]
        return matrix

    def _error(self) -> tuple[float, ...]:
        """Constant error of a reading, and standard deviation of the random one, in SI units."""
        given = [getattr(self, key) for key in self.error_keys] or [None, None]
        constant, sigma = (0.0, 0.0, 0.0) if given[0] is None else given[0], given[1] or 0.0
        return tuple(self.si * number for number in (*constant, sigma))

    def row(self, sensor: int, parts: int, turns: int) -> tuple:
        """The failure for kernels; `sensor`, `parts`, `turns`: see `SENSOR_FAILURE`."""
        kind, value = KINDS[self.kind]
        changed = *self._matrix().ravel(), *self._error()
        return sensor, kind, parts, turns, value, *changed, *self.instants_s()


_Size = Annotated[float, Field(gt=0.0)]


class FieldFailure(SensorFailure):
    """A failure of a magnetometer in an interval of the run."""

    error_keys: ClassVar = ("bias_nt", "noise_nt")
    si: ClassVar = 1e-9

    bias_nt: Vector | None = None
    """Constant error, for 'bias'."""
    noise_nt: _Size | None = None
    """Standard deviation of the error of each component, for 'noise'."""


class FieldRateFailure(SensorFailure):
    """A failure of a search coil in an interval of the run."""

    error_keys: ClassVar = ("bias_nt_s", "noise_nt_s")
    si: ClassVar = 1e-9

    bias_nt_s: Vector | None = None
    """Constant error, for 'bias'."""
    noise_nt_s: _Size | None = None
    """Standard deviation of the error of each component, for 'noise'."""


class RateFailure(SensorFailure):
    """A failure of a gyro in an interval of the run."""

    error_keys: ClassVar = ("bias_deg_s", "noise_deg_s")
    si: ClassVar = math.radians(1.0)

    bias_deg_s: Vector | None = None
    """Constant error, for 'bias'."""
    noise_deg_s: _Size | None = None
    """Standard deviation of the error of each component, for 'noise'."""


class DirectionFailure(SensorFailure):
    """A failure of a sensor of a direction or of the attitude in an interval of the run."""

    error_keys: ClassVar = ("bias_deg", "noise_deg")
    si: ClassVar = math.radians(1.0)

    bias_deg: Vector | None = None
    """Constant rotation of the reading about the body axes (a rotation vector), for 'bias'."""
    noise_deg: _Size | None = None
    """Standard deviation of a random rotation of each reading about each axis, for 'noise'."""


class PlainFailure(SensorFailure):
    """A failure of a sensor whose reading has no axes of its own."""

    has_axes: ClassVar = False


class CoilFailure(Interval):
    """A failure of a coil in an interval of the run."""

    coil: int = Field(ge=0)
    """Number of the coil, from 0."""
    kind: Literal["dead", "stuck", "reversed"]
    """'dead' (no dipole), 'stuck' (on, with one dipole whatever is commanded) or 'reversed' (the
    opposite of what is commanded).
    """
    dipole_a_m2: float | None = None
    """Dipole along its axis with which a coil is stuck, for 'stuck'."""

    @model_validator(mode="after")
    def _keys_of_the_kind(self):
        self.check_keys({"dipole_a_m2": ("stuck",)})
        return self

    def row(self) -> tuple:
        """The failure for kernels."""
        factor = -1.0 if self.kind == "reversed" else 0.0
        return self.coil, factor, self.dipole_a_m2 or 0.0, *self.instants_s()


class ComputerFailure(Interval):
    """A failure of the on-board computer in an interval of the run."""

    kind: Literal["halted", "restarted"]
    """'halted' or 'restarted'. While halted there are no control steps: coils and wheels keep their
    commands, the coils also where they would be off for a measurement. Then it goes on where it
    stopped. 'restarted' is the same, and at the end laws, estimators and modes begin as at the
    start of the run; the latest readings are there.
    """

    @model_validator(mode="after")
    def _a_restart_ends(self):
        if self.kind == "restarted" and self.until_s is None:
            raise ValueError("until_s: must be given for kind 'restarted'; received none")
        return self

    def row(self) -> tuple:
        """The failure for kernels."""
        return (RESTARTED if self.kind == "restarted" else HALTED), *self.instants_s()
