"""Work of `run`, `validate` and `version`: files, progress bar, summary table."""

import contextlib
import json as json_
import os
import sys
from pathlib import Path

import numpy as np

import torquer
from torquer.cli import FAILED_CODE, INTERRUPTED_CODE
from torquer.cli.modes_work import mode_findings
from torquer.cli.output import console, make_writable, tell_error, writing_to
from torquer.notes.notes import notes_of
from torquer.scenario.load import load_scenario
from torquer.scenario.resolution import notes_on_steps
from torquer.simulation.prepare import blocks_of, modes_for
from torquer.simulation.result import (
    COMPLETE,
    INTERRUPTED,
    STOPPED,
    attributes_of,
    scenario_of,
)
from torquer.simulation.simulate import RunStopped, resume, simulate
from torquer.simulation.size import check_disk, check_memory, size_of, told_bytes, told_time
from torquer.simulation.store import lazily


def run(
    scenario_path: Path, out: Path | None, as_json: bool, go_on: bool, check_steps: bool
) -> int:
    """Simulate, write the output folder, print the summary; return the exit code."""
    scenario = load_scenario(scenario_path)
    out = out or Path("runs") / scenario.name
    check_surroundings(scenario)
    make_writable(out)
    path = out / "result.nc"
    if not go_on:
        _keep_interrupted(out)
    _print_notes(notes_of(scenario))
    code, stopped = 0, None
    with writing_to(out), _progress(scenario.name) as progress:
        try:
            if go_on:
                _check_earlier(path, scenario)
                result = resume(path, progress=progress)
            else:
                result = simulate(scenario, progress=progress, to=path)
        except RunStopped as error:
            result, stopped = error.result, str(error)
            code = INTERRUPTED_CODE if error.interrupted else FAILED_CODE
        if check_steps and not stopped:
            result = _with_measured_error(result, progress)
        summary = _write(result, out)
    _show(summary, out, as_json)
    _print_notes(notes_on_steps(result))
    if stopped:
        tell_error(f"{stopped}; partial results are in {out}")
    return code


def _with_measured_error(result, progress):
    """The result with the error that a second, finer run finds; as it is if that run stops."""
    from torquer.simulation.refined import integration_error

    try:
        errors = integration_error(result, progress=progress)
    except RunStopped as error:
        _print_notes([f"the steps are not checked: {error}"])
        return result
    return result.assign(integration_error_measured=errors.attitude_error.max())


def _print_notes(notes: list[str]) -> None:
    for note in notes:
        console(stderr=True).print(f"note: {note}", style="yellow", soft_wrap=True)


def validate(scenario_path: Path, as_json: bool) -> int:
    """Check a scenario and its law; print notes."""
    try:
        scenario, size = _checked(scenario_path)
    except ValueError as error:
        if not as_json:
            raise
        print(json_.dumps({"valid": False, "errors": str(error).splitlines()}, indent=2))
        return 2
    notes, found = notes_of(scenario), mode_findings(scenario)
    if as_json:
        data = {"scenario": scenario.name, "valid": True, "notes": notes, "size": size._asdict()}
        print(json_.dumps(data | {"modes": [each._asdict() for each in found]}, indent=2))
        return 0
    length = told_time(scenario.steps() * scenario.grid_s)
    print(f"{scenario.name}: valid, {length} of flight; {scenario.simulation.in_words}")
    print(
        f"a run: {size.rows} rows, result of about {told_bytes(size.disk_bytes)}, about "
        f"{told_bytes(size.memory_bytes)} of memory and {told_time(size.computing_s)} of computing"
    )
    for finding in found:
        if not finding.is_fault:  # the notes tell the faults
            print(f"modes: {finding.message}")
    for note in notes:
        print(f"note: {note}")
    return 0


def _checked(scenario_path: Path):
    """The scenario and its size, if its law, field, date and orbit can be used and it can fit."""
    scenario = load_scenario(scenario_path)
    size = size_of(scenario, check_usable(scenario))
    check_memory(size, to_file=True)
    check_disk(size, Path())
    return scenario, size


