"""Everything that the strength of the field says about a session's magnetometer, with a verdict."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

import numpy as np
import xarray as xr

from torquer.base.limits import RequestError
from torquer.computer.estimation.filter import Filter
from torquer.environment.along_orbit import OrbitEnvironment
from torquer.ground.telemetry.attitude import estimate_attitude
from torquer.ground.telemetry.axes import Axes, rank_axes
from torquer.ground.telemetry.calibration import (
    GROUPS,
    Calibration,
    Choice,
    TooManyOutliers,
    complete_rows,
)
from torquer.ground.telemetry.convention import Found, find_convention
from torquer.ground.telemetry.diagnosis.causes import NOTHING, Given, Known, Place
from torquer.ground.telemetry.diagnosis.diagnose import diagnose
from torquer.ground.telemetry.diagnosis.rows import find_usable
from torquer.ground.telemetry.diagnosis.verdict import Diagnosis
from torquer.ground.telemetry.diagnosis.words import mistake, notes, row_findings
from torquer.ground.telemetry.examination import Examination
from torquer.ground.telemetry.judged import choose_calibration, fitted_coupling, trusted_field
from torquer.ground.telemetry.modulus import (
    FieldAlong,
    FieldGiven,
    environment_along,
    strength_ratio,
)
from torquer.ground.telemetry.reading.read import Finding
from torquer.ground.telemetry.twin.members import Twin
from torquer.ground.telemetry.twin.twin import fit_twin
from torquer.ground.telemetry.undetermined import say_unturned, unturned_axes
from torquer.maths.geometry.frames import geodetic_from_ecef
from torquer.scenario.spec import Scenario

#: The first part of a session [s] that is compared with the rest, and how much worse is reported.
_FIRST_S, _WORSE = 600.0, 2.0


def examine(
    session,
    orbit=None,
    groups: tuple[str, ...] | None = None,
    leave_out_first_s: float = 0.0,
    filter_: Filter | None = None,
    scenario: Scenario | None = None,
    known: Known = NOTHING,
) -> Examination:
    """Examine a session (`torquer.ground.telemetry.reading.read.Session`).

    `orbit`: of the satellite, or None where the telemetry has `position_j`. `groups`: model of the
    calibration, by default chosen by blocks of time held out. `filter_`: makes an attitude of the
    calibrated readings, and a smoothed one. `scenario`: the satellite as it is believed to be,
    whose twin is fitted to them. `known`: what the diagnosis may rely on. ValueError without
    readings of a magnetometer, or without positions.
    """
    data, findings = session.data, list(session.findings)
    if "b_measured" not in data:
        raise ValueError("FILE: must hold b_measured, which nothing else replaces; received none")
    if orbit is None and "position_j" not in data:
        raise RequestError("orbit", "must be given where the telemetry has no position_j")
    data, t_s = _late_part(data, leave_out_first_s, findings)
    environment = environment_along(data, orbit)
    given = orbit is None
    field: FieldGiven | FieldAlong
    place: Given | Place
    if given:
        field = FieldGiven(environment, t_s, data["position_j"].values)
        place = Given(field)
    else:
        field, place = FieldAlong(environment, t_s), Place(environment)
    strength, _ = field.strength(t_s)
    ratio = strength_ratio(np.linalg.norm(data["b_measured"].values, axis=1), strength)
    mistakes: list[Finding] = []
    data, usable = _without_spoilt(data, findings)
    diagnosis = _diagnose(data, field, place, known, findings)
    if diagnosis is None:
        text = f"8 usable rows of b_measured or more are needed; received {usable}"
        mistakes.append(Finding("too few rows", len(t_s), text))
    else:
        mistakes += [each for each in (mistake(diagnosis, ratio),) if each is not None]
        findings += notes(diagnosis)
    is_fitted = not mistakes
    axes = _axes(data, diagnosis, None if given else environment, mistakes, findings)
    calibration: Calibration | None = None
    choices: tuple[Choice, ...] = ()
    if diagnosis is not None and is_fitted:
        vector = trusted_field(data, environment)
        try:
            calibration, choices = choose_calibration(
                data, field, groups, given, vector, diagnosis.bias_t, findings
            )
        except TooManyOutliers as error:
            mistakes.append(Finding("no calibration", len(t_s), str(error)))
    if calibration is not None:
        calibration = _with_still_axes(data, field, calibration)
        _note(data, field, calibration, findings)
    made = make_columns(data, environment, field, calibration, given)
    conventions: tuple[Found, ...] = ()
    attitude = twin = None
    if calibration is not None:
        corrected = data.assign(b_measured=(data["b_measured"].dims, calibration.apply(data)))
        along = _shift(environment, calibration.of("shift"))
        conventions = _conventions(corrected, along, mistakes, findings)
        if filter_ is not None and not mistakes:
            attitude = estimate_attitude(corrected, filter_, along)
        if scenario is not None and not mistakes:
            twin = _twin(corrected, scenario, calibration)
    return Examination(
        data,
        tuple(findings),
        tuple(mistakes),
        ratio,
        diagnosis,
        axes,
        calibration,
        choices,
        made,
        conventions,
        attitude,
        twin,
    )


def _without_spoilt(data, findings) -> tuple[xr.Dataset, int]:
    """The session without its frozen and saturated rows, and how many rows say something."""
    b = data["b_measured"].values
    usable = find_usable(data["time"].values, b)
    findings += row_findings(usable)
    spoilt = usable.frozen | usable.saturated
    if spoilt.any():
        kept = np.where(spoilt[:, None], np.nan, b)
        data = data.assign(b_measured=(data["b_measured"].dims, kept, data["b_measured"].attrs))
    return data, int(usable.kept.sum())


def _diagnose(data, field, place, known: Known, findings) -> Diagnosis | None:
    """What explains the readings; without what coils beside the magnetometer do, if that is it."""
    t_s, b = data["time"].values, data["b_measured"].values
    found = diagnose(t_s, b, place, known)
    if found is None or found.verdict == "stated" or "dipole_body" not in data:
        return found
    coupling = fitted_coupling(data, field)
    if coupling is None:
        return found
    again = diagnose(t_s, b - data["dipole_body"].values @ coupling.T, place, known)
    if again is None or again.verdict != "stated":
        return found
    text = "the readings feel the coils so strongly that causes are judged without their part"
    findings.append(Finding("coils are felt", len(t_s), text))
    return again


def _axes(data, diagnosis: Diagnosis | None, environment, mistakes, findings) -> Axes | None:
    """Ways to name the magnetometer's axes; its bias, as far as it is known, is taken off first."""
    b = data["b_measured"].values
    axes = rank_axes(data, b if diagnosis is None else b - diagnosis.bias_t, environment)
    if axes is not None and axes.is_wrong:
        text = (
            f"{axes.said}: {axes.errors_deg[0]:.1f} deg so, {axes.stated_deg:.1f} as stated; "
            f"{axes.text}"
        )
        mistakes.append(Finding("axes of the magnetometer wrong", len(b), text))
    elif axes is None:
        text = "without gyro or Sun sensor swapped axes of the magnetometer cannot be noticed"
        if "omega_measured" in data:
            text = (
                "swapped axes of the magnetometer cannot be noticed: too few rows follow one "
                "another with a turn by the gyro that is neither too large nor too small"
            )
        findings.append(Finding("axes not checked", 0, text))
    return axes


