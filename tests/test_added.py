"""One of each X of 'to add X, touch these files' is really added, to a copy of the package.

It works, and no more files of the package are touched than ARCHITECTURE.md says. Files that
`docs/made_code.py` makes do not count.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest
from made_code import MADE
from test_additions import ROOT, table

PARTS = Path(__file__).parent / "additions"
SENSORS = "torquer/spacecraft/sensors"


class Addition(NamedTuple):
    """New files, by the file of `tests/additions` that each is; edits, by the file edited.

    An edit is (text that stands in the file once, what it becomes).
    """

    new: dict[str, str]
    edits: dict[str, list[tuple[str, str]]]


def after(place: str, text: str) -> tuple[str, str]:
    """An edit: text after a place."""
    return place, place + text


def before(place: str, text: str) -> tuple[str, str]:
    """An edit: text before a place."""
    return place, text + place


ADDITIONS = {
    "sensor": Addition(
        {
            f"{SENSORS}/limb_camera.py": "limb_camera.py",
            "torquer/computer/estimation/measurements/limb_camera.py": "limb_measurement.py",
        },
        {
            f"{SENSORS}/devices.py": [
                after("    integrating_gyro,\n", "    limb_camera,\n"),
                before(
                    f"from {SENSORS}.magnetometer import".replace("/", "."),
                    f"from {SENSORS}.limb_camera import LimbCamera\n".replace("/", "."),
                ),
                after("    fine_sun_sensor.DEVICE,\n", "    limb_camera.DEVICE,\n"),
                before(
                    "    magnetometers: dict[",
                    '    limb_camera: LimbCamera | None = None\n    """Limb camera."""\n'
                    "    limb_cameras: dict[str, LimbCamera] = Field(default_factory=dict)\n"
                    '    """Several limb cameras by name."""\n',
                ),
            ]
        },
    ),
    "law": Addition(
        {"torquer/computer/laws/even_damping.py": "even_damping.py"},
        {
            "torquer/computer/laws/built_in.py": [
                before(
                    "from torquer.computer.laws.magneto_gyro",
                    "from torquer.computer.laws.even_damping import EvenDamping\n",
                ),
                after("    Off\n", "    | EvenDamping\n"),
            ]
        },
    ),
    "disturbance torque": Addition(
        {"torquer/spacecraft/disturbance/soft_iron.py": "soft_iron.py"},
        {
            "torquer/spacecraft/disturbance/__init__.py": [
                before(
                    "from torquer.spacecraft.disturbance.solar_pressure",
                    "from torquer.spacecraft.disturbance.soft_iron import (\n"
                    "    NO_SOFT_IRON, SoftIron, soft_iron_torque,\n)\n",
                ),
                before(
                    '    "unmodelled": Torque(',
                    '    "soft_iron": Torque(SoftIron, soft_iron_torque, NO_SOFT_IRON),\n',
                ),
                before(
                    "    unmodelled: UnmodelledTorque",
                    '    soft_iron: SoftIron | None = None\n    """Soft iron; left out: none."""\n',
                ),
            ]
        },
    ),
    "telecommand": Addition(
        {},
        {
            "torquer/flight/packets/chibis_m.toml": [
                before(
                    "[up.set_rates]\n",
                    '[up.round_clock]\nid = 34\nmodule = "clk"\n'
                    'description = "Round the on-board time down"\n'
                    'fields = [{ name = "to_ms", type = "u32", unit = "ms", '
                    'description = "to multiples of it" }]\n\n',
                )
            ],
            "torquer/flight/software/modules/clk.py": [
                before(
                    "    def _set(self",
                    "    def on_round_clock(self, core, values) -> Reason:\n"
                    '        """Round the time down [ms]."""\n'
                    "        (to_ms,) = values\n"
                    "        if to_ms == 0:\n"
                    "            return Reason.VALUE\n"
                    "        return self._set(core, -(core.clock.now_ms % to_ms))\n\n",
                )
            ],
        },
    ),
    "report panel": Addition(
        {"torquer/report/flight/panels/turning_energy.py": "turning_energy.py"},
        {
            "torquer/report/flight/panels/__init__.py": [
                after(
                    "import torques\n",
                    "from torquer.report.flight.panels.turning_energy import turning_energy\n",
                ),
                after("        (rate, True),\n", "        (turning_energy, True),\n"),
            ]
        },
    ),
    "scenario key": Addition(
        {},
        {
            "torquer/environment/along_orbit.py": [
                before(
                    "    table_tolerance: Annotated",
                    '    field_factor: float = 1.0\n    """Factor of the field."""\n',
                ),
                (
                    "return b_inertial_along(",
                    "return self.environment.field_factor * b_inertial_along(",
                ),
            ]
        },
    ),
    "signal": Addition(
        {},
        {
            "torquer/computer/modes/signals.py": [
                before(
                    "@inlined\ndef nutation(",
                    "@inlined\ndef rate_across(table, state, k, index):\n"
                    '    """Rate across the axis."""\n'
                    "    inputs = read_inputs(k)\n"
                    "    return norm(cross(table.axis, inputs.estimate.omega_body_rad_s))\n\n\n",
                ),
                before(
                    '    "nutation_deg": Signal(\n',
                    '    "rate_across_deg_s": Signal(\n'
                    '        rate_across, "deg/s", ("axis",), estimated=_RATE\n    ),\n',
                ),
            ]
        },
    ),
    "command option": Addition(
        {},
        {
            "torquer/cli/commands/run.py": [
                before(
                    "    no_report: bool = False\n",
                    '    no_summary: bool = False\n    """Print no summary."""\n',
                ),
                ("    else:\n        from torquer.analysis.summary import summary_rows",
                 "    elif not how.no_summary:\n"
                 "        from torquer.analysis.summary import summary_rows"),
            ]
        },
    ),
}  # fmt: skip


@pytest.fixture
def copy(tmp_path):
    """A copy of the package, with what Python has read of it, and of what makes its made files."""
    for folder in ("torquer", "docs/templates"):
        shutil.copytree(ROOT / folder, tmp_path / folder)
    for file in ("docs/made_code.py", "pyproject.toml"):
        shutil.copy2(ROOT / file, tmp_path / file)
    return tmp_path


def add(addition: Addition, copy: Path) -> None:
    """Write the new files and edit the others."""
    for path, part in addition.new.items():
        assert not (copy / path).exists(), path
        shutil.copy2(PARTS / part, copy / path)
    for path, edits in addition.edits.items():
        text = (copy / path).read_text(encoding="utf-8")
        for place, becomes in edits:
            assert text.count(place) == 1, (path, place)
            text = text.replace(place, becomes)
        (copy / path).write_text(text, encoding="utf-8")


def run(copy: Path, *arguments: str) -> None:
    """Run Python with the copy, kernels as plain Python."""
    own = {"PYTHONPATH": str(copy), "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(
        [sys.executable, *arguments], cwd=copy, env=os.environ | own, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr


def changed_files(copy: Path) -> set[str]:
    """Files of the package that are new or differ, in the copy."""
    files = (path for path in (copy / "torquer").rglob("*") if path.is_file())
    named = {path.relative_to(copy).as_posix(): path for path in files}
    return {
        name
        for name, path in named.items()
        if "__pycache__" not in name
        and not ((ROOT / name).exists() and (ROOT / name).read_bytes() == path.read_bytes())
    }


def test_the_first_rows_of_the_table_are_those_added():
    assert {*[*table()][: len(ADDITIONS)]} == ADDITIONS.keys()


@pytest.mark.parametrize("name", ADDITIONS)
def test_what_is_added_works_and_touches_no_more_files(name, copy):
    add(ADDITIONS[name], copy)
    if name == "sensor":
        run(copy, "docs/made_code.py")
    run(copy, str(PARTS / "shown.py"), name.replace(" ", "_"))
    changed = changed_files(copy)
    assert changed & MADE.keys() == (MADE.keys() if name == "sensor" else set())
    assert len(changed - MADE.keys()) == table()[name][0], changed
