"""The commands: thin layers over the package; a user error gives one line and exit code 2."""

import sys
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import App, CycloptsError, Parameter

import torquer
import torquer.cli
from torquer.base.strict_json import json_text
from torquer.cli.commands.board import app as board_app
from torquer.cli.commands.campaign import app as campaign_app
from torquer.cli.commands.design import app as design_app
from torquer.cli.commands.export import app as export_app
from torquer.cli.commands.field import app as field_app
from torquer.cli.commands.gallery import app as gallery_app
from torquer.cli.commands.ground import app as ground_app
from torquer.cli.commands.kernels import app as kernels_app
from torquer.cli.commands.telemetry import app as telemetry_app
from torquer.cli.commands.theory import app as theory_app
from torquer.cli.commands.wheels import app as wheels_app
from torquer.cli.examples import show_examples
from torquer.cli.mistakes import in_words
from torquer.cli.options import CodeOptions, Json, Whole, at_least, options, positive
from torquer.cli.output import drop_output, finish_output, print_error

app = App(
    name="torquer",
    help="Satellite attitude control with magnetorquers and reaction wheels.",
    version=torquer.__version__,
    version_flags=["--version"],
    default_parameter=Parameter(negative=()),  # no --no-X for each flag X
    suppress_keyboard_interrupt=False,
)

app.command(board_app)
app.command(campaign_app)
app.command(design_app)
app.command(export_app)
app.command(field_app)
app.command(gallery_app)
app.command(ground_app)
app.command(kernels_app)
app.command(telemetry_app)
app.command(theory_app)
app.command(wheels_app)


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
    checkpoint_s: float = 5.0
    """Seconds between saves of a long run."""
    computer: Path | None = None
    """Fly the computer in C that `export c` wrote in this folder, or a library built from it."""
    plots: bool = False
    """Draw plots/*.png, too; with --resume of a complete run only these and the report."""
    no_report: bool = False
    """Write no report and no pictures."""


@app.command
def run(
    scenario: Path, *, how: RunOptions = RunOptions(), code: CodeOptions = CodeOptions()
) -> int:
    """Simulate SCENARIO and write result.nc, summary.json and report.html."""
    from torquer.cli.commands import simulate as work

    return work.run(scenario, how, code)


@app.command
def validate(scenario: Path, *, json: Json = False, code: CodeOptions = CodeOptions()) -> int:
    """Check SCENARIO without running it: errors, and notes on likely problems."""
    if torquer.cli.own_process:
        from torquer.cli.plain_kernels import without_compiler

        without_compiler(scenario)
    from torquer.cli.commands import simulate as work

    return work.validate(scenario, json, code)


@options
class BudgetOptions:
    """Options of `torquer budget`."""

    out: Path | None = None
    """Folder for torques.png [not drawn]."""
    hold: bool = False
    """Do not simulate: hold the initial attitude in the frame of initial.reference."""
    json: Json = False


@app.command
def budget(
    scenario: Path, *, how: BudgetOptions = BudgetOptions(), code: CodeOptions = CodeOptions()
) -> int:
    """Disturbance torques of SCENARIO along its motion, compared with what the coils can give."""
    from torquer.cli.commands import budget as work

    return work.show(scenario, how, code)


@options
class ModesOptions:
    """Options of `torquer modes`."""

    mermaid: bool = False
    """Print the diagram as Mermaid text."""
    svg: Path | None = None
    """File for the diagram as a picture."""
    json: Json = False


@app.command
def modes(
    scenario: Path, *, how: ModesOptions = ModesOptions(), code: CodeOptions = CodeOptions()
) -> int:
    """Show the modes of SCENARIO: states, transitions, dead ends, conflicts, chatter."""
    from torquer.cli.commands import modes as work

    return work.show(scenario, how, code)


