"""SDOT 3.2: the gain of Fig. 3.11 with the gravity gradient, about 20 deg.

The text gives it as the reason for a hundred times the gain: the control torque is then of the
order of gravity's. The run of Fig. 3.11 with gravity, from 24 start arguments, in the averaged
field and in that of the direct dipole; angles are to the Sun's line, in the last 12 of 48 h.
"""

import numpy as np

from gallery.drawing import BLUE, GREEN, RED, label, level, new_figure
from gallery.entry import Answer, Entry, Verdict, chosen, consistent, lost, near, uncertain, within
from gallery.sdot_runs import AVERAGED, MU_E_T_KM3, ORBIT, RATE_RAD_S, Run, start_arguments
from torquer.maths.geometry.attitudes import to_reference
from torquer.simulation.setup.simulate import simulate

GAIN, HOURS, COUNT, LAST_H = 60.0, 48.0, 24, 36.0
DIPOLE = ({"kind": "direct_dipole", "mu_e_t_km3": MU_E_T_KM3}, AVERAGED[1])
CASES = {"averaged field": (AVERAGED, GAIN, True), "direct dipole": (DIPOLE, GAIN, True),
         "averaged, hundred times the gain": (AVERAGED, 100.0 * GAIN, True),
         "averaged, no gravity": (AVERAGED, GAIN, False)}  # fmt: skip


def angles(field, gain: float, gravity: bool) -> np.ndarray:
    """Angle of axis 3 to the Sun's line [deg] `[start, time]` in the last hours."""
    return np.array([_flown(Run(gain, start, field=field, hours=HOURS), gravity)
                     for start in start_arguments(COUNT, 180.0)])  # fmt: skip


def _flown(run: Run, gravity: bool) -> np.ndarray:
    result = simulate(run.scenario().replace("environment.gravity_gradient", gravity))
    axis = to_reference(result["q_body_to_inertial"].values, np.array([0.0, 0.0, 1.0]))
    off = np.degrees(np.arccos(np.clip(np.abs(axis @ run.sun_inertial), 0.0, 1.0)))
    return off[result["time"].values > 3600.0 * LAST_H]


def torque_ratio() -> float:
    """Greatest control torque k |omega| B over gravity's 3/2 omega0^2 (C - A), at the start."""
    b = 1e9 * MU_E_T_KM3 / ORBIT.radius_m**3
    control = GAIN * float(np.linalg.norm(RATE_RAD_S)) * b
    return control / (1.5 * ORBIT.rate_rad_s() ** 2 * (1.8172 - 1.025))


def compute() -> Answer:
    """Angles with and without gravity, and with the gain of Fig. 3.12."""
    found = {name: angles(*case) for name, case in CASES.items()}
    median = {name: float(np.median(each)) for name, each in found.items()}
    first, dipole, strong, calm = median.values()
    checks = (
        uncertain(chosen(near("averaged field: median angle of axis 3 to the Sun's line", "20",
                              first, "deg", 5.0, "about 20 deg")), 0.5),
        uncertain(chosen(near("direct dipole: the same", "20", dipole, "deg", 5.0,
                              "about 20 deg")), 0.5),
        within("greatest control torque at the start over gravity's", "of the order of gravity's",
               torque_ratio(), 0.1, 10.0),
        uncertain(within("a hundred times the gain: the same angle", "accuracy is to be increased",
                         strong, high=first, unit="deg"), 0.5),
        consistent(within("without gravity: the same angle", "Fig. 3.11: tends to zero", calm,
                          high=0.5, unit="deg")),
        uncertain(lost("averaged field, starts' medians: greatest",
                       np.median(found["averaged field"], axis=1).max(), "deg"), 0.5),
    )  # fmt: skip
    text = "; ".join(
        f"{name}: {np.median(each, axis=1).min():.1f} to {np.median(each, axis=1).max():.1f} deg"
        for name, each in found.items()
    )
    note = (
        f"Medians of the last {HOURS - LAST_H:.0f} of {HOURS:.0f} h over {COUNT} start arguments, "
        f"which are not printed: {text}."
    )
    return Answer(checks, {"": picture(found)}, note)


def picture(found: dict):
    """Distribution of the angle over starts and times."""
    figure, (axes,) = new_figure("S-dot with k = 60 and gravity (SDOT 3.2)", height=3.8)
    names = list(CASES)[:3]
    for colour, name in zip((BLUE, GREEN, RED), names, strict=True):
        values = np.sort(found[name].ravel())
        axes.plot(values, np.linspace(0.0, 1.0, values.size), color=colour, lw=1.3, label=name)
    axes.axvline(20.0, color="#555555", lw=0.9, ls=(0, (5, 3)))
    level(axes, 0.5, "median")
    axes.set(xlim=(0.0, 60.0), ylim=(0.0, 1.0))
    label(axes, "axis 3 to the Sun's line in the last 12 h [deg]; dashed: printed",
          "part of starts and time")  # fmt: skip
    return figure


ENTRY = Entry(
    ids=("SDOT-gravity",),
    compute=compute,
    declared=Verdict.CHOSEN,
    reason="the argument of latitude at the start is not printed",
    slow=True,
)
