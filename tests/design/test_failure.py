"""Why a design fails: causes as changes of a scenario, counter-tests, levers, the nearest."""

import math
from pathlib import Path

import pytest

import torquer
from torquer.analysis.causes import COUNTED_ON
from torquer.analysis.counter_tests import groups_of, lessened, undisturbed
from torquer.design.failure import Failure, Flown, explain, without_each
from torquer.design.nearest import LEVERS, nearest, rungs
from torquer.scenario.load import scenario_from_data

EXAMPLES = Path(__file__).parents[2] / "examples"
SATELLITE = {
    "start": "2025-01-01T00:00:00Z",
    "orbit": {"kind": "circular", "altitude_km": 500.0, "inclination_deg": 60.0},
    "environment": {"atmosphere": {"kind": "gost", "f107": 150, "ap": 12}},
    "spacecraft": {
        "body": {"inertia_kg_m2": [0.04, 0.04, 0.007]},
        "coils": {"limit_a_m2": 0.2, "residual_dipole_a_m2": [0.003, 0.0, 0.004], "lag_s": 0.1},
        "magnetometer": {"noise_nt": 50.0, "bias_nt": [100.0, 0.0, 0.0]},
        "gyro": {"noise_deg_s": 0.01, "bias_deg_s": [0.0, 0.02, 0.0]},
        "aerodynamics": {"parts": [
            {"kind": "cylinder", "axis": [0, 0, 1], "radius_m": 0.05, "length_m": 0.3,
             "centre_m": [0, 0, 0.01]},
        ]},
    },
    "disturbance": {"constant_torque_n_m": [1e-8, 0.0, 0.0]},
    "initial": {"rate_deg_s": [1.0, 0.0, 0.0]},
    "control": {"sample_s": 4.0,
                "law": {"kind": "three_axis", "rate_gain_n_m_s_per_t2": 1e4,
                        "angle_gain_n_m_per_t2": 10.0},
                "ephemeris": {"field": {"kind": "igrf14", "degree": 2}}},
    "simulation": {"revolutions": 1.0},
}  # fmt: skip


@pytest.fixture(scope="module")
def satellite():
    return scenario_from_data(SATELLITE)


GROUPS = ("gravity gradient", "residual dipole", "air and light", "held torque", "noise", "bias",
          "models on board", "sampling and lag")  # fmt: skip


def test_the_satellite_has_these_groups_of_causes(satellite):
    assert groups_of(satellite) == [*GROUPS]


@pytest.mark.parametrize("group", GROUPS)
def test_every_group_goes_alone_and_once(satellite, group):
    without = lessened(satellite, group, 0.0)
    assert groups_of(without) == [each for each in GROUPS if each != group]
    assert lessened(without, group, 0.0) == without


def test_a_satellite_without_causes_has_those_that_laws_count_on(satellite):
    assert groups_of(undisturbed(satellite)) == [*COUNTED_ON]


@pytest.mark.parametrize("step_s", [0.8, 2.0, 4.0])
def test_a_fixed_step_of_integration_fits_the_quicker_control(satellite, step_s):
    """Without sampling a given step stays one, which RK4 cannot do without."""
    fixed = satellite.replace("simulation", {
        "revolutions": 1.0, "step_s": step_s, "record_s": 4.0, "integrator": "rk4"})  # fmt: skip
    quick = lessened(fixed, "sampling and lag", 0.0)
    assert quick.control.sample_s == 1.0
    assert quick.simulation.step_s in (0.5, 1.0) and quick.simulation.step_s <= step_s


def test_a_cause_that_the_rest_of_a_scenario_needs_stays(satellite):
    """Records every 0.7 s do not fit control steps of 1 s."""
    odd = satellite.replace("control.sample_s", 1.4).replace("simulation", {
        "duration_s": 700.0, "step_s": 0.7, "record_s": 0.7})  # fmt: skip
    assert lessened(odd, "sampling and lag", 0.0) == odd


