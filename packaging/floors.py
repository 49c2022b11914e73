"""Print the lowest versions that pyproject.toml allows, as `name==version` for pip.

    python packaging/floors.py [EXTRA...]

`make test-floors` installs them. Exit code 1 if a requirement has no lowest version.
"""

import re
import sys
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path

PROJECT = Path(__file__).parents[1] / "pyproject.toml"
_REQUIREMENT = re.compile(r"(?P<name>[\w.-]+)(?P<extras>\[[\w,-]+\])?([>=]=(?P<floor>[\w.]+))?")


def floors(project: dict, extras: Iterable[str]) -> Iterator[str]:
    """Pins of a project's dependencies and those of its extras; ValueError without a floor."""
    optional = project["optional-dependencies"]
    required = [*project["dependencies"], *(line for extra in extras for line in optional[extra])]
    for line in required:
        found = _REQUIREMENT.match(line)
        if found["name"] == project["name"]:
            yield from floors({**project, "dependencies": []}, found["extras"][1:-1].split(","))
        elif found["floor"] is None:
            raise ValueError(f"{line}: must have a lowest version, as in name>=1.0")
        else:
            yield f"{found['name']}{found['extras'] or ''}=={found['floor']}"


if __name__ == "__main__":
    project = tomllib.loads(PROJECT.read_text("utf-8"))["project"]
    try:
        print("\n".join(floors(project, sys.argv[1:])))
    except ValueError as error:
        sys.exit(f"error: {error}")
