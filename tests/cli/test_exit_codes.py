"""What goes wrong with files: one line and exit code 2, whatever the command."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from torquer.cli.output import writing_to
from torquer.compile import engine

needs_jit = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
ORBIT = ("--altitude-km", "550", "--inclination-deg", "60")
#: Commands that read a file, which comes last.
READERS = {
    "run": ("run",),
    "validate": ("validate",),
    "wheels": ("wheels",),
    "theory": ("theory", "--scenario"),
    "field_orbit": ("field", "orbit", "--scenario"),
    "field_cone": ("field", "cone", *ORBIT, "--date", "2025-01-01", "--model"),
    "tle": ("field", "orbit", "--tle"),
}
#: Commands that write a folder, which comes last.
WRITERS = {
    "field_orbit": ("field", "orbit", *ORBIT, "--start", "2025-01-01", "--out"),
    "field_map": ("field", "map", "--out"),
    "field_cone": ("field", "cone", *ORBIT, "--date", "2025-01-01", "--out"),
    "gallery_run": ("gallery", "run", "FIELD-10", "--out"),
    "gallery_all": ("gallery", "all", "--out"),
    "theory": (
        "theory", "spin_up", *ORBIT, "--inertia", "1", "1", "1.2", "--gain", "1e5", "--out",
    ),
    "wheels": (
        "wheels", str(Path(__file__).parents[2] / "examples" / "wheels" / "foton.toml"), "--out",
    ),
}  # fmt: skip
DEEP = 10_000
#: Files with several mistakes, a line each; both lines of a TLE are reported.
SEVERAL = ("empty", "no_table", "deep_key", "long_hex", "twice")
UNREADABLE = {
    "nowhere": None,
    "empty": b"",
    "binary": bytes(range(256)) * 8,
    "zeros": bytes(1000),
    "utf16": "start = 3".encode("utf-16"),
    "twice": b"seed = 1\nseed = 2\n",
    "deep_list": b"a = " + b"[" * DEEP + b"]" * DEEP,
    "deep_table": b"a = " + b"{a=" * DEEP + b"1" + b"}" * DEEP,
    "deep_key": b".".join([b"a"] * 500) + b" = 1",
    "long_number": b"seed = " + b"1" * 5000,
    "long_hex": b"seed = 0x" + b"f" * 5000,
    "no_table": b"spacecraft = 3\n",
}


def one_line(answer) -> str:
    code, out, err = answer
    assert (code, out) == (2, ""), err
    assert err.startswith("error: ") and err.endswith("\n")
    return err


@pytest.mark.parametrize("reader", READERS)
def test_files_that_cannot_be_used(call, tmp_path, reader):
    (tmp_path / "folder").mkdir()
    for name, content in UNREADABLE.items():
        path = tmp_path / name
        if content is not None:
            path.write_bytes(content)
        err = one_line(call(*READERS[reader], path))
        assert err.count("\n") == 1 or name in SEVERAL, err
        assert len(err) < 2500
    err = one_line(call(*READERS[reader], tmp_path / "folder"))
    assert err.count("\n") == 1


def test_messages_about_unreadable_files(call, tmp_path):
    must = {
        "nowhere": "must be a readable file; received ",
        "binary": "must be a readable file; received ",
        "zeros": "must be TOML; received: ",
        "twice": "must be TOML; received: Cannot overwrite a value (at line 2, column 9)",
        "deep_list": "must have at most 32 levels of tables and lists; received more",
        "deep_table": "must have at most 32 levels of tables and lists; received more",
        "deep_key": "must have at most 32 levels of tables and lists; received more",
        "long_number": "must be TOML; received: Exceeds the limit",
    }
    for command, what in (("validate", "scenario"), ("wheels", "design")):
        for name, line in must.items():
            if UNREADABLE[name] is not None:
                (tmp_path / name).write_bytes(UNREADABLE[name])
            assert call(command, tmp_path / name)[2].startswith(f"error: {what}: {line}")


@pytest.mark.skipif(not Path("/proc/self/mem").exists(), reason="no file that cannot be read")
def test_a_file_that_cannot_be_read(call):
    for reader in ("run", "validate", "wheels", "tle"):
        err = one_line(call(*READERS[reader], "/proc/self/mem"))
        assert "must be a readable file; received /proc/self/mem (Input/output error)" in err


@pytest.mark.parametrize("writer", [*WRITERS, "run"])
def test_folders_that_cannot_be_written(call, scenario, tmp_path, writer):
    (tmp_path / "in_the_way").write_text("kept")
    command = WRITERS.get(writer, ("run", scenario, "--out"))
    long = "x" * 300
    for out in ("in_the_way", "in_the_way/deeper", long):
        err = one_line(call(*command, tmp_path / out))
        assert err.startswith("error: --out: must be a folder that can be written; received ")
        assert err.count("\n") == 1
    assert (tmp_path / "in_the_way").read_text() == "kept"


@needs_jit
@pytest.mark.skipif(not hasattr(os, "posix_fallocate"), reason="no limit that can be set")
def test_a_disk_that_is_full_ends_in_one_line(scenario, tmp_path):
    """HDF5 would crash; here files may not become longer than 50 000 bytes."""
    out = tmp_path / "out"
    code = (
        "import resource, sys, torquer\n"
        "torquer.simulate(torquer.load_scenario(sys.argv[1]))\n"  # what it compiles may be longer
        "resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, 50_000))\n"
        "from torquer.cli import main\n"
        "main(['run', *sys.argv[1:]])\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(scenario), "--out", str(out)],
        capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == (
        f"error: --out: must be a folder that can be written; received {out} (File too large)\n"
    )
    assert not out.exists()


def test_write_error_names_the_folder_unless_a_pipe_closed():
    answer = pytest.raises(ValueError, match=r"^--docs: must be a folder .*; received a \(No space")
    with answer, writing_to(Path("a"), "--docs"):
        raise OSError(28, "No space left on device")
    with pytest.raises(BrokenPipeError), writing_to(Path("a")):
        raise BrokenPipeError


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no such device")
def test_output_that_cannot_be_written():
    def command(*arguments, **streams):
        return subprocess.run([sys.executable, "-m", "torquer", *arguments], **streams, timeout=60)

    with open("/dev/full", "w") as full:
        done = command("--help", stdout=full, stderr=subprocess.PIPE)
        assert (done.returncode, done.stderr.count(b"\n")) == (2, 1)
        assert done.stderr.startswith(b"error: [Errno 28] No space left")
        assert command("fly", stdout=subprocess.PIPE, stderr=full).returncode == 2
    reader, writer = os.pipe()
    os.close(reader)
    done = command("schema", stdout=writer, stderr=subprocess.PIPE)
    os.close(writer)
    assert (done.returncode, done.stderr) == (0, b"")