def check_usable(scenario) -> bool:
    """Whether all laws are compiled; `ValueError` if laws, modes or environment are unusable."""
    blocks = blocks_of(scenario)
    for block in blocks.all():
        block.pack()
    modes_for(scenario, blocks)
    check_surroundings(scenario)
    return blocks.compiled


def check_surroundings(scenario) -> None:
    """Raise `ValueError` if field, date, orbit or air of a scenario cannot be used."""
    around, t_s = scenario.surroundings(), _looks(scenario)
    around.check_dates(*t_s[[0, -1]])
    around.sample(t_s)
    if scenario.spacecraft.aerodynamics and not np.isfinite(around.flow(t_s)).all():
        raise ValueError(
            "environment.atmosphere: must have a finite density along the orbit; received one "
            "beyond the range of floats"
        )


def version(as_json: bool) -> int:
    """Print versions."""
    from importlib.metadata import version as of

    names = ["numpy", "numba", "scipy", "xarray", "pydantic", "pyerfa", "sgp4"]
    versions = {"torquer": torquer.__version__} | {name: of(name) for name in names}
    versions["python"] = sys.version.split()[0]
    if as_json:
        print(json_.dumps(versions, indent=2))
    else:
        print("\n".join(f"{name} {number}" for name, number in versions.items()))
    return 0


def _looks(scenario):
    """Times at which models are checked: both ends of the run, and along the first orbit."""
    end = scenario.steps() * scenario.grid_s
    return np.append(np.linspace(0.0, min(end, scenario.orbit.period_s), 50), end)


def _keep_interrupted(out: Path) -> None:
    """A run that can be resumed is not overwritten."""
    path = out / "result.nc"
    try:
        earlier = attributes_of(path)
    except (OSError, ValueError):
        return  # none, or no result of a run
    if earlier.get("how_it_ended") in (INTERRUPTED, STOPPED):
        raise ValueError(
            f"--out: must hold no unfinished run; received {out} ({earlier['ended']}): "
            "continue with --resume, choose another --out, or remove it"
        )


def _check_earlier(path: Path, scenario) -> None:
    """Raise `ValueError` unless there is a result of this scenario to resume."""
    if not path.is_file():
        raise ValueError(
            f"--resume: must find an interrupted run; received {path.parent} without result.nc"
        )
    try:
        with lazily(path) as earlier:
            began_with, how = scenario_of(earlier), earlier.attrs["how_it_ended"]
    except (OSError, ValueError, KeyError) as error:
        raise ValueError(
            f"--resume: must find a result of a run; received {path} ({error})"
        ) from None
    if began_with != scenario:
        raise ValueError(f"--resume: the scenario must be the one that {path} began with")
    if how == COMPLETE:
        raise ValueError(
            f"--resume: must find an interrupted run; received a complete one in {path}"
        )


@contextlib.contextmanager
def _progress(name: str):
    """Progress callback of a bar on a terminal; None elsewhere."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.progress import Progress

    with Progress(console=console(stderr=True), transient=True) as bar:
        task = bar.add_task(name, total=1.0)
        yield lambda part: bar.update(task, completed=part)


def _write(result, out: Path) -> dict:
    from torquer.analysis.summary import summary_of
    from torquer.report import write_report

    summary = summary_of(result)
    (out / "summary.json").write_text(json_.dumps(summary, indent=2) + "\n", encoding="utf-8")
    with contextlib.suppress(KeyboardInterrupt):
        write_report(result, out)
    return summary


def _show(summary: dict, out: Path, as_json: bool) -> None:
    if as_json:
        print(json_.dumps(summary, indent=2))
        return
    from rich.table import Table

    from torquer.report.flight.summary_rows import rows_of

    table = Table(title=summary["scenario"], show_header=False, title_justify="left")
    for row in rows_of(summary):
        table.add_row(*row)
    console().print(table)
    print(f"{os.fspath(out)}: result.nc, summary.json, report.html, plots/")
