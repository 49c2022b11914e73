"""Whole flights in which a sensor reads no number: alone, side by side, in plain Python and in C.

Every built-in law and estimator with failures of every sensor; which ones is drawn at random, the
same ones each time. The slow tests fly them all.
"""

import itertools
import os
import subprocess
import sys

import numpy as np
import pytest
from filter_cases import DYNAMICS, GYRO, without
from flight.c99 import plain_replay
from flight.c99.in_c import needs_compiler
from flight.c99.test_export import built, replayed
from law_examples import EXAMPLES
from simulation.lanes.test_lanes import fly_both
from slow_cases import slow_after

import torquer
from torquer import Law, RunStopped, simulate
from torquer.compile import engine
from torquer.computer.laws import LAWS
from torquer.scenario.load import scenario_from_data
from torquer.scenario.toml_text import toml_from_data

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")

AXES = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0], [0, 0, -1]]
#: Sensors that may fail, with errors that are drawn at every reading.
SENSORS = {
    "magnetometer": {"noise_nt": 50.0},
    "search_coil": {"noise_nt_s": 20.0},
    "gyro": {"noise_deg_s": 0.01, "bias_drift_deg_s_sqrt_s": 1e-4},
    "sun_sensors": {"axes": AXES, "half_field_deg": 60.0, "noise_deg": 0.1},
    "attitude_sensor": {"noise_deg": 0.05},
    "horizon_sensor": {"noise_deg": 0.2},
    "sun_cells": {"normals": AXES, "noise": 0.01},
}
WHEELS = {
    "layout": {"kind": "orthogonal"}, "momentum_limit_n_m_s": 2.0, "speed_limit_rpm": 6000,
    "torque_limit_n_m": 0.05,
}  # fmt: skip
KINDS = ("nan", "infinite")
BUILT_IN = [kind for kind in LAWS if kind not in ("user", "off")]
ON_WHEELS = (
    "wheel_pd", "wheel_lyapunov", "wheel_one_axis", "wheel_tracking", "bias_momentum", "unloading",
)  # fmt: skip
#: What a law declares that takes a sensor.
NEED = {
    "magnetometer": "magnetometer", "gyro": "rate", "sun_sensors": "sun",
    "search_coil": "search_coil", "attitude_sensor": "attitude", "horizon_sensor": "horizon",
    "sun_cells": "sun_cells",
}  # fmt: skip
NOISE = {"magnetometer_noise_nt": 50.0, "sun_noise_deg": 0.1}
STARS = {"star_tracker_noise_deg": 0.05, "horizon_noise_deg": 0.2, "cell_noise": 0.02,
         "cell_normals": AXES,
         "sensors": ["magnetometer", "sun", "star_tracker", "horizon", "sun_cells"]}  # fmt: skip
ESTIMATORS = {
    "triad": {"kind": "triad", "rate": "gyro", **NOISE},
    "rate_from_field": {"kind": "rate_from_field"},
    "kalman_gyro": GYRO | STARS,
    "kalman_dynamics": DYNAMICS | STARS | {"rate_sigma_deg_s": 3.0},
    "gyro, field alone": without(GYRO, "sun_noise_deg") | {"sensors": ["magnetometer"]},
    "dynamics, field alone": without(DYNAMICS, "sun_noise_deg") | {"sensors": ["magnetometer"]},
}
LENGTH_S = 240.0


def example(kind):
    """Keys of an example of a law; wheels at rest are to be unloaded, too."""
    at_rest = {"dead_band_n_m_s": 0.0} if kind == "unloading" else {}
    return {"kind": kind, **EXAMPLES[kind], **at_rest}


@pytest.fixture(scope="module")
def fly_data(plain_data):
    """Data of a scenario with all sensors, some of which fail; changed by dotted keys."""

    def build(failures=(), on_wheels=False, **control):
        craft = {
            f"spacecraft.{name}": keys | {"failures": list(dict(failures).get(name, []))}
            for name, keys in SENSORS.items()
        }
        craft |= {"spacecraft.wheels": WHEELS} if on_wheels else {}
        return plain_data({
            **craft, "control": {"sample_s": 1.0, **control}, "environment.eclipse": "none",
            "simulation": {"duration_s": LENGTH_S, "step_s": 1.0, "record_s": 1.0,
                           "integrator": "rk4"},
        })  # fmt: skip

    return build


