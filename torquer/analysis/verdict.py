"""The verdict on a run: whether and when it met its goals, how well, and what was at its limit."""

import numpy as np

from torquer.analysis.goals import NAMED, Goal, below_in_words, goal_signal
from torquer.analysis.residual import Residual, find_residual
from torquer.analysis.series import Variables, first_at, none_if_never, stays_from, times_above
from torquer.analysis.wheel_use import AT_LIMIT, recorded_wheels
from torquer.base.language import Message, joined, message
from torquer.base.strict_json import finite_or_none
from torquer.scenario.spec import Scenario
from torquer.spacecraft.actuators.coils import Coils

#: Shares of the record below this are not reported.
_WORTH_TELLING = 0.005
#: Share of a coil's limit below which the coils had much in reserve.
_MUCH = 0.5


def judge_run(
    scenario: Scenario, goals: list[Goal], t, found: dict[str, np.ndarray], complete: bool
) -> dict:
    """Verdict as plain data; `done` is None without a limit to judge by.

    A limit that is only usual for the laws can be met, but not failed.

    `found`: series at the times `t` [s]: signals by "goal 0", "goal 1", ...; "coil_share" and
    "share", "torque_share" of the wheels, as far as there are any.
    """
    revolution_s = 2.0 * np.pi / scenario.orbit.rate_rad_s(scenario.start)
    within_s = scenario.mission.within_s if scenario.mission else None
    judged = [
        _judge(goal, t, found[f"goal {n}"], revolution_s, within_s)
        for n, goal in enumerate(goals)
        if f"goal {n}" in found
    ]
    unjudged = [goal for n, goal in enumerate(goals) if f"goal {n}" not in found]
    times = [each["stays_from_s"] for each in judged]
    settled = None if not judged or None in times else max(times)
    done = all(each["done"] for each in judged) if judged else None
    if done and unjudged:
        done = None
    if done is False and scenario.mission is None:
        done = None  # a limit that nobody asked for is not missed
    return {
        "done": done,
        "headline": _headline(judged, unjudged, done, settled, complete),
        "settled_s": settled,
        "goals": judged,
        "limits_met": [*limits_met(t, found, settled), *_unused_coils(judged, found)],
    }


def judged_series(part: Variables, scenario: Scenario, goals: list[Goal]) -> dict[str, np.ndarray]:
    """The series that `judge_run` judges, from the variables of a run or of a part of it."""
    found = {}
    for n, goal in enumerate(goals):
        if (signal := goal_signal(goal, part, scenario)) is not None:
            found[f"goal {n}"] = signal
    if scenario.spacecraft.coils is not None:
        found["coil_share"] = _coil_share(part, scenario.spacecraft.coils)
    wheels = recorded_wheels(part, scenario)
    if wheels is not None:
        found["share"] = wheels.momentum_shares.max(axis=1)
        found["torque_share"] = wheels.torque_shares.max(axis=1)
    return found


def _coil_share(part: Variables, coils: Coils) -> np.ndarray:
    """Greatest share of its limit that a coil has; with more than three, by least squares."""
    dipole = part["dipole_body"].values - np.array(coils.residual_dipole_a_m2)
    each = dipole @ np.linalg.pinv(np.array(coils.axes))
    return np.max(np.abs(each) / coils.limits_a_m2(), axis=1)


def _judge(goal: Goal, t, signal, revolution_s: float, within_s: float | None) -> dict:
    """When a signal came below its limit and stayed, and how it was after that.

    Where there is no signal, NaN, it is not below: no attitude is held, say.
    """
    below = signal < goal.below
    first, stays = none_if_never(first_at(t, below)), none_if_never(stays_from(t, below))
    last = signal[t >= t[-1] - revolution_s]
    whole = t[-1] - t[0] >= revolution_s and not np.isnan(last).all()
    residual = find_residual(t, signal, goal.below, revolution_s)
    return {
        "signal": goal.signal, "below": goal.below, "unit": goal.unit, "why": goal.why,
        "done": stays is not None and (within_s is None or stays <= within_s),
        "within_s": within_s, "first_s": first, "stays_from_s": stays,
        "times_above": int(times_above(below)), "within_residual": residual is not None,
        "residual": None if residual is None else list(residual),
        "initial": finite_or_none(signal[0]), "final": finite_or_none(signal[-1]),
        "mean_last_revolution": float(np.nanmean(last)) if whole else None,
        "greatest_last_revolution": float(np.nanmax(last)) if whole else None,
    }  # fmt: skip


def limits_met(t, found: dict[str, np.ndarray], settled: float | None) -> list[str]:
    """Actuators at their limits, before the goals were reached or in the whole run."""
    whole = settled is None or settled <= t[0]
    early = t <= (t[-1] if whole else settled)
    named = (
        ("coil_share", message("a coil was at its limit")),
        ("share", message("a wheel was at its momentum limit")),
        ("torque_share", message("a wheel's motor was at its torque limit")),
    )
    lines: list[str] = []
    for key, what in named:
        if key in found:
            part = float(np.mean(found[key][early] >= AT_LIMIT))
            if part >= _WORTH_TELLING:
                given = {"what": what, "percent": 100.0 * part}
                lines.append(
                    message("{what} in {percent:.0f} % of the run", **given)
                    if whole
                    else message("{what} in {percent:.0f} % of the time until then", **given)
                )
    return lines


