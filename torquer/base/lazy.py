"""Public names of a package, imported when first used: the package itself costs nothing.

A package lists them once, as imports under `if TYPE_CHECKING`, where editors and type checkers find
them, and then says

    __getattr__, __dir__, __all__ = lazily(__name__, __file__)
"""

import ast
import importlib
import sys
from collections.abc import Callable
from pathlib import Path


def homes_in(source: str) -> dict[str, str]:
    """Names that a source imports under `if TYPE_CHECKING`, and the modules they come from."""
    blocks = (node for node in ast.parse(source).body if isinstance(node, ast.If))
    imports = (
        statement
        for block in blocks
        if isinstance(block.test, ast.Name) and block.test.id == "TYPE_CHECKING"
        for statement in block.body
        if isinstance(statement, ast.ImportFrom)
    )
    return {alias.name: each.module or "" for each in imports for alias in each.names}


def lazily(package: str, file: str) -> tuple[Callable, Callable, list[str]]:
    """`__getattr__`, `__dir__` and `__all__` of a package whose names its file lists as above."""
    homes = homes_in(Path(file).read_text(encoding="utf-8"))

    def imported(name: str):
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value = getattr(importlib.import_module(homes[name]), name)
        setattr(sys.modules[package], name, value)
        return value

    return imported, lambda: sorted(homes), sorted(homes)
