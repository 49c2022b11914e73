"""The first path of a newcomer, each step with its time: from a wheel to gains of an own satellite.

    python packaging/newcomer.py WHEEL [WHEEL_OF_KERNELS] [--at-most SECONDS]

In a temporary folder: a bare environment, `pip install WHEEL ...`, a scenario with the numbers of
another satellite, `validate`, `design detumble`, and `run` with the gain that it chose. Without the
wheel of kernels nothing is compiled before. Exit code 1 if a step fails or all of it takes longer
than SECONDS (600).
"""

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

#: What the newcomer changes in the scenario of `torquer init`: a 12U CubeSat on another orbit.
OWN = {
    "inertia_kg_m2": "[0.21, 0.19, 0.11]",
    "limit_a_m2": "0.6",
    "altitude_km": "480",
    "inclination_deg": "51.6",
    "rate_deg_s": "[4, -6, 3]",
}


class Newcomer:
    """Steps and the seconds that each took."""

    def __init__(self, folder: Path):
        self.folder, self.took_s = folder, {}
        self._environment = {
            name: value for name, value in os.environ.items() if not name.startswith("TORQUER_")
        } | {"TORQUER_CACHE_DIR": str(folder / "cache"), "PYTHONPATH": ""}

    def step(self, name: str, *command: object) -> str:
        """Run a step's command, print its time; what it prints."""
        begun_s = time.monotonic()
        ended = subprocess.run(
            [*map(str, command)],
            cwd=self.folder,
            env=self._environment,
            check=True,
            stdout=subprocess.PIPE,
            text=True,
        )
        self.took_s[name] = time.monotonic() - begun_s
        print(f"{self.took_s[name]:7.1f} s  {name}", flush=True)
        return ended.stdout

    def torquer(self, *words: str) -> str:
        """Run a command of torquer as a step; what it prints."""
        return self.step(f"torquer {' '.join(words)}", self.python, "-m", "torquer", *words)

    @property
    def python(self) -> Path:
        """The interpreter of the bare environment."""
        places = (self.folder / "bare/bin/python", self.folder / "bare/Scripts/python.exe")
        return next(place for place in places if place.exists())


def with_own_numbers(text: str) -> str:
    """The scenario of `torquer init` with the newcomer's numbers."""
    for key, value in OWN.items():
        text, count = re.subn(rf"^{key} = (\[.*?\]|\S+)", f"{key} = {value}", text, flags=re.M)
        assert count == 1, key
    return text


def walked(newcomer: Newcomer, *wheels: Path) -> float:
    """Walk the path; the gain."""
    newcomer.step("python -m venv bare", sys.executable, "-m", "venv", "bare")
    newcomer.step("pip install torquer", newcomer.python, "-m", "pip", "install", "-q", *wheels)
    newcomer.torquer("init", "my_satellite")
    scenario = newcomer.folder / "my_satellite.toml"
    scenario.write_text(with_own_numbers(scenario.read_text("utf-8")), "utf-8")
    newcomer.torquer("validate", scenario.name)
    found = newcomer.torquer("design", "detumble", scenario.name, "--out", "gains", "--json")
    newcomer.torquer("run", "gains/scenario.toml")
    assert [*newcomer.folder.glob("runs/*/report.html")]
    return json.loads(found)["gain_a_m2_s_per_t"]


def main() -> int:
    """Print a line for each step, the gain, and the sum."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("wheels", type=Path, nargs="+", metavar="wheel")
    parser.add_argument("--at-most", type=float, default=600.0)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="torquer-newcomer-") as name:
        newcomer = Newcomer(Path(name))
        try:
            gain = walked(newcomer, *(wheel.resolve() for wheel in given.wheels))
        except subprocess.CalledProcessError as error:
            print(f"fails: {' '.join(error.cmd)}", file=sys.stderr)
            return 1
    total_s = sum(newcomer.took_s.values())
    print(f"{total_s:7.1f} s  gain {gain:.3g} A m^2 s/T")
    return 0 if total_s <= given.at_most else 1


if __name__ == "__main__":
    sys.exit(main())