def _unused_coils(judged: list[dict], found: dict[str, np.ndarray]) -> list[str]:
    """Coils that had much in reserve all the time, where a goal was missed."""
    if "coil_share" not in found or all(each["done"] for each in judged):
        return []
    most = float(np.max(found["coil_share"]))
    if most >= _MUCH:
        return []
    return [
        message(
            "no recorded dipole of a coil exceeds {percent:.2g} % of its limit",
            percent=100.0 * most,
        )
    ]


def _headline(judged: list[dict], unjudged: list[Goal], done, settled, complete: bool) -> Message:
    if not complete:
        return message("No verdict: the run did not reach its end.")
    if not judged and unjudged:
        what = joined(", ", [goal.in_words for goal in unjudged])
        return message(
            "No verdict: {what} cannot be judged, as no built-in law held an attitude.", what=what
        )
    if not judged:
        return message(
            "No verdict: the scenario gives no limits in {table}, and its laws imply none.",
            table=NAMED,
        )
    if done:
        return _achieved(judged, settled)
    failures = joined("; ", [_failure(each) for each in judged if not each["done"]])
    if done is None:
        return message(
            "No verdict (no limits in {table}). The usual limit was not met: {failures}.",
            table=NAMED,
            failures=failures,
        )
    return message("Not achieved: {failures}.", failures=failures)


def _achieved(judged: list[dict], settled: float) -> Message:
    given = {"what": joined(", ", map(_below, judged)), "time": clock_text(settled)}
    before = [words for each in judged if (words := again_in_words(each))]
    if not before:
        return message("Achieved: {what} from {time} to the end.", **given)
    once = joined("; ", before)
    return message("Achieved: {what} from {time} to the end ({once}).", once=once, **given)


def _below(each: dict) -> Message:
    return below_in_words(each["signal"], each["below"], each["unit"])


def _failure(each: dict) -> Message:
    given = {"what": _below(each), "final": value_or_none(each, "final")}
    if each["first_s"] is None:
        return message("{signal} never below {limit}, {final} at the end",
                       signal=each["signal"], limit=_limit(each), final=given["final"])  # fmt: skip
    words = again_in_words(each)
    if each["stays_from_s"] is None:
        given |= {"first": clock_text(each["first_s"]), "signal": each["signal"]}
        given |= {"limit": _limit(each)}
        if not each["within_residual"]:
            return message(
                "{signal} first below {limit} at {first}, but {final} at the end", **given
            )
        return message(
            "{signal} first below {limit} at {first}, but {final} at the end ({within})",
            within=_within_residual(each),
            **given,
        )
    given |= {"late": clock_text(each["stays_from_s"]), "wanted": clock_text(each["within_s"])}
    if not words:
        return message("{what} from {late} only, later than {wanted}", **given)
    return message("{what} from {late} only, later than {wanted} ({again})", again=words, **given)


def value_or_none(each: dict, key: str) -> Message:
    """A value of a judged goal with its unit; where there was none, that no attitude was held."""
    if each[key] is None:
        return message("no attitude held")
    return message("{value:.3g} {unit}", value=each[key], unit=each["unit"])


def again_in_words(each: dict) -> Message | None:
    """When a signal was first below its limit, if it was above it again; None if it was not.

    And that the limit lies within the residual motion, where it does.
    """
    count = each["times_above"]
    if not count:
        return None
    given = {"limit": _limit(each), "time": clock_text(each["first_s"])}
    words = (
        message("first below {limit} at {time}, above it once since", **given)
        if count == 1
        else message(
            "first below {limit} at {time}, above it {count} times since", **given, count=count
        )
    )
    return joined(": ", [words, _within_residual(each)]) if each["within_residual"] else words


def _within_residual(each: dict) -> Message:
    residual = Residual(*each["residual"])
    return message(
        "the limit lies within the residual motion, {low:.3g}..{high:.3g} {unit} in the last two "
        "revolutions",
        low=residual.low,
        high=residual.high,
        unit=each["unit"],
    )


def _limit(each: dict) -> Message:
    return message("{value:.3g} {unit}", value=each["below"], unit=each["unit"])


def clock_text(t_s: float) -> Message:
    """A time since the start, in a suitable unit."""
    units = ((120.0, 1.0, "s"), (7200.0, 60.0, "min"), (4 * 86400.0, 3600.0, "h"))
    length, unit = next(((s, name) for most, s, name in units if t_s < most), (86400.0, "d"))
    return message("{value:.3g} {unit}", value=t_s / length, unit=unit)
