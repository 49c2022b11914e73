"""Work of `telemetry`: reads, examines, prints, writes."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from torquer.base.conventions import MU_EARTH_M3_S2
from torquer.base.strict_json import json_text
from torquer.cli.commands.telemetry import ProposeOptions, TelemetryOptions
from torquer.cli.loading import load_checked
from torquer.cli.options import CodeOptions
from torquer.cli.output import make_writable, print_note, table, table_console, writing_to
from torquer.cli.process import FAILED_CODE
from torquer.ground.telemetry.attitude import load_filter
from torquer.ground.telemetry.calibration import GROUPS, MODELS, split_shift
from torquer.ground.telemetry.convention import WAYS_SHOWN, Found
from torquer.ground.telemetry.examine import PARAMETER_HEAD, Examination, examine
from torquer.ground.telemetry.mapping import load_mapping, text_of_mapping
from torquer.ground.telemetry.modulus import start_of
from torquer.ground.telemetry.orbit import load_orbit
from torquer.ground.telemetry.propose import proposed
from torquer.ground.telemetry.read import read
from torquer.ground.telemetry.twin_found import Twin
from torquer.ground.telemetry.twin_members import text_of_members
from torquer.simulation.results.file import put

_WIDTH = 110
_MODELS = dict(
    zip(
        ("bias", "scale", "non-orthogonality", "shift", "coils", "temperature", "all"),
        MODELS,
        strict=True,
    )
)
#: Units in which parameters are shown, and the factor from SI.
_SHOWN = {"T": ("nT", 1e9), "1": ("%", 100.0), "rad": ("deg", 180.0 / np.pi), "s": ("s", 1.0),
          "T/(A m^2)": ("nT/(A m^2)", 1e9), "T/K": ("nT/K", 1e9)}  # fmt: skip

_TWIN_UNITS = {"inertia": "kg m^2", "dipole": "A m^2"}


def check(files: tuple[Path, ...], how: TelemetryOptions, code: CodeOptions) -> int:
    """Examine telemetry; 1 if it cannot be used as it is."""
    if not files:
        raise ValueError("FILE: must be given; received none")
    if (how.clock_sigma_s is None) != (how.along_track_sigma_km is None):
        raise ValueError("--clock-sigma-s: must be given with --along-track-sigma-km, and with it")
    session = read(files, None if how.mapping is None else load_mapping(how.mapping))
    orbit, about = None, "positions of the telemetry"
    if how.orbit is not None:
        orbit, about = load_orbit(how.orbit, start_of(session.data))
    out = how.out or Path("runs") / f"{files[0].stem}-telemetry"
    make_writable(out)
    groups = None if how.model is None else _MODELS[how.model]
    filter_ = None if how.filter is None else load_filter(how.filter)
    twin = None if how.twin is None else load_checked(how.twin, code)
    found = examine(session, orbit, groups, 60.0 * how.leave_out_first_min, filter_, twin)
    from torquer.report.telemetry.page import write_telemetry
    from torquer.simulation.results.netcdf import written

    with writing_to(out):
        put(out / "calibrated.nc", written(found.calibrated))
        names = ["calibrated.nc"]
        if found.attitude is not None:
            put(out / "attitude.nc", written(found.attitude.data))
            names.append("attitude.nc")
        if found.twin is not None and found.twin.data is not None and found.twin.onward is not None:
            put(out / "twin.nc", written(found.twin.data))
            put(out / "twin.toml", text_of_members(found.twin.onward, found.twin))
            names += ["twin.nc", "twin.toml"]
        names += write_telemetry(found, parameter_rows(found), twin_rows(found), about, out)
    data = as_data(found, about, how)
    if how.clock_sigma_s is not None and "split" not in data:
        print_note("--clock-sigma-s: splits nothing, as no shift was fitted")
    if how.json:
        print(json_text(data | {"out": str(out)}))
    else:
        _show(found, data, about)
        print(f"{out}: {', '.join(names)}")
    fits = found.attitude is None or found.attitude.fit.fits
    fits = fits and (found.twin is None or found.twin.fits)
    return 0 if fits and not found.mistakes else FAILED_CODE


def _show(found: Examination, data: dict, about: str) -> None:
    screen = table_console(_WIDTH)
    first, last = (np.datetime_as_string(found.data["utc"].values[k], "s") for k in (0, -1))
    print(f"{len(found.data['time'])} rows, {first}Z to {last}Z; {about}")
    for each in found.mistakes:
        print(f"WRONG: {each.text}")
    for each in found.findings:
        print(f"note: {each.text}")
    if found.calibration is not None:
        rows = parameter_rows(found)
        screen.print(table(PARAMETER_HEAD, rows, "Calibration", left=(0, 3)))
    if found.choices:
        screen.print(table(CHOICE_HEAD, choice_rows(found), "Models compared"))
    if found.twin is not None and found.twin.fits:
        screen.print(table(PARAMETER_HEAD, twin_rows(found), "Twin", left=(0, 3)))
    if "split" in data:
        clock, along = data["split"]["clock_s"], data["split"]["along_track_km"]
        print(f"clock {clock[0]:.2f} +- {clock[1]:.2f} s, along the track "
              f"{along[0]:.2f} +- {along[1]:.2f} km, by the errors stated beforehand")  # fmt: skip
    print(f"verdict: {found.verdict}")


CHOICE_HEAD = ("model up to", "fitted rms", "held-out rms")


def choice_rows(found: Examination) -> list[tuple[str, str, str]]:
    """The models that were compared, with their rms [nT]."""
    return [
        (each.groups[-1], f"{1e9 * each.fitted:.0f} nT", f"{1e9 * each.held_out:.0f} nT")
        for each in found.choices
    ]


def parameter_rows(found: Examination) -> list[tuple[str, str, str, str]]:
    """Parameters of the calibration in the units in which they are shown."""
    calibration = found.calibration
    rows: list[tuple[str, str, str, str]] = []
    if calibration is None:
        return rows
    for group in calibration.groups:
        unit, factor = _SHOWN[GROUPS[group].unit]
        for name in GROUPS[group].names:
            sigma = factor * calibration.sigmas[name]
            digits = max(0, 1 - int(np.floor(np.log10(max(sigma, 1e-9)))))
            value = f"{factor * calibration.of(name):.{digits}f}"
            rows.append((name, value, f"{sigma:.{digits}f}", unit))
    return rows


def twin_rows(found: Examination) -> list[tuple[str, str, str, str]]:
    """Parameters of the twin, to two digits of their deviations; those over the gain in SI."""
    if found.twin is None:
        return []
    rows = []
    for name, value, sigma in zip(
        found.twin.names, found.twin.values, found.twin.sigmas.values(), strict=True
    ):
        unit = next((each for key, each in _TWIN_UNITS.items() if name.startswith(key)), "")
        shown = "" if name.endswith("/gain") or name == "gain" else unit
        rows.append((name, *_with_error(value, sigma), shown))
    return rows


def _with_error(value: float, sigma: float) -> tuple[str, str]:
    """A number and its standard deviation, to two digits of the latter."""
    places = 1 - math.floor(math.log10(max(sigma, 1e-12)))
    if 0 <= places <= 6:
        return f"{value:.{places}f}", f"{sigma:.{places}f}"
    digits = math.floor(math.log10(abs(value) or sigma)) + places
    return f"{value:.{max(digits, 0)}e}", f"{sigma:.1e}"


def as_data(found: Examination, about: str, how: TelemetryOptions) -> dict:
    """What was found as plain data, SI."""
    data: dict = {
        "verdict": found.verdict,
        "usable": not found.mistakes,
        "rows": found.data.sizes["time"],
        "orbit": about,
        "strength_ratio": found.ratio,
        "mistakes": [each._asdict() for each in found.mistakes],
        "findings": [each._asdict() for each in found.findings],
    }
    if found.zone is not None:
        data["zone"] = {
            "best_h": found.zone.best_h,
            "residual_nt": found.zone.best_nt,
            "stated_nt": found.zone.stated_nt,
            "next_nt": found.zone.next_nt,
        }
    if found.axes is not None:
        data["axes"] = {
            "best": list(found.axes.orders[0]),
            "error_deg": float(found.axes.errors_deg[0]),
            "next_deg": float(found.axes.errors_deg[1]),
            "by": list(found.axes.by),
        }
    data["conventions"] = [_convention(each) for each in found.conventions]
    if found.attitude is not None:
        fit = found.attitude.fit
        data["attitude"] = {
            "fits": fit.fits,
            "reasons": list(fit.reasons),
            "rejected": fit.rejected,
            "known": fit.known,
            "sensors": [each._asdict() for each in fit.sensors],
        }
    if found.twin is not None:
        data["twin"] = _twin(found.twin)
    calibration = found.calibration
    if calibration is not None:
        data["calibration"] = {
            "model": list(calibration.groups),
            "values": {name: calibration.of(name) for name in calibration.names},
            "sigmas": {name: float(each) for name, each in calibration.sigmas.items()},
            "covariance": calibration.covariance.tolist(),
            "rms_t": calibration.rms,
            "outliers": calibration.outliers,
            "correlation": calibration.correlation,
            "undetermined": list(calibration.undetermined),
        }
        if "shift" in calibration.groups and how.clock_sigma_s is not None:
            radius = float(np.mean(found.calibrated["Radius"]))
            clock, along = split_shift(
                calibration.of("shift"),
                float(calibration.sigmas["shift"]),
                how.clock_sigma_s,
                1e3 * (how.along_track_sigma_km or 0.0),
                float(np.sqrt(MU_EARTH_M3_S2 / radius)),
            )
            data["split"] = {
                "clock_s": [float(each) for each in clock],
                "along_track_km": [float(each) / 1e3 for each in along],
            }
    return data


def _twin(found: Twin) -> dict:
    """A twin as plain data."""
    return {
        "fits": found.fits,
        "verdict": found.verdict,
        "only_ratio": found.only_ratio,
        "saturated": found.saturated,
        "values": {name: found.of(name) for name in found.names},
        "sigmas": found.sigmas,
        "covariance": found.covariance.tolist(),
        "chi2": found.chi2,
        "freedoms": found.freedoms,
        "window_s": found.window_s,
        "session_s": found.session_s,
        "undetermined": list(found.undetermined),
        "doubt": found.doubt,
    }


def _convention(found: Found) -> dict:
    """The best ways to read quaternions, ranked, as plain data."""
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


def propose(file: Path, how: ProposeOptions) -> int:
    """Write a proposed mapping, and say what of it is guessed."""
    if not file.is_file():
        raise ValueError(f"FILE: must be a file; received {file}")
    mapping, guesses = proposed(file)
    out = how.out or Path(f"{file.stem}.mapping.toml")
    if out.exists():
        raise ValueError(f"--out: must be a new file; received {out}")
    with writing_to(out.parent):
        put(out, text_of_mapping(mapping, guesses))
    if how.json:
        print(json_text({"mapping": str(out), "guesses": guesses}))
        return 0
    for each in guesses:
        print(f"guessed: {each}")
    print(f"{out}: check it, then `torquer telemetry {file.name} --mapping {out.name} --orbit ...`")
    return 0
