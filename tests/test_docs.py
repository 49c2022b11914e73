"""Generated pages are up to date, and the README's example runs as it stands there."""

import importlib.util
import inspect
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def _generator():
    spec = importlib.util.spec_from_file_location("generate", ROOT / "docs/generate.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("name", ["scenario.md", "equations.md", "api.md"])
def test_generated_page_is_up_to_date(name):
    made = _generator().PAGES[name]()
    assert (ROOT / "docs" / name).read_text(encoding="utf-8") == made, "run docs/generate.py"


@pytest.mark.parametrize(
    "package",
    [
        "torquer.earth.atmosphere",
        "torquer.environment",
        "torquer.environment.field",
        "torquer.theory",
        "torquer.wheel_array",
    ],
)
def test_every_public_name_is_there_and_has_its_line(package):
    generator, module = _generator(), importlib.import_module(package)
    for name in generator.public_names(package):
        assert generator.line_of(package, name), name
        assert not inspect.ismodule(getattr(module, name)), f"{name} is a module of {package}, too"
    assert set(module.__all__) <= set(dir(module))
    with pytest.raises(AttributeError, match=f"module '{package}' has no attribute 'nothing'"):
        _ = module.nothing


def test_public_parts_of_the_package_are_imported_when_they_are_used():
    code = (
        "import sys, torquer.control, torquer.theory, torquer.wheel_array, torquer.environment\n"
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


def test_readme_links_exist():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)#]+)\)", text):
        assert (ROOT / target).exists(), target
