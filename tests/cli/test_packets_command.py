"""`torquer packets` and `torquer ground import` with packets of another satellite."""

import json
import sqlite3
import struct
from pathlib import Path

import pytest

from torquer.flight.packets.dictionary import Dictionary, load_dictionary
from torquer.flight.packets.xtce import xtce

HEAD = 'name = "own"\n'
AOCS = (
    '[down.aocs]\nid = {id}\ndescription = "aocs"\nfields = [ {{ {field}, description = "g" }} ]\n'
)
#: A field each, and whether it can travel in the frames of a link with ids of one byte.
CASES = {
    "be": ('name = "gyro", type = "i16be", count = 3, scale = 0.01, unit = "deg/s"', 1),
    "i24": ('name = "mag", type = "i24", count = 3, unit = "nT"', 1),
    "neg": ('name = "mag_y", type = "i16", scale = -0.01, unit = "uT"', 1),
    "off": ('name = "temp", type = "u8", scale = 0.5, offset = -40, unit = "degC"', 1),
    "id1025": ('name = "mode", type = "u8"', 1025),
}


def software(folder, text, link="historical"):
    (folder / "packets.toml").write_text(text, encoding="utf-8")
    file = folder / "software.toml"
    file.write_text(f'name = "own"\ndictionary = "packets.toml"\nlink = "{link}"\n')
    return file


@pytest.mark.parametrize(("field", "number"), CASES.values(), ids=CASES)
def test_ground_needs_packets_only(call, tmp_path, field, number):
    """No modules, any field: the recording is read, or a line says what is not possible."""
    file = software(tmp_path, HEAD + AOCS.format(id=number, field=field))
    recording = tmp_path / "pass.bin"
    size = load_dictionary(tmp_path / "packets.toml").down["aocs"].size
    header = struct.pack("<IIBBIH", 0xAABBCCDD, 9, number & 0xFF, 0, 0, size)
    recording.write_bytes(header + bytes(range(1, size + 1)))
    asked = ("ground", "import", recording, "--software", file, "--folder", tmp_path / "archive")
    code, out, err = call(*asked)
    if number > 255:
        assert code == 2 and out == "" and err.count("\n") == 1
        assert "down.aocs.id: must be 1 to 255 with link = 'historical'" in err
        return
    assert (code, err) == (0, "") and "frames 1, new 1, lost bytes 0" in out
    code, out, _ = call("packets", file, "--out", tmp_path / "made")
    assert code == 0 and f"down   1  aocs                   {size} bytes" in out
    assert "packets.xml (XTCE), packets.dbc, packets.json (Open MCT), packets.md" in out


OTHER = """name = "other"
byte_order = "big"
unknown = "none"
[down.house]
id = 1025
description = "housekeeping"
time_ms = "time"
fields = [
  { name = "time", type = "u48", scale = 0.0152587890625, offset = -315619200000.0, unit = "ms", description = "time of 2000" },
  { name = "mode", type = "u3", labels = { 1 = "SAFE", 5 = "SUN" }, description = "mode" },
  { type = "pad", count = 1 },
  { name = "b", type = "i12", count = 3, scale = -0.5, unit = "uT", description = "field" },
  { name = "serial", type = "u64", description = "number" },
  { name = "volt", type = "u8", polynomial = [1, 0.5, 0.25], unit = "V", description = "bus" },
]
"""  # noqa: E501


def house(seconds, mode, b, serial, volt, count=0):
    """A packet, by its bits."""
    bits = format(mode, "03b") + "0" + "".join(format(each % 2**12, "012b") for each in b)
    data = (seconds << 16).to_bytes(6, "big") + int(bits, 2).to_bytes(5, "big")
    data += serial.to_bytes(8, "big") + bytes([volt])
    return struct.pack(">HHH", 1025, 0xC000 | count, len(data) - 1) + data


@pytest.mark.parametrize("format", ["netcdf", "parquet"])
def test_space_packets_of_another_satellite_reach_archive_and_files(call, tmp_path, format):
    file = software(tmp_path, OTHER, "space_packets")
    recording = tmp_path / "pass.bin"
    start = 315619200  # 2010
    frames = [house(start + k, 5 * k, (-2048, k, 5), 2**64 - 1 - k, k, k) for k in range(2)]
    recording.write_bytes(b"".join(frames) * 2)
    folder = tmp_path / "archive"
    code, out, _ = call("ground", "import", recording, "--software", file, "--folder", folder)
    assert code == 0 and "frames 4, new 2, lost bytes 0" in out
    with sqlite3.connect(folder / "satellite.sqlite") as db:
        rows = db.execute("SELECT time, mode, b_x, b_y, serial, volt FROM house ORDER BY time")
        assert rows.fetchall() == [
            (0.0, 0, 1024.0, 0.0, str(2**64 - 1), 1.0),
            (1000.0, 5, 1024.0, -0.5, str(2**64 - 2), 1.75),
        ]
        ((text,),) = db.execute("SELECT value FROM _about WHERE key = 'dictionary'")
    db.close()
    assert Dictionary.model_validate_json(text) == load_dictionary(tmp_path / "packets.toml")
    made = tmp_path / "files"
    asked = ("ground", "export", folder / "satellite.sqlite", "--out", made, "--format", format)
    assert call(*asked)[0] == 0
    assert serials(made, format) == [2**64 - 1, 2**64 - 2]


