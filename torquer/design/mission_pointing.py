"""Parts of a mission's design on pointing: what a flight with its laws holds, and a budget."""

import math
from typing import NamedTuple

import numpy as np
import xarray as xr

from torquer.analysis.attitude import find_attitude_error
from torquer.analysis.summary import Summary, summarise, summary_rows, told_rows
from torquer.analysis.verdict import clock_text
from torquer.analysis.wheel_use import AT_LIMIT
from torquer.base.time import DAY_S
from torquer.computer.blocks.user import UserLaw
from torquer.design.pointing_answer import PointingBudget, pointing_budget
from torquer.design.requests import MissionRequest, PointingRequest
from torquer.scenario.held import slews_in_flight, why_no_attitude
from torquer.scenario.spec import Scenario
from torquer.simulation.results.dataset import flown_scenario
from torquer.simulation.setup.simulate import simulate
from torquer.spacecraft.wheel_array.envelope import momentum_envelope

#: Life of a satellite [s] in which momentum must go.
_LIFE_S = 5.0 * 365.25 * DAY_S


class FlownLaws(NamedTuple):
    """A flight of a scenario with its own laws, and its summary."""

    result: xr.Dataset
    summary: Summary

    def lines(self) -> list[str]:
        """The rows of the summary."""
        return [f"{label.strip()}: {text}" for label, text in told_rows(summary_rows(self.summary))]

    @property
    def saturates(self) -> bool:
        """Whether a wheel reaches its momentum limit."""
        return self.summary.get("peak_wheel_momentum_share", 0.0) >= AT_LIMIT


def fly_laws(scenario: Scenario) -> FlownLaws:
    """Fly a scenario as it is."""
    result = simulate(scenario)
    return FlownLaws(result, summarise(result))


def flown_in_words(found: FlownLaws, within_deg: float) -> str:
    """How well the laws held their attitude, and what that took of wheels and coils."""
    said = found.summary
    mean, peak = (
        said.get(f"{kind}_attitude_error_last_revolution_deg") for kind in ("mean", "peak")
    )
    if mean is None and (final := said.get("final_attitude_error_deg")) is None:
        words = "no attitude held at the end"
    elif mean is None:
        words = f"attitude error {final:.3g} deg at the end"
    else:
        words = f"attitude error {mean:.3g} deg in the mean, {peak:.3g} at most"
        words += " over the last revolution"
    if (commanded := said.get("peak_commanded_error_last_revolution_deg")) is not None:
        words += f"; at most {commanded:.3g} deg from what is commanded, slews included"
        words += f", and {100.0 * on_target(found, within_deg):.3g} % of it on target"
    if (share := said.get("peak_wheel_momentum_share")) is not None:
        words += f"; a wheel up to {100.0 * share:.3g} % of its momentum"
    if (energy_j := said.get("coil_energy_j")) is not None:
        words += f"; coils {energy_j:.3g} J"
    return f"{words}; asked: {within_deg:g} deg"


def error_that_counts(found: FlownLaws) -> float:
    """Error [deg] to be compared with what is asked: with slews that from what is commanded.

    A law that need not slew again must also have arrived at the end.
    """
    said = found.summary
    keys = ("peak_commanded_error_last_revolution_deg", "peak_attitude_error_last_revolution_deg",
            "final_attitude_error_deg")  # fmt: skip
    known = [said[key] for key in keys if said.get(key) is not None]
    if not known:
        return math.inf
    if said.get(keys[0]) is None or slews_in_flight(flown_scenario(found.result).control):
        return known[0]
    final = said.get("final_attitude_error_deg")
    return math.inf if final is None else max(known[0], final)


def filled_in_words(found: FlownLaws) -> str:
    """What becomes of momentum that no law takes off; "" where one may, or it hardly grows."""
    scenario = flown_scenario(found.result)
    wheels, laws = scenario.spacecraft.wheels, scenario.control.named().laws.values()
    if wheels is None or any(map(_may_unload, laws)):
        return ""
    limit = momentum_envelope(wheels.array()).inner_radius
    gain, period_s = _gained(found), scenario.orbit.period_s
    if not gain > limit * period_s / _LIFE_S:
        return ""
    return (
        f"nothing unloads the wheels: they gather {gain * DAY_S / period_s:.2g} N m s a day, and "
        f"have no more than {limit:.2g} N m s about their weakest axis, for about "
        f"{clock_text(float(f'{limit / gain * period_s:.2g}'))}"
    )


def _may_unload(spec) -> bool:
    """Whether a law has a momentum that it wants the wheels to have, or is the user's own."""
    return isinstance(spec, UserLaw) or bool(spec.momentum_key)


def _gained(found: FlownLaws) -> float:
    """Size of what the last revolution adds to the momentum of body and wheels [N m s]; not a
    number in a shorter flight."""
    t_s, momentum = (found.result[name].values for name in ("time", "momentum_inertial"))
    before_s = t_s[-1] - flown_scenario(found.result).orbit.period_s
    if before_s < t_s[0]:
        return math.nan
    before = [np.interp(before_s, t_s, each) for each in momentum.T]
    return float(np.linalg.norm(momentum[-1] - before))


def on_target(found: FlownLaws, within_deg: float) -> float:
    """Share of the last revolution's records at which it is so near to what its targets give."""
    error, t_s = find_attitude_error(found.result), found.result["time"].values
    if error is None:
        return 0.0
    last = t_s >= t_s[-1] - flown_scenario(found.result).orbit.period_s
    return float(np.mean(error.angle_deg[last] <= within_deg))


def judged_by(scenario: Scenario, request: MissionRequest) -> Scenario:
    """The scenario with what is asked as its limit, of the error that is meant, where it is given
    beside the scenario."""
    if request.pointing_deg is None or why_no_hold(scenario):
        return scenario
    both = ("commanded_error_below_deg", "attitude_error_below_deg")
    given = {} if scenario.mission is None else scenario.mission.model_dump(exclude_none=True)
    named = [key for key in both if key in given]
    meant = both[:1] if slews_in_flight(scenario.control) else both[1:]
    limits = dict.fromkeys(named or meant, request.pointing_deg)
    return scenario.replace("mission", given | limits)


def budget_of(scenario: Scenario, request: MissionRequest) -> PointingBudget:
    """The pointing budget, with as many flights as the mission has of everything."""
    return pointing_budget(scenario, PointingRequest(flights=request.runs))


def budget_in_words(found: PointingBudget, within_deg: float) -> tuple[str, float]:
    """The absolute error that the confidence does not exceed, the greatest cause; the error."""
    total, part = found.total.measured("ape"), 100.0 * found.request.confidence
    predicted = found.total.predicted
    both = [total and total.errors, predicted and predicted["ape"]]
    error_deg = max(math.degrees(each.quantile_rad) for each in both if each is not None)
    words = f"{part:.4g} % of all errors stay below {error_deg:.3g} deg; asked: {within_deg:g} deg"
    sizes = {line.cause.label: line.measured("ape").errors.rms_rad for line in found.causes
             if line.measured("ape") is not None}  # fmt: skip
    if sizes:
        worst = max(sizes, key=lambda label: sizes[label])
        words += f"; most is {worst}, {math.degrees(sizes[worst]):.3g} deg rms"
    return words, error_deg


def why_no_hold(scenario: Scenario) -> str:
    """Why no law's pointing can be flown; "" where it can."""
    return why_no_attitude(scenario.control)


def why_no_budget(scenario: Scenario) -> str:
    """Why there is no pointing budget; "" where there is one."""
    modes = scenario.control.named().modes
    return why_no_hold(scenario) or ("" if modes is None else "modes: no one loop all the time")
