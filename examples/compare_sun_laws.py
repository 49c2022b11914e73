"""My wheels died: which law brings the solar panels to the Sun with coils alone?

python examples/compare_sun_laws.py design          (finds all gains, sun_laws.json)
python examples/compare_sun_laws.py [STARTS]        (10 000 unless given; writes sun-laws.png)
python examples/compare_sun_laws.py faults          (single faults of a few of the starts)

All gains by one rule: the same number of flights for every law, from the same starts, which are not
those of the comparison. What counts are the mean hours of the day that the axis is more than 30 deg
away from the Sun; of the gains for which they are at most half an hour above the least, those that
need least energy are taken.

Sixteen starts share an orbit and a date, so that they can fly side by side.
"""

import json
import os
import re
import sys
import warnings
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

import matplotlib.pyplot as plt
import numpy as np
from scipy.stats import qmc

import torquer
from torquer.campaign.faults.fly import fly_faults
from torquer.campaign.faults.verdict import VERDICTS
from torquer.campaign.fly import OneByOne
from torquer.campaign.sampling import member_scenario
from torquer.campaign.statistics import quantile
from torquer.report.common.colours import CURVES
from torquer.report.common.figure import quiet

HERE = Path(__file__).parent
SCENARIO, FOUND = HERE / "sun_laws.toml", HERE / "sun_laws.json"
INERTIA = [[1.0255, 0.0014, -0.0724], [0.0014, 1.5393, 0.0019], [-0.0724, 0.0019, 1.8172]]
#: Starts that share an orbit and a date.
TOGETHER = 16
#: Rounds of the search for gains: number of designs, and of starts that each of them flies. The
#: first round covers the ranges evenly; each following one the best before and their surroundings.
ROUNDS = ((32, 48), (16, 64), (4, 128))
#: The best of a round whose surroundings the next one covers, and the part of the range around
#: each; in the last round the best themselves are flown again.
PARENTS, AROUND = 4, 1.0 / 6.0
#: Seeds of the starts of the search and of those of the comparison.
TRAINING, TESTED = 1001, 1
#: Starts of the comparison with which `faults` flies every single fault.
WITH_FAULTS = 8
#: When faults strike [h].
AT_H = 6.0
#: Ranges of the gains of S-dot, of B-dot, of torques: about 1/100 to 100 times the gain at which
#: coils of 3.2 A m^2 are saturated at 0.5 deg/s or 90 deg off the Sun.
SDOT, BDOT, TORQUE = (4.0, 4e4), (1e5, 1e9), (1e-6, 1e-2)
#: Designs whose mean hours away from the Sun exceed the least by at most this count as equal.
EQUAL_H = 0.5


class Contender(NamedTuple):
    """A law of the comparison.

    `reads`: the sensors that it reads; `control`: what its `[control]` contains; `ranges`: of the
    numbers of `control.laws` for which the search looks.
    """

    reads: str
    control: dict
    ranges: dict[str, tuple[float, float]]


class Flown(NamedTuple):
    """Outcomes of the campaign in the file, each of [groups, starts in a group]."""

    succeeded: np.ndarray
    settling_s: np.ndarray
    first_s: np.ndarray
    near_sun: np.ndarray
    error_deg: np.ndarray
    worst_deg: np.ndarray
    rate_deg_s: np.ndarray
    energy_j: np.ndarray


def _laws(**laws: dict) -> dict:
    return {"laws": laws}


def _with_modes() -> dict:
    """S-dot with damping, rest in the shadow and reversal: SDOT, Fig. 3.18, and its guards."""
    control = torquer.load_scenario(HERE / "sun_pointing.toml").control
    return control.model_dump(mode="json", exclude_unset=True)


