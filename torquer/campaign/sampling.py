"""Members of a campaign: the values of their keys, the seeds of their noise, their scenarios."""

from collections.abc import Iterable, Mapping
from datetime import datetime
from typing import Any

import numpy as np

from torquer.base.explain import ScenarioError, key_name
from torquer.base.validate import finite
from torquer.campaign.changes import CHANGES
from torquer.campaign.own_draws import RefusedDraw
from torquer.campaign.spec import Campaign
from torquer.campaign.table import listed
from torquer.campaign.unit_numbers import (
    checked_members,
    noise_numbers,
    random_words,
    unit_numbers,
)
from torquer.campaign.variation import ATTITUDE, Correlated, Variation, as_numbers
from torquer.scenario.change import value_at, with_values
from torquer.scenario.spec import Scenario

#: What members have at a key: numbers [n], vectors [n, k], or other values.
Drawn = dict[str, np.ndarray | list]


def draw(campaign: Campaign, scenario: Scenario, members) -> Drawn:
    """Values of each key that varies, of members by their numbers (n integers, 0 or more).

    They do not depend on which members are asked for together. For "initial.attitude" they are
    quaternions (x, y, z, w). `values` and times come as lists, all others as arrays.
    """
    members = checked_members(members, campaign.rows)
    try:
        drawn = draw_values(campaign, scenario, unit_numbers(campaign, members))
    except RefusedDraw as error:
        raise error.of(members) from None
    return listed(campaign.table, members) | drawn


def draw_values(campaign: Campaign, scenario: Scenario, units: np.ndarray) -> Drawn:
    """Values of each key that is drawn, from unit numbers [n, campaign.unit_numbers]."""
    drawn: Drawn = {}
    parts = units_by_group(campaign, units)
    for key, variation in campaign.vary.items():
        with np.errstate(over="ignore"):  # the scenario refuses what is not finite
            drawn[key] = _values(variation, parts[variation.tied_to or key])
        if variation.relative is not None:
            own = _own_numbers(("campaign", "vary", key, "relative"), key, scenario)
            drawn[key] = np.multiply.outer(np.asarray(drawn[key], dtype=float), own)
    for together in campaign.correlated:
        rows = _normal_together(together, parts[", ".join(together.keys)])
        if together.changes is None:
            drawn |= dict(zip(together.keys, rows.T, strict=True))
        else:
            _change(drawn, together, rows, scenario)
    return drawn


def units_by_group(campaign: Campaign, units: np.ndarray) -> dict[str, np.ndarray]:
    """Unit numbers [n, campaign.unit_numbers] in parts, by what belongs together."""
    groups = campaign.groups  # without any the numbers are one empty part
    return dict(zip(groups, _split(units, groups.values()), strict=False))


def _split(columns: np.ndarray, counts: Iterable[int]) -> list[np.ndarray]:
    """Columns [n, sum of the counts] in parts."""
    return np.split(columns, np.cumsum([*counts])[:-1], axis=1)


def _change(drawn: Drawn, together: Correlated, rows: np.ndarray, scenario: Scenario) -> None:
    """Change what is drawn of some keys, or the scenario's own values, by deviations [n, k]."""
    names = together.changes or ()
    parts = _split(rows, (CHANGES[name].numbers for name in names))
    for key, name, part in zip(together.keys, names, parts, strict=True):
        own = drawn[key] if key in drawn else _repeat(key, name, scenario, len(rows))
        with np.errstate(over="ignore"):  # the scenario refuses what is not finite
            drawn[key] = CHANGES[name].of(np.asarray(own, dtype=float), part)


def _repeat(key: str, name: str, scenario: Scenario, count: int) -> np.ndarray:
    """A scenario's own value for each of some members, of the shape that a change takes."""
    place = ("campaign", "correlated", key)
    if key == ATTITUDE:
        own = np.array(scenario.initial.attitude)
    else:
        own = _own_numbers(place, key, scenario)
    if name == "inertia" and own.shape == (3,):
        own = np.diag(own)
    shape = CHANGES[name].shape
    if shape not in (None, own.shape):
        raise ScenarioError(
            f"{key_name(place)}: must have a value of shape {shape} for a change by {name!r}; "
            f"received {own.tolist()}"
        )
    return np.repeat(own[None], count, axis=0)


def _own_numbers(place: tuple, key: str, scenario: Scenario) -> np.ndarray:
    """The scenario's own value of a key; ScenarioError for one that has no numbers."""
    own = None
    try:
        own = value_at(scenario, key)
        numbers = finite(key, () if own is None else own)
    except ValueError:
        numbers = np.empty(0)
    if not numbers.size:
        raise ScenarioError(
            f"{key_name(place)}: must apply to numbers that the scenario gives; received "
            f"{'nothing' if own is None else repr(own)}"
        )
    return numbers


def _values(variation: Variation, units: np.ndarray):
    """Values of a variation from its unit numbers [n, k]."""
    return _FORMS[variation.form](variation, units)


def _draw_from_list(variation: Variation, units: np.ndarray) -> list:
    values = variation.values
    places = np.minimum((units[:, 0] * len(values)).astype(int), len(values) - 1)
    return [values[place] for place in places]


def _shape(variation: Variation, units: np.ndarray) -> np.ndarray:
    """Unit numbers [n, k] of a vector; [n] of a number."""
    return units[:, 0] if variation.length is None else units


def _uniform(variation: Variation, units: np.ndarray):
    low, high = variation.uniform
    if isinstance(low, datetime):
        return [low + u * (high - low) for u in units[:, 0].tolist()]
    return _between(low, high, _shape(variation, units))


