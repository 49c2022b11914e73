"""`torquer budget`: disturbance torques along a motion, or a pointing budget, as table, picture,
JSON."""

from dataclasses import fields
from pathlib import Path
from typing import Annotated

from torquer.base.strict_json import json_text
from torquer.cli.compiling import show_progress
from torquer.cli.loading import load_usable
from torquer.cli.options import FLAT, CodeOptions, Json, option, options
from torquer.cli.output import (
    moving_bar,
    print_answer,
    print_error,
    say,
    table,
    table_console,
    writing_to,
)
from torquer.cli.process import FAILED_CODE, INTERRUPTED_CODE
from torquer.design.requests import PointingRequest

#: Width of the table where the output is not a terminal.
_WIDTH = 120


@options
class BudgetOptions:
    """Options of `torquer budget`."""

    out: Path | None = None
    """Folder for torques.png; with --pointing for pointing.png, pointing.csv [not written]."""
    hold: bool = False
    """Do not simulate: hold the initial attitude in the frame of initial.reference."""
    pointing: bool = False
    """Errors of the held attitude by cause in place of torques, predicted and flown."""
    json: Json = False


def budget(
    scenario: Path,
    *,
    how: BudgetOptions = BudgetOptions(),
    asked: Annotated[PointingRequest, FLAT] = PointingRequest(),
    code: CodeOptions = CodeOptions(),
) -> int:
    """Disturbance torques of SCENARIO along its motion, compared with what the coils can give.

    With --pointing: errors of pointing (APE), stability (RPE) and knowledge (AKE) of the attitude
    that its law holds, by cause and for all, by linear theory and in flights with one cause each.
    """
    if how.pointing:
        return _point(scenario, how, asked, code)
    for each in fields(asked):
        if getattr(asked, each.name) != each.default:
            raise ValueError(f"{option(each.name)}: must be given with --pointing alone")
    from torquer.analysis.budget import as_plain, budget_along_run, budget_while_held
    from torquer.report.flight import budget_rows as report
    from torquer.simulation.setup.simulate import RunStopped, simulate

    satellite = load_usable(scenario, code, how.out)
    try:
        if how.hold:
            found = budget_while_held(satellite)
        else:
            with show_progress(satellite.name) as progress:
                found = budget_along_run(simulate(satellite, progress=progress))
    except RunStopped as error:
        print_error(str(error))
        return INTERRUPTED_CODE if error.interrupted else FAILED_CODE
    title = f"Torque budget of {satellite.name}" + (", attitude held" if how.hold else "")
    picture = None if how.out is None else _draw(found, title, how.out)
    if how.json:
        head = {"scenario": satellite.name, "attitude_held": how.hold}
        print(json_text(head | as_plain(found)))
        return 0
    screen = table_console(_WIDTH)
    unit, rows = report.budget_table(found)
    screen.print(table(report.HEAD, rows, f"{title}, {unit}"))
    for line in filter(None, (report.reach_in_words(found), report.models_in_words(found.models))):
        screen.print(line, soft_wrap=True)
    if picture:
        say(picture)
    return 0


def _point(path: Path, how: BudgetOptions, asked: PointingRequest, code: CodeOptions) -> int:
    """Print a pointing budget."""
    from torquer.design.pointing_answer import pointing_budget

    if how.hold:
        raise ValueError("--hold: must be left out with --pointing, whose law holds the attitude")
    satellite = load_usable(path, code, how.out)
    given, columns = ("completed", "total"), ("MofNCompleteColumn", "TimeRemainingColumn")
    with moving_bar("flights", given, *columns) as progress:
        found = pointing_budget(satellite, asked, progress)
    written = [] if how.out is None else _write_pointing(found, how.out)
    return print_answer(found, how.json, how.out, written)


def _write_pointing(found, out: Path) -> list[Path]:
    """pointing.png and pointing.csv."""
    from torquer.report.common.figure import save_figure
    from torquer.report.theory.pointing import draw_pointing
    from torquer.simulation.results.file import put

    with writing_to(out):
        picture = save_figure(draw_pointing(found), out / "pointing.png")
        return [picture, put(out / "pointing.csv", found.csv())]


def _draw(budget, title: str, out: Path) -> Path:
    from torquer.report.flight.torque_budget import draw_budget

    with writing_to(out):
        return draw_budget(budget, title, out / "torques.png")
