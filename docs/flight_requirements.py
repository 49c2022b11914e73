"""Requirements of the flight software, and the tests that verify each."""

from __future__ import annotations

import ast
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
FILE = ROOT / "torquer/flight/software/requirements.toml"


class Requirement(NamedTuple):
    """A requirement: its number, what must hold, the title of its group."""

    number: str
    text: str
    group: str


def requirements() -> list[Requirement]:
    """All requirements, in the order of the file."""
    groups = tomllib.loads(FILE.read_text(encoding="utf-8"))
    return [
        Requirement(number, text, group["title"])
        for group in groups.values()
        for number, text in group.items()
        if number != "title"
    ]


def verifications(folder: Path) -> Iterator[tuple[str, str, str]]:
    """(requirement, file, test) of each `@pytest.mark.verifies` in a folder of tests."""
    for file in sorted(folder.rglob("test_*.py")):
        text = file.read_text(encoding="utf-8")
        if "mark.verifies" not in text:
            continue
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.FunctionDef):
                for number in _verified_by(node):
                    yield number, file.relative_to(folder.parent).as_posix(), node.name


def _verified_by(test: ast.FunctionDef) -> Iterator[str]:
    """The requirements that a test names."""
    for call in test.decorator_list:
        if isinstance(call, ast.Call) and ast.unparse(call.func) == "pytest.mark.verifies":
            yield from (str(ast.literal_eval(argument)) for argument in call.args)


def requirements_page() -> str:
    """Requirements of the flight software with the tests that verify them."""
    lines = [
        "# Requirements of the flight software",
        "",
        "Made by `docs/generate.py` from `torquer/flight/software/requirements.toml`",
        "and the tests, which",
        'name what they verify: `@pytest.mark.verifies("REQ-SVR-003")`.',
    ]
    tests: dict[str, list[str]] = {}
    for number, file, test in verifications(ROOT / "tests"):
        tests.setdefault(number, []).append(f"[`{test}`](../{file})")
    group = ""
    for each in requirements():
        if each.group != group:
            group = each.group
            lines += [
                "",
                f"## {group}",
                "",
                "| number | requirement | verified by |",
                "|---|---|---|",
            ]
        shown = "<br>".join(tests.get(each.number, ["nothing"]))
        lines.append(f"| {each.number} | {each.text} | {shown} |")
    return "\n".join([*lines, ""])
