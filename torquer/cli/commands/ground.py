"""`torquer ground`: telemetry in the browser, commands, archives."""

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import App

from torquer.base.dates import iso_s
from torquer.base.folder_lock import claim
from torquer.base.limits import at_least, within
from torquer.base.strict_json import json_text
from torquer.cli.app import read_help
from torquer.cli.commands.ground_orders import As, in_words
from torquer.cli.examples import show_examples
from torquer.cli.loading import FOLDER, load_checked, load_given, note_what_waits, span_ms
from torquer.cli.options import CodeOptions, Json, options
from torquer.cli.output import (
    check_installed,
    harmless,
    make_writable,
    moving_bar,
    print_error,
    print_note,
    show_address,
    writing_to,
)
from torquer.cli.process import FAILED_CODE

app = App(name="ground", help_epilogue=show_examples("ground"), version_flags=[])
#: Short name of a satellite without a ground file.
NAME = "satellite"
#: The port of the page unless another is given.
PORT = 8421
_SERVER_NEEDS = ("starlette", "uvicorn", "websockets")


@options
class GroundOptions:
    """Options of `torquer ground`."""

    link: str | None = None
    """Link to a single satellite, in place of FILE: the address of `torquer fly --listen`."""
    scenario: Path | None = None
    """Its scenario: names for commands and sensors, mode table, orbit [none: numbers only]."""
    software: Path | None = None
    """Its software file: packets, kind of frames, keys [that of Chibis-M]."""
    satellite: str = NAME
    """Its short name, also of its archive."""
    folder: Path = FOLDER
    """Folder of the archives."""
    port: Annotated[int | None, within(0, 65535)] = PORT
    """Port of the page on 127.0.0.1; 0: any free one."""
    no_browser: bool = False
    """Only print the address of the page."""
    command_counter: Annotated[int | None, within(0, 2**32 - 2)] = None
    """Last counter of commands that was used, where the archive that had it is lost."""
    recovery_counter: Annotated[int | None, within(0, 2**32 - 2)] = None
    """Last counter of the recovery key that was used, likewise."""
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
    is served to this machine only, to whoever has an address that is printed: with the first one
    satellites are commanded, with the second one they are watched.
    """
    check_installed("ground", _SERVER_NEEDS)
    from torquer.ground.contact import Counters
    from torquer.pages.ground.server import Ground

    satellites = _satellites(file, how, code)
    make_writable(how.folder, "--folder")
    with writing_to(how.folder, "--folder"), claim(how.folder, "--folder"):
        counters = Counters(how.command_counter or 0, how.recovery_counter or 0, how.new_telemetry)
        with _keys_as_written(file):
            ground = Ground(satellites, how.folder, how.port or 0, counters)
        for each in satellites:
            _note_on_protection(each)
            _note_on_elements(each)
        watch = f"{ground.watch_address}  (watch only)"
        ground.serve(lambda: show_address(ground, how.folder, how.no_browser, watch))
    for key, rows in ground.unarchived.items():
        print_error(f"{key}: {rows} rows could not be archived")
    return FAILED_CODE if ground.unarchived else 0


def _note_on_protection(satellite) -> None:
    if satellite.software.link == "historical":
        print_note(f"{satellite.key}: commands go without protection, as its software file says")
    elif satellite.software.keys.are_known:
        print_note(
            f"{satellite.key}: its link is protected by keys that everybody knows; up_key and "
            "down_key of the software file name your own"
        )


def _note_on_elements(satellite) -> None:
    """Elements may come later, and are read again: a file that holds none is no reason to end."""
    if satellite.table.elements is not None:
        from torquer.ground.elements import orbit_of
        from torquer.ground.ground_clock import now_ms

        try:
            orbit_of(satellite.table, None, now_ms())
        except ValueError as error:
            print_note(f"{satellite.key}: no passes until this is mended: {error}")


def _satellites(path: Path | None, how: GroundOptions, code: CodeOptions) -> list:
    """The satellites of the file, or the one of the options."""
    from torquer.ground.file import SatelliteTable, load_ground, make_satellite

    if (path is None) == (how.link is None):
        received = "neither" if path is None else "both"
        raise ValueError(f"FILE: must be given, or --link; received {received}")
    if path is not None:
        for name, is_given in (
            ("scenario", how.scenario is not None),
            ("software", how.software is not None),
            ("satellite", how.satellite != NAME),
        ):
            if is_given:
                raise ValueError(f"--{name}: must not be given with FILE, which has its own")
        file = load_ground(path)
        tables, stations = file.satellites, file.stations
    else:
        table = {"link": how.link, "software": how.software, "scenario": how.scenario}
        tables, stations = {_short_name(how.satellite): SatelliteTable.model_validate(table)}, {}
    for key, each in tables.items():
        if each.scenario is not None:
            with _keys_as_written(path, key):
                load_checked(each.scenario, code)
    made = []
    for key, each in tables.items():
        with _keys_as_written(path, key):
            made.append(make_satellite(key, each, stations))
    return made


@contextmanager
def _keys_as_written(path: Path | None, key: str = "") -> Iterator[None]:
    """Within the block, mistakes go by the keys of the ground file, or by the options without it.

    `key`: the satellite whose table names files; what is wrong in these goes by their own keys.
    """
    try:
        yield
    except ValueError as error:
        if path is None:
            text = re.sub(r"^satellites\.\w+\.link: ", "--link: ", str(error))
        else:
            whose = f"satellites.{key}." if key else ""
            text = re.sub(r"^(?=(software|scenario): )", whose, str(error))
        if text == str(error):
            raise
        raise ValueError(text) from None


def _short_name(name: str) -> str:
    from pydantic import TypeAdapter, ValidationError

    from torquer.flight.packets.dictionary import Name

    try:
        return TypeAdapter(Name).validate_python(name)
    except ValidationError:
        raise ValueError(
            "--satellite: must be words of lower-case letters and digits, with '_' between them; "
            f"received {name!r}"
        ) from None


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
    operator: As = None
    """Your name, stated with what you order; nothing proves it."""
    folder: Path = FOLDER
    """Folder of the ground's archives."""
    json: Json = False