def test_a_part_of_a_cause_keeps_its_direction(satellite):
    half = lessened(satellite, "residual dipole", 0.5)
    assert half.spacecraft.coils.residual_dipole_a_m2 == pytest.approx((0.0015, 0.0, 0.002))
    assert half.spacecraft.gyro == satellite.spacecraft.gyro


@pytest.mark.parametrize("lever", LEVERS, ids=lambda lever: lever.name)
def test_a_lever_gives_the_value_that_it_is_asked_for(satellite, lever):
    now, *others = rungs(lever, satellite)
    assert now == pytest.approx(lever.now(satellite)) and len(others) == 5
    assert others[-1] == pytest.approx(lever.bound(satellite))
    changed = lever.changed(satellite, others[1])
    assert changed != satellite
    if lever.unit != "of its own":
        assert lever.now(changed) == pytest.approx(others[1])


def _dipole(scenario) -> float:
    return math.hypot(*scenario.spacecraft.coils.residual_dipole_a_m2)


def _weak(scenario, seed) -> Flown:
    """All starts arrive below 2 mA m^2, or with coils of 0.5 A m^2; errors go with the dipole."""
    limit = scenario.spacecraft.coils.limits_a_m2().min()
    works = _dipole(scenario) < 2e-3 or limit > 0.5
    return Flown(16 * works, 16, 1.0 + 1e4 * _dipole(scenario))


def test_the_limiting_cause_and_the_nearest_designs_are_found(satellite):
    found = explain(satellite, ("it", "error", "deg"), lambda x: x, _weak, _weak, LEVERS, {})
    assert found.limiting == "residual dipole"
    assert found.share("residual dipole") == pytest.approx(50.0 / 51.0)
    assert found.share("noise") == 0.0
    values = {each.lever: each for each in found.found}
    assert 1.4e-3 < values["residual dipole"].value < 2e-3
    assert 0.5 < values["limit of the coils"].value < 0.6
    assert values["limit of the coils"].verified == 16
    assert values["altitude"].value is None and "noise of the sensors" not in values
    said = "\n".join(found.lines())
    assert "what limits: residual dipole, 98 % of it" in said
    assert "works: residual dipole 0.00" in said
    assert "not found: altitude from 500 to 1e+03 km" in said


def test_causes_that_only_together_limit_are_named(satellite):
    def fly(scenario, seed) -> Flown:
        noise = scenario.spacecraft.magnetometer.noise_nt
        works = _dipole(scenario) == 0.0 and noise == 0.0
        return Flown(16 * works, 16, 1.0 + (_dipole(scenario) > 0.0) + 0.5 * (noise > 0.0))

    groups = ("noise", "residual dipole", "bias")
    alone, (names, flown) = without_each(satellite, groups, fly)
    assert names == ("residual dipole", "noise") and flown.is_enough
    told = Failure("it", "error", "deg", fly(satellite, 1), alone, (names, flown)).lines()
    assert told[-1].startswith(
        "why: what limits: no cause alone; without residual dipole, noise: 16"
    )


def test_a_cause_that_may_stay_is_not_among_those_that_go_together(satellite):
    """Noise goes first, as it makes most of the error; dipole and bias are what stops all."""

    def fly(scenario, seed) -> Flown:
        meter = scenario.spacecraft.magnetometer
        noise, bias = meter.noise_nt > 0.0, any(meter.bias_nt)
        dipole = _dipole(scenario) > 0.0
        return Flown(16 * (not dipole and not bias), 16, 1.0 + 3.0 * noise + 2.0 * dipole + bias)

    _, (names, flown) = without_each(satellite, ("bias", "noise", "residual dipole"), fly)
    assert names == ("residual dipole", "bias") and flown == Flown(16, 16, 4.0)


