"""A scheme: laws one after another, each stage until its conditions hold. Data, not code.

One kernel runs every scheme: it finds the stage's laws by their numbers and adds their dipoles.
Conditions are taken from what the computer measures; the momentum is J omega of the gyro.

Memory: stage (from 1; 0: not begun, beyond the last: done), whether its conditions hold now and
since when [s], when each stage began [s] (-1: not yet); then that of every law.
"""

import json
import math
from typing import Annotated, Literal, Union

import numpy as np
from pydantic import BeforeValidator, Field, WithJsonSchema, model_validator

from torquer.control.built_in import BUILT_IN, KERNELS, ask
from torquer.control.law import Law
from torquer.control.spin_axis import (
    END,
    axis_of,
    inertia_parameters,
    target_body,
    unit_vector,
)
from torquer.engine import inlined, kernel, without_reference_counts
from torquer.geometry.vec3 import add, dot, norm, sym_vec
from torquer.spec import Inertia, Spec

#: Places in the memory.
STAGE, HELD, SINCE, STARTS = 0, 1, 2, 3
#: Places in the parameters: number of stages, where the rows of laws begin; axis and target as
#: in `spin_axis`, the inertia after them; then a row per stage, a row per law, their parameters.
STAGES, LAW_ROWS, STAGE_ROWS = 0, 1, END + 6
#: A stage's row: its first law and the one after its last; cosines of angles; rates [rad/s];
#: times [s].
FIRST, AFTER, NUTATION, TO_TARGET, MOMENTUM, SPIN, RATE, AT_LEAST, AT_MOST, FOR, STAGE_ROW = range(
    11
)
#: A law's row: its kernel, where its parameters and its memory begin and end.
KERNEL, FROM, TO, MEMORY_FROM, MEMORY_TO, LAW_ROW = range(6)
#: What stands for a condition that is not set: no cosine, any rate, no time.
_ANY_ANGLE, _ANY_RATE, _NEVER_S = -2.0, 1e9, 1e18
#: Rounding of a time must not cost a reading [s].
_ROUNDING_S = 1e-6


@inlined
def within(a, b, cosine):
    """Whether an angle between vectors has a greater cosine; never so for a vector of zeros."""
    return cosine < -1.0 or dot(a, b) > cosine * norm(a) * norm(b)


@inlined
def conditions_hold(measured, p, row):
    """Whether all conditions of a stage hold at this reading; angles of the axis' line."""
    axis, omega = axis_of(p), measured.omega_body_rad_s
    inertia = (p[END], p[END + 1], p[END + 2], p[END + 3], p[END + 4], p[END + 5])
    momentum, target = sym_vec(inertia, omega), target_body(measured, p)
    along = axis if dot(axis, momentum) >= 0.0 else (-axis[0], -axis[1], -axis[2])
    return (
        within(along, momentum, p[row + NUTATION])
        and within(axis, target, p[row + TO_TARGET])
        and within(momentum, target, p[row + MOMENTUM])
        and dot(axis, omega) > p[row + SPIN]
        and norm(omega) < p[row + RATE]
    )


@inlined
def stage_is_over(measured, p, memory, row):
    """Whether the stage has done its work, or had its time; remembers since when it holds."""
    spent_s = measured.t_s - memory[STARTS + int(memory[STAGE]) - 1]
    if not conditions_hold(measured, p, row):
        memory[HELD] = 0.0
    elif memory[HELD] == 0.0:
        memory[HELD], memory[SINCE] = 1.0, measured.t_s
    held_long = memory[HELD] == 1.0 and measured.t_s - memory[SINCE] >= p[row + FOR]
    return (held_long and spent_s >= p[row + AT_LEAST]) or spent_s >= p[row + AT_MOST]


@kernel
def begin_next(measured, p, memory):
    """Go to the next stage, and note when it begins."""
    memory[STAGE] += 1.0
    memory[HELD] = 0.0
    if memory[STAGE] <= p[STAGES]:
        memory[STARTS + int(memory[STAGE]) - 1] = measured.t_s


