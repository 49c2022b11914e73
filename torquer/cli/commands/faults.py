"""Work of `faults`: every single fault of a scenario flown, a table, a picture, the worst."""

import json
from pathlib import Path

from torquer.base.strict_json import json_text
from torquer.campaign.faults.contents import (
    WORDS,
    as_plain,
    counts_in_words,
    dataset_of,
    table_of,
)
from torquer.campaign.faults.fly import FaultCampaign, fly_faults
from torquer.campaign.faults.verdict import LOST
from torquer.cli.app import FaultOptions
from torquer.cli.commands.simulate import progress_of
from torquer.cli.loading import code_of, load_usable
from torquer.cli.mistakes import as_options
from torquer.cli.options import CodeOptions, check_ranges
from torquer.cli.output import make_writable, table, table_console, writing_to
from torquer.scenario.change import with_values
from torquer.scenario.spec import Scenario
from torquer.scenario.toml_text import toml_of
from torquer.simulation.results.file import put, save

_WIDTH = 150


def fly(path: Path, how: FaultOptions, code: CodeOptions) -> int:
    """Fly the faults, write the folder, print the table; 1 if one with guards is lost."""
    check_ranges(how)
    if how.workers is not None and how.workers < 1:
        raise ValueError(f"--workers: must be 1 or more; received {how.workers}")
    scenario = _changed(load_usable(path, code, None), how)
    out = how.out or Path("runs") / f"{scenario.name}-faults"
    make_writable(out)
    at_s = [3600.0 * at_h for at_h in how.at_h or ()]
    try:
        with progress_of(scenario.name) as progress:
            found = fly_faults(scenario, how.only or (), at_s, how.workers, progress)
    except ValueError as error:
        text = as_options(str(error), {"only": "--only", "at_h": "--at-h"})
        raise ValueError(text) from None
    with writing_to(out):
        files = _write(found, out)
    if how.json:
        print(json_text(as_plain(found) | {"worst_file": str(out / "worst.toml")}))
    else:
        _show(found, out, files, bool(code_of(scenario)))
    return 1 if found.counts(True)[LOST] else 0


def _changed(scenario: Scenario, how: FaultOptions) -> Scenario:
    changes: dict[str, float | None] = {}
    if how.seed is not None:
        changes["seed"] = how.seed
    if how.hours is not None:
        changes |= {"simulation.duration_s": 3600.0 * how.hours, "simulation.revolutions": None}
    return with_values(scenario, changes) if changes else scenario


def _write(found: FaultCampaign, out: Path) -> list[str]:
    from torquer.report.campaign.faults import write_fault_report

    save(dataset_of(found), out / "faults.nc")
    put(out / "faults.json", json_text(as_plain(found)) + "\n")
    worst = found.scenario_of(found.worst())
    text = toml_of(json.loads(worst.model_dump_json(exclude_unset=True, exclude_none=True)))
    put(out / "worst.toml", text)
    return [*write_fault_report(found, out), "faults.nc", "faults.json", "worst.toml"]


def _show(found: FaultCampaign, out: Path, files: list[str], user_code: bool) -> None:
    head, rows = table_of(found)
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
