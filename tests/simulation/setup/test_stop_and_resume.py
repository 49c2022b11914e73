"""Stopping, storing and going on: the same bits as the unbroken run. Seeds. Without JIT."""

import dataclasses
import json
import os
import subprocess
import sys

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from integrators import INTEGRATORS, by
from slow_cases import slow_after

import torquer
from torquer import RunStopped, law, load, resume, save, simulate
from torquer.compile import engine
from torquer.computer.laws import Bdot
from torquer.computer.laws.off import Off
from torquer.environment.orbit import Circular
from torquer.scenario.spec import (
    Body,
    Coils,
    Control,
    InitialMotion,
    Scenario,
    Simulation,
    Spacecraft,
)
from torquer.simulation.setup import checkpoints as pieces, run as runner

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")

#: Everything that remembers: noise, drift, lag, a window; 1200 steps, records off the cycle.
FULL = {
    "spacecraft.magnetometer": {"noise_nt": 50.0, "coil_disturbance_nt_per_a_m2": 100.0},
    "spacecraft.gyro": {"noise_deg_s": 0.01, "bias_drift_deg_s_sqrt_s": 0.001},
    "spacecraft.sun_sensors": {"axes": [[1, 0, 0], [-1, 2, 0]], "half_field_deg": 80.0,
                               "noise_deg": 0.1},
    "spacecraft.coils": {"limit_a_m2": [2.0, 3.0, 4.0, 3.0], "lag_s": 0.7,
                         "axes": [[1, 2, 3], [0, 1, 0.3], [-0.1, 0.2, 1], [1, 0, 0]],
                         "residual_dipole_a_m2": [0.1, 0.0, -0.1]},
    "control": {"law": {"kind": "bdot", "gain_a_m2_s_per_t": 1e6},
                "sample_s": 3.0, "measure_s": 6.0, "actuate_s": 4.0},
    "simulation": {"duration_s": 602.0, "step_s": 0.5, "record_s": 7.0},
    "seed": 7,
}  # fmt: skip


def same(a, b):
    """Whether two results are the same, bit for bit."""
    assert sorted(a.variables) == sorted(b.variables)
    for name in a.variables:
        if a[name].dtype.kind == "f":
            assert np.array_equal(a[name].values, b[name].values, equal_nan=True), name
        else:
            assert np.array_equal(a[name].values, b[name].values), name
    assert a.attrs == b.attrs
    return True


def on_a_grid_of(step_s, integrator):
    """All that remembers, with all times multiples of a step."""
    times = {"sample_s": 6, "measure_s": 12, "actuate_s": 8}
    control = FULL["control"] | {key: count * step_s for key, count in times.items()}
    simulation = {"duration_s": 630 * step_s, "record_s": 14 * step_s, "step_s": step_s}
    random = {"random_torque_n_m": 1e-6, "random_hold_s": 10 * step_s}
    changes = {"control": control, "simulation": simulation, "disturbance": random}
    return FULL | changes | by(integrator)


@settings(
    max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    hundredths=st.integers(3, 150),
    integrator=st.sampled_from(INTEGRATORS),
    stops=st.lists(st.floats(0.0, 1.0), min_size=1, max_size=6),
)
def test_bits_do_not_depend_on_where_a_run_is_split(make, hundredths, integrator, stops):
    """Nor on whether its time grid is exact in binary: 0.7 s is not, 0.5 s is."""
    scenario = make(on_a_grid_of(hundredths / 100.0, integrator))
    whole, length_s = simulate(scenario), 630 * hundredths / 100.0
    part = simulate(scenario, until_s=min(stops) * length_s)
    for stop in sorted(stops)[1:]:
        part = resume(part, until_s=stop * length_s)
    assert same(resume(part), whole)


@law(
    parameters={"gain": 2e5, "leak": 0.9},
    memory={"leaky": 1.0, "calls": 0.0},
    log={"calls": "1"},
)
def remembering(inputs, parameters, memory):
    """A law that remembers, and whose answer is full of what it remembers."""
    memory.leaky = parameters.leak * memory.leaky + inputs.b_body_t[0] * 1e4
    memory.calls += 1.0
    s = parameters.gain * memory.leaky
    b = inputs.b_body_t
    return (s * b[1] + 1e-3 * memory.calls, -s * b[0], inputs.omega_body_rad_s[2])


