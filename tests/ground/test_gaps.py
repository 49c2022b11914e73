"""Gaps in what is archived, and the orders by which the satellite sends what it stored of them."""

import random
from contextlib import closing

import pytest
from made_archive import CHIBIS, archive_of, row
from onboard_ground import flying

from torquer.base.limits import RequestError
from torquer.compile import engine
from torquer.flight.packets.reasons import Reason
from torquer.flight.packets.software_file import load_link
from torquer.ground import gaps as gaps_
from torquer.ground.archive import EPOCH_MS, Archive, read_only
from torquer.ground.gaps import SPAN_MS, can_fill, fill, find_gaps, is_on_board
from torquer.ground.recording import import_recording


def found(path, *asked):
    with closing(read_only(path)) as db:
        return find_gaps(db, CHIBIS, *asked)


def extended(times_ms):
    return [row("extended", time_ms) for time_ms in times_ms]


@pytest.fixture(params=[100_000, 40], ids=["at once", "in parts"])
def parts(request, monkeypatch):
    monkeypatch.setattr(gaps_, "_PART", request.param)


@pytest.mark.usefixtures("parts")
@pytest.mark.parametrize("lost", [[37], [37, 38], [*range(120, 180)]])
def test_missing_rows_are_a_gap(tmp_path, lost):
    times = [1000 * k for k in range(300) if k not in lost]
    (gap,) = found(archive_of(tmp_path / "sat.sqlite", extended(times)))
    assert (gap.packet, gap.every_ms, gap.missing, gap.stored) == ("extended", 1000, len(lost), 0)
    assert (gap.start_ms, gap.end_ms) == (1000 * (lost[0] - 1), 1000 * (lost[-1] + 1))


def test_another_period_and_jitter_are_none(tmp_path):
    draw = random.Random(3)
    fast = [1000 * k + draw.randrange(200) for k in range(100)]
    slow = [100_000 + 30_000 * k for k in range(100)]
    assert found(archive_of(tmp_path / "sat.sqlite", extended(fast + slow))) == []


def test_packets_that_come_as_it_happens_have_no_gaps(tmp_path):
    draw, at = random.Random(5), [0]
    for _ in range(200):
        at.append(at[-1] + round(1000 * 10 ** draw.uniform(0, 4)))
    rows = [row("event", time_ms) for time_ms in at]
    assert found(archive_of(tmp_path / "sat.sqlite", rows)) == []


def test_few_rows_and_none_have_no_period(tmp_path):
    times = [0, 1000, 2000, 9000]
    assert found(archive_of(tmp_path / "few.sqlite", extended(times))) == []
    assert found(archive_of(tmp_path / "none.sqlite", [])) == []


def test_what_has_been_stored_on_board_and_come_since_is_counted(tmp_path):
    times = [1000 * k for k in range(300) if not 100 <= k < 200]
    stored = [row("stored", 1000 * k) for k in range(0, 300, 10)]
    (gap,) = found(archive_of(tmp_path / "sat.sqlite", extended(times) + stored))
    assert (gap.missing, gap.stored) == (100, 10)


def test_the_last_week_is_looked_at_unless_more_is_asked_for(tmp_path):
    late = 3 * SPAN_MS
    times = [*range(0, 60_000, 1000), *range(90_000, 150_000, 1000)]
    path = archive_of(tmp_path / "sat.sqlite", extended(times + [late + t for t in times]))
    assert [gap.start_ms for gap in found(path)] == [late + 59_000]
    everything = found(path, ["extended"], 0)
    assert [gap.start_ms for gap in everything] == [59_000, 149_000, late + 59_000]
    assert found(path, ["extended"], 0, late - 1)[0].start_ms == 59_000
    assert found(path, ["beacon"], 0) == []


def test_the_latest_gaps_are_listed(tmp_path, monkeypatch):
    monkeypatch.setattr(gaps_, "MOST", 3)
    times = [1000 * k for k in range(1000) if k % 100 != 99]
    listed = found(archive_of(tmp_path / "sat.sqlite", extended(times)))
    assert [gap.end_ms for gap in listed] == [700_000, 800_000, 900_000]


