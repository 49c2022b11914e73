"""`torquer ground at` and `ground gaps`: an instant of the past, what is missing, wrong inputs."""

import json

import pytest
from made_archive import archive_of, row


@pytest.fixture
def call(call_ground):
    return call_ground


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Archives of two satellites, one of which has a gap."""
    made = tmp_path_factory.mktemp("ground")
    kept = [1000 * k for k in range(300) if not 100 <= k < 150]
    rows = [row("extended", time_ms, 10**9 + time_ms, omega_x=time_ms / 8e3) for time_ms in kept]
    archive_of(made / "one.sqlite", [*rows, row("modes", 60_000, state_0=1)])
    archive_of(made / "two.sqlite", [])
    return made


def test_an_instant_in_words_and_as_json(call, folder):
    here = ("--folder", folder, "--satellite", "one")
    code, out, _ = call("at", "1970-01-01T00:01:40.5+00:00", *here)
    assert code == 0 and out.startswith("one at 1970-01-01T00:01:40.500Z, on-board time\n")
    assert "omega: 12.375 unknown unknown deg/s\n" in out
    about = "extended: 1970-01-01T00:01:39.000Z on board, received 1970-01-12T13:48:19.000Z"
    assert f"\n{about}, authentic, 1.5 s old\n" in out and "modes" in out and "STALE" in out
    code, out, _ = call("at", "1970-01-12T13:46:40Z", "--by", "received", "--json", *here)
    (extended,) = json.loads(out)["packets"]
    assert code == 0 and extended["values"]["omega_x"] == 0.0
    code, out, err = call("at", "1960-01-01T00:00:00Z", *here)
    assert code == 0 and "nothing had come by then" in err


def test_states_go_by_the_names_of_a_scenario(call, folder):
    scenario = ("--scenario", "examples/chibis_m_day.toml")
    here = ("--folder", folder, "--satellite", "one")
    code, out, _ = call("at", "1970-01-01T00:02:00Z", *scenario, *here)
    assert code == 0 and "\ndetermination: " in out and "\nstabilisation: unknown" in out


def test_gaps_in_words_and_as_json(call, folder):
    here = ("--folder", folder, "--satellite", "one")
    code, out, _ = call("gaps", *here)
    assert code == 0 and out == (
        "extended: 1970-01-01T00:01:39.000Z to 1970-01-01T00:02:30.000Z: 50 rows of one each 1 s "
        "are missing; 0 stored ones came\n"
    )
    code, out, _ = call("gaps", "--packet", "extended", "--json", *here)
    assert [gap["missing"] for gap in json.loads(out)["gaps"]] == [50]
    code, _, err = call("gaps", "--folder", folder, "--satellite", "two")
    assert code == 0 and "there are no gaps" in err


def test_gaps_are_filled_by_the_ground_that_runs(call, folder):
    here = ("--folder", folder, "--satellite", "one")
    code, _, err = call("gaps", "--fill", *here)
    assert code == 2 and "must be that of a running ground" in err


BACKWARDS = ("--start", "2012-01-02T00:00:00Z", "--end", "2012-01-01T00:00:00Z")


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (("at", "noon", "--satellite", "one"), "TIME: must be a time with a zone"),
        (("at", "2012-01-01T00:00:00", "--satellite", "one"), "TIME: must be a time with a zone"),
        (("at", "2012-01-01T00:00:00Z"), "--satellite: must be one of one, two; received nothing"),
        (("at", "2012-01-01T00:00:00Z", "--satellite", "three"), "one of one, two; received three"),
        (("gaps", "--satellite", "one", "--packet", "_log"), "--packet: must be one of beacon"),
        (("gaps", "--satellite", "one", "--start", "x"), "--start: must be a time with a zone"),
        (("gaps", "--satellite", "one", *BACKWARDS), "--end: must not be before --start; received"),
        (("history", "--satellite", "one", *BACKWARDS), "--end: must not be before --start"),
        (("alarms", "--satellite", "one", "--log", *BACKWARDS), "--end: must not be before"),
        (("alarms", "--satellite", "one", *BACKWARDS[:2]), "--start: must be given with --log"),
        (("alarms", "--satellite", "one", *BACKWARDS[2:]), "--end: must be given with --log"),
    ],
)
def test_wrong_questions_get_one_line(call, folder, arguments, problem):
    code, _, err = call(*arguments, "--folder", folder)
    assert code == 2 and problem in err and err.count("\n") == 1


def test_a_file_that_is_no_archive_gets_one_line(call, tmp_path):
    (tmp_path / "sat.sqlite").write_bytes(b"nothing")
    for arguments in (("at", "2012-01-01T00:00:00Z"), ("gaps",)):
        code, _, err = call(*arguments, "--folder", tmp_path)
        assert code == 2 and "archive: must be an archive" in err and err.count("\n") == 1
