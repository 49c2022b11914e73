"""Work of `run` and `validate`: files, progress bar, summary table."""

import contextlib
import signal
import sys
import warnings
from dataclasses import replace
from pathlib import Path

from torquer.analysis.notes.fault_notes import fault_lines, unnoticed_faults
from torquer.analysis.notes.mode_notes import mode_findings
from torquer.analysis.notes.notes import notes_of
from torquer.base.strict_json import json_text
from torquer.cli import FAILED_CODE, INTERRUPTED_CODE, SIGNAL_CODE, compiling, leave_or_raise
from torquer.cli.app import RunOptions
from torquer.cli.folder_lock import claimed
from torquer.cli.loading import (
    check_code,
    check_computer,
    check_orbit_environment,
    code_of,
    load_checked,
)
from torquer.cli.mistakes import as_options
from torquer.cli.options import CodeOptions
from torquer.cli.output import (
    harmless,
    interrupted,
    make_writable,
    print_error,
    print_note,
    show_summary,
    writing_to,
)
from torquer.scenario.load import data_of, text_of
from torquer.scenario.resolution import notes_on_steps
from torquer.simulation.results.dataset import COMPLETE
from torquer.simulation.results.file import lazily, put
from torquer.simulation.results.restore import OtherBits, check_version, of_one_run, scenario_in
from torquer.simulation.results.store import check_free
from torquer.simulation.setup.checkpoints import NotSaved
from torquer.simulation.setup.prepare import blocks_of, modes_for
from torquer.simulation.setup.run import begin_loop
from torquer.simulation.setup.signals import ALL, Stop, noting_signals
from torquer.simulation.setup.simulate import RunStopped, resume, simulate
from torquer.simulation.setup.size import bytes_text, check_disk, check_memory, size_of, time_text

#: Warnings of a run that are printed as notes.
_NOTES = (OtherBits, NotSaved)


def run(path: Path, how: RunOptions, code: CodeOptions) -> int:
    """Simulate, write the output folder, print the summary; return the exit code."""
    if how.plots and how.no_report:
        raise ValueError("--plots: must not be given with --no-report; received both")
    check_computer(how.computer, code)
    try:
        return run_scenario(load_checked(path, code), how)
    except ValueError as error:
        raise ValueError(as_options(str(error), {"computer": "--computer"})) from None


def run_scenario(scenario, how: RunOptions) -> int:
    """Simulate a scenario whose code may be executed, as `run` does; return the exit code."""
    out = how.out or Path("runs") / scenario.name
    with compiling.compiling_shown():
        # a run that goes on compiles when it is prepared; one that is complete compiles nothing
        if compiling.is_cold() and not how.resume:
            begin_loop(scenario)
        check_orbit_environment(scenario)
    make_writable(out)
    # the folder is free again before a late signal ends the process
    with noting_signals(ALL, (leave_or_raise,)) as signals, writing_to(out), claimed(out):
        try:
            result, stopped, code = _flown(scenario, out / "result.nc", how)
            if signals.asked and stopped:  # the report can wait: --resume draws it
                code, how = SIGNAL_CODE + signals.number, replace(how, no_report=True)
                signals.forget()
            summary = _write(result, out, signals, how)
        except KeyboardInterrupt:
            print_error(interrupted(out, "partial results", (out / "result.nc").exists()))
            signals.forget()
            return SIGNAL_CODE + (signals.number or signal.SIGINT)
    if how.json:
        print(json_text(summary))
    else:
        from torquer.analysis.summary_rows import rows_of

        report = () if how.no_report else ("report.html", *["plots/"] * how.plots)
        files = ("result.nc", "summary.json", *report)
        show_summary(summary["scenario"], rows_of(summary), out, *files)
    for note in notes_on_steps(result):
        print_note(note)
    if stopped:
        goes_on = "" if code == FAILED_CODE else ": continue with --resume"
        print_error(f"{stopped}; partial results are in {out}{goes_on}")
    return code


def _flown(scenario, path: Path, how: RunOptions):
    """(Result, what made the run stop or "", exit code) of a run that writes its file."""
    if how.resume:
        complete = _check_earlier(path, scenario)
    elif not how.overwrite:
        check_free(
            path, "--out", "--resume continues it, --overwrite replaces it; or choose another --out"
        )
    for note in notes_of(scenario):
        print_note(note)
    with progress_of(scenario.name) as progress, warnings.catch_warnings(record=True) as seen:
        for kind in _NOTES:
            warnings.simplefilter("always", kind)
        result, stopped, code = None, "", 0
        saved = {"progress": progress, "checkpoint_s": how.checkpoint_s, "computer": how.computer}
        try:
            if how.resume and complete:
                result = lazily(path)
            elif how.resume:
                result = resume(path, scenario=scenario, **saved)
            else:
                result = simulate(scenario, to=path, overwrite=True, **saved)
        except RunStopped as error:
            result, stopped = error.result, str(error)
            code = INTERRUPTED_CODE if error.interrupted else FAILED_CODE
        if how.check_steps and not stopped:
            result = _with_measured_error(result, progress)
    for each in seen:
        if each.category in _NOTES:
            print_note(str(each.message))
    return result, stopped, code


def _with_measured_error(result, progress):
    """The result with the error found by a second, finer run; unchanged if that run stops."""
    from torquer.simulation.setup.step_error import integration_error

    try:
        errors = integration_error(result, progress=progress)
    except RunStopped as error:
        print_note(f"the steps are not checked: {error}")
        return result
    return result.assign(integration_error_measured=errors.attitude_error.max())


