"""Work of `torquer design three-axis`: table, JSON, map, laws as TOML."""

import json
import math
from dataclasses import asdict, dataclass
from pathlib import Path

from torquer.cli.design_capture import Capture, CaptureTask, capture, law_keys, told
from torquer.cli.design_options import DesignCase
from torquer.cli.output import json_text, make_writable, writing_to
from torquer.theory.three_axis.design import (
    SETTLED,
    Candidate,
    ThreeAxisDesign,
    assessed,
    design_gains,
)
from torquer.theory.three_axis.response import greatest_angle

_HEAD = ("", "degree", "settling", "gain margin", "delay", "inertia", "error", "noise")
_UNITS = ("", "1/rad", "rev", "", "s", "%", "deg", "deg rms")


@dataclass(frozen=True)
class _Shown:
    """The design, its laws and the scenario's own by name, and what each captures, if asked."""

    design: ThreeAxisDesign
    candidates: dict[str, Candidate]
    captures: dict[str, Capture | None]


def show(case: DesignCase, starts: CaptureTask | None, out: Path | None, as_json: bool) -> int:
    """Print the design; write the map and the laws if a folder is given."""
    if out is not None:
        make_writable(out)
    try:
        made = _made(case, starts)
    except ArithmeticError as error:
        raise ValueError(str(error)) from None
    files = [] if out is None else _write(case, made.design, out)
    if as_json:
        print(json_text(_data(case, made, files)))
        return 0
    print(*_lines(case, made), sep="\n")
    if files:
        print(f"{out}: {', '.join(Path(file).name for file in files)}")
    return 0


def _made(case: DesignCase, starts: CaptureTask | None) -> _Shown:
    design, captures = design_gains(case.task), {}
    candidates = dict(design.candidates)
    if case.own is not None:
        candidates["own"] = assessed(case.task, case.own)
    if starts is not None:
        for name, each in candidates.items():
            captures[name] = capture(case.scenario, case.task, each, starts)
    return _Shown(design, candidates, captures)


def _lines(case: DesignCase, made: _Shown) -> list[str]:
    """The design as text."""
    task, hold = case.task, case.task.sampled.hold
    cycle, field = task.sampled.cycle, hold.surroundings.environment.field.kind
    off = f", coils off for {cycle.off_s:g} s" if cycle.off_s else ""
    rows = [_HEAD, _UNITS, *(_row(hold, *each) for each in made.candidates.items())]
    minutes = 2.0 * math.pi / hold.rate_rad_s / 60.0
    lines = [
        f"{case.name}: three axes by coils, field {field} (repeats after {hold.revolutions} rev of "
        f"{minutes:.1f} min), dipole held for {cycle.hold_s:g} s{off}, linear range "
        f"{task.linear_range_deg:g} deg",
        *("".join(f"{cell:>12}" for cell in row) for row in rows),
    ]
    for name in ("formula", "refined"):
        k, k_a = _pair(made.candidates[name])
        lines.append(f"{name}: rate_gain_n_m_s_per_t2 = {k:.6g}, angle_gain_n_m_per_t2 = {k_a:.6g}")
    lines.append(
        f"refined: no gains on the grids around it are better; the last grid has a spacing of "
        f"{100.0 * made.design.search.spacing.max():.2g} %"
    )
    lines += [told(name, found) for name, found in made.captures.items()]
    notes = [f"{name}: {note}" for name, each in made.candidates.items() for note in each.notes]
    return lines + [f"note: {note}" for note in (*case.notes, *notes)]


def _row(hold, name: str, candidate: Candidate) -> tuple[str, ...]:
    revolutions = candidate.settling_s * hold.rate_rad_s / (2.0 * math.pi)
    start = (name, f"{candidate.degree:.4f}", f"{revolutions:.2f}")
    if candidate.margins is None or candidate.error is None:
        return (*start, *["-"] * 5)
    margins, error = candidate.margins, candidate.error
    gains = f"{margins.least_gain:.2g}..{margins.greatest_gain:.3g}"
    delay, inertia = f"{margins.delay_s:.0f}", f"{100.0 * margins.inertia:.0f}"
    angles = (f"{math.degrees(x):.3g}" for x in (error.greatest_rad, error.noise_rms_rad))
    return (*start, gains, delay, inertia, *angles)


def _pair(candidate: Candidate) -> tuple[float, float]:
    values = candidate.law.values()
    return values["rate_gain"], values["angle_gain"]


def _data(case: DesignCase, made: _Shown, files: list[str]) -> dict:
    task, hold = case.task, case.task.sampled.hold
    return {
        "name": case.name,
        "orbital_rate_rad_s": hold.rate_rad_s,
        "revolutions": hold.revolutions,
        "limit_a_m2": task.limit_a_m2,
        "linear_range_deg": task.linear_range_deg,
        "gain_margin": task.gain_margin,
        "settled_part": SETTLED,
        "strengths": dict(zip(("formula", "refined"), made.design.strengths, strict=True)),
        "grid_spacing": float(made.design.search.spacing.max()),
        "candidates": {
            name: {**_candidate(each), "capture": _capture(made.captures.get(name))}
            for name, each in made.candidates.items()
        },
        "notes": list(case.notes),
        "files": files,
    }


def _candidate(candidate: Candidate) -> dict:
    error, margins = candidate.error, candidate.margins
    return {
        "law": law_keys(candidate.law),
        "degree_per_rad": candidate.degree,
        "continuous_degree_per_rad": candidate.continuous_degree,
        "averaged_degree_per_rad": candidate.averaged_degree,
        "settling_s": candidate.settling_s,
        "margins": margins and margins._asdict(),
        "error": error and {
            "greatest_deg": math.degrees(error.greatest_rad),
            "rms_deg": math.degrees(error.rms_rad),
            "noise_rms_deg": math.degrees(error.noise_rms_rad),
            "by_source_deg": {
                name: math.degrees(greatest_angle(turns)) for name, turns in error.by_source.items()
            },
            "greatest_dipole_a_m2": float(abs(error.dipoles_a_m2).max()),
        },
        "notes": list(candidate.notes),
    }  # fmt: skip


def _capture(found: Capture | None) -> dict | None:
    return None if found is None else {**asdict(found), "interval": list(found.interval)}


def _write(case: DesignCase, made: ThreeAxisDesign, out: Path) -> list[str]:
    """map.png and a TOML file of each law."""
    from torquer.report.theory.three_axis import draw_design

    with writing_to(out):
        files = [draw_design(case.task, made, out / "map.png")]
        for name, candidate in made.candidates.items():
            files.append(out / f"{name}.toml")
            files[-1].write_text(_toml(candidate.law), encoding="utf-8")
    return [str(file) for file in files]


def _toml(law) -> str:
    """A law as the table of a scenario."""
    rows = (f"{key} = {json.dumps(value)}" for key, value in law_keys(law).items())
    return "\n".join(["[control.law]", *rows, ""])
