"""Non-volatile memory: damage is noticed, the reserve serves, nothing raises, nothing is half."""

import builtins
import copy
import errno
import os
import random
import shutil
import subprocess
import sys
from collections.abc import MutableMapping

import pytest
from hypothesis import given, strategies as st

from torquer.flight.packets.reasons import Reason
from torquer.flight.software.memory import Memory, unseal

DATA = bytes(range(40))


@pytest.fixture(params=["dicts", "folders"])
def memory(request, tmp_path):
    """A memory of each kind."""
    return Memory(tmp_path / "memory" if request.param == "folders" else None)


def reports(memory):
    """Reasons and names since the last look."""
    return [(report.code, report.name) for report in memory.take_reports()]


def bits_flipped(content):
    """The content with each bit flipped in turn."""
    for bit in range(8 * len(content)):
        damaged = bytearray(content)
        damaged[bit // 8] ^= 1 << bit % 8
        yield bytes(damaged)


def test_what_is_written_is_read_also_by_the_next_boot(memory, tmp_path):
    assert memory.read("clock") is None
    assert reports(memory) == [(Reason.FILE_MISSING, "clock")]
    contents = {"clock": b"", "settings.svr": DATA, "log": bytes(100_000)}
    for name, data in contents.items():
        assert memory.write(name, b"old")
        assert memory.write(name, data)
    again = Memory(tmp_path / "memory") if (tmp_path / "memory").exists() else memory
    assert again.names() == sorted(contents)
    assert {name: again.read(name) for name in contents} == contents
    assert reports(again) == []


@given(st.dictionaries(st.sampled_from("abc"), st.binary(max_size=50)), st.binary(max_size=50))
def test_a_snapshot_brings_everything_back(contents, other):
    memory = Memory()
    for name, data in contents.items():
        memory.write(name, data)
    memory.read("missing")
    kept = memory.snapshot()
    first = copy.deepcopy(memory)
    memory.write("a", other)
    memory.write("z", other)
    memory.take_reports()
    memory.restore(kept)
    assert memory.snapshot() == kept == first.snapshot()
    assert memory.names() == sorted(contents)
    assert memory.write("a", DATA) and memory.read("a") == DATA


def test_a_snapshot_of_dicts_fits_into_folders(tmp_path):
    one, other = Memory(), Memory(tmp_path)
    one.write("a", DATA)
    one.places["main"]["a"] = b"damaged"
    other.write("b", DATA)
    other.restore(one.snapshot())
    assert other.snapshot() == one.snapshot()
    assert Memory(tmp_path).read("a") == DATA


@pytest.mark.verifies("REQ-MEM-002")
def test_every_flipped_bit_and_every_cut_is_noticed():
    memory = Memory()
    memory.write("settings", DATA)
    content = memory.places["main"]["settings"]
    cuts = [content[:size] for size in range(len(content))]
    longer = [content + b"\0", content + DATA, DATA + content]
    for damaged in (*bits_flipped(content), *cuts, *longer):
        assert unseal("settings", damaged) is None
        memory.places["main"]["settings"] = damaged
        assert memory.read("settings") == DATA
        assert reports(memory) == [(Reason.RESERVE_USED, "settings")]
    assert unseal("clock", content) is None, "a file under another name"


def test_two_damaged_copies_are_reported_and_give_none(memory):
    at_random = random.Random(1)
    memory.write("settings", DATA)
    content = memory.places["main"]["settings"]
    damaged = at_random.sample(list(bits_flipped(content)), 30)
    damaged += [content[:size] for size in range(len(content))]
    for main, reserve in zip(damaged, reversed(damaged), strict=True):
        memory.places["main"]["settings"], memory.places["reserve"]["settings"] = main, reserve
        assert memory.read("settings") is None
        assert reports(memory) == [(Reason.FILE_DAMAGED, "settings")]
    assert memory.counts[Reason.FILE_DAMAGED] == len(damaged)
    assert memory.write("settings", b"new") and memory.read("settings") == b"new"


@given(st.binary(max_size=200), st.binary(max_size=200))
def test_files_of_noise_are_never_taken_for_data(main, reserve):
    memory = Memory()
    memory.places["main"]["x"], memory.places["reserve"]["x"] = main, reserve
    assert memory.read("x") is None
    assert reports(memory) == [(Reason.FILE_DAMAGED, "x")]


@pytest.mark.verifies("REQ-MEM-002")
@pytest.mark.parametrize("lost", ["main", "reserve"])
def test_a_lost_copy_is_made_again(memory, lost):
    memory.write("a", DATA)
    memory.write("b", DATA)
    del memory.places[lost]["a"]
    assert memory.read("a") == DATA
    memory.take_reports()
    memory.mend()
    expected = [(Reason.FILE_REPAIRED, "a")]
    assert reports(memory) == [(Reason.RESERVE_USED, "a")] * (lost == "main") + expected
    memory.mend()
    assert reports(memory) == []
    assert memory.places["main"]["a"] == memory.places["reserve"]["a"]
    assert memory.read("a") == DATA and reports(memory) == []


def test_of_two_whole_copies_the_one_written_last_counts(memory):
    """Power failed between the copies, in either order of events that leaves them different."""
    memory.write("counter", b"1")
    old = memory.places["main"]["counter"]
    memory.write("counter", b"2")
    new = memory.places["main"]["counter"]
    memory.places["reserve"]["counter"] = old
    assert memory.read("counter") == b"2" and reports(memory) == []
    memory.places["main"]["counter"], memory.places["reserve"]["counter"] = old, new
    assert memory.read("counter") == b"2"
    assert reports(memory) == [(Reason.RESERVE_USED, "counter")]
    memory.mend()
    memory.places["reserve"].clear()
    assert memory.read("counter") == b"2"


def test_the_number_of_a_writing_begins_again_after_u32(memory):
    memory.write("a", b"1")
    memory._writings["a"] = 2**32 - 2
    for data in (b"2", b"3", b"4"):
        assert memory.write("a", data) and memory.read("a") == data
    assert reports(memory) == []


@pytest.mark.parametrize("name", ["", ".a", "../a", "a/b", "A", "a b", "a\n", "ü", "a" * 65])
def test_a_name_that_is_no_file_name_is_a_mistake(memory, name):
    with pytest.raises(ValueError, match=r"^memory: a name must be of at most 64 of a-z"):
        memory.write(name, DATA)
    with pytest.raises(ValueError, match=r"^memory: a name must be of at most 64 of a-z"):
        memory.read(name)
    assert memory.names() == []


class Refusing:
    """Below a folder one call of the system fails; `None`: no call does."""

    def __init__(self, monkeypatch):
        self.call, self.folder, self.why = None, "", errno.ENOSPC
        for module, name in ((builtins, "open"), (os, "fsync"), (os, "replace")):
            monkeypatch.setattr(module, name, self._refusing(name, getattr(module, name)))

    def _refusing(self, name, call):
        def refusing(file, *given, **how):
            path = os.readlink(f"/proc/self/fd/{file}") if isinstance(file, int) else str(file)
            if name == self.call and f"/{self.folder}/" in path:
                raise OSError(self.why, os.strerror(self.why), path)
            return call(file, *given, **how)

        return refusing


@pytest.mark.verifies("REQ-MEM-003")
@pytest.mark.skipif(not os.path.exists("/proc/self/fd"), reason="needs the names of open files")
@pytest.mark.parametrize("why", [errno.ENOSPC, errno.EROFS, errno.EACCES, errno.EIO])
@pytest.mark.parametrize("call", ["open", "fsync", "replace"])
@pytest.mark.parametrize("folder", ["main", "reserve", "memory"])
def test_a_disk_that_refuses_is_reported_and_keeps_the_old(
    monkeypatch, tmp_path, folder, call, why
):
    memory, disk = Memory(tmp_path / "memory"), Refusing(monkeypatch)
    memory.write("a", b"old")
    disk.call, disk.folder, disk.why = call, folder, why
    places = ["main", "reserve"] if folder == "memory" else [folder]
    assert memory.write("a", b"new") is (folder != "memory")
    assert reports(memory) == [(Reason.FILE_NOT_WRITTEN, f"{place}/a") for place in places]
    disk.call = None
    expected = b"old" if folder == "memory" else b"new"
    assert Memory(tmp_path / "memory").read("a") == expected
    for place in ("main", "reserve"):
        assert os.listdir(tmp_path / "memory" / place) == ["a"]
    memory.write("a", b"newer")
    assert Memory(tmp_path / "memory").read("a") == b"newer"


@pytest.mark.verifies("REQ-MEM-003", "REQ-LNK-005")
@pytest.mark.parametrize("refusing", [(), ("main",), ("reserve",), ("main", "reserve")])
def test_what_advances_never_goes_back(memory, refusing):
    """Whichever file systems refuse the new content, and whichever copy is lost afterwards."""
    memory.write("counter", b"old")
    working = dict(memory.places)

    class Refuses(MutableMapping):
        """A file system that takes nothing more, but lets go."""

        def __init__(self, files):
            self.files = files

        def __setitem__(self, name, content):
            raise OSError(errno.ENOSPC, "full")

        def __getitem__(self, name):
            return self.files[name]

        def __delitem__(self, name):
            del self.files[name]

        def __iter__(self):
            return iter(self.files)

        def __len__(self):
            return len(self.files)

    memory.places.update({place: Refuses(working[place]) for place in refusing})
    assert memory.advance("counter", b"new") == (len(refusing) < 2)
    memory.places.update(working)
    if len(refusing) == 2:
        assert memory.read("counter") == b"old"
        memory.remove("counter")
        assert memory.names() == []
        return
    assert memory.read("counter") == b"new"
    for place in memory.places:
        kept = memory.places[place].pop("counter", None)
        assert memory.read("counter") in (b"new", None)
        if kept is not None:
            memory.places[place]["counter"] = kept


def test_a_disk_that_cannot_be_read_is_damaged(monkeypatch, tmp_path):
    memory, disk = Memory(tmp_path / "memory"), Refusing(monkeypatch)
    memory.write("a", DATA)
    (tmp_path / "memory" / "main" / "a").unlink()
    (tmp_path / "memory" / "main" / "a").mkdir()
    assert memory.read("a") == DATA
    assert reports(memory) == [(Reason.RESERVE_USED, "a")]
    shutil.rmtree(tmp_path / "memory" / "main")
    (tmp_path / "memory" / "main").write_text("a file where the folder was")
    again = Memory(tmp_path / "memory")
    assert again.read("a") == DATA and again.names() == ["a"]
    assert again.write("a", b"new") and again.read("a") == b"new"
    codes = [code for code, _ in reports(again)]
    assert codes[:2] == [Reason.FILE_NOT_WRITTEN, Reason.RESERVE_USED]
    assert disk.call is None


def test_a_memory_without_any_disk_does_not_raise(tmp_path):
    (tmp_path / "file").write_text("")
    memory = Memory(tmp_path / "file")
    assert memory.read("a") is None and memory.write("a", DATA) is False and memory.names() == []
    memory.mend()
    assert memory.counts[Reason.FILE_NOT_WRITTEN] == 4


def test_link_in_place_of_the_unfinished_file_is_not_followed(tmp_path):
    memory = Memory(tmp_path / "memory")
    (tmp_path / "others").write_text("theirs")
    (tmp_path / "memory" / "main" / ".a.part").symlink_to(tmp_path / "others")
    assert memory.write("a", DATA)
    assert (tmp_path / "others").read_text() == "theirs"
    assert memory.names() == ["a"]


#: In a name space of its own, with a disk of 64 kB: a file that fits, one that does not.
FILLED = """
mount -t tmpfs -o size=64k tmpfs "$DISK"
exec "$PYTHON" - <<'END'
import os
from torquer.flight.software.memory import Memory
memory = Memory(os.environ["DISK"])
print(memory.write("a", b"old" * 100), memory.write("a", bytes(100_000)))
print(Memory(os.environ["DISK"]).read("a") == b"old" * 100)
print([report.name for report in memory.take_reports()], memory.write("a", b"new"))
END
"""


def can_mount():
    """Whether this system lets a test have a disk of its own."""
    if shutil.which("unshare") is None:
        return False
    tried = ["unshare", "-rm", "mount", "-t", "tmpfs", "tmpfs", "/mnt"]
    return subprocess.run(tried, capture_output=True).returncode == 0


@pytest.mark.skipif(not can_mount(), reason="needs the right to mount a disk")
def test_a_disk_that_is_full_keeps_the_old(tmp_path):
    where = os.environ | {"DISK": str(tmp_path), "PYTHON": sys.executable}
    ran = ["unshare", "-rm", "sh", "-c", FILLED]
    done = subprocess.run(ran, env=where, capture_output=True, text=True, timeout=60)
    assert done.stdout.splitlines() == ["True False", "True", "['main/a', 'reserve/a'] True"], done