def with_law(fly_data, kind, failures=()):
    """A scenario under one law."""
    return scenario_from_data(fly_data(failures, kind in ON_WHEELS, law=example(kind)))


def commands(result):
    """Dipole and motors' torques at each control step."""
    torque = result["wheel_torque"].values if "wheel_torque" in result else []
    parts = [result["command_body"].values, *([torque] if len(torque) else [])]
    return np.concatenate(parts, axis=1)[:-1]


def drawn(seed, count):
    """Sensors, kinds and intervals of failures, drawn at random."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        from_s = float(rng.integers(60, 120))
        until_s = from_s + float(rng.integers(1, 50))
        interval = {"from_s": from_s, "until_s": until_s}
        yield str(rng.choice([*SENSORS])), {"kind": str(rng.choice(KINDS)), **interval}


def fly_with(fly_data, kind, sensor, failure, whole):
    """A law flies through a failure: finite commands, none of those it cannot find, then again."""
    result = simulate(with_law(fly_data, kind, {sensor: [failure]}))
    found, law = commands(result), with_law(fly_data, kind).control.law.law()
    assert len(found) == LENGTH_S and np.isfinite(found).all()
    gone = slice(int(failure["from_s"]), int(failure["until_s"]))
    assert np.array_equal(found[: gone.start], whole[: gone.start])
    if NEED[sensor] not in law.needs:
        assert np.array_equal(found, whole)
    elif NEED[sensor] in law.waits_for:
        assert not found[gone].any()
    assert found[gone.stop + 5 :].any()


@pytest.mark.parametrize("kind", BUILT_IN)
def test_a_law_flies_through_failures_and_works_again(fly_data, kind):
    whole = commands(simulate(with_law(fly_data, kind)))
    for sensor, failure in drawn(BUILT_IN.index(kind), 2):
        fly_with(fly_data, kind, sensor, failure, whole)


@pytest.mark.slow
@pytest.mark.parametrize("kind", BUILT_IN)
def test_a_law_flies_through_each_failure_and_works_again(fly_data, kind):
    whole = commands(simulate(with_law(fly_data, kind)))
    for sensor, of, until_s in itertools.product(SENSORS, KINDS, (101.0, 140.0)):
        failure = {"kind": of, "from_s": 100.0, "until_s": until_s}
        fly_with(fly_data, kind, sensor, failure, whole)


@pytest.mark.parametrize("kind", KINDS)
def test_bdot_brakes_again_as_if_it_had_rested(fly_data, kind):
    """From the second reading after the failure on its command is what it makes of two readings."""
    gain = EXAMPLES["bdot"]["gain_a_m2_s_per_t"]
    failure = {"kind": kind, "from_s": 60.0, "until_s": 80.0}
    scenario = with_law(fly_data, "bdot", {"magnetometer": [failure]})
    result = simulate(scenario.replace("simulation.duration_s", 200.0))
    b, found = result["b_measured"].values, result["command_body"].values
    again = slice(81, 199)
    assert found[again] == pytest.approx(-gain * (b[again] - b[80:198]), rel=1e-9)
    assert not np.isfinite(b[60:80]).any() and not found[60:81].any()


@pytest.mark.parametrize("name", ESTIMATORS)
def test_an_estimate_is_finite_or_unknown_through_failures(fly_data, name):
    """A law that waits for the estimate holds meanwhile; no infinity is stated."""
    gives_attitude = name != "rate_from_field"
    law = {"held": example("three_axis" if gives_attitude else "bdot_rate")}
    for sensor, failure in drawn([*ESTIMATORS].index(name), 4):
        data = fly_data({sensor: [failure]}, estimator=ESTIMATORS[name], laws=law)
        result = simulate(scenario_from_data(data))
        assert np.isfinite(commands(result)).all()
        for part in ("q_estimated", "omega_estimated", "attitude_sigma", "gyro_bias_estimated"):
            assert not np.isinf(result[part].values).any(), (sensor, failure)
        known = np.isfinite(result["omega_estimated"].values[10:-1]).all(axis=1)
        assert known[int(failure["until_s"]) :].all(), (sensor, failure)
        if "kalman" in name:
            assert known.all()


@pytest.mark.parametrize("sensor", sorted(SENSORS.keys() - {"search_coil"}))
@pytest.mark.parametrize("kind", KINDS)
def test_a_filter_shows_the_sensor_that_reads_no_number(fly_data, sensor, kind):
    """But a star tracker that reads NaN is taken for blinded; no filter reads the search coil."""
    failure = {"kind": kind, "from_s": 100.0, "until_s": 130.0}
    data = fly_data({sensor: [failure]}, estimator=GYRO | STARS, law={"kind": "off"})
    result = simulate(scenario_from_data(data)).isel(time=slice(0, -1))
    wrong = result["isolated"].sel(sensor=sensor).values > 0.0
    is_seen = not (sensor == "attitude_sensor" and kind == "nan")
    assert (wrong[100:130] == is_seen).all() and not wrong[10:100].any()
    assert not wrong[130:].any()


CHECKED = {
    "noise": {"magnetometer_noise_nt": 100, "sun_noise_deg": 0.2, "gyro_noise_deg_s": 0.02,
              "rate_tolerance_deg_s": 0.06},
    "inertia_kg_m2": [1.0, 1.3, 1.7], "axis": [0, 0, 1], "target": "sun",
}  # fmt: skip


def switched(signal, **condition):
    """A mode table that leaves its first state for good if a condition holds once."""
    when = {"signal": signal, **condition}
    states = {
        "first": {"laws": ["braking"], "transitions": [{"to": "second", "when": when}]},
        "second": {"laws": ["braking"], "final": True},
    }
    return {**CHECKED, "states": states}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("sensor", "signal", "condition"),
    [
        ("magnetometer", "field_nt", {"above": 1e6}),
        ("magnetometer", "field_nt", {"below": 1.0}),
        ("gyro", "rate_deg_s", {"above": 100.0}),
        ("gyro", "rate_deg_s", {"below": 0.01}),
        ("gyro", "nutation_deg", {"above": 89.0}),
        ("sun_sensors", "axis_to_sun_deg", {"above": 179.9}),
        ("sun_sensors", "axis_to_sun_deg", {"below": 0.1}),
        ("sun_sensors", "axis_to_target_deg", {"below": 0.1}),
        ("sun_sensors", "sensor_suspected", {"sensor": "gyro", "above": 0.5}),
        ("gyro", "sensor_suspected", {"sensor": "magnetometer", "above": 0.5}),
        ("magnetometer", "coil_suspected", {"coil": "x", "above": 0.5}),
        ("gyro", "coils_reversed", {"above": 0.5}),
        ("horizon_sensor", "sensor_suspected", {"sensor": "sun_sensors", "above": 0.5}),
    ],
)
def test_no_mode_is_left_for_what_is_no_number(fly_data, sensor, signal, condition, kind):
    failure = {"kind": kind, "from_s": 60.0, "until_s": 100.0}
    table = switched(signal, **condition)
    laws = {"braking": example("bdot")}
    result = simulate(scenario_from_data(fly_data({sensor: [failure]}, laws=laws, modes=table)))
    assert not result["mode_main"].values.any() and np.isfinite(commands(result)).all()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("sensor", SENSORS)
def test_the_sensor_is_suspected_at_once(fly_data, sensor, kind):
    failure = {"kind": kind, "from_s": 60.0, "until_s": 100.0}
    table = switched("sensor_suspected", sensor=sensor, above=0.5)
    laws = {"braking": example("bdot")}
    result = simulate(scenario_from_data(fly_data({sensor: [failure]}, laws=laws, modes=table)))
    is_seen = not (sensor == "attitude_sensor" and kind == "nan")  # it may be blinded
    assert result["mode_main"].values[:-1].tolist() == [0] * 60 + [int(is_seen)] * 180


def test_a_users_law_may_stop_the_run(fly_data):
    def own(inputs, parameters, memory):
        return tuple(1e4 * x for x in inputs.b_body_t)

    failure = {"kind": "nan", "from_s": 60.0}
    scenario = with_law(fly_data, "bdot", {"magnetometer": [failure]})
    with pytest.raises(RunStopped, match=r"must return a finite dipole; received \(nan, nan, nan"):
        simulate(scenario, Law("own", own, compiled=False))


#: Laws that fly together, with failures of what they read: side by side, in C, in plain Python.
TOGETHER = {
    name: example(name)
    for name in ("bdot", "sdot", "spin_to_sun", "nutation_damping", "three_axis", "preliminary_1")
}
FAILURES = {
    "magnetometer": [{"kind": "nan", "from_s": 30.0, "until_s": 45.0},
                     {"kind": "infinite", "from_s": 120.0, "until_s": 121.0}],
    "gyro": [{"kind": "infinite", "from_s": 40.0, "until_s": 60.0}],
    "sun_sensors": [{"kind": "nan", "from_s": 70.0, "until_s": 85.0},
                    {"kind": "infinite", "from_s": 90.0, "until_s": 95.0}],
    "attitude_sensor": [{"kind": "infinite", "from_s": 100.0, "until_s": 110.0}],
    "horizon_sensor": [{"kind": "nan", "from_s": 130.0, "until_s": 140.0}],
    "sun_cells": [{"kind": "nan", "from_s": 150.0, "until_s": 160.0}],
}  # fmt: skip


def five_heads(data):
    """The scenario with five sun sensors, as the examples have: the loop over their lanes."""
    data["spacecraft"]["sun_sensors"]["axes"] = AXES[:5]
    return scenario_from_data(data)


def test_members_side_by_side_have_the_bits_of_each_alone(fly_data):
    scenario = five_heads(fly_data(FAILURES, laws=TOGETHER))
    assert np.isfinite(commands(simulate(scenario))).all()
    for beside, kept, cells, own in fly_both(scenario, rows=(0, 7, 16)):
        assert np.array_equal(beside, kept)
        assert cells["coil_energy_j"] == own["coil_energy_j"] > 0.0


@pytest.mark.slow
@pytest.mark.parametrize("kind", BUILT_IN)
def test_each_law_side_by_side_has_the_bits_of_each_alone(fly_data, kind):
    scenario = with_law(fly_data, kind, FAILURES)
    for beside, kept, _, _ in fly_both(scenario, rows=(0, 20)):
        assert np.array_equal(beside, kept)


def test_filters_side_by_side_have_the_bits_of_each_alone(fly_data):
    control = {"estimator": GYRO | STARS, "laws": {"held": example("three_axis")}}
    for beside, kept, _, _ in fly_both(five_heads(fly_data(FAILURES, **control)), rows=[3]):
        assert np.array_equal(beside, kept)


#: What is exported: computers that fly through all failures.
EXPORTED = {
    "laws": {"laws": TOGETHER},
    "magneto_gyro": {"law": example("magneto_gyro")},
    "triad": {"estimator": ESTIMATORS["triad"], "laws": {"held": example("three_axis")}},
    "modes": {"laws": {"braking": example("bdot_rate")},
              "modes": switched("sensor_suspected", sensor="horizon_sensor", above=0.5)},
    "gyro": {"estimator": GYRO | STARS, "laws": {"held": example("three_axis")}},
    "dynamics": {"estimator": ESTIMATORS["kalman_dynamics"], "law": {"kind": "off"}},
}  # fmt: skip


@needs_compiler
@pytest.mark.parametrize("name", slow_after(4, EXPORTED))
def test_c_and_plain_python_have_the_same_bits(fly_data, tmp_path, name):
    data = fly_data(FAILURES, **EXPORTED[name])
    scenario = scenario_from_data(data)
    torquer.export_c(scenario, tmp_path / "c", steps=200)
    done = replayed(built(tmp_path / "c", "-O2"), tmp_path / "c")
    said = "200 control steps: the same bits in commands and state\n"
    assert (done.stdout, done.returncode) == (said, 0)
    (tmp_path / "scenario.toml").write_text(toml_from_data(data))
    command = [sys.executable, plain_replay.__file__, tmp_path / "scenario.toml"]
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(
        [*command, tmp_path / "c/test/recorded.bin"], capture_output=True, text=True,
        env=environment,
    )  # fmt: skip
    assert done.stdout == said, done.stderr
