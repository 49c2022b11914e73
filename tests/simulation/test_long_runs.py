"""Long runs are computed in pieces: the same bits wherever the result goes and a run stops."""

import errno
import signal

import numpy as np
import pytest
from integrators import by
from slow_cases import slow_after

from torquer import RunStopped, law, load, resume, save, simulate
from torquer.compile import engine
from torquer.environment.table import build, lookup3
from torquer.scenario.load import scenario_from_data
from torquer.simulation.results.store import InFile, parts_folder
from torquer.simulation.setup import checkpoints as pieces, run as runner, size as sizes
from torquer.simulation.setup.checkpoints import NotSaved
from torquer.simulation.setup.size import estimate_size, piece_steps

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")

#: All that a record may hold and a run may remember; records off the cycle, and now and then.
FULL = {
    "environment.field": {"kind": "igrf14"},
    "environment.earth_rotation": "precise",
    "spacecraft.magnetometer": {"noise_nt": 50.0, "coil_disturbance_nt_per_a_m2": 100.0},
    "spacecraft.gyro": {"noise_deg_s": 0.01, "bias_drift_deg_s_sqrt_s": 0.001},
    "spacecraft.sun_sensors": {"axes": [[1, 0, 0], [-1, 2, 0]], "half_field_deg": 80.0},
    "spacecraft.coils": {"limit_a_m2": 3.0, "lag_s": 0.7},
    "spacecraft.wheels": {"layout": {"kind": "orthogonal"}, "momentum_limit_n_m_s": 1.0,
                          "torque_limit_n_m": 0.01, "speed_noise_rpm": 1.0},
    "control": {"laws": {
                    "coils": {"kind": "bdot", "gain_a_m2_s_per_t": 1e5},
                    "wheels": {"kind": "wheel_pd", "bandwidth_rad_s": 0.01,
                               "reference": "inertial", "inertia_kg_m2": [1.0, 1.3, 1.7]}},
                "sample_s": 3.0, "measure_s": 6.0, "actuate_s": 4.0},
    "simulation": {"duration_s": 1505.0, "step_s": 0.5, "record_s": 7.0},
    "seed": 7,
}  # fmt: skip
#: A satellite of which little is recorded: what files cost goes with the number of variables.
LITTLE = {
    "control": {"law": {"kind": "bdot", "gain_a_m2_s_per_t": 1e5}, "sample_s": 3.0},
    "simulation": {"duration_s": 1750.0, "step_s": 0.5, "record_s": 250.0},
}
WAYS = {
    "records": (FULL, 55),
    "few records": (LITTLE, 2),
    "exact tables": (FULL | {"environment.table_tolerance": 0.0}, 55),
    "adaptive steps": (FULL | by("auto"), 55),
}
#: For what concerns files, not bits: those that differ in where pieces end.
OF_FILES = pytest.mark.parametrize(
    "scenario", slow_after(1, ["few records", "records"]), indirect=True
)


@pytest.fixture(params=slow_after(0, list(WAYS)[:3]) + list(WAYS)[3:])
def scenario(make, request, monkeypatch):
    """A scenario of four pieces: each costs some tenths of a second in a file."""
    changes, rows = WAYS[request.param]
    monkeypatch.setattr(sizes, "_PIECE_ROWS", rows)
    monkeypatch.setattr(sizes, "_PIECE_EXACT_STEPS", 800)
    made = make(changes)
    assert 3.0 < made.steps() / piece_steps(made) < 4.0
    return made


def same(a, b):
    """Whether two results hold the same bits and tell the same."""
    assert sorted(a.variables) == sorted(b.variables)
    for name in a.variables:
        assert a[name].dtype == b[name].dtype, name
        kind = a[name].dtype.kind
        assert np.array_equal(a[name].values, b[name].values, equal_nan=kind == "f"), name
        assert a[name].attrs == b[name].attrs, name
    assert a.attrs == b.attrs
    return True


def test_a_result_in_a_file_is_that_in_memory(scenario, tmp_path):
    whole = simulate(scenario)
    assert (
        whole.sizes["time"]
        == scenario.steps() // round(scenario.simulation.record_s / scenario.grid_s) + 1
    )
    with simulate(scenario, to=tmp_path / "result.nc") as lazy:
        assert same(lazy, whole)
    assert same(load(tmp_path / "result.nc"), whole)
    save(whole, tmp_path / "saved.nc")
    assert same(load(tmp_path / "saved.nc"), whole)


def test_stopped_anywhere_it_goes_on_with_the_same_bits(scenario, tmp_path):
    """Within a piece, and where one ends; in memory, in the file, and from one to the other."""
    whole, path = simulate(scenario), tmp_path / "result.nc"
    border_s = 2.0 * piece_steps(scenario) * 0.5
    within_s = border_s + 40.0
    parts = {stop_s: simulate(scenario, until_s=stop_s) for stop_s in (0.0, border_s, within_s)}
    for part in parts.values():
        assert same(resume(part), whole)
    simulate(scenario, until_s=border_s, to=path).close()
    stopped = load(path)
    assert same(stopped, parts[border_s]) and same(resume(stopped), whole)
    with resume(path, until_s=within_s) as later:
        assert later.attrs["how_it_ended"] == "stopped"
        assert same(later, parts[within_s])
    with resume(path) as ended:
        assert same(ended, whole)


