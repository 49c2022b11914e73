"""The command line: outputs, exit codes, and one line per mistake."""

import json
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import torquer
from torquer.compile import engine, sources
from torquer.simulation.loop.step import run_steps

needs_jit = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")


def command(*arguments, **options):
    return subprocess.run(
        [sys.executable, "-m", "torquer", *map(str, arguments)],
        capture_output=True, text=True, timeout=120, **options,
    )  # fmt: skip


def same(a, b):
    """Whether two results are the same bits; numbers that are not known are so in both."""
    return all(
        np.array_equal(a[name].values, b[name].values, equal_nan=a[name].dtype.kind == "f")
        for name in a.variables
    )


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


@pytest.mark.parametrize(
    ("arguments", "given", "threads"),
    [
        ("", {}, "1"),
        ("", {"OPENBLAS_NUM_THREADS": ""}, "1"),
        ("", {"OPENBLAS_NUM_THREADS": "3"}, "3"),
        ("", {"OPENBLAS_DEFAULT_NUM_THREADS": "3"}, "none"),
        ("", {"GOTO_NUM_THREADS": "3"}, "none"),
        ("", {"OMP_NUM_THREADS": "3"}, "none"),
        ("['version']", {}, "none"),
    ],
    ids=str,
)
def test_numpy_has_one_thread_in_the_process_of_a_command(arguments, given, threads):
    """Unless the user asks for a number, by any of the names that OpenBLAS knows."""
    code = (
        "import os, sys\nfrom torquer.cli import main\nsys.argv = ['torquer', 'version']\n"
        f"try:\n    main({arguments})\nexcept SystemExit as left:\n    assert not left.code\n"
        "print(os.environ.get('OPENBLAS_NUM_THREADS', 'none'), file=sys.stderr)\n"
    )
    environment = {k: v for k, v in os.environ.items() if not k.endswith("_NUM_THREADS")} | given
    of_a_command = {"capture_output": True, "text": True, "check": True, "env": environment}
    done = subprocess.run([sys.executable, "-c", code], **of_a_command)
    assert done.stderr.strip() == threads


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="counts threads as Linux does")
def test_the_thread_that_a_command_asks_for_is_the_only_one():
    code = (
        "import os, sys\nfrom torquer.cli import main\nsys.argv = ['torquer', 'version']\n"
        "try:\n    main()\nexcept SystemExit:\n    pass\n"
        "import numpy\nnumpy.ones((2, 2)) @ numpy.ones((2, 2))\n"
        "print(len(os.listdir('/proc/self/task')), file=sys.stderr)\n"
    )
    environment = {k: v for k, v in os.environ.items() if not k.endswith("_NUM_THREADS")}
    of_a_command = {"capture_output": True, "text": True, "check": True, "env": environment}
    done = subprocess.run([sys.executable, "-c", code], **of_a_command)
    assert done.stderr.strip() == "1"


def test_importing_the_package_costs_nothing():
    code = "import sys, torquer; print(sorted({'numpy', 'numba', 'pydantic'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_every_command_has_help(call):
    for name in ("run", "validate", "schema", "version"):
        code, out, err = call(name, "--help")
        assert (code or 0, err) == (0, "")
        assert f"torquer {name}" in out


def test_version_in_text_and_json(call, strict_json):
    code, out, err = call("version")
    assert (code, err) == (0, "")
    assert out.splitlines()[0] == f"torquer {torquer.__version__}"
    code, out, err = call("version", "--json")
    assert (code, err) == (0, "")
    versions = strict_json(out)
    assert versions["torquer"] == torquer.__version__
    assert versions["numpy"] == np.__version__
    assert versions["python"] == sys.version.split()[0]


def test_schema_is_json(call, strict_json):
    code, out, err = call("schema")
    assert (code, err) == (0, "")
    assert strict_json(out)["properties"].keys() >= {"orbit", "spacecraft", "control"}


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["swim"], 'Unknown command "swim"'),
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


def test_validate_says_what_it_found(call, scenario, strict_json):
    code, out, err = call("validate", scenario)
    valid, size = out.splitlines()
    assert (code, valid, err) == (0, "short: valid, 5 min of flight; rk4, steps of 1 s", "")
    assert size.startswith("a run: 61 rows, result of about 23.9 kB, about 30")
    assert size.endswith(" of memory and less than 1 s of computing")
    code, out, err = call("validate", scenario, "--json")
    assert (code, err) == (0, "")
    answer = strict_json(out)
    size = answer.pop("size")
    assert answer == {"scenario": "short", "valid": True, "notes": [], "executes": [], "modes": [],
                      "unnoticed_faults": {"at_all": [], "by_motion": []},
                      "compiles_first": False}  # fmt: skip
    assert (size["steps"], size["rows"], size["disk_bytes"]) == (300, 61, 61 * 49 * 8)


