"""Dictionaries of any fields, described in XTCE and DBC: read by others, and back."""

import pytest
from hypothesis import given, settings, strategies as st
from packet_cases import CHIBIS
from packet_strategies import any_fields

from torquer.flight.packets.codec import decoder, encoder
from torquer.flight.packets.dbc import dbc
from torquer.flight.packets.dictionary import Dictionary, Field, Packet, load_dictionary
from torquer.flight.packets.dictionary_text import dictionary_toml
from torquer.flight.packets.document import document
from torquer.flight.packets.frames import Downlink, Stream
from torquer.flight.packets.openmct import openmct
from torquer.flight.packets.segments import Splitter
from torquer.flight.packets.xtce import FRAME, xtce
from torquer.flight.packets.xtce_import import read_xtce

cantools = pytest.importorskip("cantools")
space_packet_parser = pytest.importorskip("space_packet_parser")
definitions = pytest.importorskip("space_packet_parser.xtce.definitions")
some = settings(max_examples=60, deadline=None)


def primary_header(apid, size, count=0):
    """A primary header by its bits."""
    text = f"{0:03b}{0:01b}{0:01b}{apid:011b}{3:02b}{count:014b}{size - 1:016b}"
    return int(text, 2).to_bytes(6, "big")


@st.composite
def dictionaries(draw, link="space_packets", **keys):
    """Dictionaries of telemetry with ids that the link has room for."""
    ids = st.integers(0, 2046) if link == "space_packets" else st.integers(1, 255)
    down = {}
    for number, each in enumerate(draw(st.sets(ids, min_size=1, max_size=3))):
        time = Field(name="t", type="u40", byte_order="big", scale=1.5, description="time")
        fields = (time, *draw(any_fields(**keys)))
        name = f"p{number}"
        down[name] = Packet(name=name, id=each, description="d", fields=fields, time_ms="t")
    return Dictionary(name="any", down=down)


@st.composite
def raws(draw, packet):
    """Data of a packet; what has labels has one of them."""
    values = list(decoder(packet)(draw(st.binary(min_size=packet.size, max_size=packet.size))))
    for k, (_, field, _) in enumerate(packet.numbers()):
        if field.labels and values[k] not in field.texts:
            values[k] = draw(st.sampled_from(list(field.texts)))
    return encoder(packet)(values)


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return tmp_path_factory.mktemp("described") / "satellite.xml"


@pytest.mark.parametrize("link", ["space_packets", "historical"])
@some
@given(data=st.data())
def test_xtce_of_any_dictionary_is_valid_and_read_back_the_same(file, link, data):
    dictionary = data.draw(dictionaries(link, whole_bytes=("little",)))
    file.write_text(xtce(dictionary, link), encoding="utf-8")
    assert space_packet_parser.validate_xtce(
        file, print_results=False, raise_on_error=False, allow_schema_download=False
    ).errors == []  # fmt: skip
    found = read_xtce(file)
    assert (found.dictionary, found.link, found.notes) == (dictionary, link, ())


@some
@given(data=st.data())
def test_xtce_reader_finds_the_values_of_space_packets(file, data):
    dictionary = data.draw(dictionaries(whole_bytes=("little",)))
    file.write_text(xtce(dictionary, "space_packets"), encoding="utf-8")
    reader = definitions.XtcePacketDefinition.from_xtce(file, root_container_name="space__packet")
    for packet in dictionary.down.values():
        raw = data.draw(raws(packet))
        read = reader.parse_bytes(primary_header(packet.id, packet.size) + raw)
        for (name, field, _), value in zip(packet.numbers(), decoder(packet)(raw), strict=True):
            theirs = read[f"{packet.name}__{name}"]
            if field.labels:
                assert (str(theirs), theirs.raw_value) == (field.texts[value], value)
            elif field.is_raw:
                assert theirs == value or (value != value and theirs != theirs), name
            else:
                least = max(abs(field.value(end)) for end in (field.kind.low, field.kind.high))
                assert theirs == pytest.approx(value, rel=1e-9, abs=1e-9 * least)


@some
@given(dictionary=dictionaries())
def test_file_of_any_dictionary_is_read_back_the_same(file, dictionary):
    path = file.with_suffix(".toml")
    path.write_text(dictionary_toml(dictionary), encoding="utf-8")
    assert load_dictionary(path) == dictionary
    assert Dictionary.model_validate_json(dictionary.model_dump_json()) == dictionary
    text = document(dictionary, "space_packets")
    points = [m for packet in openmct(dictionary)["packets"] for m in packet["measurements"]]
    for packet in dictionary.down.values():
        assert f"`{packet.name}`, id {packet.id}, {packet.size} bytes" in text
        assert [m["name"] for m in points if m["key"].startswith(f"{packet.name}.")] == list(
            packet.names
        )


