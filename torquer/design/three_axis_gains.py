"""Gains for three axes by coils alone: the case from a scenario or a request, laws, flights."""

import math
from dataclasses import fields

from torquer.base.limits import RequestError, given_values
from torquer.campaign.capture import capture
from torquer.computer.blocks.law import Law
from torquer.computer.estimation.sensors import SensorReadings
from torquer.computer.laws.pointing import HeldAttitude
from torquer.computer.laws.three_axis import ThreeAxis
from torquer.design.requests import Key, ThreeAxisRequest
from torquer.design.three_axis_answer import ThreeAxisAnswer
from torquer.design.three_axis_failure import explain_hold, fails
from torquer.design.three_axis_trim import offered_trim
from torquer.maths.geometry.vec3 import scale
from torquer.scenario.load import ScenarioError, scenario_from_data
from torquer.scenario.spec import Scenario
from torquer.theory.three_axis.gain_search import DesignTask, assess, design_gains
from torquer.theory.three_axis.hold import AttitudeHold
from torquer.theory.three_axis.response import Noise, Offsets
from torquer.theory.three_axis.sampled import Cycle, SampledHold

#: Keys without which there is no satellite.
_NEEDED = ("inertia", "altitude_km", "inclination_deg", "limit_a_m2")
#: Where keys stand in a scenario.
_PLACES = {
    field.name: each.place
    for field in fields(ThreeAxisRequest)
    for each in getattr(field.type, "__metadata__", ())
    if isinstance(each, Key)
}
#: The start of a satellite that is given by a request: the field's date.
_START = "2025-01-01T00:00:00Z"


def three_axis(
    scenario: Scenario | None = None, request: ThreeAxisRequest = ThreeAxisRequest()
) -> ThreeAxisAnswer:
    """Gains for three-axis control by coils alone: by formula, refined, and a periodic regulator.

        answer = three_axis(torquer.load_scenario("my_satellite.toml"))
        answer.candidates["refined"].law
        torquer.plot(answer)

    The scenario describes the satellite, if given; otherwise the request does. A law of the
    scenario that holds an attitude is assessed, too, as `own`. With `capture_runs` each law is
    flown from random attitudes. Where no law holds the satellite, `failure` says why, by flights:
    what goes with each cause, and the nearest design that works. RequestError for a satellite that
    is not described, or twice; ValueError where no gains work.
    """
    own = None
    if scenario is None:
        scenario = scenario_from_request(request)
    else:
        for key in given_values(request, *_PLACES):
            raise RequestError(key, "must not be given with a scenario; received both")
        own = _own_law(scenario.control)
    task, notes = _task(scenario, request)
    try:
        return _answer(scenario, request, task, notes, own)
    except ArithmeticError as error:
        raise ValueError(str(error)) from None


def _answer(scenario: Scenario, request: ThreeAxisRequest, task, notes, own) -> ThreeAxisAnswer:
    design, captures = design_gains(task), {}
    candidates = dict(design.candidates)
    if own is not None:
        candidates["own"] = assess(task, own)
    if request.capture_runs is not None:
        starts = request.capture_runs, request.capture_rate_deg_s, request.capture_within_deg
        captures = {
            name: capture(scenario, task, each, *starts) for name, each in candidates.items()
        }
    within_deg = request.capture_within_deg
    trim, flown, failure = offered_trim(task, candidates, within_deg), None, None
    if fails(candidates, captures, within_deg):
        flown, failure = explain_hold(
            scenario, request, design, candidates, trim, lambda changed: _task(changed, request)[0]
        )
    return ThreeAxisAnswer(
        scenario, task, design, candidates, captures, within_deg, notes, trim, failure, flown
    )


