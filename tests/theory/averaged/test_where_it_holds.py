"""The verdict on averaged motions: against true motions, and each condition by itself."""

import math

import pytest
from where_cases import CASES, REFUSED, RIGHT, WRONG, answer, truth

from torquer import theory
from torquer.compile import engine
from torquer.scenario.load import load_scenario
from torquer.theory.averaged.answer import law_gains, law_motion
from torquer.theory.averaged.assumed import CIRCULAR, TO_CONE_AXIS, WITHIN_LIMITS
from torquer.theory.averaged.conditions import EACH_FLOWN, FLOWN, SAMPLED
from torquer.theory.averaged.flights import Flight, Flights
from torquer.theory.averaged.requests import LawRequest
from torquer.theory.slow.axis_stability import nutation_growth
from torquer.theory.validity import Limit, judge
from torquer.theory.where_it_holds import conditions, table

CUBE = {"altitude_km": 600.0, "inertia": (1.0, 1.0, 1.5), "rho_deg": 30.0}


@pytest.mark.slow
@pytest.mark.skipif(not engine.COMPILED, reason="nine true motions of 60 cases")
def test_no_wrong_answer_is_silent_and_right_ones_are_seldom_doubted():
    silent, right, doubted = [], 0, []
    for case in CASES:
        found = answer(case)
        formula = found.found["revolutions"]["median"]
        state, true = found.found["verdict"]["state"], truth(case, found)
        ratio = true / (math.inf if formula is None else formula)
        if not 1.0 / WRONG <= ratio <= WRONG and state == "valid":
            silent.append(case)
        if 1.0 / RIGHT <= ratio <= RIGHT:
            right += 1
            doubted += [case] * (state == "doubtful")
    assert silent == []
    assert right >= 40 and len(doubted) < 0.1 * right
    assert len(CASES) == 60


@pytest.mark.skipif(not engine.COMPILED, reason="true motions of a hundred revolutions")
@pytest.mark.parametrize(
    ("inclination_deg", "formula", "flown"), [(5.0, 460.0, 102.0), (10.0, 115.0, 65.0),
                                              (20.0, 29.0, 26.0)]
)  # fmt: skip
def test_near_the_equator_the_dipoles_tilt_turns_the_field(inclination_deg, formula, flown):
    """As the condition says; on the equator the formula says never, and true motions go there."""
    cube = {**CUBE, "rho_deg": 0.0, "gain": 1e5, "rate_deg_s": (3.0,) * 3, "to": 20.0}
    found = law_motion("bdot", LawRequest(inclination_deg=inclination_deg, **cube)).data()
    assert found["revolutions"]["median"] == pytest.approx(formula, abs=0.5)
    assert found["verdict"]["flown_revolutions"] == pytest.approx(flown, abs=0.5)


@pytest.mark.parametrize("case", REFUSED, ids=lambda case: case.law)
def test_a_law_about_the_intermediate_axis_is_refused(case):
    with pytest.raises(ValueError, match=r"^inertia: .*intermediate.* received 1, 2, 1.5 kg m"):
        answer(case)


def test_nutation_grows_about_the_intermediate_axis_alone():
    """By Euler's equations: w sqrt((C - A)(B - C)/(A B))."""
    rate = (0.0, 0.0, 2.0)
    assert nutation_growth([[1, 0, 0], [0, 2, 0], [0, 0, 1.5]], rate, 1e-3) == pytest.approx(
        2.0 / 1e-3 * math.sqrt(0.5 * 0.5 / 2.0)
    )
    for axial in (0.9, 2.1):
        assert nutation_growth([[1, 0, 0], [0, 2, 0], [0, 0, axial]], rate, 1e-3) == 0.0


@pytest.mark.parametrize(
    ("rate", "state"), [(6.0, "valid"), (3.0, "valid"), (1.0, "doubtful"), (0.5, "doubtful")]
)
def test_bdot_against_the_turning_field(rate, state):
    """The same 7.5 revolutions by the formula; flown 7.5, 8, 13.5 and never."""
    asked = LawRequest(inclination_deg=51.6, gain=1e5, rate_deg_s=(rate,) * 3, **CUBE)
    verdict = law_motion("bdot", asked).data()["verdict"]
    assert verdict["state"] == state
    if state == "doubtful":
        assert any(doubt["quantity"].startswith("precession at the end")
                   for doubt in verdict["doubts"])  # fmt: skip
    assert (verdict["flown_revolutions"] is None) == (rate == 0.5)


def test_never_of_an_equatorial_orbit_is_doubted():
    asked = LawRequest(inclination_deg=0.0, gain=1e5, rate_deg_s=(3.0, 3.0, 3.0), to=20.0,
                       **CUBE | {"rho_deg": 0.0})  # fmt: skip
    found = law_motion("bdot", asked)
    lines = found.lines()
    assert "angular momentum to 20 %: never" in lines
    assert any("flown 3 times: not within 59.7 revolutions" in line for line in lines)
    assert "doubtful: the formula says never, but true motions go on towards it" in lines
    assert any("dipole's tilt" in line for line in lines)
    assert all(line in found._repr_html_() for line in found.verdict[:1])


@pytest.mark.parametrize(
    ("flown", "words"),
    [((math.inf, 150.0), "go there"), ((math.inf, math.inf), "go on towards it")],
)
def test_a_doubted_never_says_whether_a_motion_arrived(flown, words):
    flights = Flights(tuple(Flight(0.0, math.inf, each, 200.0, 0.4, 0.0) for each in flown))
    doubt = flights.doubt(FLOWN, EACH_FLOWN)
    assert doubt.words == f"the formula says never, but true motions {words}"


