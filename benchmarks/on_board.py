"""The on-board computer: what a control step, its parts and an exchange with a host cost.

`TORQUER_PEER` names a checkout of another version to be measured in turns with this one, each in a
process of its own.
"""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from version import scenario, seconds_per_step

import torquer
from torquer.simulation.setup.run import prepare

HERE = Path(__file__).parent
OWN = HERE.parent
#: Control steps of a measured flight that is driven from outside.
EXCHANGES = 20000


@torquer.law(parameters={"gain": 1e6})
def user_gyro_bdot(inputs, parameters, memory):
    """The built-in B-dot by gyro and magnetometer as a user would write it."""
    wx, wy, wz = inputs.estimate.omega_body_rad_s
    bx, by, bz = inputs.b_body_t
    k = parameters.gain
    return (k * (wy * bz - wz * by), k * (wz * bx - wx * bz), k * (wx * by - wy * bx))


class Version:
    """A version of the package in a process of its own, that takes its turn when asked."""

    def __init__(self, checkout: Path):
        self.process = subprocess.Popen(
            [sys.executable, str(HERE / "version.py")],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=environment(checkout),
        )

    def __call__(self, law: str, sample_s: float) -> float:
        """Seconds per step of 1 s."""
        self.process.stdin.write(f"{law} {sample_s}\n")
        self.process.stdin.flush()
        return float(self.process.stdout.readline())

    def close(self) -> None:
        """End the process."""
        self.process.stdin.close()
        self.process.wait()


def versions() -> dict[str, Path]:
    """Checkouts by name: this one, and the peer if there is one."""
    peer = os.environ.get("TORQUER_PEER")
    return {"this": OWN} | ({"peer": Path(peer)} if peer else {})


def environment(checkout: Path, cache: str | None = None) -> dict[str, str]:
    """Environment of a process that imports the package of a checkout."""
    own = {"TORQUER_CACHE_DIR": cache} if cache else {}
    return os.environ | {"PYTHONPATH": str(checkout)} | own


def medians(functions: dict, turns: int) -> dict:
    """Median of what each function returns, all taking turns after a first one."""
    found = {name: [] for name in functions}
    for turn in range(turns + 1):
        for name, function in functions.items():
            value = function()
            if turn > 0:
                found[name].append(value)
    return {name: float(np.median(values)) for name, values in found.items()}


def in_nanoseconds(times: dict) -> dict:
    """Times [s] as nanoseconds."""
    return {name: 1e9 * value for name, value in times.items()}


def control_step(turns: int) -> dict:
    """Gyro B-dot every second and every 1000 s: the difference is the control step.

    Medians over processes that take turns: a step may take 40 % more in one than in another.
    """
    asked = {
        (name, sample_s): lambda checkout=checkout, sample_s=sample_s: best_in_process(
            checkout, sample_s
        )
        for name, checkout in versions().items()
        for sample_s in (1.0, 1000.0)
    }
    ns = in_nanoseconds(medians(asked, turns))
    found = {
        name: {
            "ns_per_second_of_flight": ns[name, 1.0],
            "ns_without_control": ns[name, 1000.0],
            "ns_of_control_step": ns[name, 1.0] - ns[name, 1000.0],
        }
        for name in versions()
    }
    if "peer" in found:
        found["ratio_to_peer"] = {k: v / found["peer"][k] for k, v in found["this"].items()}
    return found


def best_in_process(checkout: Path, sample_s: float) -> float:
    """Seconds per step of 1 s, the least of a few runs in one process."""
    version = Version(checkout)
    least = min(version("gyro", sample_s) for _ in range(5))
    version.close()
    return least


def with_modes(plain):
    """The law of a scenario in all states of a table of two regions with four states each."""
    law = plain.control.law
    rates, fields = (2.0, 1.0, 0.5), (30000.0, 35000.0, 40000.0)

    def chain(signal, side, thresholds, laws):
        ways = [
            {"to": f"{signal}_{k + 1}", "when": {"signal": signal, side: threshold}, "for_s": 60.0}
            for k, threshold in enumerate(thresholds)
        ]
        back = {"to": f"{signal}_0", "at_most_s": 1000.0}
        return {
            "states": {
                f"{signal}_{k}": {"laws": laws, "transitions": [way]}
                for k, way in enumerate([*ways, back])
            }
        }

    regions = {
        "rate": chain("rate_deg_s", "below", rates, ["law"]),
        "field": chain("field_nt", "above", fields, []),
    }
    control = plain.control.model_dump(exclude={"law", "laws", "modes"})
    control |= {"laws": {"law": law.model_dump()}, "modes": {"regions": regions}}
    return plain.replace("control", control)


def parts(turns: int) -> dict:
    """A user's law, modes and an estimator, and the same run without; all at 1 Hz."""
    gyro, difference = scenario("gyro", 1.0), scenario("difference", 1.0)
    full = difference.replace("control.estimator", {"kind": "rate_from_field"})
    empty = difference.replace("control.estimator", {"kind": "none"})
    cases = {
        "built-in law": (gyro, None),
        "user law": (gyro, user_gyro_bdot),
        "modes, 2 regions of 4 states": (with_modes(gyro), None),
        "difference of readings": (difference, None),
        "no estimator": (empty, None),
        "rate_from_field": (full, None),
    }
    runs = {
        name: lambda case=case, law=law: seconds_per_step(prepare(case, law))
        for name, (case, law) in cases.items()
    }
    ns = in_nanoseconds(medians(runs, turns))
    return {
        "ns_per_second_of_flight": ns,
        "user_law_to_built_in": ns["user law"] / ns["built-in law"],
        "ns_of_modes": ns["modes, 2 regions of 4 states"] - ns["built-in law"],
        "ns_of_estimator": ns["rate_from_field"] - ns["no estimator"],
    }


def exchange_seconds() -> float:
    """Processor time of an exchange of readings and command with a flight driven from outside."""
    flight = torquer.Flight(scenario("gyro", 1.0))
    flight.read()
    flight.command()
    start = time.process_time()
    for _ in range(EXCHANGES):
        flight.read()
        flight.command((0.1, 0.0, 0.0))
    return (time.process_time() - start) / EXCHANGES


def first_steps(checkout: Path, cache: str) -> float:
    """Seconds of a process that imports the package and asks for one run."""
    command = [sys.executable, str(HERE / "version.py")]
    start = time.perf_counter()
    subprocess.run(
        command,
        input="difference 1\n",
        text=True,
        check=True,
        capture_output=True,
        env=environment(checkout, cache),
    )
    return time.perf_counter() - start


def starts(turns: int) -> dict:
    """A process that flies B-dot for 20 revolutions: with an empty cache, and then a warm one."""
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        caches = {name: str(Path(folder) / name) for name in versions()}
        for name, checkout in versions().items():
            found[name] = {"first_s": first_steps(checkout, caches[name])}
        asked = {
            name: lambda name=name, checkout=checkout: first_steps(checkout, caches[name])
            for name, checkout in versions().items()
        }
        for name, seconds in medians(asked, turns).items():
            found[name]["warm_s"] = seconds
    return found


def measure(turns: int) -> dict:
    """All of it; times belong to this machine, ratios travel."""
    return {
        "control_step": control_step(turns),
        "parts": parts(turns),
        "exchange_us": 1e6
        * medians({"exchange": exchange_seconds}, max(1, turns // 3))["exchange"],
        "start_up": starts(max(1, turns // 3)),
    }


if __name__ == "__main__":
    import json

    print(json.dumps(measure(int(sys.argv[1]) if len(sys.argv) > 1 else 15), indent=2))
