"""What the dataset of a campaign has: inputs, outcomes, how members ended, what was asked."""

import json
import math
from collections.abc import Mapping

import numpy as np
import xarray as xr

#: Greatest value of a signal, by its unit where it has one.
_GREATEST = {"deg": 180.0}
#: How many members are named in a list.
NAMED = 5
#: Members whose signals over time are in memory at once.
_BLOCK = 8192
#: Unit of a number taken from a signal, where it differs from the signal's unit.
_UNITS_OF_WHAT = {"settles_below": "s", "first_below": "s", "part_below": ""}
_UNITS = {
    "rate_deg_s": "deg/s",
    "rate_x_deg_s": "deg/s",
    "rate_y_deg_s": "deg/s",
    "rate_z_deg_s": "deg/s",
    "rate_fastest_axis_deg_s": "deg/s",
    "rate_orbital_deg_s": "deg/s",
    "momentum_n_m_s": "N m s",
    "wheel_momentum_n_m_s": "N m s",
    "attitude_error_deg": "deg",
    "coil_energy_j": "J",
    "peak_dipole_a_m2": "A m^2",
}
_SIGNED = ("rate_x_deg_s", "rate_y_deg_s", "rate_z_deg_s")


def campaign_table(result: xr.Dataset) -> dict:
    """The table `[campaign]` as plain data."""
    return json.loads(result.attrs["campaign"])


def scenario_name(result: xr.Dataset) -> str:
    """The scenario's name."""
    return str(json.loads(result.attrs["scenario"]).get("name", ""))


def groups_in(result: xr.Dataset) -> list[str]:
    """Names of what is drawn independently: keys that vary, and groups of correlated keys."""
    table = campaign_table(result)
    alone = (key for key, variation in table["vary"].items() if "tied_to" not in variation)
    return [*alone, *(", ".join(each["keys"]) for each in table["correlated"])]


def is_design(result: xr.Dataset) -> bool:
    """Whether members are those of Saltelli's design, for Sobol's indices."""
    return campaign_table(result).get("sampling") == "saltelli"


def independent(result: xr.Dataset) -> xr.Dataset:
    """The members that are independent: the first two of each point of Saltelli's design.

    All of any other campaign.
    """
    if not is_design(result):
        return result
    return result.isel(member=member_numbers(result) % (len(groups_in(result)) + 2) < 2)


def member_blocks(result: xr.Dataset) -> list[slice]:
    """Members in blocks: the signals of all of them over time may not fit into memory."""
    count = result.sizes["member"]
    return [slice(k, min(k + _BLOCK, count)) for k in range(0, count, _BLOCK)]


def member_numbers(result: xr.Dataset) -> np.ndarray:
    """The members' numbers [n]."""
    return np.asarray(result["member"].values, dtype=np.int64)


def member_inputs(result: xr.Dataset) -> dict[str, np.ndarray | list]:
    """The members' values at each key that varies, as `as_columns` takes them; times in seconds."""
    return {key: _plain(values) for key, values in _by_role(result, "input").items()}


def member_outcomes(result: xr.Dataset) -> dict[str, np.ndarray]:
    """Outcomes [n] by name; missing ones NaN."""
    return {name: each.astype(float) for name, each in _by_role(result, "outcome").items()}


def names_by_role(result: xr.Dataset, role: str) -> list[str]:
    """Names of the inputs, the outcomes or the series."""
    return [str(name) for name, each in result.data_vars.items() if each.attrs.get("role") == role]


def _by_role(result: xr.Dataset, role: str) -> dict[str, np.ndarray]:
    names = names_by_role(result, role)
    return {name: result[name].transpose("member", ...).values for name in names}


def _plain(values: np.ndarray) -> np.ndarray | list:
    if values.dtype.kind == "M":
        return values.astype("datetime64[ns]").astype(np.int64) * 1e-9
    return values if values.dtype.kind in "biuf" else values.tolist()


def failed_in(result: xr.Dataset) -> np.ndarray:
    """Which members' runs failed [n]."""
    return np.array([str(how) == "failed" for how in result["how_it_ended"].values], dtype=bool)


def succeeded_in(result: xr.Dataset) -> np.ndarray | None:
    """Which members succeeded [n]; None without conditions."""
    if "succeeded" not in result:
        return None
    return np.asarray(result["succeeded"].values) == 1


def definition(result: xr.Dataset, name: str) -> tuple[object, dict]:
    """An outcome's signal, a name or a table, and what is taken of it."""
    attrs = result[name].attrs
    what = json.loads(attrs.get("what") or "null") or {}
    return json.loads(attrs.get("signal") or "null"), _drop_missing(what)


