"""Functions that the source describes: the table of what the flight software has of each."""

from __future__ import annotations

import tomllib
from typing import NamedTuple

from flight_requirements import ROOT, requirements

FILE = ROOT / "torquer/flight/software/functions.toml"


class Function(NamedTuple):
    """A function: what it is, where the source describes it, requirements, what is missing."""

    what: str
    source: str
    requirements: tuple[str, ...]
    missing: str
    group: str

    @property
    def state(self) -> str:
        """Whether it is there: yes, partial, no."""
        if not self.requirements:
            return "no"
        return "partial" if self.missing else "yes"


def functions() -> list[Function]:
    """All functions, in the order of the file."""
    groups = tomllib.loads(FILE.read_text(encoding="utf-8"))
    return [
        Function(
            each["what"],
            each["source"],
            tuple(each["requirements"]),
            each.get("missing", ""),
            group["title"],
        )
        for group in groups.values()
        for each in group["functions"]
    ]


def functions_page() -> str:
    """Functions of the source with their requirements and state."""
    found = functions()
    states = [each.state for each in found]
    counts = ", ".join(f"{states.count(state)} {state}" for state in ("yes", "partial", "no"))
    lines = [
        "# Functions of the flight software in the source",
        "",
        "Made by `docs/generate.py` from `torquer/flight/software/functions.toml`.",
        "What 3.3, 3.4 and App. A of [SDOT](sources.md) say that the software of Chibis-M does,",
        "and what of it is here:",
        f"{len(found)} functions, {counts}. [Requirements](requirements.md) have the tests.",
    ]
    texts = {each.number: each.text for each in requirements()}
    group = ""
    for each in found:
        if each.group != group:
            group = each.group
            lines += ["", f"## {group}", "", "| function | SDOT | here | by |", "|---|---|---|---|"]
        shown = "<br>".join(f"{number}: {texts[number]}" for number in each.requirements)
        state = f"{each.state}: {each.missing}" if each.missing else each.state
        lines.append(f"| {each.what} | {each.source} | {state} | {shown or '-'} |")
    return "\n".join([*lines, ""])
