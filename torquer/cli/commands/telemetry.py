"""`torquer telemetry`: what flight data say about a satellite."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import App

from torquer.base.strict_json import json_text
from torquer.cli.examples import show_examples
from torquer.cli.loading import load_checked
from torquer.cli.options import FLAT, CodeOptions, Json, options
from torquer.cli.output import (
    make_writable,
    print_note,
    say,
    table,
    table_console,
    writing_to,
)
from torquer.cli.process import FAILED_CODE
from torquer.ground.telemetry.request import TelemetryRequest

if TYPE_CHECKING:
    from torquer.ground.telemetry.examination import Examination

_WIDTH = 110
app = App(name="telemetry", help_epilogue=show_examples("telemetry"), version_flags=[])


@options
class CheckOutput:
    """Output of `torquer telemetry`."""

    out: Path | None = None
    """Output folder [runs/FILE-telemetry]."""
    json: Json = False


@app.default
def check(
    *files: Path,
    asked: Annotated[TelemetryRequest, FLAT] = TelemetryRequest(),
    output: CheckOutput = CheckOutput(),
    code: CodeOptions = CodeOptions(),
) -> int:
    """Check the magnetometer in FILES against the field along the orbit, and calibrate it.

    CSV, Parquet, NetCDF, CDF or a ground archive. The strength of the field needs no attitude: it
    finds wrong units and zones, outliers, bias, scale, non-orthogonality and a shift in time, with
    their errors. Logged quaternions are compared with field and Sun: order, sense, frame, axes.
    With --filter an attitude is estimated, forwards and in hindsight, and whether the filter's
    model fits. With --twin the same tip-off is simulated, and says what inertia and gain are;
    `torquer campaign` varies what its errors leave open, twin.toml. Writes calibrated.nc,
    attitude.nc, twin.nc, twin.toml, report.html and pictures. Exit code 1 for telemetry that cannot
    be used as it is, and for a filter or a twin that does not fit it.
    """
    from torquer.ground.telemetry.case import load_case

    if asked.twin is not None:
        load_checked(asked.twin, code)
    case = load_case(files, asked)
    out = output.out or Path("runs") / f"{files[0].stem}-telemetry"
    make_writable(out)
    found = case.examine()
    with writing_to(out):
        names = _write(found, out)
    if asked.clock_sigma_s is not None and found.split is None:
        print_note("--clock-sigma-s: splits nothing, as no shift was fitted")
    if output.json:
        print(json_text(found.as_plain() | {"out": str(out)}))
    else:
        _show(found)
        say(f"{out}: {', '.join(names)}")
    return 0 if found.is_good else FAILED_CODE


def _write(found: "Examination", out: Path) -> list[str]:
    """Write data, pictures and page; the names of the files."""
    from torquer.ground.telemetry.twin.members import write_members
    from torquer.report.telemetry.page import write_telemetry
    from torquer.simulation.results.file import put
    from torquer.simulation.results.netcdf import write_bytes

    twin = found.twin
    files: dict[str, Any] = {"calibrated.nc": write_bytes(found.calibrated)}
    if found.attitude is not None:
        files["attitude.nc"] = write_bytes(found.attitude.data)
    if twin is not None and twin.data is not None and twin.onward is not None:
        files["twin.nc"] = write_bytes(twin.data)
        files["twin.toml"] = write_members(twin.onward, twin)
    for name, content in files.items():
        put(out / name, content)
    return [*files, *write_telemetry(found, out)]


def _show(found: "Examination") -> None:
    from torquer.ground.telemetry.examination import (
        CHOICE_HEAD,
        PARAMETER_HEAD,
        choice_texts,
        parameter_texts,
    )

    screen = table_console(_WIDTH)
    rows, first, last, orbit = (row.value for row in found.facts[:4])
    say(f"{rows} rows, {first} to {last}; {orbit}")
    for each in found.mistakes:
        say(f"WRONG: {each.text}")
    for each in found.findings:
        say(f"note: {each.text}")
    if calibrated := parameter_texts(found.calibration):
        screen.print(table(PARAMETER_HEAD, calibrated, "Calibration", left=(0, 3)))
    if found.choices:
        screen.print(table(CHOICE_HEAD, choice_texts(found.choices), "Models compared"))
    if fitted := parameter_texts(found.twin):
        screen.print(table(PARAMETER_HEAD, fitted, "Twin", left=(0, 3)))
    if found.split is not None:
        (clock, off), (along, away) = found.split
        say(f"clock {clock:.2f} +- {off:.2f} s, along the track {along:.2f} +- {away:.2f} km, "
              "by the errors stated beforehand")  # fmt: skip
    say(f"verdict: {found.verdict}")


@options
class ProposeOptions:
    """Options of `torquer telemetry init`."""

    orbit: Path | None = None
    """Orbit along which readings are tested, as `torquer telemetry` takes it [none]."""
    satellite: str | None = None
    """Name or catalogue number of the satellite in a file of several orbits."""
    out: Path | None = None
    """The mapping file [FILE.mapping.toml next to where you are]."""
    json: Json = False


@app.command(help_epilogue=show_examples("telemetry init"))
def init(file: Path, *, how: ProposeOptions = ProposeOptions()) -> int:
    """Propose a mapping for FILE, and say what of it is guessed.

    Stamps, columns and units are read in all ways that give plausible dates and fields; with
    --orbit each is tested against the field along it. The best is written, the others stand in the
    file as comments. Where none is plausible a skeleton is written, and the exit code is 2.
    """
    from torquer.ground.telemetry.proposal.propose import NoProposal, propose_mapping
    from torquer.simulation.results.file import put

    out = how.out or Path(f"{file.stem}.mapping.toml")
    if out.exists():
        raise ValueError(f"--out: must be a new file; received {out}")
    try:
        proposal = propose_mapping(file, how.orbit, how.satellite)
    except NoProposal as found:
        with writing_to(out.parent):
            put(out, found.skeleton)
        raise ValueError(f"{found} (a skeleton to fill in: {out})") from None
    with writing_to(out.parent):
        put(out, proposal.text)
    if how.json:
        plain = {"guesses": proposal.guesses, "others": proposal.others}
        print(json_text({"mapping": str(out)} | plain))
        return 0
    for each in proposal.guesses:
        say(f"guessed: {each}")
    for each in proposal.others:
        say(f"also possible: {each}")
    orbit = how.orbit or "..."
    say(f"{out}: check it, then `torquer telemetry {file.name} --mapping {out.name} --orbit "
          f"{orbit}`")  # fmt: skip
    return 0