def serials(folder, format):
    if format == "netcdf":
        import xarray as xr

        with xr.open_dataset(folder / "house.nc") as data:
            assert data["mode"].attrs["flag_values"].tolist() == [1, 5]
            return data["serial"].values.tolist()
    import pyarrow.parquet as pq

    return pq.read_table(folder / "house.parquet")["serial"].to_pylist()


def test_recording_of_another_satellite_needs_another_name(call, tmp_path):
    folder, recording = tmp_path / "archive", tmp_path / "pass.bin"
    recording.write_bytes(house(315619200, 1, (0, 0, 0), 7, 0))
    asked = ("ground", "import", recording, "--folder", folder, "--software")
    assert call(*asked, software(tmp_path, OTHER, "space_packets"))[0] == 0
    other = software(tmp_path, OTHER.replace("house", "home"), "space_packets")
    code, out, err = call(*asked, other)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert (
        "with rows of house, which it lacks: give another satellite another name by --satellite"
        in err
    )
    assert call(*asked, other, "--satellite", "other")[0] == 0


def test_numbers_before_2010_and_lowest_ones_are_kept(call, tmp_path):
    file = software(tmp_path, OTHER, "space_packets")
    (tmp_path / "pass.bin").write_bytes(house(0, 1, (0, 0, 0), 7, 0))
    folder = tmp_path / "archive"
    asked = ("ground", "import", tmp_path / "pass.bin", "--software", file, "--folder", folder)
    assert call(*asked)[0] == 0
    with sqlite3.connect(folder / "satellite.sqlite") as db:
        assert db.execute("SELECT _time_ms, serial FROM house").fetchall() == [(946684800000, 7)]
    db.close()


def test_description_that_cannot_be_is_told_and_the_others_are_written(call, tmp_path):
    file = software(tmp_path, OTHER, "space_packets")
    code, out, err = call("packets", file, "--out", tmp_path / "made")
    assert code == 0 and {path.name for path in (tmp_path / "made").iterdir()} == {
        "packets.xml", "packets.json", "packets.md",
    }  # fmt: skip
    assert "packets.dbc is not written: house: must have an id from 1 to 255, as identifiers" in err
    assert "packets.dbc" not in out


def test_xtce_becomes_a_dictionary_and_says_by_which_link(call, tmp_path):
    software(tmp_path, OTHER)
    dictionary = load_dictionary(tmp_path / "packets.toml")
    (tmp_path / "other.xml").write_text(xtce(dictionary, "space_packets"), encoding="utf-8")
    out = tmp_path / "new" / "dictionary.toml"
    code, text, err = call("packets", "import", tmp_path / "other.xml", "--out", out)
    assert (code, err) == (0, "") and 'link = "space_packets"' in text
    assert "down 1025  house" in text
    assert load_dictionary(out) == dictionary
    code, text, _ = call("packets", "import", tmp_path / "other.xml", "--out", out, "--json")
    assert json.loads(text) == {
        "file": str(out), "link": "space_packets",
        "packets": [{"name": "house", "id": 1025, "bytes": 20}],
    }  # fmt: skip
    code, _, err = call("packets", "import", tmp_path / "other.xml", "--packet", "none")
    assert code == 2 and err.count("\n") == 1
    assert "other.xml: packet: must be one of space__packet, house; received none" in err
    code, _, err = call("packets", "import", tmp_path / "no.xml", "--out", out)
    assert code == 2 and "FILE: must be readable; received" in err


def test_software_that_flies_needs_frames_of_its_own(call, tmp_path):
    file = software(tmp_path, OTHER, "space_packets")
    code, _, err = call("fly", Path("examples/chibis_m_day.toml"), "--software", file)
    assert code == 2 and "link: must be historical, protected or pus for software that flies" in err


def test_commands_are_refused_where_packets_are_read_only(call, tmp_path):
    command = (
        '[modules]\nobc = 1\n[up.go]\nid = 1\nmodule = "obc"\ndescription = "d"\nfields = []\n'
    )
    file = software(tmp_path, OTHER + command, "space_packets")
    code, _, err = call("packets", file)
    assert code == 2 and "up: must be left out with link = 'space_packets'" in err