@app.command(help_epilogue=show_examples("ground send"))
def send(name: str | None = None, /, *values: str, how: SendOptions = SendOptions()) -> int:
    """Send the command NAME with VALUES, written KEY=VALUE, by the ground that runs in --folder.

    Several numbers of one field are separated by commas; regions, states, flags, parameters,
    labels and bits go by their names. Prints what became of it; exit code 1 unless it was executed.
    """
    from torquer.ground.client import RunningGround

    if (name is None) == (how.file is None):
        raise ValueError(
            f"NAME: must be given, or --file; received {'neither' if name is None else 'both'}"
        )
    orders = _orders(name, values, how)
    found = RunningGround(how.folder, how.operator).send(orders, how.satellite, not how.no_wait)
    if how.json:
        print(json_text(found))
    else:
        _show_commands(found)
    pairs = zip(orders, found, strict=True)
    went_well = how.no_wait or all(each["state"] in _good(order) for order, each in pairs)
    return 0 if went_well else FAILED_CODE


@options
class PlanOptions:
    """Options of `torquer ground plan` and `torquer ground cancel`."""

    satellite: str | None = None
    """Short name of the satellite, where the ground serves several."""
    operator: As = None
    """Your name, stated with what you order; nothing proves it."""
    folder: Path = FOLDER
    """Folder of the ground's archives."""
    json: Json = False


@app.command(help_epilogue=show_examples("ground plan"))
def plan(*, how: PlanOptions = PlanOptions()) -> int:
    """List the commands that wait on board for their execution time, by asking the satellite.

    Each with its number here, by which `torquer ground cancel` takes it out, and how the list
    differs from what is known here: on board only, on ground only, or as it was sent.
    """
    from torquer.ground.client import RunningGround

    found = RunningGround(how.folder, how.operator).plan(how.satellite)
    if how.json:
        print(json_text(found))
        return 0
    for each in found:
        at = iso_s(each["execute_ms"])
        what = f"{each['command'] or 'of another dictionary'}, request {each['request']}"
        if each["id"] is not None:
            what = f"{each['id']} {in_words(each)}"
        print(harmless(f"{at}  {what}: {each['mark']}"))
    if not found:
        print_note("no command waits on board")
    return 0


