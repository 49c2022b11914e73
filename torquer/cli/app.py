"""The commands: thin layers over the package; a user error gives one line and exit code 2."""

import sys
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import App, CycloptsError, Parameter

import torquer
import torquer.cli
from torquer.cli.campaign import app as campaign_app
from torquer.cli.design import app as design_app
from torquer.cli.examples import show_examples
from torquer.cli.field import app as field_app
from torquer.cli.gallery import app as gallery_app
from torquer.cli.options import CodeFromAnywhere, Json, NoReport, NoUserCode
from torquer.cli.output import drop_output, finish_output, json_text, tell_error
from torquer.cli.theory import theory
from torquer.cli.wheels import app as wheels_app

app = App(
    name="torquer",
    help="Satellite attitude control with magnetorquers and reaction wheels.",
    version=torquer.__version__,
    version_flags=["--version"],
    default_parameter=Parameter(negative_iterable=()),
    suppress_keyboard_interrupt=False,
)

app.command(campaign_app)
app.command(design_app)
app.command(field_app)
app.command(gallery_app)
app.command(theory)
app.command(wheels_app)


@app.command
def run(
    scenario: Path,
    *,
    out: Annotated[Path | None, Parameter(help="Output folder [runs/NAME].")] = None,
    json: Json = False,
    resume: Annotated[
        bool, Parameter(help="Resume the interrupted run in the output folder.", negative="")
    ] = False,
    overwrite: Annotated[
        bool, Parameter(help="Replace an unfinished run in the output folder.", negative="")
    ] = False,
    check_steps: Annotated[
        bool,
        Parameter(help="Measure the integration error with a second, finer run.", negative=""),
    ] = False,
    checkpoint_s: Annotated[float, Parameter(help="Seconds between saves of a long run.")] = 5.0,
    no_report: NoReport = False,
    no_user_code: NoUserCode = False,
    code_from_anywhere: CodeFromAnywhere = False,
) -> int:
    """Simulate SCENARIO and write result.nc, summary.json, report.html and plots/*.png."""
    from torquer.cli import simulate as work

    how = work.How(
        resume, overwrite, check_steps, checkpoint_s, not no_report, not no_user_code,
        code_from_anywhere,
    )  # fmt: skip
    return work.run(scenario, out, json, how)


@app.command
def validate(
    scenario: Path,
    *,
    json: Json = False,
    no_user_code: NoUserCode = False,
    code_from_anywhere: CodeFromAnywhere = False,
) -> int:
    """Check SCENARIO without running it: errors, and notes on likely problems."""
    if torquer.cli.own_process:
        from torquer.cli.plain_kernels import without_compiler

        without_compiler(scenario)
    from torquer.cli import simulate as work

    return work.validate(scenario, json, not no_user_code, code_from_anywhere)


@app.command
def budget(
    scenario: Path,
    *,
    out: Annotated[Path | None, Parameter(help="Folder for torques.png [not drawn].")] = None,
    hold: Annotated[
        bool,
        Parameter(
            help="Do not simulate: hold the initial attitude in the frame of initial.reference.",
            negative="",
        ),
    ] = False,
    json: Json = False,
    no_user_code: NoUserCode = False,
    code_from_anywhere: CodeFromAnywhere = False,
) -> int:
    """Disturbance torques of SCENARIO along its motion, compared with what the coils can give."""
    from torquer.cli import budget as work

    return work.show(scenario, out, hold, json, not no_user_code, code_from_anywhere)


@app.command
def modes(
    scenario: Path,
    *,
    mermaid: Annotated[
        bool, Parameter(help="Print the diagram as Mermaid text.", negative="")
    ] = False,
    svg: Annotated[Path | None, Parameter(help="File for the diagram as a picture.")] = None,
    json: Json = False,
    no_user_code: NoUserCode = False,
    code_from_anywhere: CodeFromAnywhere = False,
) -> int:
    """Show the modes of SCENARIO: states, transitions, dead ends, conflicts, chatter."""
    from torquer.cli import modes_work as work

    code = (not no_user_code, code_from_anywhere)
    return work.show(scenario, mermaid, svg, json, *code)