def contenders() -> dict[str, Contender]:
    """All laws by their names."""
    by_gyro = {"kind": "bdot_rate", "gain_a_m2_s_per_t": 1e7}
    by_field = {"kind": "bdot", "gain_a_m2_s_per_t": 1e7}
    panels = {"kind": "panel_tracking", "difference_gain_n_m": 2e-5, "brightest_gain_n_m": 1e-4}
    cross = {"kind": "sun_cross", "gain_n_m": 3e-5}
    spin = {
        "kind": "spin_to_sun",
        "gain_n_m": 1e-4,
        "momentum_n_m_s": 0.05,
        "inertia_kg_m2": INERTIA,
    }
    damping = {"damping.gain_a_m2_s_per_t": BDOT}
    of_panels = {"pointing.difference_gain_n_m": TORQUE, "pointing.brightest_gain_n_m": TORQUE}
    of_cross = {"pointing.gain_n_m": TORQUE}
    of_spin = {
        "pointing.gain_n_m": TORQUE,
        "pointing.momentum_n_m_s": (0.01, 0.1),
        "pointing.begin_deg": (5.0, 40.0),
    }
    of_sdot = {"pointing.gain_a_m2_s": SDOT}
    sdot = {"kind": "sdot_rate", "gain_a_m2_s": 600.0}
    without_spin = {
        f"{name}, B-dot by {how}": Contender(reads, _laws(pointing=law, damping=bdot), of | damping)
        for name, law, of in (("panels", panels, of_panels), ("cross product", cross, of_cross))
        for how, reads, bdot in (
            ("gyro", "magnetometer, gyro, Sun sensors", by_gyro),
            ("differences", "magnetometer, Sun sensors", by_field),
        )
    }
    return {
        "S-dot": Contender("gyro, Sun sensors", _laws(pointing=sdot), of_sdot),
        "S-dot by differences": Contender(
            "Sun sensors", _laws(pointing=sdot | {"kind": "sdot"}), of_sdot
        ),
        "S-dot with its modes": Contender(
            "magnetometer, gyro, Sun sensors",
            _with_modes(),
            {"sdot.gain_a_m2_s": SDOT, **damping},
        ),
        **without_spin,
        "spin, then to the Sun": Contender(
            "magnetometer, gyro, Sun sensors", _laws(pointing=spin), of_spin
        ),
        "spin, rate by the field": Contender(
            "magnetometer, Sun sensors",
            _laws(pointing=spin) | {"estimator": {"kind": "rate_from_field", "interval_s": 4.0}},
            of_spin,
        ),
    }


def scenario_of(contender: Contender, gains: Mapping[str, float]):
    """The scenario with a law of given gains, and the campaign."""
    scenario, campaign = torquer.load_campaign(SCENARIO)
    control = json.loads(json.dumps(contender.control)) | {"sample_s": scenario.control.sample_s}
    for key, value in gains.items():
        law, gain = key.split(".")
        control["laws"][law][gain] = value
    if "sdot_differences" in control["laws"]:  # S-dot where the gyro is suspected: the same gain
        control["laws"]["sdot_differences"]["gain_a_m2_s"] = gains["sdot.gain_a_m2_s"]
    return scenario.replace("control", control), campaign