def test_requests_without_a_meaning_are_refused():
    with pytest.raises(ValueError, match=r"^rate: must have a part along the spin axis"):
        law_motion("spin_up", LawRequest(inclination_deg=20.0, gain=50.0,
                                         rate_deg_s=(5.0, 0.0, 0.0), **CUBE))  # fmt: skip
    with pytest.raises(ValueError, match=r"^sun: must not lie across the field"):
        law_motion("sdot", LawRequest(inclination_deg=0.0, gain=10.0, sun_deg=90.0,
                                      rate_deg_s=(1.0, 1.0, 6.0), **CUBE))  # fmt: skip


def test_what_is_there_from_the_start_takes_no_time():
    asked = LawRequest(inclination_deg=51.6, gain=10.0, rate_deg_s=(1.0, 1.0, 6.0), sun_deg=40.0,
                       **CUBE | {"rho_deg": 40.0})  # fmt: skip
    found = law_motion("sdot", asked)
    assert found.found["revolutions"]["median"] == 0.0
    assert found.verdict == ["there from the start: nothing flown", "valid"]


def test_one_set_of_limit_motions_where_rates_vanish_to_second_order():
    asked = LawRequest(inclination_deg=0.0, gain=1e6, rate_deg_s=(1.0, 1.0, 6.0),
                       **CUBE | {"rho_deg": 0.0})  # fmt: skip
    ends = {each["description"] for each in law_motion("nutation_damping", asked).found["tends_to"]}
    assert ends == {
        "momentum along the cone axis, any nutation",
        "momentum against the cone axis, any nutation",
        "momentum in any direction, nutation 0 deg",
        "momentum in any direction, nutation 180 deg",
    }  # fmt: skip


def test_a_table_of_gains_has_what_was_flown_and_each_doubt_once():
    asked = LawRequest(inclination_deg=51.6, gain=1e5, rate_deg_s=(1.0, 1.0, 1.0), **CUBE)
    found = law_gains("bdot", asked)
    assert found.lines()[1].endswith("flown")
    doubts = [line for line in found.lines() if line.startswith("doubtful at ")]
    assert len(doubts) == len({line.partition(": ")[2] for line in doubts}) >= 2
    assert all(row["verdict"]["state"] == "doubtful" for row in found.data()["rows"])


def test_a_verdict_is_data_and_a_limit_may_refuse():
    soft, hard = Limit("x", most=1.0, why="too much"), Limit("y", 0.0, refuses=True, why="why not")
    verdict = judge((soft, 2.0), (hard, 1.0), (soft, None))
    assert verdict.data() == {
        "state": "doubtful",
        "doubts": [{"text": "x = 2: must be at most 1 (too much)", "quantity": "x", "value": 2.0,
                    "least": None, "most": 1.0, "beyond": "too much"}],
    }  # fmt: skip
    assert judge((soft, 1.0)).lines() == ["valid"]
    with pytest.raises(ValueError, match=r"^y: must be at least 0 \(why not\); received -1$"):
        judge((hard, -1.0))


def test_every_condition_has_a_formula_a_reason_and_a_trial():
    found = conditions(theory)
    assert len(found) > 15
    assert all(limit.of and limit.why and limit.shown for limit in found)
    assert len(table(theory)) == len(found) + 2


SCENARIO = """
start = 2024-03-04T10:00:00Z
environment.field = {{ kind = "averaged" }}
spacecraft.body.inertia_kg_m2 = [1.5, 1.5, 1.2]
spacecraft.coils.limit_a_m2 = {limit}
initial.rate_deg_s = [5, 5, 5]
control = {{ sample_s = {sample_s}, law = {{ {law} }} }}
simulation.duration_s = 300
[orbit]
{orbit}
"""
CIRCLE = 'kind = "circular"\naltitude_km = 500\ninclination_deg = 60'
OVAL = 'kind = "kepler"\nperigee_altitude_km = 500\napogee_altitude_km = {}\ninclination_deg = 60'
RATE = 'kind = "bdot_rate", gain_a_m2_s_per_t = 4e4'
ASIDE = 'kind = "preliminary_1", gain_a_m2_per_t = 1e4, target = [1.0, 0.0, 0.0]'


@pytest.mark.parametrize(
    ("changed", "quantity"),
    [
        ({}, None),
        ({"limit": 0.1}, "commanded dipole over the coils' limit"),
        ({"orbit": OVAL.format(3000)}, "eccentricity"),
        ({"orbit": OVAL.format(700)}, None),
        ({"sample_s": 9.0}, "damping of the sampled law over that of the ideal one"),
        ({"law": ASIDE}, "angle of the target to the cone axis [deg]"),
    ],
    ids=["inside", "saturated", "oval", "nearly a circle", "sampled", "target aside"],
)
def test_what_true_motions_leave_out_is_doubted_by_itself(tmp_path, changed, quantity):
    usual = {"limit": 300.0, "sample_s": 1.0, "orbit": CIRCLE, "law": RATE}
    path = tmp_path / "case.toml"
    path.write_text(SCENARIO.format(**usual | changed))
    verdict = law_motion(scenario=load_scenario(path)).data()["verdict"]
    doubted = {doubt["quantity"] for doubt in verdict["doubts"]}
    unseen = {limit.name for limit in (WITHIN_LIMITS, CIRCULAR, SAMPLED, TO_CONE_AXIS)}
    assert doubted & unseen == ({quantity} if quantity else set())


def test_a_motion_cut_short_is_no_never():
    """Its time to the goal is estimated by where it has come."""
    flight = Flight(0.0, 50.0, math.inf, 60.0, 0.2, 1.4)
    assert flight.needed == pytest.approx(70.0)
    assert flight._replace(span=125.0).needed == math.inf
