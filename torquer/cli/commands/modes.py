"""`torquer modes`: the mode table of a scenario in words and as a diagram, and its faults."""

import os
from pathlib import Path

from torquer.base.strict_json import json_text
from torquer.cli.loading import load_checked
from torquer.cli.options import CodeOptions, Json, options
from torquer.cli.output import say


@options
class ModesOptions:
    """Options of `torquer modes`."""

    mermaid: bool = False
    """Print the diagram as Mermaid text."""
    svg: Path | None = None
    """File for the diagram as a picture."""
    json: Json = False


def modes(
    scenario: Path, *, how: ModesOptions = ModesOptions(), code: CodeOptions = CodeOptions()
) -> int:
    """Show the modes of SCENARIO: states, transitions, dead ends, conflicts, chatter."""
    from torquer.analysis.notes.mode_notes import mode_findings
    from torquer.computer.modes.diagram import mermaid, svg

    satellite = load_checked(scenario, code)
    table = satellite.control.named().modes
    if table is None:
        raise ValueError("control.modes: must be given, or a scheme as control.law; received none")
    if how.svg is not None:
        _write(svg(table), how.svg)
    found = mode_findings(satellite)
    if how.json:
        data = {"mermaid": mermaid(table), "findings": [each._asdict() for each in found]}
        print(json_text(data, None))
        return 0
    if how.mermaid:
        print(mermaid(table).rstrip("\n"))
    else:
        say(*in_words(table))
    for each in found:
        mark = "%% " if how.mermaid else ""
        say(f"{mark}{'note' if each.is_fault else 'modes'}: {each.message}")
        for line in each.strip:
            say(f"{mark}    {line}")
    if how.svg is not None and not how.mermaid:
        say(os.fspath(how.svg))
    return 0


def _write(text: str, picture: Path) -> None:
    try:
        picture.write_text(text, encoding="utf-8")
    except OSError as error:
        raise ValueError(
            f"--svg: must be a file that can be written; received {picture} "
            f"({error.strerror or error})"
        ) from None


def in_words(modes) -> list[str]:
    """Regions, states and transitions of a mode table, line by line."""
    from torquer.computer.modes.spec import MAIN
    from torquer.computer.modes.wording import state_in_words

    lines = []
    for name, region in modes.regions.items():
        lines += [f"region {name}"] if name != MAIN else []
        lines += [_transition(each, "any state ") for each in region.transitions]
        for key, state in region.states.items():
            does = ", ".join(state_in_words(state)) or "nothing"
            begin = " (initial)" if key == region.initial else ""
            lines.append(f"{key}{begin}: {does}")
            lines += [_transition(each, "  ") for each in state.transitions]
    return lines


def _transition(transition, leaves: str) -> str:
    from torquer.computer.modes.wording import transition_in_words

    return f"{leaves}-> {transition.to}: {transition_in_words(transition)}"
