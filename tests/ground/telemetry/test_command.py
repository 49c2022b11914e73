"""`torquer telemetry` as it is typed: files, verdicts, exit codes."""

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from telemetry_session import SHIFT_S, TLE, environment, motion, session
from twin_session import tip_off

import torquer
from torquer.base.limits import RequestError
from torquer.base.strict_json import json_text
from torquer.campaign.sampling import draw
from torquer.cli.answer import answer
from torquer.compile import engine
from torquer.ground.telemetry import TelemetryRequest, check
from torquer.ground.telemetry.examination import with_error
from torquer.scenario.change import with_values

EXAMPLE = Path("examples/chibis_m_detumble.toml").resolve()
MY_LAW = Path("examples/my_law.toml").resolve()


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    data, _ = session(0)
    data.to_netcdf("pass.nc", engine="h5netcdf")
    late = data.assign_coords(utc=data["utc"] + np.timedelta64(1, "h"))
    late.to_netcdf("late.nc", engine="h5netcdf")
    (tmp_path / "c.tle").write_text("\n".join(TLE))
    return tmp_path


def test_a_good_pass(folder, capsys):
    assert not answer(["telemetry", "pass.nc", "--orbit", "c.tle", "--model", "shift", "--json",
                       "--clock-sigma-s", "1", "--along-track-sigma-km", "10"])  # fmt: skip
    found = json.loads(capsys.readouterr().out)
    assert found["usable"] and found["calibration"]["values"]["bias_z"] == pytest.approx(
        2200e-9, abs=1e-7
    )
    assert found["split"]["clock_s"][0] < 2.5
    names = {each.name for each in (folder / "runs/pass-telemetry").iterdir()}
    assert names == {"calibrated.nc", "report.html", "residual.png", "ellipsoid.png", "causes.png"}
    with xr.open_dataset(folder / "runs/pass-telemetry/calibrated.nc") as made:
        assert {"B_VFM", "F", "F_model", "Latitude", "Longitude", "Radius", "Flags_F"} <= set(made)
        assert float(abs(made["F"] - made["F_model"]).max()) < 400.0
    page = (folder / "runs/pass-telemetry/report.html").read_text(encoding="utf-8")
    assert "Calibrated to" in page and "skew_zy" in page


def test_python_is_told_what_the_command_prints(folder, capsys):
    found = check("pass.nc", TelemetryRequest(orbit=Path("c.tle"), model="bias"))
    answer(["telemetry", "pass.nc", "--orbit", "c.tle", "--model", "bias", "--json"])
    printed = json.loads(capsys.readouterr().out)
    del printed["out"]
    assert json.loads(json_text(found.as_plain())) == printed
    page = found._repr_html_()
    assert found.verdict in page and "<td>bias_z</td>" in page and "<td>nT</td>" in page
    with pytest.raises(RequestError, match=r"^leave_out_first_min: must be 0 or more; received -1"):
        TelemetryRequest(leave_out_first_min=-1.0)


def test_a_wrong_zone_ends_with_1(folder, capsys):
    assert answer(["telemetry", "late.nc", "--orbit", "c.tle", "--out", "late"]) == 1
    printed = capsys.readouterr().out
    assert "verdict: not usable as it is: zone wrong by +1 h" in printed


def test_errors_of_clock_and_track_that_split_nothing_are_noted(folder, capsys):
    assert not answer(["telemetry", "pass.nc", "--orbit", "c.tle", "--model", "bias",
                       "--clock-sigma-s", "1", "--along-track-sigma-km", "10"])  # fmt: skip
    assert "--clock-sigma-s: splits nothing, as no shift was fitted" in capsys.readouterr().err


FILTER = """
[control.estimator]
kind = "kalman_gyro"
magnetometer_noise_nt = 50.0
sun_noise_deg = 0.5
angle_random_walk_deg_sqrt_s = 0.01
rate_random_walk_deg_s_sqrt_s = 1e-6
gyro_bias_sigma_deg_s = 0.01
"""


@pytest.fixture
def with_quaternions(folder):
    """The session with the attitude that it has, and a filter for it."""
    (folder / "filter.toml").write_text(FILTER)
    data, _ = session(0)
    to_body, _ = motion(data["time"].values + SHIFT_S, 0)
    data["q_measured"] = (("time", "component"), to_body.inv().as_quat())
    place, t_s = environment(), data["time"].values
    lit = place.sunlit_fraction(t_s, place.state(t_s)[0]) > 0.99
    data["sun_measured"].values[~lit] = 0.0
    return data.assign_coords(component=list("xyzw"))


@pytest.mark.skipif(not engine.COMPILED, reason="filters over sessions: slow")
def test_attitude_and_conventions(folder, with_quaternions, capsys):
    with_quaternions.to_netcdf("pass.nc", engine="h5netcdf")
    assert not answer(["telemetry", "pass.nc", "--orbit", "c.tle", "--model", "shift",
                       "--filter", "filter.toml", "--json"])  # fmt: skip
    found = json.loads(capsys.readouterr().out)
    assert found["attitude"]["fits"] and found["attitude"]["known"] == 1.0
    by = {each["by"]: each for each in found["conventions"]}
    assert by["field"]["agrees"] and by["field"]["stated_deg"] < 0.5
    assert by["field"]["ways"][0]["axes"] == ["x", "y", "z"]
    names = {each.name for each in (folder / "runs/pass-telemetry").iterdir()}
    assert {"attitude.nc", "attitude.png"} <= names
    with xr.open_dataset(folder / "runs/pass-telemetry/attitude.nc") as made:
        assert {"q_smoothed", "q_estimated", "attitude_sigma_smoothed"} <= set(made)
    page = (folder / "runs/pass-telemetry/report.html").read_text(encoding="utf-8")
    assert "Logged quaternions and the field" in page and "filter and smoother state" in page


