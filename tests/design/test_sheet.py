"""A scenario from a size class and a data sheet, with a campaign of what it leaves open."""

import math

import numpy as np
import pytest

from torquer.analysis.notes.notes import write_notes
from torquer.base.limits import RequestError
from torquer.campaign.fly import fly_campaign
from torquer.campaign.load import load_campaign
from torquer.campaign.sampling import member_scenario
from torquer.campaign.statistics import quantile
from torquer.compile import engine
from torquer.design import SheetRequest, from_sheet, size_classes
from torquer.design.detumbling import without_flights
from torquer.design.requests import DetumbleRequest
from torquer.design.wheel_file import wheels_of
from torquer.design.wheel_report import wheels
from torquer.scenario.load import scenario_from_text
from torquer.theory.averaged.conditions import FLOWN

#: A box whose middle is the centre of mass has no torque of light.
NOTES = [
    "disturbance.solar_pressure gives no torque with the parts as given: each has its centre "
    "(centre_m) at the centre of mass; a campaign may shift them"
]
needs_jit = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
#: Members whose values are looked at.
DRAWN = 150


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """A sheet with panels, its scenario and campaign, and members of it."""
    sheet = from_sheet(SheetRequest(like="3u", mass_kg=5.0, panels=2, altitude_km=450.0))
    path = tmp_path_factory.mktemp("sheet") / "mine.toml"
    path.write_text(sheet.text)
    scenario, campaign = load_campaign(path)
    return sheet, scenario, [member_scenario(scenario, campaign, n) for n in range(DRAWN)]


@pytest.mark.parametrize("name", size_classes())
def test_each_class_is_a_scenario_with_the_gain_of_theory(name):
    sheet, kind = from_sheet(SheetRequest(like=name)), size_classes()[name]
    scenario = scenario_from_text(sheet.text, name)
    body = scenario.spacecraft.body
    assert body.mass_kg == kind.mass_kg and scenario.orbit.altitude_km == kind.altitude_km
    assert body.box_m == pytest.approx(kind.size_m, rel=1e-3)
    rate = float(np.linalg.norm(scenario.initial.rate_deg_s))
    assert rate == pytest.approx(kind.tip_off_deg_s, rel=1e-3)
    dipole = np.linalg.norm(scenario.spacecraft.coils.residual_dipole_a_m2)
    assert dipole == pytest.approx(3.5e-3 * kind.mass_kg, rel=1e-3)
    theory = without_flights(scenario, DetumbleRequest()).theory_gain
    assert scenario.control.law.gain_a_m2_s_per_t == pytest.approx(theory, rel=0.01)
    assert max(map(len, sheet.text.partition("\n[spacecraft.aero")[0].splitlines())) <= 100


@pytest.mark.parametrize("name", size_classes())
def test_with_wheels_it_slews_within_a_quarter_of_what_they_can_do(name):
    kind = size_classes()[name]
    scenario = scenario_from_text(from_sheet(SheetRequest(like=name, wheels=True)).text, name)
    found = wheels(wheels_of(scenario)).found
    assert scenario.spacecraft.wheels.momentum_limit_n_m_s == kind.wheel_momentum_n_m_s
    assert all(0.0 < each["share"] <= 0.26 for each in found["demand"].values())
    assert [each["demand_met"] for each in found["failures"] if len(each["lost"]) == 1] == [
        True
    ] * 4
    assert scenario.mission.attitude_error_below_deg == pytest.approx(10 * kind.attitude_noise_deg)
    assert write_notes(scenario) == NOTES


def test_what_was_given_takes_the_place_of_the_class(written):
    sheet, scenario, _ = written
    assert scenario.spacecraft.body.mass_kg == 5.0 and scenario.orbit.altitude_km == 450.0
    assert scenario.spacecraft.body.inertia == pytest.approx(sheet.masses.inertia, rel=1e-3)
    assert len(scenario.spacecraft.aerodynamics.parts) == 3
    wanted = "torquer init NAME --like 3u --mass-kg 5 --panels 2 --altitude-km 450"
    assert sheet.text.partition("\n")[0] == f"# A 3U CubeSat from its data sheet: {wanted}"
    assert "# The box and its panels, from the centre of mass." in sheet.text


def test_a_measured_dipole_varies_by_a_fifth():
    sheet = from_sheet(SheetRequest(like="1u", dipole_a_m2=0.002))
    assert "magnitude = { uniform = [0.0016, 0.0024] }" in sheet.text
    assert "#   Residual dipole: as given; in the campaign a fifth less" in sheet.text