IN_PYTHON = dataclasses.replace(remembering, name="in_python", compiled=False)


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("stop_s", slow_after(2, [333.5, 0.0, 70.0, 100.0, 101.0]))
def test_a_run_stopped_anywhere_goes_on_with_the_same_bits(make, integrator, stop_s, tmp_path):
    scenario = make(FULL | by(integrator))
    whole = simulate(scenario)
    part = simulate(scenario, until_s=stop_s)
    assert part.attrs["ended"].startswith("stopped at t = ")
    assert part.attrs["how_it_ended"] == "stopped"
    assert stop_s <= float(part.checkpoint[0]) * scenario.grid_s <= stop_s + 4.0  # longest hold
    assert stop_s - 7.0 < part.time.values[-1] <= stop_s + 4.0
    save(part, tmp_path / "part.nc")
    assert same(resume(load(tmp_path / "part.nc")), whole)
    assert same(resume(resume(part, until_s=400.5)), whole)


@pytest.mark.parametrize("own", [remembering, IN_PYTHON], ids=["compiled", "python"])
def test_laws_with_memory_go_on_with_the_same_bits(make, own):
    scenario = make(FULL)
    whole = simulate(scenario, own)
    assert whole["law.calls"].values[-1] == len([t for t in range(1204) if t % 20 in (0, 6, 12)])
    part = simulate(scenario, own, until_s=211.5)
    assert same(resume(part, own), whole)


@pytest.mark.parametrize("kind", ["bdot_rate", "bdot_derivative", "off"])
def test_every_law_goes_on_with_the_same_bits(make, kind):
    gain = {} if kind == "off" else {"gain_a_m2_s_per_t": 1e6}
    scenario = make(FULL | {"control.law": {"kind": kind, **gain}})
    assert same(resume(simulate(scenario, until_s=301.0)), simulate(scenario))


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_results_do_not_depend_on_how_fast_the_machine_is(make, integrator, monkeypatch):
    """The run is cut into pieces by the wall clock."""
    scenario = make(FULL | by(integrator) | {"simulation.duration_s": 3003.0})
    fast = simulate(scenario)
    monkeypatch.setattr(pieces, "_PIECE_S", 0.0)
    assert same(simulate(scenario), fast)


def test_a_complete_result_has_nothing_to_go_on_with(make):
    whole = simulate(make(FULL))
    assert whole.attrs["ended"] == whole.attrs["how_it_ended"] == "complete"
    assert same(resume(whole), whole)
    assert same(simulate(make(FULL), until_s=1e9), whole)


@pytest.mark.parametrize("lag_s", [0.0, 0.7])
def test_last_record_shows_coils_as_a_longer_run_does(make, lag_s):
    """At the beginning of a measurement window they are switched off, and what is left decays."""
    windows = FULL | {
        "spacecraft.coils": FULL["spacecraft.coils"] | {"lag_s": lag_s},
        "simulation": {"duration_s": 600.0, "step_s": 0.5, "record_s": 10.0},
    }
    longer = simulate(make(windows | {"simulation.duration_s": 1200.0}))
    whole, part = simulate(make(windows)), simulate(make(windows), until_s=300.0)
    for shorter in (whole, part):
        dipole = shorter.dipole_body.values
        assert np.array_equal(dipole, longer.dipole_body.values[: len(dipole)])
    off = np.abs(whole.dipole_body.values[-1] - [0.1, 0.0, -0.1]).max() < 1e-12
    assert off == (lag_s == 0.0)
    assert same(resume(part), whole)


def test_a_parameter_may_be_a_number_of_numpy(make):
    law = remembering.with_parameters(gain=np.float32(2e5))
    assert same(simulate(make(FULL), law), simulate(make(FULL), remembering))


def test_the_law_must_be_the_one_that_began(make):
    part = simulate(make(FULL), remembering, until_s=100.0)
    with pytest.raises(ValueError, match=r"law remembering: must be given again .*received none"):
        resume(part)
    with pytest.raises(ValueError, match=r"law: must be remembering .*; received off "):
        resume(part, Off().law())
    with pytest.raises(ValueError, match=r"began; received remembering .*\"gain\": 1\.0"):
        resume(part, remembering.with_parameters(gain=1.0))


