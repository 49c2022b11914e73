"""Hold an attitude by coils alone in spite of a residual dipole: how much does a trim help?

python examples/trim_residual_dipole.py [STARTS]   (64 unless given; minutes)

Starts with any attitude and up to 1 deg/s, fifteen revolutions in IGRF-14. Each start counts by its
mean error over the last two. A residual dipole stands for three equal components. Standard errors
are those of the bootstrap.
"""

import sys
from pathlib import Path

import numpy as np

import torquer
from torquer.campaign.fly import fly_campaign
from torquer.campaign.spec import Campaign
from torquer.theory import (
    AttitudeHold,
    Cycle,
    DesignTask,
    SampledHold,
    design_gains,
)

SCENARIO = torquer.load_scenario(Path(__file__).parent / "residual_dipole.toml")
LAWS = SCENARIO.control.laws
RESIDUAL = "spacecraft.coils.residual_dipole_a_m2"
#: Components of the residual dipole [mA m^2].
DIPOLES = (0.0, 1.0, 2.0, 5.0, 10.0, 20.0)
REVOLUTIONS, COUNTED, WITHIN_DEG = 15, 2, 10.0
RATES = {"direction": "uniform", "magnitude": {"uniform": [0.0, 1.0]}}
ANY = {"initial.attitude": "uniform", "initial.rate_deg_s": RATES}
#: Starts that are not upside down, where gravity's gradient may keep them, dipole or not.
UPRIGHT = {f"initial.euler_deg[{axis}]": {"uniform": [-45.0, 45.0]} for axis in range(3)}
#: Moments of inertia as the trim knows them, over the true ones.
WRONG_INERTIA = {"+10, +10, -10 %": (1.1, 1.1, 0.9), "-10, -10, +10 %": (0.9, 0.9, 1.1)}


def regulator(field: str) -> dict:
    """The periodic regulator for the satellite, with the field model that the designer has."""
    scenario = SCENARIO.replace("environment.field", {"kind": field})
    hold = AttitudeHold.of_scenario(scenario, LAWS["hold"].law())
    sampled = SampledHold(hold, Cycle.of_control(scenario.control))
    found = design_gains(DesignTask(sampled, float(scenario.spacecraft.coils.limit_a_m2)))
    return found.regulator.law.spec.model_dump(mode="json")


def errors(
    hold: dict, trim: dict | None, dipole_ma_m2: float, starts: int, vary=ANY, **keys
) -> np.ndarray:
    """Mean errors [deg] at the end of all starts; `keys`: other tables of the spacecraft."""
    scenario = SCENARIO.replace("control.laws", {"hold": hold} | ({"trim": trim} if trim else {}))
    scenario = scenario.replace(RESIDUAL, [1e-3 * dipole_ma_m2] * 3)
    scenario = scenario.replace("simulation.revolutions", REVOLUTIONS)
    for name, value in keys.items():
        scenario = scenario.replace(f"spacecraft.{name}", value)
    after_s = (REVOLUTIONS - COUNTED) * scenario.orbit.period_s
    error = {"signal": "attitude_error_deg", "what": {"mean_after_s": after_s}}
    campaign = {
        "runs": starts, "seed": 1, "outcomes": {"error_deg": error},
        "vary": vary,
    }  # fmt: skip
    return fly_campaign(scenario, Campaign.model_validate(campaign)).error_deg.values


def with_error(values, part: float) -> str:
    """A quantile of the starts with its standard error."""
    drawn = np.random.default_rng(1).choice(values, (2000, len(values)))
    spread = np.quantile(drawn, part, axis=1).std()
    return f"{np.quantile(values, part):6.1f} +- {spread:4.1f}"


def line(*said, values) -> None:
    """A line of the table."""
    held = f"{np.sum(values < WITHIN_DEG):4d} of {len(values)}"
    print("".join(f"{each:<22}" for each in said), end="")
    print(f"{with_error(values, 0.5)}  {with_error(values, 0.9)}  {held}", flush=True)


def table_of_dipoles(holds: dict, trim: dict, starts: int) -> None:
    """With and without the trim."""
    print("".join(f"{x:<22}" for x in ("hold", "dipole, mA m^2", "trim")), "median, 90 %, held")
    for name, hold in holds.items():
        for dipole in DIPOLES:
            for said, each in (("none", None), ("dipole_trim", trim)):
                line(name, f"{dipole:g}", said, values=errors(hold, each, dipole, starts))


def table_of_doubts(holds: dict, trim: dict, starts: int) -> None:
    """What is not as the laws know it."""
    print("\nwith the trim, 5 mA m^2")
    devices = {
        "gyro": {"noise_deg_s": 0.005, "bias_deg_s": [1e-3, -1e-3, 1e-3]},
        "attitude_sensor": {"noise_deg": 0.2},
        "magnetometer": {"noise_nt": 300, "bias_nt": [500, -500, 500]},
    }
    for name, hold in holds.items():
        line(name, "starts", "upright", values=errors(hold, trim, 5.0, starts, UPRIGHT))
        for said, factors in WRONG_INERTIA.items():
            known = (np.diagonal(np.array(trim["inertia_kg_m2"])) * factors).tolist()
            wrong = trim | {"inertia_kg_m2": known}
            line(name, "inertia", said, values=errors(hold, wrong, 5.0, starts))
        line(name, "sensors", "with errors", values=errors(hold, trim, 5.0, starts, **devices))
        plain = errors(hold, None, 0.0, starts, **devices)
        line(name, "sensors", "no dipole, no trim", values=plain)
    by_dipole = regulator("direct_dipole")
    line("regulator", "field", "gains for a dipole", values=errors(by_dipole, trim, 5.0, starts))


def main(starts: int) -> None:
    """Both tables."""
    trim = LAWS["trim"].model_dump(mode="json")
    holds = {"three_axis": LAWS["hold"].model_dump(mode="json"), "regulator": regulator("igrf14")}
    table_of_dipoles(holds, trim, starts)
    table_of_doubts(holds, trim, starts)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 64)
