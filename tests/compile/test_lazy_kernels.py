"""Kernels that Numba is given when they are first called."""

import copy
import os
import pickle
import subprocess
import sys
import threading
from pathlib import Path

import numba
import numpy as np
import pytest

import torquer
from torquer.base.noise import normal3
from torquer.compile import engine
from torquer.compile.engine import inlined, keep_off_disk, kernel, plugged, records
from torquer.compile.when_compiling import is_plain, plainly, when_compiling

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="nothing is compiled")


@inlined
def third(x):
    return x / 3.0


@plugged
def twice(function, x):
    return function(function(x))


@kernel
def wave(x, count=3):
    total = 0.0
    for k in range(1, count + 1):
        total += twice(third, x * k) * np.sin(x * k)
    return total


def eager(function):
    """Numba's own dispatcher of a kernel's function."""
    return numba.njit(error_model="numpy")(function.py_func)


def test_bits_are_those_of_numbas_own_dispatcher_and_of_python():
    for x in (0.1, -7.3, 1e-300, 1e300):
        bits = np.float64(wave(x)).tobytes()
        assert bits == np.float64(eager(wave)(x)).tobytes() == wave.py_func(x).tobytes()
    seeds = [(2**40 + 7, 3, 2**33 + k) for k in range(20)]
    assert [normal3(*each) for each in seeds] == [eager(normal3)(*each) for each in seeds]


def test_a_kernel_looks_like_its_function_and_like_a_dispatcher():
    assert (wave.__name__, wave.__module__) == ("wave", __name__)
    assert wave(0.1, count=2) == wave(0.1, 2) != wave(0.1)
    assert len(wave.signatures) >= 1 and wave.targetoptions["error_model"] == "numpy"
    with pytest.raises(AttributeError):
        _ = wave.nothing
    assert not hasattr(wave, "__array__")


def test_what_looks_at_a_kernel_does_not_load_the_compiler():
    @kernel
    def idle(x):
        return x

    assert idle.__name__ in repr(idle) and not hasattr(idle, "__get_pydantic_core_schema__")
    assert idle == copy.copy([idle])[0] and hash(idle)
    assert idle._dispatcher is None


def test_a_kernel_of_a_module_is_found_there_when_it_is_unpickled():
    assert pickle.loads(pickle.dumps(wave)) is wave
    assert copy.deepcopy({"law": wave})["law"] is wave


def test_one_of_a_function_is_unpickled_with_its_code():
    def local():
        @kernel
        def seven(x):
            return 7.0 * x

        return seven

    seven = local()
    assert pickle.loads(pickle.dumps(seven))(2.0) == 14.0 == seven(2.0)


def test_threads_that_call_a_kernel_first_share_one():
    for _ in range(5):

        @kernel
        def slow(x):
            return wave(x) + 1.0

        keep_off_disk(slow)
        begin, found, made = threading.Barrier(4), [], set()

        def call(slow=slow, begin=begin, found=found, made=made):
            begin.wait()
            found.append(slow(0.1))
            made.add(slow.dispatcher)

        threads = [threading.Thread(target=call) for _ in range(4)]
        for each in threads:
            each.start()
        for each in threads:
            each.join()
        assert found == [wave.py_func(0.1) + 1.0] * 4
        assert len(made) == 1 and len(slow.signatures) == 1


def test_plainly_it_runs_as_python_in_this_thread_alone():
    @kernel
    def idle(x):
        return third(x)

    elsewhere = []
    with pytest.raises(ZeroDivisionError), plainly():
        assert idle(3.0) == 1.0 and idle._dispatcher is None
        with plainly(False):
            assert wave(0.1) == wave.py_func(0.1)
        array = np.zeros(2, [("a", np.float64)])
        assert records(array).a.shape == (2,)
        thread = threading.Thread(target=lambda: elsewhere.append(is_plain.get()))
        thread.start()
        thread.join()
        idle(1 / 0)
    assert elsewhere == [False] and not hasattr(records(array), "a")
    assert idle(3.0) == 1.0 and idle._dispatcher is not None


def test_what_waits_for_numba_is_told_once_and_late_comers_at_once():
    told = []
    when_compiling(lambda: told.append(1))
    assert told == [1]
    wave(0.1)
    assert told == [1]


def words(script, **environment):
    """What a process prints, and its standard error."""
    there = {**os.environ, "PYTHONPATH": str(Path(torquer.__file__).parents[1]), **environment}
    command = [sys.executable, "-c", script]
    ended = subprocess.run(command, env=there, capture_output=True, text=True, timeout=300)
    assert ended.returncode == 0, ended.stderr
    return ended.stdout.split(), ended.stderr


MODULE = """
from torquer.base.noise import float_bits
from torquer.compile.engine import inlined, kernel

@inlined
def third(x):
    return x / 3.0

@kernel
def whole(x):
    return third(x) + float(float_bits(x) & 3)

def closed_over(function):
    @kernel
    def closed(x):
        return function(x)

    return closed
"""
USE = """
import sys
import lazy_kernels_of_a_test as kernels
print("numba" in sys.modules)
from torquer.compile.numba_private import event

class Count(event.Listener):
    seen = 0
    def on_start(self, each):
        Count.seen += 1
    def on_end(self, each):
        pass

event.register("numba:compile", Count())
print(kernels.whole(0.7).hex(), Count.seen)
print(kernels.closed_over(kernels.third)(0.3).hex())
"""


def test_a_second_process_compiles_nothing(tmp_path):
    (tmp_path / "lazy_kernels_of_a_test.py").write_text(MODULE)
    script = f"import sys; sys.path.insert(0, {str(tmp_path)!r})\n{USE}"
    cache = {"TORQUER_CACHE_DIR": str(tmp_path / "cache")}
    closed = (0.3 / 3.0).hex()
    whole = (0.7 / 3.0 + float(np.float64(0.7).view(np.uint64) & np.uint64(3))).hex()
    (first, _), (second, _) = words(script, **cache), words(script, **cache)
    assert int(first[2]) >= 2
    assert first[:2] + first[3:] == ["False", whole, closed]
    assert second == ["False", whole, "0", closed]
    names = {path.name.split("-")[0] for path in (tmp_path / "cache").rglob("*.nbi")}
    assert "lazy_kernels_of_a_test.whole" in names
    assert not any("closed" in name for name in names)


def test_code_of_sources_edited_meanwhile_is_not_kept(tmp_path):
    script = (
        "from torquer.compile import sources; sources._BEGAN_S = 0.0\n"
        "from torquer.compile.engine import kernel\n"
        "from torquer.maths.geometry.vec3 import dot\n"
        "print(dot((1.0, 2.0, 3.0), (1.0, 0.0, 0.0)), sum(dot.stats.cache_hits.values()))"
    )
    for _ in range(2):
        printed, said = words(script, TORQUER_CACHE_DIR=str(tmp_path))
        assert printed == ["1.0", "0"]
        assert said.count("CacheNote: compiled code is not kept: torquer's files have changed") == 1
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]


def test_numbas_own_setting_is_heeded():
    script = "from torquer.compile.engine import kernel; print(kernel(abs) is abs)"
    for value, plain in (("1", "True"), ("0", "False"), ("nonsense", "False")):
        assert words(script, NUMBA_DISABLE_JIT=value)[0] == [plain]
