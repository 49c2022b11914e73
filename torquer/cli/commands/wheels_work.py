"""Work of `torquer wheels`: tables, JSON and pictures."""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from rich.box import SIMPLE
from rich.table import Table

from torquer.base.strict_json import json_text
from torquer.cli.commands.wheels import WheelsOptions
from torquer.cli.output import make_writable, table, table_console, writing_to
from torquer.design.wheel_design import report_of
from torquer.design.wheel_file import WheelDesign, load_wheels
from torquer.design.wheel_sweep import Sweep, angles_of, as_plain, sweep_of
from torquer.report.wheels.tables import (
    best_in_words,
    failure_rows,
    layout_rows,
    summary_rows,
    sweep_rows,
)

#: Width of the tables where the output is not a terminal.
_WIDTH = 110
#: A sweep as it is written, with the number of points behind it or without.
_SWEEP = re.compile(r"^(\w+)=([^:]+):([^:]+)(?::(\d+))?$")
_POINTS, _MOST_POINTS = 61, 1001


def show(path: Path, how: WheelsOptions) -> int:
    """Print the report on a design; draw it if a folder is given."""
    design = load_wheels(path)
    swept = None if how.sweep is None else sweep_of(design, *swept_angle(design, how.sweep))
    if how.out is not None:
        make_writable(how.out)
    report = report_of(design)
    files = [] if how.out is None else _draw(design, report, swept, how.out)
    if how.json:
        print(json_text(report | ({"sweep": as_plain(swept)} if swept else {})))
        return 0
    screen = table_console(_WIDTH)
    screen.print(_summary(report))
    for title, head, rows, left in _tables(report, swept):
        screen.print(table(head, rows, title, range(left)))
    if swept:
        print(best_in_words(swept))
    if files:
        print(f"{how.out}: {', '.join(files)}")
    return 0


def swept_angle(design: WheelDesign, text: str) -> tuple[str, list[float]]:
    """Key and values [deg] of a sweep written `gamma_deg=20:85` or `gamma_deg=20:85:14`.

    `ValueError` for a key other than an angle of the design's layout, and for bad numbers.
    """
    angles = angles_of(design)
    if not angles:
        kind = design.wheels.layout.kind
        raise ValueError(f"--sweep: must name an angle of the layout; {kind} has none")
    example = f"such as {angles[0]}=20:85 or {angles[0]}=20:85:14"
    found = _SWEEP.match(text)
    if found is None or found[1] not in angles:
        raise ValueError(
            f"--sweep: must be ANGLE=FROM:TO, {example}, with {' or '.join(angles)}; "
            f"received {text!r}"
        )
    try:
        first, last = float(found[2]), float(found[3])
    except ValueError:
        raise ValueError(f"--sweep: must have numbers, {example}; received {text!r}") from None
    points = int(found[4] or _POINTS)
    if not 0.0 < first < last < 90.0:
        raise ValueError(f"--sweep: must increase, from above 0 to below 90 deg; received {text!r}")
    if not 2 <= points <= _MOST_POINTS:
        raise ValueError(f"--sweep: must have 2 to {_MOST_POINTS} points; received {points}")
    return found[1], np.linspace(first, last, points).tolist()


def _draw(design, report: dict, swept: Sweep | None, out: Path) -> list[str]:
    from torquer.report.wheels.page import write_page
    from torquer.report.wheels.pictures import draw_all
    from torquer.report.wheels.sweep import draw_sweep

    with writing_to(out):
        made = draw_all(design, report, out)
        made += [draw_sweep(design, swept, out / "sweep.png")] if swept else []
        return [path.name for path in (*made, write_page(design, report, out / "wheels.html"))]


def _summary(report: dict) -> Table:
    title = report["description"] or report["name"]
    summary = Table(title=title, show_header=False, title_justify="left", box=SIMPLE)
    for row in summary_rows(report):
        summary.add_row(*row)
    return summary


def _tables(report: dict, swept: Sweep | None) -> Iterator[tuple]:
    """Title, head, rows and number of columns of words of each table of the report."""
    yield *failure_rows(report), 1
    if len(report["layouts"]) > 1:
        yield *layout_rows(report), 2
    if swept:
        yield *sweep_rows(swept), 0
