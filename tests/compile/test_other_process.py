"""Compiling in another process: this one finds the code, or compiles what is not there."""

import importlib
import sys

import pytest

from torquer.compile import other_process
from torquer.compile.arguments import Arguments
from torquer.compile.code_cache import is_missing
from torquer.compile.engine import COMPILED

pytestmark = pytest.mark.skipif(not COMPILED, reason="without the compiler nothing is compiled")
SOURCE = """
from typing import NamedTuple

from torquer.compile.arguments import Entry, record_at


class FACTOR(NamedTuple):
    factor: int


def _times(address, number):
    return record_at(address).factor * number


times, Factor = Entry(_times, 1), FACTOR
"""


@pytest.fixture
def module(tmp_path, monkeypatch):
    """A module with an entry that nobody has compiled."""
    name = tmp_path.name  # another one in each test: types outlive modules, and go by names
    (tmp_path / f"{name}.py").write_text(SOURCE.replace("FACTOR", name))
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(other_process, "cores", lambda: 2)
    yield importlib.import_module(name)
    del sys.modules[name]


def test_an_entry_is_compiled_by_another_process_and_found_by_this_one(module):
    arguments = Arguments(module.Factor(7))
    signature = module.times._signature(arguments)
    assert is_missing(module.times.kernel, signature)
    module.times.begin(arguments.record)
    assert module.times._begun.wait() == 0
    assert not is_missing(module.times.kernel, signature)
    assert module.times(arguments, 6) == 42
    assert sum(module.times.kernel.stats.cache_hits.values()) == 1


def test_what_the_other_process_cannot_compile_is_compiled_here(module, monkeypatch):
    monkeypatch.setattr(other_process, "_CHILD", "raise SystemExit(3)")
    arguments = Arguments(module.Factor(7))
    module.times.begin(arguments.record)
    assert module.times(arguments, 6) == 42
    assert module.times._begun.returncode == 3
    assert sum(module.times.kernel.stats.cache_hits.values()) == 0


def test_one_core_compiles_by_itself_and_so_does_a_process_that_finds_the_code(module, monkeypatch):
    arguments = Arguments(module.Factor(7))
    monkeypatch.setattr(other_process, "cores", lambda: 1)
    module.times.begin(arguments.record)
    assert module.times._begun is None
    monkeypatch.setattr(other_process, "cores", lambda: 2)
    assert module.times(arguments, 6) == 42
    signature = module.times._signature(arguments)
    assert other_process.compile_in_other_process(module.times.kernel, signature) is None
