"""Text in hexadecimal and dumps: read as they were written, or the line that stopped it."""

import random

import pytest

from torquer.ground.recorded.hexadecimal import read_hex

DATA = random.Random(3).randbytes(200)


def rows(width=16):
    return [(at, DATA[at : at + width]) for at in range(0, len(DATA), width)]


def shown(data):
    return "".join(chr(byte) if 32 <= byte < 127 else "." for byte in data)


def canonical(text):
    """As `hexdump -C` writes it."""
    lines = []
    for at, data in rows():
        digits = f"{data[:8].hex(' ')}  {data[8:].hex(' ')}"
        lines.append(f"{at:08x}  {digits:<49}" + f" |{shown(data)}|" * text)
    return "\n".join([*lines, f"{len(DATA):08x}", ""])


def xxd(text, group=2):
    lines = (f"{at:08x}: {d.hex(' ', -group):<39}" + f"  {shown(d)}" * text for at, d in rows())
    return "\n".join(lines)


def od(offset):
    """As `od -A FORMAT -t x1` writes it."""
    return "\n".join([*(f"{at:{offset}} {d.hex(' ')}" for at, d in rows()), f"{200:{offset}}"])


@pytest.mark.parametrize("text", [False, True])
@pytest.mark.parametrize("dump", [canonical, xxd, lambda text: xxd(text, 1)])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_dumps_are_read_without_their_offsets_and_texts(dump, text, end):
    found = read_hex(dump(text).replace("\n", end).encode())
    assert (found.data, found.stopped) == (DATA, "") and "dump with offsets" in found.what


@pytest.mark.parametrize("offset", ["07o", "06x", "07d"])
def test_offsets_count_in_the_base_in_which_they_are_written(offset):
    assert read_hex(od(offset).encode()).data == DATA


def test_stars_of_a_dump_stand_for_the_line_before():
    head = DATA[:16].hex(" ")
    zeros = bytes(16).hex(" ")
    text = f"00000000  {head}\n00000010  {zeros}\n*\n00000050  {head}\n00000060\n"
    assert read_hex(text.encode()).data == DATA[:16] + bytes(64) + DATA[:16]


def test_text_of_a_dump_may_be_digits():
    data = b"abcdef0123456789" * 4
    lines = (f"{at:08x}: {data[at : at + 16].hex(' ', -2)}  {shown(data[:16])}" for at in (0, 16))
    assert read_hex("\n".join(lines).encode()).data == data[:32]


@pytest.mark.parametrize("data", [DATA.hex(), DATA.hex(" "), "\ufeff" + DATA.hex("\n")])
def test_digits_are_read_also_after_a_byte_order_mark(data):
    found = read_hex(data.encode())
    assert (found.data, found.what, found.stopped) == (DATA, "text in hexadecimal", "")


WORDS = "\n".join(f"{at:07x} {d.hex(' ', -2)}" for at, d in rows())


@pytest.mark.parametrize(
    ("text", "stopped"),
    [
        (DATA.hex()[:-1], "line 1 must end with a pair: there are 399 digits"),
        (DATA.hex() + "\n0\n" + DATA.hex(), "line 2 must end with a pair: .* received '0'"),
        ("# pass\n" + DATA.hex(), "line 1 must have digits in pairs, .*; received '# pass'"),
        (DATA.hex() + "\nend", "line 2 must have digits in pairs, .*; received 'end'"),
        (xxd(False).replace("00000030:", "00000038:"), "line 3 must have 24 bytes, as the next"),
        (canonical(True).replace("00000030", "0000003x"), "line 4 must begin with an offset"),
        (WORDS, "line 1 must begin with an offset, then have bytes one by one"),
    ],
)
def test_line_that_stops_a_text_is_named(text, stopped):
    found = read_hex(text.encode())
    assert found.data == b""
    with pytest.raises(ValueError, match=stopped):
        raise ValueError(found.stopped)


def test_other_text_and_bytes_are_none():
    for data in (b"This is a text about nothing.\n" * 5, DATA, b"00", b""):
        assert read_hex(data) is None
