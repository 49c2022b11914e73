"""The parts of a mission's design, each by the function of its own: what it says, what is open."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from torquer.analysis.filters.sensor_sets import SensorSet, as_plain as sets_as_plain, sensor_sets
from torquer.analysis.notes.bdot_notes import BDOT
from torquer.campaign.capture import flight
from torquer.campaign.faults.contents import as_plain as faults_as_plain, counts_in_words
from torquer.campaign.faults.fly import FaultCampaign, fly_faults
from torquer.campaign.faults.verdict import DEGRADED as HURT, LOST
from torquer.computer.estimation.filter import Filter
from torquer.computer.laws.off import Off
from torquer.design.detumbling import detumble
from torquer.design.gain_sweep import GainSweep
from torquer.design.gyro.answer import GyroDesign
from torquer.design.gyro.gains import magneto_gyro
from torquer.design.mission_pointing import (
    FlownLaws,
    budget_in_words,
    budget_of,
    error_that_counts,
    filled_in_words,
    flown_in_words,
    fly_laws,
    judged_by,
    why_no_budget,
    why_no_hold,
)
from torquer.design.pointing_answer import PointingBudget
from torquer.design.requests import (
    DetumbleRequest,
    MagnetoGyroRequest,
    MissionRequest,
    ThreeAxisRequest,
)
from torquer.design.sweep_domain import ABOVE_REST
from torquer.design.three_axis_answer import ThreeAxisAnswer
from torquer.design.three_axis_gains import three_axis
from torquer.design.wheel_file import wheels_of
from torquer.design.wheel_report import WheelReport, wheels
from torquer.design.wheel_tables import nearest_in_words, slews_in_words, summary_rows
from torquer.scenario.spec import Scenario
from torquer.theory.validity import Doubt

#: What a part says, best first; the worst of them is the mission's.
HOLDS, DOUBTFUL, FAILS, LEFT_OUT = "holds", "doubtful", "fails", "left out"
STATES = (HOLDS, LEFT_OUT, DOUBTFUL, FAILS)
#: Gains of B-dot, and times of a day, flown.
_GAINS, _TIMES = 5, 2


class Part(NamedTuple):
    """A part: `state` of STATES, why in `words`, what is `open`, the `answer` of its function (None
    where it is left out), its text and its plain data."""

    name: str
    state: str
    words: str
    open: tuple[str, ...] = ()
    answer: Any = None
    lines: tuple[str, ...] = ()
    data: Mapping | None = None


def _bare(scenario: Scenario) -> Scenario:
    """The scenario with its control cycle, but without laws: what gains are designed for.

    Of its mission the limits of rates stay: others are for an attitude that its laws hold.
    """
    bare = flight(scenario, Off().law(), 1.0, 1.0).replace(
        "initial", scenario.initial.model_dump(mode="json", exclude_none=True)
    )
    given = {} if scenario.mission is None else scenario.mission.model_dump(exclude_none=True)
    rates = {key: value for key, value in given.items() if key.startswith("rate_")}
    within = {key: given[key] for key in ("within_s",) if rates and key in given}
    return bare.replace("mission", rates | within or None)


def _has_bdot(scenario: Scenario) -> bool:
    laws, modes = scenario.control.named()
    return modes is None and len(laws) == 1 and isinstance(next(iter(laws.values())), BDOT)


def detumbling(scenario: Scenario, request: MissionRequest) -> Part:
    """How long releases tumble with the gain chosen."""
    asked = DetumbleRequest(
        tip_off_deg_s=request.tip_off_deg_s, gains=_GAINS, runs=request.runs, times=_TIMES
    )
    scenario = scenario if _has_bdot(scenario) else _bare(scenario)
    sweep = detumble(scenario, asked)
    best, goal = sweep.chosen, f"below {sweep.below_deg_s:.3g} deg/s"
    count, runs = best.settled_within(sweep.wanted.allowed_s), len(best.settled_s)
    words = f"{count} of {runs} releases stay {goal}, half of them after "
    words += f"{best.settled_by(0.5) / 3600.0:.3g} h, with a gain of {best.gain:.4g} A m^2 s/T"
    words += f", {sweep.chosen_is}" if sweep.chosen_is else ""
    opened = () if scenario.mission else ("mission: no rate that counts as stopped is given",)
    # of the time by theory nothing is said here: the releases were flown
    doubts = [each for each in sweep.verdict.doubts if each.limit is ABOVE_REST]
    return _of(sweep, words, sweep.failure, doubts, opened)


def _of(answer, words: str, failure, doubts: Sequence[Doubt], opened: tuple[str, ...]) -> Part:
    """The part of an answer with `lines`, `data` and perhaps a failure; doubts are open points."""
    state = FAILS if failure else DOUBTFUL if doubts else HOLDS
    if failure and failure.limiting:
        words += f"; {failure.limiting} limits"
    elif failure and failure.together[1].is_enough:
        words += f"; what limits together: {', '.join(failure.together[0])}"
    nearest = failure.works() if failure else ()
    more = (f"would work: {nearest[0]}",) if nearest else ()
    lines, data = tuple(answer.lines()), answer.data()
    doubtful = (each.text for each in doubts)
    return Part("", state, words, (*more, *doubtful, *opened), answer, lines, data)


def hold(scenario: Scenario, request: MissionRequest) -> Part:
    """How well coils alone hold the attitude."""
    asked = ThreeAxisRequest(
        capture_runs=request.runs, capture_within_deg=request.within_deg(scenario)
    )
    answer = three_axis(scenario, asked)
    names = sorted(answer.candidates, key=lambda name: len(answer.verdict_on(name).doubts))
    counts = {name: each.captured if each else 0 for name, each in answer.captures.items()}
    best = max(names, key=lambda name: counts[name])
    words = f"{best} holds {counts[best]} of {request.runs} starts in any attitude within "
    words += f"{asked.capture_within_deg:g} deg"
    opened = []
    if "attitude_sensor" not in scenario.spacecraft.model_fields_set:
        opened.append("attitude and rate are exact: no sensor that gives them is described")
    if answer.trim and not answer.failure:
        opened.append("the law dipole_trim would take off the residual dipole")
    return _of(answer, words, answer.failure, answer.verdict_on(best).doubts, tuple(opened))


def pitch_wheel(scenario: Scenario, request: MissionRequest) -> Part:
    """How soon magnetometer, coils and a pitch wheel point."""
    made = magneto_gyro(scenario, MagnetoGyroRequest(tip_off_deg_s=request.tip_off_deg_s))
    settled = made.flights.settled_s(request.within_deg(scenario)) if made.flights else ()
    count, runs = int(sum(each < float("inf") for each in settled)), len(settled)
    words = f"{count} of {runs} releases point within {request.within_deg(scenario):g} deg"
    return _of(made, words, made.failure, made.verdict.doubts, ())


def sensors(scenario: Scenario, request: MissionRequest) -> Part:
    """What the filters know of the attitude, by linear covariance."""
    sets = sensor_sets(scenario)
    best, limit = sets[0], request.within_deg(scenario)
    worst = max(x for x in (best.light_deg, best.dark_deg) if x == x)
    words = f"95 % of the filter's errors stay below {worst:.3g} deg"
    state = HOLDS if worst <= limit else FAILS
    lines = tuple(
        f"{each.name}: {each.light_deg:.3g} deg with the Sun seen, {each.dark_deg:.3g} deg without"
        for each in sets
    )
    return Part("", state, words, (), sets, lines, {"sensor_sets": sets_as_plain(sets)})


def wheel_array(scenario: Scenario, request: MissionRequest) -> Part:
    """What the wheels can store and push, whole and after a failure, against the slews."""
    report = wheels(wheels_of(scenario))
    found = report.found
    single = [each for each in found["failures"] if len(each["lost"]) == 1]
    left = [each["worst_rate_deg_s"] for each in single]
    words = f"rates up to {found['momentum']['worst_rate_deg_s']:.3g} deg/s about any axis"
    words += f", {min(left):.3g} with one wheel failed" if left else ""
    words += slews_in_words(found["demand"])
    state, opened = HOLDS, [f"would work: {text}" for text in nearest_in_words(found["nearest"])]
    if not found["demand"]:
        opened.append("no rate or momentum is demanded: a file of torquer wheels has [demand]")
    if not left or min(left) <= 0.0:
        state = DOUBTFUL
        opened.append("a failed wheel leaves an axis without control")
    elif not found["nearest"] and not all(each["demand_met"] for each in single):
        opened.append("with one wheel failed slews must be slower")
    if found["nearest"]:
        state = FAILS
    lines = tuple(f"{label}: {text}" for label, text in summary_rows(found))
    return Part("", state, words, tuple(opened), report, lines, report.data())


def pointing(scenario: Scenario, request: MissionRequest) -> Part:
    """What a flight with the scenario's laws holds: slews and unloading, too."""
    found, limit = fly_laws(scenario), request.within_deg(scenario)
    holds = error_that_counts(found) <= limit and not found.saturates
    opened = ("a wheel reaches its momentum limit",) if found.saturates else ()
    words, fills = flown_in_words(found, limit), filled_in_words(found)
    opened = (*opened, fills) if fills else opened
    state = FAILS if not holds else DOUBTFUL if fills else HOLDS
    return Part("", state, words, opened, found, tuple(found.lines()), dict(found.summary))


