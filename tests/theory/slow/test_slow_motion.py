"""Integration of the slow motion by closed equations and by averaging a law; maps."""

import math
import re

import numpy as np
import pytest

from torquer.computer.laws.bdot import BdotRate
from torquer.computer.laws.nutation_damping import NutationDampingRate
from torquer.theory.slow.averaging import converged_nodes
from torquer.theory.slow.evolution import BDOT, EVOLUTIONS, bdot
from torquer.theory.slow.evolution.model import Slow
from torquer.theory.slow.slow_motion import evolve, evolve_law, map_evolution, map_law
from torquer.theory.slow.spinner import Spinner

U = np.linspace(0.0, 40.0, 9)
START = Slow(1.0, 0.9, 0.4, 1.1)
GRID = {"inclination_deg": np.array([10.0, 45.0, 80.0]), "rho_deg": np.array([20.0, 70.0])}
FIXED = {"sigma_deg": 0.0, "theta_deg": 70.0, "eps": 0.1}


@pytest.mark.parametrize(
    "name", ["bdot", "nutation_damping", "spin_up", "preliminary_1", "preliminary_2"]
)
def test_averaging_on_the_way_gives_the_closed_motion(name, spin_laws, satellite):
    spinner, gain = satellite(60.0), 4e4
    law, target = spin_laws(gain)[name]
    closed = evolve(EVOLUTIONS[name], EVOLUTIONS[name].case(gain, spinner, target), START, U)
    found = evolve_law(law, spinner, START, U)
    assert np.ptp(closed.l) > 0.01
    for one, other in zip(found, closed, strict=True):
        assert one == pytest.approx(other, abs=1e-9)


def test_dipole_b_dot_agrees_with_closed_equations_without_needing_them(satellite):
    gain = 4e4
    law = BdotRate(gain_a_m2_s_per_t=gain).law()
    for field in ("direct_dipole", "tilted_dipole"):
        spinner = satellite(60.0, field=field)
        case = EVOLUTIONS["bdot_any_field"].case(gain, spinner)
        closed = evolve(EVOLUTIONS["bdot_any_field"], case, START, U)
        at = converged_nodes(law, spinner)
        for one, other in zip(evolve_law(law, spinner, START, U, at=at), closed, strict=True):
            assert one == pytest.approx(other, abs=1e-9)


def test_maps_hold_the_ends_of_single_runs():
    evolution, end = EVOLUTIONS["nutation_damping"], 20.0
    found = map_evolution(evolution, GRID, FIXED, end, rtol=1e-11)
    assert found.theta.shape == (3, 2)
    for i, inclination in enumerate(GRID["inclination_deg"]):
        for j, rho in enumerate(GRID["rho_deg"]):
            case = evolution.case(0.1, Spinner(inclination_deg=inclination))
            start = Slow(1.0, math.radians(rho), 0.0, math.radians(70.0))
            path = evolve(evolution, case, start, [0.0, end])
            for one, other in zip(found, path, strict=True):
                assert one[i, j] == pytest.approx(other[-1], abs=1e-9)


def test_maps_match_closed_equations_on_any_number_of_threads():
    law = NutationDampingRate(gain_a_m2_s_per_t=1.0).law()
    closed = map_evolution(EVOLUTIONS["nutation_damping"], GRID, FIXED, 20.0)
    for workers in (1, 3, None):
        found = map_law(law, GRID, FIXED, 20.0, workers=workers)
        again = map_evolution(EVOLUTIONS["nutation_damping"], GRID, FIXED, 20.0, workers=workers)
        for one, same, other in zip(found, again, closed, strict=True):
            assert one == pytest.approx(other, abs=1e-7)
            assert np.array_equal(same, other)


def test_a_map_may_run_over_any_axes():
    axes = {"eps": [0.05, 0.1], "theta_deg": [20.0, 40.0, 60.0], "sigma_deg": [0.0]}
    fixed = {"inclination_deg": 60.0, "rho_deg": 40.0}
    spinner = Spinner(inclination_deg=0.0, field="direct_dipole", axial_kg_m2=0.5)
    found = map_evolution(EVOLUTIONS["bdot_any_field"], axes, fixed, 30.0, spinner=spinner)
    assert found.l.shape == (2, 3, 1)
    assert np.all(found.l[1] < found.l[0])
    law = BdotRate(gain_a_m2_s_per_t=0.5).law()  # eps = k B0^2/(omega0 C), C = 0.5
    by_law = map_law(law, axes, fixed, 30.0, spinner=spinner)
    assert by_law.l == pytest.approx(found.l, rel=1e-6)


