"""Work of `modes`: the mode table of a scenario in words and as a diagram, and its faults."""

import os
from pathlib import Path

from torquer.analysis.notes.mode_notes import mode_findings
from torquer.base.strict_json import json_text
from torquer.cli.app import ModesOptions
from torquer.cli.loading import load_checked
from torquer.cli.options import CodeOptions
from torquer.computer.modes.spec import MAIN, Modes
from torquer.computer.modes.wording import state_in_words, transition_in_words


def show(path: Path, how: ModesOptions, code: CodeOptions) -> int:
    """Print or write the diagram, print the findings."""
    from torquer.computer.modes.diagram import mermaid, svg

    scenario = load_checked(path, code)
    modes = scenario.control.named().modes
    if modes is None:
        raise ValueError("control.modes: must be given, or a scheme as control.law; received none")
    if how.svg is not None:
        _write(svg(modes), how.svg)
    found = mode_findings(scenario)
    if how.json:
        data = {"mermaid": mermaid(modes), "findings": [each._asdict() for each in found]}
        print(json_text(data, None))
        return 0
    print(mermaid(modes).rstrip("\n") if how.mermaid else "\n".join(in_words(modes)))
    for each in found:
        mark = "%% " if how.mermaid else ""
        print(f"{mark}{'note' if each.is_fault else 'modes'}: {each.message}")
        for line in each.strip:
            print(f"{mark}    {line}")
    if how.svg is not None and not how.mermaid:
        print(os.fspath(how.svg))
    return 0


def _write(text: str, picture: Path) -> None:
    try:
        picture.write_text(text, encoding="utf-8")
    except OSError as error:
        raise ValueError(
            f"--svg: must be a file that can be written; received {picture} "
            f"({error.strerror or error})"
        ) from None


def in_words(modes: Modes) -> list[str]:
    """Regions, states and transitions, line by line."""
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
    return f"{leaves}-> {transition.to}: {transition_in_words(transition)}"
