"""What fixed steps do to a motion by themselves: fixed_steps.json, docs/img/fixed-steps.png.

Bodies without any torque, whose motion is known: a rotation about a principal axis lags, a nutation
shrinks, a tumbling body loses angular momentum. Then B-dot, whose command is held from one control
step to the next.
"""

import json
import math
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import torquer
from torquer.maths.geometry.quaternion import angle_between, multiply
from torquer.report.common.colours import BLUE, GREEN, RED
from torquer.report.common.figure import FINE_DPI, quiet
from torquer.scenario.load import scenario_from_text

ROOT = Path(__file__).parents[1]
RECORD = ROOT / "benchmarks" / "fixed_steps.json"
FREE = """
start = 2012-03-04T10:31:47Z
orbit = {{ kind = "circular", altitude_km = 550, inclination_deg = 60 }}
environment.gravity_gradient = false
spacecraft.body.inertia_kg_m2 = {inertia}
initial.rate_deg_s = {rate}
control.law.kind = "off"
simulation = {{ duration_s = {duration}, record_s = {record}, {steps} }}
"""
BDOT = """
start = 2012-03-04T10:31:47Z
orbit = {{ kind = "circular", altitude_km = 550, inclination_deg = 60 }}
environment.gravity_gradient = false
spacecraft.body.inertia_kg_m2 = [0.05, 0.06, 0.07]
spacecraft.coils.limit_a_m2 = 10.0
initial.rate_deg_s = {rate}
control = {{ law = {{ kind = "bdot", gain_a_m2_s_per_t = 2e4 }}, sample_s = {step} }}
simulation = {{ duration_s = 1200, record_s = 1200, {steps} }}
"""
#: Angle [rad] that the body turns, or nutates, within a step.
ANGLES = (0.1, 0.2, 0.3, 0.5, 0.7, 0.9)
STEP_S = 1.0
#: The turns that are flown.
TURNS = 200
#: Keys of `simulation` for a step.
INTEGRATORS = {
    "RK4": 'integrator = "rk4", step_s = {h}',
    "splitting": 'integrator = "splitting", step_s = {h}',
    "default": "tolerance_deg = 1e-4",
}


def free(inertia, rate_rad_s, turning_rad_s: float, steps: str, h: float = STEP_S):
    """A free motion over TURNS turns at a rate, all of whose times are multiples of the step."""
    duration = h * round(TURNS * 2.0 * math.pi / turning_rad_s / h)
    text = FREE.format(
        inertia=np.array(inertia).tolist(),
        rate=np.degrees(rate_rad_s).tolist(),
        duration=duration,
        record=h,
        steps=steps.format(h=h),
    )
    return torquer.simulate(scenario_from_text(text))


def lag(angle: float, steps: str) -> float:
    """Angle [rad] by which a rotation about a principal axis lags, a turn."""
    rate = angle / STEP_S
    run = free((0.05, 0.05, 0.05), (0.0, 0.0, rate), rate, steps)
    q, omega = run.q_body_to_inertial.values, run.omega_body.values[0]
    half = 0.5 * np.linalg.norm(omega) * float(run.time.values[-1])
    turned = (*(math.sin(half) * omega / np.linalg.norm(omega)), math.cos(half))
    exact = multiply(tuple(q[0]), turned)
    return float(angle_between(q[-1:], np.array([exact]))[0]) / TURNS


def nutation_lost(angle: float, steps: str) -> float:
    """Part of its amplitude that a nutation loses, a turn: a disc, whose nutation is 0.9 spins."""
    nutating = angle / STEP_S
    spin = nutating / 0.9
    run = free((0.05, 0.05, 0.095), (0.05 * spin, 0.0, spin), nutating, steps)
    across = np.hypot(*run.omega_body.values[[0, -1], :2].T)
    return -math.log(across[1] / across[0]) / TURNS