def pointing_errors(scenario: Scenario, request: MissionRequest) -> Part:
    """Errors by cause, predicted and flown."""
    found, limit = budget_of(scenario, request), request.within_deg(scenario)
    words, error_deg = budget_in_words(found, limit)
    part = _of(found, words, None, found.verdict.doubts, ())
    return part if error_deg <= limit else part._replace(state=FAILS)


def faults(scenario: Scenario, request: MissionRequest) -> Part:
    """What every single fault does to the satellite."""
    found = fly_faults(judged_by(scenario, request), workers=request.workers)
    counts, worst = found.counts(True), found.worst()
    words = ", ".join(f"{number} {name}" for name, number in counts.items())
    state = FAILS if counts[LOST] else DOUBTFUL if counts[HURT] else HOLDS
    opened = () if state == HOLDS else (f"the worst fault is {worst.fault.name}",)
    if found.verdict[0] != "safe":
        opened = (*opened, f"without a fault it is {': '.join(found.verdict)}")
    return Part("", state, words, opened, found, tuple(counts_in_words(found)),
                faults_as_plain(found))  # fmt: skip


def _why_no_coils(scenario: Scenario) -> str:
    return "" if scenario.spacecraft.coils else "no coils"


def _why_no_coil_hold(scenario: Scenario) -> str:
    has = scenario.spacecraft.wheels
    return _why_no_coils(scenario) or ("reaction wheels: coils alone need not hold" if has else "")


