"""`torquer campaign`: many runs of a scenario with varied keys; comparison of two campaigns."""

from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

from torquer.cli.options import CodeFromAnywhere, Json, NoReport, NoUserCode

app = App(
    name="campaign",
    help="Many runs of a scenario with varied keys; comparison of two campaigns.",
    version_flags=[],
)


@app.default
def fly(
    scenario: Path,
    *,
    out: Annotated[Path | None, Parameter(help="Output folder [runs/NAME-campaign].")] = None,
    json: Json = False,
    runs: Annotated[int | None, Parameter(help="Number of runs, in place of the file's.")] = None,
    workers: Annotated[int | None, Parameter(help="Number of workers [one per core].")] = None,
    where: Annotated[
        str,
        Parameter(help="Where runs are computed: 'threads', 'processes', or a Dask address."),
    ] = "threads",
    resume: Annotated[
        bool,
        Parameter(help="Continue the campaign in the output folder, or add runs.", negative=""),
    ] = False,
    member: Annotated[
        int | None, Parameter(help="Fly this run alone, with its full record and report.")
    ] = None,
    no_report: NoReport = False,
    no_user_code: NoUserCode = False,
    code_from_anywhere: CodeFromAnywhere = False,
) -> int:
    """Fly the campaign of SCENARIO, many runs with varied keys; write campaign.nc and a report."""
    from torquer.cli import campaign_work as work

    how = work.HowMany(
        workers, where, resume, runs, not no_report, not no_user_code, code_from_anywhere
    )
    if member is not None:
        return work.fly_member(scenario, member, out, json, how)
    return work.fly(scenario, out, json, how)


@app.command
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
    from torquer.cli import campaign_compare as work

    return work.compare(a, b, out, json)
