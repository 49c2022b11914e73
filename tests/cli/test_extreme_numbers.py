"""Numbers that are finite and absurd: refused in one line, or run to a result that can be read.

Every number of a scenario is replaced by each of a list, one at a time. Warnings are errors.
"""

import copy
import json
import re
import warnings
from pathlib import Path

import numpy as np
import pytest
from slow_cases import slow_after

import torquer
from torquer.analysis.notes.notes import write_notes
from torquer.analysis.summary import summarise
from torquer.base.explain import ScenarioError
from torquer.compile import engine
from torquer.design.wheel_file import load_wheels, wheels_from_text
from torquer.scenario.load import load_scenario, scenario_from_data
from torquer.simulation.setup.simulate import RunStopped, simulate
from torquer.simulation.setup.usable import check_usable

needs_jit = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
EXAMPLES = Path(__file__).parents[2] / "examples"
EXTREMES = (0, -1, 1e-320, 1e-300, -1e-300, 1e-30, 1e30, 1e200, -1e200, 1.7e308, 10**400)
#: Greatest and least of what may pass for a satellite's.
EDGES = (1e-15, 1e-12, 1e-9, 1e6, 1e9)
ORBIT = ("--altitude-km", "550", "--inclination-deg", "60")
#: More steps are not run.
MOST_STEPS = 20_000


def as_lists(value):
    """Plain data as a file holds them: lists, and no keys without a value."""
    if isinstance(value, dict):
        return {key: as_lists(x) for key, x in value.items() if x is not None}
    return [as_lists(x) for x in value] if isinstance(value, list | tuple) else value


def numbers_of(data, place=()):
    """Places of all numbers, truth values apart."""
    if isinstance(data, int | float) and not isinstance(data, bool):
        yield place
    elif isinstance(data, dict | list):
        for key, value in data.items() if isinstance(data, dict) else enumerate(data):
            yield from numbers_of(value, (*place, key))


def changed(data, place, value):
    data = copy.deepcopy(data)
    table = data
    for key in place[:-1]:
        table = table[key]
    table[place[-1]] = value
    return data


def short(scenario) -> dict:
    """Data of a scenario that lasts four records."""
    data = as_lists(scenario.model_dump(mode="json"))
    data["simulation"].pop("revolutions", None)
    data["simulation"]["duration_s"] = 4 * data["simulation"]["record_s"]
    return data


def check_refusal(error: ValueError) -> None:
    """One line of the usual form."""
    answer = str(error)
    assert re.match(r"[^:]+: .*(must|needs|no orbit at)", answer) and "\n" not in answer, answer
    assert "of thousands" in answer or len(answer) < 1000


def usable(data: dict):
    """The scenario of the data, with all that `torquer validate` looks at; None if refused."""
    try:
        scenario = scenario_from_data(data)
        check_usable(scenario)
    except ValueError as error:
        check_refusal(error)
        return None
    for note in write_notes(scenario):
        assert not re.search(r"\b(nan|inf)\b", note), note
    assert type(scenario).model_validate_json(scenario.model_dump_json()) == scenario
    return scenario


def run(scenario) -> None:
    """Run it; what is recorded is finite, and so is the summary."""
    try:
        result = simulate(scenario)
    except RunStopped as error:
        result = error.result
        ended = (
            "the state stopped being finite after t = .* s; last|simulation.step_s: .*; received|"
            "the motion is too fast for adaptive steps after t = .* s"
        )
        assert re.match(ended, str(error))
    for name, values in result.data_vars.items():
        as_expected = np.isfinite(values.values)
        if name == "mode_entered":  # only those that were entered have a time
            as_expected = as_expected == (result["mode_entries"].values > 0.0)
        elif name in ("mean_step", "least_step") and not result["steps"]:
            as_expected = np.isnan(values.values)
        assert name == "checkpoint" or as_expected.all(), name
    json.dumps(summarise(result), allow_nan=False)


def try_all(data: dict, values, every: int = 1, runs: bool = True) -> tuple[int, int]:
    """(refused, valid) of each `every`-th of all replacements."""
    cases = [(place, value) for place in numbers_of(data) for value in values]
    counts = [0, 0]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for place, value in cases[::every]:
            scenario = usable(changed(data, place, value))
            counts[scenario is not None] += 1
            if runs and scenario is not None and scenario.steps() <= MOST_STEPS:
                run(scenario)
    return tuple(counts)


@pytest.fixture
def plain(scenario) -> dict:
    return short(load_scenario(scenario))


@pytest.mark.slow
@needs_jit
def test_extremes_in_a_plain_scenario(plain):
    refused, valid = try_all(plain, (*EXTREMES, *EDGES))
    assert refused > 200 and valid > 300


@pytest.mark.parametrize("name", ["chibis_m_detumble", "spinner", "wheels_in_flight"])
def test_extremes_in_the_examples_are_refused_or_valid(name):
    data = short(load_scenario(EXAMPLES / f"{name}.toml"))
    refused, valid = try_all(data, EXTREMES, every=5, runs=False)
    assert refused > 80 and valid > 40


