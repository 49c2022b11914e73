"""Work of `torquer theory`: results in text and JSON, design tables, pictures."""

import math
from pathlib import Path
from typing import Any

import numpy as np

from torquer.cli import theory_text as text
from torquer.cli.output import json_text, make_writable, writing_to
from torquer.cli.theory_options import AveragedCase, in_range
from torquer.cli.theory_sampling import sampling_data, sampling_lines, sampling_notes
from torquer.cli.theory_sun import described, sun_data, sun_lines
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
from torquer.theory.evolution.sdot import sun_angle
from torquer.theory.slow_motion import evolve, map_of_evolution
from torquer.theory.validity import PRECESSION, SLOW_CHANGE

_TURN = 2.0 * math.pi
#: Harmonics of the laws here: 2 in the precession angle, 4 in u; none depends on phi.
_HARMONICS = int(PRECESSION.least)
#: Multiples of the gain in a design table; small parameters of one without a gain.
_PARTS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)
_EPS = (0.003, 0.01, 0.03, 0.1, 0.3)
_GRID = 61
#: Laws with a target.
_POINTED = ("reorientation", "preliminary_1", "preliminary_2", "sdot")


def _check(revolutions: float | None) -> None:
    if revolutions is not None and not 0.0 < revolutions < math.inf:
        raise ValueError(f"--revolutions: must be a positive number; received {revolutions:g}")
    in_range("--revolutions", "revolutions", revolutions, 0.0)


def show(
    case: AveragedCase, part, revolutions, latex: bool, out: Path | None, as_json: bool
) -> int:
    """Print the averaged motion; draw it if a folder is given."""
    _check(revolutions)
    if out is not None:
        make_writable(out)
    formulas = _latex(case.law) if latex else None
    answer, motions = _answer(case, part, revolutions)
    if formulas:
        answer["latex"] = formulas
    if out is not None:
        with writing_to(out):
            answer["pictures"] = _draw(case, answer["course_revolutions"], motions, out)
    if as_json:
        print(json_text(answer))
        return 0
    print("\n".join(_lines(case, answer)))
    return 0


def _times(case: AveragedCase, part: float) -> Times:
    """Slow times to a fraction of the initial value; all equal where the direction is known."""
    if case.rho is None:
        return times_over_directions(case.evolution, case.constants, case.theta, part)
    start = Slow(1.0, case.rho, case.sigma, case.theta)
    return Times(*3 * (slow_time(case.evolution, case.constants, start, part),))


def _answer(case: AveragedCase, part: float, revolutions: float | None) -> tuple[dict, dict]:
    """The results as plain data, and the slow motions behind them."""
    constants, spinner = case.constants, case.spinner
    times = _times(case, part)
    points = tends_to(find_equilibria(rates_of_evolution(case.evolution, constants)))
    start = None if case.rho is None else Slow(1.0, case.rho, case.sigma, case.theta)
    turns = _turns(times, constants.eps)
    length = revolutions or _length(turns)
    motions = _motions(case, length)
    answer = {
        "law": case.law,
        "gain": case.gain,
        "orbit": {
            "inclination_deg": spinner.inclination_deg,
            "period_s": case.period_s,
            "strength_nt": 1e9 * spinner.strength_t,
            "p": constants.moments[0],
            "cone_deg": math.degrees(cone_angle(math.radians(spinner.inclination_deg))),
        },
        "satellite": {
            "transverse_kg_m2": spinner.transverse_kg_m2,
            "axial_kg_m2": spinner.axial_kg_m2,
            "momentum_n_m_s": spinner.momentum_n_m_s,
            "theta_deg": math.degrees(case.theta),
            "rho_deg": None if case.rho is None else math.degrees(case.rho),
            "eta": list(spinner.eta),
        },
        "eps": constants.eps,
        "quantity": GOALS[case.law].name,
        "part": part,
        "revolutions": turns,
        "seconds": {k: v and v * case.period_s for k, v in turns.items()},
        "course_revolutions": length,
        "tends_to": [
            {"description": described(case, each), "length_rate": each.length_rate}
            for each in points
        ],
        "sun": sun_data(case),
        "equations": list(text.EQUATIONS[case.law]),
        "first_integrals": [
            {"name": name, "formula": formula, "at_start": _value(case, name, start),
             "drift": _drift(motions, name)}
            for name, formula in text.INTEGRALS[case.law].items()
        ],
        "sampling": sampling_data(case),
        "notes": [*case.notes, *sampling_notes(case), *_caveats(motions), *_warnings(case)],
    }  # fmt: skip
    return answer, motions


