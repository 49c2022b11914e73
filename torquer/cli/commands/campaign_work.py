"""Work of `torquer campaign`: many runs of a scenario, their files, one of them flown again."""

import contextlib
import re
import signal
import sys
from pathlib import Path

from torquer.base.folder_lock import claimed
from torquer.base.strict_json import json_text
from torquer.campaign.fly import fly_campaign
from torquer.campaign.load import campaign_from_data, load_campaign
from torquer.campaign.sampling import member_scenario
from torquer.campaign.store import files_there, is_there, remove
from torquer.campaign.summary import campaign_summary, summary_rows
from torquer.cli.commands.campaign import CampaignOptions
from torquer.cli.commands.run import RunOptions, run_scenario
from torquer.cli.loading import check_code, check_computer, check_orbit_environment
from torquer.cli.options import CodeOptions, as_options
from torquer.cli.output import (
    interrupted,
    make_writable,
    print_error,
    progress_bar,
    show_summary,
    writing_to,
)
from torquer.cli.process import SIGNAL_CODE, leave_or_raise
from torquer.simulation.results.file import put
from torquer.simulation.setup.signals import ALL, noting_signals

#: Options of arguments of `fly_campaign`, and of keys that they replace.
_OPTIONS = {"to": "--out", "workers": "--workers", "where": "--where", "campaign.runs": "--runs",
            "computer": "--computer"}  # fmt: skip


def fly(path: Path, how: CampaignOptions, code: CodeOptions) -> int:
    """Fly a campaign, write its folder, print the summary; return the exit code."""
    if how.plots:
        raise ValueError("--plots: must be given with --member only; received it without")
    check_computer(how.computer, code)
    scenario, campaign = _loaded(path, how, code)
    out = how.out or Path("runs") / f"{scenario.name}-campaign"
    make_writable(out)
    with noting_signals(ALL, (leave_or_raise,)) as signals, writing_to(out), claimed(out):
        try:
            _make_free(out / "campaign.nc", how)
            with _progress(scenario.name) as progress:
                result = fly_campaign(
                    scenario, campaign, to=out / "campaign.nc", workers=how.workers,
                    where=how.where, resume=how.resume, progress=progress, computer=how.computer,
                )  # fmt: skip
            with signals.raising():
                summary = _written(result, out, how)
        except KeyboardInterrupt:
            flown = bool(files_there(out / "campaign.nc"))
            print_error(interrupted(out, "the runs flown so far", flown))
            signals.forget()
            return SIGNAL_CODE + (signals.number or signal.SIGINT)
        except ValueError as error:
            text = re.sub(r"(?<!-)\bresume (?=continues|flies)", "--resume ", str(error))
            raise ValueError(as_options(text, _OPTIONS)) from None
    if how.json:
        print(json_text(summary))
        return 0
    report = () if how.no_report else ("report.html", "plots/")
    show_summary(
        summary["name"], summary_rows(summary), out, "campaign.nc", "summary.json", *report
    )
    return 0


def _make_free(path: Path, how: CampaignOptions) -> None:
    """Remove the campaign that is to be replaced; ValueError for one that is not."""
    if how.resume:
        return
    if how.overwrite:
        remove(path)
    elif is_there(path):
        raise ValueError(
            f"--out: must hold no campaign; received {path}: --resume continues it, --overwrite "
            "replaces it; or choose another --out"
        )


def _written(result, out: Path, how: CampaignOptions) -> dict:
    """Write summary and report; the summary."""
    summary = campaign_summary(result)
    put(out / "summary.json", json_text(summary) + "\n")
    if not how.no_report:
        from torquer.report.campaign import write_campaign_report

        write_campaign_report(result, out)
    return summary


def fly_member(path: Path, member: int, how: CampaignOptions, code: CodeOptions) -> int:
    """Fly one member alone, with its full record and report."""
    for option, given in (
        ("--resume", how.resume),
        ("--workers", how.workers is not None),
        ("--where", how.where != "threads"),
        ("--computer", how.computer is not None),
    ):
        if given:
            raise ValueError(f"{option}: must not be given with --member; received both")
    scenario, campaign = _loaded(path, how, code)
    if not 0 <= member < campaign.runs:
        raise ValueError(f"--member: must lie within 0..{campaign.runs - 1}; received {member}")
    alone = RunOptions(
        out=how.out, json=how.json, plots=how.plots, no_report=how.no_report,
        overwrite=how.overwrite,
    )  # fmt: skip
    return run_scenario(member_scenario(scenario, campaign, member), alone)


def _loaded(path: Path, how: CampaignOptions, code: CodeOptions):
    """Scenario and campaign of a file, checked for flight with these options."""
    scenario, campaign = load_campaign(path)
    check_code(scenario, path, code, campaign)
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