def _twin(corrected: xr.Dataset, scenario: Scenario, calibration: Calibration) -> Twin:
    """The twin, by readings with the noise that the calibration left."""
    bias_sigma = max(calibration.sigmas[name] for name in GROUPS["bias"].names)
    return fit_twin(
        corrected, scenario, calibration.sigma, bias_sigma, shift_s=calibration.of("shift")
    )


def _shift(environment: OrbitEnvironment, shift_s: float) -> OrbitEnvironment:
    """The environment at the stamps moved by a shift."""
    return replace(environment, start=environment.start + timedelta(seconds=shift_s))


def _conventions(data, along, mistakes, findings) -> tuple[Found, ...]:
    """Ways to read logged quaternions by the field and by the Sun, and what is wrong with them."""
    if "q_measured" not in data:
        return ()
    found = []
    for sensor, name in (("field", "b_measured"), ("sun", "sun_measured")):
        if name not in data:
            continue
        try:
            each = find_convention(data, along, sensor=sensor)
        except ValueError as error:
            findings.append(Finding("quaternions not checked", 0, str(error)))
            continue
        found.append(each)
        where = mistakes if each.is_wrong else findings
        key = "quaternions or axes of another convention" if each.is_wrong else "quaternions"
        where.append(Finding(key, each.rows, each.verdict))
    return tuple(found)


