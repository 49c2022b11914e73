"""Kernels as plain Python for commands that call them a few times only: nothing is loaded for them.

Loading the compiler's registries takes longer than `validate` computes. What a user's law needs is
another thing: whether it compiles is what is to be checked.
"""

import os
import sys
import tomllib
from pathlib import Path


def without_compiler(scenario: Path) -> None:
    """Let kernels be plain Python in this process, if that is enough for the scenario's check.

    Nothing is changed where the package is already loaded, a law is in a file, or an orbit is
    integrated. What is wrong with the file is told later.
    """
    if "torquer.engine" not in sys.modules and _needs_no_compiler(scenario):
        os.environ["NUMBA_DISABLE_JIT"] = "1"


def _needs_no_compiler(path: Path) -> bool:
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8-sig"))
        control, orbit = data.get("control", {}), data.get("orbit", {})
        laws = [control.get("law"), *control.get("laws", {}).values()]
        own = any("file" in law for law in laws if isinstance(law, dict))
        return not own and orbit.get("kind") != "numerical" and "campaign" not in data
    except (OSError, ValueError, AttributeError, TypeError, RecursionError):
        return False