@pytest.mark.skipif(not engine.COMPILED, reason="filters over sessions: slow")
def test_quaternions_of_another_convention_end_with_1(folder, with_quaternions, capsys):
    with_quaternions["q_measured"].values[:] = np.roll(with_quaternions["q_measured"], 1, axis=1)
    with_quaternions.to_netcdf("pass.nc", engine="h5netcdf")
    words = ["telemetry", "pass.nc", "--orbit", "c.tle", "--filter", "filter.toml"]
    assert answer(words) == 1
    printed = capsys.readouterr().out
    assert "WRONG: quaternions and field agree to" in printed and "scalar first" in printed
    assert "attitude to" not in printed


@pytest.mark.skipif(not engine.COMPILED, reason="filters over sessions: slow")
def test_a_filter_that_does_not_fit_ends_with_1(folder, with_quaternions, capsys):
    (folder / "filter.toml").write_text(FILTER.replace("50.0", "5.0"))
    words = ["telemetry", "pass.nc", "--orbit", "c.tle", "--filter", "filter.toml"]
    assert answer(words) == 1
    assert "the filter's model does not fit: readings of the magnet" in capsys.readouterr().out


@pytest.mark.skipif(not engine.COMPILED, reason="hundreds of flights: slow")
def test_a_twin(folder, capsys, monkeypatch):
    """A tip-off of a satellite up to 25 % off: its parameters, picture, page and file."""
    # enough here, in less time
    monkeypatch.setattr("torquer.ground.telemetry.twin.twin._GUESSES", 3)
    monkeypatch.setattr("torquer.ground.telemetry.twin.fit._RATIOS", np.array([-0.2, 0.0, 0.2]))
    text = EXAMPLE.read_text(encoding="utf-8")
    (folder / "believed.toml").write_text(text.replace("= 5e6", "= 8e5"), encoding="utf-8")
    data, true = tip_off(torquer.load_scenario("believed.toml"), 5, 20, (10.0, 10.0, 10.0))
    data.to_netcdf("tip-off.nc", engine="h5netcdf")
    words = ["telemetry", "tip-off.nc", "--orbit", "c.tle", "--model", "bias",
             "--twin", "believed.toml", "--json"]  # fmt: skip
    assert not answer(words)
    found = json.loads(capsys.readouterr().out)
    assert "with a turn by the gyro that is neither too large nor too small" in json.dumps(found)
    twin = found["twin"]
    assert twin["fits"] and not twin["only_ratio"] and 0.0 < twin["saturated"] < 0.9
    for name in ("inertia_xx", "inertia_yy", "inertia_zz", "gain"):
        off = twin["values"][name] - true[name]
        assert abs(off) < 4.0 * twin["sigmas"][name] and abs(off) < 0.05 * true[name]
    out = folder / "runs/tip-off-telemetry"
    assert {"twin.nc", "twin.png", "twin.toml"} <= {each.name for each in out.iterdir()}
    scenario, campaign = torquer.load_campaign(out / "twin.toml")
    drawn = draw(campaign, scenario, range(2000))["spacecraft.body.inertia_kg_m2"][:, 0, 0]
    assert np.mean(drawn) == pytest.approx(twin["values"]["inertia_xx"], rel=1e-4)
    assert np.std(drawn) == pytest.approx(twin["sigmas"]["inertia_xx"], rel=0.08)
    few = campaign.model_copy(update={"runs": 16})
    timing = {"duration_s": 600.0, "record_s": 3.0, "step_s": scenario.simulation.step_s}
    flown = torquer.fly_campaign(with_values(scenario, {"simulation": timing}), few)
    assert set(flown["how_it_ended"].values.tolist()) == {"complete"}
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "Twin over data" in page and "better than what was known beforehand" in page


@pytest.mark.parametrize(
    ("value", "sigma", "shown"),
    [
        (1.401, 0.0034, ("1.4010", "0.0034")),
        (0.048, 0.0101, ("0.048", "0.010")),
        (4.956e6, 6.3e4, ("4.956e+06", "6.3e+04")),
        (-2213.0, 148.0, ("-2213", "148")),
        (2.22e-7, 3.4e-9, ("2.220e-07", "3.4e-09")),
        (0.0, 0.01, ("0.000", "0.010")),
    ],
)
def test_a_number_has_the_digits_of_its_error(value, sigma, shown):
    assert with_error(value, sigma) == shown


def test_twin_code_is_executed_only_where_allowed(folder, capsys):
    words = ["telemetry", "pass.nc", "--orbit", "c.tle", "--twin", str(MY_LAW), "--no-user-code"]
    assert answer(words) == 2
    assert "control.law.file: must not be given with --no-user-code" in capsys.readouterr().err


def test_a_mapping_is_proposed_once(folder, capsys):
    rows = [f"2012-03-04T10:31:{k:02d}Z,1000{k},2000,3000" for k in range(9)]
    (folder / "a.csv").write_text("\n".join(["utc,bx_nT,by_nT,bz_nT", *rows]))
    assert not answer(["telemetry", "init", "a.csv"])
    assert "guessed: b_measured is bx_nT, by_nT, bz_nT" in capsys.readouterr().out
    assert answer(["telemetry", "init", "a.csv"]) == 2
    assert "--out: must be a new file" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "FILE: must be given"),
        (["pass.nc"], "--orbit: must be given"),
        (["pass.nc", "--clock-sigma-s", "1"], "--along-track-sigma-km: must be given, as "),
        (["init", "none.csv"], "FILE: must be a file"),
    ],
)
def test_mistakes(folder, capsys, words, message):
    assert answer(["telemetry", *words]) == 2
    assert message in capsys.readouterr().err
