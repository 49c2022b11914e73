"""`torquer ground`: telemetry in the browser, commands, archives."""

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import App

from torquer.base.limits import at_least, within
from torquer.cli.examples import examples_of
from torquer.cli.options import CodeOptions, Json, options

app = App(name="ground", help_epilogue=examples_of("ground"), version_flags=[])
FOLDER = Path("runs/ground")
#: Short name of a satellite without a ground file.
NAME = "satellite"
#: The port of the page unless another is given.
PORT = 8421


@options
class GroundOptions:
    """Options of `torquer ground`."""

    link: str | None = None
    """Link to a single satellite, in place of FILE: the address of `torquer fly --listen`."""
    scenario: Path | None = None
    """Its scenario: names for commands, mode table, orbit, sensors [none: numbers only]."""
    software: Path | None = None
    """Its software file: packets, kind of frames, keys [that of Chibis-M]."""
    name: str = NAME
    """Its short name, also of its archive."""
    folder: Path = FOLDER
    """Folder of the archives."""
    port: Annotated[int | None, within(0, 65535)] = PORT
    """Port of the page on 127.0.0.1; 0: any free one."""
    no_browser: bool = False
    """Only print the address of the page."""
    command_counter: Annotated[int | None, within(0, 2**32 - 2)] = None
    """Last counter of commands that was used, where the archive that had it is lost."""
    new_telemetry: bool = False
    """Accept telemetry whose counter begins again, as after a loss of the satellite's memory."""


@app.default
def serve(
    file: Path | None = None,
    /,
    *,
    how: GroundOptions = GroundOptions(),
    code: CodeOptions = CodeOptions(),
) -> int:
    """Receive, archive and show telemetry, and send commands, until Ctrl-C.

    FILE names satellites with their links, software files and scenarios; or give --link. The page
    is served to this machine only, to whoever has the address that is printed.
    """
    from torquer.cli.commands import ground_work as work

    return work.serve(file, how, code)


@options
class SendOptions:
    """Options of `torquer ground send`."""

    satellite: str | None = None
    """Short name of the satellite, where the ground serves several."""
    file: Path | None = None
    """File of commands, as for `torquer fly --commands`; `at_s` counts from now."""
    delay_s: Annotated[float | None, at_least(0.0)] = None
    """Time after which the satellite executes it, by its clock [at once]."""
    no_acknowledge: bool = False
    """Ask for no answer."""
    no_wait: bool = False
    """Do not wait for the answer."""
    folder: Path = FOLDER
    """Folder of the ground's archives."""
    json: Json = False


@app.command(help_epilogue=examples_of("ground send"))
def send(name: str | None = None, /, *values: str, how: SendOptions = SendOptions()) -> int:
    """Send the command NAME with VALUES, written KEY=VALUE, by the ground that runs in --folder.

    Several numbers of one field are separated by commas; regions, states, flags, parameters and
    labels go by their names. Prints what became of it; exit code 1 unless it was executed.
    """
    from torquer.cli.commands import ground_work as work

    return work.send(name, values, how)


@options
class ImportOptions:
    """Options of `torquer ground import`."""

    software: Path | None = None
    """Software file of the satellite: packets, kind of frames, keys [that of Chibis-M]."""
    name: str = NAME
    """Its short name."""
    folder: Path = FOLDER
    """Folder of the archives."""
    json: Json = False


@app.command(name="import", help_epilogue=examples_of("ground import"))
def import_(recording: Path, *, how: ImportOptions = ImportOptions()) -> int:
    """Put the frames of RECORDING, bytes as they were received, into the archive.

    Prints what was found, lost and rejected. A frame is in an archive once, however often it comes.
    """
    from torquer.cli.commands import ground_work as work

    return work.import_recording(recording, how)


@options
class ExportOptions:
    """Options of `torquer ground export`."""

    out: Path = Path("runs/export")
    """Output folder."""
    format: Literal["netcdf", "parquet"] = "netcdf"
    """Format of the files."""
    packet: list[str] | None = None
    """Only this packet; may be repeated [all]."""
    start: str | None = None
    """First on-board time, ISO 8601 with a zone [all]."""
    end: str | None = None
    """Last on-board time, ISO 8601 with a zone [all]."""
    json: Json = False


@app.command(help_epilogue=examples_of("ground export"))
def export(archive: Path, *, how: ExportOptions = ExportOptions()) -> int:
    """Write the packets of ARCHIVE (runs/ground/NAME.sqlite), a file each, with units."""
    from torquer.cli.commands import ground_work as work

    return work.export(archive, how)
