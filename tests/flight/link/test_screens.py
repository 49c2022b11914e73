"""What a link hands on: whole frames of each client, whatever the others send, and no noise."""

import random

import pytest
from frame_attacks import refit
from hypothesis import given, settings, strategies as st

from torquer.flight.link import screens_of
from torquer.flight.link.screen import AT_ONCE, FRAME_S, UNPROVEN, choose
from torquer.flight.packets.frames import Uplink
from torquer.flight.packets.protected import CommandReceiver, CommandSender
from torquer.flight.packets.software_file import load_link

LINK, HISTORICAL = load_link(), load_link({"link": "historical"})
KEYS = LINK.keys
STATUS = Uplink(LINK.dictionary).frame("report_status", 0, (1, 1))
SET_ELEMENTS = Uplink(LINK.dictionary).frame("set_elements", 0, (1, bytes(69), bytes(69)))
#: The beginning of a frame of 1024 bytes.
BEGUN = b"\xeb\x90" + bytes([0x20, KEYS.spacecraft, 0x03, 0xFF])


def protected():
    """Screens before a receiver, and who commands it."""
    receiver = CommandReceiver({KEYS.spi: KEYS.up}, KEYS.spacecraft)
    sender = CommandSender(KEYS.up, KEYS.spi, KEYS.spacecraft)
    return screens_of(LINK, receiver.judge), receiver, sender


@pytest.mark.verifies("REQ-LNK-007")
@settings(deadline=None)
@given(st.lists(st.integers(1, 60), min_size=1, max_size=12), st.integers(0, 2**32))
def test_frames_come_whole_however_clients_are_mixed(steps, seed):
    rng = random.Random(seed)
    new, receiver, sender = protected()
    own = [sender.wrap(STATUS) for _ in range(3)]
    streams = [b"".join(own), BEGUN + rng.randbytes(300), rng.randbytes(200) + b"\xeb"]
    screens, found = [new() for _ in streams], []
    ends = [0] * len(streams)
    while any(end < len(stream) for end, stream in zip(ends, streams, strict=True)):
        k = rng.randrange(len(streams))
        step = rng.choice(steps)
        found += screens[k].pass_on(streams[k][ends[k] : ends[k] + step], 0.0)
        ends[k] += step
    assert [frame for frame, is_proven in found if is_proven] == own
    assert len(receiver.take(choose(found))) == 3


@pytest.mark.verifies("REQ-LNK-007")
def test_the_end_of_a_frame_is_waited_for_only_so_long_from_its_start():
    """A byte now and then does not help: the limit counts from the beginning."""
    new, _, sender = protected()
    screen, frame, t_s = new(), sender.wrap(STATUS), 0.0
    assert screen.pass_on(BEGUN, t_s) == []
    while t_s < FRAME_S:
        t_s += 0.25
        assert screen.pass_on(b"\0", t_s) == []
    assert screen.pass_on(frame[:20], t_s + 0.25) == []
    assert screen.pass_on(frame[20:], t_s + 0.5) == [(frame, True)]


def test_a_frame_behind_a_mark_that_came_to_nothing_is_found():
    new, _, sender = protected()
    screen, frame = new(), sender.wrap(STATUS)
    assert screen.pass_on(BEGUN + frame, 0.0) == []
    assert screen.pass_on(b"", FRAME_S + 0.1) == [(frame, True)]


@pytest.mark.parametrize("place", [3, 12, 30, -1])
def test_noise_ends_here_and_the_rest_is_not_proven(place):
    new, receiver, sender = protected()
    frame = sender.wrap(STATUS)
    damaged = frame[:place] + bytes([frame[place] ^ 1]) + frame[place:][1:]
    assert new().pass_on(damaged, 0.0) == []
    forged = bytearray(frame)
    forged[20] ^= 1
    assert new().pass_on(refit(forged), 0.0) == [(refit(forged), False)]
    assert new().pass_on(frame, 0.0) == [(frame, True)]
    receiver.take(frame)
    assert new().pass_on(frame, 0.0) == [(frame, False)]


def test_proven_frames_go_first_and_all_fit_into_the_receiver():
    rng = random.Random(1)
    genuine = [(rng.randbytes(200), True) for _ in range(60)]
    others = [(rng.randbytes(100), False) for _ in range(60)]
    mixed = [*genuine, *others]
    rng.shuffle(mixed)
    chosen = choose(mixed)
    wanted = b"".join(data for data, is_proven in mixed if is_proven)
    room = AT_ONCE // 200 * 200
    assert len(chosen) <= AT_ONCE and chosen[:room] == wanted[:room]
    assert len(chosen) == room + (AT_ONCE - room) // 100 * 100
    few = choose([*others, genuine[0]])
    assert few.startswith(genuine[0][0]) and len(few) == 200 + UNPROVEN // 100 * 100


@pytest.mark.verifies("REQ-LNK-007")
def test_historical_frames_are_handed_on_whole_too():
    new = screens_of(HISTORICAL, lambda frame: "never asked")
    first, second = new(), new()
    assert first.pass_on(SET_ELEMENTS[:50], 0.0) == []
    assert second.pass_on(STATUS, 0.1) == [(STATUS, True)]
    assert first.pass_on(SET_ELEMENTS[50:], 0.2) == [(SET_ELEMENTS, True)]
    assert second.pass_on(bytes(range(200)) * 5, 0.3) == []
    unknown = STATUS[:8] + b"\xfe" + STATUS[9:]
    assert second.pass_on(unknown, 0.4) == [(unknown, False)]  # for a negative answer
    assert first.pass_on(SET_ELEMENTS[:50], 1.0) == []
    assert first.pass_on(b"", 1.1 + FRAME_S) == []
    assert first.pass_on(STATUS, 1.2 + FRAME_S) == [(STATUS, True)]