def test_nutation_after_15_revolutions_as_the_book_tells():
    """MAG, after Fig. 3.1.2: at high inclination at most some 14 deg are left of 70, at low
    inclination it may hardly change (eps = 0.1)."""
    axes = {"inclination_deg": [2.0, 89.0], "rho_deg": np.linspace(0.5, 89.5, 90)}
    left = np.degrees(
        map_evolution(EVOLUTIONS["nutation_damping"], axes, FIXED, 30.0 * math.pi).theta
    )
    assert left[1].max() == pytest.approx(14.0, abs=1.0)
    assert left[0].max() > 69.0


def test_b_dot_brakes_fastest_at_46_degrees_not_the_pole():
    """MAG, of Figs. 2.1.2 and 2.1.3, which holds up to 46 deg only; eps = 0.1, theta0 = 1."""
    rho = np.linspace(1.5, 88.5, 30)
    axes = {"inclination_deg": np.array([10.0, 45.577, 90.0]), "rho_deg": rho}
    fixed = {"sigma_deg": 0.0, "theta_deg": math.degrees(1.0), "eps": 0.1}

    def left(revolutions, ratio):
        satellite = Spinner(inclination_deg=0.0, axial_kg_m2=ratio)
        end = 2.0 * math.pi * revolutions
        return map_evolution(EVOLUTIONS["bdot"], axes, fixed, end, spinner=satellite).l

    for ratio in (1.0 / 3.0, 2.0 / 3.0, 1.9):
        mean = np.average(left(10.0, ratio), axis=1, weights=np.sin(np.radians(rho)))
        assert mean[1] < mean[2] < mean[0]
        assert np.all(np.diff(left(2.0, ratio)[:, -1]) > 0.0)
    cases = [BDOT.case(0.1, Spinner(inclination_deg=i)) for i in axes["inclination_deg"]]
    sphere = [[bdot.sphere(20.0 * math.pi, case, x)[0] for x in np.radians(rho)] for case in cases]
    assert left(10.0, 1.0) == pytest.approx(np.array(sphere), rel=1e-5)


def test_motion_into_a_singular_point_is_marked_and_stops_alone():
    """Spin-up against a slow opposite spin brakes to l = 0 (theta = 180 deg)."""
    evolution, spinner = EVOLUTIONS["spin_up"], Spinner(inclination_deg=90.0)
    fixed = {"inclination_deg": 90.0, "sigma_deg": 0.0, "rho_deg": 0.0, "theta_deg": 180.0}
    found = map_evolution(evolution, {"eps": [0.01, 0.1]}, fixed, 15.0)
    assert found.l[0] == pytest.approx(1.0 - 0.01 * 15.0, rel=1e-6)
    assert np.isnan(found.l[1])
    case, start = evolution.case(0.1, spinner), Slow(1.0, 0.0, 0.0, math.pi)
    path = evolve(evolution, case, start, [0.0, 5.0, 15.0])
    assert path.ended == pytest.approx(10.0, abs=1e-6)
    assert path.l[:2] == pytest.approx([1.0, 0.5], rel=1e-9)
    assert np.isnan(np.array(path)[:, 2]).all()
    assert re.match(r"stops at u = 10: the motion leaves the domain .* l = 0.5, ", path.notes[0])


@pytest.mark.parametrize(
    ("axes", "fixed", "message"),
    [
        (
            GRID,
            {"theta_deg": 1.0, "eps": 0.1},
            "map: each of inclination_deg, .* received no sigma",
        ),
        (GRID, FIXED | {"rho_deg": 1.0}, "map: each of .* received twice rho_deg"),
        (GRID, FIXED | {"rho": 1.0}, "map: each of .* received another name, rho"),
        (GRID | {"eps": [math.nan]}, {"sigma_deg": 0.0, "theta_deg": 1.0}, "eps: must be finite"),
        (GRID | {"eps": 0.1}, {"sigma_deg": 0.0, "theta_deg": 1.0}, "map: an axis must be a row"),
    ],
)
def test_maps_without_sense_are_refused(axes, fixed, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        map_evolution(EVOLUTIONS["bdot"], axes, fixed, 1.0)


def test_other_input_without_sense_is_refused():
    law = BdotRate(gain_a_m2_s_per_t=1.0).law()
    with pytest.raises(
        ValueError, match=r"^gain: must name a parameter of law bdot_rate: gain; rec"
    ):
        map_law(law, GRID, FIXED, 1.0, gain="k")
    with pytest.raises(ValueError, match="field must be averaged"):
        spinner = Spinner(inclination_deg=0.0, field="tilted_dipole")
        map_evolution(EVOLUTIONS["bdot"], GRID, FIXED, 1.0, spinner=spinner)
    case = EVOLUTIONS["bdot"].case(0.1, Spinner(inclination_deg=50.0))
    with pytest.raises(ValueError, match=r"^u: must be a row of numbers; received shape \(\)"):
        evolve(EVOLUTIONS["bdot"], case, START, 3.0)