FIRST = "before that the first run compiles the simulation, once: half a minute to a minute"


def test_validate_says_whether_the_first_run_compiles(scenario, tmp_path):
    """With an empty cache, though `validate` does without the compiler; with the loop in it not."""
    root = tmp_path / "cache"
    given = {"TORQUER_CACHE_DIR": str(root), "NUMBA_DISABLE_JIT": "0"}

    def lines(*options, **changes):
        command = [sys.executable, "-m", "torquer", "validate", str(scenario), *options]
        environment = os.environ | given | changes
        return subprocess.run(
            command, env=environment, capture_output=True, text=True, check=True
        ).stdout

    assert FIRST in lines()
    assert FIRST not in lines(NUMBA_DISABLE_JIT="1")
    kept = root / sources.source_key() / "torquer.simulation.loop"
    kept.mkdir(exist_ok=True)
    (kept / "step._run_steps-0.nbi").touch()
    assert json.loads(lines("--json"))["compiles_first"] is False


@pytest.mark.parametrize("has_loop", [True, False])
def test_validate_says_it_as_text_and_as_json(call, scenario, strict_json, monkeypatch, has_loop):
    monkeypatch.setattr("torquer.cli.compiling._has_loop", lambda: has_loop)
    assert (FIRST in call("validate", scenario)[1]) != has_loop
    assert strict_json(call("validate", scenario, "--json")[1])["compiles_first"] != has_loop


@needs_jit
def test_the_printed_size_is_that_of_the_result(call, scenario, no_report, strict_json, tmp_path):
    scenario.write_text(scenario.read_text().replace("record_s = 5.0", "record_s = 1.0"))
    size = strict_json(call("validate", scenario, "--json")[1])["size"]
    call("run", scenario, "--out", tmp_path / "out")
    result = torquer.load(tmp_path / "out" / "result.nc")
    assert size["rows"] == result.sizes["time"]
    row = sum(v.nbytes for v in result.variables.values() if "time" in v.dims)
    assert size["disk_bytes"] == row


HUGE = {
    "machine_memory": "must fit in the 1 MB of memory of this machine; received a run that",
    "free_disk": "must fit in the 1 kB that are free at ",
}


@pytest.mark.parametrize("name", ["validate", "run"])
@pytest.mark.parametrize("limit", HUGE)
def test_what_cannot_fit_is_one_line(call, scenario, monkeypatch, name, limit, tmp_path):
    there = {"machine_memory": lambda: 1e6, "free_disk": lambda folder: 1e3}
    monkeypatch.setattr(f"torquer.simulation.setup.size.{limit}", there[limit])
    code, out, err = call(name, scenario, *(["--out", tmp_path / "out"] if name == "run" else []))
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith("error: simulation: 61 rows of the record (duration over record_s) ")
    assert HUGE[limit] in err


def test_a_billion_seconds_are_refused_before_the_run(call, scenario, monkeypatch):
    text = scenario.read_text().replace("duration_s = 300", "duration_s = 1e9")
    turn = '[environment]\nearth_rotation = "sidereal"'  # the precise one takes seconds here
    scenario.write_text(text.replace("[environment]", turn).replace("5.0", "1.0"))
    monkeypatch.setattr("torquer.simulation.setup.size.machine_memory", lambda: 24e9)
    monkeypatch.setattr("torquer.simulation.setup.size.free_disk", lambda folder: 300e9)
    code, _, err = call("validate", scenario)
    assert code == 2
    assert "error: simulation: 1e+09 rows of the record (duration over record_s) must fit" in err


def test_validate_prints_notes(call, scenario, strict_json):
    scenario.write_text(scenario.read_text().replace("[1.0, -2.0, 3.0]", "[0.0, 0.0, 50.0]"))
    code, out, _ = call("validate", scenario)
    assert code == 0
    note = out.splitlines()[2]
    assert note.startswith("note: the initial rate of 50 deg/s is above the 45 deg/s")
    assert len(strict_json(call("validate", scenario, "--json")[1])["notes"]) == 2