def _why_no_pitch_wheel(scenario: Scenario) -> str:
    has = any(scenario.spacecraft.body.wheel_momentum_n_m_s)
    return _why_no_coils(scenario) or ("" if has else "no wheel_momentum_n_m_s of the body")


def _why_no_wheels(scenario: Scenario) -> str:
    return "" if scenario.spacecraft.wheels else "no reaction wheels"


def _why_no_filter(scenario: Scenario) -> str:
    used = scenario.control.estimator, *scenario.control.estimators.values()
    has = any(isinstance(each, Filter) for each in used)
    return "" if has else "no filter: attitude and rate on board are readings of the sensors"


def _why_no_law(scenario: Scenario) -> str:
    laws = scenario.control.named().laws.values()
    return "" if any(spec.kind != "off" for spec in laws) else "no law"


#: Parts by name: the function, and why a satellite has none of it ("" where it has).
PARTS: dict[str, tuple[Callable, Callable[[Scenario], str]]] = {
    "detumbling": (detumbling, _why_no_coils),
    "hold by coils": (hold, _why_no_coil_hold),
    "pitch wheel": (pitch_wheel, _why_no_pitch_wheel),
    "sensors and filter": (sensors, _why_no_filter),
    "reaction wheels": (wheel_array, _why_no_wheels),
    "pointing in flight": (pointing, why_no_hold),
    "pointing budget": (pointing_errors, why_no_budget),
    "faults": (faults, _why_no_law),
}


def walk(name: str, scenario: Scenario, request: MissionRequest) -> Part:
    """A part by its name; left out, with the reason, where the satellite has none of it.

    What its function refuses is doubtful: nothing is known of it.
    """
    function, why_not = PARTS[name]
    if missing := why_not(scenario):
        return Part(name, LEFT_OUT, missing)
    try:
        return function(scenario, request)._replace(name=name)
    except ValueError as error:
        return Part(name, DOUBTFUL, f"not designed: {error}", (str(error),))


#: Answers that parts give.
Answer = (
    GainSweep | ThreeAxisAnswer | GyroDesign | list[SensorSet] | WheelReport | FlownLaws
    | PointingBudget | FaultCampaign
)  # fmt: skip
