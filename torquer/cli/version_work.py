"""Work of `version`: it imports none of the packages it names."""

import platform
from importlib.metadata import version as of

import torquer
from torquer.cli.output import json_text

_NAMES = ("numpy", "numba", "scipy", "xarray", "pydantic", "pyerfa", "sgp4")


def version(as_json: bool) -> int:
    """Print versions."""
    versions = {"torquer": torquer.__version__} | {name: of(name) for name in _NAMES}
    versions["python"] = platform.python_version()
    if as_json:
        print(json_text(versions))
    else:
        print("\n".join(f"{name} {number}" for name, number in versions.items()))
    return 0
