"""Calibrations judged by more than |B|: by what the dipoles followed, and by logged attitudes.

A correction may make the strength better and the vector worse: a coupling that the noise made does,
and every block of time held out agrees with it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from torquer.base.limits import RequestError
from torquer.ground.telemetry.calibration import (
    GROUPS,
    MODELS,
    Calibration,
    Choice,
    TooManyOutliers,
    calibrate,
    choose,
    complete_rows,
)
from torquer.ground.telemetry.convention import find_convention
from torquer.ground.telemetry.diagnosis.loop import Followed, follow
from torquer.ground.telemetry.reading.read import Finding
from torquer.ground.telemetry.vector import MODEL, KnownField, calibrate_vector, known_field

#: A correction may leave the field vector this factor worse by a logged attitude.
_WORSE_VECTOR = 1.02
#: What the telemetry must have for a part of a model.
_NEEDED = {"coils": "dipole_body", "temperature": "temperature"}
#: The field has one strength where it varies by less than this [T].
_ONE_STRENGTH_T = 1e-9


def choose_calibration(
    data,
    field,
    groups,
    given: bool,
    vector: KnownField | None,
    near: np.ndarray,
    findings: list[Finding],
) -> tuple[Calibration, tuple[Choice, ...]]:
    """The calibration of a session, and the models that were compared for it.

    `groups`: the model that is asked for, None for the best; `given`: positions are those of the
    telemetry; `vector`: the field by logged attitudes; `near`: a probable bias [3] T; `findings`
    grows. RequestError for a model that the session does not allow.
    """
    loop = _loop(data, field)
    if groups == MODEL:
        return calibrate_vector(data, field, _needed(vector)), ()
    for group, name in _NEEDED.items():
        if groups is not None and group in groups and name not in data:
            raise RequestError(
                "model", f"must have {name} in the telemetry to fit {group}; received none"
            )
    if groups is not None and _stands_still(data, field):
        groups = _without_shift(groups)
    if groups is not None and "coils" in groups and loop is not None:
        raise RequestError("model", f"must not fit the coils, as {loop.text}; received coils")
    if loop is not None:
        findings.append(Finding("dipoles follow the readings", 0, f"coils not fitted: {loop.text}"))
    if groups is not None:
        return _judged(calibrate(data, field, groups, near), data, vector, findings), ()
    models = MODELS
    if given:  # positions belong to the stamps: a shift of both is not seen well
        models = tuple(dict.fromkeys(tuple(g for g in m if g != "shift") for m in models))
    if loop is not None:
        models = tuple(m for m in models if "coils" not in m)
    found, choices = choose(data, field, models=models, near=near)
    for smaller in reversed(models[: models.index(found.groups)]):
        if vector is None or not (errors := _errors(found, data, vector)).are_worse:
            break
        findings.append(_worse(found, errors, vector, "a smaller model is used"))
        found = calibrate(data, field, smaller, near)
    return _judged(found, data, vector, findings), choices


def _stands_still(data, field) -> bool:
    """Whether the field has one strength throughout, as at a place on the ground."""
    return bool(np.ptp(field.strength(data["time"].values)[0]) < _ONE_STRENGTH_T)


def _without_shift(groups: tuple[str, ...]) -> tuple[str, ...]:
    """A model without the shift, of which a constant strength says nothing."""
    if groups[-1] == "shift":
        raise RequestError(
            "model",
            "must not end in a shift in time where the strength of the field is constant, as at a "
            "place on the ground; received shift",
        )
    return tuple(each for each in groups if each != "shift")


def _loop(data, field) -> Followed | None:
    """How far the dipoles follow the readings; None where they do not, or are not known.

    A strong coupling makes readings follow the dipoles: so these must follow the readings also
    without the coupling that fits best.
    """
    if "dipole_body" not in data:
        return None
    rows, *_ = complete_rows(data, field)
    found = follow(rows.t_s, rows.m, rows.dipole)
    if found is None or not found.is_loop:
        return None
    coupling = fitted_coupling(data, field)
    if coupling is None:
        return found
    again = follow(rows.t_s, rows.m - rows.dipole @ coupling.T, rows.dipole)
    return found if again is None or again.follows else None


def fitted_coupling(data, field) -> np.ndarray | None:
    """Field [3, 3] T for each A m^2 of the coils that fits |B| best; None where nothing fits."""
    try:
        found = calibrate(data, field, ("bias", "scale", "non_orthogonality", "coils"))
    except TooManyOutliers:
        return None
    return np.array([found.of(name) for name in GROUPS["coils"].names]).reshape(3, 3)


def trusted_field(data, environment) -> KnownField | None:
    """The field by logged attitudes, if their convention agrees with the readings."""
    vector = known_field(data, environment)
    if vector is None:
        return None
    try:
        return vector if find_convention(data, environment).agrees else None
    except ValueError:  # too few usable rows: said where conventions are
        return None


def _needed(vector: KnownField | None) -> KnownField:
    if vector is None:
        raise RequestError(
            "model",
            "must have q_measured that agrees with the readings in 24 rows or more to be attitude; "
            "received telemetry without",
        )
    return vector


class _Errors(NamedTuple):
    """What the readings and a correction of them leave of the field vector [nT]."""

    before: float
    after: float

    @property
    def are_worse(self) -> bool:
        """Whether the corrected vector is farther from the field than the reading."""
        return self.after > _WORSE_VECTOR * self.before


def _errors(found: Calibration, data, vector: KnownField) -> _Errors:
    readings = (data["b_measured"].values, found.apply(data))
    return _Errors(*(1e9 * vector.error(each) for each in readings))


def _worse(found: Calibration, errors: _Errors, vector: KnownField, then: str) -> Finding:
    text = (
        f"up to {found.groups[-1]} the correction takes the field vector from {errors.before:.0f} "
        f"to {errors.after:.0f} nT by the logged attitude, which does not show in |B|: {then}. If "
        "the attitude was estimated from this magnetometer, it follows the errors of its readings"
    )
    return Finding("the vector gets worse", len(vector.rows), text)


def _judged(found: Calibration, data, vector: KnownField | None, findings) -> Calibration:
    """A calibration that was asked for or chosen, with what the vector says of it."""
    if vector is None:
        return found
    errors = _errors(found, data, vector)
    if errors.are_worse:
        findings.append(_worse(found, errors, vector, "do not use it without the reason"))
        return found
    text = (
        f"by the logged attitude the field vector goes from {errors.before:.0f} to "
        f"{errors.after:.0f} nT"
    )
    findings.append(Finding("vector", len(vector.rows), text))
    return found
