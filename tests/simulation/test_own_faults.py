"""The user's own parts fail in flight: one line that names key, file and instant."""

import re

import numpy as np
import pytest
from own_parts import (
    AIR,
    BEGINS,
    BRIEF,
    DRAG,
    ESTIMATE,
    LAW,
    LEAK,
    PARTS,
    TEXT,
    compiled_only,
    made,
    message,
    put,
    scenario_maker,
    stopped,
    whole_runs,
    write,
)

from torquer.scenario.load import check_orbit_environment
from torquer.simulation.results.file import load
from torquer.simulation.setup import size
from torquer.simulation.setup.simulate import resume, simulate


@pytest.fixture
def scenario(tmp_path):
    """A function that makes the scenario of some lines, beside files of parts."""
    return scenario_maker(tmp_path)


INSTANT = (
    "    if ((t_s > 1170.0) & (t_s < 1220.0)).any():\n        raise ValueError('boom')\n    a = 1e3"
)
YEARS = "    s = (years - 2025.4958904109589) * 365.0 * 86400.0\n"
YEARS += "    if ((s > 1170.0) & (s < 1220.0)).any():\n        raise ValueError('boom')\n"
LATER = {
    "orbit": ("    a = 1e3", INSTANT, r"at t = 1[12]\d\d"),
    "environment.field": (
        "    distance = np",
        YEARS + "    distance = np",
        "2025-07-01T00:(19|20):",
    ),
    "environment.atmosphere": (
        "    return np.full",
        YEARS + "    return np.full",
        "2025-07-01T00:(19|20):",
    ),
}


@whole_runs
@pytest.mark.parametrize("to_file", (False, True))
@pytest.mark.parametrize("key", LATER)
def test_surroundings_that_fail_later_leave_what_was_computed(
    scenario, tmp_path, key, to_file, monkeypatch
):
    """The first look does not find a minute; the next piece of the tables does."""
    monkeypatch.setattr(size, "_PIECE_ROWS", 100)
    old, new, expected = LATER[key]
    line, others, *_ = PARTS[key]
    times = {"duration_s": 3000.0, "record_s": 5.0, "step_s": 1.0}
    found_scenario = scenario(line, *others).replace("simulation", times)
    usual = simulate(found_scenario)
    put(tmp_path, key, old, new)
    found_scenario = scenario(line, *others).replace("simulation", times)
    check_orbit_environment(found_scenario)
    to = tmp_path / "result.nc" if to_file else None
    text, result = stopped(found_scenario, to)
    assert text.startswith(f"{key}: must be ") and re.search(expected, text)
    assert "ValueError('boom')" in text and str(tmp_path / "own.py") in text
    count = result.sizes["time"]
    assert count == 200 and (result["time"].values == usual["time"].values[:count]).all()
    assert np.array_equal(result["omega_body"], usual["omega_body"][:count])
    if to_file:
        assert load(to).sizes["time"] == count
        assert message(resume, to).startswith(f"{key}: must be ")


LATE = "    if {t} > 9.5:\n        {do}\n"
#: What is done, and what is said to be received, by a torque and by a sensor.
DONE = {
    "raise ValueError('boom')": r"received ValueError\('boom'\) at t = ",
    "x = 1.0 / float({t} - {t})": r"received ZeroDivisionError\('float division by zero'\) at t = ",
    "x = (1.0, 2.0)[int({t})]": r"received IndexError\('tuple index out of range'\) at t = ",
}
#: The same of answers.
ANSWERS = {
    "return (np.nan, 0.0, 0.0)": r", finite; received \(nan, 0\.0, 0\.0\) at t = ",
    "return (0.0, -np.inf, 0.0)": r", finite; received \(0\.0, -inf, 0\.0\) at t = ",
}


@pytest.mark.parametrize("do", (*DONE, *ANSWERS))
@pytest.mark.parametrize("step_s", (None, 0.5))
def test_a_torque_that_fails_in_flight_is_named(scenario, tmp_path, do, step_s):
    key = "disturbance.own.leak"
    text = LATE.replace("{do}", do).replace("{t}", "here.t_s")
    file = put(tmp_path, key, BEGINS[key], text + BEGINS[key])
    steps = BRIEF if step_s is None else {**BRIEF, "step_s": step_s}
    found, result = stopped(made(scenario, key).replace("simulation", steps))
    expected = {**DONE, **ANSWERS}[do] + r"(\d+\.?\d*) s \(leak in " + re.escape(str(file))
    received = re.search(expected, found)
    assert found.startswith(f"{key}: must be a function (here) that compiles and ") and received
    assert 9.5 <= float(received[1]) < 11.0
    assert result["time"].values[-1] == 8.0 and np.isfinite(result["omega_body"].values).all()


