"""The archive: each frame once, what was not known, other dictionaries, killed writers, history."""

import math
import os
import random
import signal
import subprocess
import sys
from contextlib import closing

import pytest

from torquer.flight.packets.codec import decoder, encoder
from torquer.flight.packets.dictionary import Dictionary, Field, Packet, load_dictionary
from torquer.flight.packets.frames import Downlink, Stream
from torquer.ground.archive import (
    AUTHENTIC,
    EPOCH_MS,
    UNCHECKED,
    Archive,
    ArchiveError,
    OtherPacketsError,
    Row,
    RowMaker,
    dictionary_in,
    read_only,
)
from torquer.ground.history import latest

CHIBIS = load_dictionary("chibis_m")
EVENT = (3, 49, -7, 4.2e11 + 130.0)


def frames(*packets):
    """Frames of (name, time_s, values), as a stream finds them."""
    maker, stream = Downlink(CHIBIS), Stream(CHIBIS, "down")
    return list(stream.feed(b"".join(maker.frame(*packet) for packet in packets)))


def rows(*packets, received_ms=None, quality=AUTHENTIC):
    maker = RowMaker(CHIBIS)
    return [maker.row(frame, received_ms, quality) for frame in frames(*packets)]


@pytest.fixture
def archive(tmp_path):
    with closing(Archive(tmp_path / "sat.sqlite", CHIBIS)) as made:
        yield made


def content(archive, packet):
    return archive.read(f'SELECT * FROM "{packet}"')


def test_a_frame_is_there_once(archive):
    first = rows(("event", 100, EVENT), ("beacon", 100, (1, 2, 1, 7, 255, 3, 4)), received_ms=5)
    assert archive.put(first) == 2
    before = content(archive, "event")
    assert archive.put(rows(("event", 100, EVENT), received_ms=77)) == 0
    assert content(archive, "event") == before
    # another frame of the same time is another row
    assert archive.put(rows(("beacon", 100, (1, 2, 1, 7, 255, 3, 5)))) == 1
    assert len(content(archive, "beacon")) == 2


def test_time_comes_from_the_field_or_else_the_frame(archive):
    archive.put(rows(("event", 100, EVENT), ("beacon", 100, (1, 2, 1, 7, 255, 3, 4))))
    assert archive.read("SELECT _time_ms FROM event") == [(EPOCH_MS + 420000000130,)]
    assert archive.read("SELECT _time_ms FROM beacon") == [(EPOCH_MS + 100_000,)]


@pytest.mark.parametrize("time_ms", [math.nan, math.inf, -1.0, 1e300])
def test_non_time_field_is_not_taken_for_time(archive, time_ms):
    archive.put(rows(("event", 100, (3, 49, 0, time_ms))))
    assert archive.read("SELECT _time_ms FROM event") == [(EPOCH_MS + 100_000,)]


def test_what_was_not_known_is_empty_and_bytes_are_digits(archive):
    values = list(decoder(CHIBIS.down["extended"])(bytes(CHIBIS.down["extended"].size)))
    names = CHIBIS.down["extended"].names
    values[names.index("omega_y")] = math.nan
    values[names.index("sigma")] = math.nan
    values[names.index("b_x")] = 12345.0
    archive.put(rows(("extended", 1, values), ("dump", 2, (3, 0, 2, b"\x01\xab"))))
    assert archive.read("SELECT omega_x, omega_y, sigma, b_x FROM extended") == [
        (0.0, None, None, 12344.0)
    ]
    ((data,),) = archive.read("SELECT data FROM dump")
    assert data == "01ab" + "00" * 62


def test_the_archive_says_what_it_holds(archive):
    archive.put(rows(("event", 100, EVENT)))
    with closing(read_only(archive.path)) as db:
        assert dictionary_in(db) == CHIBIS


def other(**fields):
    """A dictionary with one packet `p` of these fields and types."""
    made = tuple(Field(name=n, type=t, description="d") for n, t in fields.items())
    packet = Packet(name="p", id=1, description="d", fields=made)
    return Dictionary(name="other", modules={"m": 1}, down={"p": packet})


def test_conflicting_packet_is_refused_and_additional_packets_are_accepted(tmp_path):
    path = tmp_path / "sat.sqlite"
    first = other(a="u8")
    Archive(path, first).close()
    with pytest.raises(ArchiveError, match=r"must hold the packets of this dictionary.* packet p$"):
        Archive(path, other(a="u16"))
    more = first.model_copy(update={"down": first.down | {"event": CHIBIS.down["event"]}})
    Archive(path, more).close()
    with closing(Archive(path, first)) as archive:  # the packet that is gone keeps its table
        assert archive.read("SELECT count(*) FROM event") == [(0,)]


def test_a_dictionary_without_a_packet_that_has_rows_is_refused(tmp_path):
    path = tmp_path / "sat.sqlite"
    with closing(Archive(path, CHIBIS)) as archive:
        archive.put(rows(("event", 100, EVENT)))
    with pytest.raises(OtherPacketsError, match=r"received .* with rows of event, which it lacks$"):
        Archive(path, other(a="u8"))
    with closing(read_only(path)) as db:  # nothing has changed
        assert dictionary_in(db) == CHIBIS
        assert not db.execute("SELECT 1 FROM sqlite_master WHERE name = 'p'").fetchall()


