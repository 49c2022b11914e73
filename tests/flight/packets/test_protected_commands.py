"""Commands in TC frames: bits of the standard, the MAC of RFC 4231, what is rejected and why."""

import copy
import hashlib
import hmac
import struct

import fastcrc
import frame_attacks
import pytest
from frame_attacks import KEY, SPACECRAFT, SPI, refit
from hypothesis import given, strategies as st

from torquer.flight.packets.protected import COMMAND_BYTES, CommandReceiver, CommandSender
from torquer.flight.packets.security import USED_UP, crc16, mac

MARK = b"\xeb\x90"
OTHER_KEY = bytes(range(32, 64))


def link(**how):
    """A sender and a receiver that understand each other."""
    receiver = CommandReceiver({SPI: KEY, SPI + 1: OTHER_KEY}, SPACECRAFT, **how)
    return CommandSender(KEY, SPI, SPACECRAFT), receiver


@pytest.mark.parametrize(
    ("key", "data", "expected"),
    [  # RFC 4231, test cases 1 to 5, the first half of HMAC-SHA-256
        (20 * b"\x0b", b"Hi There", "b0344c61d8db38535ca8afceaf0bf12b"),
        (b"Jefe", b"what do ya want for nothing?", "5bdcc146bf60754e6a042426089575c7"),
        (20 * b"\xaa", 50 * b"\xdd", "773ea91e36800e46854db8ebd09181a7"),
        (bytes(range(1, 26)), 50 * b"\xcd", "82558a389a443c0ea4cc819899f2083a"),
        (20 * b"\x0c", b"Test With Truncation", "a3b6167473100ee06e0c796c2955552b"),
    ],
)
def test_the_mac_is_that_of_rfc_4231(key, data, expected):
    assert mac(key, data).hex() == expected


@given(st.binary(min_size=32, max_size=32), st.binary(max_size=300))
def test_mac_and_crc_are_those_of_others(key, data):
    assert mac(key, data) == hmac.new(key, data, hashlib.sha256).digest()[:16]
    assert crc16(data) == fastcrc.crc16.ibm_3740(data)  # with which spacepackets checks frames


def test_the_crc_has_its_check_value():
    assert crc16(b"123456789") == 0x29B1


@pytest.mark.verifies("REQ-LNK-003")
@given(
    st.integers(0, 1023), st.integers(1, 65534), st.integers(0, 2**32 - 2), st.binary(max_size=995)
)
def test_a_frame_has_the_bits_of_the_standard(spacecraft, spi, counter, data):
    """CCSDS 232.0-B, 4.1.2: the header's fields one after the other, as texts of bits."""
    frame = CommandSender(KEY, spi, spacecraft, counter).wrap(data)[2:]
    fields = (
        *(f"{0:02b}", "1", "0", f"{0:02b}", f"{spacecraft:010b}"),  # version, bypass, data, spare
        *(f"{0:06b}", f"{len(frame) - 1:010b}", f"{0:08b}"),  # channel, length less one, number
    )
    bits = "".join(f"{byte:08b}" for byte in frame[:5])
    assert bits == "".join(fields)
    # CCSDS 355.0-B: SPI and sequence number before the data, MAC behind
    assert frame[5:11] == spi.to_bytes(2, "big") + (counter + 1).to_bytes(4, "big")
    assert frame[11:-18] == data
    assert frame[-18:-2] == hmac.new(KEY, frame[:-18], hashlib.sha256).digest()[:16]
    assert fastcrc.crc16.ibm_3740(frame) == 0


@given(st.lists(st.binary(max_size=60) | st.just(MARK * 9), max_size=20), st.integers(1, 400))
def test_what_is_wrapped_arrives_however_it_is_cut(datas, size):
    sender, receiver = link()
    stream = b"".join(map(sender.wrap, datas))
    pieces = [stream[at : at + size] for at in range(0, len(stream), size)]
    assert [data for piece in pieces for data in receiver.feed(piece)] == datas
    assert receiver.counters == {SPI: len(datas), SPI + 1: 0}
    assert (receiver.rejected, receiver.lost_bytes) == ({}, 0)


