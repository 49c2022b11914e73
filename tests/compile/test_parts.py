"""Kernels compiled as parts of others: no machine code of their own, bits and errors as whole."""

import pickle
import subprocess
import sys
from collections import namedtuple

import llvmlite.binding as llvm
import numba
import pytest

from torquer.compile import engine
from torquer.compile.numba_private import Part
from torquer.compile.views import Address

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="nothing is compiled")

KERNELS = """
from torquer.compile.engine import inlined, kernel

@inlined
def third(x):
    return x / 3.0

@kernel
def checked(x):
    if x < 0.0:
        raise ValueError("negative", x)
    return third(x)

@kernel
def whole(x):
    return checked(x) + checked(2.0 * x)
"""
USE = """
print(whole(0.1).hex(), sum(whole.stats.cache_hits.values()))
try:
    whole(-1.0)
except ValueError as error:
    print(error.args)
"""


def libraries(of) -> list:
    """Compiled code of a function."""
    return [each.library for each in of.overloads.values()]


def test_what_only_kernels_call_has_no_machine_code():
    made: dict = {"__name__": "kernels_of_a_test"}
    exec(KERNELS, made)
    assert made["whole"](0.3) == 0.3 / 3.0 + 0.6 / 3.0
    (part,) = libraries(made["checked"].for_kernels)
    assert isinstance(part, Part) and part.serialize_using_object_code()[1] == "bitcode"
    assert not libraries(made["checked"])
    (whole,) = libraries(made["whole"])
    assert not isinstance(whole, Part)
    assert made["checked"](0.3) == 0.3 / 3.0  # the form that Python calls


def test_code_compiled_or_cached_matches_bits_and_errors_of_python(tmp_path, monkeypatch):
    (tmp_path / "kernels.py").write_text(KERNELS + USE)
    monkeypatch.setenv("TORQUER_CACHE_DIR", str(tmp_path / "cache"))
    expected = (0.1 / 3.0 + 0.2 / 3.0).hex()
    for hits in (0, 1):
        done = subprocess.run(
            [sys.executable, "kernels.py"], cwd=tmp_path, capture_output=True, text=True
        )
        assert done.stdout.splitlines() == [f"{expected} {hits}", "('negative', -1.0)"], done.stderr


def test_the_disk_keeps_no_code_for_linking_of_what_python_calls(tmp_path, monkeypatch):
    """It is nine tenths of a large kernel's files, and no other code takes it in."""
    monkeypatch.setenv("TORQUER_CACHE_DIR", str(tmp_path / "cache"))
    (tmp_path / "kernels.py").write_text(KERNELS + USE)
    subprocess.run([sys.executable, "kernels.py"], cwd=tmp_path, check=True, capture_output=True)
    (kept,) = tmp_path.rglob("*kernels.whole-*.1.nbc")
    _, (names, (library, *_)) = pickle.loads(kept.read_bytes())
    _, kind, (machine_code, for_linking) = library
    assert kind == "object" and machine_code
    assert any("whole" in name for name in names)
    assert not list(llvm.parse_bitcode(for_linking).functions)


def test_symbols_are_short_however_long_a_record_is():
    """Each type's name stands in the symbols of all that is compiled for it."""
    Long = namedtuple("Long", [f"number_{k}" for k in range(100)])
    numbers = Long(*map(float, range(100)))
    one, other = (Address(numba.typeof(each)) for each in (numbers, Long(1, *numbers[1:])))
    assert len(one.name) < 50 and one == Address(numba.typeof(numbers))
    assert one != other and one.name.startswith("Address(")


def test_another_whole_is_made_of_parts_on_the_disk(tmp_path, monkeypatch):
    monkeypatch.setenv("TORQUER_CACHE_DIR", str(tmp_path / "cache"))
    second = "\n@kernel\ndef another(x):\n    return checked(x) - 1.0\n"
    (tmp_path / "kernels.py").write_text(KERNELS + second)
    expected = ["whole", (0.1 / 3.0 + 0.2 / 3.0).hex(), "another", (0.1 / 3.0 - 1.0).hex()]
    for name, bits in zip(expected[::2], expected[1::2], strict=True):
        call = f"import kernels; print(kernels.{name}(0.1).hex(), " \
               "sum(kernels.checked.for_kernels.stats.cache_hits.values()))"  # fmt: skip
        done = subprocess.run(
            [sys.executable, "-c", call], cwd=tmp_path, capture_output=True, text=True
        )
        assert done.stdout.split() == [bits, str(int(name == "another"))], done.stderr
