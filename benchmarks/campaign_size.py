"""Tip-offs in any number, to a file: time by part, memory, disk; statistics beside those of fewer.

.venv/bin/python benchmarks/campaign_size.py RUNS FOLDER [OF]
.venv/bin/python benchmarks/campaign_size.py 1000000 /tmp/million 10000

The main example with adaptive steps and ten revolutions (`REVOLUTIONS=n` flies fewer); attitude,
rate, inertia, gain and the magnetometer's bias vary. `CASE=wheels`: `wheels_in_flight.toml`, four
wheels behind a Kalman filter; the same vary, rates up to 0.5 deg/s. RUNS.json in FOLDER has what
is printed. `OF`: a campaign of so many members, flown here before; both differ by chance alone if
all differences of means and of the rate of success lie within a few of their standard errors.
Members of the smaller are the first of the larger one: it is compared with those that come after.
"""

import json
import os
import resource
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import NamedTuple

import numpy as np

import torquer
from torquer.campaign import at_once, executors, fleet, fly
from torquer.campaign.contents import member_outcomes
from torquer.campaign.load import campaign_from_data
from torquer.scenario.load import scenario_from_text
from torquer.simulation.lanes.group import Lanes
from torquer.simulation.results.file import lazily

ROOT = Path(__file__).parents[1]
FILTER = """
[spacecraft.sun_sensors]
preset = "dss3"
[control.estimator]
kind = "kalman_gyro"
sensors = ["magnetometer", "sun"]
magnetometer_noise_nt = 50.0
sun_noise_deg = 0.15
angle_random_walk_deg_sqrt_s = 0.004
rate_random_walk_deg_s_sqrt_s = 1e-5
gyro_bias_sigma_deg_s = 0.01
"""


class Case(NamedTuple):
    """A scenario of the examples, what is added to it, and what varies and counts."""

    file: str
    added: str
    up_to_deg_s: float
    gain: str
    gains: list[float]
    below_deg_s: float


CASES = {
    "tip-offs": Case(
        "tip_off_campaign.toml", "", 15.0, "control.law.gain_a_m2_s_per_t", [3e6, 8e6], 0.5
    ),
    "wheels": Case(
        "wheels_in_flight.toml", FILTER, 0.5, "control.laws.wheels.bandwidth_rad_s", [0.1, 0.2], 0.1
    ),
}


def campaign_of(case: Case, runs: int) -> dict:
    """The campaign as data."""
    rate = {"direction": "uniform", "magnitude": {"uniform": [0.0, case.up_to_deg_s]}}
    bias = {"normal": {"mean": [0, 0, 0], "sigma": 50.0}}
    return {
        "runs": runs,
        "seed": 1,
        "vary": {
            "initial.attitude": "uniform",
            "initial.rate_deg_s": rate,
            "spacecraft.body.inertia_kg_m2": {"relative": {"uniform": [0.9, 1.1]}},
            case.gain: {"log_uniform": case.gains},
            "spacecraft.magnetometer.bias_nt": bias,
        },
        "outcomes": {
            "final_rate_deg_s": {"signal": "rate_deg_s", "what": {"at_end": True}},
            "mean_rate_deg_s": {"signal": "rate_deg_s", "what": {"mean_after_s": 0.0}},
            "coil_energy_j": {"signal": "coil_energy_j"},
        },
        "success": {"final_rate_deg_s": {"below": case.below_deg_s}},
    }


#: Where processor time goes: what is called, and which part of a member's cost it is.
PARTS: list[tuple[object, str, str]] = [
    (fleet, "draw", "draw"),
    (at_once.AtOnce, "numbers", "prepare"),
    (Lanes, "fly_in_parts", "fly and reduce"),
    (fleet.Reduction, "add", "reduce"),
    (executors, "chunk_dataset", "describe"),
    (fly, "put_chunk", "write"),
    (fly, "finish_file", "join"),
]


def counted(spent: Counter) -> None:
    """Count the processor time of each part from now on, in the thread that works on it."""
    lock = threading.Lock()

    def timed(function: Callable, part: str) -> Callable:
        @wraps(function)
        def call(*args, **keys):
            begun_s = time.thread_time()
            try:
                return function(*args, **keys)
            finally:
                with lock:
                    spent[part] += time.thread_time() - begun_s

        return call

    for place, name, part in PARTS:
        setattr(place, name, timed(getattr(place, name), part))


def flown(runs: int, path: Path) -> dict:
    """What a campaign takes; compiled code is on the disk before."""
    case = CASES[os.environ.get("CASE", "tip-offs")]
    text = (ROOT / "examples" / case.file).read_text() + case.added
    scenario = scenario_from_text(text).replace("simulation", {
        "revolutions": float(os.environ.get("REVOLUTIONS", "10")), "record_s": 60.0,
    })  # fmt: skip
    few = campaign_from_data(campaign_of(case, 64), scenario)
    torquer.fly_campaign(scenario, few)
    spent: Counter = Counter()
    counted(spent)
    begun_s, processor_s = time.time(), time.process_time()
    campaign = campaign_from_data(campaign_of(case, runs), scenario)
    result = torquer.fly_campaign(scenario, campaign, to=path)
    known = {
        "runs": runs,
        "wall_s": time.time() - begun_s,
        "processor_s": time.process_time() - processor_s,
        "memory_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0,
        "disk_mb": path.stat().st_size / 1e6,
        "revolutions": scenario.simulation.revolutions,
    }
    spent["fly and reduce"] -= spent["reduce"]
    spent["fly"] = spent.pop("fly and reduce")
    parts = {part: 1e3 * seconds / runs for part, seconds in spent.items()}
    return known | {"ms_a_member": parts, "statistics": statistics(result, slice(None))}


def statistics(result, members: slice) -> dict[str, tuple[float, float]]:
    """Means of outcomes and of success, with their standard errors."""
    values = member_outcomes(result) | {"success": result["succeeded"].values.astype(float)}
    found = {}
    for name, each in values.items():
        known = each[members][np.isfinite(each[members])]
        found[name] = float(known.mean()), float(known.std(ddof=1) / np.sqrt(len(known)))
    return found


def main(runs: int, folder: Path, fewer: int | None = None) -> None:
    """Fly, tell, and compare."""
    folder.mkdir(parents=True, exist_ok=True)
    known = flown(runs, folder / f"{runs}.nc")
    if fewer is not None:
        rest = statistics(lazily(folder / f"{runs}.nc"), slice(fewer, None))
        few = json.loads((folder / f"{fewer}.json").read_text())["statistics"]
        known["in_standard_errors"] = {
            name: (mean - few[name][0]) / float(np.hypot(error, few[name][1]))
            for name, (mean, error) in rest.items()
        }
    (folder / f"{runs}.json").write_text(json.dumps(known, indent=1) + "\n")
    print(json.dumps(known, indent=1))


if __name__ == "__main__":
    main(int(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]) if len(sys.argv) > 3 else None)
