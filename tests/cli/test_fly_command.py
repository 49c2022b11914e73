"""`torquer fly` and `torquer session`: what they write, say, and refuse."""

import json
import signal
from pathlib import Path

import pytest
from exported_netcdf import read_exported
from unit_cases import SIDE, two_magnetometers_text

from torquer.base.folder_lock import claim
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
    answer = json.loads(text)
    assert code == 0 and answer["ticks"] == 300 and answer["reboots"] == 1
    assert answer["packets"]["ready"] == 2 and len(answer["digest"]) == 16
    both = (out / "session.json", tmp_path / "other" / "session.json")
    code, text, _ = call("session", "bisect", *both)
    assert code == 1 and "control step 60," in text
    code, text, _ = call("session", "bisect", *both, "--json")
    assert json.loads(text)["tick"] == 60
    assert call("session", "bisect", both[0], both[0])[:2] == (0, "the same bytes came down\n")


def test_a_flight_with_two_magnetometers_names_the_stuck_one(call, tmp_path):
    file = tmp_path / "units.toml"
    file.write_text(two_magnetometers_text(), encoding="utf-8")
    for ticks in (80, 90):
        assert call("fly", file, "--ticks", ticks, "--out", tmp_path / str(ticks))[0] == 0
    sessions = [tmp_path / folder / "session.json" for folder in ("80", "90")]
    code, text, _ = call("session", "bisect", *sessions)
    assert code == 1 and f"side ({SIDE})" in text
    data = read_exported(tmp_path / "90" / "extended.nc")
    assert data["isolated"].attrs["flag_meanings"].endswith(" panel side")
    recording, archive = tmp_path / "90" / "downlink.bin", tmp_path / "satellite.sqlite"
    for known in ((), ("--scenario", file)):
        assert call("ground", "import", recording, "--folder", tmp_path, *known)[0] == 0
        call("ground", "export", archive, "--out", tmp_path, "--packet", "extended")
        meanings = read_exported(tmp_path / "extended.nc")["isolated"].attrs["flag_meanings"]
        assert meanings.endswith(" panel side") == bool(known)


def test_packets_of_a_satellite_name_its_sensors(call, tmp_path):
    file = tmp_path / "units.toml"
    file.write_text(two_magnetometers_text(), encoding="utf-8")
    for known, last in (((), "own_sensor"), (("--scenario", file), "side")):
        assert call("packets", *known, "--out", tmp_path)[0] == 0
        tree = json.loads((tmp_path / "packets.json").read_text(encoding="utf-8"))
        points = {m["key"]: m for packet in tree["packets"] for m in packet["measurements"]}
        assert points["extended.isolated"]["values"][0]["bits"][-1] == last
    code, _, err = call("packets", "--scenario", tmp_path / "none.toml")
    assert code == 2 and "scenario: must be a readable file" in err


@flies
def test_the_examples_of_commands_and_faults_are_flown(call, tmp_path):
    code, text, _ = call(
        *("fly", DAY, "--ticks", 1500, "--out", tmp_path, "--json"),
        *("--commands", f"{SOFTWARE}/commands.toml", "--faults", f"{SOFTWARE}/faults.toml"),
    )
    packets = json.loads(text)["packets"]
    # of four commands, the delayed one only that it waits
    assert code == 0 and packets["acknowledgement"] == 4 and packets["parameter"] == 1


@flies
def test_a_flight_in_real_time_takes_its_time(call, tmp_path, monkeypatch):
    """Each control step waits for its time; the clock is one of our own."""
    from torquer.flight.software import session

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


@flies
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
def test_flight_ended_by_a_signal_is_written_and_replays(call, tmp_path, monkeypatch, name):
    from torquer.flight.software.core import Core

    tick, number = Core.tick, getattr(signal, name)

    def interrupted(core, uplink=b""):
        if core.services.t_s == 99.0:
            signal.raise_signal(number)
        return tick(core, uplink)

    monkeypatch.setattr(Core, "tick", interrupted)
    # as without pytest, whose handlers are left alone
    before = {each: signal.signal(each, signal.SIG_DFL) for each in (signal.SIGINT, number)}
    try:
        code, text, err = call("fly", DAY, "--speed", 1e9, "--out", tmp_path)
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)
    assert code == 128 + number and "101 control steps" in text
    assert (
        f"error: interrupted after 101 control steps; what came down until then is in {tmp_path}"
        in err
    )
    monkeypatch.undo()
    code, text, _ = call("session", "replay", tmp_path / "session.json")
    assert code == 0 and "in 101 control steps" in text
    assert not (tmp_path / ".claimed").exists()


