"""Work of `torquer theory`: its case from the options, results in text and JSON, pictures."""

import math
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from torquer.analysis.averaged import equations as text
from torquer.analysis.averaged.case import (
    POINTED,
    SAMPLED,
    AveragedCase,
    case_of_scenario,
    spinner_of,
    spun_about_the_axis,
)
from torquer.analysis.averaged.motion import design_data, motion_data
from torquer.base import validate
from torquer.base.conventions import EARTH_RADIUS_M
from torquer.base.limits import given
from torquer.base.strict_json import json_text
from torquer.cli.commands.theory import CaseOptions, TheoryOptions
from torquer.cli.options import option
from torquer.cli.output import make_writable, writing_to
from torquer.environment.field.averaged import Averaged, mean_of_extremes
from torquer.environment.orbit.kepler import check_farthest
from torquer.scenario.load import load_scenario
from torquer.theory.slow.evolution.model import Slow
from torquer.theory.slow.evolution.sdot import sun_angle
from torquer.theory.slow.gains import Sampling
from torquer.theory.slow.slow_motion import map_of_evolution
from torquer.theory.validity import SLOW_CHANGE

_RATE_DEG_S = (5.0, 5.0, 5.0)
_GRID = 61

# ------------------------------------------------------------ the case


def case_of(law: str | None, how: TheoryOptions) -> AveragedCase:
    """The case from either source; `ValueError` if both or neither is given."""
    laws, named = ", ".join(text.LAWS), given(how, *(each.name for each in fields(CaseOptions)))
    if law is not None and law not in text.LAWS:
        raise ValueError(f"LAW: must be one of {laws}; received {law!r}")
    if how.scenario is not None:
        if named:
            key = next(iter(named))
            raise ValueError(f"{option(key)}: must not be given with --scenario; received both")
        case = case_of_scenario(load_scenario(how.scenario))
        if law not in (None, case.law):
            raise ValueError(
                f"LAW: must be the scenario's, {case.law}, or left out; received {law!r}"
            )
        return case
    if law is None:
        raise ValueError(f"LAW: must be one of {laws}; received nothing")
    needed = ("inclination_deg", "inertia", *["gain"] * (not how.design))
    for key in (*needed, *["sun_deg"] * (law == "sdot")):
        if key not in named:
            raise ValueError(f"{option(key)}: must be given (or --scenario); received nothing")
    if law != "sdot" and how.sun_deg is not None:
        raise ValueError(f"--sun-deg: must be left out for {law}; received {how.sun_deg:g}")
    return spun_about_the_axis(_case_of_options(law, how, how.inclination_deg or 0.0))


def _case_of_options(law: str, how: TheoryOptions, inclination_deg: float) -> AveragedCase:
    inclination = math.radians(inclination_deg)
    radius_m, b0_t = _radius_and_strength(how.altitude_km, how.strength_nt, inclination)
    tensor = validate.inertia_tensor("--inertia", how.inertia)
    for each in how.rate_deg_s or ():
        if must := validate.out_of_range("rate_deg_s", each):
            raise ValueError(f"--rate-deg-s: must be {must}; received {each:g}")
    rate = validate.finite("--rate-deg-s", how.rate_deg_s or _RATE_DEG_S, (3,))
    notes: tuple[str, ...] = ()
    if how.rate_deg_s is None:
        notes = ("the initial rate is the default: set it with --rate-deg-s",)
    axis = np.array([0.0, 0.0, 1.0])
    spinner, theta, remarks = spinner_of(tensor, axis, rate, inclination_deg, b0_t, radius_m)
    rho, sampling = None, _sampling(law, how.sample_s, how.lag_s)
    if how.rho_deg is not None:
        rho = math.radians(how.rho_deg)
        if how.sun_deg is not None:
            notes = (*notes, "the momentum lies in the plane of the cone axis and the Sun")
    sun = math.radians(how.sun_deg or 0.0)
    name = f"{(radius_m - EARTH_RADIUS_M) / 1e3:.4g} km, {inclination_deg:g} deg"
    return AveragedCase(
        law, how.gain, spinner, theta, rho, target=(math.sin(sun), 0.0, math.cos(sun)),
        notes=(*notes, *remarks), name=name, sampling=sampling,
    )  # fmt: skip


def _sampling(law: str, sample_s: float | None, lag_s: float | None) -> Sampling | None:
    """Sample and hold at one interval, over which the law also takes its differences."""
    if sample_s is None and lag_s is None:
        return None
    if law not in SAMPLED:
        name, value = ("--lag-s", lag_s) if sample_s is None else ("--sample-s", sample_s)
        raise ValueError(f"{name}: must be left out for {law}; received {value:g}")
    if sample_s is None:
        raise ValueError("--sample-s: must be given with --lag-s; received nothing")
    if not 0.0 <= (lag_s or 0.0) < math.inf:
        raise ValueError(f"--lag-s: must be 0 or positive; received {lag_s:g}")
    return Sampling(sample_s, sample_s, lag_s or 0.0)


def _radius_and_strength(altitude_km, strength_nt, inclination) -> tuple[float, float]:
    """Radius [m] and B0 [T]; the direct dipole supplies one of them if it is not given."""
    equatorial = Averaged().mu_e_t_km3 * 1e9
    if altitude_km is not None:
        radius_m = EARTH_RADIUS_M + 1e3 * altitude_km
        check_farthest(radius_m)
        b0_t = mean_of_extremes(equatorial / radius_m**3, inclination)
        return radius_m, b0_t if strength_nt is None else 1e-9 * strength_nt
    if strength_nt is None:
        raise ValueError("--altitude-km: it or --strength-nt must be given; received neither")
    radius_m = (mean_of_extremes(equatorial, inclination) / (1e-9 * strength_nt)) ** (1.0 / 3.0)
    if radius_m <= EARTH_RADIUS_M:
        most = 1e9 * mean_of_extremes(equatorial / EARTH_RADIUS_M**3, inclination)
        raise ValueError(
            f"--strength-nt: must be below {most:.0f} nT, its value on the ground, without "
            f"--altitude-km; received {strength_nt:g}"
        )
    check_farthest(radius_m)
    return radius_m, 1e-9 * strength_nt


