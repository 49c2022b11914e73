"""`torquer campaign`: many runs of a scenario with varied keys; comparison of campaigns."""

import contextlib
import re
import signal
import sys
from functools import partial
from pathlib import Path
from string import ascii_uppercase
from typing import Annotated

from cyclopts import App, Parameter

from torquer.base.folder_lock import claim
from torquer.base.strict_json import json_text
from torquer.cli.examples import show_examples
from torquer.cli.loading import check_code, check_computer, load_result
from torquer.cli.options import CodeOptions, Figure, Json, as_options, options
from torquer.cli.output import (
    check_report_options,
    describe_interrupt,
    make_writable,
    print_error,
    progress_bar,
    say,
    show_summary,
    table,
    table_console,
    write_beside_report,
    writing_to,
)
from torquer.cli.process import FAILED_CODE, SIGNAL_CODE, leave_or_raise
from torquer.simulation.results.file import explain_errors, put
from torquer.simulation.setup.signals import ALL, noting_signals

#: Options of arguments of `fly_campaign`, and of keys that they replace.
_OPTIONS = {"to": "--out", "workers": "--workers", "where": "--where", "campaign.runs": "--runs",
            "computer": "--computer", "part": "--part"}  # fmt: skip
#: Width of the table of a comparison where the output is not a terminal.
_WIDTH = 120
_PART = "Fly part K of N alone, such as 2/8; `torquer campaign join` makes one campaign of all."
app = App(name="campaign", help_epilogue=show_examples("campaign"), version_flags=[])


@options
class CampaignOptions:
    """Options of `torquer campaign`."""

    out: Path | None = None
    """Output folder [runs/NAME-campaign]."""
    json: Json = False
    runs: int | None = None
    """Number of runs, in place of the file's."""
    workers: int | None = None
    """Number of workers [one per core]."""
    where: str = "threads"
    """Where runs are computed: 'threads', 'processes', or a Dask address."""
    part: Annotated[str | None, Parameter(help=_PART)] = None
    resume: bool = False
    """Continue the campaign in the output folder, or add runs."""
    overwrite: bool = False
    """Replace the campaign in the output folder."""
    member: int | None = None
    """Fly this run alone, with its full record and report."""
    computer: Path | None = None
    """Fly the computer in C that `export c` wrote in this folder, or a library built from it."""
    plots: bool = False
    """With --member, draw plots/*.png, too."""
    page: bool = False
    """Write page.pdf, too: success, plots, numbers, models and sources on one page of A4."""
    figure: Figure = None
    no_report: bool = False
    """Write no report and no pictures."""


@app.default
def fly(
    scenario: Path, *, how: CampaignOptions = CampaignOptions(), code: CodeOptions = CodeOptions()
) -> int:
    """Fly the campaign of SCENARIO, many runs with varied keys; write campaign.nc and a report.

    Exit code 1 if every run failed.
    """
    from torquer.campaign.fly import fly_campaign
    from torquer.campaign.store import files_there

    check_report_options(how)
    if how.member is not None:
        return _fly_member(scenario, how.member, how, code)
    if how.plots:
        raise ValueError("--plots: must be given with --member only; received it without")
    part = _part_of(how.part)
    check_computer(how.computer, code)
    satellite, campaign = _load(scenario, how, code)
    out = how.out or Path("runs") / f"{satellite.name}-campaign"
    make_writable(out)
    with noting_signals(ALL, (leave_or_raise,)) as signals, writing_to(out), claim(out):
        try:
            _make_free(out / "campaign.nc", how)
            with _progress(satellite.name) as progress:
                result = fly_campaign(
                    satellite, campaign, to=out / "campaign.nc", workers=how.workers,
                    where=how.where, resume=how.resume, progress=progress, computer=how.computer,
                    part=part,
                )  # fmt: skip
            if part is not None:
                return _say_part(result, how, out)
            with signals.raising():
                summary = _write(result, out, how)
        except KeyboardInterrupt:
            flown = bool(files_there(out / "campaign.nc"))
            print_error(describe_interrupt(out, "the runs flown so far", flown))
            signals.forget()
            return SIGNAL_CODE + (signals.number or signal.SIGINT)
        except ValueError as error:
            text = re.sub(r"(?<!-)\bresume (?=continues|flies)", "--resume ", str(error))
            raise ValueError(as_options(text, _OPTIONS)) from None
    return _show(summary, how, out)