def _motions(case: AveragedCase, revolutions: float) -> dict:
    """Slow motions from the given direction, or from several, by name."""
    u = np.linspace(0.0, _TURN * revolutions, 400)
    some = (20.0, 60.0, 90.0, 120.0, 150.0) if case.law in _POINTED else (10.0, 30.0, 50.0, 70.0,
                                                                           85.0)  # fmt: skip
    starts = np.radians(some) if case.rho is None else [case.rho]
    return {
        f"rho₀ {math.degrees(rho):.3g}°": evolve(
            case.evolution, case.constants, Slow(1.0, float(rho), case.sigma, case.theta), u
        )
        for rho in starts
    }


def _drift(motions: dict, name: str) -> float | None:
    """Largest drift of a first integral; None where it is undefined or infinite."""
    known = [motion.drift.get(name, math.nan) for motion in motions.values()]
    known = [x for x in known if math.isfinite(x)]
    return max(known, default=None)


def _caveats(motions: dict) -> list[str]:
    """Caveats of the motions, each once."""
    return list(dict.fromkeys(note for motion in motions.values() for note in motion.notes))


def _turns(times: Times, eps: float) -> dict:
    """Revolutions; None for never."""
    return {name: _number(s / (_TURN * eps)) for name, s in times._asdict().items()}


def _number(value) -> float | None:
    return float(value) if math.isfinite(value) else None


def _value(case, name, start) -> float | None:
    """A first integral where the direction is known and no logarithm of zero is needed."""
    if start is None:
        return None
    with np.errstate(all="ignore"):
        return _number(case.evolution.integrals[name](start, case.constants))


def _warnings(case: AveragedCase) -> list[str]:
    """Where averaging is not valid."""
    notes, eps, spinner = [], case.constants.eps, case.spinner
    precession = spinner.eta[1]
    slow = Slow(1.0, case.rho or 1.0, case.sigma, case.theta)
    near = [n for n in resonances(spinner, slow, greatest=_HARMONICS, width=max(0.05, eps))
            if n[0] == 0 and 0 < abs(n[1]) <= 2]  # fmt: skip
    if precession < _HARMONICS:
        notes.append(
            f"the precession, {precession:.3g} times the orbital rate, is not fast: averaging "
            "is not valid"
        )
    elif near:
        _, b, c = near[0]
        notes.append(f"near resonance: {b} x precession {c:+d} x orbital rate is about zero")
    if case.law in ("bdot", "sdot") and precession > _HARMONICS:
        notes.append(
            f"averaging is valid until the precession drops to {_HARMONICS} orbital rates, at "
            f"l = {_HARMONICS / precession:.2g}"
        )
    return notes


