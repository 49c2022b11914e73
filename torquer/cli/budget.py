"""Work of `budget`: disturbance torques along a motion as table, picture, JSON."""

from pathlib import Path

from rich.box import SIMPLE
from rich.table import Table

from torquer.analysis.budget import Budget, as_plain, budget_of_held_attitude, budget_of_run
from torquer.cli import FAILED_CODE, INTERRUPTED_CODE
from torquer.cli.output import console, json_text, make_writable, tell_error, writing_to
from torquer.cli.simulate import check_surroundings, progress_of
from torquer.cli.user_code import check_code
from torquer.report.flight.budget_rows import HEAD, budget_table, reach_in_words
from torquer.scenario.load import load_scenario
from torquer.simulation.simulate import RunStopped, simulate

#: Width of the table where the output is not a terminal.
_WIDTH = 120


def show(
    path: Path,
    out: Path | None,
    hold: bool,
    as_json: bool,
    user_code: bool = True,
    code_from_anywhere: bool = False,
) -> int:
    """Fly the scenario, or hold its initial attitude; print the budget, draw it into a folder."""
    scenario = load_scenario(path)
    check_code(scenario, path, user_code, code_from_anywhere)
    check_surroundings(scenario)
    if out is not None:
        make_writable(out)
    try:
        budget = budget_of_held_attitude(scenario) if hold else _flown(scenario)
    except RunStopped as error:
        tell_error(str(error))
        return INTERRUPTED_CODE if error.interrupted else FAILED_CODE
    title = f"Torque budget of {scenario.name}" + (", attitude held" if hold else "")
    if out is not None:
        _draw(budget, title, out)
    if as_json:
        print(json_text({"scenario": scenario.name, "attitude_held": hold, **as_plain(budget)}))
        return 0
    screen = console()
    if not screen.is_terminal:
        screen = console(width=_WIDTH)
    screen.print(_table(budget, title))
    if line := reach_in_words(budget):
        screen.print(line, soft_wrap=True)
    if out is not None:
        print(out / "torques.png")
    return 0


def _flown(scenario) -> Budget:
    with progress_of(scenario.name) as progress:
        return budget_of_run(simulate(scenario, progress=progress))


def _draw(budget, title: str, out: Path) -> None:
    from torquer.report.flight.torque_budget import draw_budget

    with writing_to(out):
        draw_budget(budget, title, out / "torques.png")


def _table(budget, title: str) -> Table:
    unit, rows = budget_table(budget)
    table = Table(title=f"{title}, {unit}", title_justify="left", box=SIMPLE)
    for k, name in enumerate(HEAD):
        table.add_column(name, justify="right" if k else "left", no_wrap=True)
    for row in rows:
        table.add_row(*row)
    return table
