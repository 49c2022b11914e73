"""Build the wheel `torquer-kernels`: compiled kernels for this platform and version of Python.

    python packaging/kernels_wheel.py [--out dist] [SCENARIO ...]

Installed next to `torquer`, its code is read instead of being compiled; it is for these sources of
`torquer` and no others. Without SCENARIO it holds what the main example needs.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

from torquer.base.version import VERSION

MAIN = Path(__file__).parents[1] / "examples" / "chibis_m_detumble.toml"
PYPROJECT = f"""
[build-system]
requires = ["setuptools>=77"]
build-backend = "setuptools.build_meta"

[project]
name = "torquer-kernels"
description = "Compiled kernels of torquer, so that nothing is compiled on first use"
license = "MIT"
version = "{VERSION}"
dependencies = ["torquer=={VERSION}"]

[tool.setuptools]
packages = ["torquer_kernels"]
package-data = {{ torquer_kernels = ["kernels.json", "**/*.nbi", "**/*.nbc"] }}
"""
#: Compiled code is for one platform and version of Python, though there is no extension module.
SETUP = """
from setuptools import Distribution, setup

class Compiled(Distribution):
    def has_ext_modules(self):
        return True

setup(distclass=Compiled)
"""


def main() -> None:
    """Compile into the folder of a package and make a wheel of it."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("scenarios", nargs="*", type=Path, default=[MAIN])
    parser.add_argument("--out", type=Path, default=Path("dist"))
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="torquer-kernels-") as name:
        folder = Path(name)
        package = folder / "torquer_kernels"
        build = [sys.executable, "-m", "torquer", "kernels", "build", "--out", str(package)]
        subprocess.run([*build, *map(str, given.scenarios)], check=True)
        (package / "__init__.py").write_text('"""Compiled kernels of torquer."""\n')
        (folder / "pyproject.toml").write_text(PYPROJECT)
        (folder / "setup.py").write_text(SETUP)
        wheel = [sys.executable, "-m", "pip", "wheel", "--no-deps", "--no-build-isolation"]
        subprocess.run([*wheel, "--wheel-dir", str(given.out), str(folder)], check=True)


if __name__ == "__main__":
    main()
