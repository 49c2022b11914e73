"""Build the wheel `torquer-kernels`: compiled kernels for this platform and version of Python.

    python packaging/kernels_wheel.py [--out dist] [SCENARIO ...]

Installed next to `torquer`, its code is read instead of being compiled; it is for these sources of
`torquer` and no others, and asks for the versions of Numba and llvmlite that compiled it. Without
SCENARIO it holds what the first hour needs: the scenario of `torquer init`, as a run, as a campaign
and in `design detumble`.
"""

import argparse
import subprocess
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path

from torquer.base.version import VERSION

START = Path(__file__).parents[1] / "torquer" / "scenario" / "start.toml"
#: What makes of the scenario of `torquer init` a campaign of fixed steps, which fly side by side.
CAMPAIGN = """step_s = 1.0

[campaign]
runs = 16
vary = { initial.attitude = "uniform" }
outcomes = { settling_s = { signal = "rate_deg_s", what = { settles_below = 0.5 } } }
"""
PYPROJECT = f"""
[build-system]
requires = ["setuptools>=77"]
build-backend = "setuptools.build_meta"

[project]
name = "torquer-kernels"
description = "Compiled kernels of torquer, so that nothing is compiled on first use"
license = "MIT"
version = "{VERSION}"
dependencies = [
  "torquer=={VERSION}", "numba=={version("numba")}", "llvmlite=={version("llvmlite")}",
]

[tool.setuptools]
packages = ["torquer_kernels"]
package-data = {{ torquer_kernels = ["kernels.json", "**/*.nbi", "**/*.nbc"] }}
"""
#: Code that only the compiling of other kernels needs: three quarters of all, and no run reads it.
FOR_OTHERS = "*.for_kernels.*"
#: Compiled code is for one platform and version of Python, though there is no extension module.
SETUP = """
from setuptools import Distribution, setup

class Compiled(Distribution):
    def has_ext_modules(self):
        return True

setup(distclass=Compiled)
"""


def first_hour(folder: Path) -> list[Path]:
    """Scenarios that need what a new user's need, written into a folder."""
    text = START.read_text(encoding="utf-8")
    made = {"run.toml": text, "campaign.toml": f"{text}\n{CAMPAIGN}"}
    for name, content in made.items():
        (folder / name).write_text(content, encoding="utf-8")
    return [folder / name for name in made]


def main() -> None:
    """Compile into the folder of a package and make a wheel of it."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("scenarios", nargs="*", type=Path)
    parser.add_argument("--out", type=Path, default=Path("dist"))
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="torquer-kernels-") as name:
        folder = Path(name)
        package = folder / "torquer_kernels"
        build = [sys.executable, "-m", "torquer", "kernels", "build", "--out", str(package)]
        scenarios = given.scenarios or first_hour(folder)
        subprocess.run([*build, *map(str, scenarios)], check=True)
        for file in package.rglob(FOR_OTHERS):
            file.unlink()
        (package / "__init__.py").write_text('"""Compiled kernels of torquer."""\n')
        (folder / "pyproject.toml").write_text(PYPROJECT)
        (folder / "setup.py").write_text(SETUP)
        wheel = [sys.executable, "-m", "pip", "wheel", "--no-deps", "--no-build-isolation"]
        subprocess.run([*wheel, "--wheel-dir", str(given.out), str(folder)], check=True)


if __name__ == "__main__":
    main()