def test_inertia_is_drawn_about_that_of_the_sheet(written):
    sheet, _, members = written
    moments = np.array([np.diag(m.spacecraft.body.inertia) for m in members])
    ratio = moments / np.diag(sheet.masses.inertia)
    assert ratio.min() >= 0.81 - 1e-3 and ratio.max() <= 1.3225 + 1e-3
    edges = np.array([m.spacecraft.body.box_m for m in members]) / sheet.box_m
    assert edges.mean(axis=0) == pytest.approx([1.025] * 3, abs=4 * 0.0722 / math.sqrt(DRAWN))
    assert edges.std(axis=0) == pytest.approx([0.25 / math.sqrt(12)] * 3, rel=0.2)
    assert abs(np.corrcoef(edges.T)[np.triu_indices(3, 1)]).max() < 4 / math.sqrt(DRAWN)


def test_dipole_is_drawn_in_any_direction_between_the_classes(written):
    sheet, _, members = written
    drawn = np.array([m.spacecraft.coils.residual_dipole_a_m2 for m in members])
    size = np.linalg.norm(drawn, axis=1)
    assert size.min() >= sheet.dipole_a_m2.low and size.max() <= sheet.dipole_a_m2.high
    middle, wide = math.log(math.sqrt(0.005 * 0.05)), math.log(10.0) / math.sqrt(12)
    assert np.log(size).mean() == pytest.approx(middle, abs=4 * wide / math.sqrt(DRAWN))
    assert np.log(size).std() == pytest.approx(wide, rel=0.2)
    mean = np.linalg.norm((drawn / size[:, None]).mean(axis=0))
    assert mean < 4 / math.sqrt(DRAWN)


def test_centre_of_mass_is_drawn_alike_for_all_parts(written):
    sheet, _, members = written
    own = np.array([part.centre_m for part in sheet.parts])
    drawn = np.array([[p.centre_m for p in m.spacecraft.aerodynamics.parts] for m in members])
    shifts = drawn - own
    assert np.abs(shifts - shifts[:, :1]).max() < 1e-5
    wanted = 0.5 * np.array(sheet.satellite.centre_m)
    assert shifts[:, 0].std(axis=0) == pytest.approx(wanted, rel=0.25)
    assert np.abs(shifts[:, 0].mean(axis=0) / wanted).max() < 4 / math.sqrt(DRAWN)


def test_air_is_drawn_over_the_solar_cycle(written):
    flux = np.array([m.environment.atmosphere.f107 for m in written[2]])
    assert flux.min() >= 75 and flux.max() <= 200 and flux.std() == pytest.approx(36.1, rel=0.2)


@needs_jit
@pytest.mark.parametrize("name", ["12u", "3u"])
def test_half_of_the_releases_stop_in_the_time_promised(tmp_path, name):
    sheet, path = from_sheet(SheetRequest(like=name)), tmp_path / "mine.toml"
    path.write_text(sheet.text)
    scenario, campaign = load_campaign(path)
    with pytest.warns(UserWarning, match="members fly one by one"):
        flown = fly_campaign(scenario, campaign)
    half_s = quantile(np.nan_to_num(flown.settling_s.values, nan=np.inf), 0.5)
    assert FLOWN.holds(half_s / sheet.promised_s)


@pytest.mark.parametrize(
    ("keys", "says"),
    [
        ({}, "like: must be one of 1u, 2u, 3u, 6u, 12u, 50kg, 150kg; received nothing"),
        ({"like": "4u"}, "like: must be one of 1u, 2u, 3u, 6u, 12u, 50kg, 150kg; received '4u'"),
        ({"like": "3u", "panels": 3}, "panels: must be an even number, 0 or more; received 3"),
        ({"like": "3u", "panels": 10}, "panels: must lie within 0..8; received 10"),
        ({"like": "3u", "mass_kg": 0.1, "panels": 2}, "mass_kg: must be above 0.204 kg, the mass"),
        ({"like": "3u", "mass_kg": -1.0}, "mass_kg: must be a positive number; received -1"),
        ({"like": "3u", "size_m": (0.1, 0.0, 0.3)}, "size_m: must be three positive numbers; rec"),
        ({"like": "3u", "inclination_deg": 190.0}, "inclination_deg: must lie within 0..180; rec"),
    ],
)
def test_refusals(keys, says):
    with pytest.raises(RequestError, match=f"^{says}"):
        from_sheet(SheetRequest(**keys))