def _show(summary: dict, how: CampaignOptions, out: Path) -> int:
    """Show the summary of a campaign; the exit code."""
    from torquer.campaign.summary import summary_rows

    ended = FAILED_CODE if summary["failed"] == summary["members"] else 0
    if how.json:
        print(json_text(summary))
        return ended
    made = {"report.html": True, "page.pdf": how.page, "plots/": True, "paper/": how.figure}
    report = [name for name, is_made in made.items() if is_made and not how.no_report]
    show_summary(
        summary["name"], summary_rows(summary), out, "campaign.nc", "summary.json", *report
    )
    return ended


def _part_of(text: str | None) -> tuple[int, int] | None:
    """The numbers of --part."""
    if text is None:
        return None
    found = re.fullmatch(r"(\d{1,9})/(\d{1,9})", text, re.ASCII)
    if not found:
        raise ValueError(f"--part: must be K/N, such as 2/8; received {text!r}")
    return int(found[1]), int(found[2])


def _say_part(result, how: CampaignOptions, out: Path) -> int:
    """Say what a part has flown; statistics are those of all parts together."""
    from torquer.campaign.store import in_words

    members, failed = result["member"].values, int((result["how_it_ended"] != "complete").sum())
    told = {"part": how.part, "first": int(members[0]), "last": int(members[-1]), "failed": failed}
    if how.json:
        print(json_text(told))
    else:
        say(
            f"{out}: campaign.nc, part {how.part}: members {in_words(members)}, "
            f"{failed} failed; `torquer campaign join` makes one campaign of all parts"
        )
    return FAILED_CODE if failed == len(members) else 0


@app.command(help_epilogue=show_examples("campaign join"))
def join(
    parts: Annotated[list[Path], Parameter(negative_iterable=())],
    /,
    *,
    out: Annotated[Path, Parameter(help="Output folder.")],
    json: Json = False,
    no_report: Annotated[bool, Parameter(help="Write no report and no pictures.")] = False,
) -> int:
    """Make one campaign of its PARTS, given by their folders or campaign.nc files.

    The parts are flown by `torquer campaign SCENARIO --part K/N`, each into a folder of its own.
    """
    from torquer.campaign.parts import join_parts

    files = [each / "campaign.nc" if each.is_dir() else each for each in parts]
    make_writable(out)
    how = CampaignOptions(out=out, json=json, no_report=no_report)
    with writing_to(out), claim(out):
        try:
            result = join_parts(files, out / "campaign.nc")
        except ValueError as error:
            raise ValueError(as_options(str(error), {"files": "PARTS", "to": "--out"})) from None
        summary = _write(result, out, how)
    return _show(summary, how, out)


def _make_free(path: Path, how: CampaignOptions) -> None:
    """Remove the campaign that is to be replaced; ValueError for one that is not."""
    from torquer.campaign.store import is_there, remove

    if how.resume:
        return
    if how.overwrite:
        remove(path)
    elif is_there(path):
        raise ValueError(
            f"--out: must hold no campaign; received {path}: --resume continues it, --overwrite "
            "replaces it; or choose another --out"
        )


def _write(result, out: Path, how: CampaignOptions) -> dict:
    """Write summary and report; the summary."""
    from torquer.campaign.summary import campaign_summary

    summary = campaign_summary(result)
    put(out / "summary.json", json_text(summary) + "\n")
    if not how.no_report:
        from torquer.report.campaign import write_campaign_report

        write_campaign_report(result, out)
        write_beside_report(result, out, how)
    return summary


