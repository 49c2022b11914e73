"""Work and precision: what an attitude to a given accuracy costs, by integrator and task.

`make bench-precision` writes benchmarks/precision.json and design/precision.png. The error is the
greatest angle [rad] from the reference at a few instants; the cost is the processor time of the
stepping alone, in microseconds per simulated second, least of turns that all ways take. The
reference is exact for the gyrostat, the exact free rotation for the free spinner, else adaptive
steps of the finest tolerance; how far another integrator's finest is from it is its floor.

Own runs have sensors, control steps and tables of the environment in them, which the rivals have
not; see `precision_rivals.py` and `precision_basilisk.py` for what else differs.
`python precision.py spinner slow` takes these tasks alone, and only prints.
"""

import importlib.util
import json
import math
import os
import platform
import sys
import time
from pathlib import Path

import numpy as np
from precision_basilisk import basilisk_ways
from precision_own import fly, own_ways
from precision_picture import draw
from precision_rivals import heyoka_ways, scipy_ways
from precision_tasks import TASKS, Task, angle, exact_gyrostat

HERE = Path(__file__).parent
TURNS = 7
#: A way has had its turns after so much time [s], preparation included.
ENOUGH_S = 1.0
TARGETS = (1e-3, 1e-6, 1e-9)


def reference(task: Task) -> tuple[np.ndarray, float]:
    """(Attitudes, how well they are known [rad])."""
    best, other = (fly(task.scenario(finest))[1] for finest in task.references)
    if task.is_free and task.wheel.any():
        best = exact_gyrostat(task)
    return best, angle(best, other)


def measure(task: Task) -> dict:
    """Floor of the reference, and by integrator the settings with cost and error."""
    expected, floor = reference(task)
    families = (own_ways, scipy_ways, heyoka_ways, basilisk_ways)
    ways = [way for family in families for way in family(task)]
    flown = [(math.inf, None)] * len(ways)
    used = [0.0] * len(ways)
    for _ in range(TURNS):
        for k, way in enumerate(ways):
            if used[k] < ENOUGH_S:
                start = time.perf_counter()
                flown[k] = cheaper(flown[k], way.fly())
                used[k] += time.perf_counter() - start
    curves: dict[str, list] = {}
    for way, (seconds, attitudes) in zip(ways, flown, strict=True):
        if attitudes is not None and np.isfinite(attitudes).all():
            point = [way.setting, 1e6 * seconds / task.duration_s, angle(attitudes, expected)]
            curves.setdefault(way.integrator, []).append(point)
    return {"title": task.title, "floor_rad": floor, "setting, us per s, rad": curves}


def cheaper(one: tuple, other: tuple | None) -> tuple:
    """Of two flights the one in less time; a run that stops is none."""
    return one if other is None or one[0] <= other[0] else other


def cost_at(curve: list, target: float) -> float | None:
    """Cost [us/s] of an error: between the two settings about it; None if it is not reached.

    The finer of them and the next one must be below it: one lucky step is not enough. No more than
    what a still finer setting takes: below the interval between two events there is no choice.
    """
    for k, (_, cost, error) in enumerate(curve):
        if error <= target and all(e <= target for _, _, e in curve[k : k + 2]):
            if k > 0:
                cost = _between(curve[k - 1], curve[k], target)
            return min([cost, *(c for _, c, e in curve[k:] if e <= target)])
    return None


def _between(coarse: list, fine: list, target: float) -> float:
    """Cost at an error between those of two settings, by powers."""
    (_, cheap, large), (_, dear, small) = coarse, fine
    if large <= target:
        return dear
    part = math.log(large / target) / math.log(large / max(small, 1e-16))
    return cheap * (dear / cheap) ** part


def costs(found: dict) -> dict:
    """Cost [us/s] at the target errors by integrator; targets below the floor are left out."""
    targets = [target for target in TARGETS if target > 2.0 * found["floor_rad"]]
    curves = found["setting, us per s, rad"]
    return {f"{t:g} rad": {name: cost_at(c, t) for name, c in curves.items()} for t in targets}


def tell(name: str, found: dict) -> None:
    """Print a task's curves and costs."""
    print(f"{name}: {found['title']}; reference to {found['floor_rad']:.1g} rad")
    for integrator, curve in found["setting, us per s, rad"].items():
        text = ", ".join(f"{s:g}: {cost:.3g} us {error:.1e}" for s, cost, error in curve)
        print(f"  {integrator}: {text}")
    for target, by_name in found["us per s at"].items():
        text = ", ".join(f"{n} {c:.3g}" for n, c in by_name.items() if c is not None)
        print(f"  us per s at {target}: {text}", flush=True)


def main(names: list[str]) -> None:
    """Measure all tasks, or the named ones; write numbers and picture if all."""
    for module, package in (("heyoka", "heyoka"), ("Basilisk", "bsk")):
        if importlib.util.find_spec(module) is None:
            print(f"{module}: not installed (pip install {package}); left out")
    tasks = {}
    for name in names or TASKS:
        tasks[name] = measure(TASKS[name])
        tasks[name]["us per s at"] = costs(tasks[name])
        tell(name, tasks[name])
    if names:
        return
    machine = {
        "processor": platform.processor() or platform.machine(),
        "cores": os.cpu_count(),
        "python": platform.python_version(),
    }
    text = json.dumps({"machine": machine, "tasks": tasks}, indent=1)
    (HERE / "precision.json").write_text(text + "\n", encoding="utf-8")
    draw(tasks, HERE.parent / "design" / "precision.png")


if __name__ == "__main__":
    main(sys.argv[1:])
