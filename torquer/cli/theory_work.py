"""What `torquer theory` does: answers in text and JSON, design tables, pictures."""

import json as json_
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from torquer.cli import theory_text as text
from torquer.cli.output import make_writable, writing_to
from torquer.cli.theory_options import Question, in_range
from torquer.cli.theory_sampling import sampling_lines, sampling_notes, sampling_told
from torquer.environment.field.averaged import cone_angle
from torquer.theory.comparison import resonances
from torquer.theory.design import (
    GOALS,
    Row,
    Times,
    design_table,
    gain_for,
    gain_of,
    slow_time,
    times_over_directions,
)
from torquer.theory.equilibria import find_equilibria, rates_of_evolution, tends_to
from torquer.theory.evolution.model import Slow
from torquer.theory.slow_motion import evolve, map_of_evolution
from torquer.theory.validity import PRECESSION, SLOW_CHANGE

_TURN = 2.0 * math.pi
#: Harmonics of the laws here: 2 in the precession angle, 4 in u; none turns on phi.
_HARMONICS = int(PRECESSION.least)
#: Parts of the gain in a design table, and small parameters of one without a gain.
_PARTS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)
_EPS = (0.003, 0.01, 0.03, 0.1, 0.3)
_GRID = 61
#: Laws with a target.
_POINTED = ("reorientation", "preliminary_1", "preliminary_2")


def _check(revolutions: float | None) -> None:
    if revolutions is not None and not 0.0 < revolutions < math.inf:
        raise ValueError(f"--revolutions: must be a positive number; received {revolutions:g}")
    in_range("--revolutions", "revolutions", revolutions, 0.0)


def show(asked: Question, part, revolutions, latex: bool, out: Path | None, as_json: bool) -> int:
    """Print what the averaged motion says; draw it if a folder is given."""
    _check(revolutions)
    if out is not None:
        make_writable(out)
    formulas = _latex(asked.law) if latex else None
    told, courses = _told(asked, part, revolutions)
    if formulas:
        told["latex"] = formulas
    if out is not None:
        with writing_to(out):
            told["pictures"] = _draw(asked, told["course_revolutions"], courses, out)
    if as_json:
        print(json_.dumps(told, indent=2))
        return 0
    print("\n".join(_lines(asked, told)))
    return 0


def _times(asked: Question, part: float) -> Times:
    """Slow times to a part of the first value; all the same where the direction is known."""
    if asked.rho is None:
        return times_over_directions(asked.evolution, asked.case, asked.theta, part)
    start = Slow(1.0, asked.rho, asked.sigma, asked.theta)
    return Times(*3 * (slow_time(asked.evolution, asked.case, start, part),))


def _told(asked: Question, part: float, revolutions: float | None) -> tuple[dict, dict]:
    """The answer as plain data, and the courses that show it."""
    case, spinner = asked.case, asked.spinner
    times = _times(asked, part)
    points = tends_to(find_equilibria(rates_of_evolution(asked.evolution, case)))
    start = None if asked.rho is None else Slow(1.0, asked.rho, asked.sigma, asked.theta)
    turns = _turns(times, case.eps)
    length = revolutions or _length(turns)
    courses = _courses(asked, length)
    told = {
        "law": asked.law,
        "gain": asked.gain,
        "orbit": {
            "inclination_deg": spinner.inclination_deg,
            "period_s": asked.period_s,
            "strength_nt": 1e9 * spinner.strength_t,
            "p": case.moments[0],
            "cone_deg": math.degrees(cone_angle(math.radians(spinner.inclination_deg))),
        },
        "satellite": {
            "transverse_kg_m2": spinner.transverse_kg_m2,
            "axial_kg_m2": spinner.axial_kg_m2,
            "momentum_n_m_s": spinner.momentum_n_m_s,
            "theta_deg": math.degrees(asked.theta),
            "rho_deg": None if asked.rho is None else math.degrees(asked.rho),
            "eta": list(spinner.eta),
        },
        "eps": case.eps,
        "quantity": GOALS[asked.law].name,
        "part": part,
        "revolutions": turns,
        "seconds": {k: v and v * asked.period_s for k, v in turns.items()},
        "course_revolutions": length,
        "tends_to": [
            {
                "told": each.description.replace("third axis", "cone axis"),
                "length_rate": each.length_rate,
            }
            for each in points
        ],
        "equations": list(text.EQUATIONS[asked.law]),
        "first_integrals": [
            {"name": name, "formula": formula, "at_start": _value(asked, name, start),
             "drift": _drift(courses, name)}
            for name, formula in text.INTEGRALS[asked.law].items()
        ],
        "sampling": sampling_told(asked),
        "notes": [*asked.notes, *sampling_notes(asked), *_doubts(courses), *_warnings(asked)],
    }  # fmt: skip
    return told, courses


