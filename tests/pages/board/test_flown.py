"""Flights of the board: the numbers of `simulate` to the bit, tables kept by orbit."""

import numpy as np
import pytest
from unpacking import unpacked_answer

import torquer
from torquer.analysis.attitude import body_axes_from_deg
from torquer.analysis.summary import summarise
from torquer.compile import engine
from torquer.pages.board import flown as flown_module
from torquer.pages.board.answer import MOST_POINTS, extremes, make_answer
from torquer.pages.board.flown import MOST_ORBITS, NotFlown, Orbits, Superseded, fly
from torquer.pages.board.text import read_scenario
from torquer.scenario.change import with_values
from torquer.scenario.load import scenario_from_text
from torquer.simulation.setup import run as run_module

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole flights: minutes without JIT")


@pytest.fixture
def scenario(text):
    return scenario_from_text(text)


def test_every_number_is_that_of_simulate_to_the_bit(scenario):
    scenario = with_values(scenario, {"simulation.record_s": 1.0})
    result, flown = torquer.simulate(scenario), fly(scenario, Orbits())
    names = ("q_body_to_inertial", "omega_body", "dipole_body", "omega_orbital", "sun_inertial")
    for name in (*names, "position_inertial", "velocity_inertial", "b_measured", "time"):
        assert np.array_equal(flown[name].values, result[name].values), name
    header, arrays = unpacked_answer(make_answer(flown))
    kept = np.isin(result["time"].values, arrays["t_s"])
    assert MOST_POINTS // 2 < len(arrays["t_s"]) <= MOST_POINTS + 1 < len(kept)
    assert arrays["t_s"][-1] == result["time"].values[-1]
    rate, dipole = np.degrees(result["omega_body"].values), result["dipole_body"].values
    assert np.array_equal(arrays["view.rate"], rate[kept])
    assert np.array_equal(arrays["view.dipole"], dipole[kept])
    assert np.array_equal(arrays["q"], result["q_body_to_inertial"].values[kept])
    size = np.degrees(np.linalg.norm(result["omega_body"].values, axis=1))
    plots = {
        "rate": np.column_stack([size, rate]),
        "dipole": dipole,
        "vertical": body_axes_from_deg(result, "position_inertial"),
        "sun": body_axes_from_deg(result, "sun_inertial"),
    }
    for name, whole in plots.items():
        shown = np.isin(result["time"].values, arrays[f"{name}.t_s"])
        assert np.array_equal(arrays[name], whole[shown]), name
    summary = summarise(result)
    assert header["verdict"] == summary["verdict"]
    assert all(summary[key] == value for key, value in header["numbers"].items())


def test_a_plot_keeps_every_peak_of_a_long_run():
    t = np.arange(10_007.0)
    values = np.column_stack([np.sin(t), np.cos(0.3 * t) + 1e-3 * t])
    values[4321, 0], values[10_006, 1] = 7.0, -9.0  # one record each, the second in the rest
    kept = extremes(values, 100)
    assert kept[0] == 0 and kept[-1] == len(t) - 1 and np.all(np.diff(kept) > 0)
    assert len(kept) <= 2 * 2 * 100 + 2
    for begin in range(0, len(t), 101):
        interval = slice(begin, begin + 101)
        shown = values[kept[(kept >= begin) & (kept < begin + 101)]]
        assert np.array_equal(shown.max(axis=0), values[interval].max(axis=0))
        assert np.array_equal(shown.min(axis=0), values[interval].min(axis=0))


def test_a_plot_has_all_records_of_a_short_run():
    values = np.random.default_rng(1).normal(size=(200, 3))
    assert np.array_equal(extremes(values, 100), np.arange(200))
    assert len(extremes(np.zeros((201, 3)), 100)) < 201


def test_a_run_of_several_pieces_is_that_of_simulate(scenario, monkeypatch):
    monkeypatch.setattr(run_module, "piece_steps", lambda scenario: 500)
    result, orbits = torquer.simulate(scenario), Orbits()
    for _ in range(2):  # the second with kept tables
        flown = fly(scenario, orbits)
        assert np.array_equal(flown["omega_body"].values, result["omega_body"].values)
        assert np.array_equal(flown["omega_orbital"].values, result["omega_orbital"].values)


def test_tables_are_made_once_for_an_orbit(scenario, monkeypatch):
    made, piece_of = [], run_module.tabulate_piece
    monkeypatch.setattr(run_module, "tabulate_piece", lambda *a: made.append(a) or piece_of(*a))
    orbits = Orbits()
    for gain in (1e4, 2e4, 3e4):
        fly(with_values(scenario, {"control.law.gain_a_m2_s_per_t": gain}), orbits)
    assert len(made) == 1
    for altitude in range(500, 500 + MOST_ORBITS):  # with that of the first one too many
        fly(with_values(scenario, {"orbit.altitude_km": float(altitude)}), orbits)
    assert len(made) == 1 + MOST_ORBITS
    fly(with_values(scenario, {"orbit.altitude_km": 500.0 + MOST_ORBITS - 1}), orbits)
    assert len(made) == 1 + MOST_ORBITS
    fly(scenario, orbits)
    assert len(made) == 2 + MOST_ORBITS


def test_another_start_or_field_or_span_has_other_tables(scenario):
    orbits, alone = Orbits(), fly(scenario, Orbits())["omega_body"].values
    changes = (
        {"start": "2025-07-02T00:00:00Z"},
        {"environment.field": {"kind": "tilted_dipole"}},
        {"simulation.revolutions": 0.4},
    )
    fly(scenario, orbits)
    for change in changes:
        other = with_values(scenario, change)
        found = fly(other, orbits)["omega_body"].values
        assert np.array_equal(found, fly(other, Orbits())["omega_body"].values)
        assert not np.array_equal(found, alone)
    assert np.array_equal(fly(scenario, orbits)["omega_body"].values, alone)


def test_a_run_that_nobody_waits_for_ends_soon(scenario):
    asked = []

    def after_three():
        asked.append(0)
        return len(asked) > 3

    long = with_values(scenario, {"simulation.revolutions": 20.0})
    with pytest.raises(Superseded):
        fly(long, Orbits(), after_three)
    assert len(asked) == 4


def test_a_run_that_ends_early_says_why(scenario, monkeypatch):
    monkeypatch.setattr(
        flown_module, "advance_in_pieces", lambda *a: "the state stopped at t = 5 s"
    )
    with pytest.raises(NotFlown, match="the state stopped at t = 5 s"):
        fly(scenario, Orbits())


@pytest.mark.slow
def test_wheels_have_a_plot_of_their_own():
    from pathlib import Path

    from torquer.pages.board.text import data_from_toml

    path = Path("examples/wheels_in_flight.toml")
    data = data_from_toml(path.read_text(encoding="utf-8"))
    data["simulation"] = {"duration_s": 300.0, "record_s": 10.0}
    scenario = read_scenario(data, path.parent, ())
    header, arrays = unpacked_answer(make_answer(fly(scenario, Orbits())))
    result = torquer.simulate(scenario)
    assert np.array_equal(arrays["wheels"], result["wheel_speed"].values * (30.0 / np.pi))
    assert header["verdict"] == summarise(result)["verdict"]
