"""`torquer board`: its address, its end, and wrong inputs."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from torquer.cli import main
from torquer.compile import engine

PATIENCE_S = 300


@pytest.mark.skipif(not engine.COMPILED, reason="whole flights: minutes without JIT")
@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
def test_it_prints_its_address_and_ends_at_a_signal():
    pytest.importorskip("uvicorn")
    command = [sys.executable, "-m", "torquer", "board", "--port", "0", "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        address = process.stdout.readline()
        assert address.startswith("http://127.0.0.1:") and "/?token=" in address
        assert process.stdout.readline() == "Ctrl-C ends it\n"
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE_S) == 0


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (("nothing.toml",), "scenario: must be a readable file; received nothing.toml"),
        (("--port", "70000"), "--port: must lie within 0..65535; received 70000"),
        (
            (str(Path("examples/my_law.toml").resolve()), "--no-user-code"),
            "control.law.file: must not be given with --no-user-code",
        ),
    ],
)
def test_a_mistake_is_one_line(arguments, line, capsys):
    pytest.importorskip("uvicorn")
    with pytest.raises(SystemExit) as left:
        main(["board", *arguments, "--no-browser"])
    _, err = capsys.readouterr()
    assert left.value.code == 2 and line in err and "Traceback" not in err
