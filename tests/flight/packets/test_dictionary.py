"""The dictionary's file: what it gives, and one line for each mistake."""

import copy

import pytest
from packet_cases import CHIBIS

from torquer.computer.interface import SENSORS
from torquer.flight.packets.dictionary import (
    Dictionary,
    DictionaryError,
    load_dictionary,
)
from torquer.flight.packets.fields import MOST_BYTES
from torquer.flight.packets.frames import HEADER_BYTES

#: Bytes of a CCSDS telecommand frame.
TC_FRAME = 1024
HEAD = 'name = "Cube"\nmodules = { obc = 1 }\n'
FIELD = '{ name = "a", type = "u8", description = "x" }'
OTHER = FIELD.replace('"a"', '"a_x"')
LONG = '{ name = "b", type = "bytes", count = 65535, description = "x" }'


def packet(fields, name="down.house", number=1, more=""):
    return f'[{name}]\nid = {number}\ndescription = "d"\nfields = [{fields}]\n{more}\n'


def changed(old, new):
    assert old in FIELD
    return HEAD + packet(FIELD.replace(old, new))


def load(tmp_path, text, *extra):
    files = []
    for number, each in enumerate((text, *extra)):
        files.append(tmp_path / f"file{number}.toml")
        files[-1].write_text(each, encoding="utf-8")
    return load_dictionary(files[0], files[1:])


def test_chibis_has_the_packets_of_the_source():
    assert CHIBIS.down["beacon"].size == 8
    assert CHIBIS.down["beacon"].names[5] == "reboot_counter"
    assert [at for name, _, at in CHIBIS.down["beacon"].numbers() if name == "reboot_counter"] == [
        5
    ]
    assert {name: packet.id for name, packet in CHIBIS.down.items()} == {
        "beacon": 1, "extended": 2, "acknowledgement": 3, "event": 4, "parameter": 5,
        "module_status": 6, "queues": 7, "ready": 8, "stored": 9, "dump": 10, "devices": 11,
        "settings": 12, "modes": 13, "housekeeping": 14, "wheels": 15, "reading": 16, "plan": 20,
        "calibration": 21, "periods": 22, "models": 23,
    }  # fmt: skip
    assert CHIBIS.down["stored"].fields == CHIBIS.down["extended"].fields
    assert all(packet.names[0] == "acknowledge" for packet in CHIBIS.up.values())
    assert {packet.module for packet in CHIBIS.up.values()} <= CHIBIS.modules.keys()
    assert copy.deepcopy(CHIBIS) is CHIBIS


def test_the_longest_packet_fits_a_protected_telecommand_frame():
    assert MOST_BYTES + HEADER_BYTES + 48 <= TC_FRAME  # header, security header, MAC, CRC


def test_names_of_several_numbers(tmp_path):
    fields = '{ name = "v", type = "f32", count = 3, description = "x" },' + (
        '{ name = "q", type = "i8", count = 4, description = "x" },'
        '{ name = "t", type = "bytes", count = 3, description = "x" }'
    )
    house = load(tmp_path, HEAD + packet(fields)).down["house"]
    assert house.names == ("v_x", "v_y", "v_z", "q_0", "q_1", "q_2", "q_3", "t")
    assert (house.size, house.format) == (19, "<fffbbbb3s")


def test_further_files_add_modules_labels_and_packets(tmp_path):
    more = (
        '[modules]\nlamp = 9\n[labels]\ncolour = ["RED", "BLUE"]\n'
        + packet(FIELD.replace('"u8"', '"u8", labels = "colour"'), "down.lamp", 2)
        + packet(FIELD, "up.blink", 16, 'module = "lamp"')
        + packet(FIELD, "up.wake", 17, 'module = "obc"')
    )
    found = load(tmp_path, HEAD + packet(FIELD), more)
    assert list(found.down) == ["house", "lamp"]
    assert found.down["lamp"].fields[0].labels == ("RED", "BLUE")
    assert found.up["blink"].names == ("acknowledge", "a")
    assert found.modules == {"obc": 1, "lamp": 9}
    same = load(tmp_path, HEAD + packet(FIELD), '[down.twin]\nid = 3\ndescription = "d"\n'
                'fields = "house"')  # fmt: skip
    assert same.down["twin"].fields == same.down["house"].fields


def test_bits_are_named_by_a_list_by_a_table_or_by_the_kinds_of_devices(tmp_path):
    def bits_of(bits, more="", kind="u16"):
        field = FIELD.replace('"u8"', f'"{kind}", bits = {bits}')
        return load(tmp_path, HEAD + packet(field) + more).down["house"].fields[0].bits

    assert bits_of('["heater", "lamp"]', kind="u8") == ("heater", "lamp")
    assert bits_of('"parts"', '[labels]\nparts = ["heater"]') == ("heater",)
    assert bits_of('"sensors"') == SENSORS
    assert bits_of('"sensors"', '[labels]\nsensors = ["mine"]') == ("mine",)
    assert CHIBIS.down["extended"].fields[5].bits == SENSORS
    assert Dictionary.model_validate_json(CHIBIS.model_dump_json()) == CHIBIS