def scenario_from_request(request: ThreeAxisRequest) -> Scenario:
    """A scenario made from the keys of a request; errors name them."""
    named = given_values(request, *_PLACES)
    for key in _NEEDED:
        if key not in named:
            raise RequestError(key, "must be given, or a scenario; received nothing")
    law = {"kind": "three_axis", "rate_gain_n_m_s_per_t2": 1.0, "angle_gain_n_m_per_t2": 1.0}
    data: dict = {
        "name": "design", "start": _START, "orbit": {"kind": "circular"}, "control": {"law": law},
        "initial": {"rate_deg_s": [0.0, 0.0, 0.0]}, "simulation": {"revolutions": 1.0},
    }  # fmt: skip
    for key, value in named.items():
        *tables, last = _PLACES[key].split(".")
        table = data
        for name in tables:
            table = table.setdefault(name, {})
        table[last] = list(value) if isinstance(value, tuple) else value
    try:
        return scenario_from_data(data)
    except ScenarioError as error:
        raise _as_request_error(str(error)) from None


def _as_request_error(text: str) -> RequestError:
    """A mistake of the scenario as one of the request."""
    keys = []
    for key, place in _PLACES.items():
        if place in text:
            text = text.replace(place, key)
            keys.append(key)
    first, _, problem = text.partition(": ")
    return RequestError(first, problem, *keys)


def _task(scenario: Scenario, request: ThreeAxisRequest) -> tuple[DesignTask, tuple[str, ...]]:
    """What is designed for, and what is left out."""
    craft, control = scenario.spacecraft, scenario.control
    if craft.coils is None:
        raise ValueError("spacecraft.coils: must be given for magnetic control; received none")
    craft.coils.check_axes("gains of three axes")
    held, notes = _attitude(control)
    hold = AttitudeHold.of_scenario(scenario, held.law(), request.revolutions)
    sensor, gyro, disturbance = (
        craft.one_of("attitude_sensor"),
        craft.one_of("gyro"),
        scenario.disturbance,
    )
    hold_s, torque, random = control.sample_s, (0.0, 0.0, 0.0), 0.0
    if disturbance is not None:
        torque, random = disturbance.constant_torque_n_m, disturbance.random_torque_n_m
        hold_s = disturbance.random_hold_s or hold_s
    noise = Noise(math.radians(sensor.noise_deg), math.radians(gyro.noise_deg_s), random, hold_s)
    degree = math.radians(1.0)
    offsets = Offsets(scale(degree, sensor.error_deg), scale(degree, gyro.bias_deg_s))
    task = DesignTask(
        SampledHold(hold, Cycle.of_control(control), craft.coils.residual_dipole_a_m2),
        float(craft.coils.limits_a_m2().min()),
        request.linear_range_deg, request.gain_margin, torque, noise, offsets,
    )  # fmt: skip
    return task, (*notes, *_left_out(scenario))


def _attitude(control) -> tuple[ThreeAxis, tuple[str, ...]]:
    """The three-axis law for the attitude that a law of the scenario holds."""
    laws = [spec for spec in control.named().laws.values() if isinstance(spec, HeldAttitude)]
    keys = {"rate_gain_n_m_s_per_t2": 1.0, "angle_gain_n_m_per_t2": 1.0}
    if not laws:
        return ThreeAxis(**keys), (
            "no law holds an attitude: alignment with the orbital frame is assumed",
        )
    held = laws[0].model_dump(include={"reference", "euler_deg", "sequence"})
    return ThreeAxis(**keys, **held), ()


def _own_law(control) -> Law | None:
    """The only law, where it holds an attitude by coils and without memory."""
    laws = [spec.law() for spec in control.named().laws.values()]
    if len(laws) != 1 or not {"orbital", "q_wanted"} <= laws[0].values().keys():
        return None
    return laws[0] if laws[0].answers == "dipole" and not len(laws[0].first_memory()) else None


def _left_out(scenario: Scenario) -> tuple[str, ...]:
    """What the linear theory leaves out."""
    craft, found = scenario.spacecraft, []
    if craft.coils is not None and craft.coils.lag_s > 0.0:
        found.append("the lag of the coils is left out: compare it with the delay margin")
    if not isinstance(scenario.control.estimator, SensorReadings):
        found.append("the noise is that of the sensors, without the estimator")
    if craft.one_of("gyro").bias_drift_deg_s_sqrt_s > 0.0:
        found.append("the gyro's bias is taken as constant, without its drift")
    return tuple(found)
