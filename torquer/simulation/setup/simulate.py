"""Simulate a scenario, or continue from where a result stopped."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from torquer.base.spec import check_spec
from torquer.computer.blocks.law import Law
from torquer.scenario.spec import Scenario
from torquer.simulation.outside.library import Library
from torquer.simulation.results.dataset import (
    COMPLETE,
    FAILED,
    INTERRUPTED,
    STOPPED,
    record_dataset,
    whole_run_names,
    with_state,
)
from torquer.simulation.results.file import NotStorable, explain_errors, lazily
from torquer.simulation.results.restore import (
    OtherBits,
    are_one_run,
    check_version,
    other_bits,
    restore,
    scenario_in,
)
from torquer.simulation.results.store import InFile, InMemory, check_free, drop_parts, gather
from torquer.simulation.setup.checkpoints import CHECKPOINT_S, Checkpoints, advance_in_pieces
from torquer.simulation.setup.run import Run, prepare, record_this_instant
from torquer.simulation.setup.signals import noted_signals, noting_signals
from torquer.simulation.setup.size import check_disk, check_memory, estimate_size

if TYPE_CHECKING:
    import xarray as xr


class RunStopped(Exception):
    """A run that ended early. `result` holds what was computed until then; `interrupted` is true
    if the keyboard stopped it, not a failure.

        >>> try:
        ...     torquer.simulate(scenario, lambda t_s, *inputs: (float("nan"), 0.0, 0.0))
        ... except torquer.RunStopped as stopped:
        ...     until_s = float(stopped.result.time[-1])
        >>> until_s
        0.0
    """

    def __init__(self, reason: str, result: xr.Dataset, interrupted: bool):
        super().__init__(reason)
        self.result = result
        self.interrupted = interrupted


def simulate(
    scenario: Scenario,
    law: Law | Callable | None = None,
    *,
    laws: Mapping[str, Law | Callable] | None = None,
    until_s: float | None = None,
    progress: Callable[[float], None] | None = None,
    to: str | os.PathLike | None = None,
    checkpoint_s: float = CHECKPOINT_S,
    overwrite: bool = False,
    computer: str | os.PathLike | None = None,
) -> xr.Dataset:
    """Run a scenario and return its result as an `xarray.Dataset`.

    `law` replaces the scenario's laws, each of `laws` the law of the same name, including its
    parameters; a function without the decorator runs as plain Python. The scenario in the result
    names the laws that were flown.
    `until_s` stops the run early, at the next instant of a reading, of a control cycle or of the
    record; `resume` continues from there. `progress` is called with the fraction done, 0..1.
    `to`: a file (NetCDF) for the result. A long run is written piece by piece, in bounded memory;
    the result returned then reads its numbers from the file when they are needed. What is computed
    is saved every `checkpoint_s` seconds of computing, so that `resume` can continue from there if
    the process is killed; after a slow save the next waits a hundred times as long as it took.
    An unfinished run in that file is replaced only with `overwrite`.
    `computer`: a folder of `export_c`, or a shared library built from it, whose computer in C flies
    in place of the Python kernels, with the same bits.
    Raises `RunStopped`, with what was computed, if the state or a law's output is not finite, on
    an error inside a law and on a keyboard interrupt.

        >>> damped = torquer.simulate(scenario)
        >>> damped["omega_body"].dims, damped["omega_body"].attrs["units"]
        (('time', 'axis'), 'rad/s')
    """
    scenario = check_scenario(scenario)
    _check_size(scenario, to)
    if to is not None and not overwrite:
        check_free(Path(to), "to", "resume continues it, overwrite=True replaces it")
    with noting_signals() as signals:
        with signals.raising():
            run = flown_by(computer, scenario, law, laws)
        if to is None:
            return finish(run, InMemory(), until_s, progress)
        drop_parts(Path(to))
        return finish(run, InFile(Path(to)), until_s, progress, checkpoint_s)


def resume(
    result: xr.Dataset | str | os.PathLike,
    law: Law | Callable | None = None,
    *,
    laws: Mapping[str, Law | Callable] | None = None,
    until_s: float | None = None,
    progress: Callable[[float], None] | None = None,
    scenario: Scenario | None = None,
    checkpoint_s: float = CHECKPOINT_S,
    computer: str | os.PathLike | None = None,
) -> xr.Dataset:
    """Continue from where a result stopped; the whole is the same to the bit as an unbroken run.

    `result`: a result, or its file, to which the rest of the run is then written. A law that was
    passed from Python must be passed again, unless it can be loaded from a file. `scenario`: that
    of the run, if the files of its laws have moved; its name and description may have changed.
    `computer`: as of `simulate`; it may be given or left out whatever the run began with.
    ValueError for a result that is damaged, of another version of torquer or of another run; a
    warning where the last bits may differ, as on another kind of processor.

        >>> half = torquer.simulate(scenario, until_s=300.0)
        >>> torquer.resume(half).identical(result)
        True
    """
    with noting_signals() as signals:
        if not isinstance(result, str | os.PathLike):
            with signals.raising():
                run = _restore(result, law, laws, scenario, None, computer)
            earlier = result.isel(time=slice(0, run.first_row)).drop_vars(whole_run_names(result))
            return finish(run, InMemory(earlier), until_s, progress)
        path = Path(result)
        gather(path)
        with signals.raising(), lazily(path) as earlier, explain_errors(path):
            run = _restore(earlier, law, laws, scenario, path, computer)
        return finish(run, InFile(path), until_s, progress, checkpoint_s)


def check_scenario(scenario) -> Scenario:
    """The scenario, checked again; ValueError for anything else."""
    if not isinstance(scenario, Scenario):
        raise ValueError(
            "scenario: must be a torquer Scenario (see torquer.load_scenario); "
            f"received {scenario!r}"
        )
    return check_spec(scenario)


def flown_by(computer, scenario: Scenario, law=None, laws=None, stops: bool = False) -> Run:
    """The run of a scenario, by its exported computer if one is given; `stops`: see `prepare`."""
    if computer is None:
        return prepare(scenario, law, laws, stops=stops)
    library = Library(computer)
    run = prepare(scenario, law, laws, stops=stops, library=library)
    library.check_start(run.state.board, run.blocks)
    return run


def _restore(
    result: xr.Dataset, law, laws, scenario: Scenario | None, to: Path | None, computer
) -> Run:
    """The run of a result, where it stopped."""
    check_version(result)
    began = scenario_in(result)
    if scenario is not None and not are_one_run(began, scenario):
        raise ValueError("scenario: must be the one that the run began with; received another")
    scenario = scenario or began
    _check_size(scenario, to)
    run = flown_by(computer, scenario, law, laws)
    restore(run, result)
    for line in other_bits(result):
        warnings.warn(line, OtherBits, stacklevel=3)
    return run


def _check_size(scenario: Scenario, to) -> None:
    size = estimate_size(scenario)
    check_memory(size, to is not None)
    if to is not None:
        check_disk(size, Path(to).parent)


def finish(
    run: Run, store, until_s: float | None = None, progress=None, checkpoint_s=CHECKPOINT_S
) -> xr.Dataset:
    """Run on to the end (or to `until_s`) and return the result so far, which goes to a store."""
    last = run.steps if until_s is None else _last_step(run, until_s)
    run.keep = store.keep
    try:
        return _finish(run, store, last, progress, checkpoint_s)
    except NotStorable as error:
        result = with_state(record_dataset(run), run, FAILED, str(error))
        raise RunStopped(str(error), result, False) from None


def _finish(run: Run, store, last: int, progress, checkpoint_s: float) -> xr.Dataset:
    with noted_signals().raising():
        run.make_ready()
    interrupted = False
    try:
        reason = advance_in_pieces(run, last, progress, Checkpoints(store.checkpoint, checkpoint_s))
    except KeyboardInterrupt:
        reason, interrupted = f"interrupted at t = {run.now_s:g} s", True
    if not run.is_at_end:
        run.enter()
        record_this_instant(run)
    if reason:
        how = INTERRUPTED if interrupted else FAILED
        raise RunStopped(reason, store.result(run, how, reason), interrupted)
    if run.state.at[0] == run.steps:
        return store.result(run, COMPLETE, COMPLETE)
    return store.result(run, STOPPED, f"stopped at t = {run.now_s:g} s as asked")


def _last_step(run: Run, until_s: float) -> int:
    if not until_s >= 0.0:
        raise ValueError(f"until_s: must be a time from 0 on; received {until_s}")
    return math.ceil(min(run.steps, until_s / run.plan.step_s - 1e-9))