def part_of(case: AveragedCase, to_percent: float | None) -> float:
    """Target fraction of the initial value."""
    grows = case.law == "spin_up"
    part = (200.0 if grows else 10.0) if to_percent is None else to_percent
    if must := validate.out_of_range("to", part, 0.0):
        raise ValueError(f"--to: must be {must}; received {part:g}")
    if grows and not 100.0 < part < math.inf:
        raise ValueError(f"--to: must be above 100 for spin_up, which grows; received {part:g}")
    if not grows and not 0.0 < part < 100.0:
        raise ValueError(f"--to: must lie between 0 and 100; received {part:g}")
    return part / 100.0


# ------------------------------------------------------------ the motion


def show(law: str | None, how: TheoryOptions) -> int:
    """Print the averaged motion; draw it if a folder is given."""
    case = case_of(law, how)
    part = part_of(case, how.to)
    if how.out is not None:
        make_writable(how.out)
    formulas = _latex(case.law) if how.latex else None
    answer, motions = motion_data(case, part, how.revolutions)
    if formulas:
        answer["latex"] = formulas
    if how.out is not None:
        with writing_to(how.out):
            answer["pictures"] = _draw(case, answer["course_revolutions"], motions, how.out)
    print(json_text(answer) if how.json else "\n".join(_lines(case, answer)))
    return 0


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
        *_sun_lines(answer["sun"]),
        *_sampling_lines(case, answer["sampling"]),
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


def _sampling_lines(case: AveragedCase, found: dict | None) -> list[str]:
    """What a sampled law can damp, and its greatest gain, in words."""
    if found is None or case.sampling is None:
        return []
    what = "precession" if case.law == "nutation_damping" else "rotation"
    lines = [
        f"with {case.sampling.in_words} it damps {what} up to {found['limit_deg_s']:.3g} "
        f"deg/s; at the initial {found['rate_deg_s']:.3g} deg/s with "
        f"{100.0 * found['efficiency']:.3g} % of the ideal damping"
    ]
    if found["greatest_gain"] is not None:
        lines.append(
            "in a field of B0 slow motion is stable up to a gain of "
            f"{found['greatest_gain']:.3g} {text.UNITS[case.law]}"
        )
    return lines


def _sun_lines(data: dict | None) -> list[str]:
    """Where S-dot brings the momentum, in words."""
    if data is None:
        return []
    end = data["final_momentum"]
    side = "towards" if end > 0.0 else "away from"
    turns = f"after at most {data['revolutions_at_most']:.3g} revolutions"
    return [
        f"from {data['gamma_deg']:.1f} deg off the Sun the momentum turns {side} it, within "
        f"{data['captured_deg']:g} deg {turns}; final momentum {abs(end):.4g} L0"
    ]


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
    from torquer.computer.laws import LAWS

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


# ------------------------------------------------------------ the design


def design(law: str | None, how: TheoryOptions) -> int:
    """Print the time for each gain, and the gain for a given time."""
    case = case_of(law, how)
    part = part_of(case, how.to)
    if how.out is not None or how.latex:
        other = "--out" if how.out is not None else "--latex"
        raise ValueError(f"{other}: must not be given with --design; received both")
    data = design_data(case, part, how.revolutions)
    print(json_text(data) if how.json else "\n".join(_design_lines(case, data)))
    return 0


def _design_lines(case: AveragedCase, data: dict) -> list[str]:
    unit, wanted = text.UNITS[case.law], data["gain_for_it"]
    rho = "any direction" if case.rho is None else f"rho0 {data['rho_deg']:.1f} deg"
    lines = [
        f"{case.law}, {case.name}: revolutions of {case.period_s / 60:.1f} min until the "
        f"{data['quantity']} is {100 * data['part']:g} % (theta0 {data['theta_deg']:.0f} deg, "
        f"{rho})",
        f"{'gain ' + unit:>22}{'eps':>10}{'min':>9}{'median':>9}{'max':>9}",
    ]
    for row in data["rows"]:
        turns = ("never" if x is None else f"{x:.3g}" for x in row["revolutions"].values())
        times = "".join(f"{x:>9}" for x in turns)
        lines.append(f"{row['gain']:>22.4g}{row['eps']:>10.3g}{times}")
    if wanted:
        gain = {name: "none" if x is None else f"{x:.4g}" for name, x in wanted.items()}
        lines.append(
            f"{data['wanted_revolutions']:g} revolutions: gain {gain['greatest']} {unit} for the "
            f"slowest direction, {gain['median']} for the median, {gain['least']} for the fastest"
        )
    lines += _sampling_lines(case, data["sampling"])
    lines += [f"note: {note}" for note in data["notes"]]
    if any(row["eps"] > SLOW_CHANGE for row in data["rows"]):
        lines.append(f"note: times are approximate where eps exceeds {SLOW_CHANGE:g}")
    return lines


# ------------------------------------------------------------ pictures


def _draw(case: AveragedCase, revolutions: float, motions: dict, out: Path) -> list[str]:
    """evolution.png and map.png."""
    from torquer.report.theory.pictures import draw_evolution, draw_map

    constants, end, pointed = case.constants, 2.0 * math.pi * revolutions, case.law in POINTED
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
