"""`torquer fly` and `torquer session`: what they write, say, and refuse."""

import json

import pytest

from torquer.compile import engine

DAY, SOFTWARE = "examples/chibis_m_day.toml", "examples/software"
flies = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")


@flies
def test_a_flight_is_written_flown_again_and_compared(call, tmp_path):
    out = tmp_path / "flown"
    faults = tmp_path / "faults.toml"
    faults.write_text('faults = [{ tick = 60, fault = "reboot" }]\n', encoding="utf-8")
    code, text, err = call("fly", DAY, "--ticks", 300, "--out", out)
    assert code == 0 and "300 control steps" in text and "keys that everybody knows" in err
    assert {path.name for path in out.iterdir()} >= {
        *("session.json", "downlink.bin", "downlink.png", "extended.nc", "beacon.nc", "ready.nc")
    }
    assert call("session", "replay", out / "session.json")[0] == 0
    code, text, _ = call(
        "fly", DAY, "--ticks", 300, "--faults", faults, "--out", tmp_path / "other", "--json"
    )
    told = json.loads(text)
    assert code == 0 and told["ticks"] == 300 and told["reboots"] == 1
    assert told["packets"]["ready"] == 2 and len(told["digest"]) == 16
    both = (out / "session.json", tmp_path / "other" / "session.json")
    code, text, _ = call("session", "bisect", *both)
    assert code == 1 and "control step 60," in text
    code, text, _ = call("session", "bisect", *both, "--json")
    assert json.loads(text)["tick"] == 60
    assert call("session", "bisect", both[0], both[0])[:2] == (0, "the same bytes came down\n")


@flies
def test_the_examples_of_commands_and_faults_are_flown(call, tmp_path):
    code, text, _ = call(
        *("fly", DAY, "--ticks", 1500, "--out", tmp_path, "--json"),
        *("--commands", f"{SOFTWARE}/commands.toml", "--faults", f"{SOFTWARE}/faults.toml"),
    )
    packets = json.loads(text)["packets"]
    assert code == 0 and packets["acknowledgement"] == 3 and packets["parameter"] == 1


@flies
def test_a_flight_in_real_time_takes_its_time(call, tmp_path, monkeypatch):
    """Each control step waits for its time; the clock is one of our own."""
    from torquer.onboard import session

    class Clock:
        now = 100.0

        def monotonic(self):
            return self.now

        def sleep(self, seconds):
            self.now += seconds

    clock = Clock()
    monkeypatch.setattr(session, "time", clock)
    call("fly", DAY, "--ticks", 31, "--speed", 10, "--out", tmp_path)
    assert clock.now == pytest.approx(103.0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--speed", 2, "--realtime"), "--speed: must not be given with --realtime"),
        (("--speed", 0), "--speed: must be a positive number; received 0"),
        (("--ticks", 0), "--ticks: must be 1 or more; received 0"),
        (("--commands", "no.toml"), "no.toml"),
        (("--faults", DAY), "must be a known key"),
        (("--software", DAY), "must be a known key"),
    ],
)
def test_wrong_input_gets_one_line(call, tmp_path, arguments, message):
    code, _, err = call("fly", DAY, "--out", tmp_path, *arguments)
    assert code == 2 and message in err


def test_no_session_is_refused(call, tmp_path):
    for arguments in (("replay", DAY), ("bisect", DAY, DAY), ("replay", tmp_path / "no.json")):
        code, _, err = call("session", *arguments)
        assert code == 2 and "session: must be a readable session" in err


def test_packets_are_listed_and_described(call, tmp_path):
    code, text, _ = call("packets", f"{SOFTWARE}/my_software.toml", "--out", tmp_path / "made")
    assert code == 0 and "down 100  coil_energy" in text and "to coil_energy" in text
    made = {path.name for path in (tmp_path / "made").iterdir()}
    assert made == {"packets.xml", "packets.dbc", "packets.json", "packets.md"}
    code, text, _ = call("packets", "--json")
    beacon = next(row for row in json.loads(text) if row["name"] == "beacon")
    assert beacon == {"direction": "down", "name": "beacon", "id": 1, "module": "", "bytes": 8}
    code, _, err = call("packets", tmp_path / "no.toml")
    assert code == 2 and "no.toml" in err
