"""The dozen of examples/satellites: gain, time to stop promised and flown, attitude hold, causes.

Each satellite flies the campaign of its file: 64 releases. Then the law that `torquer design
three-axis` refines for it holds it from 64 starts, with what the data sheet leaves open drawn as
in the file; and once more without the cause that theory names first. Satellites with wheels slew,
and have a pointing budget. `docs/satellites.md` is made of what this writes: `python
benchmarks/satellites.py [NAME ...]`, a quarter of an hour for all.
"""

from __future__ import annotations

import json
import math
import sys
import warnings
from pathlib import Path

import numpy as np

from torquer.campaign.capture import flight
from torquer.campaign.fly import OneByOne, fly_campaign
from torquer.campaign.load import campaign_from_data, load_campaign
from torquer.campaign.plain import with_flat_keys
from torquer.campaign.statistics import quantile
from torquer.design import DetumbleRequest, PointingRequest, pointing_budget, three_axis
from torquer.design.detumbling import without_flights
from torquer.design.mission_pointing import fly_laws
from torquer.scenario.change import with_values
from torquer.scenario.toml_text import parse_toml

HERE = Path(__file__).parent
FILES = HERE.parent / "examples/satellites"
FOUND, FOUND_WHEELS = HERE / "satellites.json", HERE / "satellites_with_wheels.json"
#: Flights of a pointing budget.
BUDGET_FLIGHTS = 64
#: Control step and integration step of a hold [s]; greatest rate at its start [deg/s]; revolutions
#: flown, and those at their end of which the mean error is taken; error up to which it holds [deg].
SAMPLE_S, STEP_S, RATE_DEG_S, REVOLUTIONS, LAST, HELD_DEG = 4.0, 2.0, 0.2, 10.0, 2.0, 30.0
_DIPOLE = "spacecraft.coils.residual_dipole_a_m2"
_AIR = {"environment.atmosphere": None, "spacecraft.aerodynamics": None, "disturbance": None}
#: What is changed without a cause, and what of the campaign no longer varies.
WITHOUT = {
    "nothing": ({}, ()),
    "dipole": ({_DIPOLE: [0.0, 0.0, 0.0]}, (_DIPOLE,)),
    "air_and_light": (_AIR, ("environment.atmosphere.f107", "correlated")),
}
WITHOUT["both"] = tuple(
    a | b if isinstance(a, dict) else a + b
    for a, b in zip(WITHOUT["dipole"], WITHOUT["air_and_light"], strict=True)
)


def stopping(scenario, campaign) -> dict:
    """Gain, time by theory, and of the releases flown."""
    rate, gain = campaign.vary["initial.rate_deg_s"].magnitude, scenario.control.law
    gain = gain.gain_a_m2_s_per_t
    wanted = DetumbleRequest(tip_off_deg_s=rate.values[0])
    promised = quantile(without_flights(scenario, wanted).releases_by_theory_s(gain), 0.5)
    settled = fly_campaign(scenario, campaign).settling_s.values
    settled = np.where(np.isnan(settled), np.inf, settled)
    return {
        "gain_a_m2_s_per_t": gain,
        "promised_s": promised,
        "flown_s": quantile(settled, 0.5),
        "flown_90_s": quantile(settled, 0.9),
        "stopped": int(np.isfinite(settled).sum()),
    }


def holding(scenario, data: dict) -> dict:
    """Errors flown by the law refined for the satellite: of all causes, and without some."""
    scenario = scenario.replace("control.sample_s", SAMPLE_S).replace("simulation.step_s", STEP_S)
    candidate = three_axis(scenario).candidates["refined"]
    held = flight(scenario, candidate.law, REVOLUTIONS, period_s(scenario))
    gains = candidate.law.spec.model_dump(mode="json")
    return {
        "rate_gain_n_m_s_per_t2": gains["rate_gain_n_m_s_per_t2"],
        "angle_gain_n_m_per_t2": gains["angle_gain_n_m_per_t2"],
        "without": {name: errors(held, data, *cause) for name, cause in WITHOUT.items()},
    }