@kernel
def scheme(measured, parameters, memory):
    """The added dipoles of the laws of the stage that has come; nothing after the last.

    A stage's conditions are looked at from the reading after its first one on.
    """
    p, memory = without_reference_counts(parameters), without_reference_counts(memory)
    row = STAGE_ROWS + (int(memory[STAGE]) - 1) * STAGE_ROW
    begun, done = memory[STAGE] > 0.0, memory[STAGE] > p[STAGES]
    if not begun or (not done and stage_is_over(measured, p, memory, row)):
        begin_next(measured, p, memory)
        row += STAGE_ROW
    m = (0.0, 0.0, 0.0)
    if memory[STAGE] > p[STAGES]:
        return m
    for law in range(int(p[row + FIRST]), int(p[row + AFTER])):
        at = int(p[LAW_ROWS]) + law * LAW_ROW
        own = p[int(p[at + FROM]) : int(p[at + TO])]
        remembered = memory[int(p[at + MEMORY_FROM]) : int(p[at + MEMORY_TO])]
        m = add(m, ask(int(p[at + KERNEL]), measured, own, remembered))
    return m


def _known_kind(value):
    """One clear line for a kind that is none, and for the laws of users' files."""
    kind = value.get("kind") if isinstance(value, dict) else getattr(value, "kind", None)
    if kind not in BUILT_IN:
        raise ValueError(
            f"kind: must be one of {', '.join(BUILT_IN)} (a scheme takes the package's own laws "
            f"only); received {'nothing' if kind is None else repr(kind)}"
        )
    return value


#: A law of a stage. (Its keys may stand in the scheme: the schema of files asks for none here.)
Part = Annotated[
    Annotated[Union[tuple(BUILT_IN.values())], Field(discriminator="kind")],  # noqa: UP007
    BeforeValidator(_known_kind),
    WithJsonSchema(
        {"type": "object", "required": ["kind"], "properties": {"kind": {"enum": [*BUILT_IN]}}}
    ),
]
#: A bound that a measured angle or rate must be below or above; a time.
_Angle = Annotated[float, Field(gt=0.0, le=180.0)]
_Positive = Annotated[float, Field(gt=0.0)]


class Until(Spec):
    """When a stage ends: once all the conditions given have held together for `for_s`.

    `nutation_below_deg`: angle between the line of the axis and the momentum (0 for a spin either
    way); `axis_to_target_below_deg`, `momentum_to_target_below_deg`; `spin_above_deg_s`: rate
    about the axis; `rate_below_deg_s`: the whole rate. `at_least_s`: not before the stage has
    lasted so long; `at_most_s`: then in any case, which makes a stage of fixed length if it is
    given alone. An angle to what is not known (a Sun that is not seen, the momentum of a body at
    rest) is not below anything.
    """

    nutation_below_deg: _Angle | None = None
    axis_to_target_below_deg: _Angle | None = None
    momentum_to_target_below_deg: _Angle | None = None
    spin_above_deg_s: _Positive | None = None
    rate_below_deg_s: _Positive | None = None
    at_least_s: _Positive | None = None
    at_most_s: _Positive | None = None
    for_s: float = Field(default=0.0, ge=0.0)

    @model_validator(mode="after")
    def _something_ends_it(self):
        conditions = self.model_dump(exclude={"for_s"})
        if all(value is None for value in conditions.values()):
            raise ValueError(f"until: must have one of {', '.join(conditions)}; received none")
        if self.for_s > 0.0 and not self.waits_for_something:
            raise ValueError("for_s: needs a condition that is to hold; received times only")
        return self

    @property
    def waits_for_something(self) -> bool:
        """Whether there is a condition besides those of time."""
        times = {"at_least_s", "at_most_s", "for_s"}
        return any(value is not None for value in self.model_dump(exclude=times).values())

    def row(self) -> dict[str, float]:
        """The conditions as a stage's row of parameters, from the cosines on."""

        def cosine(angle_deg):
            return _ANY_ANGLE if angle_deg is None else math.cos(math.radians(angle_deg))

        def time(value_s, otherwise):
            return otherwise if value_s is None else max(0.0, value_s - _ROUNDING_S)

        timed = self.at_least_s is None and not self.waits_for_something
        spin, rate = self.spin_above_deg_s, self.rate_below_deg_s
        return {
            "cos_nutation": cosine(self.nutation_below_deg),
            "cos_axis_to_target": cosine(self.axis_to_target_below_deg),
            "cos_momentum_to_target": cosine(self.momentum_to_target_below_deg),
            "spin_above": -_ANY_RATE if spin is None else math.radians(spin),
            "rate_below": _ANY_RATE if rate is None else math.radians(rate),
            "at_least_s": time(self.at_least_s, _NEVER_S if timed else 0.0),
            "at_most_s": time(self.at_most_s, _NEVER_S),
            "for_s": time(self.for_s, 0.0),
        }