@options
class FilterOptions:
    """Options of `torquer filter-check`."""

    runs: Whole = None
    """Number of runs [200]."""
    attitude_sigma_deg: Annotated[float | None, at_least(0.0)] = None
    """Spread of the initial attitude about SCENARIO's, each axis; 180: any attitude [any; 5 if it
    is relative to the orbital frame].
    """
    rate_sigma_deg_s: Annotated[float | None, at_least(0.0)] = None
    """Spread of the initial rate about SCENARIO's, each axis [the orbital rate, or a tenth of
    SCENARIO's rate].
    """
    expected: bool = False
    """Predict the accuracy, without simulating."""
    computer: Path | None = None
    """Fly the computer in C that `export c` wrote in this folder, or a library built from it."""
    out: Path | None = None
    """Folder for report and pictures."""
    json: Json = False


@app.command
def filter_check(
    scenario: Path, *, how: FilterOptions = FilterOptions(), code: CodeOptions = CodeOptions()
) -> int:
    """Check the Kalman filter of SCENARIO: its errors over many runs against its own covariance.

    Each run draws noise, start, and errors of the sensors. NEES, NIS and whiteness with their
    chi-square bands; errors compared with linear covariance analysis; readings rejected, restarts;
    a verdict. Exit code 1 unless it is 'consistent'. With --expected, without simulating: the
    accuracy with and without the Sun in view, and gaps in observability, for the sensors of each
    filter and for each sensor alone.
    """
    from torquer.cli.commands import filter_check as work

    return (work.expect if how.expected else work.check)(scenario, how, code)


@options
class FaultOptions:
    """Options of `torquer faults`."""

    only: list[str] | None = None
    """Only faults with this in their names, such as 'gyro' or 'coil 0 dead'; may be repeated."""
    at_h: list[float] | None = None
    """Hours after the start at which faults strike [in each mode]; may be repeated."""
    hours: Annotated[float | None, positive()] = None
    """Length of each flight in hours [SCENARIO's]."""
    seed: Annotated[Whole, at_least(0)] = None
    """Seed of all random numbers [SCENARIO's]."""
    workers: Whole = None
    """Flights at once [one per core]."""
    out: Path | None = None
    """Output folder [runs/NAME-faults]."""
    json: Json = False


@app.command
def faults(
    scenario: Path, *, how: FaultOptions = FaultOptions(), code: CodeOptions = CodeOptions()
) -> int:
    """Fly SCENARIO with every single fault of its sensors, coils, wheels and computer.

    Each fault strikes in each mode that the flight without a fault visits: in the middle of the
    longest stay, or next to it with the Sun in view; with guards and without. Guards are
    regions of modes without laws, estimators and settings. Lost: the flight ended early, or the
    rate exceeds 2 deg/s in the last revolution (or twice that without a fault). Safe: not lost,
    the limits of [mission] hold during the whole last revolution, and the coils used at most 3
    times the energy without a fault. Degraded: all else. Noticed: the modes entered a state
    that they do not enter without the fault. Exit code 1 if a flight with guards is lost.
    """
    from torquer.cli.commands import faults as work

    return work.fly(scenario, how, code)


@options
class FlyOptions:
    """Options of `torquer fly`."""

    software: Path | None = None
    """File of the flight software [that of Chibis-M]."""
    commands: Path | None = None
    """File of commands with the times at which they are sent."""
    faults: Path | None = None
    """File of faults and reboots."""
    computer: Path | None = None
    """Fly the computer in C that `export c` wrote in this folder, or a library built from it."""
    memory: Path | None = None
    """Folder of the non-volatile memory, kept after the flight [in memory, as delivered]."""
    speed: Annotated[float | None, positive()] = None
    """How many times real time at most [as fast as it goes]."""
    realtime: bool = False
    """Fly in real time."""
    listen: str | None = None
    """Link to the ground: tcp:HOST:PORT, udp:HOST:PORT, can:virtual:CHANNEL,
    can:udp_multicast:GROUP or can:socketcan:INTERFACE [none]; with --realtime or --speed."""
    ticks: Annotated[Whole, at_least(1)] = None
    """Number of control steps [to the end of SCENARIO]."""
    out: Path | None = None
    """Output folder [runs/NAME-flight]."""
    json: Json = False


