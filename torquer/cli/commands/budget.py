"""Work of `budget`: disturbance torques along a motion as table, picture, JSON."""

from pathlib import Path

from torquer.analysis.budget import Budget, as_plain, budget_of_held_attitude, budget_of_run
from torquer.base.strict_json import json_text
from torquer.cli import FAILED_CODE, INTERRUPTED_CODE
from torquer.cli.app import BudgetOptions
from torquer.cli.commands.simulate import progress_of
from torquer.cli.loading import load_usable
from torquer.cli.options import CodeOptions
from torquer.cli.output import print_error, table, table_console, writing_to
from torquer.report.flight.budget_rows import (
    HEAD,
    budget_table,
    models_in_words,
    reach_in_words,
)
from torquer.simulation.setup.simulate import RunStopped, simulate

#: Width of the table where the output is not a terminal.
_WIDTH = 120


def show(path: Path, how: BudgetOptions, code: CodeOptions) -> int:
    """Fly the scenario, or hold its initial attitude; print the budget, draw it into a folder."""
    scenario = load_usable(path, code, how.out)
    try:
        budget = budget_of_held_attitude(scenario) if how.hold else _flown(scenario)
    except RunStopped as error:
        print_error(str(error))
        return INTERRUPTED_CODE if error.interrupted else FAILED_CODE
    title = f"Torque budget of {scenario.name}" + (", attitude held" if how.hold else "")
    picture = None if how.out is None else _draw(budget, title, how.out)
    if how.json:
        head = {"scenario": scenario.name, "attitude_held": how.hold}
        print(json_text(head | as_plain(budget)))
        return 0
    screen = table_console(_WIDTH)
    unit, rows = budget_table(budget)
    screen.print(table(HEAD, rows, f"{title}, {unit}"))
    for line in filter(None, (reach_in_words(budget), models_in_words(budget.models))):
        screen.print(line, soft_wrap=True)
    if picture:
        print(picture)
    return 0


def _flown(scenario) -> Budget:
    with progress_of(scenario.name) as progress:
        return budget_of_run(simulate(scenario, progress=progress))


def _draw(budget: Budget, title: str, out: Path) -> Path:
    from torquer.report.flight.torque_budget import draw_budget

    with writing_to(out):
        return draw_budget(budget, title, out / "torques.png")
