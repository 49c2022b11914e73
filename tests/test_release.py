"""Release: the script that checks it, the sdist, the recipe, the wheel of kernels."""

import importlib.util
import os
import subprocess
import sys
import tarfile
from pathlib import Path

import numpy as np
import pytest

import torquer
from torquer.compile import engine

ROOT = Path(__file__).parents[1]
EXAMPLE = ROOT / "examples/chibis_m_detumble.toml"


def loaded(name):
    """A script of `packaging/`."""
    spec = importlib.util.spec_from_file_location(name, ROOT / f"packaging/{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


release, newcomer, floors = loaded("release"), loaded("newcomer"), loaded("floors")


def outcome(check, folder):
    """Why a check fails, "" if it does not."""
    return dict(release.results((check,), folder))[check.__doc__]


def test_citation_and_recipe_are_of_this_version(tmp_path):
    assert outcome(release.citation, tmp_path) == ""
    assert outcome(release.recipe, tmp_path) == ""


def test_a_recipe_without_a_dependency_fails(tmp_path, monkeypatch):
    monkeypatch.setitem(release.PROJECT, "dependencies", ["numpy>=2.0", "other>=1"])
    assert outcome(release.recipe, tmp_path) == "missing: other>=1"


def test_the_lowest_versions_are_pinned_with_those_of_extras():
    project = {
        "name": "torquer",
        "dependencies": ["numpy>=2.0", "numba>=0.63,<0.69"],
        "optional-dependencies": {
            "fly": ["dask[distributed]>=2024.8", "torquer[read]"],
            "read": ["pyarrow>=17"],
            "old": ["numpy", "scipy>=1"],
        },
    }
    own = ["numpy==2.0", "numba==0.63"]
    assert list(floors.floors(project, [])) == own
    expected = [*own, "dask[distributed]==2024.8", "pyarrow==17"]
    assert list(floors.floors(project, ["fly"])) == expected
    with pytest.raises(ValueError, match="numpy: must have a lowest version"):
        list(floors.floors(project, ["old"]))


def test_every_extra_that_needs_no_gpu_has_lowest_versions():
    extras = set(release.PROJECT["optional-dependencies"]) - {"cuda"}
    assert all("==" in pin for pin in floors.floors(release.PROJECT, sorted(extras)))


def test_placeholders_for_addresses_fail(tmp_path, monkeypatch):
    monkeypatch.setitem(release.PROJECT, "urls", {"Homepage": "https://torquer.invalid/"})
    assert "placeholders: Homepage" in outcome(release.addresses, tmp_path)
    monkeypatch.setitem(release.PROJECT, "urls", {"Homepage": "https://example.org"})
    assert outcome(release.addresses, tmp_path) == ""


def test_a_changelog_without_a_date_fails(tmp_path, monkeypatch):
    monkeypatch.setattr(release, "ROOT", tmp_path)
    page = tmp_path / "CHANGELOG.md"
    page.write_text(f"# Changelog\n\n## {release.VERSION} - unreleased\n")
    assert outcome(release.changelog, tmp_path) == "no such heading"
    page.write_text(f"# Changelog\n\n## {release.VERSION} - 2026-12-01\n")
    assert outcome(release.changelog, tmp_path) == ""


def test_a_failing_command_is_one_line(tmp_path):
    with pytest.raises(RuntimeError, match="ZeroDivisionError: division by zero"):
        release.run(sys.executable, "-c", "1/0", cwd=tmp_path)


def test_the_newcomers_numbers_are_in_the_scenario_of_init():
    text = (ROOT / "torquer/scenario/start.toml").read_text(encoding="utf-8")
    scenario = torquer.scenario_from_text(newcomer.with_own_numbers(text))
    assert scenario.spacecraft.coils.limit_a_m2 == 0.6
    assert (scenario.orbit.altitude_km, scenario.orbit.inclination_deg) == (480, 51.6)
    assert scenario.initial.rate_deg_s == (4, -6, 3)
    assert np.array_equal(scenario.spacecraft.body.inertia_kg_m2, np.diag([0.21, 0.19, 0.11]))


def test_a_step_of_the_newcomer_that_fails_is_a_line(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["newcomer.py", "torquer.whl"])
    failing = (sys.executable, "-c", "raise SystemExit(3)")
    monkeypatch.setattr(newcomer, "walked", lambda path, wheel: path.step("step", *failing))
    assert newcomer.main() == 1
    assert capsys.readouterr().err.startswith("fails: ")


@pytest.mark.slow
def test_tests_of_the_unpacked_sdist_pass(tmp_path):
    """Those that need files which an installed package lacks: pages, examples, gallery."""
    assert outcome(release.sdist, tmp_path) == ""
    (archive,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(archive) as packed:
        packed.extractall(tmp_path / "unpacked", filter="data")
    (source,) = (tmp_path / "unpacked").iterdir()
    tests = ["test_russian.py", "test_equations.py", "test_data_rights.py", "test_layers.py"]
    command = [
        sys.executable,
        "-m",
        "pytest",
        *(f"tests/{name}" for name in tests),
        "tests/maths/geometry",
    ]
    environment = os.environ | {"PYTHONPATH": str(source)}
    ended = subprocess.run(command, cwd=source, env=environment, capture_output=True, text=True)
    assert ended.returncode == 0, ended.stdout


@pytest.mark.slow
@pytest.mark.skipif(not engine.COMPILED, reason="nothing is compiled")
def test_the_wheel_of_kernels_is_found_and_nothing_is_compiled(tmp_path):
    make = [sys.executable, str(ROOT / "packaging/kernels_wheel.py"), "--out", str(tmp_path)]
    subprocess.run([*make, str(EXAMPLE)], check=True, cwd=ROOT, capture_output=True)
    (wheel,) = tmp_path.glob("torquer_kernels-*.whl")
    assert not wheel.name.endswith("none-any.whl")
    installed, cache = tmp_path / "installed", tmp_path / "cache"
    install = [sys.executable, "-m", "pip", "install", "--no-deps", "--target", str(installed)]
    subprocess.run([*install, str(wheel)], check=True, capture_output=True)
    places = os.pathsep.join([str(installed), str(ROOT)])
    environment = os.environ | {"PYTHONPATH": places, "TORQUER_CACHE_DIR": str(cache)}
    environment.pop("TORQUER_KERNELS", None)
    run = [sys.executable, "-m", "torquer", "run", str(EXAMPLE), "--out", str(tmp_path / "out")]
    ended = subprocess.run(run, env=environment, check=True, capture_output=True, text=True)
    assert ended.stderr == ""
    assert not [path for path in cache.rglob("*") if path.is_file()]