@OF_FILES
def test_an_interrupted_run_keeps_what_it_has(scenario, tmp_path, monkeypatch):
    """By the keyboard, and by the end of the process while a piece is computed."""
    whole, path, calls = simulate(scenario), tmp_path / "result.nc", []

    def impatient(part):
        if part > 0.6:
            raise KeyboardInterrupt

    monkeypatch.setattr(pieces, "_PIECE_S", 1e9)
    with pytest.raises(RunStopped, match="interrupted at t = ") as stopped:
        simulate(scenario, to=path, progress=impatient)
    stopped.value.result.close()
    with resume(path) as ended:
        assert same(ended, whole)

    own = runner.tabulate_piece

    def killed(*arguments):
        calls.append(arguments)
        if len(calls) == 4:
            raise SystemExit
        return own(*arguments)

    monkeypatch.setattr(runner, "tabulate_piece", killed)
    with pytest.raises(SystemExit):
        simulate(scenario, to=path)
    monkeypatch.setattr(runner, "tabulate_piece", own)
    kept = load(path)
    assert kept.attrs["how_it_ended"] == "interrupted"
    assert kept.checkpoint.values[0] == piece_steps(scenario)
    assert len(list(parts_folder(path).iterdir())) == 2
    with resume(path) as ended:
        assert same(ended, whole)
    assert not parts_folder(path).exists()


@OF_FILES
def test_run_killed_while_writing_its_second_piece_goes_on(scenario, tmp_path):
    whole, path = simulate(scenario), tmp_path / "result.nc"
    simulate(scenario, until_s=100.0, to=path).close()
    parts_folder(path).mkdir()
    (parts_folder(path) / "000000000400.nc.part").write_bytes(b"begun")
    with resume(path) as ended:
        assert same(ended, whole)
    assert not parts_folder(path).exists()


@OF_FILES
def test_unwritable_checkpoint_is_reported_and_the_run_goes_on(scenario, tmp_path, monkeypatch):
    def full(self, run):
        raise OSError(errno.ENOSPC, "No space left on device")

    whole = simulate(scenario)
    monkeypatch.setattr(InFile, "checkpoint", full)
    with (
        pytest.warns(NotSaved, match=r"^nothing saved at t = \d+ s: No space left on device$"),
        simulate(scenario, to=tmp_path / "result.nc", checkpoint_s=1e-9) as flown,
    ):
        assert same(flown, whole)


def test_a_run_that_netcdf_refuses_to_store_is_kept(make, tmp_path, monkeypatch):
    """Names are checked before a run. Were one missed, hours of computing would be lost."""
    import xarray

    def refusing(self, *given, **how):
        raise ValueError("Forward slashes '/' are not allowed")

    scenario = make()
    whole = simulate(scenario)
    monkeypatch.setattr(xarray.Dataset, "to_netcdf", refusing)
    message = "result: must be what NetCDF can store; received: Forward slashes '/' are not allowed"
    with (
        pytest.warns(NotSaved, match=rf"^nothing saved at t = \d+ s: {message}$"),
        pytest.raises(RunStopped, match=f"^{message}$") as stopped,
    ):
        simulate(scenario, to=tmp_path / "result.nc", checkpoint_s=1e-9)
    assert np.array_equal(stopped.value.result.omega_body, whole.omega_body)


@pytest.mark.parametrize("error", [KeyboardInterrupt, SystemError("of the glue of compiled code")])
def test_signal_during_preparation_of_a_run_acts_at_once(make, monkeypatch, error):
    def interrupted(self):
        signal.raise_signal(signal.SIGINT)
        raise error  # what becomes of it in compiled code

    monkeypatch.setattr(runner.Run, "make_ready", interrupted)
    with pytest.raises(KeyboardInterrupt):
        simulate(make())


def test_a_run_of_one_piece_does_not_depend_on_pieces(make, monkeypatch, tmp_path):
    whole = simulate(make(FULL), to=tmp_path / "result.nc")
    assert same(load(tmp_path / "result.nc"), whole)
    monkeypatch.setattr(sizes, "_PIECE_ROWS", 400)
    assert same(simulate(make(FULL)), whole)


def test_pieces_match_one_piece_within_the_promise_of_the_tables(make, monkeypatch):
    """Elsewhere cut, the tables differ within their promised error of 1e-9, no more."""
    quiet = {"simulation": FULL["simulation"], "environment.field": {"kind": "igrf14"}}
    whole = simulate(make(quiet))
    monkeypatch.setattr(sizes, "_PIECE_SEGMENTS", 4)
    pieces = simulate(make(quiet))
    assert piece_steps(make(quiet)) < make(quiet).steps() / 6
    error = np.abs(pieces.q_body_to_inertial.values - whole.q_body_to_inertial.values).max()
    assert 0.0 < error < 1e-8
    assert np.array_equal(pieces.b_inertial.values[:20], whole.b_inertial.values[:20])