def _lines(case: AveragedCase, answer: dict) -> list[str]:
    orbit, body = answer["orbit"], answer["satellite"]
    unit = text.UNITS[case.law]
    rho = "any direction" if case.rho is None else f"rho0 {body['rho_deg']:.1f} deg"
    lines = [
        f"{case.law}, gain {case.gain:g} {unit}: {case.name}, period {case.period_s / 60:.1f} "
        f"min, B0 {orbit['strength_nt']:.0f} nT",
        f"A {body['transverse_kg_m2']:.4g}, C {body['axial_kg_m2']:.4g} kg m^2, L0 "
        f"{body['momentum_n_m_s']:.4g} N m s, theta0 {body['theta_deg']:.1f} deg, {rho}",
        "",
        f"eps = {text.SMALL[case.law]} = {answer['eps']:.4g}",
        f"{answer['quantity']} to {100 * answer['part']:g} %: {_span(answer['revolutions'])}",
        "tends to:",
        *(f"  {each['description']}" for each in answer["tends_to"]),
        *sun_lines(answer["sun"]),
        *sampling_lines(case),
        "",
        f"equations, {text.SHARED}:",
        *(
            answer.get("latex") or "\n".join(f"  {line}" for line in answer["equations"])
        ).splitlines(),
        f"first integrals (drift in units of l and radians over {answer['course_revolutions']:.3g} "
        "revolutions):",
    ]
    for each in answer["first_integrals"]:
        value = "" if each["at_start"] is None else f" = {each['at_start']:.5g}"
        drift = "" if each["drift"] is None else f"; drift {each['drift']:.1g}"
        lines.append(f"  {each['formula']}{value}{drift}")
    lines += [f"note: {note}" for note in answer["notes"]]
    return lines + [f"{path}" for path in answer.get("pictures", ())]


def _span(times: dict) -> str:
    """Range and median in words."""
    least, median, greatest = (
        "never" if value is None else f"{value:.3g}" for value in times.values()
    )
    if least == greatest:
        return f"{least} revolutions"
    return f"{least} to {greatest} revolutions by direction, median {median}"


def _latex(law: str) -> str:
    """The equations of the law as flown, averaged by sympy."""
    try:
        from torquer.theory import symbolic
    except ImportError:
        raise ValueError(
            "--latex: needs sympy: pip install 'torquer[symbolic]'; received an installation "
            "without it"
        ) from None
    import sympy

    made = _symbolic_law(law)
    symbols: dict[str, Any] = {"gain": sympy.Symbol("k", positive=True)}
    if "inertia" in made.values():
        moments = (symbolic.transverse, symbolic.transverse, symbolic.axial)
        symbols["inertia"] = (*moments, 0.0, 0.0, 0.0)
    if "momentum" in made.values():
        symbols["momentum"] = symbolic.momentum
    found: Any = symbolic.averaged_equations(made, symbols)
    if law == "reorientation":  # a spin about the axis
        found = Slow(*(sympy.factor(x.subs(symbolic.theta, 0)) for x in found))
    return symbolic.as_latex(found)


def _symbolic_law(law: str):
    """The law with a target along the cone axis, its values replaced by symbols later."""
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
        "sdot": ("sdot_rate", "gain_a_m2_s", {}),
    }  # fmt: skip
    kind, gain, others = kinds[law]
    return LAWS[kind](**{gain: 1.0}, **others).law()


def design(case: AveragedCase, part: float, revolutions: float | None, as_json: bool) -> int:
    """Print the time for each gain, and the gain for a given time."""
    _check(revolutions)
    times = _times(case, part)
    evolution, spinner = case.evolution, case.spinner
    gains = [case.gain * x for x in _PARTS] if case.gain else [
        gain_of(evolution, spinner, eps) for eps in _EPS
    ]  # fmt: skip
    rows = design_table(evolution, spinner, times, gains)
    wanted = None if revolutions is None else gain_for(evolution, spinner, times, revolutions)
    if as_json:
        print(json_text(_design_data(case, part, rows, revolutions, wanted)))
        return 0
    unit = text.UNITS[case.law]
    rho = "any direction" if case.rho is None else f"rho0 {math.degrees(case.rho):.1f} deg"
    print(
        f"{case.law}, {case.name}: revolutions of {case.period_s / 60:.1f} min until the "
        f"{GOALS[case.law].name} is {100 * part:g} % (theta0 {math.degrees(case.theta):.0f} deg, "
        f"{rho})"
    )
    print(f"{'gain ' + unit:>22}{'eps':>10}{'min':>9}{'median':>9}{'max':>9}")
    print("\n".join(_row_line(row) for row in rows))
    if wanted:
        gain = [f"{x:.4g}" if math.isfinite(x) else "none" for x in wanted]
        print(
            f"{revolutions:g} revolutions: gain {gain[2]} {unit} for the slowest direction, "
            f"{gain[1]} for the median, {gain[0]} for the fastest"
        )
    print(*sampling_lines(case), sep="\n", end="\n" if case.sampling else "")
    for note in (*case.notes, *sampling_notes(case)):
        print(f"note: {note}")
    if any(row.eps > SLOW_CHANGE for row in rows):
        print(f"note: times are approximate where eps exceeds {SLOW_CHANGE:g}")
    return 0


