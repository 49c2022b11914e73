"""MAG Fig. 3.1.3: B-dot with two coils of three, the body of Chibis-M.

The text gives no gain and no field model. Taken here: a gain that keeps the coils of 3.2 A m^2 at
their limit while the body tumbles (at 5e6 A m^2 s/T down to about 0.1 deg/s), IGRF-14 in March
2012, body axes on the inertial ones at the start, at the ascending node; a few other nodes and
attitudes are run as well, and gains of a third and of three times as much: what the text says must
hold for all of them.
"""

import numpy as np

from gallery.drawing import COLOURS, label, new_figure
from gallery.entry import Answer, Entry, within
from torquer.scenario.load import scenario_from_data
from torquer.simulation.setup.simulate import simulate

COILS = {"three coils": np.eye(3).tolist(), "two coils": np.eye(3)[:2].tolist()}
#: Other starts: attitude (3-2-1) and node [deg].
STARTS = (((0.0, 0.0, 0.0), 0.0), ((40.0, 70.0, 10.0), 60.0), ((-80.0, 20.0, 130.0), 120.0),
          ((150.0, -40.0, 60.0), 200.0), ((10.0, 30.0, -100.0), 290.0))  # fmt: skip
SLOW_DEG_S = 0.5
#: Gains [A m^2 s/T], the one shown first.
GAINS = (5e6, 5e6 / 3.0, 1.5e7)


def scenario(coils: str, start=STARTS[0], gain=GAINS[0]):
    """The text's run with two coils or three."""
    return scenario_from_data({
        "start": "2012-03-01T00:00:00Z",
        "orbit": {"kind": "circular", "radius_km": 6850.0, "inclination_deg": 51.7,
                  "raan_deg": start[1]},
        "spacecraft": {"body": {"inertia_kg_m2": [1.02, 1.51, 1.73]},
                       "coils": {"limit_a_m2": 3.2, "axes": COILS[coils]}},
        "initial": {"rate_deg_s": [10.0, 10.0, 10.0], "euler_deg": list(start[0])},
        "control": {"law": {"kind": "bdot_derivative", "gain_a_m2_s_per_t": gain}, "sample_s": 1.0},
        "simulation": {"duration_s": 15000.0, "record_s": 10.0},
    })  # fmt: skip


def course(coils: str, start=STARTS[0], gain=GAINS[0]):
    """Time [s] and rates [deg/s] in the body."""
    result = simulate(scenario(coils, start, gain))
    return result["time"].values, np.degrees(result["omega_body"].values)


def slow_after(course) -> tuple[float, np.ndarray]:
    """When the whole rate and each component are below the limit for good [s]; inf if they stay
    above."""
    t_s, rates = course
    whole = np.linalg.norm(rates, axis=1)
    t_s = np.where(t_s < t_s[-1], t_s, np.inf)
    each = [t_s[np.flatnonzero(np.abs(column) > SLOW_DEG_S)[-1]] for column in rates.T]
    return float(t_s[np.flatnonzero(whole > SLOW_DEG_S)[-1]]), np.array(each)


def longer_with_two(gain: float) -> np.ndarray:
    """Time to the limit with two coils over that with three, by start."""
    times = [[slow_after(course(coils, s, gain))[0] for s in STARTS] for coils in COILS]
    return np.divide(times[1], times[0])


def left_after(run) -> float:
    """Rate at the end [deg/s], mean of the last records."""
    return float(np.linalg.norm(run[1], axis=1)[-100:].mean())


def compute() -> Answer:
    """Both coil sets from one start for the picture; five starts for the times."""
    shown = {coils: course(coils) for coils in COILS}
    left = [left_after(course("two coils", gain=gain)) for gain in GAINS]
    longer = [longer_with_two(gain) for gain in GAINS]
    medians = [float(np.median(each)) for each in longer]
    each = slow_after(shown["two coils"])[1]
    checks = (
        within("two coils: rate after 15 000 s, greatest of three gains",
               "damping is still possible", max(left), high=0.25, unit="deg/s"),
        within("time to 0.5 deg/s, two coils over three, median of five starts, least of three "
               "gains", "the speed may go down", min(medians), low=1.02),
    )  # fmt: skip
    figure, axes = new_figure("B-dot with three coils and with two (MAG Fig. 3.1.3)", 2, 5.6)
    for panel, (coils, (t_s, rates)) in zip(axes, shown.items(), strict=True):
        for i in range(3):
            panel.plot(t_s, rates[:, i], color=COLOURS[i], lw=0.9, label=f"axis {i + 1}")
        last = panel is axes[-1]
        label(panel, "time [s]" if last else "", f"rate, {coils} [deg/s]", legend=not last)
        panel.set_xlim(0.0, 12000.0)
    note = (
        f"Two coils took {', '.join(f'{x:.2f}' for x in longer[0])} times as long from the five "
        f"starts. From the first, shown, the components with two coils were below 0.5 deg/s after "
        f"{each[0]:.0f}, {each[1]:.0f} and {each[2]:.0f} s. Gain and field model are not given in "
        f"the text: with gains of {', '.join(f'{gain:.2g}' for gain in GAINS)} A m^2 s/T the "
        f"medians are {', '.join(f'{x:.2f}' for x in medians)}, and two coils leave "
        f"{', '.join(f'{x:.2f}' for x in left)} deg/s."
    )
    return Answer(checks, {"": figure}, note)


ENTRY = Entry(ids=("MAG-3.1.3",), compute=compute)