def test_file_of_our_own_dictionary_is_read_back_the_same(tmp_path):
    path = tmp_path / "chibis.toml"
    path.write_text(dictionary_toml(CHIBIS), encoding="utf-8")
    assert load_dictionary(path) == CHIBIS


@some
@given(data=st.data())
def test_dbc_reader_finds_the_values_of_every_segment(data):
    orders = data.draw(st.sampled_from([("little",), ("big",), ("little", "big")]))
    dictionary = data.draw(dictionaries("historical", orders=orders))
    try:
        text = dbc(dictionary)
    except ValueError as error:
        fields = [field for packet in dictionary.down.values() for field in packet.fields]
        assert any(f.polynomial or f.type == "f16" or f.kind.bits % 8 for f in fields), error
        return
    database = cantools.database.load_string(text, "dbc", strict=True)
    splitter, make = Splitter(dictionary, "down"), Downlink(dictionary)
    for packet in dictionary.down.values():
        raw = data.draw(st.binary(min_size=packet.size, max_size=packet.size))
        frame = make.frame(packet.name, 1, decoder(packet)(raw))
        frame = frame[: -packet.size] + raw
        (ours,) = Stream(dictionary, "down").feed(frame)
        read = {}
        for identifier, part in splitter.frame(frame):
            read |= database.decode_message(identifier, part, decode_choices=False)
        for (name, field, _), value in zip(packet.numbers(), ours.values, strict=True):
            if field.type != "bytes":
                theirs = read[name]
                assert theirs == pytest.approx(value, rel=1e-12) or value != value, name
                assert not field.is_raw or theirs == value or value != value


def only(field, number=1, name="house"):
    packet = Packet(name=name, id=number, description="d", fields=(field,), time_ms="")
    return Dictionary(name="any", down={name: packet})


def test_what_a_description_cannot_state_gets_one_line_with_the_field():
    bent = Field(name="t", type="u8", polynomial=(1, 2, 3), description="x")
    with pytest.raises(ValueError, match=r"down\.house\.t: must have scale and offset for DBC"):
        dbc(only(bent))
    half = Field(name="t", type="f16", description="x")
    with pytest.raises(ValueError, match=r"down\.house\.t: must be f32 or f64 for DBC; .* f16"):
        dbc(only(half))
    with pytest.raises(ValueError, match=r"house: must have an id from 1 to 255, .*1025"):
        dbc(only(half, 1025))
    with pytest.raises(ValueError, match=r"down\.house\.id: must be 1 to 255 with link = 'hist"):
        xtce(only(half, 1025))
    little = Field(name="t", type="u4", count=2, description="x")
    with pytest.raises(ValueError, match=r"house\.t: must be big-endian for XTCE, or of whole"):
        xtce(only(little))
    long = Field(name="t", type="u9be", count=16, description="x")
    with pytest.raises(ValueError, match=r"house: must have numbers that begin at whole bytes"):
        dbc(only(long))


def test_polynomial_padding_and_labels_are_in_the_page():
    fields = (
        Field(name="t", type="u12be", polynomial=(1.5, -2, 0.25), description="temperature"),
        Field(name="", type="pad", count=4, byte_order="big", description="padding"),
        Field(name="n", type="i24le", scale=-0.5, offset=3, description="field"),
        Field(name="mode", type="u8be", labels={3: "SAFE", 9: "SUN"}, description="mode"),
        Field(name="m", type="u16be", description="m"),
    )
    packet = Packet(name="house", id=1, description="d", fields=fields, time_ms="t")
    text = document(Dictionary(name="any", down={"house": packet}), "space_packets")
    assert "| 0 | `t` | u12 | 1.5 -2 r +0.25 r^2 |" in text
    assert "| 1 bit 4 |  | pad x 4 |" in text
    assert "| 2 | `n` | i24le | -0.5, +3 |" in text
    assert "mode (3 SAFE, 9 SUN)" in text and "Numbers are big-endian" in text
    assert "| 0 bit 5 | `apid` | u11 |" in text and "PUS-C" not in text


def test_numbers_that_follow_our_header_are_told_by_it(file):
    """A document of ours names its frame; the primary header has the name of its own."""
    assert f'name="{FRAME}"' in xtce(CHIBIS)
    file.write_text(xtce(CHIBIS), encoding="utf-8")
    found = read_xtce(file)
    assert found.dictionary.down == CHIBIS.down and found.link == "historical"
    assert found.notes == ("CommandMetaData: commands are left out",)