@app.command(help_epilogue=show_examples("ground cancel"))
def cancel(number: int, /, *, how: PlanOptions = PlanOptions()) -> int:
    """Cancel the command NUMBER, which waits here or on board.

    Exit code 1 unless it is cancelled: the satellite may have executed it meanwhile.
    """
    from torquer.ground.client import RunningGround

    if not 1 <= number < 2**53:
        raise ValueError(f"NUMBER: must be that of a command, from 1 on; received {number}")
    found = RunningGround(how.folder, how.operator).cancel(number, how.satellite)
    if how.json:
        print(json_text(found))
    else:
        _show_commands([found])
    return 0 if found["state"] in ("cancelled", "executed") else FAILED_CODE


def _good(order: dict) -> tuple[str, ...]:
    """States of a command that went well, as far as is waited for."""
    return ("executed", "received") if order["acknowledge"] else ("sent",)


def _orders(name: str | None, values: Sequence[str], how: SendOptions) -> list[dict]:
    if how.file is not None:
        if values or how.delay_s is not None or how.no_acknowledge:
            raise ValueError("--file: must be given alone; received values or options as well")
        from torquer.flight.packets.commands import load_script

        commands = load_script(how.file).commands
        if not commands:
            raise ValueError(f"--file: must hold commands; received none in {how.file}")
        return [each.model_dump(mode="json", exclude_none=True) for each in commands]
    order: dict[str, Any] = {"command": name, "acknowledge": not how.no_acknowledge}
    if how.delay_s:
        order["delay_s"] = how.delay_s
    return [order | {"values": dict(map(_key_and_value, values))}]


def _key_and_value(text: str) -> tuple[str, Any]:
    """KEY=VALUE: a number, several with commas between them, or text."""
    key, equals, value = text.partition("=")
    if not equals or not key:
        raise ValueError(f"values: must be written KEY=VALUE; received {text!r}")
    parts = value.split(",")
    try:
        numbers = [float(part) if set(part) & set(".eEni") else int(part) for part in parts]
    except ValueError:
        return key, value
    return key, numbers if len(numbers) > 1 else numbers[0]


def _show_commands(commands: list[dict]) -> None:
    for each in commands:
        reason = f" ({each['reason']})" if each["reason"] else ""
        print(harmless(f"{each['id']} {in_words(each)}: {each['state']}{reason}"))


@options
class ImportOptions:
    """Options of `torquer ground import`."""

    software: Path | None = None
    """Software file of the satellite: packets, kind of frames, keys [that of Chibis-M]."""
    scenario: Path | None = None
    """Its scenario: names of its sensors in packets [none]."""
    satellite: str = NAME
    """Its short name, also of its archive."""
    folder: Path = FOLDER
    """Folder of the archives."""
    json: Json = False


