"""Members in lanes against their single runs, stepping only: ratios of alternating runs.

.venv/bin/python benchmarks/lanes.py ["NAME" ...]
"""

import sys
import time
from pathlib import Path

import numpy as np

from torquer.scenario.load import scenario_from_text
from torquer.simulation.lanes.group import Lanes, Pieces, first_rate
from torquer.simulation.lanes.laws import CELLS_AT
from torquer.simulation.setup.run import prepare
from torquer.simulation.setup.step_error import integration_error

EXAMPLES = Path(__file__).parents[1] / "examples"
DURATION_S = 3600
LAW = 'control = { law = { kind = "bdot_rate", gain_a_m2_s_per_t = 4e4 }, sample_s = 1.0 }'
SCENARIO = f"""
start = 2012-03-04T10:31:47Z
orbit = {{ kind = "circular", altitude_km = 500, inclination_deg = 51.7 }}
spacecraft.body.inertia_kg_m2 = [1.0255, 1.5393, 1.8172]
spacecraft.coils.limit_a_m2 = 3.2
initial.rate_deg_s = [5, 4, 3]
{LAW}
simulation = {{ duration_s = {DURATION_S}, step_s = 1.0, record_s = 20.0 }}
"""
#: Of the sensors at which the law looks: lanes read no others, a run alone reads all it has.
NOISE = """
spacecraft.magnetometer.noise_nt = 50.0
spacecraft.gyro = { noise_deg_s = 0.01, bias_drift_deg_s_sqrt_s = 1e-4 }
"""
UNREAD = "spacecraft.attitude_sensor.noise_deg = 0.01\n"
FILTER = """
spacecraft.sun_sensors.preset = "dss3"
[control.law]
kind = "bdot_rate"
gain_a_m2_s_per_t = 4e4
[control.estimator]
kind = "kalman_gyro"
sensors = ["magnetometer", "sun"]
magnetometer_noise_nt = 50.0
sun_noise_deg = 0.15
angle_random_walk_deg_sqrt_s = 0.01
rate_random_walk_deg_s_sqrt_s = 1e-4
gyro_bias_sigma_deg_s = 0.03
"""
SEVERAL = """
[spacecraft.magnetometers]
boom = { noise_nt = 50.0 }
panel = { noise_nt = 200.0 }
[spacecraft.gyros]
a = { noise_deg_s = 0.01, bias_drift_deg_s_sqrt_s = 1e-4 }
b = { noise_deg_s = 0.02 }
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
LAG = "spacecraft.coils.lag_s = 0.3\n"
AIR = """
environment.atmosphere.kind = "exponential"
spacecraft.aerodynamics.parts = [{ kind = "plate", axis = [0, 1, 1], area_m2 = 2.0, \
centre_m = [0, 0, 0.5] }]
"""
SUNLIGHT = """
disturbance.solar_pressure.parts = [{ kind = "plate", axis = [0, 1, 1], area_m2 = 20.0, \
centre_m = [0, 0, 5], specular_reflectivity = 0.3 }]
"""
WHEELS = """
[spacecraft.wheels]
layout = { kind = "regular_pyramid", count = 4, gamma_deg = 54.7 }
momentum_limit_n_m_s = 0.5
torque_limit_n_m = 0.01
coulomb_friction_n_m = 1e-4
viscous_friction_n_m_s = 1e-7
speed_noise_rpm = 1.0
minimum_speed_fraction = 0.1
[control.laws.held]
kind = "wheel_pd"
bandwidth_rad_s = 0.02
reference = "inertial"
inertia_kg_m2 = [1.0255, 1.5393, 1.8172]
[control.laws.coils]
kind = "unloading"
gain_per_s = 1e-3
"""
OWN_LAW = f"""
[control]
sample_s = 1.0
law = {{ kind = "user", file = "{EXAMPLES / "my_law.py"}", parameters = {{ gain = 4e4 }} }}
[simulation]
duration_s = {DURATION_S}
step_s = 1.0
record_s = 20.0
"""
PLAIN = SCENARIO.replace(LAW, "control.sample_s = 1.0")
ON_WHEELS = PLAIN + WHEELS
ADAPTIVE = SCENARIO.replace(", step_s = 1.0", "")
RARE = ADAPTIVE.replace("sample_s = 1.0", "sample_s = 10.0")
SLOW = ADAPTIVE.replace("[5, 4, 3]", "[0.5, 0.4, 0.3]")
CASES = {
    "RK4": SCENARIO,
    "RK4, noise of magnetometer and gyro": SCENARIO + NOISE,
    "the same, and of a sensor that no law takes": SCENARIO + NOISE + UNREAD,
    "RK4, two magnetometers, two gyros": SCENARIO + SEVERAL,
    "RK4, a law of the user's": SCENARIO[: SCENARIO.index(LAW)] + OWN_LAW,
    "RK4, noise, Kalman filter": PLAIN + NOISE + FILTER,
    "RK4, modes": PLAIN + MODES,
    "RK4, four wheels": ON_WHEELS,
    "adaptive, up to 0.7 deg/s": SLOW,
    "adaptive, up to 7 deg/s": ADAPTIVE,
    "the same, noise of magnetometer and gyro": ADAPTIVE + NOISE,
    "the same, coils with a lag": ADAPTIVE.replace("initial", LAG + "initial"),
    "the same, air": ADAPTIVE + AIR,
    "the same, sunlight with its edges": ADAPTIVE + SUNLIGHT,
    "adaptive, control every 10 s": RARE,
    "the same, coils with a lag, every 10 s": RARE.replace("initial", LAG + "initial"),
    "the same, air, every 10 s": RARE + AIR,
    "adaptive, four wheels": ON_WHEELS.replace(", step_s = 1.0", ""),
    "adaptive, four wheels, every 10 s": ON_WHEELS.replace(", step_s = 1.0", "").replace(
        "sample_s = 1.0", "sample_s = 10.0"
    ),
}
MEMBERS, ROUNDS = 64, 5


def numbers_of(lanes: Lanes, run) -> np.ndarray:
    """Members whose rates are up to the scenario's."""
    motion = np.tile(run.state.cells.view(np.float64)[:7], (MEMBERS, 1))
    motion[:, 4:] *= np.random.default_rng(1).uniform(0.05, 1.0, MEMBERS)[:, None]
    return lanes.numbers_of(motion)


