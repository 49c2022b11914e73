"""Modes in the loop: laws, parameters, actuators, estimator of a state; stop and resume."""

import itertools
import math

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from integrators import INTEGRATORS, by
from slow_cases import slow_after

from torquer import RunStopped, law, load, resume, save, simulate
from torquer.compile import engine
from torquer.simulation.results.dataset import flown_laws

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")

WHEELS = {
    "layout": {"kind": "regular_pyramid", "count": 4, "gamma_deg": 54.7},
    "momentum_limit_n_m_s": 1.0,
    "torque_limit_n_m": 0.02,
}


@law(parameters={"along": 1.0, "axis": (1.0, 0.0, 0.0)})
def steady(inputs, parameters, memory):
    """The same dipole always."""
    p = parameters
    return (p.along * p.axis[0], p.along * p.axis[1], p.along * p.axis[2])


@law(answers="torque")
def pushing(inputs, parameters, memory):
    """The same torque always."""
    return (1e-3, 0.0, -2e-3)


def timed(**states):
    """States one after another, each for a minute; the last for ever."""
    names = [*states]
    made = {name: dict(keys) for name, keys in states.items()}
    for name, after in itertools.pairwise(names):
        made[name]["transitions"] = [{"to": after, "at_most_s": 60.0}]
    return {"states": made | {names[-1]: made[names[-1]] | {"final": True}}}


def flown(make, modes, laws, **changes):
    """The result of laws under modes; commands every second."""
    off = {name: {"kind": "off"} for name in laws}
    base = {
        "control": {"laws": off, "modes": modes, **changes.pop("control", {})},
        "spacecraft.coils.limit_a_m2": 100.0,
        "simulation": {"duration_s": 300.0, "step_s": 1.0, "record_s": 1.0},
    }
    return simulate(make(base | changes), laws=laws)


def minutes(result, name):
    """What is recorded of each whole minute, the same throughout."""
    found = []
    for minute in range(5):
        rows = result[name].values[60 * minute : 60 * minute + 60]
        assert np.array_equal(rows, np.tile(rows[0], (60, 1))), minute
        found.append(rows[0].tolist())
    return found


def test_factors_of_a_state_multiply_the_commands_of_its_laws(make):
    modes = timed(
        both={"laws": ["x", "z"]},
        one={"laws": {"x": 0.25}},
        against={"laws": {"x": -1.0, "z": 3.0}},
        none={},
    )
    z = steady.with_parameters(axis=(0.0, 0.0, 2.0))
    result = flown(make, modes, {"x": steady, "z": z})
    assert minutes(result, "command_body")[:4] == [
        [1.0, 0.0, 2.0], [0.25, 0.0, 0.0], [-1.0, 0.0, 6.0], [0.0, 0.0, 0.0],
    ]  # fmt: skip
    assert result.attrs["how_it_ended"] == "complete"


def test_states_set_parameters_that_stay_until_they_are_set_again(make):
    modes = timed(
        own={"laws": ["x"]},
        set={"laws": ["x"], "set": {"x.along": 5.0, "x.axis": [0.0, 1.0, 0.5]}},
        kept={"laws": ["x"]},
        again={"laws": ["x"], "set": {"x.along": -2.0}},
    )
    result = flown(make, modes, {"x": steady})
    assert minutes(result, "command_body")[:4] == [
        [1.0, 0.0, 0.0], [0.0, 5.0, 2.5], [0.0, 5.0, 2.5], [0.0, -2.0, -1.0],
    ]  # fmt: skip
    assert flown_laws(result)["x"]["parameters"] == {"along": 1.0, "axis": [1.0, 0.0, 0.0]}


def test_a_state_switches_coils_and_wheels_off(make):
    modes = timed(
        all={"laws": ["x", "push"]},
        no_coils={"laws": ["x", "push"], "coils": "off"},
        no_wheels={"laws": ["x", "push"], "wheels": "off"},
        on={"laws": ["x", "push"], "coils": "on"},
    )
    result = flown(make, modes, {"x": steady, "push": pushing}, **{"spacecraft.wheels": WHEELS})
    torque, dipole = [1e-3, 0.0, -2e-3], [1.0, 0.0, 0.0]
    off = [0.0, 0.0, 0.0]
    assert minutes(result, "torque_command_body")[:4] == [torque, torque, off, torque]
    assert minutes(result, "dipole_body")[:4] == [dipole, off, dipole, dipole]
    assert not result.wheel_torque.values[120:180].any()


@law
def wild(inputs, parameters, memory):
    """No numbers, as from a sensor that reads none."""
    return (math.nan, math.inf, math.nan)


