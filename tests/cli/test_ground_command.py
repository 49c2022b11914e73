"""`torquer ground`: the server, commands through it, recordings, exports, and wrong inputs."""

import json
import os
import signal
import socket
import sqlite3
import subprocess
import sys
import threading
import urllib.request
from contextlib import closing, suppress

import pytest
from archived import WrittenAtOnce
from ground_flight import flying, serving, table
from slow_cases import slow_after

from torquer.compile import engine
from torquer.flight.packets.frames import Downlink
from torquer.flight.packets.protected import TelemetrySender
from torquer.flight.packets.software_file import load_link

flies = pytest.mark.skipif(not engine.COMPILED, reason="whole flights: minutes without JIT")
PATIENCE_S = 120


@pytest.fixture
def call(call_ground):
    return call_ground


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The folder of a ground that serves a satellite in flight."""
    made = tmp_path_factory.mktemp("ground")
    with flying() as flight, serving(made, chibis=table(flight.address)) as client:
        client.value("omega_x")
        yield made


# Alarms


@pytest.fixture
def alarmed(tmp_path):
    """A folder with an archive that has alarms, as a ground leaves it."""
    from torquer.computer.names import Names
    from torquer.ground.alarm import Now
    from torquer.ground.alarm_desk import AlarmDesk
    from torquer.ground.archive import AUTHENTIC, Row

    dictionary = load_link().dictionary
    spool = WrittenAtOnce(tmp_path / "sat.sqlite", dictionary)
    with closing(spool.archive):
        desk = AlarmDesk(spool, dictionary, Names({}, (), {}, {}, ()), print, print)
        names = dictionary.down["housekeeping"].names
        for k, amperes in enumerate((1.7, 1.9)):
            values = dict.fromkeys(names, 0.0) | {"coils_current": amperes, "switched_off": 3}
            row = Row("housekeeping", 1000 * k, 0, AUTHENTIC, 0, k, tuple(values.values()))
            desk.look([row], Now(0, float(k)))
        (first, _) = desk.listed()["alarms"]
        desk.acknowledge({first["key"]: first["number"]}, "ann", "of the \x1b[31m test")
        desk.shelve("housekeeping.switched_off", 60.0, "bob", "repair")
    return tmp_path


def test_alarms_are_listed_from_the_archive(call, alarmed, capsys):
    capsys.readouterr()
    code, out, err = call("alarms", "--folder", alarmed, "--log")
    assert err == "note: sat.sqlite alone is read: no ground that writes it answers\n"
    current, switched_off, head, *log = out.splitlines()
    assert code == 0 and head == "out-of-limits log:" and len(log) == 2
    assert current.startswith(
        "warning housekeeping.coils_current above 1.5 A, now 1.9, since 1970-01-01T00:00:00Z, 1 x, "
        "acknowledged by ann "
    )
    assert current.endswith("of the \\x1b[31m test"), "nothing controls the terminal"
    assert "alarm   housekeeping.switched_off is coils, wheels, now 3" in switched_off
    assert "; shelved until " in switched_off and " by bob: repair" in switched_off
    assert any(
        "coils_current above 1.5 A, 1.9 at most, 1970-01-01T00:00:00Z to now" in x for x in log
    )
    code, out, _ = call("alarms", "--folder", alarmed, "--json", "--log", "--size", 1)
    found = json.loads(out)
    assert [each["state"] for each in found["alarms"]] == ["acknowledged", "active"]
    assert len(found["violations"]) == 1
    late = ("--log", "--json", "--start", "1970-01-02T00:00:00Z")
    assert json.loads(call("alarms", "--folder", alarmed, *late)[1])["violations"] == []


def test_alarms_of_no_archive_or_none(call, alarmed, tmp_path):
    code, _, err = call("alarms", "--folder", tmp_path / "none")
    assert code == 2 and "--folder: must hold an archive" in err
    code, _, err = call("alarms", "--folder", alarmed, "--satellite", "moon")
    assert code == 2 and err == "error: --satellite: must be one of sat; received moon\n"
    (alarmed / "text.sqlite").write_text("no archive")
    code, _, err = call("alarms", "--folder", alarmed, "--satellite", "text")
    assert code == 2 and "archive: must be an archive" in err and len(err.splitlines()) == 1
    with closing(sqlite3.connect(alarmed / "sat.sqlite")) as db:
        db.execute("DROP TABLE _alarms")
        db.execute("DROP TABLE _violations")
    code, out, err = call("alarms", "--folder", alarmed, "--satellite", "sat", "--log")
    assert (code, out) == (0, "out-of-limits log:\n") and "no alarms" in err


# Commands


@flies
def test_send_says_what_became_of_the_command(call, folder):
    code, out, _ = call("send", "get_parameter", "index=damping.gain", "--folder", folder)
    assert code == 0 and out.endswith("get_parameter index=damping.gain: executed\n")
    mode = ("set_mode", "region=stabilisation", "state=science")
    code, out, _ = call("send", *mode, "--folder", folder)
    assert code == 1 and "refused (not possible in this mode)" in out


@flies
def test_send_as_json_delayed_and_without_an_answer(call, folder):
    rates = ("beacon_period=10", "extended_period=1", "store_period=60")
    code, out, _ = call("send", "set_rates", *rates, "--delay-s", 600, "--json", "--folder", folder)
    (sent,) = json.loads(out)
    assert code == 0 and sent["state"] == "received" and sent["values"]["store_period"] == 60
    reads = ("send", "get_parameter", "index=0", "--folder", folder)
    code, out, _ = call(*reads, "--no-acknowledge")
    assert code == 0 and out.endswith(": sent\n")
    code, out, _ = call(*reads, "--no-wait")
    assert code == 0 and ": waiting" in out
    dipole = ("coils_manual", "dipole=0.1,-0.2,0", "duration=5")
    code, out, _ = call("send", *dipole, "--folder", folder)
    assert code == 0 and "dipole=[0.1, -0.2, 0]" in out


@flies
def test_a_plan_of_two_commands_at_one_second_is_listed_and_cancelled(call, folder, tmp_path):
    file = tmp_path / "plan.toml"
    file.write_text("".join(
        f'[[commands]]\nat_s = 0\ndelay_s = 3000\ncommand = "set_parameter"\n'
        f'values = {{ index = "damping.gain", value = {gain} }}\n' for gain in (2e6, 3e6)
    ))  # fmt: skip
    code, out, _ = call("send", "--file", file, "--json", "--folder", folder)
    first, second = json.loads(out)
    assert code == 0 and {first["state"], second["state"]} == {"received"}
    assert call("send", "report_status", "module_id=3", "--folder", folder)[0] == 0
    ours = [each["id"] for each in (first, second)]
    _, out, _ = call("plan", "--json", "--folder", folder)
    listed = [each for each in json.loads(out) if each["id"] in ours]
    assert [each["values"]["value"] for each in listed] == [2e6, 3e6]
    code, out, _ = call("cancel", first["id"], "--folder", folder)
    assert code == 0 and "plan_cancel" in out and out.endswith(": executed\n")
    _, out, _ = call("plan", "--folder", folder)
    assert "value=3000000.0" in out and "value=2000000.0" not in out
    code, out, err = call("cancel", first["id"], "--folder", folder)
    assert (code, out) == (2, "") and "must wait here or on board to be cancelled" in err


@flies
def test_a_plan_tells_what_differs_from_the_ground(call, folder):
    sends = ("send", "report_status", "module_id=3", "--folder", folder)
    code, out, _ = call(*sends, "--delay-s", 2500, "--as", "Ada", "--json")
    (ours,) = json.loads(out)
    assert (code, ours["made_by"]) == (0, "Ada (stated), command line")
    _, out, _ = call("plan", "--json", "--folder", folder)
    marks = {each["id"]: each["mark"] for each in json.loads(out)}
    assert marks[ours["id"]] == "as sent"
    with closing(sqlite3.connect(folder / "chibis.sqlite")) as db:  # as if another had sent it
        db.execute("UPDATE _commands SET command = 'power' WHERE id = ?", (ours["id"],))
        db.commit()
    _, out, _ = call("plan", "--folder", folder)
    assert f"report_status, request {ours['request']}: on board only" in out
    assert f"{ours['id']} power module_id=3: on ground only" in out
    assert call("send", "plan_cancel", f"request={ours['request']}", "--folder", folder)[0] == 0


@flies
def test_a_stack_is_loaded_stepped_and_run(call, folder, tmp_path):
    stack = ("stack", "--folder", folder)
    code, out, err = call(*stack)
    assert code == 0 and (out, err) == ("", "note: no stack was loaded\n")
    file = tmp_path / "wrong.toml"
    file.write_text('[[commands]]\ncommand = "report_statu"\n[[commands]]\ncommand = "reboot"\n')
    code, out, err = call("stack", "load", file, "--folder", folder)
    assert (code, out) == (2, "") and "commands[0].command: must be one of" in err
    assert "commands[1].values.kind: must be given" in err and err.count("\n") == 2
    example = "examples/software/commissioning.toml"
    code, out, _ = call("stack", "load", example, "--folder", folder, "--as", "Ада")
    assert code == 0 and "stack commissioning: held (loaded)" in out and "> 1 # Is everybody" in out
    assert call("stack", "next", "--folder", folder, "--as", "Ада")[0] == 0
    code, out, _ = call("stack", "next", "--folder", folder, "--as", "Ада")
    assert code == 0 and "> 3 report_status module_id=3: ready" in out
    code, out, _ = call("stack", "skip", "--folder", folder)
    assert code == 0 and "3 report_status module_id=3: skipped (skipped by command line)" in out
    code, out, _ = call("stack", "run", "--folder", folder, "--as", "Ben")
    assert code == 0 and "stack commissioning: over" in out and "received" in out.split("\n")[5]
    code, out, _ = call("history", "--folder", folder, "--json")
    made = [each["made_by"] for each in json.loads(out) if "stack" in each["made_by"]]
    begin = [f"{name} (stated), command line, stack 1 step {n}"
             for name, n in (("Ада", 2), ("Ben", 4), ("Ben", 5))]  # fmt: skip
    assert made == begin
    code, _, err = call("stack", "next", "--folder", folder)
    assert code == 2 and "stack: must be loaded; received one that is over" in err


@flies
def test_a_stack_that_fails_is_held_and_aborted(call, folder, tmp_path):
    file = tmp_path / "fails.toml"
    one = '[[commands]]\ncommand = "{}"\nvalues = {{ {} }}\n'
    mode = one.format("set_mode", 'region = "stabilisation", state = "science"')
    file.write_text(mode + one.format("report_status", "module_id = 1"))
    assert call("stack", "load", file, "--folder", folder)[0] == 0
    code, out, _ = call("stack", "run", "--folder", folder)
    assert code == 1 and "stack fails: held (step 1, command " in out
    assert "failed" in out and "refused (not possible in this mode)" in out
    code, out, err = call("stack", "load", file, "--folder", folder)
    assert code == 2 and "stack: must be over or aborted" in err
    code, out, _ = call("stack", "abort", "--folder", folder, "--json")
    assert code == 0 and json.loads(out)["stack"]["state"] == "aborted"


@flies
def test_stacks_are_saved_on_the_ground(call, folder, tmp_path):
    example = "examples/software/commissioning.toml"
    name = ("--name", "morning", "--folder", folder)
    assert call("stack", "save", example, *name)[0] == 0
    assert call("stack", "list", "--folder", folder)[1] == "morning\n"
    with open(example, encoding="utf-8") as file:
        assert call("stack", "text", "morning", "--folder", folder)[1] == file.read()
    code, out, _ = call("stack", "load", "morning", "--folder", folder)
    assert code == 0 and "stack morning: held" in out
    assert call("stack", "abort", "--folder", folder)[0] == 0
    assert call("stack", "delete", "morning", "--folder", folder)[0] == 0
    assert call("stack", "list", "--folder", folder)[1] == ""
    for action in ("load", "text", "delete"):
        code, _, err = call("stack", action, "morning", "--folder", folder)
        assert code == 2
        assert "name: must be that of a saved stack, and none is saved; received morning" in err


@flies
def test_the_history_is_filtered_and_written_as_csv(call, folder):
    call("send", "get_parameter", "index=0", "--as", "Zoe", "--folder", folder)
    _, out, _ = call("history", "--by", "zoe", "--folder", folder)
    assert "get_parameter index=0: executed, Zoe (stated), command line\n" in out
    _, out, _ = call("history", "--by", "zoe", "--csv", "--folder", folder)
    head, *rows = out.splitlines()
    assert head.startswith("id,request,command,values,state,reason,made_by,made,sent,")
    assert len(rows) == 1 and "Zoe (stated)" in rows[0] and rows[0].endswith("Z,")
    _, out, err = call("history", "--by", "zoe", "--state", "refused", "--folder", folder)
    assert (out, err) == ("", "note: there are no such commands\n")
    _, out, _ = call("history", "--end", "2012-01-01T00:00:00Z", "--json", "--folder", folder)
    assert json.loads(out) == []


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("cancel", "x"), "NUMBER: must be a whole number; received x"),
        (("cancel", "1.5"), "NUMBER: must be a whole number; received 1.5"),
        (("cancel", "-1"), "NUMBER: must be that of a command, from 1 on; received -1"),
        (("cancel", "0"), "NUMBER: must be that of a command, from 1 on; received 0"),
        (("cancel", "9" * 20), "NUMBER: must be that of a command, from 1 on; received 99"),
        (("cancel",), "NUMBER"),
        (("stack", "fire"), '"fire" for ACTION'),
        (("stack", "load"), "WHAT: must be given with load; received nothing"),
        (("stack", "run", "x"), "WHAT: must be left out with run; received x"),
        (("stack", "run", "--as", ""), "--as: must be 1 to 40 printable characters"),
        (("send", "x", "--as", "a\nb"), "--as: must be 1 to 40 printable characters"),
        (("stack",), "--folder: must be that of a running ground"),
        (("history",), "--folder: must hold an archive"),
        (("history", "--csv", "--json"), "--csv: must not be given with --json"),
        (("history", "--start", "x"), "--start: must be a time with a zone"),
        (("history", "--size", "0"), "--size: must lie within 1..20000"),
        (("history", "--state", "lost"), '"lost" for --state'),
    ],
)
def test_wrong_orders_get_one_line(call, tmp_path, arguments, message):
    words = arguments if "--as" in arguments else (*arguments, "--folder", tmp_path)
    code, out, err = call(*words)
    assert code == 2 and (not out or "--json" in arguments)
    assert message in err and err.startswith("error: ") and err.count("error:") == 1


@flies
def test_send_a_file(call, folder, tmp_path):
    file = tmp_path / "commands.toml"
    one = '[[commands]]\nat_s = {}\ncommand = "get_parameter"\nvalues = {{ index = {} }}\n'
    file.write_text(one.format(0, 0) + one.format(1, '"damping.gain"'))
    code, out, _ = call("send", "--file", file, "--folder", folder)
    assert code == 0 and out.count("executed") == 2
    file.write_text(one.format(0, 0) + one.format(0, '"damping"'))
    code, out, err = call("send", "--file", file, "--folder", folder)
    assert (code, out) == (2, "") and "values.index: must be one of" in err


@flies
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("set_mod",), "command: must be one of"),
        (("set_mode",), "values.region: must be given"),
        (("get_parameter", "index"), "values: must be written KEY=VALUE; received 'index'"),
        (("get_parameter", "index=nan"), "values.index: must be a whole number"),
        (("get_parameter", "index=1,2"), "values.index: must be a whole number"),
        (("get_parameter", "index=0", "--delay-s", -1), "--delay-s: must be 0 or more"),
        (
            ("get_parameter", "index=0", "--satellite", "other"),
            "--satellite: must be one of chibis",
        ),
        ((), "NAME: must be given, or --file; received neither"),
        (("x", "--file", "y.toml"), "NAME: must be given, or --file; received both"),
        (("--file", "nothing.toml"), "commands: "),
    ],
)
def test_wrong_commands_get_one_line(call, folder, arguments, message):
    code, out, err = call("send", *arguments, "--folder", folder)
    assert code == 2 and not out
    assert message in err and err.startswith("error: ") and err.count("error:") == 1


def test_without_a_running_ground_there_is_one_line(call, tmp_path):
    code, _, err = call("send", "automatic", "on=ON", "--folder", tmp_path)
    assert code == 2 and "--folder: must be that of a running ground" in err
    (tmp_path / "server.json").write_text('{"address": "http://127.0.0.1:9/?token=x"}')
    code, _, err = call("send", "automatic", "on=ON", "--folder", tmp_path)
    assert code == 2 and "--folder: must be that of a running ground" in err


OTHERS = {
    "no HTTP": b"SSH-2.0-x\r\n",
    "nothing": b"",
    "a page": b"HTTP/1.1 200 OK\r\nContent-Length: 4\r\n\r\n<a/>",
    "other JSON": b"HTTP/1.1 200 OK\r\nContent-Length: 3\r\n\r\n[5]",
    "not all of it": b"HTTP/1.1 200 OK\r\nContent-Length: 99\r\n\r\n[",
    "a refusal, not all of it": b"HTTP/1.1 500 No\r\nContent-Length: 99\r\n\r\n[",
}


@pytest.mark.parametrize("what", sorted(OTHERS))
def test_where_a_killed_ground_was_another_program_may_answer(call, alarmed, what):
    def answer():
        with suppress(OSError):
            while True:
                with server.accept()[0] as end, suppress(OSError):
                    end.recv(9999)
                    end.sendall(OTHERS[what])

    with closing(socket.create_server(("127.0.0.1", 0))) as server:
        threading.Thread(target=answer, daemon=True).start()
        address = f"http://127.0.0.1:{server.getsockname()[1]}/?token=x"
        (alarmed / "server.json").write_text(json.dumps({"address": address}))
        code, _, err = call("send", "automatic", "on=ON", "--folder", alarmed)
        assert code == 2 and "--folder: must be that of a running ground; " in err
        assert err.count("\n") == 1
        code, out, err = call("alarms", "--folder", alarmed)
        assert code == 0 and len(out.splitlines()) == 2
        assert err == "note: sat.sqlite alone is read: no ground that writes it answers\n"
        code, _, err = call("gaps", "--folder", alarmed)
        assert (code, err) == (0, "note: there are no gaps\n")


@pytest.mark.parametrize("address", [5, "", "file:///etc/passwd?token=x", "http://a.b:9/?token=x"])
def test_an_address_that_is_none_of_a_ground_gets_one_line(call, tmp_path, address):
    (tmp_path / "server.json").write_text(json.dumps({"address": address}))
    code, _, err = call("send", "automatic", "on=ON", "--folder", tmp_path)
    assert code == 2 and "must be that of a running ground, which" in err and err.count("\n") == 1


# The server


@pytest.mark.skipif(os.name == "nt", reason="signals of another kind")
@pytest.mark.parametrize("number", slow_after(1, [signal.SIGINT, signal.SIGTERM]))
def test_the_server_tells_its_address_and_ends_cleanly(tmp_path, number):
    command = [sys.executable, "-m", "torquer", "ground", "--link", "tcp:127.0.0.1:9", "--port"]
    command += ["0", "--no-browser", "--folder", str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as server:
        address = server.stdout.readline().decode().strip()
        assert address.startswith("http://127.0.0.1:") and "?token=" in address
        opened = urllib.request.build_opener(
            urllib.request.ProxyHandler({}), urllib.request.HTTPCookieProcessor()
        )
        with opened.open(address, timeout=PATIENCE_S) as page:
            assert page.status == 200 and "token" not in page.url
        second = subprocess.run(command, capture_output=True, timeout=PATIENCE_S)
        assert second.returncode == 2 and b"--folder: must not be in use" in second.stderr
        server.send_signal(number)
        _, err = server.communicate(timeout=PATIENCE_S)
    assert server.returncode == 0 and b"Traceback" not in err
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "satellite.counters",
        "satellite.sqlite",
    ]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "FILE: must be given, or --link; received neither"),
        (("g.toml", "--link", "tcp:127.0.0.1:9"), "FILE: must be given, or --link; received both"),
        (("nothing.toml",), "ground: "),
        (("g.toml", "--scenario", "s.toml"), "--scenario: must not be given with FILE"),
        (("g.toml", "--software", "s.toml"), "--software: must not be given with FILE"),
        (("g.toml", "--satellite", "chibis"), "--satellite: must not be given with FILE"),
        (("--link", "serial:1"), "error: --link: must be tcp:HOST:PORT"),
        (
            ("--link", "tcp:h:99999", "--satellite", "a"),
            "error: --link: port must be a whole number",
        ),
        (("--link", "tcp:127.0.0.1:9", "--port", 70000), "--port: must lie within 0..65535"),
        (
            ("--link", "tcp:127.0.0.1:9", "--satellite", "A B"),
            "--satellite: must be words of lower-case",
        ),
        (("--link", "tcp:127.0.0.1:9", "--scenario", "no.toml"), "scenario: "),
        (("--link", "tcp:127.0.0.1:9", "--software", "no.toml"), "software: "),
    ],
)
def test_wrong_options_get_one_line(call, tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    code, out, err = call(*arguments, "--no-browser")
    assert code == 2 and not out
    assert message in err and err.count("error:") == 1


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "satellites: must be given"),
        ("[satellites]\n", "satellites: "),
        ("[satellites.a]\n", "satellites.a.link: must be given"),
        ('[satellites.A-b]\nlink = "x"\n', "satellites.A-b"),
        ('[satellites.a]\nlink = "x"\nkey = 1\n', "satellites.a.key"),
        ('[satellites.a]\nlink = "x"\n', "error: satellites.a.link: must be tcp:HOST:PORT"),
        (
            '[satellites.b]\nlink = "tcp:h:1"\n[satellites.a]\nlink = "x"\nsoftware = "s.toml"\n',
            "error: satellites.a.software: must be a readable file; received ",
        ),
        (
            '[satellites.a]\nlink = "x"\nscenario = "s.toml"\n',
            "error: satellites.a.scenario: must be a readable file; received ",
        ),
        ("[satellites", "ground: "),
    ],
)
def test_a_wrong_ground_file_gets_one_line(call, tmp_path, text, message):
    file = tmp_path / "ground.toml"
    file.write_text(text)
    code, out, err = call(file, "--no-browser", "--folder", tmp_path / "g")
    assert code == 2 and not out
    assert message in err and err.count("error:") == 1


def test_missing_dependency_is_reported_with_the_extra_that_adds_it(call, monkeypatch, tmp_path):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    code, _, err = call("--link", "tcp:127.0.0.1:9", "--folder", tmp_path)
    assert code == 2 and "`pip install 'torquer[ground]'` adds" in err


# Recordings and exports


@pytest.fixture
def recording(tmp_path):
    software = load_link()
    made, keys = Downlink(software.dictionary), software.keys
    sender = TelemetrySender(keys.down, keys.spi, keys.spacecraft)
    frames = [made.frame("beacon", n, (1, 2, 1, 7, 255, n, 4)) for n in range(40)]
    path = tmp_path / "pass.bin"
    path.write_bytes(b"".join(map(sender.wrap, frames)) + sender.flush() + b"noise")
    return path


def test_a_recording_is_imported_and_exported(call, recording, tmp_path):
    folder = tmp_path / "archives"
    code, out, _ = call("import", recording, "--folder", folder, "--satellite", "chibis")
    assert code == 0 and "frames 40, new 40, lost bytes 5" in out
    code, out, _ = call("import", recording, "--folder", folder, "--satellite", "chibis", "--json")
    assert json.loads(out)["new"] == 0
    archive, out_folder = folder / "chibis.sqlite", tmp_path / "out"
    for format in ("netcdf", "parquet"):
        keys = ("--out", out_folder, "--format", format, "--json")
        code, out, _ = call("export", archive, *keys, "--start", "2010-01-01T00:00:10Z")
        (file,) = json.loads(out)
        assert code == 0 and file["rows"] == 30 and os.path.exists(file["file"])
    code, out, _ = call("export", archive, "--out", out_folder, "--packet", "beacon")
    assert code == 0 and "beacon.nc: 40 rows" in out


def test_recordings_of_which_nothing_is_kept_are_failures(call, recording, tmp_path):
    hexadecimal, other = tmp_path / "hex.txt", tmp_path / "other.bin"
    hexadecimal.write_text(recording.read_bytes().hex(" "))
    code, out, err = call("import", recording, hexadecimal, "--folder", tmp_path)
    assert (code, err) == (0, "") and "hex.txt: read as text in hexadecimal" in out
    assert "frames 40, new 40" in out and "came before in the recording" in out
    other.write_bytes(bytes(5000))
    code, out, err = call("import", other, "--folder", tmp_path)
    assert code == 1 and "frames 0" in out and err.count("\n") == 1
    assert err.startswith(
        "error: RECORDING: must hold frames of this satellite; received other.bin"
    )
    code, out, _ = call("import", other, recording, "--folder", tmp_path, "--json")
    found = json.loads(out)
    assert code == 1 and found["frames"] == 40 and found["failure"]
    assert {each["reason"] for each in found["left_out"]} == {"archived"}


@pytest.mark.parametrize(
    ("data", "why"),
    [(bytes(5000), "all its bytes are 00: it holds nothing"),
     (b"\xff" * 300, "all its bytes are FF: it holds nothing"),
     (b"", "no frame begins in it"), (bytes(range(256)) * 9, "no frame begins in it")],
    ids=["zeros", "erased", "empty", "of others"],
)  # fmt: skip
def test_a_refused_import_leaves_no_archive(call, tmp_path, data, why):
    other, folder = tmp_path / "other.bin", tmp_path / "archives"
    other.write_bytes(data)
    code, out, err = call("import", other, "--folder", folder)
    assert code == 1 and err.endswith(f": {why}\n")
    assert "archive: none made" in out and list(folder.iterdir()) == []
    code, out, _ = call("import", other, "--folder", folder, "--json")
    assert json.loads(out)["archive"] is None and list(folder.iterdir()) == []


def test_a_refused_import_leaves_an_archive_that_was_there(call, recording, tmp_path):
    call("import", recording, "--folder", tmp_path)
    other = tmp_path / "other.bin"
    other.write_bytes(bytes(5000))
    assert call("import", other, "--folder", tmp_path)[0] == 1
    code, out, _ = call("import", recording, "--folder", tmp_path)
    assert code == 0 and "frames 40, new 0" in out


def test_damaged_archives_are_exported_as_far_as_they_can_be_read(call, recording, tmp_path):
    call("import", recording, "--folder", tmp_path)
    archive, out_folder = tmp_path / "satellite.sqlite", tmp_path / "out"
    with closing(sqlite3.connect(archive)) as db:
        db.execute("DROP TABLE event")
        db.commit()
    code, out, err = call("export", archive, "--out", out_folder, "--format", "csv")
    assert code == 1 and "beacon.csv: 40 rows" in out
    assert err == "error: event: must be a table by the name of a packet; received none\n"
    code, out, err = call("export", archive, "--out", out_folder, "--packet", "event")
    assert (code, out) == (2, "") and err.count("\n") == 1


def test_wrong_recordings_and_archives_get_one_line(call, recording, tmp_path):
    code, _, err = call("import", tmp_path / "none.bin", "--folder", tmp_path)
    assert code == 2 and "RECORDING: must be a file" in err
    code, _, err = call("import", recording, "--folder", recording)
    assert code == 2 and "--folder: must be a folder" in err
    code, _, err = call("export", recording, "--out", tmp_path / "o")
    assert code == 2 and "archive: must be an archive" in err
    ends = ("--start", "2012-01-02T00:00:00Z", "--end", "2012-01-01T00:00:00Z")
    code, _, err = call("export", recording, "--out", tmp_path / "o", *ends)
    assert code == 2 and "--end: must not be before --start" in err
    call("import", recording, "--folder", tmp_path / "a")
    archive = tmp_path / "a" / "satellite.sqlite"
    code, out, err = call("export", archive, "--out", tmp_path / "o", "--packet", "event")
    assert (code, out) == (0, "") and "note: nothing was written" in err
    code, _, err = call("export", recording, "--out", tmp_path / "o", "--start", "2012-01-01")
    assert code == 2 and "--start: must be a time with a zone" in err
