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
from torquer.report.common.colours import BLUE, GREEN, GREY, RED
from torquer.report.common.figure import quiet

EXAMPLE = torquer.load_scenario(Path(__file__).with_name("passive_magnet.toml"))
COUNTS = {0: GREY, 1: BLUE, 3: RED, 6: GREEN}
NAMES = {0: "no rods", 1: "one rod on each axis", 3: "three rods", 6: "six rods"}
#: Records of which the picture shows the median angle: those of six hours.
WINDOW = 360


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
    figure, (above, below) = plt.subplots(2, 1, figsize=(8.0, 6.0), sharex=True,
                                          layout="constrained")  # fmt: skip
    for count, colour in COUNTS.items():
        t, angle, rate = fly(count)
        name = NAMES[count]
        rows = np.arange(len(angle) // WINDOW * WINDOW).reshape(-1, WINDOW)
        above.plot(t[rows].mean(axis=1), np.median(angle[rows], axis=1), color=colour, label=name)
        below.plot(t, rate, color=colour, lw=1.0, label=name)
        last = angle[t >= t[-1] - 1.0]
        print(
            f"{name}: last day {np.median(last):.1f} deg (median), {last.max():.1f} deg "
            f"(greatest), {rate[-1]:.2f} deg/s"
        )
    above.set(ylabel="magnet to field,\nmedian of 6 h [deg]", ylim=(0.0, None))
    below.set(ylabel="rate [deg/s]", xlabel="time [days]", xlim=(0.0, 14.0), ylim=(0.0, None))
    for axes in (above, below):
        quiet(axes)
    figure.legend(*below.get_legend_handles_labels(), loc="outside upper left", ncols=4,
                  frameon=False)  # fmt: skip
    figure.savefig("passive-magnet.png", dpi=100)


if __name__ == "__main__":
    main()
