"""Any output in any encoding: code pages of Windows, the C locale, names that are no UTF-8."""

import io
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from slow_cases import slow_after

import torquer
from torquer.cli import main
from torquer.cli.output import PLAIN
from torquer.compile import engine

needs_jit = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
EXAMPLES = Path(__file__).parents[2] / "examples"
ODD_TEXT = "Спутник 中 45° [/b] :smile: $x_ {} ₀"
ORBIT = ("--altitude-km", "550", "--inclination-deg", "60")
THEORY = ("theory", "spin_up", *ORBIT, "--inertia", "1", "1", "1.2", "--gain", "1e5")
#: What a stream of that encoding does by itself with a sign that it lacks.
STREAMS = [
    ("cp1251", "strict"), ("ascii", "surrogateescape"), ("cp866", "strict"), ("cp437", "strict"),
    ("latin-1", "strict"), ("utf-8", "strict"),
]  # fmt: skip


@pytest.fixture
def odd_scenario(scenario):
    """A scenario whose file, name and description are not ASCII."""
    path = scenario.with_name("полёт.toml")
    text = f'name = "Спутник"\ndescription = "{ODD_TEXT}"\n' + scenario.read_text()
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture
def through(monkeypatch):
    """`through(stream, "run", path)`: exit code, output, errors, all written in that encoding."""

    def run(stream, *arguments):
        encoding, errors = stream
        streams = [io.TextIOWrapper(io.BytesIO(), encoding=encoding, errors=errors) for _ in "oe"]
        with monkeypatch.context() as patch, pytest.raises(SystemExit) as left:
            patch.setattr(sys, "stdout", streams[0])
            patch.setattr(sys, "stderr", streams[1])
            main([str(argument) for argument in arguments])
        for each in streams:
            each.flush()
        out, err = (each.buffer.getvalue().decode(encoding) for each in streams)
        return left.value.code or 0, out, err

    return run


@pytest.fixture
def odd_wheels(tmp_path):
    """A design of wheels whose file and description are not ASCII."""
    answer = (EXAMPLES / "wheels" / "foton.toml").read_text(encoding="utf-8")
    path = tmp_path / "колёса.toml"
    lines = (
        f'description = "{ODD_TEXT}"' if x.startswith("desc") else x for x in answer.split("\n")
    )
    path.write_text("\n".join(lines), encoding="utf-8")
    return path


@pytest.mark.parametrize("stream", slow_after(2, STREAMS), ids=lambda stream: stream[0])
def test_every_command_writes_in_every_encoding(through, odd_scenario, odd_wheels, stream):
    nowhere = odd_scenario.with_name("нет\udcff.toml")
    for code, *arguments in (
        (0, "--help"),
        (0, "run", "--help"),
        (0, "version"),
        (0, "validate", odd_scenario),
        (2, "validate", nowhere),
        (2, "run", nowhere),
        (2, "ж\udcff"),
        (0, "field", "orbit", *ORBIT, "--start", "2025-01-01", "--duration-min", "5"),
        (0, *THEORY),
        (0, "wheels", odd_wheels),
        (0, "gallery", "list"),
    ):
        got, out, err = through(stream, *arguments)
        assert got == code, (arguments, err)
        assert bool(out) == (code == 0) and bool(err) == (code == 2), arguments
        assert "Traceback" not in err and "codec" not in err


@pytest.mark.parametrize("stream", slow_after(1, STREAMS[:3]), ids=lambda stream: stream[0])
def test_json_is_ascii_in_every_encoding(through, strict_json, odd_scenario, odd_wheels, stream):
    for arguments in (
        ("schema",),
        ("version", "--json"),
        ("validate", odd_scenario, "--json"),
        ("wheels", odd_wheels, "--json"),
        ("gallery", "list", "--json"),
        (*THEORY, "--json"),
    ):
        code, out, err = through(stream, *arguments)
        assert (code, err) == (0, "") and out.isascii()
        strict_json(out)
    assert strict_json(through(stream, "validate", odd_scenario, "--json")[1])["scenario"] == (
        "Спутник"
    )