@app.command
def fly(
    scenario: Path, *, how: FlyOptions = FlyOptions(), code: CodeOptions = CodeOptions()
) -> int:
    """Fly SCENARIO with flight software around its on-board computer: modules, queues, packets.

    In lock-step, as fast as it goes. Writes the session (session.json), which can be flown again to
    the same bytes, what came down (downlink.bin), a table for each packet and a picture of them.
    """
    from torquer.cli.commands import fly as work

    return work.fly(scenario, how, code)


@app.command
def packets(
    software: Path | None = None,
    /,
    *,
    out: Annotated[Path | None, Parameter(help="Folder for the descriptions [not made].")] = None,
    json: Json = False,
) -> int:
    """List the packets of SOFTWARE [that of Chibis-M] with their ids and sizes.

    With --out, descriptions for other programs, all made from the one dictionary: XTCE
    (packets.xml), CAN buses (packets.dbc), Open MCT (packets.json), readers (packets.md).
    """
    from torquer.cli.commands import packets as work

    return work.describe(software, out, json)


session_app = App(name="session", help="Recorded flights of the flight software.")
app.command(session_app)


@session_app.command
def replay(session: Path, *, json: Json = False) -> int:
    """Fly SESSION again; exit code 1 unless the same bytes come down."""
    from torquer.cli.commands import fly as work

    return work.replay(session, json)


@session_app.command
def bisect(first: Path, second: Path, *, json: Json = False) -> int:
    """Find the first control step at which the downlinks of two sessions differ.

    Exit code 1 if there is one.
    """
    from torquer.cli.commands import fly as work

    return work.bisect(first, second, json)


@options
class SmoothOptions:
    """Options of `torquer smooth`."""

    out: Path | None = None
    """Folder for smoothed.nc and smoothed.png [that of RESULT]."""
    json: Json = False


@app.command
def smooth(result: Path, *, how: SmoothOptions = SmoothOptions()) -> int:
    """Smooth the attitude of a run: RESULT is its output folder or result.nc.

    What the readings of the whole run tell about each of its control steps, with the errors to be
    expected. The run must have had a Kalman filter, simulation.record_inputs = true, and a record
    at every control step.
    """
    from torquer.cli.commands import smooth as work

    return work.smooth(result, how)


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
    from torquer.cli.commands import explain as work

    return work.show(key, json)


@app.command
def version(*, json: Json = False) -> int:
    """Print the versions of torquer and its numerical dependencies."""
    import platform
    from importlib.metadata import version as of

    names = ("numpy", "numba", "scipy", "xarray", "pydantic", "pyerfa", "sgp4")
    versions = {"torquer": torquer.__version__} | {name: of(name) for name in names}
    versions["python"] = platform.python_version()
    lines = "\n".join(f"{name} {number}" for name, number in versions.items())
    print(json_text(versions) if json else lines)
    return 0


@app.command
def init(
    name: str | None = None,
    /,
    *,
    example: Annotated[
        str | None, Parameter(help="Copy this example instead, with the files it refers to.")
    ] = None,
    listed: Annotated[bool, Parameter(name="--list", help="List the examples.")] = False,
    json: Json = False,
) -> int:
    """Write NAME.toml: a commented scenario to start from."""
    from torquer.cli.commands import init as work

    return work.init(name, example, listed, json)


@app.command
def compare(
    *results: Path,
    out: Annotated[Path | None, Parameter(help="Folder for the pictures [not drawn].")] = None,
    json: Json = False,
) -> int:
    """Compare two to six runs: RESULTS are their output folders or result.nc files."""
    from torquer.cli.commands import compare as work

    return work.compare(results, out, json)


@app.command
def completion(
    shell: Literal["bash", "zsh", "fish", "powershell"] | None = None,
    /,
    *,
    install: Annotated[
        bool, Parameter(help="Install it for the shell instead of printing it.")
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
        text = in_words(error)
        print_error(text)
        if "--json" in (sys.argv[1:] if arguments is None else arguments):
            with suppress(OSError):  # for programs that read standard output
                print(json_text({"errors": [line for line in text.split("\n") if line]}))
        drop_output()
        code = 2
    return code
