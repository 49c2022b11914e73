"""The report of a pass from an archive whose contents are known."""

import re
from contextlib import closing
from html.parser import HTMLParser

import numpy as np
import pytest
from archived import commands_on
from hypothesis import given, strategies as st
from station_skies import START_MS

from torquer.computer.names import Names
from torquer.flight.packets.commands import Sent
from torquer.flight.packets.software_file import load_link
from torquer.ground.archive import Archive, ArchiveError, Batch, Row, read_only
from torquer.ground.pass_report import Received, find_gaps, report_pass, usual_step
from torquer.report.pass_page import Heading, pass_page, report_page

DICTIONARY = load_link().dictionary
#: The ground is years ahead of the satellite.
AHEAD_MS = 10**11
END_MS = START_MS + 600_000
SCRIPT = "<script>alert(1)</script>"


def row(packet, time_ms, digest, quality=2, status=0, received_ms=0, **values):
    numbers = [values.get(name, 0) for name in DICTIONARY.down[packet].names]
    received_ms = time_ms + AHEAD_MS if received_ms == 0 else received_ms
    return Row(packet, time_ms, received_ms, quality, status, digest, tuple(numbers))


@pytest.fixture
def archive(tmp_path):
    """Ten minutes of beacons each 10 s, of which 12 and 30 to 34 are missing; others around it."""
    made = Archive(tmp_path / "a.sqlite", DICTIONARY)
    there = [k for k in range(61) if k != 12 and not 30 <= k <= 34]
    rows = [row("beacon", START_MS + 10_000 * k, k) for k in there]
    rows[3] = rows[3]._replace(quality=0)
    rows[4] = rows[4]._replace(status=1)
    rows += [row("beacon", START_MS - 10_000 * k, 1000 + k) for k in (1, 2)]
    rows += [row("event", START_MS + t, 2000 + t, module_id=1, code=1, argument=t)
             for t in (5, 60_000, 61_000, 500_000)]  # fmt: skip
    made.put(rows)
    commands = commands_on(made, DICTIONARY, Names({}, (), {}, {}, ()))
    sent = Sent(at_s=0.0, command="report_status", values={"module_id": 1})
    for at_ms in (START_MS + 100_000, START_MS - 300_000):
        for number, _ in (commands.order(sent, SCRIPT, at_ms + AHEAD_MS, None),
                          *commands.due(at_ms + AHEAD_MS))[1:]:  # fmt: skip
            commands.sent(number, at_ms + AHEAD_MS)
    entries = [
        (1, START_MS + 1000, START_MS + AHEAD_MS, "alarm", SCRIPT),
        (2, START_MS - 1000, START_MS + AHEAD_MS, "info", "before"),
    ]
    made.store(Batch([], entries=entries))
    yield made
    made.close()


@pytest.fixture
def found(archive):
    with closing(read_only(archive.path)) as db:
        return report_pass(db, DICTIONARY, START_MS, END_MS)


def test_packets_and_their_gaps(found):
    beacon = next(each for each in found.received if each.packet == "beacon")
    assert beacon == Received(
        "beacon", 55, START_MS, END_MS, 1, 1, 10.0, 6,
        [(START_MS + 110_000, START_MS + 130_000), (START_MS + 290_000, START_MS + 350_000)],
    )  # fmt: skip
    event = next(each for each in found.received if each.packet == "event")
    assert (event.rows, event.step_s, event.missing, event.gaps) == (4, None, 0, [])
    assert (found.rows, found.missing) == (59, 6)


def test_commands_of_the_pass_go_by_the_clock_of_the_ground(found):
    (command,) = found.commands
    assert command["sent_ms"] == START_MS + 100_000 + AHEAD_MS and command["state"] == "sent"
    assert found.ground_ms == (START_MS + AHEAD_MS - 60_000, END_MS + AHEAD_MS + 60_000)


def test_a_recording_has_the_clock_of_the_satellite(tmp_path):
    made = Archive(tmp_path / "r.sqlite", DICTIONARY)
    made.put([row("beacon", START_MS + k, k, received_ms=None) for k in range(3)])
    with closing(read_only(made.path)) as db:
        found = report_pass(db, DICTIONARY, START_MS, END_MS)
        nothing = report_pass(db, DICTIONARY, 0, 1)
    made.close()
    assert found.ground_ms == (START_MS, END_MS) and found.rows == 3
    assert (nothing.received, nothing.commands, nothing.log, nothing.values) == ([], [], [], [])


