"""Files of a selection: the same columns as an export's, in pieces, by either time."""

import csv
import io
import math

import pytest
from made_archive import CHIBIS, archive_of, row

from torquer.base.explain import ScenarioError, validate_tables
from torquer.ground import selection as selections
from torquer.ground.export import export_archive
from torquer.ground.selection import Selected, check_selection, file_name, selection

EXTENDED = CHIBIS.down["extended"]
ROWS = 1000
VALUES = (1.5, None, math.inf, -math.inf)


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    """Rows of which two share each millisecond, received in the other order."""
    path = tmp_path_factory.mktemp("selection") / "sat.sqlite"
    return archive_of(path, [
        row("extended", k // 2, 10_000 - k // 4, 2, k, omega_x=VALUES[k % 4], aos_mode=1)
        for k in range(ROWS)
    ])  # fmt: skip


def pieces(archive, **asked):
    selected = validate_tables(Selected, asked)
    columns = check_selection(EXTENDED, selected)
    return selection(archive, "Chibis-M", EXTENDED, columns, selected)


def table(archive, **asked):
    """Lines of a CSV file."""
    return list(csv.reader(io.StringIO(b"".join(pieces(archive, **asked)).decode())))


@pytest.mark.parametrize("part", [7, 8192])
def test_a_selection_of_everything_is_the_exported_file(archive, tmp_path, monkeypatch, part):
    monkeypatch.setattr(selections, "_PART", part)
    ((path, rows),) = export_archive(archive, tmp_path, "csv")
    assert rows == ROWS
    assert b"".join(pieces(archive)) == path.read_bytes()


@pytest.mark.parametrize("part", [7, 8192])
def test_each_row_comes_once_in_the_order_of_the_time_asked_for(archive, monkeypatch, part):
    monkeypatch.setattr(selections, "_PART", part)
    head, *lines = table(archive, by="received", start=9800, end=9900, numbers="omega_x")
    assert head == ["time", "received", "quality", "status", "omega_x [deg/s]"]
    received = [line[1] for line in lines]
    assert received == sorted(received) and len(lines) == 4 * 101
    assert {line[4] for line in lines} == {"1.5", "", "inf", "-inf"}
    head, *lines = table(archive, start=10, end=19)
    assert [line[0][-4:-1] for line in lines] == [f"{k:03d}" for k in range(10, 20) for _ in "ab"]


def test_parquet_has_the_numbers_of_the_archive(archive, tmp_path, monkeypatch):
    parquet = pytest.importorskip("pyarrow.parquet")
    monkeypatch.setattr(selections, "_PART", 64)
    path = tmp_path / "sat.parquet"
    path.write_bytes(b"".join(pieces(archive, format="parquet", numbers="omega_x,aos_mode")))
    found = parquet.read_table(path)
    assert found.column_names == ["time", "received", "quality", "status", "aos_mode", "omega_x"]
    assert found["omega_x"].to_pylist()[:4] == [*VALUES]
    assert found.schema.metadata[b"satellite"] == b"Chibis-M" and len(found) == ROWS


def test_nothing_selected_is_a_file_with_a_head(archive):
    assert len(table(archive, start=5000, end=6000)) == 1
    with pytest.raises(StopIteration):
        files = pieces(archive, start=5000, end=6000)
        next(files), next(files)


def test_a_slow_reader_holds_no_more_than_a_part(archive, monkeypatch):
    monkeypatch.setattr(selections, "_PART", 10)
    slow = pieces(archive)
    head, first = next(slow), next(slow)
    assert head.startswith(b"time,") and first.count(b"\n") == 10


@pytest.mark.parametrize(
    ("asked", "problem"),
    [
        ({"start": 5, "end": 4}, "end: must not be before start; received 4"),
        ({"numbers": "omega_x,x;y"}, "numbers: must be of packet extended; received 'x;y'"),
        ({"numbers": '_digest"'}, "numbers: must be of packet extended"),
    ],
)
def test_wrong_selections_get_one_line(archive, asked, problem):
    with pytest.raises(ScenarioError, match="^" + problem[:40].replace("'", ".")) as error:
        pieces(archive, **asked)
    assert problem in str(error.value)


def test_parquet_is_refused_where_it_cannot_be_written(archive, monkeypatch):
    monkeypatch.setattr(selections, "has_parquet", lambda: False)
    with pytest.raises(ScenarioError, match="format: must be csv where pyarrow is missing"):
        pieces(archive, format="parquet")


def test_names_of_files_are_safe():
    whole, part = Selected(), Selected(start=0, end=86_400_000, format="parquet")
    assert file_name("sat", EXTENDED, whole) == "sat_extended.csv"
    name = "sat_extended_19700101T000000Z_19700102T000000Z.parquet"
    assert file_name("sat", EXTENDED, part) == name
