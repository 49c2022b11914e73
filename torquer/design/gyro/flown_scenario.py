"""The scenario of a magneto-gyroscopic design: its law in a mode table, released at tip-off."""

import math
from datetime import timedelta

import numpy as np

from torquer.campaign.load import campaign_from_data
from torquer.campaign.spec import Campaign
from torquer.computer.laws.magneto_gyro.law import MagnetoGyro
from torquer.scenario.mission import Mission
from torquer.scenario.spec import Scenario

#: Name of the law, error that counts as pointed [deg], that counts as exact [deg].
LAW, POINTED_DEG, EXACT_DEG = "magneto_gyro", 5.0, 1.0
#: Age of a reading after which the coils are switched off: least [s], and in intervals of readings.
_OLD_S, _OLD_READINGS = 60.0, 10.0
#: Time [s] for which the estimated error must be small.
_SMALL_FOR_S = 600.0
#: Runs of the campaign that the scenario contains.
_RUNS = 200
#: What of the control table is replaced by the law and its modes.
_REPLACED = {"law", "laws", "modes", "estimator", "estimators"}


def designed_scenario(scenario: Scenario, law: dict, tip_off_deg_s: float, orbits: float):
    """The scenario with the law: released at the tip-off rate, flown for some orbits at least."""
    control = _plain(scenario.control)
    kept = {key: value for key, value in control.items() if key not in _REPLACED}
    flown = {
        **_plain(scenario),
        "control": {
            **kept,
            "laws": {LAW: law},
            "estimator": {"kind": "law"},
            "modes": _modes(scenario, law),
        },
        "initial": _initial(scenario, tip_off_deg_s),
        "simulation": _simulation(scenario, orbits),
    }
    if scenario.mission is None or scenario.mission.attitude_error_below_deg is None:
        flown["mission"] = _plain(Mission(attitude_error_below_deg=POINTED_DEG))
    return Scenario.model_validate(flown)


def _plain(spec) -> dict:
    return spec.model_dump(mode="json", exclude_unset=True, exclude_none=True)


def _modes(scenario: Scenario, law: dict) -> dict:
    """The law works while the magnetometer does; without fresh readings the coils are off.

    The satellite counts as pointed by the estimate of the law, which states none in stage 1.
    """
    control, meter = scenario.control, scenario.spacecraft.one_of("magnetometer")
    interval_s = max(control.sample_s, control.actuate_s or 0.0, meter.sample_s or 0.0)
    age_s = max(_OLD_S, _OLD_READINGS * interval_s)
    age = {"signal": "reading_age_s", "sensor": "magnetometer"}
    fresh, old = {**age, "below": 0.5 * age_s}, {**age, "above": age_s}
    error = {"signal": "attitude_error_deg"}
    small, large = {**error, "below": POINTED_DEG}, {**error, "above": 2.0 * POINTED_DEG}
    lost = {"signal": "estimate_age_s", "above": age_s}
    begin = {"to": "capturing", "when": [fresh]}
    stop = {"to": "waiting", "when": [old]}
    arrive = {"to": "pointing", "when": [small], "for_s": _SMALL_FOR_S}
    states = {
        "waiting": {"coils": "off", "transitions": [begin]},
        "capturing": {"laws": [LAW], "transitions": [stop, arrive]},
        "pointing": {
            "laws": [LAW],
            "transitions": [stop, *({"to": "capturing", "when": [why]} for why in (lost, large))],
        },
    }
    attitude = {key: law[key] for key in ("euler_deg", "sequence") if key in law}
    return {"attitude": {"reference": "orbital", **attitude}, "states": states}


def _initial(scenario: Scenario, tip_off_deg_s: float) -> dict:
    """The scenario's attitude and direction of the rate; the rate itself is that of tip-off."""
    rate = np.array(scenario.initial.rate_deg_s)
    size = float(np.linalg.norm(rate))
    direction = rate / size if size > 0.0 else np.full(3, math.sqrt(1.0 / 3.0))
    released = [float(f"{x:.6g}") for x in tip_off_deg_s * direction]
    return {**_plain(scenario.initial), "rate_deg_s": released, "rate_relative_to": "inertial"}


def _simulation(scenario: Scenario, orbits: float) -> dict:
    own = _plain(scenario.simulation)
    own_orbits = scenario.length_s / scenario.orbit.period_s
    own.pop("duration_s", None)
    return {**own, "revolutions": float(math.ceil(max(orbits, own_orbits)))}


def steps_of(scenario: Scenario) -> float:
    """Steps of a flight."""
    return scenario.length_s / (scenario.simulation.step_s or scenario.control.sample_s)


def campaign_table(scenario: Scenario, tip_off_deg_s: float) -> dict:
    """A table `[campaign]`: any attitude, the tip-off rate about any axis, any place in orbit."""
    uniform = {"uniform": [0.0, 360.0]}
    day = [time.isoformat() for time in (scenario.start, scenario.start + timedelta(days=1))]
    # the form of the text knows where the Earth is at the start: that must not vary
    law = scenario.control.laws[LAW]
    is_fixed = isinstance(law, MagnetoGyro) and law.form == "text"
    places = {
        "circular": {"orbit.raan_deg": uniform, "orbit.argument_of_latitude_deg": uniform},
        "kepler": {"orbit.raan_deg": uniform, "orbit.mean_anomaly_deg": uniform},
    }
    error = {"signal": "attitude_error_deg"}
    return {
        "runs": _RUNS,
        "seed": 1,
        "vary": {
            **places.get(scenario.orbit.kind, {} if is_fixed else {"start": {"uniform": day}}),
            "initial.attitude": "uniform",
            "initial.rate_deg_s": {"direction": "uniform", "magnitude": tip_off_deg_s},
        },
        "outcomes": {
            "pointed_s": {**error, "what": {"settles_below": POINTED_DEG}},
            "exact_s": {**error, "what": {"settles_below": EXACT_DEG}},
        },
        "success": {"pointed_s": {"below": scenario.length_s}},
    }


def make_campaign(scenario: Scenario, tip_off_deg_s: float) -> Campaign:
    """The campaign of that table."""
    return campaign_from_data(campaign_table(scenario, tip_off_deg_s), scenario)