def test_a_result_that_was_cut_is_refused(make):
    part = simulate(make(FULL), until_s=100.0)
    with pytest.raises(ValueError, match=r"must have every row of its record .* received 3 rows"):
        resume(part.isel(time=slice(0, 3)))
    with pytest.raises(ValueError, match="must have every row of its record"):
        resume(part.isel(time=slice(1, None)))
    cells = part.sizes["checkpoint_cell"]
    wrong = rf"checkpoint must have {cells} cells.*received {cells - 1}"
    with pytest.raises(ValueError, match=wrong):
        resume(part.isel(checkpoint_cell=slice(1, None)))


@pytest.mark.parametrize("until_s", [-1.0, float("nan")])
def test_until_must_be_a_time(make, until_s):
    with pytest.raises(ValueError, match=f"until_s: must be a time from 0 on; received {until_s}"):
        simulate(make(), until_s=until_s)


def test_an_interrupt_keeps_what_was_computed(make):
    scenario = make(FULL | {"simulation.duration_s": 3003.0})
    parts = []

    def impatient(part):
        parts.append(part)
        if len(parts) == 2:
            raise KeyboardInterrupt

    with pytest.raises(RunStopped, match=r"^interrupted at t = \d+(\.5)? s$") as stopped:
        simulate(scenario, progress=impatient)
    assert 0.0 < parts[0] < parts[1] < 1.0
    part = stopped.value.result
    assert part.attrs["ended"] == str(stopped.value)
    assert (part.attrs["how_it_ended"], stopped.value.interrupted) == ("interrupted", True)
    assert part.time.values[-1] == pytest.approx(parts[1] * 3003.0, abs=7.0)
    assert same(resume(part), simulate(scenario))


