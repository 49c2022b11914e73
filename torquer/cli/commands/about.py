"""`torquer version` and `torquer completion`: about the program itself."""

import platform
from importlib.metadata import version as version_of
from typing import Annotated, Literal

from cyclopts import Parameter

import torquer
from torquer.base.strict_json import json_text
from torquer.cli.options import Json
from torquer.cli.output import say


def version(*, json: Json = False) -> int:
    """Print the versions of torquer and its numerical dependencies."""
    names = ("numpy", "numba", "scipy", "xarray", "pydantic", "pyerfa", "sgp4")
    versions = {"torquer": torquer.__version__} | {name: version_of(name) for name in names}
    versions["python"] = platform.python_version()
    lines = "\n".join(f"{name} {number}" for name, number in versions.items())
    print(json_text(versions) if json else lines)
    return 0


def completion(
    shell: Literal["zsh", "bash", "fish", "powershell"] | None = None,
    /,
    *,
    install: Annotated[
        bool, Parameter(help="Install it for the shell instead of printing it.")
    ] = False,
) -> int:
    """Print the completion script for SHELL [the current one]: Tab completes commands, options."""
    from torquer.cli.app import app

    if install:
        say(f"{app.install_completion(shell=shell)}: start a new shell to use it")
    else:
        print(app.generate_completion(shell=shell))
    return 0
