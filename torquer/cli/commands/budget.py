"""`torquer budget`: disturbance torques along a motion as table, picture, JSON."""

from pathlib import Path

from torquer.base.strict_json import json_text
from torquer.cli.compiling import show_progress
from torquer.cli.loading import load_usable
from torquer.cli.options import CodeOptions, Json, options
from torquer.cli.output import print_error, table, table_console, writing_to
from torquer.cli.process import FAILED_CODE, INTERRUPTED_CODE

#: Width of the table where the output is not a terminal.
_WIDTH = 120


@options
class BudgetOptions:
    """Options of `torquer budget`."""

    out: Path | None = None
    """Folder for torques.png [not drawn]."""
    hold: bool = False
    """Do not simulate: hold the initial attitude in the frame of initial.reference."""
    json: Json = False


def budget(
    scenario: Path, *, how: BudgetOptions = BudgetOptions(), code: CodeOptions = CodeOptions()
) -> int:
    """Disturbance torques of SCENARIO along its motion, compared with what the coils can give."""
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
        print(picture)
    return 0


def _draw(budget, title: str, out: Path) -> Path:
    from torquer.report.flight.torque_budget import draw_budget

    with writing_to(out):
        return draw_budget(budget, title, out / "torques.png")