MISTAKES = {
    "type": (
        changed('"u8"', '"u65"'),
        r"down\.house\.fields\[0\]\.type: must be u1 to u64, i2 to i64, f16, .*received 'u65'",
    ),
    "no type": (changed(', type = "u8"', ""), r"fields\[0\]\.type: must be given; .* nothing"),
    "key": (changed("type", "typ = 1, type"), r"fields\[0\]\.typ: must be a known key; received 1"),
    "name": (changed('"a"', '"A b"'), r"fields\[0\]\.name: must be words of .*; received 'A b'"),
    "long name": (changed('"a"', f'"{"a" * 24}"'), r"\.name: must be words.* 23 characters"),
    "text": (changed('"x"', '""'), r"\[0\]\.description: must not be empty; received ''"),
    "lines": (changed('"x"', r'"x\ny"'), r"description: must be one line without"),
    "quotes": (changed('"x"', "'a \"b\"'"), r"description: must be one line without"),
    "no text": (changed('"x"', "1"), r"description: must be text; received 1"),
    "scale": (changed('"u8"', '"u8", scale = 0'), r"scale: must not be 0, .*; received 0"),
    "scale f": (changed('"u8"', '"f32", scale = 2'), r"scale: must be 1 for the type f32"),
    "count": (changed('"u8"', '"u8", count = 0'), r"count: must be greater than or equal to 1"),
    "truth": (changed('"u8"', '"u8", count = true'), r"count: must be a whole number; .* True"),
    "limits": (
        changed('"u8"', '"u8", limits = [3, 1]'),
        r"\[0\]\.limits: must be \[least, greatest\]; received \[3\.0, 1\.0\]",
    ),
    "three limits": (
        changed('"u8"', '"u8", limits = [1, 2, 3]'),
        r"fields\[0\]\.limits: must be two numbers; received \[1, 2, 3\]",
    ),
    "one limit": (
        changed('"u8"', '"u8", limits = [1]'),
        r"fields\[0\]\.limits: must be two numbers; received \[1\]",
    ),
    "label": (
        changed('"u8"', '"u8", labels = "mode"') + '[labels]\nmodes = ["A"]',
        r"fields\[0\]\.labels: must be a list or a name in \[labels\]; received 'mode' .*modes\?",
    ),
    "labels": (
        changed('"u8"', '"f32", labels = ["A"]'),
        r"labels: must belong to a whole type without scale, offset and .*; received type f32, sc",
    ),
    "same": (changed('"u8"', '"u8", labels = ["A", "A"]'), r"labels: must differ from each other"),
    "no labels": (changed('"u8"', '"u8", labels = 5'), r"labels: must be a list or a table; .* 5"),
    "keys": (
        changed('"u8"', '"u8", labels = { a = "A" }'),
        r"fields\[0\]\.labels: must have whole numbers for keys; received {'a': 'A'}",
    ),
    "order of all": (
        "byte_order = 'be'\n" + changed('"u8"', '"u8"'),
        r"byte_order: must be 'little' or 'big'; received 'be'",
    ),
    "order of a packet": (
        HEAD + packet(FIELD, more="unknown = 5"),
        r"down\.house\.unknown: must be 'lowest' or 'none'; received 5",
    ),
    "many": (
        changed('"u8"', f'"u8", labels = {[str(k) for k in range(257)]}'),
        r"labels: must be at most 256 for the type u8; received 257",
    ),
    "bits": (
        changed('"u8"', '"u8", bits = "sensor"'),
        r"fields\[0\]\.bits: must be a list or a name in \[labels\]; received 'sensor' .*sensors\?",
    ),
    "signed bits": (
        changed('"u8"', '"i8", bits = ["A"]'),
        r"bits: must belong to an unsigned type without scale, .*; received type i8, scale 1",
    ),
    "scaled bits": (
        changed('"u8"', '"u8", scale = 2, bits = ["A"]'),
        r"bits: must belong to an unsigned type without scale, .*; received type u8, scale 2",
    ),
    "same bits": (changed('"u8"', '"u8", bits = ["A", "A"]'), r"bits: must differ from each other"),
    "empty bit": (changed('"u8"', '"u8", bits = ["A", ""]'), r"bits\[1\]: must not be empty"),
    "comma": (
        changed('"u8"', '"u8", bits = ["A, B"]'),
        r"bits: must have no commas, and not be numbers; received 'A, B'",
    ),
    "number": (changed('"u8"', '"u8", bits = ["7"]'), r"bits: must have no commas, .* '7'"),
    "many bits": (
        changed('"u8"', '"u8", bits = "sensors"'),
        r"bits: must be at most 8 for the type u8; received 11",
    ),
    "both": (
        changed('"u8"', '"u8", bits = ["A"], labels = ["B"]'),
        r"bits: must be left out with labels; received both",
    ),
    "twice": (
        HEAD + packet(f"{FIELD}, {FIELD}"),
        r"down\.house\.fields: names must differ; received a twice",
    ),
    "hidden": (
        HEAD + packet(f"{OTHER}, {FIELD.replace(',', ', count = 3,', 1)}"),
        r"fields: names must differ; received a_x twice",
    ),
    "long": (
        HEAD + packet(f"{FIELD}, {LONG}"),
        r"fields: must have 1 to 65535 bytes; received 65536",
    ),
    "empty": (HEAD + packet(""), r"fields: must have 1 to 65535 bytes; received 0"),
    "numbers": (
        HEAD + packet('{ name = "b", type = "u8", count = 1900, description = "x" },' + FIELD),
        r"fields: must have at most 1900 numbers; received 1901",
    ),
    "id": (HEAD + packet(FIELD, number=65536), r"house\.id: must be less than or equal to 65535"),
    "taken": (
        HEAD + packet(FIELD) + packet(FIELD, "down.other"),
        r"down\.other\.id: must be free; received 1, the id of house",
    ),
    "modules": (
        HEAD.replace("obc = 1", "obc = 1, tm = 1") + packet(FIELD),
        r"modules\.tm: must be free; received 1, the id of obc",
    ),
    "module": (
        HEAD + packet(FIELD, "up.go", 16, 'module = "adcs"'),
        r"up\.go\.module: must be one of obc; received 'adcs'",
    ),
    "no module": (
        HEAD + packet(FIELD, "up.go", 16),
        r"up\.go\.module: must be one of obc; received nothing",
    ),
    "of telemetry": (
        HEAD + packet(FIELD, more='module = "obc"'),
        r"down\.house\.module: must not be given for telemetry",
    ),
    "own name": (HEAD + packet(FIELD, more='name = "b"'), r"down\.house\.name: must not be given"),
    "command": (
        HEAD + packet(FIELD.replace("u8", "u7x"), "up.go", 16, 'module = "obc"'),
        r"up\.go\.fields\[0\]\.type: must be u1 to u64, i2 to i64, .*received 'u7x'",
    ),
    "other": (
        HEAD + '[down.a]\nid = 1\ndescription = "d"\nfields = "b"',
        r"down\.a\.fields: must be a list, or the name of a packet above it; received 'b'",
    ),
    "row": (HEAD + packet("1"), r"down\.house\.fields\[0\]: must be a table of keys; received 1"),
    "table": (HEAD + "down = 3", r"down: must be a table of keys; received 3"),
    "packet": (HEAD + "[down]\nhouse = 3", r"down\.house: must be a table of keys; received 3"),
    "top": (HEAD + "downs = 3", r"downs: must be a known key; received 3"),
    "empty polynomial": (
        HEAD + packet(FIELD.replace('type = "u8"', 'type = "u8", polynomial = []')),
        r"down\.house\.fields\[0\]\.polynomial: must have 3 to 12 coefficients, or be left out; "
        r"received \[\]",
    ),
    "labels twice": (
        HEAD + packet(FIELD.replace('type = "u8"', 'type = "u8", labels = { 1 = "A", 01 = "B" }')),
        r"down\.house\.fields\[0\]\.labels: must have the key 1 once, however it is written",
    ),
    "toml": ("name = ", r"must be TOML; received: Invalid value"),
    "deep": ("a." * 40 + "a = 1", r"must have at most 32 levels of tables"),
    "nested": ("a = " + "[" * 9000, r"must have at most 32 levels of tables"),
    "digits": ("a = " + "9" * 5000, r"must be TOML; received: Exceeds the limit"),
    "command of none": (
        HEAD.replace("obc = 1", "") + packet(FIELD, "up.go", 16, 'module = "obc"'),
        r"up\.go\.module: must be one of the table \[modules\], which is empty; received 'obc'",
    ),
    "no name": ("modules = { a = 1 }", r"name: must be given; received nothing"),
}  # fmt: skip


