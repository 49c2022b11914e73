"""Runs that stop: what the command line says, keeps, and goes on with."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import torquer
from torquer.compile import engine

needs_jit = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
LAW = """
import math, pathlib, time


def own(measured, parameters, memory):
    memory[0] += 1.0
    flag = pathlib.Path(__file__).with_name("reached")
    if measured.t_s == 124.0 and not flag.exists():
        flag.touch()
        time.sleep(60.0)
    return (1e4 * measured.b_body_t[0], 1e-3 * memory[0], 0.0)


def fails(measured, parameters, memory):
    return (math.nan if measured.t_s == 124.0 else 1.0, 0.0, 0.0)
"""


def with_law(scenario, function):
    scenario.with_name("law.py").write_text(LAW)
    scenario.write_text(scenario.read_text().replace(
        'kind = "bdot", gain_a_m2_s_per_t = 1e6',
        f'kind = "user", file = "law.py", function = "{function}"',
    ))  # fmt: skip
    return scenario


def same(a, b):
    """Whether two results are the same bits; numbers that are not known are so in both."""
    return all(
        np.array_equal(a[name].values, b[name].values, equal_nan=a[name].dtype.kind == "f")
        for name in a.variables
    )


@needs_jit
def test_a_law_that_fails_leaves_what_was_computed(
    call, scenario, no_report, tmp_path, strict_json
):
    out = tmp_path / "out"
    code, stdout, err = call("run", with_law(scenario, "fails"), "--out", out, "--json")
    assert code == 1
    (line,) = err.splitlines()
    assert line.startswith(
        "error: control.law: must return a finite dipole; received (nan, 0, 0) (fails in "
    )
    assert " at t = 124 s; " in line
    assert line.endswith(f"; partial results are in {out}")
    assert strict_json(stdout)["simulated_s"] == 120.0
    result = torquer.load(out / "result.nc")
    assert result.time.values[-1] == 120.0
    assert line.startswith(f"error: {result.attrs['ended']}")


@needs_jit
def test_a_blow_up_leaves_json_that_can_be_read(call, scenario, no_report, tmp_path, strict_json):
    text = scenario.read_text() + "\n[disturbance]\nconstant_torque_n_m = [0.0, 0.0, 1e3]\n"
    scenario.write_text(text)
    code, stdout, err = call("run", scenario, "--out", tmp_path / "out", "--json")
    assert code == 1
    assert "error: the state stopped being finite after t = " in err
    assert strict_json(stdout)["ended"].startswith("the state stopped being finite")


@needs_jit
@pytest.mark.skipif(os.name == "nt", reason="signals of another kind")
def test_ctrl_c_keeps_the_result_and_resume_completes_it(
    scenario, tmp_path, call, no_report, strict_json
):
    out, flag = tmp_path / "out", tmp_path / "reached"
    process = subprocess.Popen(
        [sys.executable, "-m", "torquer", "run", str(with_law(scenario, "own")),
         "--out", str(out)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    deadline = time.monotonic() + 100.0
    while not flag.exists() and time.monotonic() < deadline and process.poll() is None:
        time.sleep(0.05)
    assert flag.exists()
    time.sleep(0.2)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60.0)
    assert process.returncode == 130
    assert (
        f"error: interrupted at t = 124 s; partial results are in {out}: continue with --resume\n"
        in err
    )
    assert "Traceback" not in err
    part = torquer.load(out / "result.nc")
    assert part.attrs["ended"] == "interrupted at t = 124 s"
    assert part.time.values[-1] == 120.0
    assert not (out / "report.html").exists() and not (out / ".claimed").exists()

    before = (out / "result.nc").read_bytes()
    code, stdout, err = call("run", scenario, "--out", out)
    assert (code, stdout) == (2, "")
    assert err == (
        f"error: --out: must hold no unfinished run; received {out / 'result.nc'} (interrupted at "
        "t = 124 s): --resume continues it, --overwrite replaces it; or choose another --out\n"
    )
    assert (out / "result.nc").read_bytes() == before

    code, stdout, err = call("run", scenario, "--out", out, "--resume", "--json")
    assert (code, err) == (0, "")
    assert strict_json(stdout)["ended"] == "complete"
    unbroken = torquer.simulate(torquer.load_scenario(scenario))
    assert same(torquer.load(out / "result.nc"), unbroken)

    before = (out / "result.nc").read_bytes()
    code, stdout, err = call("run", scenario, "--out", out, "--resume")
    assert (code, err) == (0, "")  # the report of a complete run is drawn again
    assert (out / "result.nc").read_bytes() == before


@needs_jit
def test_what_cannot_go_on_gives_way_to_a_new_run(call, scenario, no_report, tmp_path):
    """A failed run and a complete one; what is no result of a run, if it is asked to."""
    out = tmp_path / "out"
    good = scenario.read_text()
    assert call("run", with_law(scenario, "fails"), "--out", out)[0] == 1
    scenario.write_text(good)
    for before in (None, None, b"no netCDF at all"):
        asked = ()
        if before:
            (out / "result.nc").write_bytes(before)
            assert call("run", scenario, "--out", out)[0] == 2
            asked = ("--overwrite",)
        assert call("run", scenario, "--out", out, *asked)[0] == 0
        assert torquer.load(out / "result.nc").attrs["how_it_ended"] == "complete"


@needs_jit
def test_a_run_stopped_as_asked_is_kept(call, scenario, no_report, tmp_path):
    part = torquer.simulate(torquer.load_scenario(scenario), until_s=100.0)
    torquer.save(part, tmp_path / "result.nc")
    code, out, err = call("run", scenario, "--out", tmp_path)
    assert (code, out) == (2, "")
    assert "(stopped at t = 100 s as asked): --resume continues it" in err
    assert call("run", scenario, "--out", tmp_path, "--resume")[0] == 0


@needs_jit
def test_a_law_named_interrupted_is_no_interrupt(call, scenario, no_report, tmp_path, monkeypatch):
    """The exit code does not hang on the words of the message."""
    simulate = torquer.simulate

    def stopped(scenario, **_):
        result = simulate(scenario, until_s=10.0)
        raise torquer.RunStopped("interrupted at will", result, interrupted=False)

    monkeypatch.setattr("torquer.simulation.setup.simulate.simulate", stopped)
    assert call("run", scenario, "--out", tmp_path)[0] == 1


def test_resume_without_a_run(call, scenario, tmp_path):
    code, out, err = call("run", scenario, "--out", tmp_path / "empty", "--resume")
    assert (code, out) == (2, "")
    assert err == (
        "error: --resume: must find an interrupted run; "
        f"received {tmp_path / 'empty'} without result.nc\n"
    )


@needs_jit
def test_resume_of_another_scenario(call, scenario, tmp_path):
    part = torquer.simulate(torquer.load_scenario(scenario), until_s=100.0)
    (tmp_path / "out").mkdir()
    torquer.save(part, tmp_path / "out" / "result.nc")
    scenario.write_text(scenario.read_text().replace("seed = 5", "seed = 6"))
    code, out, err = call("run", scenario, "--out", tmp_path / "out", "--resume")
    assert (code, out) == (2, "")
    assert err.startswith("error: --resume: the scenario must be the one that ")


def test_resume_from_what_is_no_result(call, scenario, tmp_path):
    import xarray

    path = tmp_path / "result.nc"
    for write in (lambda: path.write_bytes(b"no netCDF at all"),
                  lambda: xarray.Dataset({"x": 1}).to_netcdf(path, engine="h5netcdf")):  # fmt: skip
        write()
        code, out, err = call("run", scenario, "--out", tmp_path, "--resume")
        assert (code, out) == (2, "")
        assert err == (
            "error: --resume: must find a result of a run; received result: must be as torquer "
            f"wrote it; received {path}, damaged or edited since\n"
        )
        assert err.count("\n") == 1


def test_an_interrupt_before_the_run_exits_130(call, scenario, monkeypatch):
    def interrupted(path):
        raise KeyboardInterrupt

    monkeypatch.setattr("torquer.scenario.load.load_scenario", interrupted)
    assert call("run", scenario) == (130, "", "error: interrupted\n")


#: An import that is interrupted, and then ends well or with an error of another kind.
WHILE_IMPORTED = {
    "raised": "{interrupt}",
    "swallowed": "try:\n    {interrupt}\nexcept BaseException:\n    pass",
    "disguised": "try:\n    {interrupt}\nexcept BaseException:\n    raise RuntimeError('no class')",
    "in text": "exec({interrupt!r})",
}


@pytest.mark.skipif(os.name == "nt", reason="signals of another kind")
@pytest.mark.parametrize("how", WHILE_IMPORTED)
@pytest.mark.parametrize("module", ["cyclopts", "pydantic"])
def test_an_interrupt_while_something_is_imported(scenario, tmp_path, module, how):
    """Whatever the import makes of it: one line and 130; first, and within a command."""
    interrupt = "import os, signal, time; os.kill(os.getpid(), signal.SIGINT); time.sleep(0)"
    (tmp_path / "first").mkdir()
    text = WHILE_IMPORTED[how].format(interrupt=interrupt)
    (tmp_path / "first" / f"{module}.py").write_text(text + "\n")
    package = str(Path(torquer.__file__).parents[1])
    done = subprocess.run(
        [sys.executable, "-m", "torquer", "run", str(scenario), "--out", str(tmp_path / "out")],
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(tmp_path / "first"), package])},
        cwd=tmp_path, capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "error: interrupted\n")


def test_a_caller_keeps_its_own_way_with_interrupts(call, scenario):
    """After a command, and where they are ignored, as in the background of a shell."""
    usual = signal.getsignal(signal.SIGINT)
    call("validate", scenario)
    assert signal.getsignal(signal.SIGINT) is usual
    try:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        call("validate", scenario)
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, usual)


def test_a_command_may_be_called_from_another_thread(scenario, capsys):
    from concurrent.futures import ThreadPoolExecutor

    from torquer.cli import main

    with ThreadPoolExecutor(1) as threads, pytest.raises(SystemExit) as left:
        threads.submit(main, ["validate", str(scenario)]).result()
    assert left.value.code == 0
    assert capsys.readouterr().out.startswith("short: valid")


LATE = """
import atexit, os, signal, sys
from torquer.cli import main
atexit.register(os.kill, os.getpid(), signal.SIGINT)
sys.argv = ["torquer", "version"]
main()
"""


@pytest.mark.skipif(os.name == "nt", reason="signals of another kind")
def test_an_interrupt_after_the_command_is_no_traceback():
    """As Python ends: what was asked for is done and printed."""
    process = subprocess.Popen(
        [sys.executable, "-c", LATE],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip
    out, err = process.communicate(timeout=60.0)
    assert process.returncode == -signal.SIGINT
    assert "torquer" in out
    assert err == ""
