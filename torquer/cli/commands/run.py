"""`torquer run`: a scenario simulated, with its files, progress bar and summary."""

import signal
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Annotated

from torquer.base.folder_lock import claim
from torquer.base.limits import Range
from torquer.base.strict_json import json_text
from torquer.cli.compiling import compiling_shown, show_progress
from torquer.cli.loading import check_computer, find_code, load_checked
from torquer.cli.options import CodeOptions, Figure, Json, as_options, options
from torquer.cli.output import (
    check_report_options,
    describe_interrupt,
    make_writable,
    print_error,
    print_note,
    show_summary,
    write_beside_report,
    writing_to,
)
from torquer.cli.process import (
    FAILED_CODE,
    INTERRUPTED_CODE,
    SIGNAL_CODE,
    leave_or_raise,
    leave_out_unused,
)
from torquer.simulation.results.file import lazily, put
from torquer.simulation.setup.signals import ALL, Stop, noting_signals


@options
class RunOptions:
    """Options of `torquer run`."""

    out: Path | None = None
    """Output folder [runs/NAME]."""
    json: Json = False
    resume: bool = False
    """Resume the interrupted run in the output folder."""
    overwrite: bool = False
    """Replace an unfinished run in the output folder."""
    check_steps: bool = False
    """Measure the integration error with a second, finer run."""
    checkpoint_s: Annotated[float, Range("be greater than 0", lambda s: s > 0.0)] = 5.0
    """Seconds between saves of a long run."""
    computer: Path | None = None
    """Fly the computer in C that `export c` wrote in this folder, or a library built from it."""
    plots: bool = False
    """Draw plots/*.png, too; with --resume of a complete run only these and the report."""
    page: bool = False
    """Write page.pdf, too: verdict, plots, numbers, models and sources on one page of A4."""
    figure: Figure = None
    no_report: bool = False
    """Write no report and no pictures."""


def run(
    scenario: Path, *, how: RunOptions = RunOptions(), code: CodeOptions = CodeOptions()
) -> int:
    """Simulate SCENARIO and write result.nc, summary.json and report.html."""
    check_report_options(how)
    check_computer(how.computer, code)
    try:
        flown = load_checked(scenario, code)
        if not find_code(flown):
            leave_out_unused()
        return run_scenario(flown, how)
    except ValueError as error:
        raise ValueError(as_options(str(error), {"computer": "--computer"})) from None


def run_scenario(scenario, how: RunOptions) -> int:
    """Simulate a scenario whose code may be executed, as `run` does; return the exit code."""
    from torquer.analysis.notes.run_notes import run_notes
    from torquer.scenario.load import check_orbit_environment

    out = how.out or Path("runs") / scenario.name
    with compiling_shown():
        check_orbit_environment(scenario)
    make_writable(out)
    # the folder is free again before a late signal ends the process
    with noting_signals(ALL, (leave_or_raise,)) as signals, writing_to(out), claim(out):
        try:
            result, stopped, code = _fly(scenario, out / "result.nc", how)
            if signals.asked and stopped:  # the report can wait: --resume draws it
                code, how = SIGNAL_CODE + signals.number, replace(how, no_report=True)
                signals.forget()
            summary = _write(result, out, signals, how)
        except KeyboardInterrupt:
            print_error(describe_interrupt(out, "partial results", (out / "result.nc").exists()))
            signals.forget()
            return SIGNAL_CODE + (signals.number or signal.SIGINT)
    if how.json:
        print(json_text(summary))
    else:
        from torquer.analysis.summary import summary_rows, told_rows

        made = {"report.html": not how.no_report, "page.pdf": how.page, "plots/": how.plots}
        made["paper/"] = how.figure is not None
        files = ("result.nc", "summary.json", *(name for name, is_made in made.items() if is_made))
        show_summary(summary["scenario"], told_rows(summary_rows(summary)), out, *files)
    for note in run_notes(result):
        print_note(note)
    if stopped:
        goes_on = "" if code == FAILED_CODE else ": continue with --resume"
        print_error(f"{stopped}; partial results are in {out}{goes_on}")
    return code


def _fly(scenario, path: Path, how: RunOptions):
    """(Result, what made the run stop or "", exit code) of a run that writes its file."""
    from torquer.analysis.notes.notes import write_notes
    from torquer.simulation.results.restore import OtherBits
    from torquer.simulation.results.store import check_free
    from torquer.simulation.setup.checkpoints import NotSaved
    from torquer.simulation.setup.simulate import RunStopped, resume, simulate

    kept = (OtherBits, NotSaved)
    if how.resume:
        complete = _check_earlier(path, scenario)
    elif not how.overwrite:
        check_free(
            path, "--out", "--resume continues it, --overwrite replaces it; or choose another --out"
        )
    for note in write_notes(scenario):
        print_note(note)
    with show_progress(scenario.name) as progress, warnings.catch_warnings(record=True) as seen:
        for kind in kept:
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
        if each.category in kept:
            print_note(str(each.message))
    return result, stopped, code


def _with_measured_error(result, progress):
    """The result with the error found by a second, finer run; unchanged if that run stops."""
    from torquer.simulation.setup.simulate import RunStopped
    from torquer.simulation.setup.step_error import integration_error

    try:
        errors = integration_error(result, progress=progress)
    except RunStopped as error:
        print_note(f"the steps are not checked: {error}")
        return result
    return result.assign(integration_error_measured=errors.attitude_error.max())


def _check_earlier(path: Path, scenario) -> bool:
    """Whether an earlier result is complete; `ValueError` if it is not of this scenario."""
    from torquer.simulation.results.dataset import COMPLETE
    from torquer.simulation.results.restore import (
        are_one_run,
        check_same_code,
        check_version,
        scenario_in,
    )

    if not path.is_file():
        raise ValueError(
            f"--resume: must find an interrupted run; received {path.parent} without result.nc"
        )
    try:
        with lazily(path) as earlier:
            check_version(earlier)
            began_with, how = scenario_in(earlier), earlier.attrs["how_it_ended"]
            began = earlier.drop_vars(list(earlier.variables))
    except (OSError, ValueError, KeyError) as error:
        raise ValueError(f"--resume: must find a result of a run; received {error}") from None
    if not are_one_run(began_with, scenario):
        raise ValueError(f"--resume: the scenario must be the one that {path} was started with")
    if how == COMPLETE:  # one that goes on is checked there
        check_same_code(began, scenario)
    return how == COMPLETE


def _write(result, out: Path, signals: Stop, how: RunOptions) -> dict:
    """Write summary and report; a signal ends the drawing."""
    from torquer.analysis.summary import summarise

    summary = summarise(result)
    put(out / "summary.json", json_text(summary) + "\n")
    if how.no_report:
        return summary
    from torquer.report import write_report

    with signals.raising():
        _remove_old_plots(out)
        write_report(result, out, plots=how.plots)
        write_beside_report(result, out, how)
    return summary


def _remove_old_plots(out: Path) -> None:
    """Remove the pictures of an earlier result, which would contradict the report."""
    kinds = {".png", ".svg", ".pdf", ".txt"}
    for folder in (out / "plots", out / "paper"):
        for picture in () if folder.is_symlink() else folder.glob("*.*"):
            is_older = picture.stat().st_mtime < (out / "result.nc").stat().st_mtime
            if picture.suffix in kinds and is_older:
                picture.unlink()