class Stage(Spec):
    """Laws that work at once, their dipoles added, until conditions hold (in the last: for ever,
    if `until` is left out)."""

    laws: tuple[Part, ...]
    until: Until | None = None

    @model_validator(mode="after")
    def _has_laws(self):
        if not self.laws:
            raise ValueError("laws: must hold one law or more ('off' is one); received none")
        return self


class Scheme(Spec):
    """Stages of laws in order; after the last one's `until` the coils are off.

    `stages`: tables of `laws`, a list whose dipoles are added, and `until`, a table of conditions
    that must hold together for `for_s`: `nutation_below_deg`, `axis_to_target_below_deg`,
    `momentum_to_target_below_deg`, `spin_above_deg_s`, `rate_below_deg_s`; `at_least_s` and
    `at_most_s` limit the length of the stage, a lone `at_most_s` fixes it.
    `axis`, `target` (a direction in the inertial frame, or 'sun') and `inertia_kg_m2` are what
    conditions are taken from, and stand for the same keys of the laws where those leave them out.
    """

    kind: Literal["scheme"] = "scheme"
    axis: unit_vector("axis") = (0.0, 0.0, 1.0)
    target: Literal["sun"] | unit_vector("target") | None = None
    inertia_kg_m2: Inertia | None = None
    stages: tuple[Stage, ...]

    @model_validator(mode="before")
    @classmethod
    def _share(cls, data):
        return _with_shared_keys(data) if isinstance(data, dict) else data

    @model_validator(mode="after")
    def _stages_fit(self):
        if not self.stages:
            raise ValueError("stages: must hold one stage or more; received none")
        for i, stage in enumerate(self.stages):
            if stage.until is None and i + 1 < len(self.stages):
                raise ValueError(
                    f"stages: stage {i + 1} must have an 'until', as one follows; received none"
                )
            if stage.until is not None:
                self._check_known(f"stages[{i}].until", stage.until)
        return self

    def _check_known(self, place: str, until: Until) -> None:
        """Conditions need to know the inertia, or the target."""
        nutation, momentum = until.nutation_below_deg, until.momentum_to_target_below_deg
        if self.inertia_kg_m2 is None and (nutation is not None or momentum is not None):
            raise ValueError(f"inertia_kg_m2: must be given for {place}; received none")
        axis = until.axis_to_target_below_deg
        if self.target is None and (axis is not None or momentum is not None):
            raise ValueError(f"target: must be given for {place}; received none")

    def law(self) -> Law:
        """The law that goes through these stages."""
        laws = [[part.law() for part in stage.laws] for stage in self.stages]
        every = [law for stage in laws for law in stage]
        memory = (0.0, 0.0, 0.0, *[-1.0] * len(laws), *(x for law in every for x in law.memory))
        return Law(
            self.kind,
            scheme,
            self._parameters(laws),
            memory,
            navigates=any(law.navigates for law in every),
            needs_sun=self.target == "sun" or any(law.needs_sun for law in every),
            spec=self,
        )

    def _parameters(self, laws: list[list[Law]]) -> dict[str, float]:
        """What the kernel reads, by names: stage1_spin_above, stage1_law2_gain, ..."""
        law_rows = STAGE_ROWS + len(laws) * STAGE_ROW
        at = law_rows + LAW_ROW * sum(map(len, laws))
        memory_at, first = STARTS + len(laws), 0
        stages, rows, own = {}, {}, {}
        for i, (stage, parts) in enumerate(zip(self.stages, laws, strict=True), start=1):
            until = stage.until or Until.model_construct(at_most_s=_NEVER_S)
            row = {"first_law": first, "after_law": first + len(parts), **until.row()}
            first += len(parts)
            stages |= _prefixed(f"stage{i}_", row)
            for k, law in enumerate(parts, start=1):
                ends = at + len(law.parameters), memory_at + len(law.memory)
                place = (KERNELS.index(law.function), at, ends[0], memory_at, ends[1])
                rows |= _prefixed(f"stage{i}_law{k}_", dict(zip(_LAW_NAMES, place, strict=True)))
                own |= _prefixed(f"stage{i}_law{k}_", law.parameters)
                at, memory_at = ends
        return {**self._header(law_rows), **stages, **rows, **own}

    def _header(self, law_rows: int) -> dict[str, float]:
        seen = isinstance(self.target, tuple)
        numbers = (
            len(self.stages), law_rows, *self.axis, self.target == "sun",
            *(self.target if seen else (0.0, 0.0, 0.0)),
        )  # fmt: skip
        names = ("stages", "law_rows", *(f"axis_{c}" for c in "xyz"), "sun",
                 *(f"target_{c}" for c in "xyz"))  # fmt: skip
        inertia = self.inertia_kg_m2 or ((0.0, 0.0, 0.0),) * 3
        head = {name: float(x) for name, x in zip(names, numbers, strict=True)}
        return {**head, **inertia_parameters(inertia)}