def momentum_lost(angle: float, steps: str) -> float:
    """Part of its angular momentum that a tumbling body loses, a turn."""
    rate = angle / STEP_S
    way = np.array([0.6, 0.6, 0.529])
    inertia = np.array([0.03, 0.07, 0.09])
    run = free(inertia, rate * way / np.linalg.norm(way), rate, steps)
    momentum = np.linalg.norm(inertia * run.omega_body.values[[0, -1]], axis=1)
    return -math.log(momentum[1] / momentum[0]) / TURNS


def bdot_left(angle: float, steps: str, part: int) -> float:
    """Part of the angular momentum that B-dot leaves in 20 minutes; `part` steps a control step."""
    rate = angle / STEP_S
    way = np.array([0.6, 0.6, 0.529])
    text = BDOT.format(
        rate=np.degrees(rate * way / np.linalg.norm(way)).tolist(),
        step=STEP_S,
        steps=steps.format(h=STEP_S / part),
    )
    run = torquer.simulate(scenario_from_text(text))
    momentum = np.linalg.norm(np.array([0.05, 0.06, 0.07]) * run.omega_body.values, axis=1)
    return float(momentum[-1] / momentum[0])


KINDS = {"lag": lag, "nutation": nutation_lost, "momentum": momentum_lost}
#: By RK4 a turn, from the angle of a step.
FORMULAS = {
    "lag": lambda z: 2.0 * math.pi * z**4 / 1920.0,
    "nutation": lambda z: 2.0 * math.pi * z**5 / 144.0,
}


def measured() -> dict:
    """All numbers of the page."""
    free_motion = {
        kind: {name: [run(z, steps) for z in ANGLES] for name, steps in INTEGRATORS.items()}
        for kind, run in KINDS.items()
    }
    rows = {f"RK4, {part} a control step": ("RK4", part) for part in (1, 2, 4, 10)}
    rows |= {"splitting, 1 a control step": ("splitting", 1), "default": ("default", 1)}
    held = {
        row: [bdot_left(z, INTEGRATORS[name], part) for z in ANGLES]
        for row, (name, part) in rows.items()
    }
    return {"angles": ANGLES, "free": free_motion, "bdot": held}


def draw(found: dict, path: Path) -> None:
    """One panel a motion: formula as a line, runs as marks."""
    figure = Figure(figsize=(11.0, 3.6), facecolor="white", layout="constrained")
    titles = {
        "lag": ("Rotation: lag a turn", "[deg]", 180.0 / math.pi),
        "nutation": ("Nutation: amplitude lost a turn", "[%]", 100.0),
        "momentum": ("Tumbling: momentum lost a turn", "[%]", 100.0),
    }
    marks = {"RK4": (RED, "o"), "splitting": (GREEN, "D"), "default": (BLUE, "s")}
    for axes, (kind, (title, unit, scale)) in zip(
        figure.subplots(1, 3), titles.items(), strict=True
    ):
        for name, (colour, mark) in marks.items():
            values = scale * np.abs(found["free"][kind][name])
            axes.loglog(
                found["angles"], np.maximum(values, 1e-12), mark, color=colour, ms=5, label=name
            )
        if kind in FORMULAS:
            z = np.geomspace(0.09, 1.1, 50)
            axes.loglog(z, scale * np.array([FORMULAS[kind](x) for x in z]), color=RED, lw=1.0,
                        label="RK4, formula")  # fmt: skip
        axes.set_title(title, fontsize=10.5, loc="left", fontweight="bold")
        axes.set(xlabel="angle turned within a step [rad]", ylabel=unit, xlim=(0.09, 1.1),
                 ylim=(3e-13, 1e2))  # fmt: skip
        axes.set_xticks(found["angles"], [f"{z:g}" for z in found["angles"]], minor=False)
        axes.set_xticks([], minor=True)
        quiet(axes)
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4,
                  frameon=False, fontsize=9)  # fmt: skip
    figure.axes[2].text(0.1, 8e-12, "drawn at 1e-12: that or less", fontsize=8)
    FigureCanvasAgg(figure).print_figure(path, dpi=0.7 * FINE_DPI)


if __name__ == "__main__":
    found = measured()
    RECORD.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    draw(found, ROOT / "docs" / "img" / "fixed-steps.png")
