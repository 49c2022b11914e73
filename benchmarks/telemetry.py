"""Telemetry: the field's strength along a million stamps, and the calibration of as many rows.

`python benchmarks/telemetry.py`: seconds of each, once the code is compiled.
"""

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

import numpy as np
from telemetry_session import BIAS, environment, session

from torquer.ground.telemetry.calibration import calibrate
from torquer.ground.telemetry.modulus import FieldAlong

ROWS = 1_000_000


def seconds(work):
    """Time of a call, the least of three, and its last result."""
    best, found = np.inf, None
    for _ in range(3):
        start = time.perf_counter()
        found = work()
        best = min(best, time.perf_counter() - start)
    return best, found


def main() -> None:
    env = environment()
    for cadence_s in (1.0, 31.0):
        t_s = cadence_s * np.arange(ROWS)
        took, _ = seconds(lambda t_s=t_s: FieldAlong(env, t_s).strength(t_s))
        print(f"strength of IGRF-14 at {ROWS:,} stamps each {cadence_s:g} s: {took:.2f} s")
    data, _ = session(0, rows=ROWS, cadence_s=1.0)
    field = FieldAlong(env, data["time"].values)
    took, found = seconds(lambda: calibrate(data, field))
    off = 1e9 * np.linalg.norm(found.bias - BIAS)
    print(f"calibration of {ROWS:,} rows: {took:.2f} s, bias off by {off:.2f} nT")


if __name__ == "__main__":
    main()
