"""The verdict on a run: whether and when it met its goals, how well, and what was at its limit."""

import numpy as np

from torquer.analysis.goals import NAMED, Goal, goal_signal
from torquer.analysis.residual import Residual, find_residual
from torquer.analysis.series import Variables, first_at, none_if_never, stays_from, times_above
from torquer.analysis.wheel_use import AT_LIMIT, recorded_wheels
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
    when, early = ("the run", t <= t[-1]) if whole else ("the time until then", t <= settled)
    named = (
        ("coil_share", "a coil was at its limit"),
        ("share", "a wheel was at its momentum limit"),
        ("torque_share", "a wheel's motor was at its torque limit"),
    )
    lines = []
    for key, words in named:
        if key in found:
            part = float(np.mean(found[key][early] >= AT_LIMIT))
            if part >= _WORTH_TELLING:
                lines.append(f"{words} in {100.0 * part:.0f} % of {when}")
    return lines


def _unused_coils(judged: list[dict], found: dict[str, np.ndarray]) -> list[str]:
    """Coils that had much in reserve all the time, where a goal was missed."""
    if "coil_share" not in found or all(each["done"] for each in judged):
        return []
    most = float(np.max(found["coil_share"]))
    if most >= _MUCH:
        return []
    return [f"no recorded dipole of a coil exceeds {100.0 * most:.2g} % of its limit"]


def _headline(judged: list[dict], unjudged: list[Goal], done, settled, complete: bool) -> str:
    if not complete:
        return "No verdict: the run did not reach its end."
    if not judged and unjudged:
        what = ", ".join(f"{goal.signal} below {goal.below:.3g} {goal.unit}" for goal in unjudged)
        return f"No verdict: {what} cannot be judged, as no built-in law held an attitude."
    if not judged:
        return f"No verdict: the scenario gives no limits in {NAMED}, and its laws imply none."
    if done is None:
        failures = "; ".join(_failure(each) for each in judged if not each["done"])
        return f"No verdict (no limits in {NAMED}). The usual limit was not met: {failures}."
    if done:
        what = ", ".join(f"{each['signal']} below {_limit(each)}" for each in judged)
        before = [words for each in judged if (words := again_in_words(each))]
        once = f" ({'; '.join(before)})" if before else ""
        return f"Achieved: {what} from {clock_text(settled)} to the end{once}."
    return "Not achieved: " + "; ".join(_failure(each) for each in judged if not each["done"]) + "."


def _failure(each: dict) -> str:
    signal, limit, final = each["signal"], _limit(each), value_or_none(each, "final")
    if each["first_s"] is None:
        return f"{signal} never below {limit}, {final} at the end"
    words = again_in_words(each)
    if each["stays_from_s"] is None:
        first = clock_text(each["first_s"])
        within = f" ({words.partition(': ')[2]})" if each["within_residual"] else ""
        return f"{signal} first below {limit} at {first}, but {final} at the end{within}"
    late, wanted = clock_text(each["stays_from_s"]), clock_text(each["within_s"])
    return f"{signal} below {limit} from {late} only, later than {wanted}" + (
        f" ({words})" if words else ""
    )


def value_or_none(each: dict, key: str) -> str:
    """A value of a judged goal with its unit; where there was none, that no attitude was held."""
    return "no attitude held" if each[key] is None else f"{each[key]:.3g} {each['unit']}"


def again_in_words(each: dict) -> str:
    """When a signal was first below its limit, if it was above it again; "" if it was not.

    And that the limit lies within the residual motion, where it does.
    """
    if not each["times_above"]:
        return ""
    count = each["times_above"]
    often = "once" if count == 1 else f"{count} times"
    words = f"first below {_limit(each)} at {clock_text(each['first_s'])}, above it {often} since"
    if not each["within_residual"]:
        return words
    residual = Residual(*each["residual"])
    return (
        f"{words}: the limit lies within the residual motion, {residual.low:.3g}.."
        f"{residual.high:.3g} {each['unit']} in the last two revolutions"
    )


def _limit(each: dict) -> str:
    return f"{each['below']:.3g} {each['unit']}"


def clock_text(t_s: float) -> str:
    """A time since the start, in a suitable unit."""
    if t_s < 120.0:
        return f"{t_s:.3g} s"
    if t_s < 7200.0:
        return f"{t_s / 60.0:.3g} min"
    return f"{t_s / 3600.0:.3g} h" if t_s < 4 * 86400.0 else f"{t_s / 86400.0:.3g} d"