@pytest.mark.parametrize("content", [b"", b"no database at all, but long enough" * 100])
def test_a_file_that_is_no_archive_gets_one_line(tmp_path, content):
    path = tmp_path / "x.sqlite"
    path.write_bytes(content)
    with pytest.raises(ArchiveError, match="archive: must be an archive; received") as refused:
        read_only(path)
    assert "\n" not in str(refused.value)


def test_dictionary_names_cannot_collide_with_archive_names(tmp_path):
    fields = dict.fromkeys(("time_ms", "digest", "quality", "status", "select", "order"), "u8")
    own = other(**fields)
    commands = own.down["p"].model_copy(update={"name": "commands", "id": 2})
    own = own.model_copy(update={"down": own.down | {"commands": commands}})
    with closing(Archive(tmp_path / "sat.sqlite", own)) as archive:
        made = Downlink(own).frame("commands", 9, (1, 2, 3, 4, 5, 6))
        (frame,) = Stream(own, "down").feed(made)
        archive.put([RowMaker(own).row(frame, None, UNCHECKED)])
        assert archive.read('SELECT time_ms, "order" FROM commands') == [(1, 6)]


def test_counters_stay(tmp_path):
    path = tmp_path / "sat.sqlite"
    with closing(Archive(path, CHIBIS)) as archive:
        archive.put([], {"down": 17})
        archive.put([], {"down": 18, "up": 2})
    with closing(Archive(path, CHIBIS)) as archive:
        assert content(archive, "_counters") == [("down", 18), ("up", 2)]


_WRITER = """
import sys
from torquer.ground.archive import Archive, RowMaker
from torquer.flight.packets.dictionary import load_dictionary
from torquer.flight.packets.frames import Downlink, Stream
known = load_dictionary("chibis_m")
archive, maker, made = Archive(sys.argv[1], known), RowMaker(known), Downlink(known)
stream = Stream(known, "down")
n = 0
while True:
    data = b"".join(made.frame("event", n + k, (1, 32, n + k, 1e3 * (n + k))) for k in range(20))
    archive.put(maker.row(frame, None, 2) for frame in stream.feed(data))
    n += 20
    print(n, flush=True)
"""


@pytest.mark.skipif(os.name == "nt", reason="no SIGKILL")
def test_a_killed_writer_loses_at_most_the_open_transaction(tmp_path):
    path = tmp_path / "sat.sqlite"
    for _ in range(3):
        path.unlink(missing_ok=True)
        with subprocess.Popen(
            [sys.executable, "-c", _WRITER, str(path)], stdout=subprocess.PIPE, text=True
        ) as writer:
            for _ in range(random.randrange(5, 60)):
                last = int(writer.stdout.readline())
            writer.send_signal(signal.SIGKILL)
            rest = writer.stdout.read().split()
        last = int(rest[-1]) if rest else last
        with closing(Archive(path, CHIBIS)) as archive:
            found = [number for (number,) in archive.read("SELECT argument FROM event")]
            assert archive.read("PRAGMA integrity_check") == [("ok",)]
        assert found == list(range(len(found)))
        assert len(found) % 20 == 0 and last <= len(found) <= last + 20


# History


def filled(archive, times_and_values):
    """Rows with a number `omega_x` at times [ms]."""
    names = CHIBIS.down["extended"].names
    place = names.index("omega_x")
    made = []
    for number, (time_ms, value) in enumerate(times_and_values):
        values = [None] * len(names)
        values[place] = value
        made.append(Row("extended", time_ms, time_ms + 5, 2, 0, number, tuple(values)))
    archive.put(made)


def test_the_latest_rows(archive):
    filled(archive, [(t, float(t)) for t in range(10)])
    with closing(read_only(archive.path)) as db:

        def of(*span):
            return latest(db, "extended", ["omega_x"], *span)

        assert of(0, 7, 2) == [(6, 11, 2, 6.0), (7, 12, 2, 7.0)]
        assert of(7, 9, 5) == [(7, 12, 2, 7.0), (8, 13, 2, 8.0), (9, 14, 2, 9.0)]
        assert of(0, 12, 1, "received") == [(7, 12, 2, 7.0)]
        assert of(-9, -1, 5) == []


def test_every_packet_of_the_dictionary_comes_back_as_it_was(archive):
    made, numbers = random.Random(5), {}
    for name, packet in CHIBIS.down.items():
        data = bytes(made.randrange(1, 255) for _ in range(packet.size))
        values = decoder(packet)(data)
        assert encoder(packet)(values) == data or any(v != v for v in values)
        numbers[name] = values
    archive.put(rows(*((name, 7, values) for name, values in numbers.items())))
    for name, packet in CHIBIS.down.items():
        columns = ", ".join(f'"{n}"' for n in packet.names)
        (found,) = archive.read(f'SELECT {columns} FROM "{name}"')
        for field, value, kept in zip(packet.names, numbers[name], found, strict=True):
            expected = value.hex() if isinstance(value, bytes) else value
            assert kept == expected or (kept is None and value != value), (name, field)
