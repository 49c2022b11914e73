"""One version of torquer in a process of its own: answers each line of stdin with a time.

Runs with any version since 0.1.0, the one that PYTHONPATH names. `gyro`: the law is B-dot by
magnetometer and gyro; the number is its `sample_s`. The answer is the time per step of 1 s.
"""

import sys
import time

from torquer import scenario_from_text
from torquer.simulation.setup.run import prepare

SCENARIO = """
start = 2012-03-03T05:16:48Z
orbit = {{ kind = "circular", radius_km = 6850.0, inclination_deg = 51.7 }}
environment = {{ field = {{ kind = "igrf14", degree = 13 }}, earth_rotation = "sidereal" }}
spacecraft.body.inertia_kg_m2 = [1.0255, 1.5393, 1.8172]
spacecraft.coils = {{ limit_a_m2 = 3.2, saturation = "clip" }}
initial.rate_deg_s = [1, 1, 1]
control = {{ law = {{ kind = "{law}", gain_a_m2_s_per_t = 1e6 }}, sample_s = {sample_s} }}
simulation = {{ revolutions = 20, step_s = 1.0, record_s = 1e4 }}
"""
LAWS = {"gyro": "bdot_rate", "difference": "bdot"}


def seconds_per_step(run) -> float:
    """Processor time that a prepared run takes for a step."""
    start = time.process_time()
    run.advance_to(run.steps)
    return (time.process_time() - start) / run.steps


def scenario(law: str, sample_s: float):
    """The scenario: a law of `LAWS`, a control step every so often."""
    return scenario_from_text(SCENARIO.format(law=LAWS[law], sample_s=sample_s))


if __name__ == "__main__":
    for line in sys.stdin:
        law, sample_s = line.split()
        print(seconds_per_step(prepare(scenario(law, float(sample_s)))), flush=True)
