"""The report of a pass as one page for the printer: opens anywhere, loads nothing."""

from __future__ import annotations

import sqlite3
from collections.abc import Mapping
from contextlib import closing
from pathlib import Path
from typing import NamedTuple

from torquer.base.dates import table_utc
from torquer.ground.archive import ArchiveError, dictionary_in, read_only
from torquer.ground.elements import KnownOrbit
from torquer.ground.pass_report import MOST_GAPS, PassReport, report_pass
from torquer.ground.passes import Pass
from torquer.ground.schedule import Radio, schedule
from torquer.ground.stations import GroundStation
from torquer.report.common.figure import encode_png
from torquer.report.common.html import encode, page
from torquer.report.passes import draw_passes


class Heading(NamedTuple):
    """What stands above a report.

    `satellite`, `station`: names; `orbit`: by what the pass was predicted; `sky`: a row of
    `torquer.ground.schedule`, None for a span without prediction; `picture`: base64 of a PNG.
    """

    satellite: str
    station: str = ""
    orbit: str = ""
    sky: dict | None = None
    picture: str = ""


def heading_of(
    name: str,
    known: KnownOrbit,
    stations: Mapping[str, GroundStation],
    each: Pass,
    radio: Radio,
) -> Heading:
    """The heading of a pass that is predicted by an orbit, with its picture."""
    (sky,) = schedule([each], each.aos.time_ms, radio._replace(bit_s=None))
    of_pass = {each.station: stations[each.station]}
    figure = draw_passes("", known.around, of_pass, [each], radio.frequency_hz)
    return Heading(name, each.station, known.text, sky, encode(encode_png(figure)))


def report_page(archive: Path, heading: Heading, start_ms: int, end_ms: int) -> str:
    """The page of a pass by an archive; `ArchiveError` with one line for what is none."""
    with closing(read_only(archive)) as db:
        try:
            found = report_pass(db, dictionary_in(db), start_ms, end_ms)
        except sqlite3.Error as error:
            raise ArchiveError(f"archive: must be whole; received {archive}: {error}") from None
    return pass_page(heading, found)


def pass_page(heading: Heading, found: PassReport) -> str:
    """A whole page of HTML; all texts from archive and dictionary are escaped."""
    over = f" over {heading.station}" if heading.station else ""
    title = f"{heading.satellite}{over}, {table_utc(found.start_ms)} UTC"
    return page(
        "pass.html",
        title,
        interactive=False,
        heading=heading,
        facts=_facts(heading, found),
        received=[_packet_row(each) for each in found.received],
        gaps=[(each.packet, _clock(a), _clock(b), f"{1e-3 * (b - a):.1f}")
              for each in found.received for a, b in each.gaps],
        most_gaps=MOST_GAPS,
        commands=[_command_row(each) for each in found.commands],
        log=[(_clock(e["time_ms"]), e["source"], e["severity"], e["text"]) for e in found.log],
        values=found.values,
    )  # fmt: skip


def _facts(heading: Heading, found: PassReport) -> list[tuple[str, str]]:
    """Labels and texts of the head of a report."""
    length_s = 1e-3 * (found.end_ms - found.start_ms)
    suspect = sum(each.suspect for each in found.received)
    facts = [
        ("AOS", f"{table_utc(found.start_ms)} UTC"),
        ("LOS", f"{table_utc(found.end_ms)} UTC"),
        ("Duration", f"{int(length_s // 60)} min {length_s % 60:.0f} s"),
        *_sky_facts(heading.sky),
        ("Packets received", str(found.rows)),
        ("Packets missing in gaps", str(found.missing)),
        ("Packets directly after lost bytes", str(suspect)),
        ("Commands sent", str(len(found.commands))),
        ("By the ground's clock", f"{' to '.join(map(table_utc, found.ground_ms))} UTC"),
    ]
    return facts + ([("Prediction", heading.orbit)] if heading.orbit else [])


def _sky_facts(sky: dict | None) -> list[tuple[str, str]]:
    if sky is None:
        return []
    top, near = sky["highest"], sky["closest"]
    facts = [
        ("Highest", f"{top['elevation_deg']:.1f}° at {_clock(top['time_ms'])}, azimuth "
                    f"{top['azimuth_deg']:.0f}°"),
        ("Azimuth at AOS, LOS", f"{sky['aos']['azimuth_deg']:.0f}°, "
                                f"{sky['los']['azimuth_deg']:.0f}°"),
        ("Closest", f"{near['range_km']:.0f} km at {_clock(near['time_ms'])}"),
        ("In the Earth's shadow", ", ".join(f"{_clock(a)} to {_clock(b)}"
                                            for a, b in sky["eclipse_ms"]) or "no"),
        ("Light at the station", f"{sky['light']}, Sun at {sky['sun_elevation_deg']:.0f}°"),
    ]  # fmt: skip
    if sky["aos"]["doppler_hz"] is not None:
        ends = (sky[key]["doppler_hz"] for key in ("aos", "los"))
        facts.append(("Doppler at AOS, LOS", ", ".join(f"{1e-3 * x:+.2f} kHz" for x in ends)))
    return facts


def _packet_row(each) -> tuple[str, ...]:
    step = "irregular" if each.step_s is None else f"{each.step_s:g}"
    missing = "" if each.step_s is None else str(each.missing)
    ends = _clock(each.first_ms), _clock(each.last_ms)
    return each.packet, str(each.rows), *ends, step, missing, str(each.suspect), str(each.alarms)


def _command_row(each: dict) -> tuple[str, ...]:
    values = " ".join(f"{key}={value}" for key, value in each["values"].items())
    sent = "" if each["sent_ms"] is None else _clock(each["sent_ms"])
    words = f"{each['command']} {values}".strip()
    return str(each["id"]), sent, each["made_by"], words, each["state"], each["reason"]


def _clock(time_ms: int) -> str:
    return table_utc(time_ms)[11:]
