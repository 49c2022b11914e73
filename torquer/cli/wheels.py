"""`torquer wheels`: a wheel array on a satellite - what it can do, and for how long."""

from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

app = App(
    name="wheels",
    help="Reaction-wheel arrays: envelope, rates, failures, other layouts, saturation.",
    version_flags=[],
)


@app.default
def wheels(
    design: Path,
    *,
    out: Annotated[
        Path | None, Parameter(help="Folder for pictures and the page [none are made].")
    ] = None,
    json: Annotated[bool, Parameter(help="Print machine-readable JSON.", negative="")] = False,
) -> int:
    """What the array in the file DESIGN can do, with any one or two wheels lost, and for how long.

    With a folder also envelope.png, failures.png, accumulation.png and wheels.html, where the
    envelope turns with the mouse.
    """
    from torquer.cli import wheels_work as work

    return work.show(design, out, json)
