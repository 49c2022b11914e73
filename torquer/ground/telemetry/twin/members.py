"""What a fitted twin says of a satellite, and its members: the satellites that it may be.

A campaign flies members beyond the telemetry. Their attitude and rate at the start of the last leg,
inertia, gain and residual dipole are drawn from their joint covariance; what the telemetry does not
show is drawn as it was known beforehand.
"""

from __future__ import annotations

import json
import math
from typing import NamedTuple

import numpy as np
import xarray as xr

from torquer.ground.telemetry.twin.flights import INERTIA, TURN, gain_key
from torquer.scenario.change import with_values
from torquer.scenario.spec import Scenario
from torquer.scenario.toml_text import to_toml, toml_from_data

#: Standard deviations of logarithms of what the telemetry does not show: the inertia's size, and
#: with it that of gain and dipole; the gain.
SCALE, GAIN = 0.3, 0.5
_INERTIA, _DIPOLE = "spacecraft.body.inertia_kg_m2", "spacecraft.coils.residual_dipole_a_m2"
#: Members of a campaign, characters of a line for a row of a covariance.
_RUNS, _WIDE = 1000, 500
#: By how much rates of members may exceed the twin's.
_FASTER = 1.2


class Twin(NamedTuple):
    """What was found.

    `names`, `values`, `covariance`: elements of the inertia [kg m^2], residual dipole [A m^2], both
    over the gain where `only_ratio`, and otherwise the gain if it shows. `saturated`: part of the
    commands at the limit of a coil. `chi2` of `freedoms`: squares of the errors over their
    variances. `window_s`: what the twin follows, of `session_s`. `undetermined`: directions of
    which the telemetry says nothing. `doubt`: why the covariance cannot be relied on, "" if it can.
    `data` over `time`: the twin's `b_body` [T] and `omega_body` [rad/s] with the readings.
    `scenario`: the twin as found, from its start; `onward`: from the start of its last leg;
    `members`: tables `[[campaign.correlated]]` of what may be there instead. Without a fit there
    are no values, and `data`, `scenario` and `onward` are None.
    """

    names: tuple[str, ...]
    values: np.ndarray
    covariance: np.ndarray
    only_ratio: bool
    saturated: float
    chi2: float
    freedoms: int
    window_s: float
    session_s: float
    undetermined: tuple[str, ...]
    doubt: str
    data: xr.Dataset | None
    scenario: Scenario | None
    onward: Scenario | None = None
    members: tuple[dict, ...] = ()

    @property
    def fits(self) -> bool:
        """Whether the twin follows the telemetry."""
        return self.scenario is not None

    @property
    def sigmas(self) -> dict[str, float]:
        """Standard deviations by name."""
        sigmas = np.sqrt(np.diag(self.covariance)).tolist()
        return dict(zip(self.names, sigmas, strict=True))

    def of(self, name: str) -> float:
        """A value by its name."""
        return float(self.values[self.names.index(name)])

    @property
    def verdict(self) -> str:
        """What is known, or that nothing is."""
        minutes = f"{self.window_s / 60.0:.1f} of {self.session_s / 60.0:.1f} min"
        if not self.fits:
            return f"no twin fits: the best one follows {minutes} of the telemetry"
        parts = {name: 100.0 * self.sigmas[name] / self.of(name) for name in self.names}
        over = "/gain" if self.only_ratio else ""
        worst = max(parts[f"inertia_{each}{over}"] for each in INERTIA[:3])
        text = f"twin: inertia{over} to {worst:.2g} %"
        if "gain" in parts:
            text += f", gain to {parts['gain']:.2g} %"
        share = f"{100.0 * self.saturated:.0f} % of the commands saturate the coils"
        if self.only_ratio:
            how = share if self.saturated else "the coils are never saturated"
            text += f"; only J/gain is known: {how}"
        elif "gain" not in parts:
            text += f", its gain is not known: {share}"
        if self.doubt:
            text += f"; do not rely on these errors: {self.doubt}"
        return text if self.window_s >= self.session_s else f"{text}; follows {minutes}"


