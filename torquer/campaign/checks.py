"""What is looked at in every member beside its outcomes: the work of its steps, and of its coils.

A single run says in a note what its integrator did by itself, and that the body was spun up. Here
each member has the numbers, and the summary tells the worst wherever it states a success.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr

from torquer.analysis.spin_up import LAST, has_grown, limit_text, may_be_spun_up, rotation_energy_j
from torquer.campaign.contents import NAMED, member_numbers
from torquer.campaign.signals import Flown
from torquer.scenario.resolution import QUIET_DAMPING, QUIET_LAG_DEG, TAKE_SHORTER, part_damped
from torquer.scenario.spec import Scenario
from torquer.simulation.results.dataset import flown_scenario

#: Which members were spun up: 1, else 0; rates at the end. When the scenario's condition ended a
#: flight.
SPUN_UP, LAST_RATE, ENDED_S = "spun_up", "last_rate_deg_s", "ended_s"


class Check(NamedTuple):
    """A number of the steps of each member, told in the summary from `quiet` on.

    It follows by `of` from a cell of the state at the end.
    """

    integrator: str
    cell: str
    of: Callable
    unit: str
    quiet: float
    label: str
    meaning: str
    advice: str


CHECKS: Mapping[str, Check] = {
    "rk4_damping": Check(
        "rk4", "damping", part_damped, "1", QUIET_DAMPING,
        "Damping by the steps of RK4",
        "fraction of the nutation or libration amplitude damped by the steps, at most",
        TAKE_SHORTER,
    ),
    "rk4_lag_deg": Check(
        "rk4", "lag", np.degrees, "deg", QUIET_LAG_DEG, "Lag by the steps of RK4",
        "approximate phase lag of the rotation due to the steps",
        TAKE_SHORTER,
    ),
    "integration_error_deg": Check(
        "auto", "error_rad", np.degrees, "deg", QUIET_LAG_DEG, "Integration error",
        "attitude error at the end: sum of the steps' estimates",
        "ask for a smaller simulation.tolerance_deg",
    ),
}  # fmt: skip
#: Columns of a campaign with checks: unit and meaning by name.
MEANINGS = {
    SPUN_UP: ("", "whether it rotates faster for good than at the start, the coils alone working"),
    LAST_RATE: ("deg/s", "rate of rotation at the last record"),
    ENDED_S: ("s", "time at which the condition of the scenario ended the flight; NaN: it did not"),
    **{name: (check.unit, check.meaning) for name, check in CHECKS.items()},
}


def column(name: str) -> str:
    """Name of the variable with a check: no outcome has such a one."""
    return f"check.{name}"


def checks_for(scenario: Scenario, varied: Sequence[str]) -> list[str]:
    """Names of what is checked in the members of a campaign, some keys of which vary."""
    any_steps = "simulation.integrator" in varied
    steps = scenario.simulation.integrator
    found = [name for name, each in CHECKS.items() if any_steps or each.integrator == steps]
    found += [SPUN_UP, LAST_RATE] if may_be_spun_up(scenario) else []
    ends = scenario.simulation.end_when is not None
    return [*found, ENDED_S] if ends or "simulation.end_when" in varied else found


def of_steps(integrator: str, cells: np.ndarray) -> dict[str, np.ndarray]:
    """The checks (n,) of members flown by an integrator, from their state at the end."""
    known = {name: each for name, each in CHECKS.items() if each.integrator == integrator}
    return {name: each.of(np.array(cells[each.cell])) for name, each in known.items()}


class Rotation:
    """The energy of rotation of n members, at the start and at least in the last part of a flight.

    Of the scenario's body, also where members have others: whether it grew is asked, by much.
    """

    def __init__(self, scenario: Scenario, count: int, length_s: float):
        self._scenario, self._late_s = scenario, (1.0 - LAST) * length_s
        self._is_asked = may_be_spun_up(scenario)
        self._first, self._least = np.full(count, np.nan), np.full(count, np.inf)
        self._last_deg_s = np.full(count, np.nan)

    def add(self, rows: slice, flown: Flown) -> None:
        """Go on with some members at the records that come next."""
        if not self._is_asked or not len(flown.t_s):
            return
        first, late = self._first[rows], flown.t_s >= self._late_s
        if np.isnan(first).any():
            first[:] = rotation_energy_j(self._scenario, flown.omega_body[0])
        self._last_deg_s[rows] = np.degrees(np.linalg.norm(flown.omega_body[-1], axis=-1))
        if late.any():
            energy = rotation_energy_j(self._scenario, flown.omega_body[late])
            self._least[rows] = np.minimum(self._least[rows], energy.min(axis=0))

    def spun_up(self) -> dict[str, np.ndarray]:
        """Which members were spun up (n,), as 1 and 0, and rates at the end.

        Nothing where it is not asked.
        """
        if not self._is_asked:
            return {}
        grown = has_grown(self._scenario, self._first, self._least)
        known = np.where(np.isfinite(self._least), grown, np.nan)
        return {SPUN_UP: known, LAST_RATE: self._last_deg_s}


# ------------------------------------------------------------------ in the summary


def check_summary(result: xr.Dataset) -> dict:
    """The median and the worst of what the steps did, and who was spun up, as plain data."""
    members = member_numbers(result)
    found = {name: each for name in CHECKS if (each := _steps(result, name, members)) is not None}
    return {"steps": found, SPUN_UP: _spun_up(result, members), ENDED_S: _ended_early(result)}


def _steps(result: xr.Dataset, name: str, members: np.ndarray) -> dict | None:
    if column(name) not in result:
        return None
    values = result[column(name)].values
    known = np.flatnonzero(np.isfinite(values))
    if not len(known):
        return None
    row = known[np.argmax(values[known])]
    worst = {"worst": float(values[row]), "member": int(members[row])}
    told = int(np.count_nonzero(values[known] >= CHECKS[name].quiet))
    return {"median": float(np.median(values[known])), **worst, "beyond": told}


def _spun_up(result: xr.Dataset, members: np.ndarray) -> dict | None:
    if column(SPUN_UP) not in result:
        return None
    rows = np.flatnonzero(result[column(SPUN_UP)].values == 1.0)
    named = [int(member) for member in members[rows[:NAMED]]]
    fastest = float(result[column(LAST_RATE)].values[rows].max(initial=0.0))
    limit = limit_text(flown_scenario(result), fastest)
    return {"count": len(rows), "members": named, "fastest_deg_s": fastest, "limit": limit}


def _ended_early(result: xr.Dataset) -> dict | None:
    """How many members the scenario's condition ended, and the median of when; by which."""
    if column(ENDED_S) not in result:
        return None
    times = result[column(ENDED_S)].values
    known, when = times[np.isfinite(times)], flown_scenario(result).simulation.end_when
    median = float(np.median(known)) if len(known) else None
    by = "simulation.end_when" if when is None else when.in_words
    return {"count": len(known), "median_s": median, "by": by}


