"""`torquer campaign`: many runs of a scenario with varied keys; comparison of two campaigns."""

from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

from torquer.cli.examples import examples_of
from torquer.cli.options import CodeOptions, Json, options

app = App(name="campaign", help_epilogue=examples_of("campaign"), version_flags=[])


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
    no_report: bool = False
    """Write no report and no pictures."""


@app.default
def fly(
    scenario: Path, *, how: CampaignOptions = CampaignOptions(), code: CodeOptions = CodeOptions()
) -> int:
    """Fly the campaign of SCENARIO, many runs with varied keys; write campaign.nc and a report."""
    from torquer.cli.commands import campaign_work as work

    if how.member is None:
        return work.fly(scenario, how, code)
    return work.fly_member(scenario, how.member, how, code)


@app.command(help_epilogue=examples_of("campaign compare"))
def compare(
    a: Path,
    b: Path,
    *,
    out: Annotated[
        Path | None, Parameter(help="Folder for the report and its pictures [not written].")
    ] = None,
    json: Json = False,
) -> int:
    """Compare the results of two campaigns, A and B, given by their folders or campaign.nc files.

    Means, quantiles and success rates with intervals, their differences, and rank tests.
    """
    from torquer.cli.commands import campaign_compare as work

    return work.compare(a, b, out, json)