@pytest.mark.parametrize(("text", "message"), MISTAKES.values(), ids=MISTAKES)
def test_mistake_is_one_line_with_file_and_key(tmp_path, text, message):
    with pytest.raises(DictionaryError, match=rf"\Afile0\.toml: .*{message}") as error:
        load(tmp_path, text)
    assert len(str(error.value).splitlines()) == 1


@pytest.mark.parametrize(
    ("extra", "message"),
    [
        (packet(FIELD, number=2), r"down\.house: must be a free name; received one in use"),
        (packet(FIELD, "down.b"), r"down\.b\.id: must be free; received 1, the id of house"),
        ("modules = { tm = 1 }", r"modules\.tm: must be free; received 1, the id of obc"),
        ('name = "b"', r"name: must not be in a file that adds packets"),
    ],
)
def test_mistake_in_a_further_file_names_that_file(tmp_path, extra, message):
    with pytest.raises(DictionaryError, match=rf"\Afile1\.toml: {message}"):
        load(tmp_path, HEAD + packet(FIELD), extra)


def test_file_that_is_not_there(tmp_path):
    with pytest.raises(DictionaryError, match=r"\Aa\.toml: must be a readable file or one of .*No"):
        load_dictionary(tmp_path / "a.toml")
    with pytest.raises(DictionaryError, match=r"\Achibis: must be .* or one of chibis_m; received"):
        load_dictionary("chibis")
