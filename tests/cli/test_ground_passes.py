"""`torquer ground passes` and `torquer ground report`: tables, JSON, pictures, pages, mistakes."""

import json

import pytest
from station_skies import CHIBIS

from torquer.flight.packets.software_file import load_link
from torquer.ground.archive import Archive, Row
from torquer.ground.passes import ms_of

FROM = ("--from", "2012-02-28T00:00:00Z")
TARUSA = ("--station", "54.73,37.18,180")


@pytest.fixture
def call(call_ground):
    return call_ground


@pytest.fixture
def tle(tmp_path):
    path = tmp_path / "c.tle"
    path.write_text("\n".join(CHIBIS) + "\n", encoding="utf-8")
    return path


@pytest.fixture
def ground(tmp_path, tle):
    path = tmp_path / "ground.toml"
    path.write_text(
        '[satellites.chibis]\nlink = "udp:127.0.0.1:10315"\nelements = "c.tle"\n'
        "downlink_hz = 435e6\n[satellites.chibis.downlink]\nbit_s = 9600.0\n"
        '[satellites.other]\nlink = "udp:127.0.0.1:10316"\n'
        "[stations.tarusa]\nlatitude_deg = 54.73\nlongitude_deg = 37.18\naltitude_m = 180.0\n"
        "[stations.pole]\nlatitude_deg = -90.0\nlongitude_deg = 0.0\n",
        encoding="utf-8",
    )
    return path


def test_a_table_of_passes(call, ground):
    code, out, err = call("passes", ground, "--satellite", "chibis", *FROM)
    assert (code, err) == (0, "")
    lines = [line for line in out.splitlines() if "tarusa" in line]
    # the pole is beyond the reach of an inclination of 52 deg
    assert len(lines) == 6 and "pole" not in out
    assert "2012-02-28 10:19:41" in lines[0]
    assert "orbit: SGP4 with elements of 38051, 0.1 days old, of c.tle" in out


def test_the_same_as_json_and_as_files(call, ground, tmp_path):
    out_folder = tmp_path / "out"
    options = ("--satellite", "chibis", *FROM, "--json", "--out", out_folder)
    code, out, _ = call("passes", ground, *options)
    answer = json.loads(out)
    assert code == 0 and len(answer["passes"]) == 6
    files = [out_folder / "passes.png", out_folder / "passes.json"]
    assert answer.pop("files") == [str(file) for file in files]
    assert json.loads(files[1].read_text(encoding="utf-8")) == answer
    assert files[0].read_bytes().startswith(b"\x89PNG") and files[0].stat().st_size > 50_000
    assert answer["frequency_hz"] == 435e6
    assert answer["passes"][0]["downlink"]["stored"][0]["packet"] == "stored"
    assert answer["elements"]["called"] == "38051"


def test_a_place_a_frequency_and_a_rate_on_the_command_line(call, tle):
    options = ("--elements", tle, *TARUSA, *FROM, "--frequency", "437.5e6", "--bit-rate", "1200")
    code, out, _ = call("passes", *options, "--lowest-elevation", "20", "--hours", "12.5", "--json")
    found = json.loads(out)["passes"]
    assert code == 0 and [round(each["aos"]["elevation_deg"], 3) for each in found] == [20.0]
    assert found[0]["downlink"] == {"bit_s": 1200.0, "bytes": int(150 * found[0]["duration_s"])}
    assert found[0]["aos"]["doppler_hz"] > 0.0 > found[0]["los"]["doppler_hz"]


def test_a_place_in_the_south_and_west(call, tle):
    code, out, _ = call("passes", "--elements", tle, "--station=-33.4,-70.6", *FROM, "--json")
    assert code == 0 and json.loads(out)["passes"][0]["station"] == "-33.4,-70.6"


def test_passes_of_a_scenario_begin_with_it(call):
    options = ("--scenario", "examples/chibis_m_day.toml", *TARUSA, "--hours", "3", "--json")
    code, out, _ = call("passes", *options)
    answer = json.loads(out)
    assert code == 0 and answer["start_ms"] == ms_of("2012-03-04T10:31:47Z", "t")
    assert answer["orbit"] == "that of the scenario chibis_m_day" and answer["passes"]