def _fly_member(path: Path, member: int, how: CampaignOptions, code: CodeOptions) -> int:
    """Fly one member alone, with its full record and report."""
    from torquer.campaign.sampling import member_scenario
    from torquer.cli.commands.run import RunOptions, run_scenario

    for option, given in (
        ("--resume", how.resume),
        ("--workers", how.workers is not None),
        ("--where", how.where != "threads"),
        ("--computer", how.computer is not None),
        ("--part", how.part is not None),
    ):
        if given:
            raise ValueError(f"{option}: must not be given with --member; received both")
    scenario, campaign = _load(path, how, code)
    if not 0 <= member < campaign.runs:
        raise ValueError(f"--member: must lie within 0..{campaign.runs - 1}; received {member}")
    alone = RunOptions(
        out=how.out, json=how.json, plots=how.plots, page=how.page, figure=how.figure,
        no_report=how.no_report, overwrite=how.overwrite,
    )  # fmt: skip
    return run_scenario(member_scenario(scenario, campaign, member), alone)


def _load(path: Path, how: CampaignOptions, code: CodeOptions):
    """Scenario and campaign of a file, checked for flight with these options."""
    from torquer.campaign.load import campaign_from_data, check_own_parts, load_campaign
    from torquer.scenario.load import check_orbit_environment

    scenario, campaign = load_campaign(path)
    check_code(scenario, path, code, campaign)
    check_own_parts(campaign, scenario)
    check_orbit_environment(scenario)
    if how.runs is not None:
        table = campaign.model_dump(exclude_unset=True) | {"runs": how.runs}
        try:
            campaign = campaign_from_data(table, scenario)
        except ValueError as error:
            raise ValueError(as_options(str(error), _OPTIONS)) from None
    return scenario, campaign


@contextlib.contextmanager
def _progress(name: str):
    """Callback for a bar with rate and remaining time on a terminal; None elsewhere."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.progress import MofNCompleteColumn, TextColumn, TimeRemainingColumn

    rate = TextColumn("{task.fields[rate]}")
    with progress_bar(MofNCompleteColumn(), rate, TimeRemainingColumn()) as bar:
        task = bar.add_task(name, total=None, rate="")

        def update(progress) -> None:
            speed = bar.tasks[0].speed
            rate = f"{speed:.0f} runs/s" if speed else ""
            bar.update(task, completed=progress.done, total=progress.runs, rate=rate)

        yield update


@app.command(help_epilogue=show_examples("campaign compare"))
def compare(
    a: Path,
    b: Path,
    *more: Path,
    out: Annotated[
        Path | None, Parameter(help="Folder for the report and its pictures [not written].")
    ] = None,
    json: Json = False,
) -> int:
    """Compare the results of two to six campaigns, given by their folders or campaign.nc files.

    Means, quantiles and success rates with intervals, their differences from those of A, and rank
    tests.
    """
    paths = (a, b, *more)
    results = [
        _result_in(path, letter) for path, letter in zip(paths, ascii_uppercase, strict=False)
    ]
    with explain_errors(", ".join(map(str, paths))):
        found, grid, about, write = (_two if len(paths) == 2 else _several)(results)
    if out is not None:
        make_writable(out)
        with writing_to(out):
            write(out)
    if json:
        print(json_text(found))
        return 0
    screen = table_console(_WIDTH)
    screen.print(table(*grid))
    screen.print(about)
    if out is not None:
        say(f"{out}: report.html, plots/")
    return 0


def _two(results) -> tuple:
    """What two campaigns differ in: data, table, how to read it, what writes the report."""
    from torquer.campaign.comparison import comparison
    from torquer.report.campaign import compare_campaigns
    from torquer.report.campaign.tables import about_comparison, comparison_grid

    found = comparison(*results)
    write = partial(compare_campaigns, *results)
    return found, comparison_grid(found), about_comparison(found), write


def _several(results) -> tuple:
    """The same of more."""
    from torquer.campaign.several import compare_several
    from torquer.report.campaign import compare_several_campaigns
    from torquer.report.campaign.several import about_several, several_grid

    found = compare_several(results)
    write = partial(compare_several_campaigns, results)
    return found, several_grid(found), about_several(found), write


def _result_in(path: Path, name: str):
    """The campaign of a file, or of the folder it was written to."""
    what = "the folder or the campaign.nc of a flown campaign"
    result = load_result(path, name, "campaign.nc", what)
    if "campaign" not in result.attrs:
        raise ValueError(f"{name}: must be the result of a campaign; received {path}")
    return result
