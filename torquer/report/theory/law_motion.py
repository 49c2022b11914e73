"""Pictures of the averaged motion under a law: slow variables over revolutions, and a map."""

import math

import numpy as np
from matplotlib.figure import Figure

from torquer.report.theory.pictures import draw_evolution, draw_map
from torquer.scenario.keys import key_words
from torquer.theory.averaged.answer import LawMotion
from torquer.theory.averaged.case import POINTED, AveragedCase
from torquer.theory.slow.evolution.model import Slow
from torquer.theory.slow.evolution.sdot import sun_angle
from torquer.theory.slow.slow_motion import map_evolution

_GRID = 61


def draw_law_motion(motion: LawMotion) -> dict[str, Figure]:
    """Figures `evolution` and `map`."""
    return {"evolution": _evolution(motion), "map": _map(motion)}


def _evolution(motion: LawMotion) -> Figure:
    case, constants = motion.case, motion.case.constants
    u = next(iter(motion.motions.values())).u
    title = f"{case.law}, {case.name}, eps = {constants.eps:.3g}"
    if motion.found["verdict"]["doubts"]:
        title += ": doubtful"
    angle = ("gamma [deg]", lambda slow: np.degrees(sun_angle(slow, constants)))
    angles = {"angle": angle} if case.law == "sdot" else {}
    return draw_evolution(u, motion.motions, title, **angles)


def _map(motion: LawMotion) -> Figure:
    case, revolutions = motion.case, motion.found["course_revolutions"]
    top = 179.0 if case.law in POINTED else 90.0
    incl, rho = np.linspace(0.0, 90.0, _GRID), np.linspace(0.0, top, _GRID)
    values, name, unit = _show(case, _slow_map(case, incl, rho, 2.0 * math.pi * revolutions))
    title = (
        f"{key_words(case.law)}: {name} after {revolutions:.3g} rev, "
        f"eps = {case.constants.eps:.3g}, theta₀ = {math.degrees(case.theta):.0f}°"
    )
    if case.law == "sdot":
        title += f", Sun {math.degrees(math.acos(case.target[2])):.0f}° off the cone axis"
    if np.isnan(values).any():
        title += ", blank where the motion stops earlier"
    inclination = case.spinner.inclination_deg
    here = (min(inclination, 180.0 - inclination),
            None if case.rho is None else math.degrees(case.rho))  # fmt: skip
    return draw_map(incl, rho, values, unit, title, here)


def _show(case: AveragedCase, found: Slow) -> tuple:
    """Values that matter for the law, their name and unit."""
    return {
        "bdot": (found.l, "L / L₀", ""),
        "nutation_damping": (np.degrees(found.theta), "nutation angle", "°"),
        "spin_up": (found.l, "L / L₀", ""),
        "sdot": (np.degrees(sun_angle(found, case.constants)), "angle to the Sun", "°"),
    }.get(case.law, (np.degrees(found.rho), "angle to the cone axis", "°"))


def _slow_map(case: AveragedCase, incl, rho, end: float) -> Slow:
    """Slow variables after u = end over (inclination, rho0), with the same eps."""
    target = case.target
    if case.law != "sdot":
        target = (0.0, 0.0, float(np.linalg.norm(target)))
    fixed = {
        "sigma_deg": math.degrees(case.sigma), "theta_deg": math.degrees(case.theta),
        "eps": case.constants.eps,
    }  # fmt: skip
    return map_evolution(
        case.evolution, {"inclination_deg": incl, "rho_deg": rho}, fixed, end,
        spinner=case.spinner, target=target,
    )  # fmt: skip
