"""Hold an attitude with coils alone: which law settles, how well, from where, at what cost?

python examples/compare_magnetic_laws.py design     (minutes: finds all gains, magnetic_laws.json)
python examples/compare_magnetic_laws.py [STARTS]   (128 unless given; writes magnetic-laws.png)

All gains by one rule, in the sampled loop in IGRF-14: of those with a gain margin of 2 that settle
at least half as fast as any, the ones with the least steady error.
"""

import json
import math
import sys
import warnings
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from pydantic import TypeAdapter

import torquer
from torquer.campaign.fly import OneByOne
from torquer.campaign.statistics import quantile, rate_interval
from torquer.computer.laws import AnyLaw
from torquer.report.common.colours import CURVES
from torquer.report.common.figure import quiet
from torquer.theory import (
    AttitudeHold,
    Cycle,
    DesignTask,
    SampledHold,
    best_feedback,
    coarser,
    degrees_with_margin,
    design_gains,
    feedback_law,
    mean_damping,
    mean_projection,
    mixed_family,
    sampled_family,
)

HERE = Path(__file__).parent
SCENARIO, FOUND = HERE / "magnetic_hold.toml", HERE / "magnetic_laws.json"
SPECS = TypeAdapter(AnyLaw)
#: Points of the grids over both gains, and how many of the best are looked at more closely.
GRID, LOOKED_AT = 24, 24
#: A start counts as captured if the error stays below that from some time on.
CAPTURED_DEG = 30.0


def task_of(scenario) -> DesignTask:
    """The loop of the scenario, sampled, with its disturbances."""
    hold, coils = AttitudeHold.of_scenario(scenario), scenario.spacecraft.coils
    sampled = SampledHold(hold, Cycle.of_control(scenario.control), coils.residual_dipole_a_m2)
    return DesignTask(sampled, float(np.min(coils.limit_a_m2)))


def matrices(rate, angle, weight) -> dict:
    """The law (4.1.5) with its dipole weighted by a matrix."""
    keys = {"rate_gains_n_m_s_per_t2": rate, "angle_gains_n_m_per_t2": angle}
    return {"kind": "periodic_gains"} | {k: [(v * weight).tolist()] for k, v in keys.items()}


def projected(rate, angle, projection) -> dict:
    """The law of Lovera and Astolfi."""
    gains = {"rate_gain_n_m_s": rate, "angle_gain_n_m": angle}
    return {"kind": "projected_pd", **gains, "mean_projection": projection.tolist()}


def sliding(damping, stiffness, inertia) -> dict:
    """Wisniewski's law, by its damping kappa/2 + lambda [1/s] and stiffness kappa lambda."""
    reaching = 0.5 * (damping + math.sqrt(max(damping**2 - 2.0 * stiffness, 0.0)))
    rates = {"manifold_rate_rad_s": stiffness / reaching, "reaching_rate_per_s": reaching}
    return {"kind": "sliding_mode", **rates, "inertia_kg_m2": inertia}


def kinds(quick: SampledHold, inertia) -> dict:
    """Laws of two gains, in units of the loop: name, law of (damping, stiffness), unit of both."""
    b, n = quick.maps.b_body_t, quick.hold.rate_rad_s
    j, s, moments = np.array(inertia), mean_damping(b), np.linalg.eigvalsh(inertia)
    found = {}
    for name, weight in {
        "(4.1.5)": np.eye(3),
        "(4.1.5), inertia": j / moments[-1],
        "(4.1.5), its inverse": np.linalg.inv(j / moments[0]),
        "(4.1.5), mean field": np.linalg.inv(s / np.linalg.norm(s, 2)),
    }.items():
        unit = n / np.linalg.eigvals(np.linalg.inv(j) @ s @ weight).real.mean()
        found[name] = (lambda x, y, w=weight: matrices(x, y, w), (unit, 0.5 * n * unit))
    unit, mean = n * moments.mean(), mean_projection(b)
    mean = 0.5 * (mean + mean.T)
    for name, weight in {"Lovera, Astolfi": np.eye(3), "the same, averaged gain": mean}.items():
        found[name] = (lambda x, y, w=weight: projected(x, y, w), (unit, 2.0 * n * unit))
    found["Wisniewski, sliding"] = (lambda x, y: sliding(x, y, inertia), (n, n * n))
    return found


def factors(points, corners) -> np.ndarray:
    """Factors of three laws, of gains `corners` `[3, 2]`, that make the law of gains `[n, 2]`."""
    ones = np.ones((3, 1))
    rows = np.hstack([points, np.ones((len(points), 1))])
    return np.linalg.solve(np.hstack([corners, ones]).T, rows.T).T


def tuned(task: DesignTask, quick: SampledHold, make, unit) -> dict:
    """The law of a kind by the rule."""
    corners = np.array([[2.0, 0.5], [3.0, 0.5], [3.0, 1.5]]) * unit
    laws = [SPECS.validate_python(make(*pair)).law() for pair in corners]
    family = mixed_family(quick, laws)
    axes = np.geomspace(0.3, 30.0, GRID), np.geomspace(0.01, 100.0, GRID)
    points = np.array([[x, y] for x in axes[0] for y in axes[1] if 2.0 * y <= x * x]) * unit
    degrees = degrees_with_margin(family, factors(points, corners), task.gain_margin)
    fast = np.flatnonzero(degrees >= 0.5 * degrees.max())
    # the stiffest of them: a spring withstands disturbances
    fast = fast[np.argsort(-points[fast, 1])][:LOOKED_AT]
    loops = [SPECS.validate_python(make(*points[k])) for k in fast]
    errors = [task.error_of(quick.with_law(loop.law())).rms_rad for loop in loops]
    return loops[int(np.argmin(errors))].model_dump(mode="json")


