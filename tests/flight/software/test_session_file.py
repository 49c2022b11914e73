"""The file of a session: written as it goes, whole or cut off anywhere, refused when damaged."""

import json
import os
import signal
import subprocess
import sys
import time

import pytest

import torquer
from torquer.base.explain import ScenarioError
from torquer.compile import engine
from torquer.flight.software.faults import FaultsFile
from torquer.flight.software.session import replay_session
from torquer.flight.software.session_file import (
    STRIDE,
    Recorder,
    Replayed,
    begin_session,
    load_session,
)

DAY = "examples/chibis_m_day.toml"


@pytest.fixture(scope="module")
def beginning():
    return begin_session(torquer.load_scenario(DAY), FaultsFile(), None)


@pytest.fixture
def path(tmp_path, beginning):
    """A session of 150 control steps with three uplinks."""
    with Recorder(tmp_path / "session.json", beginning) as recorder:
        for number in range(150):
            uplink = bytes([number]) * 5 if number in (10, 64, 149) else b""
            recorder.note(number.to_bytes(2, "big"), uplink)
    return tmp_path / "session.json"


def test_what_was_recorded_is_read_again(path):
    session, again = load_session(path), Replayed()
    for number in range(150):
        again.note(number.to_bytes(2, "big"))
    assert session.digests == again.list_digests() and len(session.digests) == 3
    assert (session.ticks, session.downlink_bytes) == (150, 300)
    assert session.uplink == ((10, "0a" * 5), (64, "40" * 5), (149, "95" * 5))
    assert isinstance(json.loads(path.read_text(encoding="utf-8")), list)


@pytest.mark.verifies("REQ-SES-003")
def test_a_file_cut_off_anywhere_has_what_came_before_the_last_digest(path):
    whole, text = load_session(path), path.read_text(encoding="utf-8")
    begin = text.index("\n,")
    for end in range(begin + 1, len(text)):
        path.write_text(text[:end], encoding="utf-8")
        session = load_session(path)
        assert session.ticks in (0, STRIDE, 2 * STRIDE, 150)
        assert session.digests == whole.digests[: len(session.digests)]
        assert session.uplink == tuple(each for each in whole.uplink if each[0] < session.ticks)
        assert session.scenario == whole.scenario


@pytest.mark.parametrize(
    ("line", "text", "message"),
    [
        (0, "{", "line 1 is none of a session"),
        (1, "[]", "line 2 is none of a session"),
        (2, "x", "line 3 is none of a session"),
        (3, ',[1,"00"', "line 4 is none of a session"),
        (3, '[1,"00"]]', "line 4 is none of a session"),
        (3, ',{"ticks": 0, "downlink_bytes": 1, "digest": ""}', "line 4 is none of a session"),
        (3, ',{"ticks": 65, "downlink_bytes": 1, "digest": ""}', "line 4 is none of a session"),
        (4, ',[63,"00"]', "line 5 is none of a session"),
        (4, ",null", "line 5 is none of a session"),
        (4, ',[70,"0g"]', "uplink[1][1]: must be hexadecimal digits"),
    ],
)
def test_a_damaged_file_is_refused_with_one_line(path, line, text, message):
    lines = path.read_text(encoding="utf-8").split("\n")
    lines[line] = text
    path.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(ScenarioError) as error:
        load_session(path)
    assert message in str(error.value) and "\n" not in str(error.value)


def test_other_files_and_versions_are_refused(path, tmp_path):
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace(torquer.__version__, "0.0.1", 1), encoding="utf-8")
    with pytest.raises(ScenarioError, match=r"must be of torquer .*received one of 0[.]0[.]1"):
        load_session(path)
    path.write_bytes(text.encode()[:-20] + b"\xff\xfe")
    for other in (path, tmp_path / "none.json", tmp_path):
        with pytest.raises(ScenarioError, match=r"^session: must be a readable session; received "):
            load_session(other)


@pytest.mark.verifies("REQ-SES-004")
def test_the_recorder_keeps_nothing(tmp_path, beginning):
    import tracemalloc

    uplink, downlink = bytes(1000), bytes(300)
    with Recorder(tmp_path / "session.json", beginning) as recorder:
        recorder.note(downlink, uplink)
        tracemalloc.start()
        for _ in range(5000):
            recorder.note(downlink, uplink)
        kept, _ = tracemalloc.get_traced_memory()
        tracemalloc.stop()
    assert kept < 20_000
    assert load_session(tmp_path / "session.json").ticks == 5001


@pytest.mark.verifies("REQ-SES-003")
@pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
@pytest.mark.skipif(os.name == "nt", reason="signals of another kind")
@pytest.mark.slow
def test_a_killed_flight_is_flown_again_as_far_as_it_came(tmp_path):
    command = [sys.executable, "-m", "torquer", "fly", DAY, "--speed", "20", "--out", tmp_path]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as flight:
        path, end_s = tmp_path / "session.json", time.monotonic() + 120.0
        while not path.exists() or path.read_text().count('"ticks"') < 5:
            assert time.monotonic() < end_s and flight.poll() is None
            time.sleep(0.1)
        flight.send_signal(signal.SIGKILL)
    session, again = load_session(path), Replayed()
    assert session.ticks >= STRIDE and not path.read_text().endswith("]\n")
    for tick in replay_session(session):
        again.note(tick.downlink)
    assert again.list_digests() == session.digests and again.ticks == session.ticks
