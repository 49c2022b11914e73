"""What is generated from the dictionary, read by others: XTCE, DBC, Open MCT."""

import json
import struct

import numpy as np
import pytest
from packet_cases import CHIBIS, SATELLITE, some_bytes

from torquer.flight.packets.codec import decoder
from torquer.flight.packets.dbc import dbc
from torquer.flight.packets.document import document
from torquer.flight.packets.frames import HEADER_BYTES, Downlink, Stream, Uplink
from torquer.flight.packets.openmct import openmct
from torquer.flight.packets.segments import Splitter
from torquer.flight.packets.xtce import FRAME, TIME_STAMP, xtce

cantools = pytest.importorskip("cantools")
space_packet_parser = pytest.importorskip("space_packet_parser")
etree = pytest.importorskip("lxml.etree")
definitions = pytest.importorskip("space_packet_parser.xtce.definitions")
XTCE = "{http://www.omg.org/spec/XTCE/20180204}"
DICTIONARIES = pytest.mark.parametrize("dictionary", [CHIBIS, SATELLITE], ids=["chibis", "odd"])


def values_of(packet, rng):
    return decoder(packet)(some_bytes(packet, rng))


def downlink(dictionary, rng, rounds):
    """Frames of all packets of telemetry."""
    make = Downlink(dictionary)
    return [
        make.frame(name, int(rng.integers(2**32)), values_of(packet, rng), int(rng.integers(3)))
        for _ in range(rounds)
        for name, packet in dictionary.down.items()
    ]


def uplink(dictionary, rng):
    make = Uplink(dictionary)
    return [
        make.frame(name, int(rng.integers(2**32)), values_of(packet, rng))
        for name, packet in dictionary.up.items()
    ]


@DICTIONARIES
def test_xtce_is_valid_by_its_schema(dictionary, tmp_path):
    file = tmp_path / "satellite.xml"
    file.write_text(xtce(dictionary), encoding="utf-8")
    assert validated(file).schema_location.startswith("https://www.omg.org/spec/XTCE/20180204/")
    assert validated(file).errors == []
    for old, new in (('sizeInBits="32"', 'sizeInBits="few"'), ("EntryList", "List")):
        file.write_text(xtce(dictionary).replace(old, new), encoding="utf-8")
        assert validated(file).errors != []


def validated(file):
    """What the schema says, which comes with the reader: nothing is downloaded."""
    return space_packet_parser.validate_xtce(
        file, print_results=False, raise_on_error=False, allow_schema_download=False
    )


@pytest.mark.verifies("REQ-PKT-004")
@DICTIONARIES
def test_xtce_reader_finds_the_same_values_in_a_whole_stream(dictionary, tmp_path):
    file = tmp_path / "satellite.xml"
    file.write_text(xtce(dictionary), encoding="utf-8")
    reader = definitions.XtcePacketDefinition.from_xtce(file, root_container_name=FRAME)
    data = b"".join(downlink(dictionary, np.random.default_rng(1), 10))
    ours = list(Stream(dictionary, "down").feed(data))
    at = 0
    for frame in ours:
        (length,) = struct.unpack_from("<H", data, at + 14)
        read = reader.parse_bytes(data[at : at + HEADER_BYTES + length])
        at += HEADER_BYTES + length
        assert (read["framesync"], read["time_stamp"]) == (0xAABBCCDD, frame.time_s)
        assert read["msg_status"].raw_value == frame.status
        assert str(read["msg_status"]) == ("INFO", "ALARM", "STOP")[frame.status]
        for (name, field, _), value in zip(frame.packet.numbers(), frame.values, strict=True):
            theirs = read[f"{frame.packet.name}__{name}"]
            if field.labels:
                assert (str(theirs), theirs.raw_value) == (field.labels[value], value)
            else:
                assert theirs == value, name
    assert at == len(data) and len(ours) == 10 * len(dictionary.down)


