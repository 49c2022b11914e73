"""Runs with wheels: stop and resume, noise, laws of every kind, the cycle, what goes wrong."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest
from integrators import by
from numba.core.runtime import _nrt_python, rtsys
from slow_cases import slow_after

import torquer
from torquer import RunStopped, law, load, resume, save, simulate
from torquer.compile import engine
from torquer.computer.laws.unloading import Unloading
from torquer.simulation.results.dataset import flown_laws
from torquer.simulation.setup import checkpoints as pieces, run as runner

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")

WHEELS = {
    "layout": {"kind": "regular_pyramid", "count": 4, "gamma_deg": 54.7},
    "momentum_limit_n_m_s": 1.0,
    "torque_limit_n_m": 0.02,
    "coulomb_friction_n_m": 5e-4,
    "viscous_friction_n_m_s": 2e-5,
    "stiction_n_m": 1e-3,
    "initial_speed_rpm": [1500.0, -800.0, 300.0, 0.0],
    "speed_noise_rpm": 2.0,
    "minimum_speed_fraction": 0.1,
    "failures": [
        {"wheel": 1, "time_s": 30.2, "noticed_after_s": 25.0},
        {"wheel": 3, "time_s": 90.0},
    ],
}
UNLOADING = {"kind": "unloading", "gain_per_s": 1e-2}
#: Readings every 1.5 s, records off them; four coils that unload, with a lag.
BASE = {
    "spacecraft.wheels": WHEELS,
    "spacecraft.coils": {"limit_a_m2": 3.0, "lag_s": 0.7},
    "spacecraft.gyro": {"noise_deg_s": 0.01},
    "control": {"laws": {"coils": UNLOADING, "wheels": {"kind": "off"}}, "sample_s": 1.5},
    "simulation": {"duration_s": 140.0, "step_s": 0.5, "record_s": 2.0},
    "seed": 7,
}
IDEAL = {"spacecraft.wheels": WHEELS | {"speed_noise_rpm": 0.0, "failures": []}}


@law(parameters={"gain": 0.3}, memory=2, answers="torque")
def braking(inputs, parameters, memory):
    """A brake that counts its readings and grows with them."""
    memory[0] += 1.0
    memory[1] = 0.9 * memory[1] - 1e-3 * inputs.omega_body_rad_s[1]
    gain, (x, y, z) = parameters.gain, inputs.omega_body_rad_s
    return (-gain * x, -gain * y + memory[1], -gain * z - 1e-5 * memory[0])


@pytest.fixture
def craft(make):
    return lambda changes=(): make(BASE | dict(changes))


def same(a, b):
    """Whether two results are the same, bit for bit."""
    assert sorted(a.variables) == sorted(b.variables)
    for name in a.variables:
        equal_nan = a[name].dtype.kind == "f"
        assert np.array_equal(a[name].values, b[name].values, equal_nan=equal_nan), name
    assert a.attrs == b.attrs
    return True


def test_what_is_recorded_of_the_wheels(craft):
    result = simulate(craft(IDEAL), laws={"wheels": braking})
    assert result.sizes["wheel"] == 4
    for name, unit in (
        ("wheel_momentum", "N m s"),
        ("wheel_speed", "rad/s"),
        ("wheel_torque", "N m"),
        ("torque_command_body", "N m"),
    ):
        assert result[name].attrs["units"] == unit
        assert np.isfinite(result[name].values).all()
    message = flown_laws(result)
    assert message["wheels"]["name"] == "braking"
    assert message["wheels"]["parameters"] == {"gain": 0.3}
    assert message["coils"]["name"] == "unloading"
    axes = np.array(craft().spacecraft.wheels.array().axes)
    message = -result.wheel_torque.values @ axes
    assert message == pytest.approx(result.torque_command_body.values, abs=1e-15)
    asked, read = result.torque_command_body.values[:-1, 0], result.omega_measured.values[:-1, 0]
    assert asked == pytest.approx(-0.3 * read, abs=1e-15)  # of the last reading, both
    assert len(np.unique(asked)) == 70  # from 1.5 to 2 s and from 2 to 3 s the same would be held


def test_a_satellite_without_wheels_has_no_such_record(make):
    result = simulate(make())
    assert not [name for name in result.variables if "wheel" in name or "torque" in name]


@pytest.mark.parametrize("integrator", ["auto", "rk4"])
@pytest.mark.parametrize("stop_s", slow_after(2, [44.5, 0.0, 29.0, 56.0, 101.0]))
def test_a_run_stopped_anywhere_goes_on_with_the_same_bits(craft, integrator, stop_s, tmp_path):
    """Also between a failure at 30.2 s and its notice at 55.2 s."""
    scenario = craft(by(integrator))
    whole = simulate(scenario, laws={"wheels": braking})
    part = simulate(scenario, laws={"wheels": braking}, until_s=stop_s)
    assert part.attrs["how_it_ended"] == "stopped"
    assert stop_s <= float(part.checkpoint[0]) * scenario.grid_s <= stop_s + 1.5
    save(part, tmp_path / "part.nc")
    assert same(resume(load(tmp_path / "part.nc"), laws={"wheels": braking}), whole)
    again = resume(part, laws={"wheels": braking}, until_s=111.0)
    assert same(resume(again, laws={"wheels": braking}), whole)


def test_failures_show_in_the_flight_of_these_tests(craft):
    """Else the test above would not mean much."""
    result = simulate(craft(), laws={"wheels": braking})
    t, asked = result.time.values, result.wheel_torque.values
    assert np.all(asked[(t > 0.0) & (t < 90.0)][:, 3] != 0.0)
    assert np.all(asked[t < 55.0, 1] != 0.0)
    assert not asked[t > 57.0, 1].any()
    assert not asked[t > 91.5, 3].any()
    assert abs(result.wheel_speed.values[0, 3]) < 1e-15 < abs(result.wheel_speed.values[10, 3])


def test_results_do_not_depend_on_how_fast_the_machine_is(craft, monkeypatch):
    fast = simulate(craft(), laws={"wheels": braking})
    monkeypatch.setattr(pieces, "_PIECE_S", 0.0)
    assert same(simulate(craft(), laws={"wheels": braking}), fast)


def test_wheel_law_must_be_the_one_that_began(craft):
    part = simulate(craft(), laws={"wheels": braking}, until_s=50.0)
    with pytest.raises(ValueError, match=r"^law braking: must be given again .*; received none$"):
        resume(part)
    with pytest.raises(ValueError, match=r"^wheels: must be .*received braking .*1\.0"):
        resume(part, laws={"wheels": braking.with_parameters(gain=1.0)})


@law(parameters={"share": 1e-3}, answers="torque")
def telling(inputs, parameters, memory):
    """Asks for a thousandth of the momentum that the tachometers tell of, as a torque."""
    x, y, z = inputs.wheel_momentum_body_n_m_s
    return (parameters.share * x, parameters.share * y, parameters.share * z)


def test_noise_of_the_tachometers_by_the_seed(craft):
    """About each body axis: inertia times deviation times the root of the sum of squares."""
    noisy = {"spacecraft.wheels": WHEELS | {"failures": [], "speed_noise_rpm": 5.0}}
    noisy |= {"control.sample_s": 1.0, "control.laws.coils": {"kind": "off"}}
    noisy |= {"simulation": {"duration_s": 600.0, "step_s": 0.5, "record_s": 1.0}}
    first, again = (simulate(craft(noisy), laws={"wheels": telling}) for _ in range(2))
    other = simulate(craft(noisy | {"seed": 8}), laws={"wheels": telling})
    assert same(first, again)
    axes = np.array(craft().spacecraft.wheels.array().axes)
    noise = []
    for result in (first, other):
        message = result.torque_command_body.values[:-1] / 1e-3
        noise.append(message - result.wheel_momentum.values[:-1] @ axes)
    deviation = 5.0 * np.pi / 30.0 / (200.0 * np.pi) * np.sqrt(np.sum(axes**2, axis=0))
    assert noise[0].std(axis=0) == pytest.approx(deviation, rel=0.15)  # five standard errors
    assert np.all(np.abs(noise[0].mean(axis=0)) < 5.0 * deviation / np.sqrt(600.0))
    assert not np.any(noise[0] == noise[1])
    assert abs(np.corrcoef(noise[0].ravel(), noise[1].ravel())[0, 1]) < 5.0 / np.sqrt(1800.0)


def test_a_plain_function_does_the_same_as_the_compiled_law(craft):
    """Each answer is one product: nothing to be rounded in another way."""

    @law(answers="torque", compiled=False)
    def plain(inputs, parameters, memory):
        x, y, z = inputs.wheel_momentum_body_n_m_s
        return (1e-3 * x, 1e-3 * y, 1e-3 * z)

    compiled = simulate(craft(), laws={"wheels": telling})
    own = simulate(craft(), laws={"wheels": plain})
    for name in ("q_body_to_inertial", "omega_body", "wheel_momentum", "wheel_torque",
                 "command_body"):  # fmt: skip
        assert np.array_equal(own[name].values, compiled[name].values), name
    assert flown_laws(own)["wheels"]["runs_as"] == "plain Python (slow: not decorated)"
    assert flown_laws(own)["coils"]["runs_as"] == "compiled"
    part = simulate(craft(), laws={"wheels": plain}, until_s=44.5)
    assert same(resume(part, laws={"wheels": plain}), own)


def test_wheels_follow_every_reading_and_hold_torque_while_coils_work(craft):
    windows = {
        "control": {"laws": BASE["control"]["laws"],
                    "sample_s": 1.0, "measure_s": 3.0, "actuate_s": 4.0},
        "spacecraft.coils": {"limit_a_m2": 3.0},
        "simulation": {"duration_s": 70.0, "step_s": 0.5, "record_s": 0.5},
    }  # fmt: skip
    result = simulate(craft(windows), laws={"wheels": braking})
    asked, dipole = result.torque_command_body.values[:140], result.dipole_body.values[:140]
    phase = np.arange(140) % 14
    changes = np.flatnonzero(np.any(asked[1:] != asked[:-1], axis=1)) + 1
    assert set(phase[changes]) == {0, 2, 4, 6}
    assert not dipole[phase < 6].any()
    assert np.all(np.any(dipole[phase >= 6] != 0.0, axis=1))


def test_a_step_allocates_nothing(craft):
    """Counted for a short and a long run in one call of the loop each."""
    on, counts = _nrt_python.memsys_stats_enabled(), []
    _nrt_python.memsys_enable_stats()
    try:
        for last in (6, 240):
            run = runner.prepare(craft(), laws={"wheels": braking})
            run.advance_to(3)
            before = rtsys.get_allocation_stats().alloc
            run.advance_to(last)
            counts.append(rtsys.get_allocation_stats().alloc - before)
    finally:
        if not on:
            _nrt_python.memsys_disable_stats()
    assert counts[0] == counts[1]


_WITHOUT_JIT = """
import json, sys
import torquer
from torquer.scenario.load import scenario_from_data
names = ("q_body_to_inertial", "omega_body", "wheel_momentum", "wheel_torque", "command_body")
result = torquer.simulate(scenario_from_data(json.load(sys.stdin)))
print(json.dumps({name: result[name].values.tolist() for name in names}))
"""


def test_plain_python_computes_the_same_as_compiled_code(plain_data):
    wheels = WHEELS | {"failures": [{"wheel": 1, "time_s": 4.0, "noticed_after_s": 3.0}]}
    hold = {"kind": "wheel_lyapunov", "rate_gain_n_m_s": 0.3, "angle_gain_n_m": 0.05,
            "inertia_kg_m2": [1.0, 1.3, 1.7]}  # fmt: skip
    changes = {"spacecraft.wheels": wheels, "control.laws.wheels": hold}
    changes |= {"simulation.duration_s": 20.0, "simulation.record_s": 5.0}
    data = plain_data(BASE | changes)
    done = subprocess.run(
        [sys.executable, "-c", _WITHOUT_JIT], input=json.dumps(data), text=True,
        env=os.environ | {"NUMBA_DISABLE_JIT": "1"}, capture_output=True, check=True, timeout=100,
    )  # fmt: skip
    compiled = simulate(torquer.scenario.load.scenario_from_data(data))
    assert np.ptp(compiled.wheel_torque.values, axis=0).min() > 1e-4
    for name, values in json.loads(done.stdout).items():
        scale = np.abs(compiled[name].values).max()
        assert np.abs(compiled[name].values - values).max() < 1e-11 * scale, name


# What goes wrong.


@law(answers="torque")
def not_a_number(inputs, parameters, memory):
    return (0.0, np.nan if inputs.t_s > 20.0 else 1e-3, 0.0)


@law(answers="torque")
def raising(inputs, parameters, memory):
    if inputs.t_s > 20.0:
        raise ValueError("too late")
    return (0.0, 0.0, 0.0)


@law(answers="torque", compiled=False)
def in_plain_python(inputs, parameters, memory):
    return (1.0, 2.0)


@pytest.mark.parametrize(
    ("own", "line"),
    [
        (not_a_number, r"law not_a_number: must return a finite torque; received \(0, nan, 0\) at "
         r"t = 21 s; quaternion and rate: .*"),
        (raising, r"law raising: must not raise; received ValueError\('too late'\) "
         r"\(test_wheel_runs.py, line \d+\) at t = 21 s; quaternion and rate: .*"),
        (in_plain_python, r"law in_plain_python: must return three numbers; received "
         r"\(1\.0, 2\.0\) at t = 0 s"),
    ],
)  # fmt: skip
def test_failing_law_ends_the_run_and_keeps_computed_results(craft, own, line):
    with pytest.raises(RunStopped, match=f"^{line}$") as stopped:
        simulate(craft(), laws={"wheels": own})
    result = stopped.value.result
    assert result.attrs["how_it_ended"] == "failed"
    assert result.time.values[-1] == (0.0 if own is in_plain_python else 20.0)
    assert np.isfinite(result.wheel_momentum.values).all()


def test_a_law_needs_what_it_is_to_drive(make):
    with pytest.raises(ValueError, match=r"^spacecraft\.wheels: must be given .*; received none$"):
        simulate(make(), braking)
    alone = {"spacecraft.coils": None, "spacecraft.wheels": WHEELS}
    with pytest.raises(ValueError, match=r"^spacecraft\.coils: must be given .*; received none$"):
        simulate(make(alone), Unloading(**UNLOADING).law())


@pytest.mark.parametrize("changes", [
    {"layout": {"kind": "orthogonal"}, "initial_speed_rpm": 0.0, "failures": []},
    {"lost": [0, 1, 2, 3], "failures": []},
    {"lost": [0, 2], "failures": [{"wheel": 1, "time_s": 0.0}, {"wheel": 3, "time_s": 50.0}]},
    {"initial_speed_rpm": 6000.0, "failures": []},
])  # fmt: skip
def test_few_or_no_wheels_are_flown_too(craft, changes):
    """Three with an idle share that they cannot keep, none, none left, all at their limit."""
    result = simulate(craft({"spacecraft.wheels": WHEELS | changes}), laws={"wheels": braking})
    for name in ("omega_body", "wheel_momentum", "wheel_torque"):
        assert np.isfinite(result[name].values).all()
    lost = changes.get("lost", [])
    assert not result.wheel_torque.values[:, lost].any()
    assert np.abs(result.wheel_speed.values).max() <= 200.0 * np.pi * (1.0 + 1e-4)


@pytest.mark.parametrize("laws", [{"coils": UNLOADING}, BASE["control"]["laws"]])
def test_wheels_without_a_law_have_their_motors_off(craft, laws):
    result = simulate(craft({"control.laws": laws}))
    assert not result.wheel_torque.values.any()
    assert np.abs(result.wheel_speed.values[-1]).sum() < np.abs(result.wheel_speed.values[0]).sum()


@law(answers="torque")
def sideways(inputs, parameters, memory):
    """A torque about x and y."""
    return (0.01, 0.01, 0.0)


def test_a_full_wheel_does_not_cost_the_others(craft):
    """The wheel along x is full, and nothing of x is given; y gets all that is asked."""
    three = {"layout": {"kind": "orthogonal"}, "initial_speed_rpm": [-6000.0, 0.0, 0.0],
             "failures": [], "speed_noise_rpm": 0.0, "coulomb_friction_n_m": 0.0,
             "viscous_friction_n_m_s": 0.0, "stiction_n_m": 0.0}  # fmt: skip
    result = simulate(craft({"spacecraft.wheels": WHEELS | three}), laws={"wheels": sideways})
    torque = result.wheel_torque.values[1:10]
    assert np.abs(torque[:, 0]).max() < 1e-3
    assert torque[:, 1] == pytest.approx(-0.01)


def test_what_is_no_law_and_what_is_no_scenario(craft):
    with pytest.raises(ValueError, match=r"^laws\.wheels: must be a torquer\.Law .*; received 3$"):
        simulate(craft(), laws={"wheels": 3})
    message = r"^scenario: must be a torquer Scenario \(see .*\); received 'file\.toml'$"
    with pytest.raises(ValueError, match=message):
        simulate("file.toml")