@flies
def test_a_signal_ends_a_flight_that_waits_for_the_clock(call, tmp_path, monkeypatch):
    """A wait of years for the second control step is left as soon as a signal comes."""
    from torquer.flight.software import session

    monkeypatch.setattr(session.time, "sleep", lambda seconds: signal.raise_signal(signal.SIGTERM))
    before = signal.signal(signal.SIGTERM, signal.SIG_DFL)
    try:
        code, text, _ = call("fly", DAY, "--speed", 1e-300, "--out", tmp_path)
    finally:
        signal.signal(signal.SIGTERM, before)
    assert code == 128 + signal.SIGTERM and text.startswith("3 control steps")


@flies
def test_flight_with_a_previously_used_memory_replays(call, tmp_path):
    """The files of the memory before the flight are part of the session."""
    for out in ("first", "second"):
        call("fly", DAY, "--ticks", 90, "--memory", tmp_path / "memory", "--out", tmp_path / out)
    code, text, err = call("session", "replay", tmp_path / "second" / "session.json")
    assert code == 0 and text.startswith("the same bytes"), err
    code, text, _ = call(
        "session", "bisect", *(tmp_path / out / "session.json" for out in ("first", "second"))
    )
    assert code == 1 and "control step 0," in text


@flies
def test_what_comes_after_the_end_of_a_flight_is_noted(call, tmp_path):
    faults = tmp_path / "faults.toml"
    faults.write_text('faults = [{ tick = 60, fault = "reboot" }]\n', encoding="utf-8")
    code, _, err = call(
        *("fly", DAY, "--ticks", 60, "--out", tmp_path, "--faults", faults),
        *("--commands", f"{SOFTWARE}/commands.toml"),
    )
    assert code == 0
    assert "--commands: 4 of the file come after the end of the flight" in err
    assert "--faults: 1 of the file come after the end of the flight" in err


@flies
def test_a_folder_in_use_by_a_flight_is_refused(call, tmp_path):
    from torquer.base.folder_lock import claim

    with claim(tmp_path):
        code, _, err = call("fly", DAY, "--ticks", 5, "--out", tmp_path)
    assert code == 2 and "--out: must not be in use by another run" in err


@flies
def test_the_files_of_an_earlier_flight_are_not_left(call, tmp_path):
    """Without telemetry there is neither the table nor the picture of the flight before."""
    call("fly", DAY, "--ticks", 5, "--out", tmp_path)
    (tmp_path / "quiet.toml").write_text("[modules.tm]\non = false\n", encoding="utf-8")
    quiet = ("--software", tmp_path / "quiet.toml")
    code, text, _ = call("fly", DAY, "--ticks", 5, "--out", tmp_path, *quiet)
    assert code == 0 and "downlink.png" not in text
    assert not {"downlink.png", "extended.nc"} & {path.name for path in tmp_path.iterdir()}


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ("{ index = 0, value = nan }", "values.value: must be a number from"),
        ("{ index = 0, value = 'x' }", "values.value: must be a number from"),
        ("{ index = 70000, value = 1 }", "values.index: must be a whole number from 0 to 65535"),
        ("{ index = 0.5, value = 1 }", "values.index: must be a whole number from 0 to 65535"),
        ("{ index = [1], value = 1 }", "values.index: must be a whole number from 0 to 65535"),
    ],
)
def test_a_value_that_does_not_fit_its_field_is_refused(call, tmp_path, values, message):
    """The codec would round or saturate it, and send what the file does not have."""
    commands = tmp_path / "commands.toml"
    commands.write_text(
        f'commands = [{{ at_s = 1, command = "set_parameter", values = {values} }}]\n',
        encoding="utf-8",
    )
    code, _, err = call("fly", DAY, "--commands", commands, "--out", tmp_path)
    assert code == 2 and f"error: commands[0].{message}" in err


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "from torquer.base.spec",
            "raise SystemExit\nfrom torquer.base.spec",
            "file: must be importable",
        ),
        ("self.energy_j = 0.0", "1 / 0", "must be made from its settings without an error"),
        ("Settings(Spec)", "Settings", "class: must have Settings derived from"),
        ("period_s = 1.0", "period_s = float('nan')", "class: must have a period_s above 0"),
    ],
)
def test_a_module_that_cannot_fly_gets_one_line(call, tmp_path, old, new, message):
    for name in ("coil_energy.py", "coil_energy.toml", "my_software.toml"):
        text = Path(SOFTWARE, name).read_text(encoding="utf-8")
        (tmp_path / name).write_text(text.replace(old, new), encoding="utf-8")
    code, _, err = call("packets", tmp_path / "my_software.toml")
    assert code == 2 and err.count("\n") == 1
    assert err.startswith("error: modules.coil_energy") and message in err