MISTAKES = [
    ("altitude_km = 550", "altitude_km = -550",
     ["orbit.altitude_km: must be greater than 0; received -550"]),
    ("[1.0, 1.2, 1.5]", "[1.0, 1.2, -1.5]", ["spacecraft.body.inertia_kg_m2: must be positive "
     "definite; received principal moments -1.5, 1, 1.2 kg m^2"]),
    ("limit_a_m2 = 3.0", "", ["spacecraft.coils.limit_a_m2: must be given without "
     "windings; received none"]),
    ("step_s = 1.0\nduration_s = 300", "duration = 300\nstep_s = 0",
     ["simulation.step_s: must be greater than 0; received 0",
      "simulation.duration: must be a known key; received 300 (did you mean duration_s?)"]),
    ('field = { kind = "averaged" }', 'field = { kind = "wmm2025" }',
     ["environment.field: field model wmm2025: date must lie within 2025.0..2030.0; received "
      "2012.17"]),
    ('[environment]\nfield = { kind = "averaged" }',
     '[environment]\nfield = { kind = "igrf14", held_at_year = 2031 }\nut1_minus_utc_s = 0.95',
     ["environment.ut1_minus_utc_s: must be less than or equal to 0.9; received 0.95"]),
    ("2012-03-04T10:31:47Z", "2031-03-04T10:31:47Z\nenvironment.field.kind = 'igrf14'\n",
     ["scenario: must be TOML; received: Cannot"]),
    ('law = { kind = "bdot", gain_a_m2_s_per_t = 1e6 }', 'law = { kind = "user", file = "no.py" }',
     ["control.law.file: must be an existing file; received"]),
    ("seed = 5", "seed = 5 5", ["scenario: must be TOML; received: "]),
]  # fmt: skip


@pytest.mark.parametrize("name", ["validate", "run"])
@pytest.mark.parametrize(("old", "new", "lines"), MISTAKES)
def test_mistakes_are_lines_on_stderr_and_exit_2(call, scenario, name, old, new, lines):
    assert old in scenario.read_text()
    scenario.write_text(scenario.read_text().replace(old, new))
    out_folder = ["--out", scenario.parent / "out"] if name == "run" else []
    code, out, err = call(name, scenario, *out_folder)
    assert (code, out) == (2, "")
    assert len(err.splitlines()) == len(lines)
    for answer, line in zip(err.splitlines(), lines, strict=True):
        assert answer.startswith(f"error: {line}")


