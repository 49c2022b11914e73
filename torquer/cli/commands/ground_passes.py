"""`torquer ground passes` and `torquer ground report`: passes to come, and what came of one."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

from cyclopts import Parameter

from torquer.base.dates import table_utc
from torquer.base.limits import positive, within
from torquer.base.strict_json import json_text
from torquer.cli.loading import FOLDER, archive_in, load_checked, note_what_waits
from torquer.cli.options import CodeOptions, Json, options
from torquer.cli.output import make_writable, print_note, table, table_console, writing_to

if TYPE_CHECKING:
    from torquer.ground.elements import KnownOrbit
    from torquer.ground.file import GroundFile, SatelliteTable
    from torquer.ground.passes import Pass
    from torquer.ground.schedule import Radio
    from torquer.ground.stations import GroundStation

_HEAD = (
    *("", "Station", "AOS [UTC]", "LOS [UTC]", "min", "Highest", "Azimuths", "Light"),
    *("Satellite", "Doppler [kHz]", "Down [kB]", "Left"),
)


@options
class PassesOptions:
    """Options of `torquer ground passes`."""

    satellite: str | None = None
    """Short name of the satellite, where FILE, or the folder of archives, has several."""
    station: list[str] | None = None
    """Only this station of FILE, or LATITUDE,LONGITUDE[,ALTITUDE] in degrees and metres; may be
    repeated.
    """
    elements: Path | None = None
    """File of the orbit (TLE, OMM, OEM, SP3), in place of that in FILE."""
    scenario: Path | None = None
    """Scenario whose orbit it is, without FILE."""
    from_: str | None = None
    """Begin, ISO 8601 with a zone [now; for the orbit of a scenario its start]."""
    hours: Annotated[float, within(0.0, 2400.0)] = 24.0
    """Length of the span."""
    lowest_elevation: Annotated[float | None, within(-10.0, 89.9, "deg")] = None
    """Elevation above which a station receives [that of the station]."""
    frequency: Annotated[float | None, positive()] = None
    """Frequency of the downlink [Hz], for Doppler [that in FILE]."""
    bit_rate: Annotated[float | None, positive()] = None
    """Bits a second of the downlink [those in FILE]."""


class _Chosen(NamedTuple):
    """A satellite with its stations, orbit and passes in a span."""

    name: str
    table: SatelliteTable | None
    stations: dict[str, GroundStation]
    known: KnownOrbit
    start_ms: int
    passes: list[Pass]
    radio: Radio


def passes(
    file: Path | None = None,
    /,
    *,
    out: Annotated[Path | None, Parameter(help="Folder for passes.png and passes.json.")] = None,
    json: Json = False,
    how: PassesOptions = PassesOptions(),
    code: CodeOptions = CodeOptions(),
) -> int:
    """Passes of a satellite over ground stations: times, elevation, light, Doppler, data volume.

    FILE is a ground file, which declares stations, elements and frequencies; or give --elements or
    --scenario with --station. Times are UTC. Elements that are days old are said to be.
    """
    from torquer.ground.schedule import schedule

    chosen = _choose(file, how, code)
    rows = schedule(chosen.passes, chosen.start_ms, chosen.radio)
    elements = chosen.known.elements
    answer = {
        "satellite": chosen.name,
        "start_ms": chosen.start_ms,
        "orbit": chosen.known.text,
        "elements": None if elements is None else elements._asdict(),
        "frequency_hz": chosen.radio.frequency_hz,
        "passes": rows,
    }
    files = [] if out is None else _write(chosen, answer, out)
    if json:
        print(json_text(answer | ({"files": files} if files else {})))
        return 0
    if rows:
        shown = [_in_words(number, each) for number, each in enumerate(rows, start=1)]
        table_console(150).print(table(_HEAD, shown, left=(1, 2, 3, 7, 8)))
    else:
        print_note("no pass in this span")
    print(f"orbit: {chosen.known.text}")
    if files:
        print(f"{out}: {', '.join(Path(file).name for file in files)}")
    return 0


def _choose(path: Path | None, how: PassesOptions, code: CodeOptions) -> _Chosen:
    from torquer.ground.elements import orbit_from_file, orbit_of, passes_by
    from torquer.ground.file import load_ground
    from torquer.ground.passes import ms_of

    file = None if path is None else load_ground(path)
    name, given = _satellite(file, how)
    of = given.scenario if given is not None else how.scenario
    scenario = None if of is None else load_checked(of, code)
    has_elements = how.elements is not None or (given is not None and given.elements is not None)
    start_ms = round(1e3 * time.time())
    if how.from_ is not None:
        start_ms = ms_of(how.from_, "--from")
    elif scenario is not None and not has_elements:
        start_ms = round(1e3 * scenario.start.timestamp())
    known = (
        orbit_of(given, scenario, start_ms)
        if how.elements is None
        else orbit_from_file(how.elements, start_ms)
    )
    if known is None:
        raise ValueError(
            "--elements: must be given for a satellite without elements or scenario in FILE; "
            "received neither"
        )
    stations = _stations(file, how)
    found = passes_by(known, stations, start_ms, start_ms + round(3.6e6 * how.hours))
    return _Chosen(name, given, stations, known, start_ms, found, _radio(given, how))


def _satellite(file: GroundFile | None, how: PassesOptions) -> tuple[str, SatelliteTable | None]:
    """Name and table of the satellite that is meant."""
    if file is None:
        if how.satellite is not None:
            raise ValueError("--satellite: must be given with FILE only; received no FILE")
        return "satellite", None
    if how.scenario is not None:
        raise ValueError("--scenario: must not be given with FILE, which has its own")
    names = list(file.satellites)
    if how.satellite is None and len(names) == 1:
        return names[0], file.satellites[names[0]]
    if how.satellite not in names:
        raise ValueError(
            f"--satellite: must be one of {', '.join(names)}; received "
            f"{'none' if how.satellite is None else how.satellite}"
        )
    return how.satellite, file.satellites[how.satellite]


def _stations(file: GroundFile | None, how: PassesOptions) -> dict[str, GroundStation]:
    declared = {} if file is None else file.stations
    if how.station is None:
        found = dict(declared)
    else:
        found = {each: declared[each] if each in declared else _place(each, declared)
                 for each in how.station}  # fmt: skip
    if not found:
        raise ValueError("--station: must be given, or stations in FILE; received neither")
    if how.lowest_elevation is None:
        return found
    lowest = {"lowest_elevation_deg": how.lowest_elevation}
    return {name: each.model_copy(update=lowest) for name, each in found.items()}


def _place(text: str, declared: dict) -> GroundStation:
    """A station that is written LATITUDE,LONGITUDE[,ALTITUDE]."""
    from torquer.base.explain import validate_tables
    from torquer.ground.stations import GroundStation

    keys = ("latitude_deg", "longitude_deg", "altitude_m")
    parts = text.split(",")
    try:
        numbers = [float(part) for part in parts]
    except ValueError:
        numbers = []
    if len(numbers) not in (2, 3):
        known = f"one of {', '.join(declared)}, or " if declared else ""
        raise ValueError(
            f"--station: must be {known}LATITUDE,LONGITUDE[,ALTITUDE]; received {text!r}"
        )
    return validate_tables(GroundStation, dict(zip(keys, numbers, strict=False)))


def _radio(given: SatelliteTable | None, how: PassesOptions) -> Radio:
    from torquer.ground.schedule import Radio, radio_of

    found = Radio() if given is None else radio_of(given)
    return found._replace(
        frequency_hz=how.frequency or found.frequency_hz, bit_s=how.bit_rate or found.bit_s
    )


def _in_words(number: int, each: dict) -> tuple[str, ...]:
    """A line of the table of passes."""
    aos, los, down = each["aos"], each["los"], each["downlink"]
    doppler = ""
    if aos["doppler_hz"] is not None:
        doppler = f"{1e-3 * aos['doppler_hz']:+.2f} to {1e-3 * los['doppler_hz']:+.2f}"
    return (
        str(number),
        each["station"],
        f"{'' if each['rises'] else 'before '}{table_utc(aos['time_ms'])}",
        f"{'' if each['sets'] else 'after '}{table_utc(los['time_ms'])[11:]}",
        f"{each['duration_s'] / 60.0:.1f}",
        f"{each['highest']['elevation_deg']:.1f}°",
        f"{aos['azimuth_deg']:.0f}° to {los['azimuth_deg']:.0f}°",
        each["light"],
        _light(each),
        doppler,
        "" if down is None else f"{down['bytes'] / 1e3:.0f}",
        "" if down is None else str(down.get("left_packets", "")),
    )


def _light(each: dict) -> str:
    """Whether the satellite is in sunlight during a pass."""
    dark_s = 1e-3 * sum(b - a for a, b in each["eclipse_ms"])
    if not dark_s:
        return "sunlit"
    return "eclipse" if dark_s > each["duration_s"] - 1.0 else f"eclipse {dark_s:.0f} s"


def _write(chosen: _Chosen, answer: dict, out: Path) -> list[str]:
    from torquer.report.common.figure import save_figure
    from torquer.report.passes import draw_passes

    make_writable(out)
    title = f"{chosen.name} · passes from {table_utc(chosen.start_ms)} UTC"
    with writing_to(out):
        figure = draw_passes(
            title, chosen.known.around, chosen.stations, chosen.passes, chosen.radio.frequency_hz
        )
        picture, data = save_figure(figure, out / "passes.png"), out / "passes.json"
        data.write_text(json_text(answer), encoding="utf-8")
    return [str(picture), str(data)]


@options
class ReportOptions:
    """Options of `torquer ground report`."""

    file: Path | None = None
    """Ground file with stations and orbit, for NUMBER."""
    to: str | None = None
    """End, ISO 8601 with a zone, in place of NUMBER."""
    folder: Path = FOLDER
    """Folder of the archives."""
    out: Path = Path("pass.html")
    """The page."""


def report(
    number: int | None = None,
    /,
    *,
    what: ReportOptions = ReportOptions(),
    how: PassesOptions = PassesOptions(),
    code: CodeOptions = CodeOptions(),
) -> int:
    """Write what the archive has of a pass as one page to print, without network and scripts.

    NUMBER is that of the pass in the list of `torquer ground passes` with the same options; or give
    --from and --to, by the satellite's clock. The page has packets, gaps, commands and what became
    of them, the log, and values at AOS and LOS.
    """
    from torquer.report.pass_page import Heading, heading_of, report_page

    if (number is None) == (what.to is None):
        raise ValueError(
            f"NUMBER: must be given, or --from and --to; received "
            f"{'neither' if number is None else 'both'}"
        )
    if number is None:
        span, heading, name = _span(what, how), Heading(""), how.satellite
    else:
        # without a ground file the name is that of the archive alone
        asked = how if what.file is not None else replace(how, satellite=None)
        chosen = _choose(what.file, asked, code)
        if not 1 <= number <= len(chosen.passes):
            raise ValueError(
                f"NUMBER: must be one of the {len(chosen.passes)} passes; received {number}"
            )
        each = chosen.passes[number - 1]
        span = each.aos.time_ms, each.los.time_ms
        heading = heading_of(chosen.name, chosen.known, chosen.stations, each, chosen.radio)
        is_there = (what.folder / f"{chosen.name}.sqlite").exists()
        name = how.satellite or (chosen.name if is_there else None)
    archive = archive_in(what.folder, name)
    heading = heading._replace(satellite=archive.stem)
    page = report_page(archive, heading, *span)
    with writing_to(what.out, what="file"):
        what.out.parent.mkdir(parents=True, exist_ok=True)
        what.out.write_text(page, encoding="utf-8")
    print(what.out)
    note_what_waits(archive)
    return 0


def _span(what: ReportOptions, how: PassesOptions) -> tuple[int, int]:
    from torquer.ground.passes import ms_of

    if how.from_ is None:
        raise ValueError("--from: must be given with --to; received nothing")
    start_ms, end_ms = ms_of(how.from_, "--from"), ms_of(what.to or "", "--to")
    if start_ms > end_ms:
        raise ValueError(f"--to: must not be before --from; received {what.to}")
    return start_ms, end_ms
