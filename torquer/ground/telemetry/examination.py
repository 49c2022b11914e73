"""What an examination of telemetry found: verdict, texts for people, data for programs."""

from __future__ import annotations

import math
from html import escape
from typing import NamedTuple

import numpy as np
import xarray as xr

from torquer.base.rows import Row, as_data, as_html
from torquer.ground.telemetry.attitude import Attitude
from torquer.ground.telemetry.axes import Axes
from torquer.ground.telemetry.calibration import Calibration, Choice
from torquer.ground.telemetry.convention import WAYS_SHOWN, Found
from torquer.ground.telemetry.diagnosis.causes import CAUSES
from torquer.ground.telemetry.diagnosis.verdict import Diagnosis
from torquer.ground.telemetry.reading.read import Finding
from torquer.ground.telemetry.twin.members import Twin

#: Head of a table of parameters, of the calibration or the twin; of one of compared models.
PARAMETER_HEAD = ("parameter", "value", "sigma", "unit")
CHOICE_HEAD = ("model up to", "fitted rms", "held-out rms")
#: Units in which people see parameters, and the factor from SI, by the beginning of the name.
_UNITS = {
    "bias": ("nT", 1e9), "scale": ("%", 100.0), "skew": ("deg", 180.0 / math.pi),
    "matrix": ("", 1.0), "shift": ("s", 1.0), "coil": ("nT/(A m^2)", 1e9), "drift": ("nT/K", 1e9),
    "inertia": ("kg m^2", 1.0), "dipole": ("A m^2", 1.0), "gain": ("", 1.0),
}  # fmt: skip


class Split(NamedTuple):
    """Shares of a shift in time, value and standard deviation: of the clock [s], and of the
    satellite along its track [km]."""

    clock_s: tuple[float, float]
    along_track_km: tuple[float, float]


class Examination(NamedTuple):
    """What was found. `calibration` is None where there can be none; `calibrated`: the session
    with the columns of the output (`make_columns`); `conventions` of logged quaternions, by the
    field and by the Sun; `attitude`: by the filter, None where there is none or the telemetry is
    not usable; `orbit` in words; `split`: of the shift, where errors of clock and elements were
    stated. Pictures and a page: `torquer.report.telemetry.page.write_telemetry`."""

    data: xr.Dataset
    findings: tuple[Finding, ...]
    mistakes: tuple[Finding, ...]
    ratio: float
    diagnosis: Diagnosis | None
    axes: Axes | None
    calibration: Calibration | None
    choices: tuple[Choice, ...]
    calibrated: xr.Dataset
    conventions: tuple[Found, ...]
    attitude: Attitude | None
    twin: Twin | None
    orbit: str = ""
    split: Split | None = None

    @property
    def verdict(self) -> str:
        """The verdict in a few words."""
        found = self.calibration
        if self.mistakes or found is None:
            return f"not usable as it is: {'; '.join(each.key for each in self.mistakes)}"
        text = f"calibrated to {1e9 * found.rms:.0f} nT with {', '.join(found.groups)}"
        if found.undetermined:
            text += ", too short or too still to determine all of it"
        made = [each.verdict for each in (self.attitude, self.twin) if each is not None]
        return "; ".join([text, *made])

    @property
    def is_good(self) -> bool:
        """Whether the telemetry can be used as it is, and filter and twin fit it."""
        fits = self.attitude is None or self.attitude.fit.fits
        return fits and (self.twin is None or self.twin.fits) and not self.mistakes

    @property
    def facts(self) -> list[Row]:
        """About the telemetry as a whole."""
        first, last = (np.datetime_as_string(self.data["utc"].values[k], "s") for k in (0, -1))
        return [
            Row("rows", "Rows", count := self.data.sizes["time"], text=str(count)),
            Row("first", "From", f"{first}Z", text=f"{first}Z"),
            Row("last", "To", f"{last}Z", text=f"{last}Z"),
            Row("orbit", "Positions", self.orbit, text=self.orbit),
            Row(
                "strength_ratio", "Strength over the model's", self.ratio, text=f"{self.ratio:.4g}"
            ),
        ]

    def as_plain(self) -> dict:
        """What was found as plain data, SI."""
        parts = {
            "diagnosis": None if self.diagnosis is None else _diagnosis(self.diagnosis),
            "axes": None if self.axes is None else _axes(self.axes),
            "conventions": [_convention(each) for each in self.conventions],
            "attitude": None if self.attitude is None else _attitude(self.attitude),
            "twin": None if self.twin is None else _twin(self.twin),
            "calibration": None if self.calibration is None else _calibration(self.calibration),
            "split": None if self.split is None else self.split._asdict(),
        }
        return {
            "verdict": self.verdict,
            "usable": not self.mistakes,
            **as_data(self.facts),
            "mistakes": [each._asdict() for each in self.mistakes],
            "findings": [each._asdict() for each in self.findings],
            **{key: part for key, part in parts.items() if part is not None},
        }

    def _repr_html_(self) -> str:
        """Verdict, parameters and findings for a notebook."""
        rows = (*parameter_texts(self.calibration), *parameter_texts(self.twin))
        table = [
            [Row("", label, text=text) for label, text in zip(PARAMETER_HEAD, texts, strict=True)]
            for texts in rows
        ]
        notes = [each.text for each in (*self.mistakes, *self.findings)]
        return f"<p>{escape(self.verdict)}</p>{as_html(table, notes)}"


