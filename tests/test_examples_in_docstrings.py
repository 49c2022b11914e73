"""Every public name has an example in its docstring, and every example runs as it is printed.

An example goes on from that of the package, whose `scenario` and `result` it may use, in a folder
with the files that the package's docstring names.
"""

import ast
import doctest
import importlib
import inspect
import re
import shutil
from pathlib import Path

import pytest

import torquer

EXAMPLES = Path(__file__).parents[1] / "examples"
#: Examples that compile or compute for long.
SLOW = {"export_c", "smooth_run"}
#: Methods that are much used: each is called in the examples of its class.
METHODS = {
    "Comparison": ("rows", "plot", "as_plain"),
    "Flight": ("read", "command", "snapshot", "restore", "resume", "result"),
    "Law": ("with_parameters",),
    "Scenario": ("replace",),
}
CAMPAIGN = """
[campaign]
runs = 4
seed = 1

[campaign.vary]
initial.attitude = "uniform"

[campaign.outcomes]
final_rate_deg_s = { signal = "rate_deg_s", what = { at_end = true } }
"""
_PARSER = doctest.DocTestParser()


def modules():
    """The module that each public name is imported from."""
    tree = ast.parse(inspect.getsource(torquer))
    imports = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    return {each.asname: node.module for node in imports for each in node.names if each.asname}


NAMES = sorted(set(torquer.__all__) - {"__version__"})


def docstring_of(name):
    """The docstring with the example of a public name; of data that of their module."""
    value = getattr(torquer, name)
    if not callable(value):
        value = importlib.import_module(modules()[name])
    return inspect.getdoc(value) or ""


def examples_of(name, docstring):
    return _PARSER.get_doctest(docstring, {}, name, name, 0)


@pytest.fixture(scope="module")
def begun():
    """What the example of the package has made, and whether it went as printed."""
    example, namespace = examples_of("torquer", torquer.__doc__), {}
    example.globs = namespace
    ran = doctest.DocTestRunner().run(example, clear_globs=False)
    assert ran.failed == 0 and ran.attempted >= 4
    return namespace


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The present folder, with the files that examples read."""
    plain = re.sub(r"^\s*\.\.\. ", "", torquer.__doc__, flags=re.M)
    text = re.search(r"text\('''\n(.*?)\n'''", plain, re.S)[1]
    (tmp_path / "satellite.toml").write_text(text + "\n", encoding="utf-8")
    (tmp_path / "releases.toml").write_text(text + "\n" + CAMPAIGN, encoding="utf-8")
    shutil.copy(EXAMPLES / "which_sensors.toml", tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("name", NAMES)
def test_every_public_name_has_an_example(name):
    sources = "".join(each.source for each in examples_of(name, docstring_of(name)).examples)
    assert re.search(rf"\b(torquer\.|@torquer\.){name}\b", sources) or name in _MADE_BY_OTHERS
    for method in METHODS.get(name, ()):
        assert f".{method}(" in sources, method


#: Classes whose objects come from a function: their examples call that.
_MADE_BY_OTHERS = {"Comparison", "Inputs", "Law", "Scenario"}


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] * (name in SLOW)) for name in NAMES]
)
def test_the_example_runs_as_it_is_printed(name, begun, folder):
    example = examples_of(name, docstring_of(name))
    example.globs = dict(begun)
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    ran = doctest.DocTestRunner(optionflags=flags).run(example)
    assert ran.attempted > 0 and ran.failed == 0
