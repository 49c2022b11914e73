"""Archives written as NetCDF and Parquet: the numbers of the archive, units, what was not known."""

import math
from contextlib import closing

import numpy as np
import pytest
import xarray as xr

from torquer.flight.packets.codec import decoder
from torquer.flight.packets.dictionary import Dictionary, Field, Packet, load_dictionary
from torquer.flight.packets.frames import Downlink, Stream
from torquer.ground import export
from torquer.ground.archive import EPOCH_MS, UNCHECKED, Archive, ArchiveError, RowMaker
from torquer.ground.export import export_archive

CHIBIS = load_dictionary("chibis_m")
RATE = CHIBIS.down["extended"].names.index("omega_x")


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    path = tmp_path_factory.mktemp("archive") / "sat.sqlite"
    made, stream, rows = Downlink(CHIBIS), Stream(CHIBIS, "down"), RowMaker(CHIBIS)
    values = list(decoder(CHIBIS.down["extended"])(bytes(CHIBIS.down["extended"].size)))
    data = b""
    for number in range(500):
        values[RATE] = math.nan if number == 7 else number / 100.0
        values[-1] = 1000.0 * number
        data += made.frame("extended", number, values)
    data += made.frame("dump", 3, (1, 2, 2, b"\xfe\xff")) + made.frame("event", 4, (1, 32, 0, 1.0))
    data += made.frame("event", 5, (1, 32, math.nan, 2.0))
    with closing(Archive(path, CHIBIS)) as filled:
        filled.put(
            rows.row(frame, None if number % 2 else 5, UNCHECKED)
            for number, frame in enumerate(stream.feed(data))
        )
    return path


@pytest.fixture
def small_parts(monkeypatch):
    monkeypatch.setattr(export, "_PART", 64)


@pytest.mark.usefixtures("small_parts")
@pytest.mark.parametrize("format", ["netcdf", "parquet"])
def test_numbers_come_out_as_they_went_in(archive, tmp_path, format):
    files = dict(export_archive(archive, tmp_path, format))
    assert {path.stem: rows for path, rows in files.items()} == {
        "extended": 500,
        "event": 2,
        "dump": 1,
    }
    read = _netcdf if format == "netcdf" else _parquet
    extended = read(tmp_path, "extended")
    rates = np.array(extended["omega_x"], float)  # null is NaN
    expected = np.arange(500) / 100.0
    expected[7] = np.nan
    np.testing.assert_allclose(rates, expected, atol=6e-6)
    times = np.array((EPOCH_MS + 1000 * np.arange(500)), "datetime64[ms]")
    assert (np.array(extended["time"]).astype("datetime64[ms]") == times).all()
    received = np.array(extended["received"]).astype("datetime64[ms]")
    assert np.isnat(received).tolist() == [bool(n % 2) for n in range(500)]
    assert set(extended["quality"]) == {UNCHECKED}
    event = read(tmp_path, "event")["argument"]
    assert event[0] == 0 and (event[1] is None or math.isnan(event[1]))
    assert read(tmp_path, "dump")["data"][0] == "feff" + "00" * 62


def _netcdf(folder, packet):
    with xr.open_dataset(folder / f"{packet}.nc", engine="h5netcdf") as data:
        return {name: data[name].values for name in data.variables}


def _parquet(folder, packet):
    import pyarrow.parquet as pq

    table = pq.read_table(folder / f"{packet}.parquet")
    return {
        name: table[name].to_numpy() if name in ("time", "received") else table[name].to_pylist()
        for name in table.column_names
    }


def test_files_say_what_their_numbers_are(archive, tmp_path):
    import pyarrow.parquet as pq

    export_archive(archive, tmp_path)
    with xr.open_dataset(tmp_path / "extended.nc", engine="h5netcdf") as data:
        assert data.attrs["satellite"] == "Chibis-M"
        assert data.omega_x.attrs["units"] == "deg/s"
        assert data.aos_mode.attrs["flag_meanings"].startswith("OFF SDOT BDOT")
        assert data.quality.attrs["flag_meanings"] == "suspect unchecked authentic"
    export_archive(archive, tmp_path, "parquet")
    schema = pq.read_schema(tmp_path / "extended.parquet")
    assert schema.field("omega_x").metadata[b"units"] == b"deg/s"
    assert str(schema.field("time").type) == "timestamp[ms, tz=UTC]"