def alone(scenario, piece, numbers, rotors_at) -> tuple[float, np.ndarray]:
    """Seconds of the members' stepping one by one; their motion at the end (n, 7)."""
    runs = [prepare(scenario.replace("seed", seed), piece=piece) for seed in range(MEMBERS)]
    for run, own in zip(runs, numbers, strict=True):
        run.state.cells.view(np.float64)[:7] = own[CELLS_AT : CELLS_AT + 7]
        rotors = run.state.rotors.view(np.float64)
        rotors[:] = own[rotors_at : rotors_at + len(rotors)]
    begun_s = time.process_time()
    for run in runs:
        run.advance_to(run.steps)
    taken_s = time.process_time() - begun_s
    return taken_s, np.array([run.state.cells.view(np.float64)[:7] for run in runs])


def in_lanes(lanes: Lanes, numbers, order) -> tuple[float, np.ndarray]:
    """Seconds of the members' stepping in lanes; their motion at the end (n, 7)."""
    begun_s = time.process_time()
    flown = lanes.fly(numbers[order], order)
    return time.process_time() - begun_s, flown.motion[-1, :7].T[np.argsort(order)]


def main(*names: str) -> None:
    """Print costs of a step of 1 s, and medians of their ratios, in turns; of some cases or all.

    Then how many of the members' bits at the end are those of members alone, and what the steps
    cost in attitude: of the scenario's own rate, against the same run with finer steps.
    """
    print(
        "| members | alone [ns] | in lanes [ns] | ratio | sorted by rate | same bits | "
        "error [deg] |\n|---|---|---|---|---|---|---|"
    )
    for name in names or CASES:
        scenario = scenario_from_text(CASES[name])
        run = prepare(scenario)
        lanes = Lanes(run, Pieces(run))
        rotors_at = lanes.packed.rotors_at
        numbers, order = numbers_of(lanes, run), np.arange(MEMBERS)
        by_rate = np.argsort([first_rate(own) for own in numbers])
        rounds = [
            (alone(scenario, run.piece, numbers, rotors_at), in_lanes(lanes, numbers, order),
             in_lanes(lanes, numbers, by_rate))
            for _ in range(ROUNDS + 1)
        ]  # fmt: skip
        turns = np.array([[seconds for seconds, _ in each] for each in rounds])[1:]
        (_, one), *others = rounds[-1]
        same = sum(np.array_equal(one, motion) for _, motion in others) / len(others)
        error_deg = np.degrees(float(integration_error(scenario).attitude_error.max()))
        alone_ns, lane_ns, _ = 1e9 * turns.min(axis=0) / (MEMBERS * DURATION_S)
        ratio, of_sorted = np.median(turns[:, 1:] / turns[:, :1], axis=0)
        print(
            f"| {name} | {alone_ns:.0f} | {lane_ns:.0f} | {ratio:.2f} | {of_sorted:.2f} | "
            f"{'all' if same == 1.0 else 'NO'} | {error_deg:.1g} |",
            flush=True,
        )


if __name__ == "__main__":
    main(*sys.argv[1:])
