"""When should coils unload the wheels: all the time, from a threshold on, or on parts of the orbit?

python examples/compare_unloading.py [REVOLUTIONS]   (15 unless given: a day)

The satellite of `looks_at_a_station.toml` with each policy: energy of the coils, part of the time
in which they work, greatest total momentum of the wheels and of one wheel, and the attitude error:
that from the attitude which the law steers, root of the mean square and the 90 % quantile.
"""

import sys
from pathlib import Path

import numpy as np

import torquer

SCENARIO = torquer.load_scenario(Path(__file__).parent / "looks_at_a_station.toml")
#: Keys of the law `unloading`, by what the policy is called.
POLICIES = {
    "none": {"gain_per_s": 1e-12},
    "continuous": {},
    "threshold": {"begin_n_m_s": 2e-3, "dead_band_n_m_s": 5e-4},
    "at the nodes": {"window_deg": 30.0},
    "at high latitudes": {"window_deg": 30.0, "window_centre_deg": 90.0},
}
HEAD = ("policy", "energy, J", "on, %", "total, mN m s", "wheel, mN m s", "error, deg", "90 %")
#: Until then the wheels take up their bias, and the first slew begins [s].
BEGIN_S = 600.0


def measures(result) -> tuple[float, ...]:
    """What the table shows of a flight."""
    rows = result.time.values.astype(float) > BEGIN_S
    error_deg = torquer.derive(result)["commanded_error"].values[rows]
    each = 1e3 * result.wheel_momentum.values[rows]
    axes = np.array(SCENARIO.spacecraft.wheels.layout.rows())
    on = np.any(result.command_body.values[rows] != 0.0, axis=1)
    total = np.linalg.norm(each @ axes, axis=1)
    rms_deg, most_deg = np.sqrt(np.mean(error_deg**2)), np.quantile(error_deg, 0.9)
    return (
        float(result.coil_energy), 100.0 * on.mean(), total.max(), np.abs(each).max(),
        rms_deg, most_deg,
    )  # fmt: skip


def main(revolutions: float) -> None:
    """The table."""
    print("".join(f"{each:<19}" for each in HEAD))
    scenario = SCENARIO.replace("simulation.revolutions", revolutions)
    for name, keys in POLICIES.items():
        law = {"kind": "unloading", "gain_per_s": 1e-3, **keys}
        result = torquer.simulate(scenario.replace("control.laws.unload", law))
        print(f"{name:<19}" + "".join(f"{each:<19.3g}" for each in measures(result)), flush=True)


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 15.0)