@flies
def test_module_author_sees_the_exception_it_raised(call, tmp_path):
    for name in ("coil_energy.py", "coil_energy.toml", "my_software.toml"):
        text = Path(SOFTWARE, name).read_text(encoding="utf-8")
        text = text.replace("dipole, _ = core.commanded", "raise SystemExit(3)")
        (tmp_path / name).write_text(text, encoding="utf-8")
    line = (tmp_path / "coil_energy.py").read_text(encoding="utf-8").split("\n")
    number = 1 + next(k for k, text in enumerate(line) if "raise SystemExit" in text)
    software = ("--software", tmp_path / "my_software.toml")
    code, _, err = call("fly", DAY, "--ticks", 5, "--out", tmp_path, *software)
    place = f"coil_energy.py, line {number}, t = 0 s"
    assert code == 0 and f"note: module coil_energy raised SystemExit: 3 ({place})" in err


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("uplink", [1, "zz"], "uplink[0][1]: must be hexadecimal digits"),
        ("memory", {"main": {"time": "0"}}, "memory.main.time: must be hexadecimal digits"),
        ("scenario", "{}", "session.scenario: must be a scenario"),
    ],
)
@flies
def test_a_session_that_was_edited_gets_one_line(call, tmp_path, key, value, message):
    call("fly", DAY, "--ticks", 5, "--out", tmp_path)
    session = tmp_path / "session.json"
    beginning, *rest = json.loads(session.read_text(encoding="utf-8"))
    edited = [beginning | {key: value}, *rest] if key in beginning else [beginning, value, *rest]
    lines = "\n,".join(json.dumps(each) for each in edited)
    session.write_text(f"[\n{lines}\n]\n", encoding="utf-8")
    code, _, err = call("session", "replay", session)
    assert code == 2 and message in err and err.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--memory", "pyproject.toml"), "--memory: must be a folder that can be written"),
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
    deep = tmp_path / "deep.json"
    deep.write_text("[" * 100_000, encoding="utf-8")
    for arguments in (
        *(("replay", DAY), ("bisect", DAY, DAY)),
        *(("replay", tmp_path / "no.json"), ("replay", deep)),
    ):
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


def test_python_file_modules_are_executed_only_where_allowed(call, tmp_path):
    """Refused before anything of them runs."""
    (tmp_path / "outside.py").write_text("raise SystemExit('executed')\n", encoding="utf-8")
    own = tmp_path / "own"
    own.mkdir()
    text = 'modules.com = {}\nmodules.x = { file = "../outside.py", class = "X" }\n'
    (own / "software.toml").write_text(text, encoding="utf-8")
    mine = ("fly", DAY, "--out", tmp_path / "out", "--software", own / "software.toml")
    code, _, err = call(*mine, "--no-user-code")
    assert code == 2 and "modules.x.file: must not be given with --no-user-code" in err
    code, _, err = call(*mine)
    assert code == 2 and "modules.x.file: must lie in the software file's folder" in err
    assert "executed" not in err


@flies
def test_the_computer_in_c_sends_the_same_bytes(call, tmp_path):
    """A session flown with the export is flown again with the kernels from which it was made."""
    bench = "examples/my_law.toml"
    assert call("export", "c", bench, "--steps", 1, "--out", tmp_path / "c")[0] == 0
    code, text, err = call(
        "fly", bench, "--computer", tmp_path / "c", "--ticks", 100, "--out", tmp_path / "flown"
    )
    assert code == 0 and "100 control steps" in text, err
    session = tmp_path / "flown" / "session.json"
    assert call("session", "replay", session, "--code-from-anywhere")[0] == 0


@flies
def test_a_flight_says_that_single_precision_has_other_bytes(call, tmp_path):
    bench = "examples/my_law.toml"
    single = ("--real", "float", "--steps", 1, "--out", tmp_path / "c")
    assert call("export", "c", bench, *single)[0] == 0
    code, _, err = call(
        "fly", bench, "--computer", tmp_path / "c", "--ticks", 100, "--out", tmp_path / "flown"
    )
    assert code == 0 and "in double precision" in err


