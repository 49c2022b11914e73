"""`torquer design magneto-gyro`: a satellite to a scenario that flies, and one line per mistake."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from torquer.analysis.attitude import find_attitude_error
from torquer.campaign.load import load_campaign
from torquer.campaign.sampling import member_scenario
from torquer.computer.laws.magneto_gyro.law import MagnetoGyro
from torquer.scenario.load import load_scenario
from torquer.simulation.setup.simulate import simulate

EXAMPLE = Path(__file__).parents[2] / "examples/magneto_gyro.toml"
#: A short search, and no flights.
QUICK = ("--evaluations", 10, "--fly", 0)
PERIOD_S = 6090.4


@pytest.fixture
def changed(tmp_path):
    """The example with texts replaced, as a file."""

    def make(*pairs):
        text = EXAMPLE.read_text()
        for old, new in zip(pairs[::2], pairs[1::2], strict=True):
            assert old in text
            text = text.replace(old, new)
        path = tmp_path / "satellite.toml"
        path.write_text(text)
        return path

    return make


def designed(call, strict_json, path, *options):
    """What is printed as JSON."""
    code, out, err = call("design", "magneto-gyro", path, *QUICK, *options, "--json")
    assert (code, err) == (0, "")
    return strict_json(out)


def flown(scenario):
    """Orbits, attitude error [deg] (n, 3), result of a run."""
    result = simulate(scenario)
    return result.time.values / PERIOD_S, find_attitude_error(result).error_deg, result


def test_the_scenario_that_it_writes_flies_as_predicted(call, strict_json, tmp_path):
    options = ("--evaluations", 20, "--fly", 2, "--json", "--out", tmp_path)
    code, out, err = call("design", "magneto-gyro", EXAMPLE, *options)
    assert (code, err) == (0, "")
    found = strict_json(out)
    pictures = ("wheel.png", "errors.png", "orbits.png", "flights.png")
    names = ["law.toml", "scenario.toml", *pictures, "page.pdf"]
    assert [Path(file).name for file in found["files"]] == names
    assert all(Path(file).stat().st_size > 300 for file in found["files"])
    assert found["degree"] > 0.2 and found["stage_1"]["degree"] > 0.3
    assert found["degree_over_a_day"] > 0.2 and min(found["margins"].values()) > 0.1
    assert found["greatest_tip_off_rad_s"] > np.radians(3.0)
    law = tomllib.loads((tmp_path / "law.toml").read_text())["control"]["law"]
    assert law == found["law"]
    _flies_as_predicted(load_scenario(tmp_path / "scenario.toml"), found)
    _flights_are_those_of_its_campaign(tmp_path / "scenario.toml", found)


def _flies_as_predicted(scenario, found):
    assert np.linalg.norm(scenario.initial.rate_deg_s) == pytest.approx(3.0, abs=1e-3)
    assert scenario.mission.attitude_error_below_deg == 5.0
    orbits, error, _ = flown(scenario)
    assert np.linalg.norm(error[orbits > 8.0], axis=1).max() < 5.0
    parts = (np.array(found["errors_deg"][name]) for name in ("noise", "field model"))
    want = np.sqrt(sum(part**2 for part in parts))
    assert np.sqrt(np.mean(error[orbits > 9.0] ** 2, axis=0)) == pytest.approx(want, rel=0.25)


def _flights_are_those_of_its_campaign(path, found):
    """Each of them settles, and near to the time of theory on average."""
    scenario, campaign = load_campaign(path)
    last = []
    for number in range(2):
        orbits, error, _ = flown(member_scenario(scenario, campaign, number))
        last.append(orbits[np.flatnonzero(np.linalg.norm(error, axis=1) > 1.0)[-1] + 1])
    flights, theory = found["time_to_point"]["flights"], found["time_to_point"]["theory"]
    assert flights["runs"] == 2 and flights["below_1_deg"]["never"] == 0
    assert flights["below_1_deg"]["settled_s"]["1"] == pytest.approx(PERIOD_S * max(last), rel=1e-3)
    assert theory["below_1_deg_s"] == pytest.approx(PERIOD_S * np.mean(last), rel=0.3)


@pytest.mark.slow
def test_silent_magnetometer_switches_coils_off_until_it_reads_again(call, tmp_path):
    assert call("design", "magneto-gyro", EXAMPLE, *QUICK, "--out", tmp_path)[0] == 0
    scenario = load_scenario(tmp_path / "scenario.toml").replace("simulation.revolutions", 14.0)
    silent = {"kind": "silent", "from_s": 40_000.0, "until_s": 45_000.0}
    orbits, error, result = flown(scenario.replace("spacecraft.magnetometer.failures", [silent]))
    t_s, off = orbits * PERIOD_S, np.all(result.command_body.values == 0.0, axis=1)
    assert off[(t_s > 40_100.0) & (t_s < 44_990.0)].all()
    assert not off[(t_s > 30_000.0) & (t_s < 39_900.0)].any()
    assert np.linalg.norm(error[orbits > 13.0], axis=1).max() < 1.0
    state, stage = result.mode_main.values, result["magneto_gyro.stage"].values
    waiting, _, pointing = range(3)
    assert np.all(state[(t_s > 40_100.0) & (t_s < 44_990.0)] == waiting)
    assert np.all(state[orbits > 13.0] == pointing)
    assert np.all(stage[state == pointing] == 2.0)
    assert np.linalg.norm(error[state == pointing], axis=1).max() < 10.0
    assert "flights.png" not in [file.name for file in tmp_path.iterdir()]


def test_text_form_states_the_dipole_and_windows_set_the_duty(call, strict_json, changed):
    path = changed("sample_s = 1.0", "sample_s = 1.0\nmeasure_s = 1.0\nactuate_s = 4.0")
    law = designed(call, strict_json, path, "--form", "text")["law"]
    assert law["coil_duty"] == 0.8
    assert law["form"] == "text" and len(law["dipole_nt"]) == 3
    assert MagnetoGyro.model_validate(law).law().values()["dipole"].used == 1.0


def test_what_is_printed(call, changed):
    """With a weak wheel there is a note, and the wheel that would do."""
    path = changed("wheel_momentum_n_m_s = [0, 30, 0]", "wheel_momentum_n_m_s = [0, 13.4, 0]")
    code, out, err = call("design", "magneto-gyro", path, *QUICK, "--degree", 0.1)
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert lines[0].startswith("satellite: J = 3699 kg m^2, lambda = 0.595, h = 2.1")
    assert any("by the frozen model" in line for line in lines)
    assert "doubtful: h = 2.11: must be at least 3 (near 2 or below it" in out
    assert "note: a wheel of 14.9 N m s has h = 2.5" in out
    assert "[control.law]" in lines and 'kind = "magneto_gyro"' in lines
    assert max(map(len, lines)) <= 140


@pytest.mark.slow
def test_the_wheel_that_is_recommended_is_better(call, strict_json, changed):
    own = "wheel_momentum_n_m_s = [0, 30, 0]"
    path = changed(own, "wheel_momentum_n_m_s = [0, 13.4, 0]")
    weak = designed(call, strict_json, path, "--degree", 0.2)
    wheel = weak["better_wheel"]["wheel_n_m_s"]
    better = designed(call, strict_json, changed(own, own.replace("30", f"{wheel}")))
    assert better["better_wheel"] is None
    assert better["degree"] > weak["degree"] + 0.05
    assert better["stage_1"]["degree"] > weak["stage_1"]["degree"] + 0.1
    assert min(better["margins"].values()) > min(weak["margins"].values()) + 0.05


@pytest.mark.slow
def test_a_lower_degree_has_a_smaller_error(call, strict_json):
    costs = designed(call, strict_json, EXAMPLE)["costs"]
    degrees, errors = ([cost[key] for cost in costs] for key in ("degree", "error_deg"))
    assert degrees == sorted(degrees) and degrees[-1] > degrees[0] + 0.05
    assert errors[0] < errors[-1]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("inclination_deg", "ends"), [(98.8, (19.0, 161.0)), (26.0, (20.0, 160.0))]
)
def test_inclinations_for_which_it_works(call, strict_json, changed, inclination_deg, ends):
    path = changed("inclination_deg = 98.8", f"inclination_deg = {inclination_deg}")
    found = designed(call, strict_json, path)
    assert [*found["inclinations_deg"].values()] == pytest.approx(ends, abs=5.0)
    unstable = "".join(note for note in found["notes"] if note.startswith("stage 2 is unstable"))
    assert ("inclination -10 deg" in unstable) == (inclination_deg == 26.0)


@pytest.mark.slow
def test_weak_coils_are_named_with_what_would_do(call, strict_json, changed):
    """Times are in proportion: the dipole that is named needs the time that is named."""
    path = changed("limit_a_m2 = 250", "limit_a_m2 = 5")
    notes = designed(call, strict_json, path)["notes"]
    weak = next(note for note in notes if note.startswith("the coils are weak: with 5 A m^2"))
    needed = float(weak.split("20 orbits need about ")[1].split()[0])
    assert any("own dipole of 11.2 A m^2" in note for note in notes)
    assert any("saturates the coils in stage 2" in note for note in notes)
    path = changed("limit_a_m2 = 250", f"limit_a_m2 = {needed}")
    time = designed(call, strict_json, path)["time_to_point"]["theory"]
    assert (time["braking_s"] + time["turning_s"]) / PERIOD_S == pytest.approx(20.0, rel=0.05)


def test_what_is_left_out_is_said(call, strict_json, changed):
    path = changed(
        "inertia_kg_m2 = [3800, 2200, 3600]\nwheel",
        "inertia_kg_m2 = [[3800, 50, 0], [50, 2200, 0], [0, 0, 3600]]\nwheel",
        "[0, 30, 0]", "[2, 30, 0]",
    )  # fmt: skip
    notes = designed(call, strict_json, path)["notes"]
    assert notes[:2] == [
        "products of inertia are left out of the design",
        "the wheel's momentum across the pitch axis is left out of the design",
    ]


@pytest.mark.slow
def test_a_scenario_with_another_law_becomes_one_with_this(call, strict_json, scenario, tmp_path):
    """A small satellite, by the same rules; its own law and its goal for the rate are gone."""
    text = scenario.read_text().replace('{ kind = "averaged" }', '{ kind = "tilted_dipole" }')
    text = text.replace("[1.0, 1.2, 1.5]", "[1.5, 1.0, 1.4]\nwheel_momentum_n_m_s = [0, 0.012, 0]")
    scenario.write_text(f"{text}[mission]\nrate_below_deg_s = 0.5\n")
    found = designed(call, strict_json, scenario, "--out", tmp_path / "out")
    assert found["tip_off_deg_s"] == pytest.approx(14.0**0.5)
    assert found["notes"][0].startswith("no law of the scenario holds an attitude in orbit")
    made = load_scenario(tmp_path / "out/scenario.toml")
    assert [*made.control.laws] == ["magneto_gyro"] and made.control.law is None
    assert made.mission.attitude_error_below_deg == 5.0
    assert flown(made)[1][-1] == pytest.approx(np.zeros(3), abs=1.0)


def test_an_eccentric_orbit_is_designed_for_by_its_period(call, strict_json, changed):
    circle = "altitude_km = 830\ninclination_deg = 98.8"
    ellipse = "semi_major_axis_km = 7208.137\neccentricity = 0.05\ninclination_deg = 98.8"
    text = changed(
        'kind = "circular"', 'kind = "kepler"', circle, ellipse + "\nmean_anomaly_deg = 0"
    )
    text.write_text(text.read_text().partition("# Any attitude")[0])
    found = designed(call, strict_json, text)
    assert found["law"]["orbital_rate_rad_s"] == pytest.approx(1.03165e-3, rel=1e-4)
    assert any(note.startswith("the orbit's radius varies by 10 %") for note in found["notes"])


@pytest.mark.slow
def test_faster_scenario_rate_is_taken_as_the_tip_off_rate(call, strict_json, changed):
    faster = changed("rate_deg_s = [2.0, -1.5, 1.66]", "rate_deg_s = [4, 0, -3]")
    assert designed(call, strict_json, faster)["tip_off_deg_s"] == 5.0
    slower = changed("rate_deg_s = [2.0, -1.5, 1.66]", "rate_deg_s = [0, 0, 0]")
    assert designed(call, strict_json, slower)["tip_off_deg_s"] == 3.0


_WHEEL = "spacecraft.body.wheel_momentum_n_m_s: must"
_WEAK = f"{_WHEEL} be above 5.362 N m s along the orbit normal, (2 - lambda) J nu0; received"
_RATE = "rate_deg_s = [2.0, -1.5, 1.66]"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[0, 30, 0]", "[0, 5, 0]", f"{_WEAK} 5"),
        ("[0, 30, 0]", "[0, 0, 0]", f"{_WEAK} 0"),
        ("[0, 30, 0]", "[0, -30, 0]", f"{_WEAK} -30"),
        ("[0, 30, 0]", "[30, 0, 0]", f"{_WEAK} 0"),
        ("[0, 30, 0]", "[0, 9, 0]", f"{_WHEEL} make stage 1 stable, as 14.9 N m s would "
                                    "(h = 2.5); received 9 (h = 0.953)"),
        (_RATE, "rate_deg_s = [30, 30, 0]", "initial.rate_deg_s: must be at most 30 deg/s, or "
                                            "--tip-off-deg-s must be given; received 42.43 deg/s"),
        ("sample_s = 1.0", "sample_s = 60.0",
         "control.sample_s: must be shorter for stage 1 to brake 3.00093 deg/s (--tip-off-deg-s) "
         "with readings held for 60 s; received 60 s"),
        ("start = 2026-03-21", "start = 1850-03-21",
         "start: must lie within the years 1900 to 2099; received '1850-03-21 00:00:00+00:00'"),
    ],
)  # fmt: skip
def test_a_satellite_on_which_it_cannot_work(call, changed, old, new, message):
    path = changed(old, new)
    code, out, err = call("design", "magneto-gyro", path, *QUICK, "--degree", 0.1)
    assert (code, out, err) == (2, "", f"error: {message}\n")


@pytest.mark.parametrize("inclination_deg", [15.0, 3.0])
def test_an_orbit_near_the_equator_is_refused(call, changed, inclination_deg):
    path = changed("inclination_deg = 98.8", f"inclination_deg = {inclination_deg}")
    code, out, err = call("design", "magneto-gyro", path, *QUICK)
    assert (code, out) == (2, "")
    must = "error: orbit: must not come so near to the magnetic equator that stage 2 is unstable; "
    assert err.startswith(f"{must}received an inclination of {inclination_deg:g} deg")
    assert err.count("\n") == 1


def test_a_satellite_without_coils(call, scenario):
    text = scenario.read_text().replace('"bdot", gain_a_m2_s_per_t = 1e6', '"off"')
    scenario.write_text(text.replace("[spacecraft.coils]\nlimit_a_m2 = 3.0\n", ""))
    code, out, err = call("design", "magneto-gyro", scenario)
    must = "spacecraft.coils: must be given for magnetic control; received none"
    assert (code, out, err) == (2, "", f"error: {must}\n")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--tip-off-deg-s", 5, "--filter-rate-rad-s", 0.1),
         "--filter-rate-rad-s: must be at least 0.1091 to brake 5 deg/s (--tip-off-deg-s); "
         "received 0.1"),
        (("--filter-rate-rad-s", 0.05),
         "--filter-rate-rad-s: must be at least 0.06547 to brake 3.00093 deg/s "
         "(--tip-off-deg-s); received 0.05"),
        (("--degree", 2), "--degree: must lie within 0.01..1; received 2"),
        (("--tip-off-deg-s", 0), "--tip-off-deg-s: must lie within 0.01..30; received 0"),
        (("--fly", -1), "--fly: must lie within 0..1000; received -1"),
    ],
)  # fmt: skip
def test_mistakes_are_one_line(call, options, message):
    code, out, err = call("design", "magneto-gyro", EXAMPLE, *options)
    assert (code, out, err) == (2, "", f"error: {message}\n")