@needs_jit
@pytest.mark.slow
@pytest.mark.parametrize("name", ["chibis_m_detumble", "spinner", "wheels_in_flight", "five_days"])
def test_extremes_in_the_examples_run(name):
    data = short(load_scenario(EXAMPLES / f"{name}.toml"))
    if data["orbit"]["kind"] == "numerical":  # which goes on to the end, however far
        data["orbit"] = {"kind": "circular", "altitude_km": 425.0, "inclination_deg": 63.0}
    refused, valid = try_all(data, (*EXTREMES, *EDGES))
    assert refused > 200 and valid > 200


@needs_jit
@pytest.mark.parametrize(
    "change",
    slow_after(
        4,
        [
            {"initial.rate_deg_s": [0.0, 0.0, 0.0]},
            {
                "initial.rate_deg_s": [1e6, 1e6, -1e6],
                "simulation.integrator": "splitting",
                "simulation.step_s": 1.0,
            },
            {"spacecraft.coils.limit_a_m2": 1e-12, "spacecraft.coils.lag_s": 1e10},
            {"spacecraft.body.inertia_kg_m2": [1e-12, 1e-12, 1e-12]},
            {"initial.rate_deg_s": [1e-300, 0.0, 0.0]},
            {"spacecraft.body.inertia_kg_m2": [1e12, 1e12, 1e12]},
            {"spacecraft.coils.residual_dipole_a_m2": [1e-300, 0.0, 1e-320]},
            {"spacecraft.magnetometer.bias_nt": [1e12, -1e12, 0.0]},
        ],
    ),
    ids=str,
)
def test_a_whole_command_at_the_edges(call, plain, tmp_path, strict_json, change):
    """With report and pictures; whatever ends the run, what is written can be read back."""
    for key, value in change.items():
        plain = changed(plain, key.split("."), value)
    path, out = tmp_path / "edge.toml", tmp_path / "out"
    path.write_text(as_toml(plain))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        code, stdout, _ = call("run", path, "--json", "--out", out, "--plots")
    assert code in (0, 1)
    summary = strict_json(stdout)
    assert summary == strict_json((out / "summary.json").read_text())
    assert (summary["ended"] == "complete") == (code == 0)
    assert torquer.load(out / "result.nc").attrs["ended"] == summary["ended"]
    assert (out / "report.html").stat().st_size > 10_000 and (out / "plots/overview.png").exists()


def as_toml(data: dict) -> str:
    """A TOML file of plain data: tables inline."""

    def shown(value) -> str:
        if isinstance(value, dict):
            return "{" + ", ".join(f"{key} = {shown(x)}" for key, x in value.items()) + "}"
        if isinstance(value, list):
            return "[" + ", ".join(map(shown, value)) + "]"
        return json.dumps(value)

    return "\n".join(f"{key} = {shown(value)}" for key, value in data.items())


# ------------------------------------------------------------------ other commands


def test_extremes_in_a_design_of_wheels():
    data = as_lists(load_wheels(EXAMPLES / "wheels" / "foton.toml").model_dump(mode="json"))
    refused = 0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for place in numbers_of(data):
            for value in EXTREMES:
                text = as_toml(changed(data, place, value)) if value != 10**400 else ""
                try:
                    design = wheels_from_text(text or as_toml(data))
                except ScenarioError as error:
                    check_refusal(error)
                    refused += 1
                else:
                    assert type(design).model_validate_json(design.model_dump_json()) == design
    assert refused > 100


THEORY = "theory {} --inclination-deg 60 --altitude-km 500 --inertia 1 1 1.2 --gain 1e5 --json"
OPTIONS = [
    THEORY.format("spin_up --rate-deg-s 5 5 5 --rho-deg 20 --to 200"),
    THEORY.format("reorientation --rho-deg 20 --to 10 --revolutions 10 --design"),
    "field point --lat 10 --lon 20 --alt-km 100 --date 2025-01-01 --degree 5 --json",
    "field orbit --altitude-km 550 --inclination-deg 60 --raan-deg 3 --start 2025-01-01 "
    "--duration-min 5 --step-s 30 --json",
]


@pytest.mark.parametrize("line", slow_after(2, sorted(OPTIONS)), ids=lambda line: line[:20])
def test_extremes_of_options(call, strict_json, line):
    words = line.split()
    places = [n for n, word in enumerate(words) if re.fullmatch(r"[\d.]+(e\d+)?", word)]
    assert len(places) > 3
    for n in places:
        for value in (0, -1, 1e-320, 1e-300, 1e30, 1.7e308, "1" + "0" * 400, "nan", "inf"):
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                code, out, err = call(*words[:n], str(value), *words[n + 1 :])
            if code:
                assert (code, err.count("\n")) == (2, 1) and len(err) < 1000, err
            strict_json(out)
