"""The torque budget: closed forms, what the coils can give by brute force, its table."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from torquer import simulate
from torquer.analysis.budget import (
    NAMES,
    as_plain,
    budget_along_run,
    budget_rows,
    budget_while_held,
    torque_across_field,
)
from torquer.base.conventions import MU_EARTH_M3_S2
from torquer.compile import engine
from torquer.report.flight.budget_rows import HEAD, budget_table, reach_in_words
from torquer.report.flight.panels.torques import COLOURS
from torquer.report.flight.torque_budget import draw_budget
from torquer.spacecraft.actuators.coils import Coils
from torquer.spacecraft.disturbance import TORQUES

needs_jit = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
HELD = {
    "initial": {"rate_deg_s": [1.0, 2.0, 3.0], "euler_deg": [20.0, -35.0, 70.0]},
    "simulation": {"revolutions": 1.0, "record_s": 20.0, "step_s": 20.0},
    "control.sample_s": 20.0,
}


def held(make, reference, **changes):
    return budget_while_held(make(HELD | {"initial.reference": reference} | changes))


def test_every_torque_has_its_name_and_its_colour():
    assert set(TORQUES) < set(NAMES)
    assert list(COLOURS) == list(NAMES)


def test_gravity_gradient_of_a_held_attitude_is_its_closed_form(make):
    """3 omega0^2 e x J e, constant in the orbital frame."""
    scenario = make(HELD | {"initial.reference": "orbital"})
    budget = budget_while_held(scenario)
    inertia = np.array(scenario.spacecraft.body.inertia_kg_m2)
    to_body = Rotation.from_euler("ZYX", [20.0, -35.0, 70.0], degrees=True).inv()
    up = to_body.apply([0.0, 0.0, 1.0])
    expected = 3.0 * scenario.orbit.rate_rad_s() ** 2 * np.cross(up, inertia @ up)
    assert budget.disturbance["gravity_gradient"] == pytest.approx(
        np.tile(expected, (len(budget.t_s), 1)), abs=1e-6 * np.linalg.norm(expected)
    )
    row = budget_rows(budget)["gravity_gradient"]
    assert row.mean_n_m == pytest.approx(expected, rel=1e-5, abs=0.0)
    assert row.rms_size_n_m == pytest.approx(np.linalg.norm(expected), rel=1e-6, abs=0.0)


def test_elliptic_orbit_gravity_gradient_is_the_pull_on_every_grain(make):
    """Grains with a full inertia tensor, each drawn by the point mass of the Earth."""
    random = np.random.default_rng(4)
    places, masses = random.normal(size=(8, 3)), random.uniform(0.5, 2.0, 8)
    places -= masses @ places / masses.sum()
    squares = np.sum(places**2, axis=1)
    inertia = np.einsum("k,kij->ij", masses, squares[:, None, None] * np.eye(3)) - np.einsum(
        "k,ki,kj->ij", masses, places, places
    )
    ellipse = {"kind": "kepler", "perigee_altitude_km": 400.0, "apogee_altitude_km": 9000.0,
               "inclination_deg": 30.0}  # fmt: skip
    scenario = make(
        HELD
        | {"orbit": ellipse, "environment.field": {"kind": "direct_dipole"}}
        | {"spacecraft.body.inertia_kg_m2": inertia.tolist(), "initial.reference": "inertial"}
    )
    budget = budget_while_held(scenario)
    to_body = Rotation.from_euler("ZYX", [20.0, -35.0, 70.0], degrees=True).inv()
    r = to_body.apply(scenario.orbit_environment().state(budget.t_s)[0])
    from_earth = r[:, None] + places
    pull = -MU_EARTH_M3_S2 * from_earth / np.linalg.norm(from_earth, axis=2, keepdims=True) ** 3
    pull += MU_EARTH_M3_S2 * (r / np.linalg.norm(r, axis=1, keepdims=True) ** 3)[:, None]
    expected = np.sum(np.cross(places, masses[:, None] * pull), axis=1)
    found = budget.disturbance["gravity_gradient"]
    size = np.linalg.norm(found, axis=1)
    assert size.max() > 8.0 * size.min()  # (r_a/r_p)^3 = 11.7 of the same direction
    # the next term of the pull is smaller by the satellite's size over the Earth's
    assert np.linalg.norm(found - expected, axis=1).max() < 1e-5 * size.max()


def test_an_attitude_is_held_without_its_rate(make):
    """No eddy currents in an inertial attitude; in the orbital one those of the orbital rate."""
    given = {"disturbance": {"eddy_currents": {"damping_n_m_s_per_t2": 1e3}}}
    still = held(make, "inertial", **given)
    assert np.all(still.disturbance["eddy_currents"] == 0.0)
    turning = held(make, "orbital", **given)
    rate, b = 2.0 * np.pi / 5739.0, 4e-5
    greatest = np.linalg.norm(turning.disturbance["eddy_currents"], axis=1).max()
    assert 0.1 * 1e3 * rate * b**2 < greatest < 2.0 * 1e3 * rate * b**2


def test_the_residual_dipole_is_that_of_coils_and_disturbance(make):
    both = held(
        make, "inertial",
        **{"spacecraft.coils.residual_dipole_a_m2": [0.1, 0.0, 0.0],
           "disturbance": {"residual_dipole": {"constant_a_m2": [-0.1, 0.2, 0.0]}}},
    )  # fmt: skip
    one = held(
        make, "inertial", **{"disturbance": {"residual_dipole": {"constant_a_m2": [0, 0.2, 0]}}}
    )
    found, expected = (each.disturbance["residual_dipole"] for each in (both, one))
    assert found == pytest.approx(expected, abs=1e-12 * np.abs(expected).max())


def by_brute_force(coils, b):
    """Least over directions across the field of the greatest torque in them, coil by coil."""
    limits = np.full(len(coils.axes), coils.limit_a_m2)
    b_unit = b / np.linalg.norm(b)
    first = np.cross(b_unit, [0.3, -0.5, 0.8])
    first /= np.linalg.norm(first)
    angle = np.linspace(0.0, np.pi, 20001)
    ways = np.outer(np.cos(angle), first) + np.outer(np.sin(angle), np.cross(b_unit, first))
    torques = np.cross(limits[:, None] * np.array(coils.axes), b)
    return np.abs(ways @ torques.T).sum(axis=1).min()


@pytest.mark.parametrize("count", [1, 2, 3, 4, 6])
def test_what_coils_can_give_across_the_field(count):
    random = np.random.default_rng(count)
    for _ in range(20):
        coils = Coils(
            limit_a_m2=tuple(random.uniform(0.1, 3.0, count)),
            axes=tuple(map(tuple, random.normal(size=(count, 3)))),
        )
        b = 4e-5 * random.normal(size=3)
        found = torque_across_field(coils, b[None])[0]
        expected = by_brute_force(coils, b)
        assert found == pytest.approx(expected, abs=2e-4 * np.linalg.norm(b) * 3.0)


def test_three_coils_along_the_axes_and_a_field_along_one():
    """Two of them work: a square of torques, half its side in the worst direction."""
    coils = Coils(limit_a_m2=2.0)
    assert torque_across_field(coils, np.array([[0.0, 0.0, 3e-5]])) == pytest.approx([6e-5])


@needs_jit
def test_the_budget_of_a_run_goes_along_its_motion(make):
    keys = {
        "spacecraft.coils.residual_dipole_a_m2": [0.1, 0.0, 0.0],
        "disturbance": {"constant_torque_n_m": [1e-6, 0, -2e-6]},
        "control": {"law": {"kind": "bdot_rate", "gain_a_m2_s_per_t": 1e5}, "sample_s": 1.0},
    }
    result = simulate(make(keys))
    budget = budget_along_run(result)
    assert list(budget.disturbance) == [
        "gravity_gradient",
        "residual_dipole",
        "constant_and_random",
    ]
    b, dipole = result.b_body.values, result.dipole_body.values
    assert budget.disturbance["residual_dipole"] == pytest.approx(
        np.cross([0.1, 0.0, 0.0], b), abs=1e-18
    )
    assert budget.control == pytest.approx(np.cross(dipole - [0.1, 0, 0], b), abs=1e-16)
    assert np.all(budget.disturbance["constant_and_random"] == [1e-6, 0.0, -2e-6])
    total = sum(budget.disturbance.values())
    assert budget.total == pytest.approx(total, abs=1e-20)
    rows = budget_rows(budget)
    size = np.linalg.norm(total, axis=1)
    assert rows["all"].rms_size_n_m == pytest.approx(np.sqrt(np.mean(size**2)), abs=0.0)
    assert rows["all"].greatest_size_n_m == size.max()
    share = rows["all"].rms_size_n_m / budget.available.mean()
    assert rows["all"].share == pytest.approx(share, abs=0.0)
    assert json.dumps(as_plain(budget))


@needs_jit
def test_a_random_torque_is_reported_as_it_was_drawn(make):
    """Without anything else the momentum of a sphere is its sum."""
    keys = {
        "spacecraft": {"body": {"inertia_kg_m2": [1e3] * 3}},
        "environment.gravity_gradient": False,
        "disturbance": {"random_torque_n_m": 1e-3, "random_hold_s": 10.0},
        "initial": {"rate_deg_s": [0.0, 0.0, 0.0]},
        "control.sample_s": 10.0,
    }
    result = simulate(make(keys))
    budget = budget_along_run(result)
    gained = np.diff(result.omega_body.values, axis=0) * 1e3
    assert gained == pytest.approx(10.0 * budget.total[:-1], abs=1e-7)
    assert budget.available is None and budget.control is None
    assert budget_rows(budget)["all"].share is None and reach_in_words(budget) == ""


def test_the_table_is_in_one_unit(make):
    budget = held(make, "orbital", **{"disturbance": {"constant_torque_n_m": [1e-11, 0, 0]}})
    unit, rows = budget_table(budget)
    assert unit == "µN m"
    assert [row[0] for row in rows] == ["gravity gradient", "constant, random", "all disturbances"]
    assert {len(row) for row in rows} == {len(HEAD)}
    assert rows[1][1:4] == ("0.000", "0", "0")
    assert rows[0][-1].endswith(" %")
    assert "in any direction across the field" in reach_in_words(budget)


@pytest.mark.parametrize("changes", [{}, {"spacecraft.coils": None}], ids=["coils", "none"])
def test_it_is_drawn(make, tmp_path, changes):
    budget = held(make, "orbital", **changes)
    path = draw_budget(budget, "$dollars$ and all", tmp_path / "torques.png")
    assert path.stat().st_size > 10_000
    nothing = budget._replace(disturbance={}, control=None)
    assert draw_budget(nothing, "nothing", tmp_path / "nothing.png").exists()
