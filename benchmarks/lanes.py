"""A member in lanes against its single run, stepping only: ratios of alternating runs.

.venv/bin/python benchmarks/lanes.py
"""

import time

import numpy as np

from torquer.compile.lanes import LANES
from torquer.scenario.load import scenario_from_text
from torquer.simulation.lanes.group import Lanes, Pieces
from torquer.simulation.setup.run import prepare

LAW = 'control = { law = { kind = "bdot_rate", gain_a_m2_s_per_t = 4e4 }, sample_s = 1.0 }'
SCENARIO = f"""
start = 2012-03-04T10:31:47Z
orbit = {{ kind = "circular", altitude_km = 500, inclination_deg = 51.7 }}
spacecraft.body.inertia_kg_m2 = [1.0255, 1.5393, 1.8172]
spacecraft.coils.limit_a_m2 = 3.2
initial.rate_deg_s = [5, 4, 3]
{LAW}
simulation = {{ duration_s = 11480, step_s = 1.0, record_s = 20.0 }}
"""
NOISE = """
spacecraft.magnetometer.noise_nt = 50.0
spacecraft.gyro = { noise_deg_s = 0.01, bias_drift_deg_s_sqrt_s = 1e-4 }
spacecraft.attitude_sensor.noise_deg = 0.01
"""
MODES = """
control.laws.damping = { kind = "bdot", gain_a_m2_s_per_t = 4e4 }
control.laws.slow = { kind = "bdot_rate", gain_a_m2_s_per_t = 2e4 }
[control.modes.states]
fast.laws = ["damping"]
fast.transitions = [{ to = "slow", when = { signal = "rate_deg_s", below = 3 } }]
slow.laws = ["slow"]
slow.transitions = [{ to = "fast", when = { signal = "rate_deg_s", above = 4 } }]
"""
CASES = {
    "no noise": SCENARIO,
    "noise on all sensors": SCENARIO + NOISE,
    "modes": SCENARIO.replace(LAW, "control.sample_s = 1.0") + MODES,
}
ROUNDS = 9


def single(scenario, piece) -> float:
    """Seconds of a run's stepping."""
    run = prepare(scenario, piece=piece)
    begun_s = time.perf_counter()
    run.advance_to(run.steps)
    return time.perf_counter() - begun_s


def in_lanes(lanes: Lanes, numbers, seeds) -> float:
    """Seconds of a member's stepping in lanes."""
    begun_s = time.perf_counter()
    lanes.fly(numbers, seeds)
    return (time.perf_counter() - begun_s) / LANES


def main() -> None:
    """Print both costs and the median of their ratio."""
    for name, text in CASES.items():
        scenario = scenario_from_text(text)
        run = prepare(scenario)
        lanes = Lanes(run, Pieces(run))
        numbers, seeds = np.tile(lanes.packed.numbers, (LANES, 1)), np.arange(LANES)
        pairs = np.array(
            [
                (single(scenario, run.piece), in_lanes(lanes, numbers, seeds))
                for _ in range(ROUNDS + 1)
            ]
        )[1:]
        alone_ns, lane_ns = 1e9 * pairs.min(axis=0) / run.steps
        ratio = np.median(pairs[:, 1] / pairs[:, 0])
        print(f"{name}: {alone_ns:.0f} ns a step alone, {lane_ns:.0f} in lanes, ratio {ratio:.2f}")


if __name__ == "__main__":
    main()