@given(st.binary(max_size=80), st.binary(max_size=80), st.sampled_from([b"", b"\xeb", MARK]))
def test_genuine_frames_after_garbage_are_accepted(before, between, last):
    sender, receiver = link()
    begun = CommandSender(OTHER_KEY, 99, SPACECRAFT).wrap(bytes(30))[:20]  # its end was lost
    for garbage in (before + last, between + begun, MARK + b"\x21\x5a\x03\xff"):
        data = sender.counter.to_bytes(4, "big")
        frame = sender.wrap(data)
        at_once = receiver.feed(garbage + frame)
        assert [*at_once, *receiver.flush()] == [data]
        assert receiver.feed(sender.wrap(b"next")) == [b"next"]
    assert receiver.lost_bytes == sum(map(len, (before, last, between, begun))) + 6


def test_garbage_is_counted_at_once_and_split_marks_are_found():
    sender, receiver = link()
    assert receiver.feed(b"garbage" + MARK[:1]) == [] and receiver.lost_bytes == 7
    assert receiver.feed(b"more") == [] and receiver.lost_bytes == 12
    stream = b"garbage" + sender.wrap(b"data") + b"\xeb" + sender.wrap(b"next")
    arrived = [data for byte in stream for data in receiver.feed(bytes([byte]))]
    assert arrived == [b"data", b"next"] and receiver.lost_bytes == 20
    assert receiver.feed(MARK + b"\x21\x5a\x00\x1b\x00") == []  # of 28 bytes: one too short
    assert receiver.rejected == {"length": 1}


def test_a_window_of_one_takes_the_next_frame_only():
    sender, receiver = link(window=1)
    assert receiver.feed(sender.wrap(b"one") + sender.wrap(b"two")) == [b"one", b"two"]
    sender.wrap(b"lost")
    assert rejected(receiver, sender.wrap(b"four")) == "leap"


def test_an_incomplete_frame_holds_back_at_most_a_longest_frame():
    sender, receiver = link()
    receiver.feed(MARK + b"\x21\x5a\x03\xff")  # of 1024 bytes, it says
    arrived = []
    for number in range(16):
        arrived += receiver.feed(sender.wrap(bytes([number]) * 40))
    assert [data[0] for data in arrived] == list(range(16))


def rejected(receiver, frame):
    """The reason why a frame is rejected; the counters must not have moved."""
    before = dict(receiver.counters)
    receiver.rejected.clear()
    assert receiver.feed(frame) + receiver.flush() == []
    assert receiver.counters == before
    return next(iter(receiver.rejected))


@pytest.mark.verifies("REQ-LNK-003")
def test_the_checks_have_an_order():
    """A frame with all mistakes, of which one after the other is put right."""
    sender, receiver = link(window=64, counters={SPI: 100})
    assert receiver.counters == {SPI: 100, SPI + 1: 0}
    whole = bytearray(CommandSender(KEY, SPI, SPACECRAFT, 99).wrap(b"data"))
    wrong = whole.copy()
    wrong[3] ^= 1  # spacecraft
    wrong[7] ^= 1  # SPI
    wrong[-1] ^= 1
    short = wrong.copy()
    struct.pack_into(">H", short, 4, 10)
    assert rejected(receiver, bytes(short)) == "length"
    assert rejected(receiver, bytes(wrong)) == "checksum"
    assert rejected(receiver, refit(wrong)) == "spacecraft"
    wrong[3] ^= 1
    assert rejected(receiver, refit(wrong)) == "spi"
    wrong[7] ^= 1
    wrong[14] ^= 1
    assert rejected(receiver, refit(wrong)) == "mac"
    wrong[14] ^= 1
    assert rejected(receiver, refit(wrong)) == "replayed"
    far = CommandSender(KEY, SPI, SPACECRAFT, 164).wrap(b"too far")
    assert rejected(receiver, far) == "leap"
    assert receiver.feed(CommandSender(KEY, SPI, SPACECRAFT, 163).wrap(b"far")) == [b"far"]
    assert receiver.counters == {SPI: 164, SPI + 1: 0}
    sender.counter = 164
    assert receiver.feed(sender.wrap(b"next")) == [b"next"]


def test_frames_do_not_overtake_each_other_and_come_once():
    sender, receiver = link()
    frames = [sender.wrap(bytes([number])) for number in range(5)]
    order = (0, 2, 1, 2, 4, 3, 4, 0)
    assert [receiver.feed(frames[number]) for number in order] == [
        [b"\0"], [b"\2"], [], [], [b"\4"], [], [], []
    ]  # fmt: skip
    assert receiver.rejected == {"replayed": 5}