def test_no_pass_is_said(call, tle):
    code, out, err = call("passes", "--elements", tle, "--station=-90,0", *FROM)
    assert code == 0 and "no pass in this span" in err and "orbit: SGP4" in out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "--elements: must be given for a satellite without elements or scenario"),
        (("--elements", "c.tle"), "--station: must be given, or stations in FILE"),
        (("--elements", "none.tle", *TARUSA), "elements: must be a file that can be read"),
        (("--elements", "c.tle", "--station", "tarusa"), "--station: must be LATITUDE,LONGITUDE"),
        (("--elements", "c.tle", "--station", "91,0"), "latitude_deg: must be less than"),
        (("--elements", "c.tle", "--station", "nan,0"), "latitude_deg: must be finite"),
        (("--elements", "c.tle", *TARUSA, "--from", "yesterday"), "--from: must be a time with"),
        (("--elements", "c.tle", *TARUSA, "--hours", "0"), "hours: must"),
        (("--elements", "c.tle", *TARUSA, "--hours", "2401"), "--hours: must"),
        (("--elements", "c.tle", *TARUSA, "--frequency", "-1"), "--frequency: must"),
        (("--elements", "c.tle", *TARUSA), "elements: c.tle: must hold elements of an orbit"),
        (("--elements", "c.tle", "--satellite", "s", *TARUSA), "--satellite: must be given with"),
        (("ground.toml",), "--satellite: must be one of chibis, other; received none"),
        (("ground.toml", "--satellite", "x"), "--satellite: must be one of chibis, other"),
        (("ground.toml", "--satellite", "other"), "--elements: must be given"),
        (("ground.toml", "--satellite", "chibis", *FROM, "--station", "moscow"),
         "--station: must be one of tarusa, pole, or LATITUDE"),
        (("ground.toml", "--scenario", "s.toml"), "--scenario: must not be given with FILE"),
        (("none.toml",), "ground: "),
    ],
)  # fmt: skip
def test_wrong_options_get_one_line(call, ground, tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    code, out, err = call("passes", *arguments)
    assert code == 2 and not out
    assert message in err and err.count("error:") == 1


# Reports


@pytest.fixture
def folder(tmp_path):
    """Archives with beacons throughout the first hours of 28 February 2012."""
    made = tmp_path / "archives"
    made.mkdir()
    start_ms = ms_of("2012-02-28T10:00:00Z", "t")
    archive = Archive(made / "chibis.sqlite", load_link().dictionary)
    count = len(load_link().dictionary.down["beacon"].names)
    archive.put(
        Row("beacon", start_ms + 10_000 * k, None, 2, 0, k, (0,) * count) for k in range(800)
    )
    archive.close()
    return made


def test_the_report_of_a_pass(call, ground, folder, tmp_path):
    page = tmp_path / "pass.html"
    options = ("--file", ground, "--satellite", "chibis", "--folder", folder, "--out", page)
    code, out, err = call("report", "2", *options, *FROM)
    text = page.read_text(encoding="utf-8")
    assert (code, out, err) == (0, f"{page}\n", "")
    assert "chibis over tarusa, 2012-02-28 11:55:29 UTC" in text
    assert "data:image/png;base64," in text and "Doppler at AOS, LOS" in text
    assert "SGP4 with elements of 38051" in text


def test_the_report_by_options_names_its_archive_as_other_commands_do(call, tle, folder, tmp_path):
    page = tmp_path / "new" / "pass.html"
    (folder / "other.sqlite").write_bytes((folder / "chibis.sqlite").read_bytes())
    orbit = ("--elements", tle, "--station", "54.73,37.18", *FROM)
    options = ("--satellite", "other", "--folder", folder, "--out", page)
    code, out, _ = call("report", "2", *orbit, *options)
    assert (code, out) == (0, f"{page}\n")
    assert "other over 54.73,37.18" in page.read_text(encoding="utf-8")


@pytest.mark.parametrize("place", [".", "page.html/pass.html"])
def test_a_page_that_cannot_be_written_is_no_folder(call, folder, tmp_path, monkeypatch, place):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "page.html").write_text("")
    span = ("--from", "2012-02-28T10:00:00Z", "--to", "2012-02-28T10:01:40Z")
    code, out, err = call("report", *span, "--folder", folder, "--out", place)
    assert code == 2 and not out
    assert f"--out: must be a file that can be written; received {place} (" in err


def test_the_report_of_a_span(call, folder, tmp_path):
    page = tmp_path / "pass.html"
    span = ("--from", "2012-02-28T10:00:00Z", "--to", "2012-02-28T10:01:40Z")
    code, _, _ = call("report", *span, "--folder", folder, "--out", page)
    text = page.read_text(encoding="utf-8")
    assert code == 0 and "data:image" not in text
    assert "<td>beacon</td><td>11</td><td>10:00:00</td><td>10:01:40</td><td>10</td>" in text


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "NUMBER: must be given, or --from and --to; received neither"),
        (("1", "--to", "2012-02-28T10:00:00Z"), "NUMBER: must be given, or --from and --to"),
        (("--to", "2012-02-28T10:00:00Z"), "--from: must be given with --to"),
        ((*FROM, "--to", "2012-01-28T10:00:00Z"), "--to: must not be before --from"),
        ((*FROM, "--to", "soon"), "--to: must be a time with a zone"),
        ((*FROM, "--to", "2012-02-29T00:00:00Z", "--satellite", "x"), "--satellite: must be one"),
        ((*FROM, "--to", "2012-02-29T00:00:00Z", "--folder", "none"), "--folder: must hold"),
        (("7", "--file", "ground.toml", "--satellite", "chibis", *FROM),
         "NUMBER: must be one of the 6 passes; received 7"),
        (("0", "--file", "ground.toml", "--satellite", "chibis", *FROM), "NUMBER: must be one of"),
    ],
)  # fmt: skip
def test_wrong_reports_get_one_line(
    call, ground, folder, tmp_path, monkeypatch, arguments, message
):
    monkeypatch.chdir(tmp_path)
    given = () if "--folder" in arguments else ("--folder", folder)
    code, out, err = call("report", *arguments, *given)
    assert code == 2 and not out and not (tmp_path / "pass.html").exists()
    assert message in err and err.count("error:") == 1


@pytest.mark.parametrize("content", [None, b"", b"nonsense", b"\xff\x00"])
def test_a_ground_says_at_its_start_that_elements_are_none(tmp_path, capsys, content):
    from torquer.cli.commands.ground import _note_on_elements
    from torquer.ground.file import SatelliteTable, make_satellite

    file = tmp_path / "c.tle"
    if content is not None:
        file.write_bytes(content)
    _note_on_elements(make_satellite("sat", SatelliteTable(link="udp:127.0.0.1:0", elements=file)))
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("note: sat: no passes until this is mended: elements: ")
    assert "must" in line