@pytest.mark.parametrize(
    ("scenario", "to_file"),
    slow_after(
        2,
        [("few records", True), ("adaptive steps", False), ("adaptive steps", True),
         ("records", False), ("exact tables", True)],
        names=2,
    ),
    indirect=["scenario"],
)  # fmt: skip
def test_an_interrupt_between_two_pieces_keeps_each_once(scenario, tmp_path, monkeypatch, to_file):
    own, calls = runner.tabulate_piece, []

    def impatient(*arguments):
        calls.append(arguments)
        if len(calls) == 4:
            raise KeyboardInterrupt
        return own(*arguments)

    whole, path = simulate(scenario), tmp_path / "result.nc" if to_file else None
    with monkeypatch.context() as patch:
        patch.setattr(runner, "tabulate_piece", impatient)
        with pytest.raises(RunStopped, match="interrupted at t = ") as stopped:
            simulate(scenario, to=path)
    if to_file:
        stopped.value.result.close()
    with resume(path or stopped.value.result) as ended:
        assert same(ended, whole)


@law(memory=1)
def fails_late(inputs, parameters, memory):
    """A law that fails in the fourth piece or later."""
    return (1.0 / (0.0 if inputs.t_s > 1000.0 else 1.0), 0.0, 0.0)


@OF_FILES
def test_a_law_that_fails_leaves_its_result_in_the_file(scenario, tmp_path):
    with pytest.raises(RunStopped, match="law fails_late: must not raise") as stopped:
        simulate(scenario, fails_late, to=tmp_path / "result.nc")
    stopped.value.result.close()
    kept = load(tmp_path / "result.nc")
    assert kept.attrs["how_it_ended"] == "failed"
    assert kept.time.values[-1] > 999.0 - scenario.simulation.record_s


def test_a_table_may_begin_anywhere():
    def sample(t_s):
        return np.stack([np.sin(t_s / 50.0), np.cos(t_s / 70.0), t_s / 1000.0], axis=1)

    table = build(sample, 100.0, 10.0, 5, start_s=1e6)
    for t in (1e6, 1e6 + 33.3, 1e6 + 100.0):
        assert lookup3(table, t) == pytest.approx(sample(np.array([t]))[0], abs=1e-8)


LOGGING = """
import torquer

@torquer.law(memory={"a": 0.0, "b": (0, 0, 0)}, log={"a": "1", "b": "T"})
def logging(inputs, parameters, memory):
    return (0.0, 0.0, 0.0)
"""
MODES = {"regions": {name: {"states": {"on": {"laws": [name], "final": True}}}
                     for name in ("coils", "wheels")}}  # fmt: skip
SENSED = {"estimator": {"kind": "rate_from_field"}}
LAWS = FULL["control"]["laws"]


@pytest.mark.parametrize("control", [
    {"law": LAWS["coils"]},
    {"laws": LAWS, "modes": MODES},
    {"law": LAWS["coils"], **SENSED},
    {"law": LAWS["coils"], "ephemeris": {"clock_error_s": 1.0}},
    {"law": {"kind": "user", "file": "logging.py"}},
], ids=["plain", "modes", "estimator", "ephemeris", "log"])  # fmt: skip
@pytest.mark.parametrize("wheels", [True, False])
def test_a_row_has_as_many_numbers_as_stated(plain_data, tmp_path, control, wheels):
    if "laws" in control and not wheels:
        pytest.skip("a law of these drives wheels")
    (tmp_path / "logging.py").write_text(LOGGING)
    changes = {"control": control, "simulation.duration_s": 20.0}
    if wheels:
        changes["spacecraft.wheels"] = FULL["spacecraft.wheels"]
    scenario = scenario_from_data(plain_data(changes), tmp_path)
    result = simulate(scenario)
    rows = {name: v for name, v in result.variables.items() if "time" in v.dims}
    assert sizes.row_numbers(scenario) == sum(v.size for v in rows.values()) / len(result.time)


def test_memory_is_that_of_a_piece_for_a_file(make, monkeypatch):
    short, long = (make({"simulation.duration_s": days * 86400.0}) for days in (40.0, 4000.0))
    assert estimate_size(long).memory_bytes == pytest.approx(
        estimate_size(short).memory_bytes, rel=1e-3
    )
    assert estimate_size(long).whole_in_memory_bytes > 20.0 * estimate_size(long).memory_bytes
    monkeypatch.setattr(sizes, "machine_memory", lambda: 5e9)
    with pytest.raises(ValueError, match=r"received a run that .* \(simulate with to='result\.nc'"):
        simulate(long)
    monkeypatch.setattr(sizes, "free_disk", lambda folder: 1e9)
    with pytest.raises(ValueError, match=r"must fit in the 1 GB that are free at "):
        simulate(long, to="result.nc")