@compiled_only
def test_a_torque_of_another_shape_is_found_in_flight(scenario, tmp_path):
    key = "disturbance.own.leak"
    put(tmp_path, key, BEGINS[key], "    return np.zeros(4)\n")
    found, _ = stopped(made(scenario, key))
    assert "returns three numbers [N m]; received array([0., 0., 0., 0.]) at t = " in found


@pytest.mark.parametrize("size_n_m", (1e160, 1e200))
def test_a_torque_in_other_units_is_named(scenario, tmp_path, size_n_m):
    found, _ = stopped(
        made(scenario, "disturbance.own.leak", f"parameters = {{ size = {size_n_m} }}")
    )
    assert re.search(r"\[N m\], below 1e\+06 N m; received \(1e\+(160|200), .* at t = ", found)


@pytest.mark.parametrize("which", (0, 1))
def test_the_one_of_two_torques_that_fails_is_named(scenario, tmp_path, which):
    """Though both are the same function; with air and light, as `all_parts` have."""
    key = "disturbance.own.leak"
    text = "    light = here.light_body_pa\n"
    text += "    if damping > 0.5 and here.t_s > 3.0:\n        raise ValueError('boom')\n"
    put(tmp_path, key, BEGINS[key], text + BEGINS[key])
    lines = [
        LEAK.replace("own.leak", f"own.{name}").replace(
            "file =", f"parameters = {{ damping = {float(k == which)} }}, file =", 1
        )
        for k, name in enumerate(("one", "two"))
    ]
    found, _ = stopped(scenario(AIR, DRAG, *lines).replace("simulation", BRIEF))
    assert found.startswith(f"disturbance.own.{('one', 'two')[which]}: must be a function (here)")


@pytest.mark.parametrize("late", ("", "sample_s = 1.0, delay_s = 0.5"))
@pytest.mark.parametrize("do", (*DONE, *ANSWERS))
def test_a_sensor_that_fails_in_flight_is_named(scenario, tmp_path, do, late):
    """Whether a law reads it or not."""
    key = "spacecraft.own_sensor"
    text = LATE.replace("{do}", do).replace("{t}", "here.t_s")
    file = put(tmp_path, key, BEGINS[key], text + BEGINS[key])
    found, result = stopped(made(scenario, key, late))
    expected = {**DONE, **ANSWERS}[do] + r"10 s \(crosswise in " + re.escape(str(file))
    assert found.startswith(f"{key}: must be a function (here) that compiles and returns three num")
    assert re.search(expected, found)
    assert result["time"].values[-1] in (8.0, 10.0)
    assert np.isfinite(result["omega_body"].values).all()


@compiled_only
def test_a_sensor_of_another_shape_is_found_in_flight(scenario, tmp_path):
    key = "spacecraft.own_sensor"
    put(tmp_path, key, BEGINS[key], "    return np.zeros(2)\n")
    found, _ = stopped(made(scenario, key))
    assert "returns three numbers; received array([0., 0.]) at t = 0 s (crosswise in " in found


def test_the_noise_with_which_a_sensor_failed_is_that_which_is_said(scenario, tmp_path):
    key = "spacecraft.own_sensor"
    text = "    if here.t_s > 9.5:\n        return (np.inf, here.noise[0], here.noise[1])\n"
    usual, record = "    return (gain * 1e6 * b[1] + noise[0]", "    return (noise[0]"
    write(
        tmp_path, TEXT.replace(usual, record).replace("1e6 * b[0], here.sun", "noise[1], here.sun")
    )
    law = LAW.replace('memory={"read": (0.0, 0.0, 0.0)}', 'memory={"read": (0.0, 0.0, 0.0)}, '
                      'log={"read": "1"}')  # fmt: skip
    (tmp_path / "law.py").write_text(law)
    seen = simulate(made(scenario, "control.law"))["law.read"].values[5]
    write(tmp_path, TEXT.replace(BEGINS[key], text + BEGINS[key]))
    found, _ = stopped(made(scenario, "control.law"))
    said = re.search(r"received \(inf, (.*), (.*)\) at t = 10 s", found)
    assert [float(said[1]), float(said[2])] == pytest.approx(list(seen[:2]), rel=1e-12)


def test_a_failed_sensor_is_not_asked(scenario, tmp_path):
    """While a failure keeps it from reading, its function is not called."""
    key = "spacecraft.own_sensor"
    text = LATE.replace("{do}", "raise ValueError('boom')").replace("{t}", "here.t_s")
    put(tmp_path, key, BEGINS[key], text + BEGINS[key])
    silent = made(scenario, key, "failures = [{ kind = 'stuck', from_s = 9.0 }]")
    assert simulate(silent).attrs["how_it_ended"] == "complete"