def test_keys_have_counters_of_their_own():
    sender, receiver = link()
    other = CommandSender(OTHER_KEY, SPI + 1, SPACECRAFT)
    sender.counter = 60
    assert receiver.feed(sender.wrap(b"a") + other.wrap(b"b")) == [b"a", b"b"]
    assert receiver.counters == {SPI: 61, SPI + 1: 1}
    stolen = bytearray(sender.wrap(b"c"))
    struct.pack_into(">H", stolen, 7, SPI + 1)
    assert rejected(receiver, refit(stolen)) == "mac"


def test_frame_inside_rejected_data_is_not_looked_for():
    """Whoever repeats an upload must not have executed what was in it."""
    sender, receiver = link()
    inner = CommandSender(KEY, SPI, SPACECRAFT, 10).wrap(b"later")
    outer = sender.wrap(inner)
    assert receiver.feed(outer) == [inner]
    assert receiver.feed(outer) == []
    assert receiver.rejected == {"replayed": 1}


def test_a_key_whose_counter_is_used_up_accepts_nothing():
    sender, receiver = link(counters={SPI: USED_UP})
    frames = [sender.wrap(b"one"), CommandSender(KEY, SPI, SPACECRAFT, USED_UP - 1).wrap(b"last")]
    assert receiver.feed(b"".join(frames)) == []
    assert receiver.rejected == {"closed": 2} and receiver.counters[SPI] == USED_UP


def test_judging_a_frame_moves_nothing():
    sender, receiver = link()
    frame = sender.wrap(b"one")[2:]
    assert receiver.judge(frame) == receiver.judge(frame) == ""
    assert receiver.judge(frame[:-1] + b"x") == "checksum"
    assert receiver.counters[SPI] == 0 and not receiver.rejected
    assert receiver.take(b"\xeb\x90" + frame) == [frame] and receiver.judge(frame) == "replayed"
    assert receiver.index_of(frame) == SPI


@given(st.integers(0, 200))
def test_a_copied_receiver_goes_on_as_the_first(at):
    sender, receiver = link()
    stream = b"".join(sender.wrap(bytes([number])) for number in range(4))
    first = receiver.feed(stream[:at])
    other = copy.deepcopy(receiver)
    assert first + receiver.feed(stream[at:]) == first + other.feed(stream[at:])
    assert vars(receiver) == vars(other)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: CommandSender(KEY[:31], 1, 1), "key: must have 32 bytes; received 31"),
        (lambda: CommandSender(KEY, 0, 1), "spi: must be from 1 to 65534; received 0"),
        (lambda: CommandReceiver({65535: KEY}, 1), "spi: must be from 1 to 65534; received 65535"),
        (lambda: CommandSender(KEY, 1, 1024), "spacecraft: must be from 0 to 1023; received 1024"),
        (lambda: CommandReceiver({1: KEY}, 1, window=0), "window: must be at least 1; received 0"),
        (lambda: CommandSender(KEY, 1, 1, -1).wrap(b""), "counter: .* received -1"),
        (lambda: CommandSender(KEY, 1, 1, 2**32 - 1).wrap(b""), "counter: .* received 4294967295"),
        (lambda: CommandSender(KEY, 1, 1).wrap(bytes(996)), "data: at most 995 .* received 996"),
    ],
)
def test_mistakes_are_named(make, message):
    with pytest.raises(ValueError, match=f"^{message}$"):
        make()


def test_the_longest_command_fits():
    sender, receiver = link()
    assert receiver.feed(sender.wrap(bytes(COMMAND_BYTES))) == [bytes(995)]
    with pytest.raises(ValueError, match="data: at most"):
        sender.wrap(bytes(COMMAND_BYTES + 1))
    assert sender.counter == 1, "what cannot be sent uses no number"


@pytest.mark.verifies("REQ-LNK-001")
def test_no_wrong_command_in_a_hundred_thousand_mutated_frames():
    watched = frame_attacks.attack(100_000, seed=1)
    assert watched.receiver.rejected.keys() == {
        *("length", "checksum", "spacecraft", "spi", "mac", "replayed")
    }