def parameter_texts(found: Calibration | Twin | None) -> list[tuple[str, str, str, str]]:
    """Parameters that were fitted, as texts under `PARAMETER_HEAD`."""
    return [] if found is None else [_parameter(name, found) for name in found.names]


def _parameter(name: str, found: Calibration | Twin) -> tuple[str, str, str, str]:
    unit, factor = next(each for key, each in _UNITS.items() if name.startswith(key))
    value, sigma = with_error(factor * found.of(name), factor * found.sigmas[name])
    return name, value, sigma, "" if name.endswith("/gain") else unit


def with_error(value: float, sigma: float) -> tuple[str, str]:
    """A number and its standard deviation, to two digits of the latter or to whole numbers."""
    places = 1 - math.floor(math.log10(max(sigma, 1e-12)))
    if -3 < places <= 6:
        return f"{value:.{max(places, 0)}f}", f"{sigma:.{max(places, 0)}f}"
    digits = math.floor(math.log10(abs(value) or sigma)) + places
    return f"{value:.{max(digits, 0)}e}", f"{sigma:.1e}"


def choice_texts(choices: tuple[Choice, ...]) -> list[tuple[str, str, str]]:
    """The models that were compared, as texts under `CHOICE_HEAD`."""
    return [
        (each.groups[-1], f"{1e9 * each.fitted:.0f} nT", f"{1e9 * each.held_out:.0f} nT")
        for each in choices
    ]


def _diagnosis(found: Diagnosis) -> dict:
    """Verdict, causes that are not excluded, and all that were tried, best first."""
    return {
        "verdict": found.verdict,
        "not_excluded": list(found.rivals),
        "floor_nt": found.floor_nt,
        "rows": found.rows,
        "causes": [
            {**each._asdict(), "text": CAUSES[each.cause].say(each.value)} for each in found.ranking
        ],
        "plane": None if found.plane is None else found.plane._asdict(),
    }


def _axes(axes: Axes) -> dict:
    return {
        "best": list(axes.orders[0]),
        "error_deg": float(axes.errors_deg[0]),
        "next_deg": float(axes.errors_deg[1]),
        "stated_deg": axes.stated_deg,
        "shares": {" ".join(o): float(s) for o, s in zip(axes.orders, axes.shares, strict=True)},
        "by": list(axes.by),
    }


def _attitude(attitude: Attitude) -> dict:
    fit = attitude.fit
    return {
        "fits": fit.fits,
        "reasons": list(fit.reasons),
        "rejected": fit.rejected,
        "known": fit.known,
        "sensors": [each._asdict() for each in fit.sensors],
    }


def _by_name(found: Calibration | Twin) -> dict:
    return {"values": {name: found.of(name) for name in found.names}, "sigmas": found.sigmas}


def _calibration(calibration: Calibration) -> dict:
    return {
        "model": list(calibration.groups),
        **_by_name(calibration),
        "covariance": calibration.covariance.tolist(),
        "rms_t": calibration.rms,
        "outliers": calibration.outliers,
        "correlation": calibration.correlation,
        "undetermined": list(calibration.undetermined),
    }


def _twin(twin: Twin) -> dict:
    return {
        "fits": twin.fits,
        "verdict": twin.verdict,
        "only_ratio": twin.only_ratio,
        "saturated": twin.saturated,
        **_by_name(twin),
        "covariance": twin.covariance.tolist(),
        "chi2": twin.chi2,
        "freedoms": twin.freedoms,
        "window_s": twin.window_s,
        "session_s": twin.session_s,
        "undetermined": list(twin.undetermined),
        "doubt": twin.doubt,
    }


def _convention(found: Found) -> dict:
    """The best ways to read quaternions, ranked."""
    return {
        "by": found.sensor,
        "rows": found.rows,
        "agrees": found.agrees,
        "is_wrong": found.is_wrong,
        "not_told_apart": len(found.rivals),
        "margin": found.margin,
        "stated_deg": found.stated.error_deg,
        "ways": [way._asdict() for way in found.ways[:WAYS_SHOWN]],
    }