@app.command
def filter_check(
    scenario: Path,
    *,
    runs: Annotated[int | None, Parameter(help="Number of runs (200).")] = None,
    expected: Annotated[
        bool, Parameter(help="Predict the accuracy, without simulating.", negative=())
    ] = False,
    out: Annotated[Path | None, Parameter(help="Folder for report and pictures.")] = None,
    json: Json = False,
    no_user_code: NoUserCode = False,
    code_from_anywhere: CodeFromAnywhere = False,
) -> int:
    """Check the Kalman filter of SCENARIO: its errors over many runs against its own covariance.

    NEES, NIS and whiteness with their chi-square bands; errors compared with linear covariance
    analysis. Exit code 1 if a statistic fails. With --expected, without simulating: the accuracy
    with and without the Sun in view, and gaps in observability, for the sensors of each filter
    and for each sensor alone.
    """
    from torquer.cli import filter_work as work

    code = (not no_user_code, code_from_anywhere)
    if expected:
        return work.expect(scenario, runs, out, json, *code)
    return work.check(scenario, runs, out, json, *code)


@app.command
def schema() -> int:
    """Print the JSON schema of scenario files, for editors."""
    import json

    from torquer.campaign.keys import file_schema

    print(json.dumps(file_schema(), indent=2))
    return 0


@app.command
def explain(key: str | None = None, /, *, json: Json = False) -> int:
    """Explain KEY of scenario files: meaning, unit, range and default.

    KEY is a key ("spacecraft.coils.limit_a_m2"), a table ("coils"), the last part of either, or
    the kind of a table ("bdot"). Without KEY all tables are listed.
    """
    from torquer.cli import explain as work

    return work.show(key, json)


@app.command
def version(*, json: Json = False) -> int:
    """Print the versions of torquer and its numerical dependencies."""
    from torquer.cli import version_work as work

    return work.version(json)


@app.command
def init(
    name: str | None = None,
    /,
    *,
    example: Annotated[
        str | None, Parameter(help="Copy this example instead, with the files it refers to.")
    ] = None,
    listed: Annotated[
        bool, Parameter(name="--list", help="List the examples.", negative="")
    ] = False,
    json: Json = False,
) -> int:
    """Write NAME.toml: a commented scenario to start from."""
    from torquer.cli import init_work as work

    return work.init(name, example, listed, json)


@app.command
def compare(
    *results: Path,
    out: Annotated[Path | None, Parameter(help="Folder for the pictures [not drawn].")] = None,
    json: Json = False,
) -> int:
    """Compare two to six runs: RESULTS are their output folders or result.nc files."""
    from torquer.cli import compare_work as work

    return work.compare(results, out, json)


@app.command
def completion(
    shell: Literal["bash", "zsh", "fish", "powershell"] | None = None,
    /,
    *,
    install: Annotated[
        bool,
        Parameter(help="Install it for the shell instead of printing it.", negative=""),
    ] = False,
) -> int:
    """Print the completion script for SHELL [the current one]: Tab completes commands, options."""
    if install:
        print(f"{app.install_completion(shell=shell)}: start a new shell to use it")
    else:
        print(app.generate_completion(shell=shell))
    return 0


show_examples(app)


def answer(arguments: list[str] | None = None) -> int | None:
    """Run a command; return its exit code: 2 on a user error, none or 0 on success."""
    code = 0
    try:
        code = app(arguments, exit_on_error=False, print_error=False, result_action="return_value")
        finish_output()
    except BrokenPipeError:  # the reader, such as `head`, has closed the pipe
        drop_output()
    except (CycloptsError, ValueError, OSError, MemoryError) as error:
        told = str(error) or repr(error)
        tell_error(told)
        if "--json" in (sys.argv[1:] if arguments is None else arguments):
            _print_as_json(told)
        drop_output()
        code = 2
    return code


def _print_as_json(told: str) -> None:
    """User errors for programs that read standard output."""
    with suppress(OSError):
        print(json_text({"errors": [line for line in told.split("\n") if line]}))