def member_tables(
    twin: Scenario,
    names: tuple[str, ...],
    slopes: np.ndarray,
    covariance: np.ndarray,
    only_ratio: bool,
) -> tuple[dict, ...]:
    """Tables `[[campaign.correlated]]` of a twin's members.

    `names` [n]: parameters, those of `Twin`; `slopes` [n, k]: their derivatives by what was fitted;
    `covariance` [6 + k, 6 + k]: of rotation vector [rad] and rate [rad/s] at the twin's start, and
    of what was fitted.
    """
    key = gain_key(twin)
    gain_name = f"control.law.{key}"
    gain = 1.0 if key is None else float(getattr(twin.control.law, key))
    unit = np.full(len(names), gain if only_ratio else 1.0)
    unit[[name == "gain" for name in names]] = 1.0 / gain
    slope = np.zeros((6 + len(names), len(covariance)))
    slope[:6, :6] = np.diag(np.repeat([1.0, 180.0 / math.pi], 3))
    slope[6:, 6:] = unit[:, None] * slopes
    changes = {"initial.attitude": "rotation", "initial.rate_deg_s": "vector", _INERTIA: "inertia"}
    if "gain" in names:
        changes[gain_name] = "factor"
    if any(name.startswith("dipole") for name in names):
        changes[_DIPOLE] = "vector"
    found = slope @ covariance @ slope.T
    tables = [_table(changes, 0.5 * (found + found.T))]
    if only_ratio:
        scaled = [each for each in (_INERTIA, gain_name, _DIPOLE) if each in {*changes, gain_name}]
        alike = SCALE**2 * np.ones((len(scaled), len(scaled)))
        tables.append(_table(dict.fromkeys(scaled, "factor"), alike))
    elif key is not None and "gain" not in names:
        tables.append(_table({gain_name: "factor"}, np.array([[GAIN**2]])))
    return tuple(tables)


def _table(changes: dict[str, str], covariance: np.ndarray) -> dict:
    return {
        "keys": list(changes),
        "changes": list(changes.values()),
        "covariance": covariance.tolist(),
    }


def write_members(onward: Scenario, twin: Twin) -> str:
    """The file that `torquer campaign` flies: a twin from its last leg `onward`, and its members.

    Its fixed steps let members fly side by side.
    """
    scenario = with_fixed_steps(onward)
    data = json.loads(scenario.model_dump_json(exclude_unset=True, exclude_none=True))
    data["name"] = f"{scenario.name}-twin"
    campaign = {"campaign": {"runs": _RUNS, "correlated": list(twin.members)}}
    said = "".join(f"# {line}\n" for line in _comments(twin, scenario))
    return "\n".join([said, toml_from_data(data), to_toml(campaign, _WIDE)])


def _comments(twin: Twin, scenario: Scenario) -> list[str]:
    """Lines of comment of the file of a twin's members."""
    said = [
        f"The twin at {scenario.start:%Y-%m-%dT%H:%M:%SZ}, at the end of the telemetry, flown on.",
        "Members: what the fit leaves open of its motion then, inertia, gain and residual dipole.",
    ]
    if twin.only_ratio:
        said += [
            "The telemetry does not show the size of inertia, gain and dipole: the last table has",
            f"one factor for all three, its logarithm with a deviation of {SCALE:g}. Put in yours.",
        ]
    elif len(twin.members) > 1:
        said += [
            "The telemetry does not show the gain: the last table has a factor for it, its",
            f"logarithm with a deviation of {GAIN:g}. Put in yours.",
        ]
    if twin.doubt:
        said.append(f"DO NOT RELY ON THESE ERRORS: {twin.doubt}.")
    return said


def with_fixed_steps(scenario: Scenario) -> Scenario:
    """The scenario with steps of RK4 that follow the rate at its start, unless it has steps."""
    given = scenario.simulation
    if given.step_s is not None:
        return scenario
    rate = _FASTER * math.radians(float(np.linalg.norm(scenario.initial.rate_deg_s)))
    step_s = scenario.grid_s / math.ceil(scenario.grid_s * max(rate, 1e-4) / TURN)
    kept = {key: getattr(given, key) for key in ("duration_s", "revolutions", "record_s")}
    return with_values(scenario, {"simulation": kept | {"step_s": step_s}})
