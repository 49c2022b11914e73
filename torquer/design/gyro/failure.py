"""Why releases of a magneto-gyroscopic design do not point, by flights with its gains."""

from collections.abc import Mapping

import numpy as np

from torquer.campaign.statistics import quantile
from torquer.design.failure import RUNS, Failure, Flown, explain, is_enough
from torquer.design.gyro.answer import GyroDesign
from torquer.design.gyro.flown_scenario import (
    POINTED_DEG,
    designed_scenario,
    make_campaign,
    steps_of,
)
from torquer.design.nearest import SAME_LAW
from torquer.design.pointing_flights import PointingFlights, fly_releases
from torquer.scenario.spec import Scenario

#: Steps of all flights of a counter-test, some seconds of computing, and fewest starts.
_MOST_STEPS, _FEWEST = 4e6, 4


def fails(flights: PointingFlights | None) -> bool:
    """Whether more than a tenth of the releases that were flown do not point."""
    if flights is None:
        return False
    settled_s = flights.settled_s(POINTED_DEG)
    return not is_enough(int(np.isfinite(settled_s).sum()), len(settled_s))


def _starts(scenario: Scenario) -> int:
    """Starts of each counter-test: fewer of long flights, that the answer comes in minutes."""
    return int(min(RUNS, max(_FEWEST, _MOST_STEPS / steps_of(scenario))))


def explain_pointing(made: GyroDesign, others: Mapping[str, dict]) -> Failure:
    """Why the design fails; `others`: keys of other laws for the same satellite, by what they are
    called.

    The law stays for changed satellites: what would do with it is sought, not a new design; and
    not where flights are so long that few starts are flown.
    """
    case, orbits = made.case, made.scenario.simulation.revolutions
    assert orbits is not None
    runs = _starts(made.scenario)

    def as_flown(changed: Scenario, law: dict = made.law) -> Scenario:
        keys = {key: value for key, value in law.items() if key != "coil_duty"}
        control = changed.control
        keys |= {"coil_duty": control.coil_duty} if control.actuate_s else {}
        return designed_scenario(changed, keys, case.tip_off_deg_s, orbits)

    def fly(changed: Scenario, seed: int, law: dict = made.law) -> Flown:
        flown = as_flown(changed, law)
        campaign = make_campaign(flown, case.tip_off_deg_s).model_copy(update={"seed": seed})
        found = fly_releases(flown, campaign, runs)
        last = found.t_s >= found.t_s[-1] - flown.orbit.period_s
        arrived = int(np.isfinite(found.settled_s(POINTED_DEG)).sum())
        return Flown(arrived, runs, quantile(found.error_deg[:, last].mean(axis=1), 0.5))

    told = (
        "the gains designed",
        f"releases with {case.tip_off_deg_s:g} deg/s that stay below {POINTED_DEG:g} deg within "
        f"{orbits:g} rev; mean error in the last",
        "deg",
    )
    flown = {name: fly(case.scenario, 2, law) for name, law in others.items()}
    levers = SAME_LAW if runs == RUNS else ()
    return explain(case.scenario, told, as_flown, fly, fly, levers, flown)