def fly(scenario, campaign, starts: int, seed: int, workers: int | None = None) -> Flown:
    """Starts of a campaign, in groups that share all that varies except for the initial motion."""
    campaign = campaign.model_copy(update={"seed": seed})
    motion = {key: value for key, value in campaign.vary.items() if key.startswith("initial.")}

    def group(number: int):
        own = {"runs": TOGETHER, "seed": 1_000_000 * seed + number, "vary": motion}
        member = member_scenario(scenario, campaign, number)
        return torquer.fly_campaign(member, campaign.model_copy(update=own), workers=1)

    flown = [group(0)]  # before the threads: it compiles
    with ThreadPoolExecutor(workers or os.cpu_count()) as pool:
        flown += pool.map(group, range(1, -(-starts // TOGETHER)))
    return Flown(**{name: np.array([each[name] for each in flown]) for name in Flown._fields})


def settling_h(flown: Flown) -> np.ndarray:
    """Hours after which each start has settled; infinite for one that has not."""
    return np.where(flown.succeeded, flown.settling_s, np.inf) / 3600.0


def cost(
    contender: Contender, gains: dict, starts: int, workers: int | None
) -> tuple[float, float]:
    """Mean hours of the day away from the Sun, and mean energy [J]."""
    scenario, campaign = scenario_of(contender, gains)
    flown = fly(scenario, campaign, starts, TRAINING, workers)
    day_h = scenario.simulation.duration_s / 3600.0
    return day_h * (1.0 - float(flown.near_sun.mean())), float(flown.energy_j.mean())


def best_first(costs: np.ndarray) -> np.ndarray:
    """Order of designs by costs [n, 2]: first those as near the Sun as the best, by energy."""
    hours, energy = costs.T
    far = hours > hours.min() + EQUAL_H
    return np.lexsort((np.where(far, hours, energy), far))


def designs_of(round_: int, before: list[np.ndarray], count: int, dimensions: int) -> np.ndarray:
    """Designs of a round as points of the unit cube, by those of the round before, best first."""
    if round_ == 0:
        return qmc.Sobol(dimensions, seed=1).random(count)
    if round_ == len(ROUNDS) - 1:
        return np.array(before[:count])
    near = qmc.Sobol(dimensions, seed=1 + round_).random(count).reshape(PARENTS, -1, dimensions)
    near[:, 0] = 0.5  # the best themselves
    around = np.array(before[:PARENTS])[:, None] + AROUND * (2.0 * near - 1.0)
    return np.clip(around, 0.0, 1.0).reshape(-1, dimensions)


def tuned(contender: Contender, workers: int | None) -> tuple[dict, np.ndarray]:
    """Gains of a law by the rule, and their costs."""
    low, high = np.log(np.array([*contender.ranges.values()])).T
    ranked: list[np.ndarray] = []
    for number, (count, starts) in enumerate(ROUNDS):
        points = designs_of(number, ranked, count, len(low))
        values = [[float(f"{x:.3g}") for x in np.exp(low + p * (high - low))] for p in points]
        gains = [dict(zip(contender.ranges, each, strict=True)) for each in values]
        costs = np.array([cost(contender, each, starts, workers) for each in gains])
        order = best_first(costs)
        ranked = [points[k] for k in order]
    return gains[order[0]], costs[order[0]]


def design(workers: int | None = None) -> None:
    """Find the gains of all laws and write them."""
    found = {}
    for name, contender in contenders().items():
        found[name], (hours, energy_j) = tuned(contender, workers)
        print(f"{name:36s}{hours:6.2f} h{energy_j / 1e3:7.2f} kJ  {found[name]}", flush=True)
        FOUND.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


def _hours(value: float) -> str:
    return f"{value:.2f} h" if np.isfinite(value) else "not reached"


def row(name: str, flown: Flown) -> str:
    """A row of the table; a start that never settles counts in the quantiles as the longest.

    The standard error is that of the mean over groups of starts, which share an orbit.
    """
    hours = settling_h(flown)
    of_groups = np.isfinite(hours).mean(axis=1)
    standard_error = of_groups.std(ddof=1) / np.sqrt(len(of_groups))
    came, away = np.isfinite(flown.first_s).mean(), (flown.error_deg > 150.0).mean()
    return (
        f"{name:36s}{100 * of_groups.mean():6.1f} +- {100 * standard_error:3.1f} %"
        f"{_hours(quantile(hours.ravel(), 0.5)):>13s}{100 * flown.near_sun.mean():7.1f} %"
        f"{100 * came:8.1f} %{100 * away:7.1f} %"
        f"{quantile(flown.error_deg.ravel(), 0.5):8.1f} /"
        f"{quantile(flown.error_deg.ravel(), 0.9):6.1f} deg"
        f"{quantile(flown.rate_deg_s.ravel(), 0.5):7.2f} deg/s"
        f"{quantile(flown.energy_j.ravel(), 0.5) / 1e3:7.2f} kJ{hours.size:8d}"
    )


HEAD = (
    f"{'law':36s}{'settled':>15s}{'half by':>13s}{'near':>9s}{'came':>10s}{'away':>9s}"
    f"{'error 50 % / 90 %':>19s}{'rate 50 %':>13s}{'energy':>10s}{'starts':>8s}"
)


def draw(name: str, flown: Flown, left, right, style: dict) -> None:
    """A law's line in both pictures: which part of the starts has settled, and how well."""
    hours, error = np.sort(settling_h(flown), axis=None), np.sort(flown.error_deg, axis=None)
    part = np.arange(1, len(hours) + 1) / len(hours)
    left.step(hours, part, where="post", **style)
    right.step(error, part, where="post", label=name, **style)


def main(starts: int, workers: int | None = None) -> None:
    """Fly every law from the same starts; a row of the table each, and a picture."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 5), layout="constrained")
    gains = json.loads(FOUND.read_text(encoding="utf-8"))
    print(HEAD)
    colours = {}
    for name, contender in contenders().items():
        flown = fly(*scenario_of(contender, gains[name]), starts, TESTED, workers)
        print(row(name, flown), flush=True)
        without_gyro = "gyro" not in contender.reads
        # a law has one colour, with a gyro and without
        colour = colours.setdefault(re.split(", | by ", name)[0], CURVES[len(colours)])
        style = {"color": colour, "linestyle": "--" if without_gyro else "-"}
        draw(name, flown, left, right, style)
    left.set(xlabel="within 30 deg of the Sun for good after [h]", ylabel="share of all starts",
             xlim=(0, 22), xticks=range(0, 23, 2), ylim=(0, 1.01))  # fmt: skip
    right.set(xlabel="mean angle of the axis to the Sun, last 6 h [deg]", xlim=(0, 180),
              ylim=(0, 1.01))  # fmt: skip
    for axes in (left, right):
        quiet(axes)
    figure.legend(
        *right.get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=9,
        title="dashed: without a gyro", frameon=False,
    )  # fmt: skip
    figure.savefig("sun-laws.png", dpi=120)


def faults(workers: int | None = None) -> None:
    """Every single fault of the satellite, from a few starts on orbits of their own."""
    print(f"{WITH_FAULTS} starts, every single fault from {AT_H:g} h on")
    print(f"{'law':36s}{'flights':>9s}{'without a fault':>18s}" + _of(VERDICTS, "{:>11s}"))
    for name, contender in contenders().items():
        scenario, campaign = scenario_of(contender, json.loads(FOUND.read_text())[name])
        flown = [
            fly_faults(
                member_scenario(scenario, campaign, member),
                at_s=[3600.0 * AT_H],
                workers=workers,
            )
            for member in range(WITH_FAULTS)
        ]
        nominal = sum(found.verdict[0] == VERDICTS[0] for found in flown)
        for guarded in (True, False) if flown[0].guards else (True,):
            counts = [
                sum(found.counts(guarded)[verdict] for found in flown) for verdict in VERDICTS
            ]
            label = name if guarded else f"{name}, no guards"
            parts = [f"{100 * count / sum(counts):.1f} %" for count in counts]
            print(
                f"{label:36s}{sum(counts):9d}{f'{nominal} {VERDICTS[0]}':>18s}"
                + _of(parts, "{:>11s}"),
                flush=True,
            )


def _of(parts, form: str) -> str:
    return "".join(form.format(part) for part in parts)


if __name__ == "__main__":
    warnings.simplefilter("ignore", OneByOne)  # laws with modes do not fly side by side
    if sys.argv[1:] == ["design"]:
        design()
    elif sys.argv[1:] == ["faults"]:
        faults()
    else:
        main(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000)
