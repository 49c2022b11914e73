"""How the differences between integrators grow in closed loops with noise: docs/img/growth.png.

Chibis-M is damped, and the differences with it. The other satellite turns slowly and is too weakly
controlled against the gravity gradient: its motion is chaotic, and any difference grows until the
runs have nothing in common. The readings have the same noise in all runs.
"""

from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import torquer
from torquer.maths.geometry.quaternion import angle_between
from torquer.report.common.colours import CURVES
from torquer.report.common.figure import quiet
from torquer.scenario.load import load_scenario, scenario_from_text

ROOT = Path(__file__).parents[1]
WEAK = """
start = 2012-03-04T10:31:47Z
orbit = { kind = "circular", altitude_km = 550, inclination_deg = 60 }
spacecraft.body.inertia_kg_m2 = [1.0, 1.3, 1.7]
spacecraft.coils.limit_a_m2 = 0.3
spacecraft.magnetometer.noise_nt = 50.0
initial = { rate_deg_s = [0.05, 0.03, 0.02], euler_deg = [20.0, -35.0, 70.0] }
control = { law = { kind = "bdot", gain_a_m2_s_per_t = 1e4 }, sample_s = 10.0 }
simulation = { revolutions = 60, record_s = 50.0 }
"""
SCENARIOS = {
    "Chibis-M stops tumbling": load_scenario(ROOT / "examples" / "chibis_m_detumble.toml"),
    "slow and weakly controlled: chaotic": scenario_from_text(WEAK),
}
STEPS = {
    "RK4, 0.5 s": {"step_s": 0.5},
    "RK4, 0.1 s": {"step_s": 0.1},
    "splitting, 0.1 s": {"step_s": 0.1, "integrator": "splitting"},
    "adaptive, default": {},
}
#: What the others are compared with.
FINE = {"tolerance_deg": 1e-9}


def flown(scenario, steps):
    """The run of a scenario with other steps."""
    keys = scenario.simulation.model_dump(exclude_none=True, exclude_defaults=True)
    return torquer.simulate(scenario.replace("simulation", keys | steps))


def apart_deg(a, b) -> np.ndarray:
    """Angle between two attitudes at the records."""
    p, q = a.q_body_to_inertial.values, b.q_body_to_inertial.values
    return np.degrees(angle_between(p, q))


def draw(path: Path) -> None:
    """One panel a scenario, one line an integrator."""
    figure = Figure(figsize=(10, 4), facecolor="white", layout="constrained")
    axes = figure.subplots(1, len(SCENARIOS), sharey=True)
    for axis, (name, scenario) in zip(axes, SCENARIOS.items(), strict=True):
        fine = flown(scenario, FINE)
        for (label, steps), colour in zip(STEPS.items(), CURVES, strict=False):
            angle = apart_deg(flown(scenario, steps), fine)
            print(f"{name}, {label}: at most {angle.max():.1e}, at the end {angle[-1]:.1e} deg")
            turns = fine.time / scenario.orbit.period_s
            axis.semilogy(turns, angle, color=colour, label=label, lw=0.9)
        axis.set_title(name, loc="left", fontsize=10.5, fontweight="bold")
        axis.set(xlabel="revolutions", ylim=(1e-13, 1e3))
        axis.margins(x=0)
        quiet(axis)
    axes[0].set_ylabel("distance from the finest run [deg]")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4,
                  frameon=False, fontsize=9)  # fmt: skip
    FigureCanvasAgg(figure).print_figure(path, dpi=110)


if __name__ == "__main__":
    draw(ROOT / "docs" / "img" / "growth.png")