def test_law_commands_to_switched_off_coils_stop_no_flight(make):
    modes = {"states": {"off": {"laws": ["x"], "coils": "off", "final": True}}}
    result = flown(make, modes, {"x": wild})
    assert result.attrs["how_it_ended"] == "complete" and not result["command_body"].values.any()
    modes["states"]["off"]["coils"] = "on"
    with pytest.raises(RunStopped, match="must return a finite dipole"):
        flown(make, modes, {"x": wild})


def test_a_region_switches_the_coils_off_whatever_the_others_do(make):
    modes = {"regions": {
        "law": {"states": {"x": {"laws": ["x"], "final": True}}},
        "power": timed(on={}, low={"coils": "off"}, back={}),
    }}  # fmt: skip
    result = flown(make, modes, {"x": steady})
    assert [row[0] for row in minutes(result, "dipole_body")] == [1.0, 0.0, 1.0, 1.0, 1.0]
    power = result.mode_power
    assert power.attrs["flag_meanings"] == "on low back"
    assert np.array_equal(power.values[:-1], np.repeat([0, 1, 2, 2, 2], 60))


@law
def believed(inputs, parameters, memory):
    """The estimated rate [mrad/s] as a dipole; 0 where it is not known."""
    x, y, z = inputs.estimate.omega_body_rad_s
    return (1e3 * x, 1e3 * y, 1e3 * z) if x == x else (0.0, 0.0, 0.0)


