"""`torquer faults`: every single fault of a scenario flown, a table, a picture, the worst."""

import json
from pathlib import Path
from typing import Annotated

from torquer.base.limits import at_least, positive
from torquer.base.strict_json import json_text
from torquer.cli.compiling import show_progress
from torquer.cli.loading import find_code, load_usable
from torquer.cli.options import CodeOptions, Json, as_options, options
from torquer.cli.output import make_writable, table, table_console, writing_to
from torquer.simulation.results.file import put, save

_WIDTH = 150


@options
class FaultOptions:
    """Options of `torquer faults`."""

    only: list[str] | None = None
    """Only faults with this in their names, such as 'gyro' or 'coil 0 dead'; may be repeated."""
    at_h: list[float] | None = None
    """Hours after the start at which faults strike [in each mode]; may be repeated."""
    hours: Annotated[float | None, positive()] = None
    """Length of each flight in hours [SCENARIO's]."""
    seed: Annotated[int | None, at_least(0)] = None
    """Seed of all random numbers [SCENARIO's]."""
    workers: Annotated[int | None, at_least(1)] = None
    """Flights at once [one per core]."""
    out: Path | None = None
    """Output folder [runs/NAME-faults]."""
    json: Json = False


def faults(
    scenario: Path, *, how: FaultOptions = FaultOptions(), code: CodeOptions = CodeOptions()
) -> int:
    """Fly SCENARIO with every single fault of its sensors, coils, wheels and computer.

    Each fault strikes in each mode that the flight without a fault visits: in the middle of the
    longest stay, or next to it with the Sun in view; with guards and without. Guards are
    regions of modes without laws, estimators and settings. Lost: the flight ended early, or the
    rate exceeds 2 deg/s in the last revolution (or twice that without a fault). Safe: not lost,
    the limits of [mission] hold during the whole last revolution, and the coils used at most 3
    times the energy without a fault. Degraded: all else. Noticed: the modes entered a state
    that they do not enter without the fault. Exit code 1 if a flight with guards is lost.
    """
    from torquer.campaign.faults.contents import as_plain
    from torquer.campaign.faults.fly import fly_faults
    from torquer.campaign.faults.verdict import LOST

    flown = _change(load_usable(scenario, code, None), how)
    out = how.out or Path("runs") / f"{flown.name}-faults"
    make_writable(out)
    at_s = [3600.0 * at_h for at_h in how.at_h or ()]
    try:
        with show_progress(flown.name) as progress:
            found = fly_faults(flown, how.only or (), at_s, how.workers, progress)
    except ValueError as error:
        text = as_options(str(error), {"only": "--only", "at_h": "--at-h"})
        raise ValueError(text) from None
    with writing_to(out):
        files = _write(found, out)
    if how.json:
        print(json_text(as_plain(found) | {"worst_file": str(out / "worst.toml")}))
    else:
        _show(found, out, files, bool(find_code(flown)))
    return 1 if found.counts(True)[LOST] else 0


def _change(scenario, how: FaultOptions):
    from torquer.scenario.change import with_values

    changes: dict[str, float | None] = {}
    if how.seed is not None:
        changes["seed"] = how.seed
    if how.hours is not None:
        changes |= {"simulation.duration_s": 3600.0 * how.hours, "simulation.revolutions": None}
    return with_values(scenario, changes) if changes else scenario


def _write(found, out: Path) -> list[str]:
    from torquer.campaign.faults.contents import as_plain, fault_dataset
    from torquer.report.campaign.faults import write_fault_report
    from torquer.scenario.toml_text import to_toml

    save(fault_dataset(found), out / "faults.nc")
    put(out / "faults.json", json_text(as_plain(found)) + "\n")
    worst = found.scenario_of(found.worst())
    text = to_toml(json.loads(worst.model_dump_json(exclude_unset=True, exclude_none=True)))
    put(out / "worst.toml", text)
    return [*write_fault_report(found, out), "faults.nc", "faults.json", "worst.toml"]


def _show(found, out: Path, files: list[str], user_code: bool) -> None:
    from torquer.campaign.faults.contents import WORDS, counts_in_words, fault_table

    head, rows = fault_table(found)
    words = [k for k, name in enumerate(head) if name in WORDS]
    title = f"{found.scenario.name}: single faults; without a fault {found.verdict[0]}"
    table_console(_WIDTH).print(table(head, rows, title, left=words))
    for line in counts_in_words(found):
        print(line)
    worst, anywhere = found.worst(), " --code-from-anywhere" if user_code else ""
    outcome, at_h = worst.outcome, worst.strike.at_s / 3600.0
    print(
        f"worst: {worst.fault.name} at {at_h:.2f} h, {outcome.verdict}"
        f"{': ' + outcome.why if outcome.why else ''}; "
        f"fly it again: torquer run {out / 'worst.toml'}{anywhere}"
    )
    print(f"{out}: {', '.join(files)}")
