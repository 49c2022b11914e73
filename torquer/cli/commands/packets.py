"""`torquer packets`: the dictionary of a software listed, described, and imported."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

from torquer.base.strict_json import json_text
from torquer.cli.examples import show_examples
from torquer.cli.loading import check_software, load_checked
from torquer.cli.options import CodeOptions, Json
from torquer.cli.output import make_writable, print_note, say, writing_to
from torquer.simulation.results.file import put

app = App(name="packets", help_epilogue=show_examples("packets"), version_flags=[])


@app.default
def packets(
    software: Path | None = None,
    /,
    *,
    scenario: Annotated[
        Path | None, Parameter(help="Scenario of the satellite: names of its sensors [none].")
    ] = None,
    out: Annotated[Path | None, Parameter(help="Folder for the descriptions [not made].")] = None,
    json: Json = False,
    code: CodeOptions = CodeOptions(),
) -> int:
    """List the packets of SOFTWARE [that of Chibis-M] with their ids and sizes.

    With --out, descriptions for other programs, all made from the one dictionary: XTCE
    (packets.xml), CAN buses (packets.dbc), Open MCT (packets.json), readers (packets.md). One that
    cannot state a packet is not written, and a line says why. Bits that stand for one of several
    sensors have names only with --scenario.
    """
    check_software(software, code)
    satellite = None if scenario is None else load_checked(scenario, code)
    link = _load_link(software).for_satellite(satellite)
    dictionary = link.dictionary
    written = [] if out is None else _describe(link, out)
    rows = [
        (way, each.name, each.id, each.module, each.size)
        for way, listed in (("down", dictionary.down), ("up", dictionary.up))
        for each in listed.values()
    ]
    keys = ("direction", "name", "id", "module", "bytes")
    if json:
        print(json_text([dict(zip(keys, row, strict=True)) for row in rows]))
        return 0
    for way, name, number, module, size in rows:
        to = f" to {module}" if module else ""
        say(f"{way:4} {number:3}  {name:20} {size:3} bytes{to}")
    if out is not None:
        say(f"written to {out}: {', '.join(written)}")
    return 0


def _load_link(software: Path | None):
    """What flies is checked with its modules; a file for the ground alone names none."""
    from torquer.flight.packets.software_file import load_link, read_software
    from torquer.flight.software.software import load_software

    file, _ = read_software(software)
    return load_software(software) if file.modules else load_link(software)


def _describe(link, out: Path) -> list[str]:
    """Write the descriptions that there can be; their names."""
    from torquer.flight.packets.dbc import dbc
    from torquer.flight.packets.document import document
    from torquer.flight.packets.openmct import openmct
    from torquer.flight.packets.xtce import xtce

    dictionary = link.dictionary
    makers: dict[str, tuple[str, Callable[[], str]]] = {
        "packets.xml": (" (XTCE)", lambda: xtce(dictionary, link.link)),
        "packets.dbc": ("", lambda: dbc(dictionary)),
        "packets.json": (" (Open MCT)", lambda: json_text(openmct(dictionary)) + "\n"),
        "packets.md": (
            "",
            lambda: f"# Packets of {dictionary.name}\n\n{document(dictionary, link.link)}",
        ),
    }
    written = []
    make_writable(out)
    with writing_to(out):
        for name, (what, make) in makers.items():
            try:
                put(out / name, make())
                written.append(f"{name}{what}")
            except ValueError as error:
                print_note(f"{name} is not written: {error}")
    return written


@app.command(name="import", help_epilogue=show_examples("packets import"))
def import_(
    file: Path,
    /,
    *,
    out: Annotated[Path, Parameter(help="The dictionary.")] = Path("dictionary.toml"),
    packet: Annotated[
        list[str] | None, Parameter(help="Only this container; may be repeated [all].")
    ] = None,
    json: Json = False,
) -> int:
    """Make a dictionary of the telemetry that FILE describes in XTCE (1.1 to 1.3).

    Whole numbers, floats, enumerations, binary data and texts of a fixed size, polynomials, both
    byte orders, and containers that inherit a header by a comparison of the APID. What a dictionary
    cannot hold is refused by its name; --packet takes only containers without it.
    """
    from torquer.flight.packets.dictionary_text import dictionary_toml
    from torquer.flight.packets.xtce_import import read_xtce

    found = read_xtce(file, packet or ())
    make_writable(out.parent)
    with writing_to(out.parent):
        put(out, dictionary_toml(found.dictionary))
    rows = [(each.name, each.id, each.size) for each in found.dictionary.down.values()]
    for note in found.notes:
        print_note(note)
    if json:
        named = [dict(zip(("name", "id", "bytes"), row, strict=True)) for row in rows]
        print(json_text({"file": str(out), "link": found.link, "packets": named}))
        return 0
    for name, number, size in rows:
        say(f"down {number:3}  {name:20} {size:3} bytes")
    say(f'written to {out}; in the software file: link = "{found.link}"')
    return 0