def _drop_missing(table: Mapping) -> dict:
    return {key: value for key, value in table.items() if value is not None}


def series_of(result: xr.Dataset, name: str) -> str | None:
    """Name of the variable with an outcome's signal over time, which outcomes of one signal share.

    None without one.
    """
    own, signal = f"series.{name}", result[name].attrs.get("signal")
    if own in result:
        return own
    for other in names_by_role(result, "outcome"):
        if result[other].attrs.get("signal") == signal and f"series.{other}" in result:
            return f"series.{other}"
    return None


def outcome_unit(result: xr.Dataset, name: str) -> str:
    """Unit of an outcome."""
    what = definition(result, name)[1]
    units = [_UNITS_OF_WHAT[key] for key in what if key in _UNITS_OF_WHAT]
    return units[0] if units else unit_of_signal(result, name)


def unit_of_signal(result: xr.Dataset, name: str) -> str:
    """Unit of the signal that an outcome is taken from; of a log what the law declares."""
    attributes = result[name].attrs
    return attributes.get("signal_units") or signal_unit(json.loads(attributes["signal"]))


def signal_unit(signal) -> str:
    """Unit of a signal; that of an axis is an angle. "" for a log and for a fraction."""
    if isinstance(signal, Mapping):
        return "" if "of_start" in signal else "deg"
    return _UNITS.get(signal, "")


def may_be_negative(signal) -> bool:
    """Whether a signal has a sign: a rate about one axis, and what a law logs."""
    if isinstance(signal, Mapping):
        return may_be_negative(signal.get("of_start"))
    return isinstance(signal, str) and (signal in _SIGNED or "." in signal)


def is_time(result: xr.Dataset, name: str) -> bool:
    """Whether an outcome is a time: if missing, it is later than the end of the run."""
    return any(_UNITS_OF_WHAT.get(key) == "s" for key in definition(result, name)[1])


def end_s(result: xr.Dataset) -> float | None:
    """Time [s] of the last record; None in a dataset without records' times."""
    if "time" not in result or not result.sizes["time"]:
        return None
    return float(result["time"].values[-1])


def outcome_bounds(result: xr.Dataset, name: str) -> tuple[float, float]:
    """Least and greatest value that an outcome can have."""
    if name not in result or "signal" not in result[name].attrs:
        return -math.inf, math.inf
    if is_time(result, name):
        return 0.0, math.inf if (end := end_s(result)) is None else end
    signal, what = definition(result, name)
    if "part_below" in what:
        return 0.0, 1.0
    least = -math.inf if may_be_negative(signal) else 0.0
    return least, _GREATEST.get(unit_of_signal(result, name), math.inf)


def restrict_times(result: xr.Dataset, name: str, end: float | None) -> np.ndarray | None:
    """Times [n], those that come later than `end` [s] or never counted as `end`.

    Their mean is the restricted mean. None for an outcome that is not a time; NaN for a member
    whose run failed.
    """
    if end is None or not is_time(result, name):
        return None
    times = np.minimum(np.nan_to_num(result[name].values.astype(float), nan=end), end)
    return np.where(failed_in(result), np.nan, times)


def in_words(result: xr.Dataset, name: str) -> str:
    """An outcome's definition in words."""
    signal, what = definition(result, name)
    taken = (
        key.replace("_", " ") + ("" if value is True else f" {value:g}")
        for key, value in what.items()
    )
    return ", ".join([signal_in_words(signal), *taken])


def signal_in_words(signal) -> str:
    """A signal's name, or the axis and the direction from which its angle is measured."""
    if isinstance(signal, Mapping):
        if "of_start" in signal:
            return f"{signal['of_start']} as a fraction of its start"
        return f"angle of axis {_numbers(signal.get('axis'))} to {_numbers(signal.get('to'))}"
    return str(signal or "")


def _numbers(value) -> str:
    return str([float(f"{x:.4g}") for x in value]) if isinstance(value, list) else str(value)


def least_is_worst(result: xr.Dataset, name: str) -> bool:
    """Whether small values of an outcome are bad.

    By its condition of success if there is one; else only for a fraction of time below a value.
    """
    condition = _drop_missing((campaign_table(result).get("success") or {}).get(name) or {})
    if condition:
        return "above" in condition
    return "part_below" in definition(result, name)[1]


def missing_as_worst(result: xr.Dataset, name: str) -> np.ndarray:
    """An outcome [n], infinite where it is missing: worse than any other value."""
    values = np.array(result[name].values, dtype=float)
    worst = -np.inf if least_is_worst(result, name) else np.inf
    return np.where(np.isnan(values), worst, values)