def test_a_state_chooses_the_estimator(make):
    """Which works from the next control step on."""
    modes = timed(
        sensors={"laws": ["x"], "estimator": "attitude_sensor"},
        field={"laws": ["x"], "estimator": "from_field"},
        nothing={"laws": ["x"], "estimator": "none"},
        usual={"laws": ["x"]},
    )
    control = {"estimators": {"from_field": {"kind": "rate_from_field"}}}
    result = flown(make, modes, {"x": believed}, control=control)
    asked, omega = 1e-3 * result.command_body.values, result.omega_body.values
    b = result.b_body.values / np.linalg.norm(result.b_body.values, axis=1)[:, None]
    read = np.r_[0:61, 181:300]
    assert asked[read] == pytest.approx(omega[read], abs=1e-15)
    across = omega - b * np.sum(omega * b, axis=1)[:, None]
    assert asked[70:120] == pytest.approx(across[70:120], abs=3e-3)  # the field turns, too
    assert np.abs(asked[70:120] - omega[70:120]).max() > 6e-3
    assert not asked[121:181].any()
    assert np.isnan(result.omega_estimated.values[121:181]).all()
    assert 1e3 * result.omega_estimated.values[70:300] == pytest.approx(
        np.where(np.arange(69, 299)[:, None] // 60 == 2, np.nan, 1e3 * asked[70:300]), nan_ok=True
    )


def test_when_states_were_entered_and_how_often(make):
    """Two states in turn, of 70 and 40 s: the times are those of the control steps."""
    modes = {"states": {
        "a": {"laws": ["x"], "transitions": [{"to": "b", "at_least_s": 70.0}]},
        "b": {"transitions": [{"to": "a", "at_most_s": 40.0}]},
    }}  # fmt: skip
    result = flown(make, modes, {"x": steady})
    assert result.mode.values.tolist() == ["main.a", "main.b"]
    assert result.mode_entries.values.tolist() == [3.0, 3.0]
    assert result.mode_entered.values.tolist() == [220.0, 290.0]
    phase = result.time.values[:-1] % 110.0
    assert np.array_equal(result.mode_main.values[:-1], phase >= 70.0)
    assert np.array_equal(result.command_body.values[:-1, 0], 1.0 * (phase < 70.0))


@pytest.mark.parametrize("signal", ["sunlit_fraction", "sun_in_view"])
def test_modes_know_day_and_night(make, signal):
    """By the ephemeris, or by Sun sensors that are left out and so see all the sky."""
    modes = {"states": {
        "day": {"laws": ["x"], "transitions": [{"to": "night",
                                                "when": {"signal": signal, "below": 0.5}}]},
        "night": {"transitions": [{"to": "day", "when": {"signal": signal, "above": 0.5}}]},
    }}  # fmt: skip
    result = flown(make, modes, {"x": steady}, **{
        "orbit.inclination_deg": 10.0,
        "simulation": {"revolutions": 1, "step_s": 1.0, "record_s": 1.0},
    })  # fmt: skip
    night, sunlit_fraction = result.mode_main.values[1:-1] == 1, result.sunlit_fraction.values[1:-1]
    assert 0.3 < night.mean() < 0.4
    assert np.array_equal(night, sunlit_fraction < 0.5)


@law(
    parameters={"gain": 2e5},
    memory={"calls": 0.0, "leaky": (1.0, 0.0, 0.0)},
    log={"calls": "1", "leaky": "T", "dipole_size": "A m^2"},
)
def telling(inputs, parameters, memory):
    """A law that remembers, and logs what it does."""
    memory.calls += 1.0
    for k in range(3):
        memory.leaky[k] = 0.9 * memory.leaky[k] + inputs.b_body_t[k]
    x = parameters.gain * memory.leaky[1]
    memory.dipole_size = abs(x)
    return (x, -parameters.gain * memory.leaky[0], 0.0)


def test_the_result_has_what_laws_log(make):
    result = flown(make, timed(work={"laws": ["own"]}, rest={}), {"own": telling})
    calls = result["own.calls"]
    assert calls.attrs == {"units": "1", "long_name": "own.calls, logged by law telling"}
    t = result.time.values[:-1]
    assert np.array_equal(calls.values[:-1], np.minimum(t, 59.0) + 1.0)  # after that of the step
    assert result["own.leaky"].dims == ("time", "axis")
    asked = result.command_body.values[:60]
    assert asked[:, 0] == pytest.approx(2e5 * result["own.leaky"].values[:60, 1], rel=1e-14)
    assert np.array_equal(result["own.dipole_size"].values[:60], np.abs(asked[:, 0]))
    alone = simulate(make({"simulation.record_s": 1.0}), telling)
    assert alone["law.calls"].values[-2] == 600.0


def test_an_estimator_of_the_only_law_is_recorded(make):
    changes = {
        "control": {"law": {"kind": "bdot_rate", "gain_a_m2_s_per_t": 1e5},
                    "estimator": {"kind": "rate_from_field", "interval_s": 2.0}},
        "simulation.record_s": 1.0,
    }  # fmt: skip
    result = simulate(make(changes)).isel(time=slice(5, -1))
    asked = 1e5 * np.cross(result.omega_estimated.values, result.b_measured.values)
    assert result.command_body.values == pytest.approx(asked, rel=1e-12, abs=1e-15)
    assert np.array_equal(result.estimate_time.values, result.time.values // 2 * 2)
    assert np.isnan(result.q_estimated.values).all()


def test_what_an_estimator_knew_ends_with_it(make):
    """Attitude sensor and gyro, which take over, state neither an error nor a bias."""
    laws, sensors = {"laws": ["idle"]}, {"estimator": "attitude_sensor"}
    modes = timed(filtered=laws | {"estimator": "fixes"}, read=laws | sensors)
    fixes = {"kind": "triad", "magnetometer_noise_nt": 50.0, "sun_noise_deg": 0.5}
    changes = {
        "control": {"laws": {"idle": {"kind": "off"}}, "modes": modes,
                    "estimators": {"fixes": fixes}},
        "spacecraft.sun_sensors": {"axes": [[0, 0, 1]], "half_field_deg": 180.0},
        "environment.eclipse": "none",
        "simulation": {"duration_s": 120.0, "step_s": 1.0, "record_s": 1.0},
    }  # fmt: skip
    result = simulate(make(changes))
    sigma = result.attitude_sigma.values
    assert np.isfinite(sigma[5:60]).all()
    assert np.isnan(sigma[62:]).all()


@pytest.mark.parametrize("kind", ["bdot", "nutation_damping", "sdot"])
def test_rested_law_takes_no_difference_across_its_rest(make, kind):
    """Its last reading is a minute old when it works again: the first command is none."""
    gain = "gain_a_m2_s" if kind == "sdot" else "gain_a_m2_s_per_t"
    modes = timed(on={"laws": ["own"]}, rest={}, again={"laws": ["own"]})
    changes = {
        "control": {"laws": {"own": {"kind": kind, gain: 1e4}}, "modes": modes},
        "environment.eclipse": "none",
        "simulation": {"duration_s": 180.0, "step_s": 1.0, "record_s": 1.0},
    }
    command = simulate(make(changes)).command_body.values
    assert command[2:60].any(axis=1).all()
    assert not command[60:121].any()  # called again at 120 s, with a reading to begin with
    assert command[121:180].any(axis=1).all()


#: All that remembers: modes in three regions, an estimator, delays, noise, drift, lag, a window.
EVERYTHING = {
    "spacecraft.magnetometer": {"noise_nt": 50.0, "coil_disturbance_nt_per_a_m2": 100.0,
                                "sample_s": 1.5, "delay_s": 1.0},
    "spacecraft.gyro": {"noise_deg_s": 0.01, "bias_drift_deg_s_sqrt_s": 0.001,
                        "sample_s": 2.0, "delay_s": 2.0},
    "spacecraft.sun_sensors": {"axes": [[1, 0, 0], [-1, 2, 0]], "half_field_deg": 80.0,
                               "noise_deg": 0.1, "sample_s": 5.0},
    "spacecraft.coils": {"limit_a_m2": [2.0, 3.0, 4.0], "lag_s": 0.7},
    "control": {
        "laws": {"damping": {"kind": "bdot", "gain_a_m2_s_per_t": 1e6},
                 "rate": {"kind": "bdot_rate", "gain_a_m2_s_per_t": 5e5},
                 "own": {"kind": "off"}},
        "estimator": {"kind": "rate_from_field", "interval_s": 3.0},
        "modes": {"regions": {
            "law": {"states": {
                "coarse": {"laws": {"damping": 0.5, "own": 1.0},
                           "transitions": [{"to": "fine", "at_least_s": 47.0}]},
                "fine": {"laws": ["damping", "rate"], "set": {"rate.gain": 2e5},
                         "transitions": [{"to": "coarse", "for_s": 20.0,
                                          "when": {"signal": "field_nt", "above": 100.0}}]}}},
            "power": {"states": {
                "on": {"transitions": [{"to": "off", "at_most_s": 61.0}]},
                "off": {"coils": "off", "transitions": [{"to": "on", "at_most_s": 13.0}]}}},
            "source": {"states": {
                "field": {"transitions": [{"to": "gyro", "at_most_s": 90.0}]},
                "gyro": {"estimator": "attitude_sensor",
                         "transitions": [{"to": "field", "at_most_s": 35.0}]}}},
        }},
        "sample_s": 3.0, "measure_s": 6.0, "actuate_s": 4.0,
    },
    "simulation": {"duration_s": 602.0, "step_s": 0.5, "record_s": 7.0},
    "seed": 7,
}  # fmt: skip
HOSTED = law(
    telling.function, parameters={"gain": 2e5}, memory=telling.memory, log=telling.log,
    compiled=False,
)  # fmt: skip
LAWS = {"compiled": {"own": telling}, "hosted": {"own": HOSTED}}


def same(a, b):
    """Whether two results are the same, bit for bit."""
    assert sorted(a.variables) == sorted(b.variables)
    for name in a.variables:
        equal_nan = a[name].dtype.kind == "f"
        assert np.array_equal(a[name].values, b[name].values, equal_nan=equal_nan), name
    assert a.attrs == b.attrs
    return True


@pytest.fixture(scope="module")
def wholes(make):
    """`wholes(integrator, way)`: (scenario, laws, the unbroken run)."""
    known = {}

    def whole(integrator, way):
        if (integrator, way) not in known:
            scenario = make(EVERYTHING | by(integrator))
            known[integrator, way] = scenario, LAWS[way], simulate(scenario, laws=LAWS[way])
        return known[integrator, way]

    return whole


@pytest.mark.parametrize("way", LAWS)
def test_modes_change_often_in_the_runs_of_these_tests(wholes, way):
    """Else the tests below would not mean much."""
    _, _, whole = wholes("rk4", way)
    assert whole.mode_entries.values.min() >= 5.0
    assert np.isfinite(whole.omega_estimated.values[5:]).all()
    assert whole["own.calls"].values[-1] > 50.0


@pytest.mark.parametrize("way", LAWS)
@pytest.mark.parametrize("integrator", slow_after(1, INTEGRATORS))
def test_run_stopped_at_any_instant_resumes_bit_identically(wholes, integrator, way, tmp_path):
    scenario, laws, whole = wholes(integrator, way)
    for stop_s in (0.0, 1.0, 47.0, 60.5, 61.0, 333.5):
        part = simulate(scenario, laws=laws, until_s=stop_s)
        assert part.attrs["how_it_ended"] == "stopped"
        assert same(resume(part, laws=laws), whole)
    save(part, tmp_path / "part.nc")
    assert same(resume(load(tmp_path / "part.nc"), laws=laws), whole)


@pytest.mark.slow
@settings(
    max_examples=10, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    st.sampled_from(INTEGRATORS),
    st.sampled_from([*LAWS]),
    st.lists(st.floats(0.0, 602.0), min_size=1, max_size=4),
)
def test_repeatedly_stopped_run_matches_the_unbroken_one(wholes, integrator, way, stops):
    scenario, laws, whole = wholes(integrator, way)
    part = simulate(scenario, laws=laws, until_s=min(stops))
    for stop_s in sorted(stops)[1:]:
        part = resume(part, laws=laws, until_s=stop_s)
    assert same(resume(part, laws=laws), whole)


def test_plain_laws_give_the_bits_of_compiled_ones_in_modes(wholes):
    """Their own answers are rounded once each: see the law."""
    compiled, hosted = (wholes("rk4", way)[2] for way in LAWS)
    for name in ("mode_law", "mode_power", "mode_source", "own.calls"):
        assert np.array_equal(compiled[name].values, hosted[name].values), name
    for name in ("omega_body", "command_body", "omega_estimated"):
        size = np.nanmax(np.abs(compiled[name].values))
        away = np.nanmax(np.abs(compiled[name].values - hosted[name].values))
        assert away < 1e-9 * size, name