ESTIMATES = {
    "raise ValueError('boom')": r"must not raise; received ValueError\('boom'\) \(estimate",
    "x = 1.0 / float({t} - {t})": r"must not raise; received ZeroDivisionError\('float ",
    "x = inputs.b_body_t[int({t})]": r"must not raise; received IndexError\(",
    "return torquer.Estimate(0.0, (np.nan, 0.0, 0.0, 1.0), {v}, {v}, 0.0, 0.0)":
        r"received \{'q_body_to_inertial': \(nan, 0\.0, 0\.0, 1\.0\)\} \(calm in ",
    "return torquer.Estimate(0.0, {q}, (0.0, np.inf, 0.0), {v}, 0.0, 0.0)":
        r"received \{'omega_body_rad_s': \(0\.0, inf, 0\.0\)\} \(calm in ",
    "return torquer.Estimate(0.0, {q}, {v}, {v}, np.inf, 0.0)":
        r"received \{'sigma_rad': inf\} \(calm in ",
}  # fmt: skip


@pytest.mark.parametrize("how", ("", "compiled=False, "))
@pytest.mark.parametrize("do", ESTIMATES)
def test_an_estimator_that_fails_in_flight_is_named(scenario, tmp_path, do, how):
    """At once, though no law has failed; the command of that step is not taken."""
    key = "control.estimator"
    text = LATE.replace("{do}", do).replace("{t}", "inputs.t_s") + BEGINS[key]
    text = text.replace("{q}", "inputs.q_body_to_inertial").replace("{v}", "(0.0, 0.0, 0.0)")
    text = ESTIMATE.replace(BEGINS[key], text)
    put(tmp_path, key, "@torquer.estimator(\n", f"@torquer.estimator({how}\n", text)
    found, result = stopped(made(scenario, key))
    assert found.startswith(f"{key}: must ") and re.search(ESTIMATES[do], found)
    assert " at t = 10 s" in found and "estimate.py" in found
    assert result["time"].values[-1] == 10.0 and np.isfinite(result["omega_body"].values).all()


@pytest.mark.parametrize("how", ("", "compiled=False, "))
def test_an_estimator_may_know_nothing_as_a_whole(scenario, tmp_path, how):
    """Not-a-numbers are what is unknown: of each part all of them, or none."""
    key, nan3 = "control.estimator", "(np.nan, np.nan, np.nan)"
    do = f"return torquer.Estimate(-np.inf, (np.nan, *{nan3}), {nan3}, {nan3}, np.nan, np.nan)"
    text = LATE.replace("{do}", do).replace("{t}", "inputs.t_s") + BEGINS[key]
    text = ESTIMATE.replace(BEGINS[key], text)
    put(tmp_path, key, "@torquer.estimator(\n", f"@torquer.estimator({how}\n", text)
    assert simulate(made(scenario, key)).attrs["how_it_ended"] == "complete"


@compiled_only
@pytest.mark.parametrize(
    ("answer", "expected"),
    (
        ("(0.0, 0.0, 0.0)", "received one that returns a tuple of 3 numbers (calm in "),
        ("None", "received one that returns nothing (calm in "),
        (
            "torquer.Estimate(0.0, (0.0, 0.0, 0.0, 1.0))",
            "received one that returns Estimate(number, ",
        ),
    ),
)
def test_an_estimator_that_returns_something_else_is_named(scenario, tmp_path, answer, expected):
    key = "control.estimator"
    text = (
        f"    return {answer}\n\n\ndef rest(inputs, parameters, memory):\n    {BEGINS[key].strip()}"
    )
    put(tmp_path, key, BEGINS[key], text)
    found = message(simulate, made(scenario, key))
    assert found.startswith(f"{key}: must compile as (inputs, parameters, memory) -> torquer.Est")
    assert expected in found


LAWS = {
    "raise ValueError('boom')": r"must not raise; received ValueError\('boom'\) \(law.py, line ",
    "return (1.0, math.nan, 0.0)": r"must return a finite dipole; received \(1, nan, 0\) \(",
}


@pytest.mark.parametrize("how", ("", "compiled=False, "))
@pytest.mark.parametrize("do", LAWS)
def test_a_law_of_a_file_that_fails_in_flight_is_named(scenario, tmp_path, do, how):
    key = "control.law"
    text = LATE.replace("{do}", do).replace("{t}", "inputs.t_s") + BEGINS[key]
    text = "import math\n" + LAW.replace(BEGINS[key], text)
    put(tmp_path, key, "@torquer.law(", f"@torquer.law({how}", text)
    found, result = stopped(made(scenario, key))
    assert found.startswith(f"{key}: must ") and re.search(LAWS[do], found)
    assert " at t = 10 s" in found and result["time"].values[-1] == 10.0