def test_the_log_has_the_entries_of_the_pass(found):
    assert [(e["source"], e["severity"]) for e in found.log if e["source"] == "ground"] == [
        ("ground", "alarm")
    ]
    assert sum(each["source"] == "satellite" for each in found.log) == 4


def test_values_at_both_ends(archive):
    names = DICTIONARY.down["extended"].names
    first = {name: k for k, name in enumerate(names)} | {"omega_x": None}
    archive.put([
        row("extended", START_MS + 5, 1, **first),
        row("extended", START_MS + 6, 2),
        row("extended", END_MS - 5, 3, omega_x=0.123456789),
        row("extended", END_MS + 5, 4, omega_x=9.0),
    ])  # fmt: skip
    with closing(read_only(archive.path)) as db:
        found = report_pass(db, DICTIONARY, START_MS, END_MS)
    ends = {(each.packet, each.number): each for each in found.values}
    omega = ends["extended", "omega_x"]
    assert (omega.unit, omega.first, omega.last) == ("deg/s", "unknown", "0.1234568")
    mode = next(f for _, f, _ in DICTIONARY.down["extended"].numbers() if f.name == "svr_mode")
    assert ends["extended", "svr_mode"].last == mode.texts[0]


@given(
    st.integers(1, 100_000),
    st.lists(st.booleans(), min_size=12, max_size=80),
    st.integers(-(10**12), 10**12),
)
def test_missing_rows_are_counted_by_their_step(step_ms, kept, start_ms):
    """Most rows are there, in any pattern; those at either end cannot be known."""
    kept = [True, True, *(keep or k % 3 != 0 for k, keep in enumerate(kept)), True, True]
    times = np.array([start_ms + k * step_ms for k, keep in enumerate(kept) if keep])
    assert usual_step(times) == step_ms
    missing, gaps = find_gaps(times, step_ms)
    assert missing == kept.count(False)
    assert sum((b - a) // step_ms - 1 for a, b in gaps) == missing


@pytest.mark.parametrize("steps", [[5, 900, 12, 4000, 77, 20_000], [1, 1], [0, 0, 0, 0]])
def test_rows_that_come_irregularly_have_no_gaps(steps):
    assert usual_step(np.cumsum([0, *steps])) is None


# The page


class Tags(HTMLParser):
    """What a page loads, and which tags it has."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.loads, self.text = [], [], ""
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.loads += [value for name, value in attrs if name in ("src", "href")]

    def handle_data(self, data):
        self.text += data


def test_the_page_escapes_and_loads_nothing(archive):
    page = report_page(archive.path, Heading("chibis", "tarusa"), START_MS, END_MS)
    seen = Tags(page)
    assert "script" not in seen.tags and seen.loads == []
    assert SCRIPT in seen.text and SCRIPT not in page
    assert "default-src 'none'" in page and "@media print" in page
    for text in ("chibis over tarusa, 2012-02-28 00:00:00 UTC", "report_status module_id=1"):
        assert text in seen.text
    assert re.search(r"Packets missing in gaps\s*6", seen.text)


def test_a_page_of_nothing_says_so(archive):
    page = report_page(archive.path, Heading("chibis"), 0, 1000)
    assert page.count("None.") == 3 and "No entries." in page
    assert "None: no packet of those that come regularly is missing." in " ".join(page.split())


def test_a_page_of_many_rows_is_bounded(found):
    many = found._replace(received=[found.received[0]._replace(gaps=[(0, 1)] * 20)] * 3)
    assert pass_page(Heading("chibis"), many).count("<tr>") < 200


def test_what_is_no_archive_gets_one_line(tmp_path):
    path = tmp_path / "a.sqlite"
    path.write_text("nothing", encoding="utf-8")
    with pytest.raises(ArchiveError, match=r"^archive: must be an archive; received [^\n]+$"):
        report_page(path, Heading("chibis"), 0, 1)
    with pytest.raises(ArchiveError):
        report_page(tmp_path / "none.sqlite", Heading("chibis"), 0, 1)
