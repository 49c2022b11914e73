"""`torquer budget`: disturbance torques along a motion as table, picture, JSON."""

from pathlib import Path

from torquer.analysis.budget import Budget, as_plain, budget_along_run, budget_while_held
from torquer.base.strict_json import json_text
from torquer.cli.commands.run import show_progress
from torquer.cli.loading import load_usable
from torquer.cli.options import CodeOptions, Json, options
from torquer.cli.output import print_error, table, table_console, writing_to
from torquer.cli.process import FAILED_CODE, INTERRUPTED_CODE
from torquer.report.flight.budget_rows import (
    HEAD,
    budget_table,
    models_in_words,
    reach_in_words,
)
from torquer.simulation.setup.simulate import RunStopped, simulate

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
    satellite = load_usable(scenario, code, how.out)
    try:
        found = budget_while_held(satellite) if how.hold else _fly(satellite)
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
    unit, rows = budget_table(found)
    screen.print(table(HEAD, rows, f"{title}, {unit}"))
    for line in filter(None, (reach_in_words(found), models_in_words(found.models))):
        screen.print(line, soft_wrap=True)
    if picture:
        print(picture)
    return 0


def _fly(scenario) -> Budget:
    with show_progress(scenario.name) as progress:
        return budget_along_run(simulate(scenario, progress=progress))


def _draw(budget: Budget, title: str, out: Path) -> Path:
    from torquer.report.flight.torque_budget import draw_budget

    with writing_to(out):
        return draw_budget(budget, title, out / "torques.png")