@pytest.mark.usefixtures("parts")
@pytest.mark.parametrize("back_ms", [1_000, 30_000, 59_000])
def test_a_clock_that_goes_back_begins_a_gap_though_no_rows_are_far_apart(tmp_path, back_ms):
    """20 rows a flight; the first that comes of the second may not be the first it recorded."""
    flights = [[20_000 * k for k in range(20)]]
    flights.append([flights[0][-1] - back_ms + 20_000 * k for k in range(20)])
    rows = [row("extended", t, 10 * k) for k, t in enumerate(flights[0] + flights[1])]
    listed = found(archive_of(tmp_path / "sat.sqlite", rows))
    (gap,) = (each for each in listed if each.went_back)
    assert gap.end_ms == flights[1][0]
    assert gap.start_ms == flights[0][-1] - 60_000
    assert gap.missing == -((gap.start_ms - gap.end_ms) // 20_000)


def test_a_reboot_while_rows_come_more_seldom_than_before(tmp_path):
    """The period changes with the telemetry's rate: it is that about the reboot that counts."""
    first = [1000 * k for k in range(400)]
    slow = [first[-1] + 20_000 * k for k in range(1, 100)]
    after = [slow[-1] - 30_000 + 20_000 * k for k in range(100)]
    rows = [row("extended", t, 10 * k) for k, t in enumerate(first + slow + after)]
    (gap,) = (each for each in found(archive_of(tmp_path / "sat.sqlite", rows)) if each.went_back)
    assert (gap.end_ms, gap.every_ms) == (after[0], 20_000)


@pytest.mark.usefixtures("parts")
def test_rows_handed_over_late_or_by_another_ground_tell_of_no_reboot(tmp_path):
    late = [*range(0, 20), 21, 22, 20, *range(23, 60), 61, 60, 62, *range(63, 80)]
    rows = [row("extended", 20_000 * t, 10 * k) for k, t in enumerate(late)]
    assert found(archive_of(tmp_path / "late.sqlite", rows)) == []
    set_back = [row("extended", 20_000 * k, 10 * (k + 40) % 800) for k in range(80)]
    assert found(archive_of(tmp_path / "set.sqlite", set_back)) == []
    unknown = [row("extended", 20_000 * k, None) for k in range(40)]
    assert found(archive_of(tmp_path / "recorded.sqlite", unknown)) == []


def test_orders_name_whole_seconds_around_a_gap_and_the_minute_before():
    sent = fill(EPOCH_MS + 61_500, EPOCH_MS + 62_500)
    assert (sent.command, sent.values) == ("replay", {"from_s": 1, "to_s": 63, "every": 1})
    assert fill(0, 2**60).values == {"from_s": 0, "to_s": 2**32 - 1, "every": 1}
    assert fill(0, EPOCH_MS + 1).values == {"from_s": 0, "to_s": 1, "every": 1}
    assert can_fill(CHIBIS)
    assert not can_fill(CHIBIS.model_copy(update={"up": {}}))


@pytest.mark.parametrize(
    ("start_ms", "end_ms"),
    [(-(2**53), 0), (0, 1000), (0, EPOCH_MS), (EPOCH_MS + 1000 * 2**32, 2**60)],
)
def test_a_gap_of_which_the_satellite_can_have_no_record_orders_none(start_ms, end_ms):
    assert not is_on_board(start_ms, end_ms)
    with pytest.raises(RequestError, match=r"^gap: must be within 2010-01-01T00:00:00Z to 2146-"):
        fill(start_ms, end_ms)


@pytest.mark.skipif(not engine.COMPILED, reason="a flight: minutes without JIT")
@pytest.mark.verifies("REQ-TM-002")
def test_a_gap_is_filled_by_the_record_each_row_once_though_it_is_asked_for_twice(tmp_path):
    """What came down in half a minute is lost; its record is ordered, twice, and comes."""
    tm = {"store_s": 1.0, "in_file": 5, "files": 100}
    ground = flying(400.0, software={"modules": {"tm": {"settings": tm}}})
    ground.tick(times=120)
    del ground.sent[60:90]
    link = load_link(None)
    with closing(Archive(tmp_path / "sat.sqlite", link.dictionary)) as archive:

        def kept():
            """Gaps of the main packet, and the record, once all that came down is archived."""
            (tmp_path / "pass.bin").write_bytes(b"".join(ground.sent))
            import_recording(link, tmp_path / "pass.bin", archive)
            gaps = found(tmp_path / "sat.sqlite", ["extended"])
            return gaps, archive.read("SELECT on_board_ms FROM stored ORDER BY _time_ms")

        (gap,), rows = kept()
        assert (gap.missing, gap.stored, rows) == (30, 0, [])
        for _ in range(2):
            order = fill(gap.start_ms, gap.end_ms)
            answer = ground.command("replay", *order.values.values(), times=50)
            assert answer["code"] == Reason.DONE
            (after,), rows = kept()
            # the minute before the gap as well, in which the record begins
            assert after.stored == 30 and len(rows) == len({*rows}) == 91
    assert len(ground.named("stored")) == 2 * 91
