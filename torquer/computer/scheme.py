"""A scheme: laws one after another, each stage until its conditions hold. Data, not code.

It is a short way to write a chain of modes (`torquer.computer.modes.scheme`). Conditions are taken
from what the computer knows; the momentum is J omega of the estimated rate.
"""

from typing import Annotated, Literal

import numpy as np
from pydantic import BeforeValidator, Field, WithJsonSchema, model_validator

from torquer.base.spec import Inertia, Spec, unit_vector
from torquer.computer.laws.built_in import BUILT_IN, BuiltIn


def _known_kind(value):
    """One clear line for a kind that is none, and for the laws of users' files."""
    kind = value.get("kind") if isinstance(value, dict) else getattr(value, "kind", None)
    if not isinstance(kind, str) or kind not in BUILT_IN:
        raise ValueError(
            f"kind: must be one of {', '.join(BUILT_IN)} (a scheme takes the package's own laws "
            f"only); received {'nothing' if kind is None else repr(kind)}"
        )
    return value


#: A law of a stage. (Its keys may stand in the scheme: the schema of files asks for none here.)
Part = Annotated[
    Annotated[BuiltIn, Field(discriminator="kind")],
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

    An angle to what is not known (a Sun that is not seen, the momentum of a body at rest) is not
    below anything.
    """

    nutation_below_deg: _Angle | None = None
    """Angle between the line of the axis and the momentum, 0 for a spin either way."""
    axis_to_target_below_deg: _Angle | None = None
    """Angle between the axis and the target."""
    momentum_to_target_below_deg: _Angle | None = None
    """Angle between the momentum and the target."""
    spin_above_deg_s: _Positive | None = None
    """Rate about the axis."""
    rate_below_deg_s: _Positive | None = None
    """Magnitude of the rate."""
    at_least_s: _Positive | None = None
    """Time before which the stage does not end."""
    at_most_s: _Positive | None = None
    """Time after which the stage ends whatever the conditions; given alone it fixes the stage's
    length.
    """
    for_s: float = Field(default=0.0, ge=0.0)
    """Time for which the conditions must have held together."""

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


class Stage(Spec):
    """Laws that work at once, their dipoles added, until conditions hold (in the last: for ever,
    if `until` is left out)."""

    laws: tuple[Part, ...]
    """Laws that work at once, their dipoles added."""
    until: Until | None = None
    """When the stage ends; left out in the last stage: never."""

    @model_validator(mode="after")
    def _has_laws(self):
        if not self.laws:
            raise ValueError("laws: must hold one law or more ('off' is one); received none")
        return self


class Scheme(Spec):
    """Stages of laws in order; after the last one's `until` the coils are off."""

    kind: Literal["scheme"] = "scheme"
    axis: unit_vector("axis") = (0.0, 0.0, 1.0)
    """Spin axis in the body, of any length, for conditions and for laws that leave out theirs."""
    target: Literal["sun"] | unit_vector("target") | None = None
    """Direction in the inertial frame, or 'sun', for conditions and for laws that leave out theirs.
    """
    inertia_kg_m2: Inertia | None = None
    """Inertia, three moments or 3x3, for conditions and for laws that leave out theirs."""
    stages: tuple[Stage, ...]
    """The stages in order."""

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


def _with_shared_keys(data: dict) -> dict:
    """The data with the scheme's axis, target and inertia in every law that takes them."""
    keys = ("axis", "target", "inertia_kg_m2")
    shared = {key: data[key] for key in keys if data.get(key) is not None}

    def filled(law):
        kind = law.get("kind") if isinstance(law, dict) else None
        spec = BUILT_IN.get(kind) if isinstance(kind, str) else None
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

    `result` is what `simulate` returned.

        >>> bdot = {"kind": "bdot", "gain_a_m2_s_per_t": 2e4}
        >>> stages = [{"laws": [bdot], "until": {"at_most_s": 100.0}}, {"laws": [{"kind": "off"}]}]
        >>> scheme = {"kind": "scheme", "stages": stages}
        >>> staged = torquer.simulate(scenario.replace("control.law", scheme))
        >>> torquer.stage_starts_s(staged).tolist()
        [0.0, 100.0]
    """
    names = [str(name) for name in result["mode"].values] if "mode" in result.coords else []
    stages = [k for k, name in enumerate(names) if name.startswith("main.stage_")]
    if not stages:
        raise ValueError("result: must be that of a scheme; received one of other laws")
    starts = result["mode_entered"].values[stages]
    return np.where(np.isfinite(starts), starts, np.nan)


def stage_at(result) -> np.ndarray:
    """Number of the stage, from 1, at every recorded instant of a simulated scheme.

    The last stage's number stays after its end.

        >>> bdot = {"kind": "bdot", "gain_a_m2_s_per_t": 2e4}
        >>> stages = [{"laws": [bdot], "until": {"at_most_s": 100.0}}, {"laws": [{"kind": "off"}]}]
        >>> scheme = {"kind": "scheme", "stages": stages}
        >>> staged = torquer.simulate(scenario.replace("control.law", scheme))
        >>> torquer.stage_at(staged)[[0, -1]].tolist()
        [1, 2]
    """
    starts = stage_starts_s(result)
    begun = starts[np.isfinite(starts)]
    return np.searchsorted(begun, result["time"].values, side="right")
