"""MAG Figs. 5.2.1, 5.2.2: B-dot on the test bench of Appendix II, and what it says of the orbit.

The text prints field, dipole, initial rate, and the greatest disturbance torques (Table II.1). Its
control cycle, gain, mass, and the directions of the torques are chosen here, as in
`examples/bench.toml`; the inertia is a quarter of the satellite's. In orbit the whole satellite
flies under the same law and cycle from the same rate.
"""

from pathlib import Path

import numpy as np

from gallery.drawing import BLUE, GREEN, RED, label, level, new_figure
from gallery.entry import Answer, Entry, Grade, Verdict, chosen, graded, near, within
from torquer import load_scenario
from torquer.analysis.budget import budget_along_run
from torquer.design.bench_scaling import scaling
from torquer.scenario.load import scenario_from_data
from torquer.simulation.setup.simulate import simulate

EXAMPLE = Path(__file__).parents[2] / "examples" / "bench.toml"
ORBIT = {"kind": "circular", "altitude_km": 500.0, "inclination_deg": 51.7}
#: What the suspension lacks in further runs; the balanced body hangs as low as the greatest
#: imbalance of Table II.1 allows.
_VERTICAL = ("vertical_torque_n_m", 0.0)
_IMBALANCE = (("centre_of_mass_m", (0.0, 0.0, -2.04e-6)), ("warm_up_shift_m", (0.0, 0.0, 0.0)))
STOPPED_DEG_S, STEADY_S = 1.0, 1200.0


def in_orbit(bench, gain=1.0):
    """The satellite in orbit under the law of the bench, its gain times a factor, without
    disturbances but gravity."""
    data = bench.model_dump(mode="json", exclude_unset=True)
    del data["disturbance"], data["mission"]
    data["control"]["law"]["gain_a_m2_s_per_t"] *= gain
    data["orbit"], data["environment"] = ORBIT, {"field": {"kind": "igrf14"}}
    data["spacecraft"]["body"] = {"preset": "chibis_m_body"}
    data["simulation"] = {"duration_s": 36000.0, "record_s": 10.0}
    return scenario_from_data(data)


def rate_deg_s(result) -> np.ndarray:
    """Absolute rate [deg/s]."""
    return np.degrees(np.linalg.norm(result["omega_body"].values, axis=1))


def stopped_s(result) -> float:
    """When the rate is below `STOPPED_DEG_S` for good."""
    above = rate_deg_s(result) >= STOPPED_DEG_S
    return float(result["time"].values[len(above) - np.argmax(above[::-1])])


def end_deg_s(scenario, *changes) -> float:
    """Mean rate of the last 300 s with other values at some keys."""
    for key, value in changes:
        scenario = scenario.replace(f"disturbance.suspension.{key}", value)
    result = simulate(scenario)
    return float(rate_deg_s(result)[result["time"].values > STEADY_S].mean())


def compute() -> Answer:
    """The bench for 1500 s, and the satellite in orbit for ten hours."""
    scenario = load_scenario(EXAMPLE)
    bench, orbit = simulate(scenario), simulate(in_orbit(scenario))
    t, rate, dipole = bench["time"].values, rate_deg_s(bench), np.abs(bench["dipole_body"].values)
    early, late = t < 500.0, t > STEADY_S
    horizontal, vertical = dipole[:, :2].max(axis=1), dipole[:, 2]
    field = np.linalg.norm(orbit["b_inertial"].values, axis=1)
    times = scaling(4.0, 0.1)
    own = scaling(4.0, float(field.mean()) / 1e-4)
    checks = (
        chosen(within("time from 15 deg/s to below 1 deg/s", "about 700 s", stopped_s(bench),
                      600.0, 850.0, "s")),
        graded(chosen(within("rate then, mean of 300 s", "about 0.6 deg/s", rate[late].mean(), 0.5,
                             0.7, "deg/s")), Grade.OPEN),
        within("vertical coil over the horizontal ones in the first 500 s",
               "mainly the horizontal coils", vertical[early].mean() / horizontal[early].mean(),
               high=0.5),
        near("scaling: a tenth of the field, four times the inertia, 10 min", "400",
             10.0 * times.saturated, "min"),
        within("field of the bench over that at 500 km", "about 10",
               1e-4 / field.mean(), 7.0, 13.0),
        chosen(within("time in orbit from 15 deg/s to below 1 deg/s", "about 400 min",
                      stopped_s(orbit) / 60.0, 300.0, 500.0, "min")),
    )  # fmt: skip
    torques = budget_along_run(bench).disturbance
    suspension = np.linalg.norm(torques["suspension"], axis=1).max()
    without = [end_deg_s(scenario, *keys) for keys in ((_VERTICAL,), _IMBALANCE)]
    stronger = simulate(in_orbit(scenario, 10.0))
    note = (
        f"The rate at 1500 s is {rate[-1]:.2f} deg/s. Weight and friction reach {suspension:.1e} "
        "N m; Table II.1 has 4e-4 N m for imbalance and as much for heating, of a body that does "
        "not hang level. Without the bearing's torque about the vertical the mean rate at the end "
        f"is {without[0]:.2f} deg/s, with a balanced body {without[1]:.2f} deg/s. With the mean "
        f"field of the orbit, {1e9 * field.mean():.0f} nT, the text's argument gives "
        f"{stopped_s(bench) * own.saturated / 60.0:.0f} min from the time of the bench; with ten "
        f"times the gain the satellite needs {stopped_s(stronger) / 60.0:.0f} min."
    )
    return Answer(checks, figures(t, rate, bench["dipole_body"].values), note)


def figures(t, rate, dipole) -> dict:
    """Rate (Fig. 5.2.1) and dipoles of the coils (Fig. 5.2.2)."""
    damping, (upper,) = new_figure("B-dot on a test bench (MAG Fig. 5.2.1)")
    upper.plot(t, rate, color=BLUE, lw=1.3)
    level(upper, 0.6, "0.6 deg/s")
    label(upper, "time [s]", "rate [deg/s]", legend=False)
    coils, (lower,) = new_figure("Dipoles of the coils on the bench (MAG Fig. 5.2.2)")
    for k, (name, colour) in enumerate((("x", BLUE), ("y", GREEN), ("z, vertical", RED))):
        lower.plot(t, dipole[:, k], color=colour, lw=0.7, label=name)
    label(lower, "time [s]", "dipole [A m²]")
    return {"rate": damping, "coils": coils}


ENTRY = Entry(
    ids=("MAG-5.2.1", "MAG-5.2.2"),
    compute=compute,
    declared=Verdict.DIFFERS,
    grade=Grade.REFUTED,
    reason=(
        "with the cycle and the gain chosen here the rotation stops in the printed time, by the "
        "horizontal coils. The rate that is left is 0.4 deg/s in the mean, 0.6 at times, and is "
        "mainly due to the bearing's torque about the vertical, as trials without this torque and "
        "without the imbalance show. The field of the bench is three times that at 500 km, not ten "
        "times: the printed 400 min follow from ten. In orbit the whole satellite needs about that "
        "time nevertheless: with the gain of the bench its coils work below their limits in the "
        "weaker field, where the time goes with 1/B^2"
    ),
    slow=True,
)