def _courses(asked: Question, revolutions: float) -> dict:
    """Slow motions from the direction given, or from some, by name."""
    u = np.linspace(0.0, _TURN * revolutions, 400)
    some = (20.0, 60.0, 90.0, 120.0, 150.0) if asked.law in _POINTED else (10.0, 30.0, 50.0, 70.0,
                                                                           85.0)  # fmt: skip
    starts = np.radians(some) if asked.rho is None else [asked.rho]
    return {
        f"rho₀ {math.degrees(rho):.3g}°": evolve(
            asked.evolution, asked.case, Slow(1.0, float(rho), asked.sigma, asked.theta), u
        )
        for rho in starts
    }


def _drift(courses: dict, name: str) -> float | None:
    """Greatest drift of a first integral; None where it does not hold, or is infinite."""
    known = [course.drift.get(name, math.nan) for course in courses.values()]
    known = [x for x in known if math.isfinite(x)]
    return max(known, default=None)


def _doubts(courses: dict) -> list[str]:
    """What is doubtful on the courses, each once."""
    return list(dict.fromkeys(note for course in courses.values() for note in course.notes))


def _turns(times: Times, eps: float) -> dict:
    """Revolutions; None for never."""
    return {name: _number(s / (_TURN * eps)) for name, s in times._asdict().items()}


def _number(value) -> float | None:
    return float(value) if math.isfinite(value) else None


def _value(asked, name, start) -> float | None:
    """A first integral where the direction is known and no logarithm of zero is asked for."""
    if start is None:
        return None
    with np.errstate(all="ignore"):
        return _number(asked.evolution.integrals[name](start, asked.case))


def _warnings(asked: Question) -> list[str]:
    """Where the averages are not to be relied upon."""
    notes, eps, spinner = [], asked.case.eps, asked.spinner
    precession = spinner.eta[1]
    slow = Slow(1.0, asked.rho or 1.0, asked.sigma, asked.theta)
    near = [n for n in resonances(spinner, slow, greatest=_HARMONICS, width=max(0.05, eps))
            if n[0] == 0 and 0 < abs(n[1]) <= 2]  # fmt: skip
    if precession < _HARMONICS:
        notes.append(
            f"the precession, {precession:.3g} times the orbital rate, is not fast: the averages "
            "do not hold"
        )
    elif near:
        _, b, c = near[0]
        notes.append(f"resonance near: {b} x precession {c:+d} x orbital rate is about zero")
    if asked.law == "bdot" and precession > _HARMONICS:
        notes.append(
            f"the averages hold until the precession passes {_HARMONICS} orbital rates: down to "
            f"l = {_HARMONICS / precession:.2g}"
        )
    return notes


def _lines(asked: Question, told: dict) -> list[str]:
    orbit, body = told["orbit"], told["satellite"]
    unit = text.UNITS[asked.law]
    rho = "any direction" if asked.rho is None else f"rho0 {body['rho_deg']:.1f} deg"
    lines = [
        f"{asked.law}, gain {asked.gain:g} {unit}: {asked.name}, period {asked.period_s / 60:.1f} "
        f"min, B0 {orbit['strength_nt']:.0f} nT",
        f"A {body['transverse_kg_m2']:.4g}, C {body['axial_kg_m2']:.4g} kg m^2, L0 "
        f"{body['momentum_n_m_s']:.4g} N m s, theta0 {body['theta_deg']:.1f} deg, {rho}",
        "",
        f"eps = {text.SMALL[asked.law]} = {told['eps']:.4g}",
        f"{told['quantity']} to {100 * told['part']:g} %: {_span(told['revolutions'])} revolutions",
        "it tends to:",
        *(f"  {each['told']}" for each in told["tends_to"]),
        *sampling_lines(asked),
        "",
        f"equations, {text.SHARED}:",
        *(told.get("latex") or "\n".join(f"  {line}" for line in told["equations"])).splitlines(),
        f"constant (drifts in terms of l and radians, over {told['course_revolutions']:.3g} "
        "revolutions):",
    ]
    for each in told["first_integrals"]:
        value = "" if each["at_start"] is None else f" = {each['at_start']:.5g}"
        drift = "" if each["drift"] is None else f"; drifts by {each['drift']:.1g}"
        lines.append(f"  {each['formula']}{value}{drift}")
    lines += [f"note: {note}" for note in told["notes"]]
    return lines + [f"{path}" for path in told.get("pictures", ())]