def validate(path: Path, as_json: bool, code: CodeOptions = CodeOptions()) -> int:
    """Check a scenario and its law; print notes."""
    from torquer.flight.c99.export import export_notes

    try:
        scenario = load_checked(path, code)
        campaign = _campaign_in(path, scenario)
        check_code(scenario, path, code, campaign)
        size = _checked_size(scenario)
    except ValueError as error:
        if not as_json:
            raise
        print(json_text({"valid": False, "errors": str(error).splitlines()}))
        return 2
    notes, found = notes_of(scenario) + export_notes(scenario), mode_findings(scenario)
    executed = {file: key for key, file in reversed(code_of(scenario, campaign).items())}
    if as_json:
        data = {"scenario": scenario.name, "valid": True, "notes": notes, "size": size._asdict()}
        data["compiles_first"] = compiling.ahead()
        data["executes"] = sorted(map(str, executed))
        if campaign:
            data["campaign"] = campaign.model_dump(mode="json", exclude_none=True)
        data["unnoticed_faults"] = unnoticed_faults(scenario)._asdict()
        print(json_text(data | {"modes": [each._asdict() for each in found]}))
        return 0
    length = time_text(scenario.steps() * scenario.grid_s)
    print(f"{scenario.name}: valid, {length} of flight; {scenario.simulation.in_words}")
    print(
        f"a run: {size.rows} rows, result of about {bytes_text(size.disk_bytes)}, about "
        f"{bytes_text(size.memory_bytes)} of memory and {time_text(size.computing_s)} of computing"
    )
    if compiling.ahead():
        print(compiling.AHEAD)
    if campaign:
        print(f"campaign: {campaign.in_words}")
    for file, key in reversed(executed.items()):
        place = key.removesuffix(".file")
        print(harmless(f"executes {file} ({place}); --no-user-code refuses it"))
    for finding in found:
        if not finding.is_fault:  # the faults are among the notes
            print(f"modes: {finding.message}")
    for line in fault_lines(scenario):
        print(f"faults: {line}")
    for note in notes:
        print(f"note: {note}")
    return 0


def _campaign_in(path: Path, scenario):
    """The campaign in a file, checked with its scenario; None for a file without."""
    table = data_of(text_of(path, "scenario"), "scenario").get("campaign")
    if table is None:
        return None
    from torquer.campaign.load import campaign_from_data

    return campaign_from_data(table, scenario, path.parent)


def _checked_size(scenario):
    """The size of a run, if its law, field, date and orbit can be used and it can fit."""
    size = size_of(scenario, check_usable(scenario))
    check_memory(size, to_file=True)
    check_disk(size, Path())
    return size


def check_usable(scenario) -> bool:
    """Whether all laws are compiled; `ValueError` if laws, modes or environment are unusable."""
    blocks = blocks_of(scenario)
    for block in blocks.all():
        block.pack()
    modes_for(scenario, blocks)
    check_orbit_environment(scenario)
    return blocks.compiled


def _check_earlier(path: Path, scenario) -> bool:
    """Whether an earlier result is complete; `ValueError` if it is not of this scenario."""
    if not path.is_file():
        raise ValueError(
            f"--resume: must find an interrupted run; received {path.parent} without result.nc"
        )
    try:
        with lazily(path) as earlier:
            check_version(earlier)
            began_with, how = scenario_in(earlier), earlier.attrs["how_it_ended"]
    except (OSError, ValueError, KeyError) as error:
        raise ValueError(f"--resume: must find a result of a run; received {error}") from None
    if not of_one_run(began_with, scenario):
        raise ValueError(f"--resume: the scenario must be the one that {path} was started with")
    return how == COMPLETE


@contextlib.contextmanager
def progress_of(name: str):
    """Progress callback for a bar on a terminal; None elsewhere."""
    cold = compiling.is_cold()
    if not sys.stderr.isatty():
        if cold:
            compiling.print_once()
        yield None
        return
    with compiling.bars() as shown, contextlib.ExitStack() as stack:
        task = shown.add_task(name, total=1.0, visible=not cold)
        if not cold:
            yield lambda part: shown.update(task, completed=part)
            return
        first = shown.add_task(compiling.NOTE, total=1.0)
        stack.enter_context(compiling.counting(lambda part: shown.update(first, completed=part)))

        def update(part: float) -> None:  # from now on all is compiled
            shown.update(first, visible=False)
            shown.update(task, completed=part, visible=True)

        yield update


def _write(result, out: Path, signals: Stop, how: RunOptions) -> dict:
    """Write summary and report; a signal ends the drawing."""
    from torquer.analysis.summary import summary_of

    summary = summary_of(result)
    put(out / "summary.json", json_text(summary) + "\n")
    if how.no_report:
        return summary
    from torquer.report import write_report

    with signals.raising():
        _remove_old_plots(out)
        write_report(result, out, plots=how.plots)
    return summary


def _remove_old_plots(out: Path) -> None:
    """Remove the pictures of an earlier result, which would contradict the report."""
    if (out / "plots").is_symlink():
        return
    for picture in (*out.glob("plots/*.png"), *out.glob("plots/*.svg")):
        if picture.stat().st_mtime < (out / "result.nc").stat().st_mtime:
            picture.unlink()