def test_an_interval_and_one_packet(archive, tmp_path):
    span = (EPOCH_MS + 10_000, EPOCH_MS + 19_999)
    assert export_archive(archive, tmp_path, "netcdf", ["extended"], *span) == [
        (tmp_path / "extended.nc", 10)
    ]
    assert export_archive(archive, tmp_path, "netcdf", ["beacon"]) == []
    with pytest.raises(ValueError, match=r"--packet: must be one of beacon, .*; received bacon"):
        export_archive(archive, tmp_path, "netcdf", ["bacon"])
    with pytest.raises(ArchiveError, match="archive: must be an archive"):
        export_archive(tmp_path / "none.sqlite", tmp_path)


def test_fields_with_the_names_of_our_columns(tmp_path):
    fields = tuple(Field(name=n, type="u8", description="d") for n in ("time", "quality"))
    packet = Packet(name="p", id=1, description="d", fields=fields)
    own = Dictionary(name="own", modules={"m": 1}, down={"p": packet})
    (frame,) = Stream(own, "down").feed(Downlink(own).frame("p", 9, (1, 2)))
    with closing(Archive(tmp_path / "sat.sqlite", own)) as archive:
        archive.put([RowMaker(own).row(frame, None, UNCHECKED)])
    export_archive(tmp_path / "sat.sqlite", tmp_path)
    found = _netcdf(tmp_path, "p")
    assert (found["time"], found["quality"], found["quality_of_frame"]) == ([1], [2], [UNCHECKED])


def _archive_of(folder, types, values):
    """An archive with one frame of a packet `p` with these fields."""
    fields = tuple(Field(name=n, type=t, description="d") for n, t in types.items())
    packet = Packet(name="p", id=1, description="d", fields=fields)
    own = Dictionary(name="own", modules={"m": 1}, down={"p": packet})
    (frame,) = Stream(own, "down").feed(Downlink(own).frame("p", 9, values))
    with closing(Archive(folder / "sat.sqlite", own)) as archive:
        archive.put([RowMaker(own).row(frame, None, UNCHECKED)])
    return folder / "sat.sqlite"


@pytest.mark.parametrize(
    ("names", "ending"),
    [
        (("time", "time_of_frame"), "_of_frame_2"),
        (("time_of_frame",), ""),
        (("status", "quality_of_frame", "received_of_frame_2", "frame"), "_of_frame_3"),
    ],
)
@pytest.mark.parametrize("format", ["netcdf", "parquet", "csv"])
def test_our_columns_have_names_that_no_field_has(tmp_path, names, ending, format):
    values = tuple(range(1, 1 + len(names)))
    path = _archive_of(tmp_path, dict.fromkeys(names, "u8"), values)
    assert export_archive(path, tmp_path, format)[0][1] == 1
    ours = [f"{name}{ending}" for name in ("time", "received", "quality", "status")]
    if format == "csv":
        head, row = (tmp_path / "p.csv").read_text(encoding="utf-8").splitlines()
        assert head.split(",") == [*ours, *names]
        assert row.split(",")[4:] == [*map(str, values)]
        return
    found = (_netcdf if format == "netcdf" else _parquet)(tmp_path, "p")
    assert set(found) == {*ours, *names}
    assert [found[name][0] for name in names] == [*values]
    assert found[ours[2]][0] == UNCHECKED


def test_in_parquet_large_whole_numbers_are_no_dates(tmp_path):
    import pyarrow.parquet as pq

    path = _archive_of(tmp_path, {"charge": "i64", "count": "u64"}, (-(2**62) - 1, 2**64 - 1))
    export_archive(path, tmp_path, "parquet")
    table = pq.read_table(tmp_path / "p.parquet")
    kinds = {field.name: str(field.type) for field in table.schema}
    assert kinds == {
        "time": "timestamp[ms, tz=UTC]",
        "received": "timestamp[ms, tz=UTC]",
        "quality": "uint8",
        "status": "uint8",
        "charge": "int64",
        "count": "uint64",
    }
    assert table["charge"].to_pylist() == [-(2**62) - 1]


def test_a_packet_that_is_asked_for_twice_is_written_once(archive, tmp_path):
    done = []
    files = export_archive(archive, tmp_path, "csv", ["event", "event"], progress=done.append)
    assert files == [(tmp_path / "event.csv", 2)] and done == [1.0]