def errors(scenario, data: dict, changes: dict, still: tuple[str, ...]) -> dict:
    """Starts that are held; median of the mean errors of all over the last revolutions, and of
    those that are held [deg]."""
    scenario = with_values(scenario, changes) if changes else scenario
    found = fly_campaign(scenario, flown_campaign(scenario, data, still)).error_deg.values
    found = np.where(np.isnan(found), 180.0, found)
    held = found[found < HELD_DEG]
    return {
        "held": len(held),
        "median_deg": quantile(found, 0.5),
        "held_deg": quantile(held, 0.5) if len(held) else None,
    }


def flown_campaign(scenario, data: dict, still: tuple[str, ...]):
    """The campaign of a file with starts at rest, and the error as its outcome."""
    table = with_flat_keys(data["campaign"])
    vary = {key: value for key, value in table["vary"].items() if key not in still}
    slow = {"uniform": [0.0, RATE_DEG_S]}
    vary["initial.rate_deg_s"] = {"direction": "uniform", "magnitude": slow}
    late_s = (REVOLUTIONS - LAST) * period_s(scenario)
    error = {"signal": "attitude_error_deg", "what": {"mean_after_s": late_s}}
    table = {**table, "vary": vary, "outcomes": {"error_deg": error}}
    if "correlated" in still:
        del table["correlated"]
    return campaign_from_data(table, scenario)


def period_s(scenario) -> float:
    """Time of a revolution."""
    return 2.0 * math.pi / scenario.orbit.rate_rad_s(scenario.start)


def stops(path: Path) -> dict:
    """How long the releases of a file tumble, also without a residual dipole."""
    scenario, campaign = load_campaign(path)
    vary = {key: each for key, each in campaign.vary.items() if key != _DIPOLE}
    without = campaign.model_copy(update={"vary": vary})
    return {
        "mass_kg": scenario.spacecraft.body.mass_kg,
        "dipole_a_m2": float(np.linalg.norm(scenario.spacecraft.coils.residual_dipole_a_m2)),
        "stop": stopping(scenario, campaign),
        "stop_without_dipole": stopping(scenario.replace(_DIPOLE, [0.0, 0.0, 0.0]), without),
    }


def holds(path: Path) -> dict:
    """How well it is held by coils alone."""
    data = parse_toml(path.read_text(encoding="utf-8"), "scenario")
    return {"hold": holding(load_campaign(path)[0], data)}


def with_wheels(path: Path) -> dict:
    """A slew and the hold after it by wheels, and the pointing budget."""
    scenario = load_campaign(path)[0]
    flown = fly_laws(scenario)
    total = pointing_budget(scenario, PointingRequest(flights=BUDGET_FLIGHTS)).total
    (limit,) = flown.summary["verdict"]["goals"]
    wheels = scenario.spacecraft.wheels
    return {
        "mass_kg": scenario.spacecraft.body.mass_kg,
        "momentum_n_m_s": wheels.momentum_limit_n_m_s,
        "torque_n_m": wheels.torque_limit_n_m,
        "below_deg": limit["below"],
        "held_after_s": limit["stays_from_s"],
        "commanded_deg": flown.summary["peak_commanded_error_last_revolution_deg"],
        "momentum_share": flown.summary["peak_wheel_momentum_share"],
        "flights": BUDGET_FLIGHTS,
        "predicted_deg": math.degrees(total.predicted["ape"].rms_rad),
        "flown_deg": math.degrees(total.measured("ape").errors.rms_rad),
        "relative_sigma": total.measured("ape").relative_sigma,
    }


def main(names: list[str]) -> None:
    """Measure all or some, the shorter part first; print, write what was found."""
    warnings.simplefilter("ignore", OneByOne)
    paths = [path for path in sorted(FILES.glob("*.toml")) if not names or path.stem in names]
    for part in (stops, holds, with_wheels):
        for path in paths:
            has_wheels = path.stem.endswith("_wheels")
            if has_wheels != (part is with_wheels):
                continue
            measured = part(path)
            print(path.stem, json.dumps(measured), flush=True)
            to = FOUND_WHEELS if has_wheels else FOUND
            found = json.loads(to.read_text()) if to.exists() else {}
            found.setdefault(path.stem, {}).update(measured)
            to.write_text(json.dumps(dict(sorted(found.items())), indent=1) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
