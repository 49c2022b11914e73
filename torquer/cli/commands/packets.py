"""`torquer packets`: the dictionary of a software listed, and described for other programs."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from torquer.base.strict_json import json_text
from torquer.cli.loading import load_given
from torquer.cli.options import Json
from torquer.cli.output import make_writable, writing_to
from torquer.simulation.results.file import put


def packets(
    software: Path | None = None,
    /,
    *,
    scenario: Annotated[
        Path | None, Parameter(help="Scenario of the satellite: names of its sensors [none].")
    ] = None,
    out: Annotated[Path | None, Parameter(help="Folder for the descriptions [not made].")] = None,
    json: Json = False,
) -> int:
    """List the packets of SOFTWARE [that of Chibis-M] with their ids and sizes.

    With --out, descriptions for other programs, all made from the one dictionary: XTCE
    (packets.xml), CAN buses (packets.dbc), Open MCT (packets.json), readers (packets.md). Bits that
    stand for one of several sensors have names only with --scenario.
    """
    from torquer.flight.packets.dbc import dbc
    from torquer.flight.packets.document import document
    from torquer.flight.packets.openmct import openmct
    from torquer.flight.packets.xtce import xtce
    from torquer.flight.software.software import load_software

    dictionary = load_software(software).for_satellite(load_given(scenario)).dictionary
    if out is not None:
        make_writable(out)
        with writing_to(out):
            put(out / "packets.xml", xtce(dictionary))
            put(out / "packets.dbc", dbc(dictionary))
            put(out / "packets.json", json_text(openmct(dictionary)) + "\n")
            put(out / "packets.md", f"# Packets of {dictionary.name}\n\n{document(dictionary)}")
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
        print(f"{way:4} {number:3}  {name:20} {size:3} bytes{to}")
    if out is not None:
        print(f"written to {out}: packets.xml (XTCE), packets.dbc, packets.json (Open MCT), .md")
    return 0
