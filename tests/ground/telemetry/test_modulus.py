"""The strength of the field along an orbit; axes that are wrong; an examination."""

import numpy as np
import pytest
from telemetry_session import START, TLE, environment, session

from torquer.environment.along_orbit import Environment, OrbitEnvironment
from torquer.environment.orbit import Circular, Sgp4
from torquer.ground.telemetry.axes import rank_axes
from torquer.ground.telemetry.examine import examine
from torquer.ground.telemetry.modulus import FieldAlong, FieldGiven, strength_ratio
from torquer.ground.telemetry.orbit import load_orbit
from torquer.ground.telemetry.reading.read import Session


def test_the_spline_is_within_a_thousandth_of_a_nanotesla():
    """A polar low orbit, where the field bends most, two stretches with a gap between."""
    orbit = Circular(altitude_km=350.0, inclination_deg=90.0)
    env = OrbitEnvironment(Environment(), orbit, START)
    t_s = np.concatenate([np.arange(0.0, 6000.0, 7.3), np.arange(40_000.0, 46_000.0, 11.1)])
    at_s = t_s + 3.7
    strength, rate = FieldAlong(env, t_s).strength(at_s)
    r, v = env.state(at_s)
    direct = np.linalg.norm(env.field(at_s, r, v), axis=1)
    assert np.max(np.abs(strength - direct)) < 1e-12
    later = np.linalg.norm(env.field(at_s + 0.5, *env.state(at_s + 0.5)), axis=1)
    before = np.linalg.norm(env.field(at_s - 0.5, *env.state(at_s - 0.5)), axis=1)
    np.testing.assert_allclose(rate, later - before, atol=2e-13)


def test_given_positions_give_the_same_field():
    data, _ = session(0)
    env, t_s = environment(), data["time"].values
    r, _ = env.state(t_s)
    given, along = FieldGiven(env, t_s, r).strength(t_s), FieldAlong(env, t_s).strength(t_s)
    np.testing.assert_allclose(given[0], along[0], atol=1e-12)
    # a spline through rows each 31 s: less exact than the grid, least at its ends
    np.testing.assert_allclose(given[1][5:-5], along[1][5:-5], atol=2e-12)


def test_the_ratio_of_the_strengths_is_that_of_the_usual_row():
    strength = np.linspace(2e-5, 5e-5, 50)
    measured = 1.3 * strength
    measured[:5] = np.nan
    measured[10] = 1.0
    assert strength_ratio(measured, strength) == pytest.approx(1.3)


@pytest.mark.parametrize("judge", ["omega_measured", "sun_measured"])
def test_swapped_axes_are_named(judge):
    data, _ = session(4)
    data = data[["b_measured", judge]]
    env = environment() if judge == "sun_measured" else None
    right = rank_axes(data, data["b_measured"].values, env)
    assert not right.is_wrong and right.orders[0] == ("x", "y", "z")
    swapped = data["b_measured"].values[:, [1, 0, 2]]
    found = rank_axes(data, swapped, env)
    assert found.is_wrong and found.orders[0] == ("y", "x", "z")
    assert found.errors_deg[1] > 2.0 * found.errors_deg[0]


def test_without_gyro_and_sun_no_axes_are_judged():
    data, _ = session(4)
    assert rank_axes(data[["b_measured"]], data["b_measured"].values) is None


def test_an_examination_names_each_mistake():
    data, _ = session(6)
    orbit = Sgp4(tle=TLE)
    good = examine(Session(data, ()), orbit)
    assert not good.mistakes and good.verdict.startswith("calibrated to ")
    assert np.max(np.abs(good.calibrated["F"] - good.calibrated["F_model"])) < 400.0
    late = data.assign_coords(utc=data["utc"] + np.timedelta64(1, "h"))
    small = data.assign(b_measured=1e-3 * data["b_measured"])
    swapped = data.copy(deep=True)
    swapped["b_measured"].values[:] = data["b_measured"].values[:, [1, 0, 2]]
    for wrong, word in (
        (late, "zone wrong by +1 h"),
        (small, "microtesla taken for nanotesla"),
        (swapped, "axes of the magnetometer wrong"),
    ):
        found = examine(Session(wrong, ()), orbit)
        assert word in found.verdict and found.verdict.startswith("not usable as it is")
        assert (found.calibration is None) == (wrong is not swapped)


def test_drifting_first_minutes_are_reported_and_left_out_on_request():
    data, _ = session(1)
    t_s = data["time"].values
    data["b_measured"].values[:, 0] += 3e-6 * np.exp(-t_s / 300.0) * (t_s < 590.0)
    orbit = Sgp4(tle=TLE)
    assert "first minutes differ" in [
        each.key for each in examine(Session(data, ()), orbit).findings
    ]
    rest = examine(Session(data, ()), orbit, leave_out_first_s=600.0)
    keys = [each.key for each in rest.findings]
    assert "left out" in keys and "first minutes differ" not in keys
    with pytest.raises(ValueError, match="leave_out_first_min: must leave rows"):
        examine(Session(data, ()), orbit, leave_out_first_s=1e6)


def test_what_an_examination_needs():
    data, _ = session(0)
    with pytest.raises(ValueError, match="orbit: must be given"):
        examine(Session(data, ()))
    with pytest.raises(ValueError, match="must hold b_measured"):
        examine(Session(data.drop_vars("b_measured"), ()), Sgp4(tle=TLE))


def test_orbits_from_files(tmp_path):
    tle = tmp_path / "two.tle"
    newer = TLE[0].replace("12058.91450162", "12064.91450162")[:68] + "1"
    tle.write_text("A\n" + "\n".join(TLE) + "\nA\n" + "\n".join([newer, TLE[1]]) + "\n")
    orbit, about = load_orbit(tle, START)
    at, plain = np.array([10.0]), Sgp4(tle=(newer, TLE[1]))
    assert np.array_equal(orbit.state(at, START), plain.state(at, START))
    assert "0.5 d after" in about
    table = tmp_path / "orbit.toml"
    table.write_text(
        "start = 2012-03-04T09:00:00Z\n[orbit]\nkind = 'circular'\naltitude_km = 500.0\n"
        "inclination_deg = 51.6\n"
    )
    orbit, _ = load_orbit(table, START)
    plain = Circular(altitude_km=500.0, inclination_deg=51.6)
    later = (START - orbit.start).total_seconds()
    np.testing.assert_allclose(
        orbit.state(np.array([10.0]), START)[0], plain.state(np.array([10.0 + later]), START)[0]
    )
    table.write_text("[orbit]\nkind = 'circular'\naltitude_km = 500.0\ninclination_deg = 51.6\n")
    with pytest.raises(ValueError, match="orbit: must state `start`"):
        load_orbit(table, START)
    table.write_text("start = 2012-03-04T09:00:00Z\n")
    with pytest.raises(ValueError, match="two-line elements, an OMM, OEM, SP3, or a table"):
        load_orbit(table, START)
    table.write_text("[orbit]\nkind = 'square'\n")
    with pytest.raises(ValueError, match="orbit: "):
        load_orbit(table, START)
    table.write_text("[orbit]\nkind = 'circular'\naltitude_km = -5\ninclination_degs = 60\n")
    with pytest.raises(ValueError, match=r"altitude_km: must be greater than 0; .*degs: must"):
        load_orbit(table, START)
    tle.write_text("\n".join([TLE[0][:-1] + "5", TLE[1]]))
    with pytest.raises(ValueError, match="checksum must be 4; received 5"):
        load_orbit(tle, START)