def _span(times: dict) -> str:
    """Least, median and greatest in words."""
    least, median, greatest = (
        "never" if value is None else f"{value:.3g}" for value in times.values()
    )
    if least == greatest:
        return least
    return f"{least} to {greatest} by direction, median {median},"


def _latex(law: str) -> str:
    """The equations of the very law that flies, averaged by sympy."""
    try:
        from torquer.theory import symbolic
    except ImportError:
        raise ValueError(
            "--latex: needs sympy: pip install 'torquer[symbolic]'; received an installation "
            "without it"
        ) from None
    import sympy

    made, symbols = _symbolic_law(law), {"gain": sympy.Symbol("k", positive=True)}
    if "j_xx" in made.parameters:
        symbols |= {"j_xx": symbolic.transverse, "j_yy": symbolic.transverse,
                    "j_zz": symbolic.axial}  # fmt: skip
    if "momentum" in made.parameters:
        symbols["momentum"] = symbolic.momentum
    found: Any = symbolic.averaged_equations(made, symbols)
    if law == "reorientation":  # a spin about the axis
        found = Slow(*(sympy.factor(x.subs(symbolic.theta, 0)) for x in found))
    return symbolic.as_latex(found)


def _symbolic_law(law: str):
    """The law with a target along the cone axis, its numbers to be replaced by symbols."""
    from torquer.control import LAWS

    up, inertia = {"target": (0.0, 0.0, 1.0)}, {"inertia_kg_m2": (1.0, 1.0, 1.0)}
    kinds: dict[str, tuple[str, str, dict[str, Any]]] = {
        "bdot": ("bdot_rate", "gain_a_m2_s_per_t", {}),
        "nutation_damping": ("nutation_damping_rate", "gain_a_m2_s_per_t", {}),
        "spin_up": ("spin_up", "gain_a_m2_per_t", {}),
        "reorientation": (
            "reorientation", "gain_a_m2_per_n_m_s_t", {**up, **inertia, "momentum_n_m_s": 1.0}
        ),
        "preliminary_1": ("preliminary_1", "gain_a_m2_per_t", up),
        "preliminary_2": ("preliminary_2", "gain_a_m2_per_t", {**up, **inertia}),
    }  # fmt: skip
    kind, gain, others = kinds[law]
    return LAWS[kind](**{gain: 1.0}, **others).law()


def design(asked: Question, part: float, revolutions: float | None, as_json: bool) -> int:
    """Print how long each gain takes, and the gain for a time."""
    _check(revolutions)
    times = _times(asked, part)
    evolution, spinner = asked.evolution, asked.spinner
    gains = [asked.gain * x for x in _PARTS] if asked.gain else [
        gain_of(evolution, spinner, eps) for eps in _EPS
    ]  # fmt: skip
    rows = design_table(evolution, spinner, times, gains)
    wanted = None if revolutions is None else gain_for(evolution, spinner, times, revolutions)
    if as_json:
        print(json_.dumps(_design_data(asked, part, rows, revolutions, wanted), indent=2))
        return 0
    unit = text.UNITS[asked.law]
    rho = "any direction" if asked.rho is None else f"rho0 {math.degrees(asked.rho):.1f} deg"
    print(
        f"{asked.law}, {asked.name}: revolutions of {asked.period_s / 60:.1f} min until the "
        f"{GOALS[asked.law].name} is {100 * part:g} % (theta0 {math.degrees(asked.theta):.0f} deg, "
        f"{rho})"
    )
    print(f"{'gain ' + unit:>22}{'eps':>10}{'least':>9}{'median':>9}{'greatest':>9}")
    print("\n".join(_row_line(row) for row in rows))
    if wanted:
        told = [f"{x:.4g}" if math.isfinite(x) else "none" for x in wanted]
        print(
            f"{revolutions:g} revolutions: gain {told[2]} {unit} for the slowest direction, "
            f"{told[1]} for the median, {told[0]} for the fastest"
        )
    print(*sampling_lines(asked), sep="\n", end="\n" if asked.sampling else "")
    for note in (*asked.notes, *sampling_notes(asked)):
        print(f"note: {note}")
    if any(row.eps > SLOW_CHANGE for row in rows):
        print(f"note: where eps is above {SLOW_CHANGE:g}, times are rough")
    return 0


