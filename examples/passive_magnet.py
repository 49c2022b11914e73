"""A bar magnet and hysteresis rods: how soon does a CubeSat follow the field, and how well?

python examples/passive_magnet.py       (seconds; writes passive-magnet.png)

Draws the angle between magnet and field, and the rate, of `passive_magnet.toml` with no rods, with
one, three and six on each axis across the magnet.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import torquer
from torquer.maths.geometry.attitudes import to_body

EXAMPLE = torquer.load_scenario(Path(__file__).with_name("passive_magnet.toml"))
COUNTS = {0: "0.7", 1: "C0", 3: "C1", 6: "C2"}


def with_rods(count: int) -> torquer.Scenario:
    """The example with so many rods on each axis."""
    if count == 0:
        return EXAMPLE.replace("spacecraft.hysteresis_rods", ())
    found = EXAMPLE
    for k in range(2):
        found = found.replace(f"spacecraft.hysteresis_rods[{k}].count", count)
    return found


def fly(count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time [days], angle from the field [deg], rate [deg/s]."""
    result = torquer.simulate(with_rods(count))
    b = to_body(result["q_body_to_inertial"].values, result["b_inertial"].values)
    angle = np.degrees(np.arccos(b[:, 0] / np.linalg.norm(b, axis=1)))
    rate = np.degrees(np.linalg.norm(result["omega_body"].values, axis=1))
    return result["time"].values / 86400.0, angle, rate


def main() -> None:
    """The picture, and the numbers of the last day."""
    figure, (above, below) = plt.subplots(2, 1, figsize=(8.0, 6.0), sharex=True)
    for count, colour in COUNTS.items():
        t, angle, rate = fly(count)
        name = f"{count} rods on each axis"
        above.plot(t[::8], angle[::8], color=colour, lw=0.6, label=name)
        below.plot(t, rate, color=colour, lw=1.0, label=name)
        last = angle[t >= t[-1] - 1.0]
        print(
            f"{name}: last day {np.median(last):.1f} deg (median), {last.max():.1f} deg "
            f"(greatest), {rate[-1]:.2f} deg/s"
        )
    above.set_ylabel("magnet to field [deg]")
    below.set(ylabel="rate [deg/s]", xlabel="time [days]", xlim=(0.0, 14.0), ylim=(0.0, None))
    below.legend(loc="upper right", bbox_to_anchor=(1.0, 0.9))
    figure.tight_layout()
    figure.savefig("passive-magnet.png", dpi=100)


if __name__ == "__main__":
    main()
