"""Processes that need the same kernel at once: one compiles it, the others wait and find it."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from law_cases import compiled

import torquer
from torquer.compile import engine, turns
from torquer.computer.blocks.user import UserLaw

pytestmark = [
    pytest.mark.skipif(not engine.COMPILED, reason="nothing is compiled"),
    pytest.mark.skipif(turns.fcntl is None, reason="this system has no such locks"),
]
EXAMPLES = Path(__file__).parents[2] / "examples"
MODULE = """
import sys, time
from torquer.compile.engine import inlined, kernel

@inlined
def part(x):
    return x + 1.0

@kernel
def whole(x):
    return part(x) * 2.0

if sys.argv[1] == "slowly":
    from numba.core.registry import CPUDispatcher
    from torquer.compile.numba_private import Compiler
    usual = Compiler.compile_extra
    def slowly(self, function):
        print("compiling", flush=True)
        time.sleep(float(sys.argv[3]))
        return usual(self, function)
    Compiler.compile_extra = slowly
print(whole(eval(sys.argv[2])), sum(whole.stats.cache_misses.values()), flush=True)
"""


def begin(folder, how, value, pause_s=2.0):
    """A process that computes with the kernel."""
    (folder / "kernels_in_turns.py").write_text(MODULE)
    there = {
        **os.environ,
        "PYTHONPATH": f"{Path(torquer.__file__).parents[1]}{os.pathsep}{folder}",
        "TORQUER_CACHE_DIR": str(folder / "cache"),
    }
    script = "import kernels_in_turns"
    command = [sys.executable, "-c", script, how, value, str(pause_s)]
    return subprocess.Popen(command, env=there, stdout=subprocess.PIPE, text=True)


def ended(process):
    """What a process has printed, in words."""
    text, _ = process.communicate(timeout=120)
    assert process.returncode == 0
    return text.split()


def test_the_second_process_waits_for_the_first_and_compiles_nothing(tmp_path):
    first = begin(tmp_path, "slowly", "3.0")
    assert first.stdout.readline() == "compiling\n"
    second = begin(tmp_path, "at once", "3.0")
    assert ended(second) == ["8.0", "0"]
    assert ended(first)[-2:] == ["8.0", "1"]


def test_for_other_types_nobody_waits_and_both_are_kept(tmp_path):
    first = begin(tmp_path, "slowly", "3.0", 20.0)
    assert first.stdout.readline() == "compiling\n"
    assert ended(begin(tmp_path, "at once", "3")) == ["8.0", "1"]
    first.kill()
    first.wait()
    assert ended(begin(tmp_path, "at once", "3.0")) == ["8.0", "1"]
    for value in ("3", "3.0"):
        assert ended(begin(tmp_path, "at once", value)) == ["8.0", "0"]


def test_a_process_that_is_killed_leaves_its_turn_to_the_next(tmp_path):
    first = begin(tmp_path, "slowly", "3.0", 100.0)
    assert first.stdout.readline() == "compiling\n"
    second = begin(tmp_path, "at once", "3.0")
    time.sleep(1.0)
    assert second.poll() is None
    first.send_signal(signal.SIGKILL)
    assert ended(second) == ["8.0", "1"]
    first.wait()


def test_patience_ends(tmp_path, monkeypatch):
    """One that has been stopped keeps nobody waiting for ever."""
    monkeypatch.setattr(turns, "_PATIENCE_S", 0.2)
    holder = "import sys, time; from torquer.compile import turns; from pathlib import Path\n"
    holder += f"print(turns.take(Path({str(tmp_path)!r}), 'a'), flush=True); time.sleep(100)"
    there = {**os.environ, "PYTHONPATH": str(Path(torquer.__file__).parents[1])}
    command = [sys.executable, "-c", holder]
    with subprocess.Popen(command, env=there, stdout=subprocess.PIPE, text=True) as other:
        try:
            assert other.stdout.readline().strip().isdigit()
            assert turns.take(tmp_path, "a") is None
            mine = turns.take(tmp_path, "b")
            assert mine is not None
            turns.give_back(tmp_path, mine)
        finally:
            other.kill()
    assert turns.take(tmp_path, "a") is not None


def test_without_locks_nobody_waits(tmp_path, monkeypatch):
    monkeypatch.setattr(turns, "fcntl", None)
    assert turns.take(tmp_path, "a") is None
    turns.give_back(tmp_path, None)


def test_in_a_folder_that_cannot_be_written_nobody_waits(tmp_path):
    begun_s = time.monotonic()
    assert turns.take(tmp_path / "missing", "a") is None
    assert time.monotonic() - begun_s < 1.0


def test_turns_end_with_whatever_was_compiled(tmp_path):
    """Also of a user's law, and of one that cannot be compiled: others would wait for it."""
    from torquer.compile import numba_private

    head = "import torquer\n@torquer.law()\ndef own(inputs, parameters, memory):\n    return "
    for body, fails in (("(1.0, 2.0, 3.0)", False), ("(1.0, missing, 3.0)", True)):
        file = tmp_path / f"{'fails' if fails else 'works'}.py"
        file.write_text(head + body)
        with pytest.raises(ValueError, match="missing") if fails else contextlib.nullcontext():
            compiled(UserLaw(kind="user", file=file).law())
        assert numba_private._turns == []
    torquer.simulate(torquer.load_scenario(EXAMPLES / "my_law.toml"), until_s=5.0)
    assert numba_private._turns == []
