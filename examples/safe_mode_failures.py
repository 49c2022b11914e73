"""What are the guards of a safe mode worth? Faults injected, each flown with its guard and without.

python examples/safe_mode_failures.py    (prints a table; writes safe-mode.png)
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy.spatial.transform import Rotation

import torquer

HERE = Path(__file__).parent
FROM_10_H = {"from_s": 36000.0}
SILENT, ZEROS = [{"kind": "silent", **FROM_10_H}], [{"kind": "zeros", **FROM_10_H}]
ON_X3 = {"axes": [[0, 0, 1]], "half_field_deg": 45.0, "noise_deg": 0.1}
#: Each fault: the guard against it, and the key and value that make it.
FAULTS = {
    "two coils the wrong way round": ("growth", "spacecraft.coils.polarity", [1, -1, -1]),
    "magnetometer silent from 10 h on": (
        "magnetometer",
        "spacecraft.magnetometer.failures",
        SILENT,
    ),
    "magnetometer zeros from 10 h on": ("field", "spacecraft.magnetometer.failures", ZEROS),
    "one Sun sensor left, on x3": ("sun", "spacecraft.sun_sensors", ON_X3),
}


def unguarded(scenario, region):
    """The scenario with a guard that stays in its first state."""
    states = scenario.control.modes.regions[region].states
    idle = {"states": {name: {"final": True} for name in states}}
    return scenario.replace(f"control.modes.regions.{region}", idle)


def rates_deg_s(flown):
    """Absolute rate over time."""
    return np.degrees(np.linalg.norm(flown.omega_body.values, axis=1))


def to_sun_deg(flown):
    """Angle of the third axis to the Sun over time."""
    axis = Rotation.from_quat(flown.q_body_to_inertial.values).as_matrix()[:, :, 2]
    sun = flown.sun_inertial.values
    cosine = np.sum(axis * sun, axis=1) / np.linalg.norm(sun, axis=1)
    return np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))


def row(name, flown):
    """A row of the table: rate at the end, mean angle to the Sun in the last 6 h, energy."""
    last = flown.time.values > flown.time.values[-1] - 6.0 * 3600.0
    return (
        f"{name:50s} {rates_deg_s(flown)[-1]:6.2f} deg/s "
        f"{to_sun_deg(flown)[last].mean():6.1f} deg {float(flown.coil_energy) / 1e3:7.2f} kJ"
    )


def main():
    """Fly everything; a row each, rates and angles in a picture."""
    sound = torquer.load_scenario(HERE / "safe_mode.toml")
    print(f"{'':50s} rate at end  axis to Sun  energy")
    print(row("no fault", torquer.simulate(sound)))
    figure, axes = plt.subplots(2, 4, figsize=(14, 6), layout="constrained", sharex=True)
    for (name, (guard, key, value)), (above, below) in zip(FAULTS.items(), axes.T, strict=True):
        faulty = sound.replace(key, value)
        for text, scenario in (("without", unguarded(faulty, guard)), ("with", faulty)):
            flown = torquer.simulate(scenario)
            print(row(f"{name}, {text} guard", flown))
            hours, look = flown.time / 3600.0, {"label": f"{text} guard", "linewidth": 0.8}
            above.plot(hours, rates_deg_s(flown), **look)
            below.plot(hours, to_sun_deg(flown), **look)
        above.set(title=name, ylabel="rate [deg/s]", yscale="log", ylim=(0.1, 100.0))
        below.set(xlabel="time [h]", ylabel="x3 to the Sun [deg]", ylim=(0, 180))
    axes[0, 0].legend()
    figure.savefig("safe-mode.png", dpi=120)


if __name__ == "__main__":
    main()
