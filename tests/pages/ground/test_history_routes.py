"""Routes of the past: files of a selection, an instant, gaps, and what strangers ask of them."""

import csv
import http.client
import io
import json
import shutil

import pytest
from ground_flight import serving, table
from made_archive import archive_of, row

pytest.importorskip("uvicorn")

from torquer.flight.link import open_link
from torquer.ground import archive, history, selection
from torquer.ground.archive import ArchiveError

SOFTWARE = 'name = "Chibis-M"\ndictionary = "chibis_m"\nlink = "historical"\n'
ROWS = 20_000


@pytest.fixture(scope="module")
def client(tmp_path_factory):
    """A ground with an archive, a gap in it, and a link on which nobody answers."""
    folder = tmp_path_factory.mktemp("ground")
    (folder / "software.toml").write_text(SOFTWARE)
    kept = [k for k in range(ROWS) if not 100 <= k < 150]
    archive_of(
        folder / "sat.sqlite",
        [row("extended", 1000 * k, 10**9 + 1000 * k, omega_x=k / 8) for k in kept],
    )
    link = open_link("tcp:127.0.0.1:0")
    try:
        with serving(folder, sat=table(link.address, folder / "software.toml", None)) as made:
            made.folder = folder
            yield made
    finally:
        link.close()


def lines(body):
    return list(csv.reader(io.StringIO(body.decode())))


def test_a_selection_comes_as_a_file(client):
    asked = "numbers=omega_x&start=1000&end=3000"
    status, body, headers = client.raw(f"/api/sat/export/extended?{asked}")
    assert status == 200 and headers["content-type"].startswith("text/csv")
    name = "sat_extended_19700101T000001Z_19700101T000003Z.csv"
    assert headers["content-disposition"] == f'attachment; filename="{name}"'
    head, *rows = lines(body)
    assert head[-1] == "omega_x [deg/s]" and [r[-1] for r in rows] == ["0.125", "0.25", "0.375"]
    _, body, _ = client.raw(f"/api/sat/export/extended?by=received&start={10**9 + 5000}")
    assert len(lines(body)) == ROWS - 50 - 5 + 1


def test_parquet_is_offered_where_it_can_be_written(client):
    parquet = pytest.importorskip("pyarrow.parquet")
    assert client.raw("/api/formats")[1] == b'["csv","parquet"]'
    _, body, headers = client.raw("/api/sat/export/extended?format=parquet")
    assert headers["content-disposition"].endswith('.parquet"')
    found = parquet.read_table(io.BytesIO(body))
    assert len(found) == ROWS - 50 and found["omega_x"][8].as_py() == 1.0


def test_what_was_known_at_an_instant(client):
    found = client.get("sat/past?time=10400")
    (extended,) = found["packets"]
    assert (extended["values"]["omega_x"], extended["age_ms"]) == (1.25, 400)
    assert found["state"]["omega"] == "1.25 unknown unknown deg/s"
    assert client.get("sat/past?time=10400&by=received")["packets"] == []


def test_gaps_are_listed_and_their_record_is_ordered(client):
    found = client.get("sat/gaps")
    (gap,) = found["gaps"]
    assert found["can_fill"] and (gap["start_ms"], gap["missing"]) == (99_000, 50)
    body = json.dumps({"start": 1262304000000, "end": 1262304005000}).encode()
    status, answer, _ = client.raw("/api/sat/gaps", body)
    sent = json.loads(answer)
    assert (status, sent["command"], sent["state"]) == (200, "replay", "waiting")
    assert sent["values"] == {"from_s": 0, "to_s": 5, "every": 1}


