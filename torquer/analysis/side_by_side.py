"""Several runs together: joined into one data set, and what differs between their scenarios."""

import json
from collections.abc import Sequence

import numpy as np
import xarray as xr

from torquer.base.time import utc_at
from torquer.simulation.results.dataset import flown_scenario

#: Attributes of a result that belong to its run alone: coordinates of the joined runs.
_OF_A_RUN = ("scenario", "seed", "ended", "how_it_ended", "laws", "versions", "processor",
             "table_relative_error")  # fmt: skip
#: Keys of a scenario that do not affect the simulation.
_SAYS_NOTHING = ("name", "description")


def concat(
    results: Sequence[xr.Dataset], names: Sequence[str] | None = None, dim: str = "run"
) -> xr.Dataset:
    """Results side by side along a new dimension, each with its scenario and seed.

    `names` of the runs; left out: those of their scenarios, numbered where two are the same.
    Variables that all runs have are kept; they are NaN at times that a run did not record.
    `scenario`, `seed`, `laws`, `ended` and `versions` become coordinates along `dim`:
    `pick_run(joined, name)` gives a run back as it was. ValueError for no results.

        >>> weak = torquer.simulate(scenario.replace("control.law.gain_a_m2_s_per_t", 5e3))
        >>> joined = torquer.concat([result, weak], names=["2e4", "5e3"])
        >>> joined.sizes["run"]
        2
    """
    results = list(results)
    if not results:
        raise ValueError("results: must be one or more results; received none")
    found = [name for name in results[0].data_vars if name != "checkpoint"]  # the loop's state
    shared = [name for name in found if all(name in result for result in results)]
    named = xr.DataArray(distinct_names(results, names), dims=(dim,), name=dim)
    parts = [result[shared].drop_vars("utc") for result in results]
    joined = xr.concat(parts, named, join="outer", combine_attrs="override", coords="minimal",
                       compat="override")  # fmt: skip
    text = {key: (dim, [str(result.attrs.get(key, "")) for result in results]) for key in _OF_A_RUN}
    joined.attrs = {"conventions": results[0].attrs.get("conventions", "")}
    return joined.assign_coords(text)


def pick_run(joined: xr.Dataset, name: str, dim: str = "run") -> xr.Dataset:
    """A run of `concat`, with its scenario, seed and laws as attributes again.

    It can be analysed and drawn, but not resumed: the state of the loop is not in it.

        >>> joined = torquer.concat([result, result], names=["first", "second"])
        >>> torquer.pick_run(joined, "second").attrs["seed"] == result.attrs["seed"]
        True
    """
    if name not in joined[dim].values:
        known = ", ".join(map(str, joined[dim].values))
        raise ValueError(f"name: must be one of {known}; received {name!r}")
    one = joined.sel({dim: name})
    attributes = {key: str(one[key].values) for key in _OF_A_RUN if key in one.coords}
    flown = one["omega_body"].notnull().all("axis").values
    one = one.drop_vars([dim, *attributes], errors="ignore").isel(time=flown)
    one = one.assign_attrs({**joined.attrs, **attributes})
    states = {name: one[name].astype(np.int64) for name in one if "flag_values" in one[name].attrs}
    start = flown_scenario(one).start
    utc = utc_at(start, one["time"].values).astype("datetime64[ns]")
    return one.assign(states).assign_coords(utc=("time", utc))


def distinct_names(results: Sequence[xr.Dataset], names: Sequence[str] | None = None) -> list[str]:
    """A name for each run, no two the same."""
    if names is not None:
        given = list(map(str, names))
        if len(given) != len(results) or len(set(given)) != len(given):
            raise ValueError(
                f"names: must be {len(results)} different names; received {', '.join(given)}"
            )
        return given
    own = [flown_scenario(result).name for result in results]
    if len(set(own)) == len(own):
        return own
    return [f"{name} {k}" for k, name in enumerate(own, 1)]


def differences(results: Sequence[xr.Dataset]) -> dict[str, list]:
    """Keys whose values differ between the scenarios, with each run's value; None: not given."""
    flat = [_flat(json.loads(result.attrs["scenario"])) for result in results]
    keys = dict.fromkeys(key for each in flat for key in each)
    values = {key: [each.get(key) for each in flat] for key in keys if key not in _SAYS_NOTHING}
    return {key: each for key, each in values.items() if any(x != each[0] for x in each)}


def _flat(data, place: str = "") -> dict:
    """Plain data by dotted keys; lists of numbers stay as they are."""
    if isinstance(data, dict):
        parts = {f"{place}.{key}".lstrip("."): value for key, value in data.items()}
    elif isinstance(data, list) and any(isinstance(each, dict) for each in data):
        parts = {f"{place}[{k}]": value for k, value in enumerate(data)}
    else:
        return {place: data}
    return {key: value for name, part in parts.items() for key, value in _flat(part, name).items()}