def test_a_computer_that_is_none_is_refused(call, tmp_path):
    code, _, err = call("fly", "examples/my_law.toml", "--computer", tmp_path)
    assert code == 2 and err.startswith("error: --computer: must be a folder of `torquer export c`")
    code, _, err = call("fly", DAY, "--computer", tmp_path, "--no-user-code")
    assert code == 2 and "--computer: must not be given with --no-user-code" in err


@flies
def test_a_recording_executes_no_code_that_it_names_unasked(call, tmp_path, monkeypatch):
    """Recordings are mailed: only code beside them, or allowed from anywhere, is executed."""
    monkeypatch.chdir(tmp_path)
    Path("mine.py").write_text(
        "from torquer.flight.software import Module\nopen('executed', 'w').close()\n"
        "class Mine(Module):\n    name = 'mine'\n    def step(self, core):\n        pass\n"
    )
    Path("mine_packets.toml").write_text("[modules]\nmine = 200\n")
    Path("mine.toml").write_text(
        'name = "mine"\npackets = ["mine_packets.toml"]\n'
        '[modules.mine]\nfile = "mine.py"\nclass = "Mine"\n'
    )
    day = Path(__file__).parents[2] / DAY
    assert call("fly", day, "--software", "mine.toml", "--ticks", 5, "--out", "out")[0] == 0
    session, executed = Path("out/session.json"), Path("executed")
    executed.unlink()
    for words in (("replay", session), ("bisect", session, session)):
        for more, must in (
            ((), "modules.mine.file: must lie in the session's folder, or be allowed by "),
            (("--no-user-code",), "modules.mine.file: must not be given with --no-user-code"),
        ):
            code, _, err = call("session", *words, *more)
            assert code == 2 and must in err and err.count("\n") == 1
        assert not executed.exists()
    assert call("session", "replay", session, "--code-from-anywhere")[0] == 0
    assert executed.exists()


def test_two_flights_never_share_a_memory(call, tmp_path):
    """Counters of frames stand in it: no number may be used twice."""
    with claim(tmp_path):
        code, out, err = call("fly", DAY, "--memory", tmp_path, "--out", tmp_path / "out")
    assert code == 2 and not out
    assert err == (f"error: --memory: must not be in use by another run; received {tmp_path}\n")


FAILING = {
    "constructor at the second boot": (
        "    made = 0\n    def __init__(self, settings):\n        super().__init__(settings)\n"
        "        Mine.made += 1\n        if Mine.made > 2:\n            raise RuntimeError('no')\n"
        "    def step(self, core):\n        if 20.0 < core.t_s < 22.0:\n            core.reboot()\n"
    ),
    "start": "    def start(self, core):\n        raise SystemExit(3)\n",
    "interrupt": "    def step(self, core):\n        raise KeyboardInterrupt\n",
    "generator": "    def step(self, core):\n        raise GeneratorExit\n",
    "no number": (
        "    def step(self, core):\n"
        "        core.take_over('dipole_a_m2', (float('nan'), 1e300, 0.0))\n"
    ),
    "no bytes": "    def step(self, core):\n        core.transmit('text')\n",
    "text of an exception": (
        "    def step(self, core):\n        raise Mute\n"
        "class Mute(Exception):\n    def __str__(self):\n        raise ValueError('s')\n"
    ),
    "status": "    def status(self):\n        raise RuntimeError('no')\n",
}


@flies
@pytest.mark.parametrize("kind", FAILING)
def test_what_a_module_does_ends_no_flight(call, tmp_path, kind):
    """The satellite flies on, and its recording is written and replays."""
    (tmp_path / "mine.py").write_text(
        "from torquer.flight.software import Module\nclass Mine(Module):\n    name = 'mine'\n"
        + FAILING[kind]
    )
    (tmp_path / "packets.toml").write_text("[modules]\nmine = 200\n")
    shipped = (Path(__file__).parents[2] / "torquer/flight/software/chibis_m.toml").read_text()
    (tmp_path / "mine.toml").write_text(
        shipped.replace('name = "Chibis-M"', 'name = "mine"\npackets = ["packets.toml"]')
        + '\n[modules.mine]\nfile = "mine.py"\nclass = "Mine"\n'
    )
    words = ("--software", tmp_path / "mine.toml", "--ticks", 120, "--out", tmp_path)
    code, out, err = call("fly", DAY, *words)
    assert code == 0 and "120 control steps" in out, err
    assert "Traceback" not in err
    assert ("module mine raised" in err) == (kind != "status"), err
    replayed = call("session", "replay", tmp_path / "session.json")
    assert replayed[0] == 0, replayed