def check_rows(summary: dict) -> list[tuple[str, str]]:
    """Label and text of what must be known beside a success rate; none where all is well."""
    rows = []
    for name, each in summary["checks"]["steps"].items():
        if each["worst"] >= CHECKS[name].quiet:
            worst, median = (_text(name, each[key]) for key in ("worst", "median"))
            text = (
                f"median {median}, worst {worst} (member {each['member']}); {CHECKS[name].advice}"
            )
            rows.append((CHECKS[name].label, text))
    spun = summary["checks"][SPUN_UP]
    if spun and spun["count"]:
        named = ", ".join(map(str, spun["members"])) + ", …" * (spun["count"] > NAMED)
        rows.append((
            "Spun up",
            f"{spun['count']} of {summary['members']} members rotate faster at the end than at the "
            f"start, while the coils worked ({named}), at up to {spun['fastest_deg_s']:.4g} deg/s"
            + f"; {spun['limit']}" * bool(spun["limit"]),
        ))  # fmt: skip
    ended = summary["checks"].get(ENDED_S)
    if ended and ended["count"]:
        rows.append((
            "Ended early",
            f"{ended['count']} of {summary['members']} members, by {ended['by']}; median after "
            f"{ended['median_s']:.4g} s",
        ))  # fmt: skip
    return rows


def _text(name: str, value: float) -> str:
    return f"{value:.3g} deg" if CHECKS[name].unit == "deg" else f"{100.0 * value:.3g} %"