def _row_line(row: Row) -> str:
    turns = (f"{x:.3g}" if math.isfinite(x) else "never" for x in row.revolutions)
    return f"{row.gain:>22.4g}{row.eps:>10.3g}" + "".join(f"{x:>9}" for x in turns)


def _design_data(asked, part, rows, revolutions, wanted) -> dict:
    def numbers(times):
        return {name: _number(x) for name, x in times._asdict().items()}

    return {
        "law": asked.law,
        "quantity": GOALS[asked.law].name,
        "part": part,
        "period_s": asked.period_s,
        "theta_deg": math.degrees(asked.theta),
        "rho_deg": None if asked.rho is None else math.degrees(asked.rho),
        "rows": [
            {"gain": row.gain, "eps": row.eps, "revolutions": numbers(row.revolutions)}
            for row in rows
        ],
        "wanted_revolutions": revolutions,
        "gain_for_it": wanted and numbers(wanted),
        "sampling": sampling_told(asked),
        "notes": [*asked.notes, *sampling_notes(asked)],
    }


def _length(turns: dict) -> float:
    """Revolutions that the courses show: somewhat more than the median time, or ten."""
    median = turns["median"]
    return 10.0 if median is None else 1.3 * median


def _draw(asked: Question, revolutions: float, courses: dict, out: Path) -> list[str]:
    """evolution.png and map.png."""
    from torquer.report.theory.pictures import draw_evolution, draw_map

    case, end, pointed = asked.case, _TURN * revolutions, asked.law in _POINTED
    u = next(iter(courses.values())).u
    title = f"{asked.law}, {asked.name}, eps = {case.eps:.3g}"
    first = draw_evolution(u, courses, title, out / "evolution.png")
    incl, rho = np.linspace(0.0, 90.0, _GRID), np.linspace(0.0, 179.0 if pointed else 90.0, _GRID)
    found = _map(asked, incl, rho, end)
    values, name, unit = {
        "bdot": (found.l, "L / L₀", ""),
        "nutation_damping": (np.degrees(found.theta), "theta", "°"),
        "spin_up": (found.l, "L / L₀", ""),
    }.get(asked.law, (np.degrees(found.rho), "rho", "°"))
    title = (
        f"{asked.law}: {name} after {revolutions:.3g} rev, eps = {case.eps:.3g}, "
        f"theta₀ = {math.degrees(asked.theta):.0f}°"
    )
    if np.isnan(values).any():
        title += ", blank where it stops before"
    inclination = asked.spinner.inclination_deg
    here = (min(inclination, 180.0 - inclination),
            None if asked.rho is None else math.degrees(asked.rho))  # fmt: skip
    second = draw_map(incl, rho, values, unit, title, here, out / "map.png")
    return [str(first), str(second)]


def _map(asked: Question, incl, rho, end: float) -> Slow:
    """Slow variables after u = end over (inclination, rho0), by the same eps."""
    cone = replace(asked, target=(0.0, 0.0, float(np.linalg.norm(asked.target))))
    fixed = {
        "sigma_deg": math.degrees(asked.sigma), "theta_deg": math.degrees(asked.theta),
        "eps": asked.case.eps,
    }  # fmt: skip
    return map_of_evolution(
        asked.evolution, {"inclination_deg": incl, "rho_deg": rho}, fixed, end,
        spinner=asked.spinner, target=cone.target,
    )  # fmt: skip
