"""Generated pages are up to date; claims of README and tutorials hold.

`test_tutorials.py` executes the blocks of all pages.
"""

import ast
import contextlib
import functools
import importlib.util
import inspect
import io
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import torquer
from torquer.cli.app import app
from torquer.compile import engine

needs_jit = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
ROOT = Path(__file__).parents[1]


@functools.cache
def _generator():
    spec = importlib.util.spec_from_file_location("generate", ROOT / "docs/generate.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def _generated() -> list[str]:
    """Names of the pages that are generated, without loading what generates them."""
    text = (ROOT / "docs/generate.py").read_text(encoding="utf-8")
    return sorted(re.findall(r'^    "([\w/.-]+\.md)": \w+_page,$', text, re.MULTILINE))


def test_all_generated_pages_are_known():
    assert _generated() == sorted(_generator().PAGES)


def test_pages_are_generated_with_nothing_but_the_package_installed(tmp_path):
    alone = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    command = [sys.executable, str(ROOT / "docs/generate.py"), "no-such.md"]
    run = subprocess.run(command, env=alone, cwd=tmp_path, capture_output=True, text=True)
    assert run.returncode == 1 and run.stdout == ""
    assert run.stderr.startswith("PAGE: must be one of telemetry-mapping.md, commands.md, ")
    assert run.stderr.endswith("; received no-such.md\n")


@pytest.mark.parametrize("name", _generated())
def test_generated_page_is_up_to_date(name):
    made = _generator().PAGES[name]()
    assert (ROOT / "docs" / name).read_text(encoding="utf-8") == made, "run docs/generate.py"


def test_the_page_of_peers_leaves_out_what_was_never_measured():
    slow = json.loads((ROOT / "benchmarks/results.json").read_text(encoding="utf-8"))["slow"]
    assert f"(measured on {slow['basilisk_measured_on']})" in " ".join(_generator()._basilisk(slow))
    assert _generator()._basilisk({}) == []


def test_every_page_that_cites_a_source_links_to_the_sources():
    cited = re.compile(r"\b(MAG|SDOT|WHEEL|MGS|FIELD(?=[ -]\(?\d))\b")
    files = [path for path in (ROOT / "docs").rglob("*.md") if "made" not in path.parts]
    pages = {path: path.read_text(encoding="utf-8") for path in files}
    citing = [path for path, text in pages.items() if cited.search(text)]
    assert len(citing) > 12
    for path in citing:
        depth = len(path.relative_to(ROOT / "docs").parts) - 1
        linked = f"({'../' * depth}sources.md" in pages[path]
        assert linked or path.name == "sources.md", path


#: Packages that import their public names when they are first used, and those that list them.
PACKAGES = {
    ".".join(path.relative_to(ROOT).parts[:-1])
    for path in ROOT.glob("torquer/**/__init__.py")
    if "__all__" in path.read_text(encoding="utf-8")
}


def test_page_of_public_names_has_every_package_that_lists_them():
    assert set(_generator().PACKAGES) == PACKAGES


@pytest.mark.parametrize("package", sorted(PACKAGES))
def test_every_public_name_is_there_and_has_its_line(package):
    generator, module = _generator(), importlib.import_module(package)
    for name in generator.public_names(package):
        assert generator.line_of(package, name), name
        assert not inspect.ismodule(getattr(module, name)), f"{name} is a module of {package}, too"
    assert set(module.__all__) - {"__version__"} <= set(dir(module))
    with pytest.raises(AttributeError, match=f"module '{package}' has no attribute 'nothing'"):
        _ = module.nothing


def test_public_parts_of_the_package_are_imported_on_use():
    code = (
        "import sys, torquer.computer.laws, torquer.theory, torquer.spacecraft.wheel_array\n"
        "import torquer.environment\n"
        "late = ('torquer.theory.', 'scipy.optimize')\n"
        "print(*(name for name in sys.modules if name.startswith(late)))"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout.strip() == ""


def test_readme_example_runs(tmp_path, monkeypatch):
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    code = re.search(r"```python\n(.*?)```", text, re.S)[1]
    assert len([line for line in code.splitlines() if line.strip()]) <= 16
    monkeypatch.chdir(tmp_path)
    names = {}
    exec(code, names)
    assert names["result"].attrs["ended"] == "complete"
    assert (tmp_path / "runs/quickstart/report.html").stat().st_size > 1e5


def test_flight_tutorial_runs_and_its_claims_hold():
    """The software outside, the board at the socket and the law on board fly the same bits."""
    text = (ROOT / "docs/tutorials/flight.md").read_text(encoding="utf-8")
    names = {}
    for block in re.findall(r"```python\n(.*?)```", text, re.S):
        exec(block, names)
    law = {"kind": "bdot", "gain_a_m2_s_per_t": 2e4}
    scenario = names["scenario"].replace("control.law", law)
    on_board = names["torquer"].simulate(scenario).omega_body.values
    assert (names["result"].omega_body.values == on_board).all()
    assert (names["over_the_link"].omega_body.values == on_board).all()
    speeds = np.degrees(np.linalg.norm(on_board[[0, -1]], axis=1))
    assert [f"{speed:.2g}" for speed in speeds] == ["9.9", "0.46"]
    assert [f"{rate:.3f}" for rate in names["rates"].values()] == ["0.120", "0.103", "0.096"]


@needs_jit
def test_notebook_tutorial_runs_and_its_claims_hold(tmp_path, monkeypatch):
    text = (ROOT / "docs/tutorials/notebook.md").read_text(encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    names: dict = {}
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        for block in re.findall(r"```python\n(.*?)```", text, re.S):
            exec(block, names)
    assert printed.getvalue().splitlines()[0] in text
    assert (tmp_path / "rate.png").stat().st_size > 10_000
    assert names["again"].torquer.scenario == names["weak"].torquer.scenario
    for method in re.findall(r"`(\w+)\([a-z]*\)`", text):
        assert hasattr(names["result"].torquer, method), method


#: Where names of the package are written down; what they name must be there.
TEXTS = (
    "*.md",
    "docs/**/*.md",
    "design/*.md",
    "examples/**/*.py",
    "examples/**/*.toml",
    "gallery/**/*.py",
    "torquer/**/*.py",
)


@functools.cache
def _exists(name: str) -> bool:
    """Whether a dotted name is a module, or something in one."""
    first, *others = name.split(".")
    found, place = importlib.import_module(first), first
    for part in others:
        place = f"{place}.{part}"
        with contextlib.suppress(ImportError):
            found = importlib.import_module(place)
            continue
        fields = (*getattr(found, "model_fields", ()), *getattr(found, "__annotations__", ()))
        if part in fields:
            return True
        if not hasattr(found, part):
            return False
        found = getattr(found, part)
    return True


def test_names_of_the_package_in_texts_exist():
    named = re.compile(r"(?<![\w./\"@-])torquer(?:\.[A-Za-z_]\w*)+")
    paths = {path for each in TEXTS for path in ROOT.glob(each) if path.is_file()}
    texts = {path: path.read_text(encoding="utf-8") for path in paths}
    found = {name: path for path, text in texts.items() for name in named.findall(text)}
    assert len(found) > 500
    assert {name: path for name, path in found.items() if not _exists(name)} == {}


def test_blocks_of_all_pages_import_names_that_exist():
    pages = [*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")]
    asked = {}
    for page in pages:
        for block in re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.S):
            for each in ast.walk(ast.parse(block)):
                if isinstance(each, ast.ImportFrom) and each.module.startswith("torquer"):
                    asked |= {f"{each.module}.{name.name}": page for name in each.names}
    assert len(asked) > 30
    assert {name: page for name, page in asked.items() if not _exists(name)} == {}


def test_page_of_commands_names_options_that_exist():
    page = (ROOT / "docs/commands.md").read_text(encoding="utf-8")
    sections = re.findall(r"^##+ torquer ([^\n]*)\n(.*?)(?=^##+ |\Z)", page, re.S | re.M)
    assert len(sections) > 40
    for words, section in sections:
        named = re.findall(r"^\* `(.*?)`", section, re.M)
        options = {each for text in named for each in re.findall(r"--[a-z][a-z0-9-]*", text)}
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            app([*words.split(), "--help"], result_action="return_value")
        assert options <= set(re.findall(r"--[a-z][a-z0-9-]*", printed.getvalue())), words


def test_readme_links_exist():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)#]+)\)", text):
        assert (ROOT / target).exists(), target


# ------------------------------------------------------------------ the tutorial on modes

MODES_PAGE = (ROOT / "docs/tutorials/modes.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(\w*)\n(.*?)^```", MODES_PAGE, re.S | re.M)


def shown(path, **options):
    """What `torquer modes` prints."""
    from torquer.cli.commands.modes import ModesOptions, modes

    with contextlib.redirect_stdout(io.StringIO()) as printed:
        modes(path, how=ModesOptions(**options))
    return printed.getvalue()


@pytest.fixture(scope="module")
def satellites(tmp_path_factory):
    """The tutorial's scenario, as it is and with each of the two ways back that follow it."""
    whole, *ways = [text for kind, text in BLOCKS if kind == "toml"][:3]
    paths = [tmp_path_factory.mktemp("tutorial") / f"{k}.toml" for k in range(len(ways) + 1)]
    for path, way in zip(paths, ["", *ways], strict=True):
        path.write_text(whole + way)
    return paths


def test_the_tutorial_prints_what_the_checker_says(satellites):
    outputs = [text for kind, text in BLOCKS if kind == ""]
    first, chatter, bounded, spinner, pointing = outputs
    assert shown(satellites[0]) == first
    for path, line in zip(satellites[1:], (chatter, bounded), strict=True):
        assert shown(path).endswith(f"\n{line}")
    assert shown(ROOT / "examples/spinner_modes.toml") == spinner
    assert pointing in shown(ROOT / "examples/sun_pointing.toml")


@pytest.mark.parametrize(
    ("page", "example"), [("modes.md", "sun_pointing.toml"), ("safe-mode.md", "safe_mode.toml")]
)
def test_the_tutorials_show_the_diagrams_of_their_examples(page, example):
    text = (ROOT / "docs/tutorials" / page).read_text(encoding="utf-8")
    (drawn,) = re.findall(r"^```mermaid\n(.*?)^```", text, re.S | re.M)
    printed = shown(ROOT / "examples" / example, mermaid=True)
    assert printed.startswith(drawn)
    assert all(line.startswith("%% ") for line in printed.removeprefix(drawn).splitlines())


def test_the_tutorial_names_every_guard():
    from torquer.scenario.load import presets

    assert [name for name in presets("region") if f"`{name}`" not in MODES_PAGE] == []


def test_the_tutorial_names_every_signal():
    from torquer.computer.modes.signals import SIGNALS

    assert [name for name in SIGNALS if f"`{name}`" not in MODES_PAGE] == []


@needs_jit
def test_the_tutorials_satellite_chatters_until_it_has_two_thresholds(satellites):
    counts = []
    for path in satellites[1:]:
        result = torquer.simulate(torquer.load_scenario(path))
        counts.append(int(result["mode_entries"].sel(mode="main.detumbling")))
    assert counts[0] > 100 and counts[1] == 1
    assert f"enters `detumbling` {counts[0]} times" in MODES_PAGE


@needs_jit
def test_the_tutorials_spinner_takes_the_times_that_it_says():
    result = torquer.simulate(torquer.load_scenario(ROOT / "examples/spinner_modes.toml"))
    entered = {str(name): float(t) for name, t in result["mode_entered"].to_series().items()}
    minutes = [round(entered[f"main.{state}"] / 60.0) for state in ("spin_up", "pointing")]
    assert minutes == [97, 117]
    axis = Rotation.from_quat(result["q_body_to_inertial"].values[-1]).as_matrix()[:, 2]
    off_deg = np.degrees(np.arccos(axis @ [1.0, 1.0, 0.0] / np.sqrt(2.0)))
    assert round(off_deg) == 5


@needs_jit
def test_the_tutorials_third_attempt_points_to_the_sun():
    result = torquer.simulate(torquer.load_scenario(ROOT / "examples/sun_pointing.toml"))
    t, wrong = result["time"].values, result["mode_capture"].values == 1
    began_min = t[1:][wrong[1:] & ~wrong[:-1]] / 60.0
    assert [int(minute) for minute in began_min] == [172, 292, 431]
    axes = Rotation.from_quat(result["q_body_to_inertial"].values).as_matrix()[:, :, 2]
    off_deg = np.degrees(np.arccos(np.sum(axes * result["sun_inertial"].values, axis=1)))
    assert off_deg[t < 431 * 60.0].max() > 170.0 and 8.0 < off_deg[t > 36000.0].max() < 9.0
