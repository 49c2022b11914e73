"""Kernels as plain Python, for commands that call them only a few times: no compiler is loaded.

Loading the compiler's registries takes longer than all that `validate` computes. A user's law is
different: the check is whether it compiles.
"""

import os
import sys
import tomllib
from pathlib import Path

from torquer.base.text_files import has_deep_key, limited_text

#: Whether this process does without the compiler that a run would use.
instead_of_compiler = False


def without_compiler(scenario: Path) -> None:
    """Use plain-Python kernels in this process if that is enough to check the scenario.

    Nothing changes if the package is already loaded, a law is in a file, or an orbit is
    integrated. Errors in the file are reported later.
    """
    global instead_of_compiler
    if "torquer.compile.engine" not in sys.modules and _needs_no_compiler(scenario):
        instead_of_compiler = os.environ.get("NUMBA_DISABLE_JIT", "0") == "0"
        os.environ["NUMBA_DISABLE_JIT"] = "1"


def _needs_no_compiler(path: Path) -> bool:
    try:
        text = limited_text(path)
        if has_deep_key(text):
            return False
        data = tomllib.loads(text)
        control, orbit = data.get("control", {}), data.get("orbit", {})
        laws = [control.get("law"), *control.get("laws", {}).values()]
        own = any("file" in law for law in laws if isinstance(law, dict))
        return not own and orbit.get("kind") != "numerical" and "campaign" not in data
    except (OSError, ValueError, AttributeError, TypeError, RecursionError):
        return False
