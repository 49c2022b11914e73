"""`torquer faults`: every single fault of a scenario flown, or pairs; a table, the worst."""

import json
from pathlib import Path
from typing import Annotated

from torquer.base.limits import at_least, positive, within
from torquer.base.strict_json import json_text
from torquer.cli.compiling import show_progress
from torquer.cli.loading import find_code, load_usable, note_whole_flights
from torquer.cli.options import CodeOptions, Json, as_options, options
from torquer.cli.output import make_writable, say, table, table_console, writing_to
from torquer.simulation.results.file import put, save

_WIDTH = 150


@options
class FaultOptions:
    """Options of `torquer faults`."""

    only: list[str] | None = None
    """Only faults with this in their names, such as 'gyro' or 'coil 0 dead'; may be repeated."""
    at_h: list[float] | None = None
    """Hours after the start at which faults strike, the first ones of pairs [in each mode; of pairs
    any time in the first half]; may be repeated.
    """
    pairs: Annotated[int | None, within(1, 1_000_000)] = None
    """Fly so many pairs of faults, drawn by the seed, in place of single ones."""
    hours: Annotated[float | None, positive()] = None
    """Length of each flight in hours [SCENARIO's]."""
    seed: Annotated[int | None, at_least(0)] = None
    """Seed of all random numbers [SCENARIO's]."""
    workers: Annotated[int | None, at_least(1)] = None
    """Flights at once [one per core]."""
    out: Path | None = None
    """Output folder [runs/NAME-faults, of pairs runs/NAME-pairs]."""
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

    With --pairs, pairs of these faults: the second one at the same time or up to a quarter of the
    flight later. A pair has its number and depends on the seed alone, not on how many are flown.
    Exit code 1 if the satellite is lost and no mode has switched the coils off.
    """
    flown = _change(load_usable(scenario, code, None), how)
    note_whole_flights(flown)
    out = how.out or Path("runs") / f"{flown.name}-{'pairs' if how.pairs else 'faults'}"
    make_writable(out)
    try:
        return _pairs(flown, how.pairs, how, out) if how.pairs else _singles(flown, how, out)
    except ValueError as error:
        text = as_options(str(error), {"only": "--only", "at_h": "--at-h"})
        raise ValueError(text) from None


def _at_s(how: FaultOptions) -> list[float]:
    return [3600.0 * at_h for at_h in how.at_h or ()]


def _singles(flown, how: FaultOptions, out: Path) -> int:
    from torquer.campaign.faults.contents import as_plain
    from torquer.campaign.faults.fly import fly_faults
    from torquer.campaign.faults.verdict import LOST

    with show_progress(flown.name) as progress:
        found = fly_faults(flown, how.only or (), _at_s(how), how.workers, progress)
    with writing_to(out):
        files = _write(found, out)
    if how.json:
        print(json_text(as_plain(found) | {"worst_file": str(out / "worst.toml")}))
    else:
        _show(found, out, files, bool(find_code(flown)))
    return 1 if found.counts(True)[LOST] else 0


def _pairs(flown, pairs: int, how: FaultOptions, out: Path) -> int:
    from torquer.campaign.faults.pair_contents import pairs_as_plain
    from torquer.campaign.faults.pairs import fly_pairs

    with show_progress(flown.name) as progress:
        found = fly_pairs(flown, pairs, how.only or (), _at_s(how), how.workers, progress)
    plain = pairs_as_plain(found)
    with writing_to(out):
        files = _write_pairs(found, plain, out)
    if how.json:
        print(json_text(plain | {"worst_file": str(out / "worst.toml")}))
    else:
        _show_pairs(found, out, files)
    return 1 if plain["counts"]["lost_unnoticed"] else 0


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

    save(fault_dataset(found), out / "faults.nc")
    put(out / "faults.json", json_text(as_plain(found)) + "\n")
    _write_worst(found, out)
    return [*write_fault_report(found, out), "faults.nc", "faults.json", "worst.toml"]


def _write_worst(found, out: Path) -> None:
    from torquer.scenario.toml_text import to_toml

    worst = found.scenario_of(found.worst())
    text = to_toml(json.loads(worst.model_dump_json(exclude_unset=True, exclude_none=True)))
    put(out / "worst.toml", text)


def _write_pairs(found, plain: dict, out: Path) -> list[str]:
    from torquer.report.campaign.pairs import write_pair_report
    from torquer.scenario.toml_text import to_toml

    put(out / "pairs.json", json_text(plain) + "\n")
    _write_worst(found, out)
    put(out / "worst-faults.toml", to_toml(found.worst().pair.tables()))
    return [*write_pair_report(found, out), "pairs.json", "worst.toml", "worst-faults.toml"]


def _show_pairs(found, out: Path, files: list[str]) -> None:
    from torquer.campaign.faults.pair_contents import WORDS, pair_counts_in_words, pair_table

    head, rows = pair_table(found)
    if rows:
        title = f"{found.scenario.name}: lost by pairs of faults; without {found.verdict[0]}"
        words = [k for k, name in enumerate(head) if name in WORDS]
        table_console(_WIDTH).print(table(head, rows, title, left=words))
    for line in pair_counts_in_words(found):
        say(line)
    say(
        f"fly the worst again: torquer run {out / 'worst.toml'}, or "
        f"torquer fly SCENARIO --faults {out / 'worst-faults.toml'}"
    )
    say(f"{out}: {', '.join(files)}")


def _show(found, out: Path, files: list[str], user_code: bool) -> None:
    from torquer.campaign.faults.contents import WORDS, counts_in_words, fault_table

    head, rows = fault_table(found)
    words = [k for k, name in enumerate(head) if name in WORDS]
    title = f"{found.scenario.name}: single faults; without a fault {found.verdict[0]}"
    table_console(_WIDTH).print(table(head, rows, title, left=words))
    for line in counts_in_words(found):
        say(line)
    worst, anywhere = found.worst(), " --code-from-anywhere" if user_code else ""
    outcome, at_h = worst.outcome, worst.strike.at_s / 3600.0
    say(
        f"worst: {worst.fault.name} at {at_h:.2f} h, {outcome.verdict}"
        f"{': ' + outcome.why if outcome.why else ''}; "
        f"fly it again: torquer run {out / 'worst.toml'}{anywhere}"
    )
    say(f"{out}: {', '.join(files)}")