@app.command(name="import", help_epilogue=show_examples("ground import"))
def import_(recording: Path, *further: Path, how: ImportOptions = ImportOptions()) -> int:
    """Put the frames of RECORDING and of FURTHER ones, bytes as received, into the archive.

    Frames may come in any order, from several stations and twice, with counters that begin again:
    each is in an archive once, by its MAC and content. Text in hexadecimal, dumps with
    offsets and KISS frames are read, too. Prints what was found, and for what reasons frames were
    left out. Exit code 1 where less than half of the bytes, or no packet, was kept; no archive is
    made for nothing. An archive with
    rows of packets that the software lacks is left as it is: another satellite has another name.
    """
    from torquer.flight.packets.software_file import load_link
    from torquer.ground.archive import Archive, OtherPacketsError
    from torquer.ground.recording import import_recording

    name = _short_name(how.satellite)
    link = load_link(how.software).for_satellite(load_given(how.scenario))
    recordings = [recording, *further]
    for each in recordings:
        if not each.is_file():
            raise ValueError(f"RECORDING: must be a file; received {each}")
    make_writable(how.folder, "--folder")
    path = how.folder / f"{name}.sqlite"
    is_new, kept = not path.exists(), True
    try:
        archive = Archive(path, link.dictionary)
    except OtherPacketsError as error:
        raise ValueError(f"{error}: give another satellite another name by --satellite") from None
    try:
        with _progress(recording.name) as progress:
            found = import_recording(link, recordings, archive, progress)
        kept = not is_new or found["new"] > 0 or bool(archive.parts())
    finally:
        if kept:
            archive.close()
        else:
            archive.discard()
    if how.json:
        print(json_text(found | {"archive": str(path) if kept else None}))
    else:
        _show_import(found)
        print(f"archive: {path if kept else 'none made, as nothing would be in it'}")
    if found["failure"]:
        print_error(found["failure"])
        return FAILED_CODE
    return 0


def _show_import(found: dict[str, Any]) -> None:
    for note in found["notes"]:
        print(harmless(note))
    counts = {key: value for key, value in found.items() if isinstance(value, int)}
    print(", ".join(f"{key.replace('_', ' ')} {value}" for key, value in counts.items()))
    for each in found["left_out"]:
        place = f", first at byte {each['first_byte']} of {each['recording']}"
        print(
            harmless(f"left out: {each['count']} {each['text']}{place * bool(each['recording'])}")
        )


@options
class ExportOptions:
    """Options of `torquer ground export`."""

    out: Path = Path("runs/export")
    """Output folder."""
    format: Literal["csv", "netcdf", "parquet"] = "netcdf"
    """Format of the files."""
    packet: list[str] | None = None
    """Only this packet; may be repeated [all]."""
    start: str | None = None
    """First on-board time, ISO 8601 with a zone [all]."""
    end: str | None = None
    """Last on-board time, ISO 8601 with a zone [all]."""
    json: Json = False


@app.command(help_epilogue=show_examples("ground export"))
def export(archive: Path, *, how: ExportOptions = ExportOptions()) -> int:
    """Write the packets of ARCHIVE (runs/ground/NAME.sqlite), a file each, with units.

    Of a damaged archive all that can be read is written, with a line on each thing that cannot:
    exit code 1 if something is lost, 2 if nothing could be read. Lost are units of tables that the
    stored dictionary does not name, and rows whose time is none from 1677 to 2262.
    """
    if how.format == "parquet":
        check_installed("ground", ("pyarrow",))
    from torquer.ground.export import export_archive

    start_ms, end_ms = span_ms(how.start, how.end)
    make_writable(how.out)
    lost: list[str] = []
    with writing_to(how.out), _progress(archive.name) as bar:
        files = export_archive(
            archive, how.out, how.format, how.packet, start_ms, end_ms, bar, lost.append
        )
    if lost and not files:
        raise ValueError("\n".join(lost))
    if how.json:
        print(json_text([{"file": str(path), "rows": rows} for path, rows in files]))
    else:
        for path, rows in files:
            print(f"{path}: {rows} rows")
    for line in lost:
        print_error(line)
    if not files:
        print_note("nothing was written: the archive has no such rows")
    note_what_waits(archive)
    return FAILED_CODE if lost else 0


def _progress(name: str):
    return moving_bar(name, ("completed",), total=1.0)


#: Commands that have files of their own, by these files.
_OTHERS = {
    "ground_alarms": ("alarms",),
    "ground_history": ("at", "gaps"),
    "ground_orders": ("history", "stack"),
    "ground_passes": ("passes", "report"),
}
for _file, _names in _OTHERS.items():
    for _name in _names:
        _place, _epilogue = (
            f"torquer.cli.commands.{_file}:{_name}",
            show_examples(f"ground {_name}"),
        )
        _help = read_help(_file, _name)
        app.command(_place, name=_name, help=_help, help_epilogue=_epilogue)