@pytest.mark.parametrize(
    ("path", "status", "text"),
    [
        ("sat/export/nothing", 404, "there is no such thing"),
        ("sat/export/_commands", 404, "there is no such thing"),
        ("nobody/export/extended", 404, "there is no such thing"),
        ("nobody/past?time=0", 404, "there is no such thing"),
        ("nobody/gaps", 404, "there is no such thing"),
        ("sat/export/extended?numbers=_digest", 400, "numbers: must be of packet extended"),
        ("sat/export/extended?numbers=7", 400, "numbers: must be of packet extended"),
        ("sat/export/extended?format=xml", 400, "format: "),
        ("sat/export/extended?by=_quality", 400, "by: "),
        ("sat/export/extended?start=" + "9" * 19, 400, "start: "),
        ("sat/export/extended?start=5&end=4", 400, "end: must not be before start"),
        ("sat/export/extended?size=5", 400, "size: "),
        ("sat/past", 400, "time: "),
        ("sat/past?time=now", 400, "time: must be a whole number"),
        ("sat/past?time=" + "9" * 400, 400, "time: "),
        ("sat/past?time=0&by=x", 400, "by: "),
        ("sat/gaps?packet=a", 400, "packet: must be one of the dictionary; received 'a'"),
        ("sat/gaps?start=x", 400, "start: "),
    ],
)
def test_wrong_questions_get_one_line(client, path, status, text):
    found, body, _ = client.raw(f"/api/{path}")
    assert found == status
    error = json.loads(body)["error"]
    assert text in error and "\n" not in error and len(error) < 300


def test_what_fails_is_told_in_one_line_without_why(client, monkeypatch, capfd):
    def fail(*_):
        raise RuntimeError("/secret/place")

    monkeypatch.setattr(history, "latest", fail)
    for _ in range(5):
        status, body, headers = client.raw("/api/sat/history/extended")
        assert (status, headers["content-type"]) == (500, "application/json")
        assert list(json.loads(body)) == ["error"] and b"secret" not in body
    (line,) = capfd.readouterr().err.splitlines()
    text = "a request failed: RuntimeError: /secret/place (http, /api/sat/history/extended)"
    assert line == f"torquer ground: {text}"
    assert client.raw("/api/sat/log")[0] == 200


SPANS = (
    *("history/extended", "history/extended/omega_x", "log", "log/search", "log.csv", "sent"),
    *("violations", "command-history", "export/extended", "gaps"),
)


@pytest.mark.parametrize("path", sorted(SPANS))
def test_a_span_that_is_reversed_is_refused_everywhere(client, path):
    status, body, _ = client.raw(f"/api/sat/{path}?start=5&end=4")
    assert status == 400
    assert json.loads(body) == {"error": "end: must not be before start; received 4"}
    for fine in ("start=5&end=5", "end=-5"):
        assert client.raw(f"/api/sat/{path}?{fine}")[0] == 200


@pytest.mark.parametrize(
    "body",
    [
        *(b"", b"[]", b"{", b'{"start": 1}', b'{"start": 5, "end": 4}', b"x" * 5000),
        b'{"start": 0, "end": 1000}',  # the satellite counts seconds from 2010 on
    ],
)
def test_wrong_orders_get_one_line(client, body):
    status, answer, _ = client.raw("/api/sat/gaps", body)
    assert status == 400 and "\n" not in json.loads(answer)["error"]


def test_a_file_that_cannot_be_read_to_its_end_is_not_whole(client, monkeypatch):
    opened = []

    def read_only(path):
        opened.append(path)
        if len(opened) > 2:
            raise ArchiveError("damaged")
        return archive.read_only(path)

    monkeypatch.setattr(selection, "read_only", read_only)
    with pytest.raises(http.client.IncompleteRead):
        client.raw("/api/sat/export/extended")
    assert len(opened) == 3 and client.raw("/")[0] == 200


def test_an_archive_that_is_gone_gets_one_line(client):
    there, away = client.folder / "sat.sqlite", client.folder / "away"
    shutil.move(there, away)
    try:
        for path in (
            *("export/extended", "past?time=0", "gaps", "log/search", "log.csv"),
            *("plan", "history/extended", "history/extended/omega_x"),
        ):
            status, body, _ = client.raw(f"/api/sat/{path}")
            error = json.loads(body)["error"]
            assert status == 503 and "archive: cannot be read now: must be an archive" in error
            assert error.count("archive:") == 1 and "\n" not in error
        for path in ("log", "sent", "command-history", "violations"):
            assert isinstance(client.get(f"sat/{path}"), list), "what memory has"
    finally:
        shutil.move(away, there)