def _late_part(data, leave_out_first_s, findings):
    t_s = data["time"].values
    late = t_s >= leave_out_first_s
    if not late.any():
        raise RequestError("leave_out_first_min", "must leave rows; received more than there are")
    if not late.all():
        text = f"the first {leave_out_first_s / 60.0:g} min are left out, as asked"
        findings.append(Finding("left out", int(np.sum(~late)), text))
        data = data.isel(time=late)
        data = data.assign_coords(time=("time", t_s[late] - t_s[late][0], data["time"].attrs))
    return data, data["time"].values


def _with_still_axes(data, field, found: Calibration) -> Calibration:
    """The calibration with its usual sizes as errors along directions where no reading turns to."""
    rows, _, _ = complete_rows(data, field)
    still = unturned_axes(rows.m[found.weight > 0.0], found.sigma)
    if not len(still):
        return found
    covariance = found.covariance.copy()
    for group in ("bias", "scale"):
        place = [k for k, name in enumerate(found.names) if name in GROUPS[group].names]
        if place:
            covariance[np.ix_(place, place)] += GROUPS[group].size ** 2 * still.T @ still
    open_ = (*say_unturned(still), *found.undetermined)
    return found._replace(covariance=covariance, undetermined=open_)


def _note(data, field, found: Calibration, findings) -> None:
    """What a user must know of a calibration."""
    rows, _, _ = complete_rows(data, field)
    out = int(np.sum(found.weight == 0.0))
    if out:
        text = f"{out} rows ({100 * found.outliers:.1f} %) are outliers, without weight"
        findings.append(Finding("outliers", out, text))
    for each in found.undetermined:
        findings.append(Finding("not determined", 0, f"the data do not determine {each}"))
    if found.correlation > 2.0 / np.sqrt(len(found.residual)):
        text = f"residuals are correlated, {found.correlation:.2f} from row to row"
        findings.append(Finding("correlated residuals", 0, text))
    first = rows.t_s < rows.t_s[0] + _FIRST_S
    if first.sum() >= 5 and (~first).sum() >= 20:
        early, late = (np.median(np.abs(found.residual[each])) for each in (first, ~first))
        if early > _WORSE * late:
            text = (
                f"the first {_FIRST_S / 60.0:g} min have {early / late:.1f} times the residual of "
                "the rest, as after switching on: --leave-out-first-min 10 leaves them out"
            )
            findings.append(Finding("first minutes differ", int(first.sum()), text))


def make_columns(data, environment, field, found: Calibration | None, given: bool) -> xr.Dataset:
    """The session with columns like those of Swarm's MAGx_LR products, in nT, deg and m.

    `B_VFM` is the corrected reading in axes of the body, `F` its strength, `F_model` IGRF's at the
    stamp (shifted as fitted), `Flags_F` 1 for outliers, 255 for rows without a reading.
    """
    t_s = data["time"].values
    at_s = t_s + (0.0 if found is None else found.of("shift"))
    b = data["b_measured"].values if found is None else found.apply(data)
    r = data["position_j"].values if given else environment.state(at_s)[0]
    lat, lon, _ = geodetic_from_ecef(np.einsum("nij,nj->ni", environment.dcm_to_ecef(at_s), r))
    flags = np.full(len(t_s), 255)
    if found is not None:
        _, used, _ = complete_rows(data, field)
        flags[used] = found.weight == 0.0
    model = field.strength(at_s)[0]
    nt, deg = {"units": "nT"}, {"units": "deg"}
    return xr.Dataset(
        {
            "Latitude": ("Timestamp", np.degrees(lat), deg),
            "Longitude": ("Timestamp", np.degrees(lon), deg),
            "Radius": ("Timestamp", np.linalg.norm(r, axis=1), {"units": "m"}),
            "B_VFM": (("Timestamp", "axis"), 1e9 * b, nt),
            "F": ("Timestamp", 1e9 * np.linalg.norm(b, axis=1), nt),
            "F_model": ("Timestamp", 1e9 * model, nt),
            "Flags_F": ("Timestamp", flags.astype("u1"), {"flag_values": [0, 1, 255]}),
        },
        {"Timestamp": data["utc"].values, "axis": list("xyz")},
        {"source": data.attrs.get("source", ""), "field_model": "IGRF-14"},
    )