def test_an_interrupt_before_the_first_step_keeps_the_start(make, monkeypatch):
    scenario = make(FULL)

    def interrupted(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(runner.Run, "advance_to", interrupted)
        with pytest.raises(RunStopped, match="interrupted at t = 0 s") as stopped:
            simulate(scenario)
    part = stopped.value.result
    assert part.time.values.tolist() == [0.0]
    assert same(resume(part), simulate(scenario))


def test_interrupt_inside_a_python_law_leaves_its_memory_unchanged(make):
    scenario, calls = make(FULL), []

    def own(inputs, parameters, memory):
        answer = remembering.function(inputs, parameters, memory)
        calls.append(inputs.t_s)
        if len(calls) == 41:
            raise KeyboardInterrupt
        return answer

    in_python = torquer.Law("own", own, remembering.parameters, remembering.memory, compiled=False)
    with pytest.raises(RunStopped, match="interrupted") as stopped:
        simulate(scenario, in_python)
    resumed = resume(stopped.value.result, in_python)
    assert calls[40] == calls[41]
    assert same(resumed, simulate(scenario, in_python))


def test_same_seed_gives_same_bits_and_another_does_not(make):
    first, again = simulate(make(FULL)), simulate(make(FULL))
    other = simulate(make(FULL | {"seed": 8}))
    assert same(first, again)
    for name in ("b_measured", "omega_measured", "sun_measured", "omega_body"):
        assert not np.array_equal(first[name].values, other[name].values), name


def test_the_seed_has_no_say_without_noise(make):
    a, b = simulate(make({"seed": 1})), simulate(make({"seed": 2}))
    assert np.array_equal(a.omega_body.values, b.omega_body.values)


def test_a_scenario_built_in_python_is_stored_with_its_result(tmp_path):
    scenario = Scenario(
        start="2012-03-04T10:31:47Z",
        orbit=Circular(altitude_km=500.0, inclination_deg=60.0),
        spacecraft=Spacecraft(
            body=Body(inertia_kg_m2=(1.0, 1.1, 1.2)),
            coils=Coils(limit_a_m2=3.0, axes=((1, 2, 3), (3, -1, 0.1), (0.2, 0.3, 1))),
        ),
        initial=InitialMotion(rate_deg_s=(1.0, 1.0, 1.0)),
        control=Control(law=Bdot(gain_a_m2_s_per_t=1e5)),
        simulation=Simulation(duration_s=100.0),
    )
    part = simulate(scenario, until_s=50.0)
    save(part, tmp_path / "part.nc")
    part = load(tmp_path / "part.nc")
    assert torquer.simulation.results.dataset.flown_scenario(part) == scenario
    assert same(resume(part), simulate(scenario))


def test_saving_replaces_the_file_only_when_all_is_written(make, tmp_path, monkeypatch):
    path = tmp_path / "result.nc"
    result = simulate(make())
    save(result, path)

    def full_disk(file):
        raise OSError("No space left on device")

    monkeypatch.setattr("torquer.simulation.results.file.to_disk", full_disk)
    with pytest.raises(OSError, match="No space"):
        save(result, path)
    monkeypatch.undo()
    assert same(load(path), result)
    assert list(tmp_path.iterdir()) == [path]


_SHORT = {
    "environment.table_tolerance": 1e-7,
    "control.sample_s": 3.0,
    "simulation.duration_s": 20.0,
    "simulation.record_s": 1.0,
    "spacecraft": {k.removeprefix("spacecraft."): v for k, v in FULL.items() if "craft" in k}
    | {"body": {"inertia_kg_m2": [1.0, 1.2, 1.5]}},
    "control.law": {"kind": "bdot", "gain_a_m2_s_per_t": 1e6},
}
_WITHOUT_JIT = """
import json, sys
from torquer import simulate
from torquer.compile import engine
from torquer.scenario.load import scenario_from_data
assert not engine.COMPILED
results = [simulate(scenario_from_data(data)) for data in json.load(sys.stdin)]
print(json.dumps([{k: r[k].values.tolist() for k in ("q_body_to_inertial", "omega_body",
    "dipole_body", "b_measured", "omega_measured", "sun_measured")} for r in results]))
"""


def test_plain_python_computes_the_same_as_compiled_code(plain_data):
    cases = [plain_data(_SHORT | by(name)) for name in INTEGRATORS]
    done = subprocess.run(
        [sys.executable, "-c", _WITHOUT_JIT], input=json.dumps(cases), text=True,
        env=os.environ | {"NUMBA_DISABLE_JIT": "1"}, capture_output=True, check=True, timeout=100,
    )  # fmt: skip
    for case, plain in zip(cases, json.loads(done.stdout), strict=True):
        compiled = simulate(torquer.scenario.load.scenario_from_data(case))
        for name, values in plain.items():
            scale = np.abs(compiled[name].values).max()
            assert scale > 0.0
            assert np.abs(compiled[name].values - values).max() < 1e-12 * scale, name


def test_a_law_that_was_edited_meanwhile_is_not_resumed_with(tmp_path):
    file = tmp_path / "law.py"
    file.write_text("def mine(inputs, parameters, memory):\n    return (0.0, 0.0, 0.0)\n")
    text = f"""
start = 2025-03-01T00:00:00Z
orbit = {{ kind = "circular", altitude_km = 500, inclination_deg = 60 }}
environment = {{ field = {{ kind = "direct_dipole" }}, table_tolerance = 1e-6 }}
spacecraft.body.inertia_kg_m2 = [1.0, 1.2, 1.5]
spacecraft.coils.limit_a_m2 = 1.0
initial.rate_deg_s = [1, 2, 3]
control.law = {{ kind = "user", file = "{file}", function = "mine" }}
simulation = {{ duration_s = 40, record_s = 10 }}
"""
    stopped = torquer.simulate(torquer.scenario_from_text(text), until_s=20.0)
    assert torquer.resume(stopped).attrs["how_it_ended"] == "complete"
    file.write_text("def mine(inputs, parameters, memory):\n    return (0.1, 0.0, 0.0)\n")
    with pytest.raises(ValueError, match="law mine: must be the one with which the run began"):
        torquer.resume(stopped)


@pytest.mark.parametrize(("stop_s", "spare"), [(105.0, 1), (107.5, 0)])
def test_every_due_row_must_be_there_and_no_more(make, stop_s, spare):
    """A row of the very instant of the stop is written again; all before it are needed."""
    scenario = make(FULL | by("rk4") | {"simulation": FULL["simulation"]})
    whole, part = simulate(scenario), simulate(scenario, until_s=stop_s)
    at_s = float(part.checkpoint[0]) * scenario.grid_s
    assert (at_s % 7.0 == 0.0) == (spare == 1)
    rows = part.sizes["time"]
    assert same(resume(part.isel(time=slice(0, rows - spare))), whole)
    with pytest.raises(ValueError, match=f"every row .* received {rows - spare - 1} rows, of "):
        resume(part.isel(time=slice(0, rows - spare - 1)))
