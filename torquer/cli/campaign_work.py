"""Work of `torquer campaign`: many runs of a scenario, their files, one of them flown again."""

import contextlib
import signal
import sys
import warnings
from pathlib import Path
from typing import NamedTuple

from torquer.campaign.fly import OneByOne, fly_campaign
from torquer.campaign.load import campaign_from_data, load_campaign
from torquer.campaign.sampling import member_scenario
from torquer.campaign.summary import campaign_summary, summary_rows
from torquer.cli import SIGNAL_CODE, leave_or_raise
from torquer.cli.claim import claimed
from torquer.cli.output import (
    console,
    json_text,
    make_writable,
    show_summary,
    tell_error,
    writing_to,
)
from torquer.cli.simulate import How, check_surroundings, run_scenario
from torquer.cli.user_code import check_code
from torquer.simulation.file import replacing
from torquer.simulation.stopping import ALL, heeding


class HowMany(NamedTuple):
    """The options of `campaign` that say how it is flown."""

    workers: int | None = None
    where: str = "threads"
    resume: bool = False
    runs: int | None = None
    report: bool = True
    user_code: bool = True
    code_from_anywhere: bool = False


def fly(path: Path, out: Path | None, as_json: bool, how: HowMany) -> int:
    """Fly a campaign, write its folder, print the summary; return the exit code."""
    scenario, campaign = _loaded(path, how)
    out = out or Path("runs") / f"{scenario.name}-campaign"
    make_writable(out)
    with claimed(out), heeding(ALL, (leave_or_raise,)) as signals, writing_to(out):
        try:
            with _progress(scenario.name) as progress, _notes():
                result = fly_campaign(
                    scenario, campaign, to=out / "campaign.nc", workers=how.workers,
                    where=how.where, resume=how.resume, progress=progress,
                )  # fmt: skip
        except KeyboardInterrupt:
            tell_error(f"interrupted; the runs flown so far are in {out}: continue with --resume")
            signals.forget()
            return SIGNAL_CODE + (signals.number or signal.SIGINT)
        summary = campaign_summary(result)
        with replacing(out / "summary.json") as file:
            file.write_text(json_text(summary) + "\n", encoding="utf-8")
        if how.report:
            from torquer.report.campaign import write_campaign_report

            write_campaign_report(result, out)
    if as_json:
        print(json_text(summary))
    else:
        show_summary(summary["name"], summary_rows(summary), out, "campaign.nc", how.report)
    return 0


def fly_member(path: Path, member: int, out: Path | None, as_json: bool, how: HowMany) -> int:
    """Fly one member alone, with its full record and report."""
    for option, given in (
        ("--resume", how.resume),
        ("--workers", how.workers is not None),
        ("--where", how.where != "threads"),
    ):
        if given:
            raise ValueError(f"{option}: must not be given with --member; received both")
    scenario, campaign = _loaded(path, how)
    if not 0 <= member < campaign.runs:
        raise ValueError(f"--member: must lie within 0..{campaign.runs - 1}; received {member}")
    return run_scenario(
        member_scenario(scenario, campaign, member), out, as_json, How(report=how.report)
    )


def _loaded(path: Path, how: HowMany):
    """Scenario and campaign of a file, checked for flight with these options."""
    scenario, campaign = load_campaign(path)
    check_code(scenario, path, how.user_code, how.code_from_anywhere)
    check_surroundings(scenario)
    if how.runs is not None:
        table = campaign.model_dump(exclude_unset=True) | {"runs": how.runs}
        campaign = campaign_from_data(table, scenario)
    return scenario, campaign


@contextlib.contextmanager
def _notes():
    """Within the block, print a note if members are flown one by one."""
    with warnings.catch_warnings():
        warnings.simplefilter("always", OneByOne)
        usual = warnings.showwarning

        def show(message, category, *about, **more):
            if category is OneByOne:
                console(stderr=True).print(f"note: {message}", style="yellow", soft_wrap=True)
            else:
                usual(message, category, *about, **more)

        warnings.showwarning = show
        yield


@contextlib.contextmanager
def _progress(name: str):
    """Callback for a bar with rate and remaining time on a terminal; None elsewhere."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeRemainingColumn,
    )

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console(stderr=True), transient=True) as bar:
        task = bar.add_task(name, total=None, rate="")

        def told(progress) -> None:
            speed = bar.tasks[0].speed
            rate = f"{speed:.0f} runs/s" if speed else ""
            bar.update(task, completed=progress.done, total=progress.runs, rate=rate)

        yield told