def _row_line(row: Row) -> str:
    turns = (f"{x:.3g}" if math.isfinite(x) else "never" for x in row.revolutions)
    return f"{row.gain:>22.4g}{row.eps:>10.3g}" + "".join(f"{x:>9}" for x in turns)


def _design_data(case, part, rows, revolutions, wanted) -> dict:
    def numbers(times):
        return {name: _number(x) for name, x in times._asdict().items()}

    return {
        "law": case.law,
        "quantity": GOALS[case.law].name,
        "part": part,
        "period_s": case.period_s,
        "theta_deg": math.degrees(case.theta),
        "rho_deg": None if case.rho is None else math.degrees(case.rho),
        "rows": [
            {"gain": row.gain, "eps": row.eps, "revolutions": numbers(row.revolutions)}
            for row in rows
        ],
        "wanted_revolutions": revolutions,
        "gain_for_it": wanted and numbers(wanted),
        "sampling": sampling_data(case),
        "notes": [*case.notes, *sampling_notes(case)],
    }


def _length(turns: dict) -> float:
    """Revolutions to compute: somewhat more than the median time, or ten."""
    median = turns["median"]
    return 10.0 if median is None else 1.3 * median


def _draw(case: AveragedCase, revolutions: float, motions: dict, out: Path) -> list[str]:
    """evolution.png and map.png."""
    from torquer.report.theory.pictures import draw_evolution, draw_map

    constants, end, pointed = case.constants, _TURN * revolutions, case.law in _POINTED
    u = next(iter(motions.values())).u
    title = f"{case.law}, {case.name}, eps = {constants.eps:.3g}"
    angle = ("gamma [deg]", lambda slow: np.degrees(sun_angle(slow, constants)))
    angles = {"angle": angle} if case.law == "sdot" else {}
    first = draw_evolution(u, motions, title, out / "evolution.png", **angles)
    incl, rho = np.linspace(0.0, 90.0, _GRID), np.linspace(0.0, 179.0 if pointed else 90.0, _GRID)
    found = _map(case, incl, rho, end)
    values, name, unit = {
        "bdot": (found.l, "L / L₀", ""),
        "nutation_damping": (np.degrees(found.theta), "theta", "°"),
        "spin_up": (found.l, "L / L₀", ""),
        "sdot": (np.degrees(sun_angle(found, constants)), "gamma", "°"),
    }.get(case.law, (np.degrees(found.rho), "rho", "°"))
    title = (
        f"{case.law}: {name} after {revolutions:.3g} rev, eps = {constants.eps:.3g}, "
        f"theta₀ = {math.degrees(case.theta):.0f}°"
    )
    if case.law == "sdot":
        title += f", Sun {math.degrees(math.acos(case.target[2])):.0f}° off the cone axis"
    if np.isnan(values).any():
        title += ", blank where the motion stops earlier"
    inclination = case.spinner.inclination_deg
    here = (min(inclination, 180.0 - inclination),
            None if case.rho is None else math.degrees(case.rho))  # fmt: skip
    second = draw_map(incl, rho, values, unit, title, here, out / "map.png")
    return [str(first), str(second)]


def _map(case: AveragedCase, incl, rho, end: float) -> Slow:
    """Slow variables after u = end over (inclination, rho0), with the same eps."""
    target = case.target
    if case.law != "sdot":
        target = (0.0, 0.0, float(np.linalg.norm(target)))
    fixed = {
        "sigma_deg": math.degrees(case.sigma), "theta_deg": math.degrees(case.theta),
        "eps": case.constants.eps,
    }  # fmt: skip
    return map_of_evolution(
        case.evolution, {"inclination_deg": incl, "rho_deg": rho}, fixed, end,
        spinner=case.spinner, target=target,
    )  # fmt: skip