def encoded(root, name, arguments):
    """A command made by what the XTCE says alone: fixed parts, and arguments by their types."""
    types = {each.get("name"): each for each in root.iter(f"{XTCE}ArgumentTypeSet").__next__()}
    (meta,) = (each for each in root.iter(f"{XTCE}MetaCommand") if each.get("name") == name)
    refs = {a.get("name"): a.get("argumentTypeRef") for a in meta.iter(f"{XTCE}Argument")}
    data = b""
    for entry in meta.find(f"{XTCE}CommandContainer/{XTCE}EntryList"):
        if entry.tag == f"{XTCE}FixedValueEntry":
            data += bytes.fromhex(entry.get("binaryValue"))
            continue
        ref = entry.get("argumentRef")
        data += encoded_argument(types[refs[ref]], arguments[ref])
    return data


def encoded_argument(kind, value):
    encoding = next(each for each in kind if each.tag.endswith("DataEncoding"))
    if encoding.tag == f"{XTCE}BinaryDataEncoding":
        (size,) = encoding.iter(f"{XTCE}FixedValue")
        return value.ljust(int(size.text) // 8, b"\0")
    assert encoding.get("byteOrder") == "leastSignificantByteFirst"
    size = int(encoding.get("sizeInBits")) // 8
    if encoding.tag == f"{XTCE}FloatDataEncoding":
        return np.array(value, f"<f{size}").tobytes()
    for term in encoding.iter(f"{XTCE}Term"):
        value = (
            round(value / float(term.get("coefficient"))) if term.get("exponent") == "1" else value
        )
    return value.to_bytes(size, "little", signed=encoding.get("encoding") == "twosComplement")


@DICTIONARIES
def test_commands_made_by_the_xtce_alone_are_the_frames(dictionary):
    root = etree.fromstring(xtce(dictionary).encode())
    for frame in Stream(dictionary, "up").feed(
        b"".join(uplink(dictionary, np.random.default_rng(2)))
    ):
        arguments = dict(zip(frame.packet.names, frame.values, strict=True))
        made = encoded(root, frame.packet.name, {**arguments, TIME_STAMP: frame.time_s})
        assert made == frame.raw, frame.packet.name


@DICTIONARIES
def test_limits_units_and_signs_are_in_the_xtce(dictionary):
    root = etree.fromstring(xtce(dictionary).encode())
    kinds = {each.get("name"): each for each in root.iter() if each.get("name")}
    omega = kinds["extended__omega_type"]
    assert omega.findtext(f"{XTCE}UnitSet/{XTCE}Unit") == "deg/s"
    (warning,) = omega.iter(f"{XTCE}WarningRange")
    assert (warning.get("minInclusive"), warning.get("maxInclusive")) == ("-30.0", "30.0")
    signs = [kinds[f"event__{name}_type"].get("signed") for name in ("code", "argument")]
    assert signs == ["false", "true"]


@pytest.mark.verifies("REQ-PKT-004")
@pytest.mark.parametrize("direction", ["down", "up"])
@DICTIONARIES
def test_every_segment_is_read_by_its_dbc(dictionary, direction):
    database = cantools.database.load_string(dbc(dictionary), "dbc")
    rng = np.random.default_rng(3)
    frames = downlink(dictionary, rng, 5) if direction == "down" else uplink(dictionary, rng)
    splitter, seen = Splitter(dictionary, direction), set()
    for frame in Stream(dictionary, direction).feed(b"".join(frames)):
        read, first = {}, True
        for identifier, data in splitter.frame(frame.raw):
            message = database.get_message_by_frame_id(identifier)
            assert message.is_extended_frame and message.length == len(data)
            assert len(message.name) <= 32
            signals = database.decode_message(identifier, data, decode_choices=False)
            if first:
                code = signals["msg_status" if direction == "down" else "module_id"]
                assert (signals["time_stamp"], code) == (frame.time_s, frame.code)
            else:
                read |= {s.name: as_bytes(s, signals[s.name]) for s in message.signals}
            first = False
            seen.add(message.name)
        check_signals(frame, read)
    assert seen == {m.name for m in database.messages if m.name.startswith(f"{direction}_")}


def as_bytes(signal, value):
    """A part of a field of bytes as bytes; any other value as it is."""
    return value.to_bytes(signal.length // 8, "little") if "__" in signal.name else value


def check_signals(frame, read):
    """The signals of all segments, in order, are the values of the frame."""
    for (name, field, _), value in zip(frame.packet.numbers(), frame.values, strict=True):
        if field.type != "bytes":
            assert read.pop(name) == value, name
            continue
        parts = [key for key in read if key.rpartition("__")[0] == name]
        assert [key.rpartition("__")[2] for key in parts] == [str(k) for k in range(len(parts))]
        assert b"".join(read.pop(key) for key in parts) == value
    assert read == {}


def test_dbc_names_labels_units_and_ranges():
    database = cantools.database.load_string(dbc(CHIBIS), "dbc")
    beacon = database.get_message_by_name("down_beacon_1")
    reboots = beacon.get_signal_by_name("reboot_counter")
    assert (reboots.start, reboots.length, reboots.byte_order) == (40, 16, "little_endian")
    assert beacon.get_signal_by_name("stb_mode").choices[3] == "SCIENCE"
    assert beacon.senders == ["Satellite"]
    momentum = next(
        signal
        for message in database.messages
        for signal in message.signals
        if message.name.startswith("down_extended") and signal.name == "wheel_momentum_x"
    )
    assert (momentum.unit, momentum.minimum, momentum.scale) == ("N m s", -0.065536, 2e-6)


def test_open_mct_has_a_point_for_every_number():
    tree = json.loads(json.dumps(openmct(CHIBIS)))
    points = {m["key"]: m for packet in tree["packets"] for m in packet["measurements"]}
    assert len(points) == sum(len(packet.names) for packet in CHIBIS.down.values())
    value, time = points["beacon.stb_mode"]["values"]
    assert (value["format"], value["enumerations"][3]) == (
        "enum",
        {"value": 3, "string": "SCIENCE"},
    )
    assert (time["hints"], value["hints"]) == ({"domain": 1}, {"range": 1})
    assert points["extended.omega_x"]["values"][0]["unit"] == "deg/s"
    limits = {"WARNING": {"low": -30, "high": 30}, "CRITICAL": {"low": -60, "high": 60}}
    assert points["extended.omega_x"]["limits"] == limits
    assert points["dump.data"]["values"][0]["format"] == "string"
    assert points["event.argument"]["values"][0]["format"] == "integer"


def test_names_of_bits_are_in_every_description():
    isolated = ("magnetometer", "search_coil", "gyro")
    root = etree.fromstring(xtce(CHIBIS).encode())
    (kind,) = root.xpath("//*[@name='extended__isolated_type']")
    names = {each.get("name"): each.text for each in kind.iter(f"{XTCE}AncillaryData")}
    assert tuple(names[f"bit {place}"] for place in range(3)) == isolated
    database = cantools.database.load_string(dbc(CHIBIS), "dbc")
    signal = next(
        signal
        for message in database.messages
        for signal in message.signals
        if message.name.startswith("down_extended") and signal.name == "isolated"
    )
    assert {k: str(v) for k, v in signal.choices.items() if k < 5} == {
        0: "none", 1: "magnetometer", 2: "search_coil", 4: "gyro",
    }  # fmt: skip
    assert "bits: 0 magnetometer, 1 search_coil, 2 gyro" in signal.comment
    tree = openmct(CHIBIS)
    points = {m["key"]: m for packet in tree["packets"] for m in packet["measurements"]}
    value = points["extended.isolated"]["values"][0]
    assert (value["format"], tuple(value["bits"][:3])) == ("integer", isolated)
    assert "(bits: 0 magnetometer, 1 search_coil, 2 gyro" in document(CHIBIS)


def test_names_of_the_header_are_free_for_packets_and_fields():
    """A packet `frame` and fields called as those of the header."""
    fields = {name: CHIBIS.down["event"].fields[0].model_copy(update={"name": name})
              for name in ("time_stamp", "counter", "framesync")}  # fmt: skip
    packet = CHIBIS.up["hold"].model_copy(update={"name": "frame", "fields": (*fields.values(),)})
    both = {"down": {"frame": packet}, "up": {"frame": packet}}
    dictionary = CHIBIS.model_copy(update=both)
    root = etree.fromstring(xtce(dictionary).encode())
    for names in ("Parameter", "ParameterType", "Argument", "SequenceContainer"):
        found = [each.get("name") for each in root.iter(f"{XTCE}{names}")]
        assert len(set(found)) == len(found), names
    assert len(cantools.database.load_string(dbc(dictionary), "dbc").messages) == 4