def _between(low, high, u: np.ndarray) -> np.ndarray:
    """Linear from low to high, for any finite two: their difference might overflow."""
    return np.clip(np.asarray(low) * (1.0 - u) + np.asarray(high) * u, low, high)


def _log_uniform(variation: Variation, units: np.ndarray) -> np.ndarray:
    low, high = map(np.asarray, variation.log_uniform)
    between = np.exp(_between(np.log(low), np.log(high), _shape(variation, units)))
    return np.clip(between, low, high)


def _normal_units(units: np.ndarray) -> np.ndarray:
    """Normal numbers at these shares of their distribution."""
    from scipy.special import ndtri  # a tenth of a second of importing

    return ndtri(units)


def _normal(variation: Variation, units: np.ndarray) -> np.ndarray:
    mean, sigma = variation.normal.mean, variation.normal.sigma
    return np.asarray(mean) + np.asarray(sigma) * _normal_units(_shape(variation, units))


def _truncated_normal(variation: Variation, units: np.ndarray) -> np.ndarray:
    from scipy.stats import truncnorm  # half a second of importing, for those who need it

    cut = variation.truncated_normal
    mean, sigma = np.asarray(cut.mean), cut.sigma
    low = np.asarray(-np.inf if cut.low is None else cut.low)
    high = np.asarray(np.inf if cut.high is None else cut.high)
    standard = truncnorm.ppf(_shape(variation, units), (low - mean) / sigma, (high - mean) / sigma)
    return np.clip(mean + sigma * standard, low, high)


def _by_quantiles(variation: Variation, units: np.ndarray) -> np.ndarray:
    """Linear between the quantiles that are given."""
    shares, values = np.array(variation.quantiles).T
    place = np.searchsorted(shares[1:-1], units[:, 0], side="right")
    low, high = shares[place], shares[place + 1]
    return _between(values[place], values[place + 1], (units[:, 0] - low) / (high - low))


def _direction(variation: Variation, units: np.ndarray) -> np.ndarray:
    """Isotropic: the component along an axis is uniform (Archimedes), the azimuth too."""
    z, azimuth = 2.0 * units[:, 0] - 1.0, 2.0 * np.pi * units[:, 1]
    across = np.sqrt((1.0 - z) * (1.0 + z))
    directions = np.column_stack([across * np.cos(azimuth), across * np.sin(azimuth), z])
    lengths = _lengths(variation.magnitude, units[:, 2:])
    return lengths[:, None] * directions


def _lengths(variation: Variation, units: np.ndarray) -> np.ndarray:
    """Values [n] of a variation of a number within another."""
    found = np.asarray(_values(variation, units), dtype=float)
    if found.ndim > 1:
        own = variation.own
        raise own.refusal(f"shape {found.shape[1:]}", ", here a number")
    return found


def _rotation(variation: Variation, units: np.ndarray) -> np.ndarray:
    """Quaternions (x, y, z, w) uniform on the rotation group. K. Shoemake (1992)."""
    u, one, other = units[:, 0], 2.0 * np.pi * units[:, 1], 2.0 * np.pi * units[:, 2]
    a, b = np.sqrt(1.0 - u), np.sqrt(u)
    columns = [a * np.sin(one), a * np.cos(one), b * np.sin(other), b * np.cos(other)]
    return np.column_stack(columns)


_FORMS = {
    "values": _draw_from_list,
    "uniform": _uniform,
    "log_uniform": _log_uniform,
    "normal": _normal,
    "truncated_normal": _truncated_normal,
    "quantiles": _by_quantiles,
    "own": lambda variation, units: variation.own.values(units),
    "direction": _direction,
    "relative": lambda variation, units: _lengths(variation.relative, units),  # the factors
    "rotation": _rotation,
}


def _normal_together(together: Correlated, units: np.ndarray) -> np.ndarray:
    """Values or deviations [n, k] of a multivariate normal distribution."""
    mean = np.zeros(together.unit_numbers) if together.mean is None else together.mean
    values = np.tile(mean, (len(units), 1))
    # a product of matrices would round one member differently from many
    for normal, row in zip(_normal_units(units).T, together.root(), strict=True):
        values += normal[:, None] * row
    return values


def member_seeds(campaign: Campaign, members) -> np.ndarray:
    """Seeds (0 to 2^63 - 1) of the noise of members [n], independent of the values that vary.

    See `noise_numbers` for members that share theirs.
    """
    members = noise_numbers(campaign, checked_members(members))
    words = random_words(campaign.seed, "seed of the noise", members)
    return (words >> np.uint64(1)).astype(np.int64)


def as_changes(drawn: Mapping[str, Any], row: int) -> dict[str, Any]:
    """Values by the scenario's keys, as `with_values` takes them, from one row of drawn values."""
    changes: dict[str, Any] = {}
    for key, values in drawn.items():
        value = as_numbers(values[row]) if isinstance(values, np.ndarray) else values[row]
        if key == ATTITUDE:  # in place of the file's attitude, however that is given
            changes |= {"initial.quaternion": value, "initial.euler_deg": (0.0, 0.0, 0.0)}
        else:
            changes[key] = value
    return changes


def member_scenario(scenario: Scenario, campaign: Campaign, member: int) -> Scenario:
    """The scenario of one member, to be flown alone."""
    (seed,) = member_seeds(campaign, [member]).tolist()
    own = {"name": f"{scenario.name}-{member}", "seed": seed}
    return with_values(scenario, own | as_changes(draw(campaign, scenario, [member]), 0))
