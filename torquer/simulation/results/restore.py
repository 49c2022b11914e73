"""A prepared run brought to where a result stopped, if that result can be believed."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np

from torquer.base.user_code import check_unchanged, own_files
from torquer.base.version import VERSION
from torquer.compile.ready import processor
from torquer.computer.computer import Blocks, estimates
from torquer.scenario.spec import Scenario
from torquer.simulation.loop.step import BETWEEN, SENSED, WORKED
from torquer.simulation.results.dataset import (
    arrays_stored,
    digest_result,
    flown_laws,
    flown_scenario,
    identify_blocks,
    mode_regions,
    modes_recorded,
    uplinked_in,
    versions,
)
from torquer.simulation.results.variables import RECORDED, TORQUE, estimated, inputs, write
from torquer.simulation.setup.prepare import make_blocks, make_log
from torquer.simulation.setup.run import AS_BEGUN, Run, describe_files

if TYPE_CHECKING:
    import xarray as xr


class OtherBits(UserWarning):
    """A run goes on where its last bits may come out differently."""


def restore(run: Run, result: xr.Dataset) -> None:
    """Bring a freshly prepared run to where a result of the same scenario and laws stopped.

    ValueError for a result of another version of torquer, of other laws, or changed since.
    """
    check_version(result)
    _check_code(result, run.blocks, run.files)
    cells = result["checkpoint"].values
    _check_state(run, cells)
    if result.attrs.get("digest") != digest_result(result):
        raise ValueError(
            "result: must be as the run left it; received one whose scenario, laws or state have "
            "been changed since"
        )
    _restore_state(run, cells)
    run.piece, run.relative_error = None, float(result.attrs["table_relative_error"])
    run.uplinked = uplinked_in(result)
    run.enter()
    _restore_record(run, result)


def check_same_code(result: xr.Dataset, scenario: Scenario) -> None:
    """ValueError for a result of other laws, or of files that have been edited since."""
    if own_files(scenario):
        _check_code(result, make_blocks(scenario), describe_files(scenario))


def _check_code(result: xr.Dataset, blocks: Blocks, files: dict[str, dict[str, str]]) -> None:
    _check_laws(blocks, result)
    check_unchanged(json.loads(result.attrs.get("parts", "{}")), files, AS_BEGUN)


def check_version(result: xr.Dataset) -> None:
    """ValueError for a result of another version of torquer: its state may mean other things."""
    theirs = _versions_in(result).get("torquer", "an unknown version")
    if theirs != VERSION:
        raise ValueError(
            f"result: must be of torquer {VERSION} to go on from; received one of {theirs}"
        )


def other_bits(result: xr.Dataset) -> list[str]:
    """What is not as it was when the run began, and may change its last bits: one line each."""
    began, now = _versions_in(result), versions()
    pairs = [(name, began.get(name), now[name]) for name in ("python", "numpy", "numba", "scipy")]
    pairs.append(("processor", result.attrs.get("processor"), processor()))
    return [
        f"the run began with {name} {was} and goes on with {name} {this}: the last bits may differ"
        for name, was, this in pairs
        if was != this
    ]


def scenario_in(result: xr.Dataset) -> Scenario:
    """The scenario of a result; ValueError of one line where it is none."""
    try:
        return flown_scenario(result)
    except (KeyError, ValueError) as error:
        lines = str(error).splitlines()
        raise ValueError(f"result: must hold a scenario; received {' '.join(lines[:3])}") from None


#: Keys of a scenario that its motion does not depend on.
_NOT_FLOWN = {"name", "description", "mission"}


def are_one_run(a: Scenario, b: Scenario) -> bool:
    """Whether two scenarios are the same run: but for names, mission, and where laws' files lie.

    What is in those files is compared by itself.
    """
    return _without_files(a.model_dump(exclude=_NOT_FLOWN)) == _without_files(
        b.model_dump(exclude=_NOT_FLOWN)
    )


def _without_files(value):
    """Data without the places of files."""
    if isinstance(value, dict):
        return {key: _without_files(each) for key, each in value.items() if key != "file"}
    if isinstance(value, list | tuple):
        return [_without_files(each) for each in value]
    return value


def _versions_in(result: xr.Dataset) -> dict:
    try:
        return dict(json.loads(result.attrs["versions"]))
    except (KeyError, TypeError, ValueError):
        return {}


def _check_laws(blocks: Blocks, result: xr.Dataset) -> None:
    given, began = identify_blocks(blocks), flown_laws(result)
    for key, law in given.items():
        was = began.get(key, {"name": "none", "parameters": {}, "source": ""})
        if (law["name"], law["parameters"]) != (was["name"], was["parameters"]):
            raise ValueError(
                f"{key}: must be {_in_words(was)}, with which the run began; "
                f"received {_in_words(law)}"
            )
        if law["source"] != was["source"]:
            raise ValueError(
                f"{key} {law['name']}: must be the one with which the run began; its file, or one "
                "that it imports from its folder, has been edited since"
            )


def _in_words(law: dict) -> str:
    return f"{law['name']} {json.dumps(law['parameters'])}"


def _check_state(run: Run, cells: np.ndarray) -> None:
    """ValueError unless a checkpoint is one of this run: its size, and where it stands."""
    size = len(run.state.at) + sum(array.size for array in arrays_stored(run.state))
    if cells.shape != (size,):
        raise ValueError(
            f"result: its checkpoint must have {size} cells, as this scenario and law have; "
            f"received {cells.size}"
        )
    step, waiting = cells[:2]
    if not (step in range(run.steps + 1) and waiting in (BETWEEN, SENSED, WORKED)):
        raise ValueError(
            f"result: its checkpoint must be at a step from 0 to {run.steps}; received {step:g}"
        )


def _restore_state(run: Run, cells: np.ndarray) -> None:
    at = len(run.state.at)
    run.state.at[:] = cells[:at].astype(np.int64)
    for array in arrays_stored(run.state):
        array[...] = cells[at : at + array.size].reshape(array.shape)
        at += array.size


def _restore_record(run: Run, result: xr.Dataset) -> None:
    """The rows of the piece in which the run stands; those before are complete as they are."""
    steps = np.arange(result.sizes["time"]) * run.plan.record_steps
    due = -(-int(run.state.at[0]) // run.plan.record_steps)
    t_s = result["time"].values
    if len(t_s) < due or not np.array_equal(t_s, steps * run.plan.step_s):
        raise ValueError(
            f"result: must have every row of its record to go on from; received {len(t_s)} rows, "
            f"of {due} or more"
        )
    record, count = run.record, len(run.record.rows)
    here = slice(run.first_row, min(len(t_s), run.first_row + count))
    rows = np.arange(here.start, here.stop) % count
    part = result.isel(time=here)
    record.rows["step"][rows] = steps[here]
    wheels, units = len(run.plan.plant.rotors.rows) > 0, run.scenario.spacecraft.units()
    write(part, (*RECORDED, TORQUE) if wheels else RECORDED, record.rows, rows)
    if wheels:
        names = ("wheel_momentum", "wheel_torque")
        record.wheels[rows] = np.hstack([part[name].values for name in names])
    if estimates(run.plan.computer):
        write(part, estimated(units), record.known, rows)
    if run.scenario.simulation.record_inputs:
        write(part, inputs(units), record.known, rows)
    for k, name in enumerate(modes_recorded(run, run.rows())):
        first = sum(len(r.states) for r in list(mode_regions(run.scenario).values())[:k])
        record.modes[rows, k] = part[name].values + first
    at = 0
    for name, _, logged, _ in make_log(run.blocks):
        record.log[rows, at : at + logged.cells] = part[name].values.reshape(len(rows), -1)
        at += logged.cells