def static(other: dict) -> dict:
    """Constant matrices that settle fastest in the averaged field, of the size of other gains."""
    scenario, _ = torquer.load_campaign(SCENARIO)
    hold = task_of(scenario.replace("environment.field", {"kind": "averaged"})).sampled.hold
    rate = np.array(other["rate_gains_n_m_s_per_t2"][0]) * hold.rate_rad_s
    angle = np.array(other["angle_gains_n_m_per_t2"][0]) * 2.0
    size = float(np.hypot(np.linalg.norm(rate), np.linalg.norm(angle)))
    return feedback_law(hold, best_feedback(hold, size).f[None]).spec.model_dump(mode="json")


def design() -> None:
    """Find all gains and write them."""
    scenario, _ = torquer.load_campaign(SCENARIO)
    task = task_of(scenario)
    quick, found = coarser(task.sampled), {}
    for name, (make, unit) in kinds(quick, scenario.spacecraft.body.inertia).items():
        found[name] = tuned(task, quick, make, unit)
    found["static output feedback"] = static(found["(4.1.5)"])
    found["periodic regulator"] = design_gains(task).regulator.law.spec.model_dump(mode="json")
    FOUND.write_text(json.dumps(found, indent=1) + "\n")


def theory_of(task: DesignTask, law) -> str:
    """What linear theory predicts: time to settle, steady error."""
    sampled = task.sampled.with_law(law)
    degree = float(sampled_family(sampled).degrees(np.empty((1, 0)))[0])
    if degree <= 0.0:
        return f"{'unstable':>25s}"
    rms = math.degrees(task.error_of(sampled).rms_rad)
    return f"{math.log(50.0) / degree / 2.0 / math.pi:11.2f} rev{rms:6.1f} deg"


def row(settling, error_deg, energy_j) -> str:
    """What all starts do; one that is not captured counts as the longest in `settling`."""
    there, starts = np.isfinite(settling), len(settling)
    low, high = rate_interval(int(there.sum()), starts)
    share = f"{100 * there.mean():.1f} % ({100 * low:.0f}..{100 * high:.0f})"
    half = quantile(settling, 0.5)
    half_by = f"{half:.2f} rev" if np.isfinite(half) else "not reached"
    return (
        f"{share:>23s}{half_by:>13s}{quantile(error_deg, 0.5):7.1f} /"
        f"{quantile(error_deg, 0.9):6.1f} deg{quantile(energy_j, 0.5):7.2f} J"
    )


def main(starts: int) -> None:
    """A row of the table for each law: what theory predicts, what it does; and a picture."""
    scenario, campaign = torquer.load_campaign(SCENARIO)
    task, campaign = task_of(scenario), campaign.model_copy(update={"runs": starts})
    period_s = scenario.orbit.period_s
    warnings.simplefilter("ignore", OneByOne)  # every start has an orbit of its own
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.6), layout="constrained")
    head = f"{'':25s}{'theory: 2 %':>15s}{'error':>10s}{'any start: captured':>23s}"
    print(f"{head}{'half by':>13s}{'error 50 % / 90 %':>19s}{'energy':>9s}")
    for number, (name, keys) in enumerate(json.loads(FOUND.read_text()).items()):
        flown = torquer.fly_campaign(scenario.replace("control.law", keys), campaign)
        settling = np.where(flown.succeeded, flown.settling_s / period_s, np.inf)
        error_deg, law = flown.error_deg.values, SPECS.validate_python(keys).law()
        print(
            f"{name:25s}{theory_of(task, law)}{row(settling, error_deg, flown.energy_j.values)}",
            flush=True,
        )
        part = np.arange(1, starts + 1) / starts
        style = {
            "color": CURVES[number % len(CURVES)],
            "ls": "--" if number >= len(CURVES) else "-",
        }
        left.step(np.sort(settling), part, where="post", label=name, **style)
        right.step(np.sort(error_deg), part, where="post", label=name, **style)
    left.set(xlabel=f"within {CAPTURED_DEG:g} deg for good after [revolutions]",
             ylabel="share of the starts", xlim=(0, 11), ylim=(0, 1.02))  # fmt: skip
    right.set(xlabel="mean error, last four revolutions [deg]", xscale="log", xlim=(0.3, 180),
              ylim=(0, 1.02))  # fmt: skip
    for axes in (left, right):
        quiet(axes)
    figure.legend(
        *left.get_legend_handles_labels(),
        loc="outside lower center",
        ncols=5,
        fontsize=9,
        frameon=False,
    )
    figure.savefig("magnetic-laws.png", dpi=120)


if __name__ == "__main__":
    if sys.argv[1:] == ["design"]:
        design()
    else:
        main(int(sys.argv[1]) if len(sys.argv) > 1 else 128)
