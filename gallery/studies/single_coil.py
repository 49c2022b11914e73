"""K. Kondo and others (2024): one coil brakes a satellite, by B-dot or by model prediction.

Inertia, orbit, limit, weights, horizon and four starts are printed; the first attitude, the dead
band of B-dot, the sampling and what the prediction has for the field are not, or our copy has lost
them.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from gallery.studies.flying import digits, first_attitude, fly_all, fly_table, read
from torquer.scenario.change import with_values
from torquer.scenario.load import load_scenario

NAME = "single_coil"
SCENARIO = Path(__file__).with_suffix(".toml")
#: Published: detumbled once each rate is below this one [deg/s].
STOPPED_DEG_S = 0.1
#: The published first rates [deg/s].
STARTS = {
    "1": (2.429286, 2.878490, -0.366780),
    "2": (-1.576299, -0.246907, 2.778531),
    "3": (0.047150, -2.486905, -1.425107),
    "4": (-0.626909, -0.795380, 2.927892),
}
_PREDICTED = {"control.law.function": "predicted"}
_BAND = "control.law.parameters.dead_band_t_s"
_TURNS = {"control.law.parameters.turns": 1.0}
_PRECISE = {"simulation.integrator": "auto", "simulation.step_s": None,
            "simulation.tolerance_deg": 1e-6}  # fmt: skip
OUTCOMES = {
    "stopped_s": {"signal": "law.fastest_deg_s", "what": {"first_below": STOPPED_DEG_S}},
}


class Case(NamedTuple):
    """Attitudes at each start, and changes to the scenario."""

    attitudes: int
    changes: Mapping


CASES = {
    "B-dot": Case(64, {}),
    **{f"dead band of {nt_s} nT/s": Case(64, {_BAND: 1e-9 * nt_s}) for nt_s in (50, 100, 200)},
    "ten hours": Case(64, {_BAND: 1e-7, "simulation.duration_s": 36000.0}),
    "B-dot at 10 Hz": Case(32, {_BAND: 1e-7, "control.sample_s": 0.1}),
    "B-dot, precise": Case(8, {_BAND: 1e-7, **_PRECISE}),
    "predicted": Case(32, _PREDICTED),
    "predicted, field turns": Case(32, _PREDICTED | _TURNS),
    "predicted, precise": Case(8, _PREDICTED | _PRECISE),
}


def flight(case: str, start: str, attitude: int = 0):
    """The scenario of a case from a start, with one of the attitudes."""
    changes = {
        "initial.rate_deg_s": list(STARTS[start]),
        "initial.quaternion": first_attitude(2024, attitude).tolist(),
    }
    return with_values(load_scenario(SCENARIO), changes | dict(CASES[case].changes))


def minutes_of(case: str, start: str) -> np.ndarray:
    """Stored minutes until each attitude of a start is detumbled; NaN where it is not."""
    return np.array([row[start] for row in read(NAME)["cases"][case]["rows"]], dtype=float)


def fly(case: str, attitudes: int | None = None) -> list[dict]:
    """Minutes until each start is detumbled, a row for each attitude."""
    count = attitudes or CASES[case].attitudes
    table = {"initial.quaternion": [first_attitude(2024, k).tolist() for k in range(count)]}

    def of(start: str) -> list[float | None]:
        found = fly_table(flight(case, start), table, OUTCOMES, workers=1)
        return [digits(each / 60.0) for each in found["stopped_s"].values]

    minutes = dict(zip(STARTS, fly_all(of, STARTS), strict=True))
    return [{start: minutes[start][k] for start in STARTS} for k in range(count)]
