"""All benchmarks: ratios measured side by side in one run, medians of interleaved turns.

`make bench` prints them and writes benchmarks/results.json. All engines agree on the final
state before a clock is looked at. Absolute times belong to this machine; ratios travel. What
another program is not installed for stays as it was measured, with its day.
"""

import json
import os
import platform
import shutil
import subprocess
import sys
import time
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from basilisk_peer import measure as measure_basilisk
from build import compiler_version
from cpp_peer import CppPeer
from detumble_task import DEGREE, Task, read_coefficients
from measured_before import measured_before
from on_board import measure as measure_on_board
from scipy_loop import run as run_scipy
from torquer_side import TorquerSide, task_at_start, user_law, year_at_start

HERE = Path(__file__).parent
RESULTS = HERE / "results.json"
TURNS = 15


def clocked(function) -> float:
    """Wall time of one call [s]."""
    start = time.perf_counter()
    function()
    return time.perf_counter() - start


def interleaved(functions: dict, turns: int = TURNS) -> dict:
    """Median wall time [s] of each function, all taking turns."""
    times = {name: [] for name in functions}
    for _ in range(turns):
        for name, function in functions.items():
            times[name].append(clocked(function))
    return {name: float(np.median(values)) for name, values in times.items()}


def detumble(task: Task, g, h) -> dict:
    """Task (a): torquer against C++ in its three forms."""
    plain, wide = CppPeer(g, h), CppPeer(g, h, wide=True)
    table, exact = TorquerSide(task), TorquerSide(task, table_tolerance=0.0)
    user = TorquerSide(task, law=user_law)
    reference = plain.run(task)
    differences = {
        "table": table.step(),
        "exact": exact.step(),
        "user law": user.step(),
        "c++ shared": plain.run_shared(task),
        "c++ wide shared": wide.run_shared(task),
    }
    differences = {k: float(np.abs(v - reference).max()) for k, v in differences.items()}
    for name, difference in differences.items():
        assert difference < 1e-6, f"{name} differs from C++ by {difference}"
    times = interleaved(
        {
            "c++": lambda: plain.run(task),
            "c++ shared": lambda: plain.run_shared(task),
            "c++ wide shared": lambda: wide.run_shared(task),
            "table, stepping": table.step,
            "table, with its making": table.whole,
            "exact field, with its making": exact.whole,
            "user law, stepping": user.step,
        }
    )
    return {
        "final_state_difference_from_c++": differences,
        "steps": task.n_steps,
        "us_per_step": {k: 1e6 * v / task.n_steps for k, v in times.items()},
        "ratio_to_c++": {k: v / times["c++"] for k, v in times.items()},
        "user_law_to_built_in": times["user law, stepping"] / times["table, stepping"],
    }


def scipy_and_basilisk(task: Task, g, h, c_us: float, own_us: float) -> dict:
    """The slow ways, per simulated second; Basilisk where it is installed, or from RESULTS."""
    seconds = 100
    state, per_second = run_scipy(task, g, h, seconds)
    error = float(np.abs(state - CppPeer(g, h).run(task, seconds, substeps=32)).max())
    assert error < 1e-8, f"SciPy differs from C++ by {error}"
    out = {
        "scipy_us_per_s": 1e6 * per_second,
        "scipy_to_c++": 1e6 * per_second / c_us,
        "scipy_difference": error,
    }
    basilisk = measure_basilisk(task)
    if basilisk:
        out["basilisk_measured_on"] = datetime.now(UTC).date().isoformat()
        out["basilisk"] = basilisk
        out["basilisk_to_torquer"] = {k: v["us_per_second"] / own_us for k, v in basilisk.items()}
        return out
    return {**measured_before(RESULTS, "slow", "basilisk"), **out}


def field_alone(g, h) -> dict:
    """Task (b): the field at many points."""
    from torquer.environment.field import FIELDS

    model = FIELDS["igrf14"](degree=DEGREE)
    packed = model.prepare(year_at_start())
    rng = np.random.default_rng(1)
    points = rng.normal(size=(20000, 3))
    points *= 6850e3 / np.linalg.norm(points, axis=1)[:, None]
    plain, wide = CppPeer(g, h), CppPeer(g, h, wide=True)
    ours, theirs = model.b_earth_fixed(packed, points), plain.field(points)
    difference = float(np.abs(ours - theirs).max() * 1e9)
    assert difference < 1e-6, f"fields differ by {difference} nT"
    times = interleaved(
        {
            "torquer": lambda: model.b_earth_fixed(packed, points),
            "c++": lambda: plain.field(points),
            "c++ wide": lambda: wide.field(points),
        }
    )
    return {
        "ns_per_point": {k: 1e9 * v / len(points) for k, v in times.items()},
        "ratio_to_c++": {k: v / times["c++"] for k, v in times.items()},
        "difference_nt": difference,
    }


def start_up() -> dict:
    """Task (c): seconds from the shell, warm."""
    tool = shutil.which("torquer") or str(Path(sys.executable).with_name("torquer"))
    example = str(HERE.parent / "examples/chibis_m_detumble.toml")
    short = (
        f"import torquer; s = torquer.load_scenario({example!r});"
        "from torquer.simulation.setup.run import prepare; r = prepare(s); r.advance_to(10)"
    )
    commands = {
        "torquer --help": [tool, "--help"],
        "torquer validate": [tool, "validate", example],
        "import, prepare and first steps of the main scenario": [sys.executable, "-c", short],
        "python itself": [sys.executable, "-c", "pass"],
    }

    def quiet(command):
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)

    for command in commands.values():
        quiet(command)
    return interleaved({k: lambda c=c: quiet(c) for k, c in commands.items()}, turns=5)


def main() -> None:
    """Run everything, print it, write results.json."""
    task = task_at_start()
    g, h = read_coefficients(year=year_at_start())
    results = {
        "machine": {
            "processor": platform.processor() or platform.machine(),
            "cores": os.cpu_count(),
            "compiler": compiler_version(),
            "python": platform.python_version(),
        },
        "detumble": (a := detumble(task, g, h)),
        "slow": scipy_and_basilisk(
            task, g, h, a["us_per_step"]["c++"], a["us_per_step"]["table, with its making"]
        ),
        "field": field_alone(g, h),
        "start_up_s": start_up(),
        "on_board": measure_on_board(TURNS),
    }
    text = json.dumps(results, indent=2)
    RESULTS.write_text(text + "\n", encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
