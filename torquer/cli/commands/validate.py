"""`torquer validate`: errors in a scenario, and notes on likely problems, without running it."""

from pathlib import Path

from torquer.base.language import message
from torquer.base.strict_json import json_text
from torquer.cli import compiling
from torquer.cli.loading import check_code, find_code, load_checked
from torquer.cli.options import CodeOptions, Json
from torquer.cli.output import say
from torquer.compile.when_compiling import plainly


@plainly()  # loading the compiler takes longer than all that is computed here
def validate(scenario: Path, *, json: Json = False, code: CodeOptions = CodeOptions()) -> int:
    """Check SCENARIO without running it: errors, and notes on likely problems."""
    from torquer.analysis.notes.assess import assess, attempt
    from torquer.analysis.notes.fault_notes import Unnoticed, lines_of, unnoticed_faults
    from torquer.analysis.notes.mode_notes import mode_findings
    from torquer.analysis.notes.notes import write_notes
    from torquer.campaign.load import check_own_parts
    from torquer.flight.c99.notes import export_notes
    from torquer.simulation.setup.usable import check_usable, checked_size

    try:
        checked = load_checked(scenario, code)
        campaign = _campaign_in(scenario, checked)
        check_code(checked, scenario, code, campaign)
        if campaign:
            check_own_parts(campaign, checked)
        blocks = check_usable(checked)
        size = checked_size(checked, blocks)
        campaign_size = None
        if campaign:
            from torquer.campaign.size import checked_campaign_size

            campaign_size = checked_campaign_size(checked, campaign, size, blocks)
    except ValueError as error:
        if not json:
            raise
        print(json_text({"valid": False, "errors": str(error).splitlines()}))
        return 2
    notes = [*write_notes(checked), *assess({"the export to C": export_notes}, checked)]
    if campaign:
        from torquer.campaign.notes import campaign_notes

        notes += campaign_notes(checked, campaign)
    found = attempt("the table of modes", lambda: mode_findings(checked), notes) or []
    faults = attempt("the faults that go unnoticed", lambda: unnoticed_faults(checked), notes)
    unnoticed = faults or Unnoticed([], [])
    executed = _keys_by_file(find_code(checked, campaign))
    if json:
        data = {"scenario": checked.name, "valid": True, "notes": notes, "size": size._asdict()}
        data["compiles_first"] = compiling.is_cold()
        data["executes"] = sorted(map(str, executed))
        if (error_m := _interpolation_error_m(checked)) is not None:
            data["interpolation_error_m"] = error_m
        if campaign and campaign_size:
            data["campaign"] = campaign.model_dump(mode="json", exclude_none=True)
            data["campaign_size"] = campaign_size._asdict()
        data["unnoticed_faults"] = unnoticed._asdict()
        print(json_text(data | {"modes": [each._asdict() for each in found]}))
        return 0
    _show(checked, campaign, (size, campaign_size), executed, found)
    for line in lines_of(unnoticed):
        say(f"faults: {line}")
    for note in notes:
        say(f"note: {note}")
    return 0


def _interpolation_error_m(scenario) -> float | None:
    """Stated error of an orbit from a file; None of any other."""
    from torquer.environment.orbit import FileOrbit

    if not isinstance(scenario.orbit, FileOrbit):
        return None
    return scenario.orbit.interpolation_error_m(scenario.start, 0.0, scenario.length_s)


def _show(scenario, campaign, sizes: tuple, executed: dict, found: list) -> None:
    from torquer.environment.orbit import FileOrbit
    from torquer.simulation.setup.size import bytes_text, time_text

    length, (size, campaign_size) = time_text(scenario.length_s), sizes
    template, steps = "{name}: valid, {length} of flight; {in_words}", scenario.simulation.in_words
    say(message(template, name=scenario.name, length=length, in_words=steps))
    say(
        f"a run: {size.rows} rows, result of about {bytes_text(size.disk_bytes)}, about "
        f"{bytes_text(size.memory_bytes)} of memory and {time_text(size.computing_s)} of computing"
    )
    if isinstance(scenario.orbit, FileOrbit):
        say(scenario.orbit.in_words(scenario.start, scenario.length_s))
    if compiling.is_cold():
        say(compiling.AHEAD)
    if campaign:
        say(f"campaign: {campaign.in_words}")
        say(f"campaign: {campaign_size.in_words}")
    for file, keys in executed.items():
        places = ", ".join(key.removesuffix(".file") for key in keys)
        say(f"executes {file} ({places}); --no-user-code refuses it")
    for finding in found:
        if not finding.is_fault:  # the faults are among the notes
            say(f"modes: {finding.message}")


def _keys_by_file(named: dict[str, Path]) -> dict[Path, list[str]]:
    """The keys that name each file."""
    found: dict[Path, list[str]] = {}
    for key, file in named.items():
        found.setdefault(file, []).append(key)
    return found


def _campaign_in(path: Path, scenario):
    """The campaign in a file, checked with its scenario; None for a file without."""
    from torquer.scenario.toml_text import parse_toml, read_text

    table = parse_toml(read_text(path, "scenario"), "scenario").get("campaign")
    if table is None:
        return None
    from torquer.campaign.load import campaign_from_data

    return campaign_from_data(table, scenario, path.parent)