@needs_jit
@pytest.mark.parametrize("stream", STREAMS, ids=lambda stream: stream[0])
def test_a_run_writes_its_notes_and_table(through, odd_scenario, no_report, tmp_path, stream):
    text = odd_scenario.read_text(encoding="utf-8").replace("[1.0, -2.0, 3.0]", "[0, 0, 50.0]")
    odd_scenario.write_text(text, encoding="utf-8")
    out = tmp_path / "вышло\udcff"
    code, stdout, err = through(stream, "run", odd_scenario, "--out", out)
    assert code == 0
    assert err.count("note: ") == 3 and "codec" not in err
    assert "Final rate" in stdout and "result.nc" in stdout
    shown = "Спутник".encode(stream[0], "backslashreplace").decode(stream[0])
    assert shown in stdout
    summary = (out / "summary.json").read_text(encoding="utf-8")
    assert (
        json.loads(summary)["scenario"] == torquer.load(out / "result.nc").attrs["scenario"][9:16]
    )


def test_signs_are_written_plainly_where_they_are_lacking(through):
    arguments = ("field", "orbit", *ORBIT, "--start", "2025-01-01", "--duration-min", "5")
    streams = (("cp437", "strict"), ("ascii", "surrogateescape"))
    heads = [through(stream, *arguments)[1].splitlines()[0] for stream in streams]
    assert heads[0].startswith("550 km, 60°, circular")  # code page 437 has the degree sign
    assert heads[1].startswith("550 km, 60 deg, circular")
    assert all(len(sign) == 1 and not sign.isascii() for sign in PLAIN)
    assert "".join(PLAIN.values()).isascii()


def test_markup_in_a_description_is_text(through, odd_wheels):
    _, out, _ = through(STREAMS[-1], "wheels", odd_wheels)
    assert ODD_TEXT in out


# ------------------------------------------------------------------ whole processes


def process(*arguments, **environment):
    return subprocess.run(
        [sys.executable, "-m", "torquer", *arguments],
        capture_output=True, timeout=120, env=os.environ | environment,
    )  # fmt: skip


@pytest.mark.skipif(os.name == "nt", reason="names of files are of another kind")
def test_in_the_c_locale(odd_wheels):
    plain = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    done = process("wheels", str(odd_wheels), **plain)
    assert (done.returncode, done.stderr) == (0, b"")
    assert rb"\u0421\u043f\u0443\u0442\u043d\u0438\u043a \u4e2d 45 deg [/b] :smile:" in done.stdout
    done = process("validate", str(odd_wheels.with_name("нет.toml")), **plain)
    assert (done.returncode, done.stdout) == (2, b"")
    assert done.stderr.startswith(b"error: scenario: must be a readable file; received ")


@needs_jit
@pytest.mark.skipif(os.name == "nt", reason="terminals of another kind")
def test_on_a_terminal_of_a_code_page(odd_scenario, tmp_path):
    import pty

    main_end, end = pty.openpty()
    done = subprocess.Popen(
        [sys.executable, "-m", "torquer", "run", str(odd_scenario), "--out", str(tmp_path / "out")],
        stdout=end, stderr=end, env=os.environ | {"PYTHONIOENCODING": "cp437", "TERM": "xterm"},
    )  # fmt: skip
    os.close(end)
    written = b""
    while True:
        try:
            piece = os.read(main_end, 65536)
        except OSError:  # the other end is closed
            break
        if not piece:
            break
        written += piece
    os.close(main_end)
    assert done.wait(timeout=60.0) == 0
    assert rb"\u0421\u043f\u0443\u0442\u043d\u0438\u043a" in written and b"Traceback" not in written


@pytest.mark.skipif(os.name == "nt", reason="names of files are of another kind")
def test_law_at_a_non_text_path_is_refused(call, scenario):
    folder = Path(os.fsdecode(os.fsencode(scenario.parent) + b"/caf\xe9"))
    folder.mkdir()
    old = 'kind = "bdot", gain_a_m2_s_per_t = 1e6'
    text = scenario.read_text().replace(old, 'kind = "user", file = "law.py"')
    (folder / "a.toml").write_text(text)
    code, out, err = call("validate", folder / "a.toml")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith("error: control.law.file: must be a path in the encoding of the file ")
