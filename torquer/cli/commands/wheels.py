"""`torquer wheels`: capability and saturation of a wheel array on a satellite."""

from pathlib import Path
from typing import Annotated

from torquer.base.strict_json import json_text
from torquer.cli.options import FLAT, Json, options
from torquer.cli.output import make_writable, say, table, table_console, writing_to
from torquer.design.requests import WheelsRequest

#: Width of the tables where the output is not a terminal.
_WIDTH = 110


@options
class WheelsOptions:
    """Options of `torquer wheels` that Python does not need."""

    out: Path | None = None
    """Folder for pictures and the page [not written]."""
    json: Json = False


def wheels(
    design: Path,
    *,
    how: Annotated[WheelsRequest, FLAT] = WheelsRequest(),
    to: WheelsOptions = WheelsOptions(),
) -> int:
    """Capability of the array in the file DESIGN, with up to two failed wheels; saturation.

    With --out also envelope.png, failures.png, accumulation.png and wheels.html, an interactive
    view of the envelope. With --sweep also a table over the angle, and sweep.png.
    """
    from torquer.design.wheel_file import load_wheels
    from torquer.design.wheel_report import wheels as report_on

    report = report_on(load_wheels(design), how)
    files = [] if to.out is None else _draw(report, to.out)
    if to.json:
        print(json_text(report.data()))
        return 0
    _print(report)
    if files:
        say(f"{to.out}: {', '.join(path.name for path in files)}")
    return 0


def _draw(report, out: Path) -> list[Path]:
    from torquer.report.wheels.page import write_all

    make_writable(out)
    with writing_to(out):
        return write_all(report, out)


def _print(report) -> None:
    from rich.box import SIMPLE
    from rich.table import Table

    from torquer.design.wheel_tables import best_in_words, summary_rows

    screen = table_console(_WIDTH)
    summary = Table(title=report.title, show_header=False, title_justify="left", box=SIMPLE)
    for row in summary_rows(report.found):
        summary.add_row(*row)
    screen.print(summary)
    for title, head, rows, left in report.tables():
        screen.print(table(head, rows, title, range(left)))
    if report.swept:
        say(best_in_words(report.swept))