def test_a_cause_without_which_all_arrive_limits_whatever_the_error():
    """Most starts point well, some never: the median error hardly changes."""
    without = {"bias": Flown(11, 16, 0.15), "residual dipole": Flown(16, 16, 0.5)}
    found = Failure("it", "error", "deg", Flown(12, 16, 0.52), without, ((), Flown(0, 0, math.nan)))
    assert found.limiting == "residual dipole"
    said = "why: what limits: residual dipole; without it 16 of 16, median 0.5 deg"
    assert said in found.lines()


def test_an_error_that_grows_without_a_cause_is_not_called_less():
    """Gravity holds what a dipole turns."""
    without = {"gravity gradient": Flown(0, 16, 67.7), "residual dipole": Flown(16, 16, 1.7)}
    together = (("residual dipole",), Flown(16, 16, 1.7))
    found = Failure("it", "error", "deg", Flown(0, 16, 44.3), without, together)
    assert "why: without gravity gradient: 0 of 16, median 67.7 deg (53 % more)" in found.lines()
    assert "why: without residual dipole: 16 of 16, median 1.7 deg (96 % less)" in found.lines()
    still = Failure("it", "error", "deg", Flown(0, 16, 0.0), without, together)
    assert any(line.endswith("(more)") for line in still.lines())
    never = {"bias": Flown(0, 16, math.inf)}
    found = Failure("it", "time", "h", Flown(3, 16, 9.0), never, (("bias",), Flown(0, 16, 9.0)))
    assert "why: without bias: 0 of 16, median inf h (more)" in found.lines()


def test_what_limits_most_of_the_error_is_named_where_not_all_arrive_without_it(satellite):
    """Text and data name the same: gravity, of which a law is designed with, or a dipole."""
    flown, better, all_but = Flown(0, 16, 149.0), Flown(10, 16, 0.04), Flown(12, 16, 0.03)
    alone = {"gravity gradient": better, "sampling and lag": flown}
    found = Failure("it", "error", "deg", flown, alone, ((), Flown(0, 0, math.nan)))
    assert found.limiting == found.data()["limiting"] == "gravity gradient"
    assert found.lines()[-1] == (
        "why: what limits: gravity gradient, 100 % of it, but not alone; even without it: 10 of "
        "16, median 0.04 deg"
    )
    alone = {"residual dipole": better, "noise": flown}
    found = Failure("it", "error", "deg", flown, alone, (("residual dipole", "noise"), all_but))
    assert found.lines()[-1].endswith(
        "even without residual dipole, noise: 12 of 16, median 0.03 deg"
    )


def test_a_law_that_does_not_exist_is_no_answer(satellite):
    def none(scenario, seed):
        raise ArithmeticError("no such regulator")

    found = explain(satellite, ("it", "error", "deg"), lambda x: x, _weak, none, LEVERS, {})
    assert all(each.value is None for each in found.found)


def test_a_value_that_other_starts_refuse_is_taken_further(satellite):
    def fly(scenario, seed):
        least = 0.5 if seed == 1 else 1.0
        return 16 * bool(scenario.spacecraft.coils.limits_a_m2().min() > least), 16

    coils = [lever for lever in LEVERS if lever.name == "limit of the coils"]
    (found,) = nearest(satellite, coils, fly, lambda arrived, runs: arrived == runs)
    assert found.value > 1.0 and found.verified == 16


@pytest.mark.slow
def test_a_dipole_that_defeats_a_hold_is_named_and_its_budget_flown():
    """The 3U of 5 mA m^2 about each axis, with coarser steps; with a fifth of it the hold works."""
    scenario = torquer.load_scenario(EXAMPLES / "residual_dipole.toml")
    answer = torquer.design.three_axis(scenario.replace("control", {
        "sample_s": 4.0, "law": {"kind": "off"}}).replace("simulation.step_s", 4.0))  # fmt: skip
    failure = answer.failure
    assert failure is not None and failure.limiting == "residual dipole"
    assert failure.without["residual dipole"].is_enough and not failure.flown.is_enough
    (budget,) = (each for each in failure.found if each.lever == "residual dipole")
    assert 1e-3 < budget.value < 8.66e-3 and budget.verified >= 15
