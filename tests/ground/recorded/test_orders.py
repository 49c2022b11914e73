"""Recordings in any order, twice, damaged, of two stations, with counters that begin again."""

import random
from contextlib import closing

import pytest
from hypothesis import given, settings, strategies as st
from recorded_passes import (
    DICTIONARY,
    HISTORICAL,
    SIZE,
    imported,
    packets,
    reasons,
    rows_of,
    wrapped,
)

from torquer.flight.packets.frames import Stream
from torquer.ground.archive import Archive


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 2**32),
    number=st.integers(1, 80),
    at_once=st.integers(1, 9),
    order=st.sampled_from(["newest first", "shuffled", "as they came"]),
    lost=st.floats(0.0, 0.3),
)
def test_every_intact_frame_is_kept_once_and_no_other(
    tmp_path_factory, seed, number, at_once, order, lost
):
    """Two stations, each with losses, damage and noise between frames: kept is what was whole."""
    draw, folder = random.Random(seed), tmp_path_factory.mktemp("orders")
    frames = list(packets(seed, number))
    sent, where = wrapped(frames, at_once=at_once)
    heard, recordings = set(), []
    for _ in range(2):
        own = [(k, frame) for k, frame in enumerate(sent) if draw.random() >= lost]
        own += draw.choices(own, k=len(own) // 5)  # some come twice
        own.sort(reverse=order == "newest first")
        if order == "shuffled":
            draw.shuffle(own)
        recording = b""
        for k, frame in own:
            if draw.random() < lost:
                at = draw.randrange(SIZE)
                frame = frame[:at] + bytes([frame[at] ^ draw.randrange(1, 256)]) + frame[at + 1 :]
                frame = frame[: draw.choice((SIZE, SIZE, draw.randrange(SIZE)))]
            else:
                heard.add(k)
            recording += frame + draw.randbytes(draw.choice((0, 0, 3, 50)))
        recordings.append(recording)
    whole = [
        frame
        for frame, (first, end) in zip(frames, where, strict=True)
        if heard.issuperset(range(first, end))
    ]
    counts, kept = imported(folder, *recordings)
    assert kept == rows_of(folder, whole)
    assert counts["frames"] == counts["new"] == len(kept) == len(whole)
    assert (
        counts["lost_bytes"] + SIZE * (len(heard) + reasons(counts).get("repeated", 0))
        == (counts["bytes"])
    )
    again, same = imported(folder, *recordings)
    assert same == kept and again["new"] == 0 and again["frames"] == len(kept)


@pytest.mark.parametrize("order", ["one after the other", "newest first", "shuffled"])
def test_counters_that_begin_again(tmp_path, order):
    frames = [[*packets(seed, 300, start_s=10**7 * seed)] for seed in range(3)]
    sessions = [wrapped(each)[0] for each in frames]
    sent = [frame for session in sessions for frame in session]
    if order == "newest first":
        sent.reverse()
    if order == "shuffled":
        random.Random(3).shuffle(sent)
    counts, kept = imported(tmp_path, b"".join(sent))
    everything = rows_of(tmp_path, [frame for each in frames for frame in each])
    assert kept <= everything, "no packet of two sessions"
    if order == "shuffled":  # neighbours and times do not tell of all which part is whose
        assert 0.85 * len(everything) < len(kept) and reasons(counts)["ambiguous"] > 0
        assert len(everything) - len(kept) <= sum(reasons(counts).values())
    else:
        assert kept == everything and counts["left_out"] == []


def test_a_packet_of_two_sessions_is_not_made(tmp_path):
    """Of two sessions with the same counters one has lost a packet's end, one its beginning."""
    sessions = [wrapped(list(packets(1, 60, start)), at_once=60)[0] for start in (0, 10**8)]
    everything = rows_of(tmp_path, [*packets(1, 60), *packets(1, 60, 10**8)])
    for lost in range(1, 20):
        one, two = (list(session) for session in sessions)
        del one[lost], two[lost - 1]
        _, kept = imported(tmp_path, b"".join(one + two), name=f"sat{lost}")
        assert kept < everything, lost


@pytest.mark.parametrize("seed", range(5))
def test_parts_wait_for_recordings_that_come_later(tmp_path, seed):
    frames = list(packets(seed, 200))
    sent, _ = wrapped(frames, at_once=20)
    random.Random(seed).shuffle(sent)
    for first in range(0, len(sent), 7):
        counts, kept = imported(tmp_path, b"".join(sent[first : first + 7]))
    assert kept == rows_of(tmp_path, frames)
    assert counts["lost_packets"] == 0
    with closing(Archive(tmp_path / "sat.sqlite", DICTIONARY)) as archive:
        assert archive.parts() == []


def test_link_and_recording_of_a_frame_are_one_row(tmp_path):
    frames = list(packets(5, 100))
    before = rows_of(tmp_path, frames)
    sent, _ = wrapped(frames)
    counts, kept = imported(tmp_path, b"".join(sent), name="expected")
    assert kept == before and (counts["frames"], counts["new"]) == (100, 0)
    assert reasons(counts) == {"archived": 100} and not counts["failure"]


@settings(max_examples=40, deadline=None)
@given(data=st.binary(max_size=400), seed=st.integers(0, 2**32), number=st.integers(0, 12))
def test_plain_frames_are_those_of_a_stream(tmp_path_factory, data, seed, number):
    """Frames without protection, noise and parts of frames between them: as the stream has it."""
    draw, folder = random.Random(seed), tmp_path_factory.mktemp("plain")
    pieces = list(packets(seed, number))
    pieces += [frame[: draw.randrange(len(frame))] for frame in pieces[::3]]
    pieces += [frame[draw.randrange(len(frame)) :] for frame in pieces[1::3] if frame]
    pieces += [b"\xdd\xcc\xbb\xaa", b"\xdd\xcc", data]
    draw.shuffle(pieces)
    recording = b"".join(pieces)
    stream = Stream(DICTIONARY, "down")
    found = [*stream.feed(recording), *stream.finish()]
    counts, kept = imported(folder, recording, link=HISTORICAL)
    assert counts["frames"] == len(found)
    assert counts["lost_bytes"] == stream.lost_bytes
    assert counts["rejected"] == sum(stream.rejected.values())
    expected = rows_of(folder, [frame.raw for frame in found])
    untrusted = [{row[:3] + row[4:] for row in rows} for rows in (kept, expected)]
    assert untrusted[0] == untrusted[1]


def test_parts_of_an_earlier_import_are_not_joined_with_another_session(tmp_path):
    sessions = [wrapped(list(packets(1, 60, start)), at_once=60)[0] for start in (0, 10**8)]
    everything = rows_of(tmp_path, [*packets(1, 60), *packets(1, 60, 10**8)])
    for lost in range(1, 20):
        name = f"sat{lost}"
        imported(tmp_path, b"".join(sessions[0][:lost]), name=name)
        _, kept = imported(tmp_path, b"".join(sessions[1][lost:]), name=name)
        assert kept < everything, lost
