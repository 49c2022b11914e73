"""All conditions of formulas, as they stand beside them: `docs/theory/where-it-holds.md`."""

import importlib
import pkgutil
from collections.abc import Iterator
from types import ModuleType

from torquer import theory
from torquer.theory.validity import Limit


def conditions(*packages: ModuleType) -> list[Limit]:
    """Each limit of a package's modules that states its trial, once; by default of the theory."""
    found: dict[Limit, None] = {}
    for module in _modules(packages or (theory,)):
        for value in vars(module).values():
            if isinstance(value, Limit) and value.shown:
                found.setdefault(value)
    return sorted(found, key=lambda limit: limit.of)


def table(*packages: ModuleType) -> list[str]:
    """The conditions as lines of a Markdown table."""
    head = ["| of | quantity | holds where it | beyond | shown by |", "|---|---|---|---|---|"]
    return [*head, *(_line(limit) for limit in conditions(*packages))]


def _line(limit: Limit) -> str:
    beyond = f"{'refused' if limit.refuses else 'doubtful'}: {limit.why}"
    bound = limit.must.removeprefix("must ").replace("lie ", "lies ").replace("be ", "is ")
    return f"| {limit.of} | {limit.name} | {bound} | {beyond} | {limit.shown} |"


def _modules(packages) -> Iterator[ModuleType]:
    for package in packages:
        within = pkgutil.walk_packages(package.__path__, f"{package.__name__}.")
        yield from map(importlib.import_module, sorted(each.name for each in within))
