"""Work of `modes`: the mode table of a scenario in words and as a diagram, and its faults."""

import os
from pathlib import Path

from torquer.cli.output import json_text
from torquer.cli.user_code import check_code
from torquer.control.modes.check import Finding, findings
from torquer.control.modes.spec import MAIN, Modes
from torquer.control.modes.wording import state_in_words, transition_in_words
from torquer.scenario.load import load_scenario


def mode_findings(scenario) -> list[Finding]:
    """The checker's findings on a scenario's modes; none for laws that always work."""
    modes = scenario.control.named().modes
    return findings(modes) if modes else []


def show(
    scenario_path: Path,
    as_mermaid: bool,
    picture: Path | None,
    as_json: bool,
    user_code: bool = True,
    code_from_anywhere: bool = False,
) -> int:
    """Print or write the diagram, print the findings."""
    from torquer.control.modes.diagram import mermaid, svg

    scenario = load_scenario(scenario_path)
    check_code(scenario, scenario_path, user_code, code_from_anywhere)
    modes = scenario.control.named().modes
    if modes is None:
        raise ValueError("control.modes: must be given, or a scheme as control.law; received none")
    if picture is not None:
        _write(svg(modes), picture)
    found = mode_findings(scenario)
    if as_json:
        print(
            json_text({"mermaid": mermaid(modes), "findings": [f._asdict() for f in found]}, None)
        )
        return 0
    if as_mermaid:
        print(mermaid(modes), end="")
        _tell(found, "%% ")
        return 0
    print("\n".join(in_words(modes)))
    _tell(found)
    if picture is not None:
        print(os.fspath(picture))
    return 0


def _write(drawn: str, picture: Path) -> None:
    try:
        picture.write_text(drawn, encoding="utf-8")
    except OSError as error:
        raise ValueError(
            f"--svg: must be a file that can be written; received {picture} "
            f"({error.strerror or error})"
        ) from None


def _tell(found: list[Finding], mark: str = "") -> None:
    for finding in found:
        print(f"{mark}{'note' if finding.is_fault else 'modes'}: {finding.message}")


def in_words(modes: Modes) -> list[str]:
    """Regions, states and transitions, line by line."""
    lines = []
    for name, region in modes.regions.items():
        lines += [f"region {name}"] if name != MAIN else []
        lines += [_way(way, "any state ") for way in region.transitions]
        for key, state in region.states.items():
            does = ", ".join(state_in_words(state)) or "nothing"
            begin = " (initial)" if key == region.initial else ""
            lines.append(f"{key}{begin}: {does}")
            lines += [_way(way, "  ") for way in state.transitions]
    return lines


def _way(way, leaves: str) -> str:
    return f"{leaves}-> {way.to}: {transition_in_words(way)}"