_LAW_NAMES = ("kernel", "parameters_from", "parameters_to", "memory_from", "memory_to")


def _prefixed(prefix: str, values: dict) -> dict[str, float]:
    return {prefix + name: float(value) for name, value in values.items()}


def _with_shared_keys(data: dict) -> dict:
    """The data with the scheme's axis, target and inertia in every law that takes them."""
    keys = ("axis", "target", "inertia_kg_m2")
    shared = {key: data[key] for key in keys if data.get(key) is not None}

    def filled(law):
        spec = BUILT_IN.get(law.get("kind")) if isinstance(law, dict) else None
        if spec is None:
            return law
        return {**{k: v for k, v in shared.items() if k in spec.model_fields}, **law}

    def with_laws(stage):
        if not isinstance(stage, dict) or not isinstance(stage.get("laws"), list | tuple):
            return stage
        return {**stage, "laws": [filled(law) for law in stage["laws"]]}

    if not isinstance(data.get("stages"), list | tuple):
        return data
    return {**data, "stages": [with_laws(stage) for stage in data["stages"]]}


def stage_starts_s(result) -> np.ndarray:
    """When each stage of a simulated scheme began [s]; not a number for one that never did.

    `result` is what `simulate` returned; the times are in the law's memory, at its checkpoint.
    """
    if result.attrs["law"] != "scheme":
        raise ValueError(f"result: must be that of a scheme; received law {result.attrs['law']}")
    parameters = json.loads(result.attrs["law_parameters"])
    stages = int(parameters["stages"])
    cells = int(max(v for name, v in parameters.items() if name.endswith("_memory_to")))
    memory = result["checkpoint"].values[-cells:]
    starts = memory[STARTS : STARTS + stages]
    return np.where(starts < 0.0, np.nan, starts)


def stage_at(result) -> np.ndarray:
    """Number of the stage, from 1, at every recorded instant of a simulated scheme.

    The last stage's number stays after its end.
    """
    starts = stage_starts_s(result)
    begun = starts[np.isfinite(starts)]
    return np.searchsorted(begun, result["time"].values, side="right")
