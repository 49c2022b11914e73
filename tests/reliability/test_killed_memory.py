"""A process killed while it writes its memory: files are old or new, never broken."""

import hashlib
import random
import subprocess
import sys
import time

import pytest

from torquer.flight.software.memory import Memory

#: Writes two files in turn; says the number of each writing when it is done.
WRITER = """
import hashlib, sys
from torquer.flight.software.memory import Memory
memory = Memory(sys.argv[1])
for number in range(10**9):
    body = b"%d:" % number + bytes([number % 256]) * (number * 997 % 20_000)
    if not memory.write("ab"[number % 2], body + hashlib.sha256(body).digest()):
        sys.exit("not written")
    print(number, flush=True)
"""


def number_in(data):
    """The number of the writing; AssertionError unless the content is whole."""
    assert hashlib.sha256(data[:-32]).digest() == data[-32:]
    return int(data.partition(b":")[0])


def kill_a_writer(folder, number):
    """Kill it at an instant that depends on the number, and look at what it left."""
    arguments = [sys.executable, "-c", WRITER, str(folder)]
    writer = subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    for _ in range(4):
        assert writer.stdout.readline(), writer.stderr.read()
    time.sleep(random.Random(number).uniform(0.0, 0.05))
    writer.kill()
    printed, error = writer.communicate(timeout=60.0)
    assert writer.returncode == -9, error
    done = int(printed.rpartition(b"\n")[0].rpartition(b"\n")[2] or 3)
    memory = Memory(folder)
    found = sorted(number_in(memory.read(name)) for name in "ab")
    # the last one said to be done, the one before; or one more, which was not said yet
    assert found in ([done - 1, done], [done, done + 1])
    assert memory.take_reports() == [], "of a file, main is whole and not behind"
    left = {file.name for place in ("main", "reserve") for file in (folder / place).iterdir()}
    assert {name for name in left if not name.startswith(".")} == {"a", "b", "index"}
    memory.mend()
    memory.take_reports()
    for place in ("main", "reserve"):
        alone = Memory()
        alone.places[place] = memory.places[place]
        assert sorted(number_in(alone.read(name)) for name in "ab") == found


@pytest.mark.verifies("REQ-MEM-001")
@pytest.mark.parametrize("number", range(5))
def test_a_memory_whose_writer_is_killed_is_old_or_new(tmp_path, number):
    kill_a_writer(tmp_path, number)


@pytest.mark.slow
@pytest.mark.parametrize("number", range(5, 55))
def test_memory_is_old_or_new_after_fifty_kills_while_writing(tmp_path, number):
    kill_a_writer(tmp_path, number)
