"""The command line: outputs, exit codes, one line per mistake, and interrupted runs."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import torquer
from torquer import engine
from torquer.cli import main

needs_jit = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")

SCENARIO = """
start = 2012-03-04T10:31:47Z
seed = 5
[orbit]
kind = "circular"
altitude_km = 550
inclination_deg = 60
[environment]
field = { kind = "averaged" }
[spacecraft.body]
inertia_kg_m2 = [1.0, 1.2, 1.5]
[spacecraft.coils]
limit_a_m2 = 3.0
[spacecraft.magnetometer]
noise_nt = 20
[initial]
rate_deg_s = [1.0, -2.0, 3.0]
[control]
sample_s = 2.0
law = { kind = "bdot", gain_a_m2_s_per_t = 1e6 }
[simulation]
duration_s = 300
record_s = 5.0
"""
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
NO_JSON = json.JSONDecoder(parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))


@pytest.fixture
def scenario(tmp_path):
    path = tmp_path / "short.toml"
    path.write_text(SCENARIO)
    (tmp_path / "law.py").write_text(LAW)
    return path


def with_law(scenario, function):
    scenario.write_text(SCENARIO.replace(
        'kind = "bdot", gain_a_m2_s_per_t = 1e6',
        f'kind = "user", file = "law.py", function = "{function}"',
    ))  # fmt: skip
    return scenario


@pytest.fixture
def call(capsys):
    """`call("run", path)`: exit code, standard output, standard error of a command."""

    def run(*arguments):
        with pytest.raises(SystemExit) as left:
            main([str(argument) for argument in arguments])
        out, err = capsys.readouterr()
        assert "Traceback" not in err
        return left.value.code, out, err

    return run


@pytest.fixture
def no_report(monkeypatch):
    """Runs without pictures: they have tests of their own."""
    monkeypatch.setattr("torquer.report.write_report", lambda result, out, **_: {})


def command(*arguments, **options):
    return subprocess.run(
        [sys.executable, "-m", "torquer.cli", *map(str, arguments)],
        capture_output=True, text=True, timeout=120, **options,
    )  # fmt: skip


def same(a, b):
    return all(np.array_equal(a[name].values, b[name].values) for name in a.variables)


# ------------------------------------------------------------------ start and help


def test_help_loads_nothing_heavy():
    code = (
        "import sys\nfrom torquer.cli import main\n"
        "try:\n    main(['--help'])\nexcept SystemExit as left:\n    assert not left.code\n"
        "heavy = {'numpy', 'numba', 'scipy', 'xarray', 'pydantic', 'matplotlib', 'plotly'}\n"
        "print(sorted(heavy & set(sys.modules)), file=sys.stderr)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.strip() == "[]"
    for name in ("run", "validate", "schema", "version"):
        assert name in done.stdout


def test_importing_the_package_costs_nothing():
    code = "import sys, torquer; print(sorted({'numpy', 'numba', 'pydantic'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_every_command_has_help(call):
    for name in ("run", "validate", "schema", "version"):
        code, out, err = call(name, "--help")
        assert (code or 0, err) == (0, "")
        assert f"torquer {name}" in out


def test_version_in_text_and_json(call):
    code, out, err = call("version")
    assert (code, err) == (0, "")
    assert out.splitlines()[0] == f"torquer {torquer.__version__}"
    code, out, err = call("version", "--json")
    assert (code, err) == (0, "")
    versions = NO_JSON.decode(out)
    assert versions["torquer"] == torquer.__version__
    assert versions["numpy"] == np.__version__
    assert versions["python"] == sys.version.split()[0]


def test_schema_is_json(call):
    code, out, err = call("schema")
    assert (code, err) == (0, "")
    assert NO_JSON.decode(out)["properties"].keys() >= {"orbit", "spacecraft", "control"}


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["fly"], 'Unknown command "fly"'),
        (["run"], "scenario"),
        (["run", "a.toml", "b.toml"], "b.toml"),
        (["run", "a.toml", "--fast"], "--fast"),
        (["validate", "a.toml", "--out", "b"], "--out"),
    ],
)
def test_wrong_arguments_are_one_line_and_exit_2(call, arguments, says):
    code, out, err = call(*arguments)
    assert (code, out) == (2, "")
    assert err.startswith("error: ") and says in err
    assert err.count("\n") == 1


# ------------------------------------------------------------------ validate


def test_validate_says_what_it_found(call, scenario):
    assert call("validate", scenario) == (0, "short: valid, 300 steps of 1 s\n", "")
    code, out, err = call("validate", scenario, "--json")
    assert (code, err) == (0, "")
    assert NO_JSON.decode(out) == {"scenario": "short", "valid": True, "notes": []}


def test_validate_prints_notes(call, scenario):
    scenario.write_text(SCENARIO.replace("[1.0, -2.0, 3.0]", "[0.0, 0.0, 50.0]"))
    code, out, _ = call("validate", scenario)
    assert code == 0
    note = out.splitlines()[1]
    assert note.startswith("note: the initial rate of 50 deg/s is above the 45 deg/s")
    assert len(NO_JSON.decode(call("validate", scenario, "--json")[1])["notes"]) == 2


MISTAKES = [
    ("altitude_km = 550", "altitude_km = -550",
     ["orbit.altitude_km: must be greater than 0; received -550"]),
    ("[1.0, 1.2, 1.5]", "[1.0, 1.2, -1.5]", ["spacecraft.body.inertia_kg_m2: must be positive "
     "definite; received principal moments -1.5, 1, 1.2 kg m^2"]),
    ("limit_a_m2 = 3.0", "", ["spacecraft.coils.limit_a_m2: must be given; received nothing"]),
    ("duration_s = 300", "duration = 300\nstep_s = 0",
     ["simulation.step_s: must be greater than 0; received 0",
      "simulation.duration: must be a known key; received 300"]),
    ('field = { kind = "averaged" }', 'field = { kind = "wmm2025" }',
     ["field model wmm2025: date must lie within 2025.0..2030.0; received 2012.17"]),
    ("2012-03-04T10:31:47Z", "2031-03-04T10:31:47Z\nenvironment.field.kind = 'igrf14'\n",
     ["scenario: must be TOML; received: Cannot"]),
    ('law = { kind = "bdot", gain_a_m2_s_per_t = 1e6 }', 'law = { kind = "user", file = "no.py" }',
     ["law file: must exist; received"]),
    ("seed = 5", "seed = 5 5", ["scenario: must be TOML; received: "]),
]  # fmt: skip


@pytest.mark.parametrize("name", ["validate", "run"])
@pytest.mark.parametrize(("old", "new", "lines"), MISTAKES)
def test_mistakes_are_lines_on_stderr_and_exit_2(call, scenario, name, old, new, lines):
    assert old in SCENARIO
    scenario.write_text(SCENARIO.replace(old, new))
    out_folder = ["--out", scenario.parent / "out"] if name == "run" else []
    code, out, err = call(name, scenario, *out_folder)
    assert (code, out) == (2, "")
    assert len(err.splitlines()) == len(lines)
    for told, line in zip(err.splitlines(), lines, strict=True):
        assert told.startswith(f"error: {line}")


def test_validate_of_a_mistake_as_json(call, scenario):
    scenario.write_text(SCENARIO.replace("altitude_km = 550", "altitude_km = -550"))
    code, out, err = call("validate", scenario, "--json")
    assert (code, err) == (2, "")
    assert NO_JSON.decode(out) == {
        "valid": False,
        "errors": ["orbit.altitude_km: must be greater than 0; received -550"],
    }


@pytest.mark.parametrize("name", ["validate", "run"])
def test_a_file_that_cannot_be_read(call, tmp_path, name):
    code, out, err = call(name, tmp_path / "nowhere.toml")
    assert (code, out) == (2, "")
    assert err.startswith("error: scenario: must be a readable file; received ")
    assert err.endswith("(No such file or directory)\n")


# ------------------------------------------------------------------ run


@needs_jit
def test_run_writes_everything_and_is_quiet_in_a_pipe(scenario, tmp_path):
    out = tmp_path / "made" / "here"
    done = command("run", scenario, "--out", out, "--json", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    summary = NO_JSON.decode(done.stdout)
    assert summary["ended"] == "complete" and summary["simulated_s"] == 300.0
    assert json.loads((out / "summary.json").read_text()) == summary
    assert (out / "report.html").stat().st_size > 10_000
    assert sorted(out.glob("plots/*.png"))
    result = torquer.load(out / "result.nc")
    assert same(result, torquer.simulate(torquer.load_scenario(scenario)))
    assert {p.name for p in out.iterdir()} == {"result.nc", "summary.json", "report.html", "plots"}


@needs_jit
def test_run_shows_a_table_and_uses_the_default_folder(call, scenario, no_report, monkeypatch):
    monkeypatch.chdir(scenario.parent)
    code, out, err = call("run", scenario)
    assert (code, err) == (0, "")
    assert "Final rate" in out and "runs/short: result.nc" in out
    assert (scenario.parent / "runs" / "short" / "result.nc").is_file()


@needs_jit
def test_notes_go_to_stderr_and_leave_json_alone(call, scenario, no_report, tmp_path):
    scenario.write_text(SCENARIO.replace("[1.0, -2.0, 3.0]", "[0.0, 0.0, 50.0]"))
    code, out, err = call("run", scenario, "--json", "--out", tmp_path / "out")
    assert code == 0
    assert NO_JSON.decode(out)["initial_rate_deg_s"] == pytest.approx(50.0)
    assert len(err.splitlines()) == 2
    assert all(line.startswith("note: ") for line in err.splitlines())


def test_a_folder_that_cannot_be_made_is_found_before_the_run(call, scenario, tmp_path):
    (tmp_path / "in_the_way").write_text("")
    for out in ("in_the_way", "in_the_way/deeper"):
        code, stdout, err = call("run", scenario, "--out", tmp_path / out)
        assert (code, stdout) == (2, "")
        assert err.startswith("error: --out: must be a folder that can be written; received ")
        assert err.count("\n") == 1
    assert (tmp_path / "in_the_way").read_text() == ""


@needs_jit
def test_a_second_process_finds_the_loop_in_the_cache(scenario):
    code = (
        "import sys, torquer\nfrom torquer.simulation.step import run_steps\n"
        "torquer.simulate(torquer.load_scenario(sys.argv[1]))\n"
        "stats = run_steps.stats\n"
        "print(sum(stats.cache_hits.values()), sum(stats.cache_misses.values()))"
    )
    for _ in range(2):
        done = subprocess.run(
            [sys.executable, "-c", code, str(scenario)], capture_output=True, text=True, check=True
        )
    assert done.stdout.split() == ["1", "0"]


@needs_jit
def test_every_law_uses_the_one_compiled_loop(scenario):
    code = (
        "import sys, torquer\nfrom torquer.simulation.step import run_steps\n"
        "scenario = torquer.load_scenario(sys.argv[1])\n"
        "for kind in ('off', 'bdot', 'bdot_rate', 'bdot_derivative'):\n"
        "    gain = {} if kind == 'off' else {'gain_a_m2_s_per_t': 1e5}\n"
        "    torquer.simulate(scenario, torquer.LAWS[kind](kind=kind, **gain).law())\n"
        "print(len(run_steps.signatures))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(scenario)], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "1"


# ------------------------------------------------------------------ stopped runs


@needs_jit
def test_a_law_that_fails_leaves_what_was_computed(call, scenario, no_report, tmp_path):
    out = tmp_path / "out"
    code, stdout, err = call("run", with_law(scenario, "fails"), "--out", out, "--json")
    assert code == 2
    (line,) = err.splitlines()
    assert line.startswith(
        "error: law fails: must return a finite dipole; received (nan, 0, 0) at t = 124 s; "
    )
    assert line.endswith(f"; what was computed is in {out}")
    assert NO_JSON.decode(stdout)["simulated_s"] == 120.0
    result = torquer.load(out / "result.nc")
    assert result.time.values[-1] == 120.0
    assert line.startswith(f"error: {result.attrs['ended']}")


@needs_jit
def test_a_blow_up_leaves_json_that_can_be_read(call, scenario, no_report, tmp_path):
    text = SCENARIO.replace("limit_a_m2 = 3.0", "limit_a_m2 = 1e300").replace("= 1e6", "= 1e250")
    scenario.write_text(text)
    code, stdout, err = call("run", scenario, "--out", tmp_path / "out", "--json")
    assert code == 2
    assert "error: the state stopped being finite after t = " in err
    assert NO_JSON.decode(stdout)["ended"].startswith("the state stopped being finite")


@needs_jit
@pytest.mark.skipif(os.name == "nt", reason="signals of another kind")
def test_ctrl_c_keeps_the_result_and_resume_completes_it(scenario, tmp_path, call, no_report):
    out, flag = tmp_path / "out", tmp_path / "reached"
    process = subprocess.Popen(
        [sys.executable, "-m", "torquer.cli", "run", str(with_law(scenario, "own")),
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
    assert f"error: interrupted at t = 124 s; what was computed is in {out}\n" in err
    assert "Traceback" not in err
    part = torquer.load(out / "result.nc")
    assert part.attrs["ended"] == "interrupted at t = 124 s"
    assert part.time.values[-1] == 120.0
    assert (out / "report.html").is_file()

    code, stdout, err = call("run", scenario, "--out", out, "--resume", "--json")
    assert (code, err) == (0, "")
    assert NO_JSON.decode(stdout)["ended"] == "complete"
    unbroken = torquer.simulate(torquer.load_scenario(scenario))
    assert same(torquer.load(out / "result.nc"), unbroken)

    code, stdout, err = call("run", scenario, "--out", out, "--resume")
    assert (code, stdout) == (2, "")
    assert err.startswith("error: --resume: must find an interrupted run; received a complete one")


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
    scenario.write_text(SCENARIO.replace("seed = 5", "seed = 6"))
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
        assert err.startswith(f"error: --resume: must find a result of a run; received {path} (")
        assert err.count("\n") == 1


def test_an_interrupt_before_the_run_exits_130(call, scenario, monkeypatch):
    def interrupted(path):
        raise KeyboardInterrupt

    monkeypatch.setattr("torquer.commands.load_scenario", interrupted)
    assert call("run", scenario) == (130, "", "error: interrupted\n")


def test_examples_are_valid(call):
    for path in sorted((Path(__file__).parents[1] / "examples").glob("*.toml")):
        code, out, err = call("validate", path)
        assert (code, err) == (0, ""), path
        assert ": valid, " in out