def test_validate_of_a_mistake_as_json(call, scenario, strict_json):
    scenario.write_text(scenario.read_text().replace("altitude_km = 550", "altitude_km = -550"))
    code, out, err = call("validate", scenario, "--json")
    assert (code, err) == (2, "")
    assert strict_json(out) == {
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
def test_run_writes_everything_and_is_quiet_in_a_pipe(scenario, tmp_path, strict_json):
    out = tmp_path / "made" / "here"
    flown = torquer.simulate(
        torquer.load_scenario(scenario)
    )  # and compiled, of which there is a note
    done = command("run", scenario, "--out", out, "--json", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    summary = strict_json(done.stdout)
    assert summary["ended"] == "complete" and summary["simulated_s"] == 300.0
    assert json.loads((out / "summary.json").read_text()) == summary
    assert (out / "report.html").stat().st_size > 10_000
    result = torquer.load(out / "result.nc")
    assert same(result, flown)
    assert {p.name for p in out.iterdir()} == {"result.nc", "summary.json", "report.html"}


@needs_jit
def test_a_page_is_written_when_it_is_asked_for(call, scenario, tmp_path):
    """Also of a complete run."""
    out = tmp_path / "out"
    code, said, _ = call("run", scenario, "--out", out, "--page")
    assert code == 0 and said.endswith("result.nc, summary.json, report.html, page.pdf\n")
    assert (out / "page.pdf").read_bytes().startswith(b"%PDF")
    (out / "page.pdf").unlink()
    assert call("run", scenario, "--out", out, "--resume", "--page")[0] == 0
    assert (out / "page.pdf").exists()


@needs_jit
def test_figures_for_a_paper_are_told_and_old_ones_removed(call, scenario, tmp_path):
    out = tmp_path / "out"
    code, said, _ = call("run", scenario, "--out", out, "--figure", "paper")
    assert code == 0 and said.endswith("result.nc, summary.json, report.html, paper/\n")
    assert {each.suffix for each in out.glob("paper/rate_1.*")} == {".png", ".pdf", ".svg"}
    code, _, error = call("run", scenario, "--out", out, "--figure", "screen")
    assert code == 2 and error == (
        'error: Invalid value "screen" for --figure. Choose from: "paper".\n'
    )
    for each in out.glob("paper/*"):
        os.utime(each, (0, 0))
    assert call("run", scenario, "--out", out, "--overwrite")[0] == 0
    assert not list(out.glob("paper/*"))


@pytest.mark.parametrize("name", ["run", "campaign"])
@pytest.mark.parametrize("option", [("--page",), ("--figure", "paper")])
def test_pictures_need_a_report(call, name, option):
    code, _, err = call(name, "any.toml", *option, "--no-report")
    assert code == 2
    assert err == f"error: {option[0]}: must not be given with --no-report; received both\n"


@needs_jit
def test_pictures_are_drawn_when_they_are_asked_for(call, scenario, tmp_path):
    """Also of a complete run; those of an earlier result do not outlive it."""
    out = tmp_path / "out"
    assert call("run", scenario, "--out", out)[0] == 0
    before = (out / "result.nc").read_bytes()
    code, text, _ = call("run", scenario, "--out", out, "--resume", "--plots")
    assert code == 0 and text.endswith("result.nc, summary.json, report.html, plots/\n")
    assert {path.stem for path in out.glob("plots/*.png")} >= {"overview", "rate", "ground_track"}
    assert (out / "result.nc").read_bytes() == before
    assert call("run", scenario, "--out", out, "--resume")[0] == 0
    assert list(out.glob("plots/*.png"))
    code, text, _ = call("run", scenario, "--out", out, "--overwrite")
    assert code == 0 and text.endswith("result.nc, summary.json, report.html\n")
    assert not list(out.glob("plots/*"))
    code, _, err = call("run", scenario, "--out", out, "--plots", "--no-report")
    assert (code, err) == (
        2, "error: --plots: must not be given with --no-report; received both\n"
    )  # fmt: skip


@pytest.mark.parametrize("wrong", ["nan", "-1", "0"])
def test_a_wrong_time_between_saves_is_found_before_any_work(call, scenario, tmp_path, wrong):
    """Under the option's own name."""
    out = tmp_path / "out"
    code, said, err = call("run", scenario, "--out", out, f"--checkpoint-s={wrong}")
    must = f"error: --checkpoint-s: must be greater than 0; received {wrong}\n"
    assert (code, said, err, out.exists()) == (2, "", must, False)


@needs_jit
def test_run_measures_the_error_of_the_steps_when_asked(call, scenario, no_report, tmp_path):
    code, out, err = call("run", scenario, "--out", tmp_path / "out", "--check-steps")
    assert (code, err) == (0, "")
    assert "Integration error, measured" in out
    found = json.loads((tmp_path / "out" / "summary.json").read_text())
    errors = torquer.integration_error(torquer.load_scenario(scenario)).attitude_error
    measured_rad = math.radians(found["integration_error_measured_deg"])
    assert measured_rad == pytest.approx(float(errors.max()), rel=1e-12) and measured_rad > 0.0


@needs_jit
def test_steps_whose_check_stops_are_reported(call, scenario, no_report, tmp_path, monkeypatch):
    def stopped(result, progress):
        raise torquer.RunStopped("interrupted at t = 10 s", result, True)

    monkeypatch.setattr("torquer.simulation.setup.step_error.integration_error", stopped)
    code, _, err = call("run", scenario, "--out", tmp_path / "out", "--check-steps")
    assert (code, err) == (0, "note: the steps are not checked: interrupted at t = 10 s\n")
    assert "measured" not in (tmp_path / "out" / "summary.json").read_text()


@needs_jit
def test_run_shows_a_table_and_uses_the_default_folder(call, scenario, no_report, monkeypatch):
    monkeypatch.chdir(scenario.parent)
    code, out, err = call("run", scenario)
    assert (code, err) == (0, "")
    assert "Final rate" in out and "runs/short: result.nc" in out
    assert (scenario.parent / "runs" / "short" / "result.nc").is_file()


@needs_jit
def test_notes_go_to_stderr_and_leave_json_alone(call, scenario, no_report, tmp_path, strict_json):
    scenario.write_text(scenario.read_text().replace("[1.0, -2.0, 3.0]", "[0.0, 0.0, 50.0]"))
    code, out, err = call("run", scenario, "--json", "--out", tmp_path / "out")
    assert code == 0
    assert strict_json(out)["initial_rate_deg_s"] == pytest.approx(50.0)
    answer = [line.removeprefix("note: ")[:24] for line in err.splitlines()]
    assert answer == [
        "the initial rate of 50 d",
        "the body rotates by 50 d",
        "the steps of RK4 made th",
    ]


def test_uncreatable_folder_is_found_before_the_run(call, scenario, tmp_path):
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
        "import sys, torquer\nfrom torquer.simulation.loop.step import run_steps\n"
        "torquer.simulate(torquer.load_scenario(sys.argv[1]))\n"
        "stats = run_steps.kernel.stats\n"
        "print(sum(stats.cache_hits.values()), sum(stats.cache_misses.values()))"
    )
    torquer.simulate(torquer.load_scenario(scenario))
    done = subprocess.run(
        [sys.executable, "-c", code, str(scenario)], capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == ["1", "0"]


@needs_jit
def test_a_warm_start_loads_nothing_that_it_does_not_use(call, scenario, tmp_path):
    """Rules of the compiler, drawing, SciPy's rotations: each costs a quarter of a second or more.

    The report draws nothing: its page does, in the browser.
    """
    heavy = ("numba.np.linalg", "matplotlib", "plotly", "scipy.spatial", "scipy.stats")
    code = (
        "import sys\nfrom torquer.cli import main\n"
        "try: main(sys.argv[1:])\n"
        f"finally: print([name for name in {heavy!r} if name in sys.modules])"
    )
    run = ["run", str(scenario), "--overwrite", "--out", str(tmp_path / "out")]
    assert call(*run)[0] == 0  # may have to compile
    done = subprocess.run(
        [sys.executable, "-c", code, *run], capture_output=True, text=True, check=True
    )
    assert done.stdout.splitlines()[-1] == "[]"


def test_a_scenario_is_checked_without_the_compiler(scenario):
    """Loading it takes as long as all the rest."""
    code = (
        "import sys\nfrom torquer.cli import main\n"
        "try: main(sys.argv[1:])\n"
        "finally: print([name for name in ('numba', 'xarray') if name in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, "validate", str(scenario)],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert done.stdout.splitlines()[-1] == "[]"


@needs_jit
@pytest.mark.parametrize("own_law", [False, True])
def test_packages_that_no_run_uses_are_left_to_the_users_code(scenario, tmp_path, own_law):
    """xarray and pandas import them wherever they are installed."""
    code = (
        "import sys\nfrom torquer.cli import main\n"
        "try: main()\n"
        "finally: print([name in sys.modules and sys.modules[name] is None for name in "
        "('dask', 'pyarrow')], 'dask.array' in sys.modules)"
    )
    if own_law:
        (tmp_path / "law.py").write_text(
            "import torquer\n@torquer.law\n"
            "def idle(inputs, parameters, memory):\n    return 0.0, 0.0, 0.0\n"
        )
        text = scenario.read_text()
        law = 'law = { kind = "user", file = "law.py" }'
        scenario.write_text(text.replace('law = { kind = "bdot", gain_a_m2_s_per_t = 1e6 }', law))
    run = ["run", str(scenario), "--json", "--out", str(tmp_path / "out")]
    done = subprocess.run(
        [sys.executable, "-c", code, *run], capture_output=True, text=True, check=True
    )
    assert (tmp_path / "out" / "report.html").exists()
    expected = "[False, False] True" if own_law else "[True, True] False"
    assert done.stdout.splitlines()[-1] == expected


@needs_jit
def test_every_law_uses_the_one_compiled_loop(scenario):
    flown = torquer.load_scenario(scenario)
    counts = set()
    for kind in ("off", "bdot", "bdot_rate", "bdot_derivative"):
        gain = {} if kind == "off" else {"gain_a_m2_s_per_t": 1e5}
        torquer.simulate(flown, torquer.LAWS[kind](kind=kind, **gain).law())
        counts.add(len(run_steps.kernel.signatures))
    assert len(counts) == 1


def test_examples_are_valid(call):
    for path in sorted((Path(__file__).parents[2] / "examples").glob("*.toml")):
        code, out, err = call("validate", path)
        assert (code, err) == (0, ""), path
        assert ": valid, " in out
