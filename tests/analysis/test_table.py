"""Results as tables: columns, times, units, files, and sizes that are refused."""

import re

import numpy as np
import pandas
import pytest
import xarray as xr
from artificial_campaign import artificial

import torquer
from torquer.analysis import table
from torquer.analysis.derived import derive
from torquer.cli.answer import answer

SCENARIO = {
    "name": "short",
    "start": "2020-03-01T00:00:00Z",
    "orbit": {"kind": "circular", "altitude_km": 500, "inclination_deg": 51.6},
    "spacecraft": {"body": {"inertia_kg_m2": [1.0, 1.2, 1.5]}, "coils": {"limit_a_m2": 3.0}},
    "initial": {"rate_deg_s": [6.0, -4.0, 5.0]},
    "control": {"law": {"kind": "bdot", "gain_a_m2_s_per_t": 2e6}, "sample_s": 2.0},
    "simulation": {"duration_s": 120.0, "step_s": 0.5, "record_s": 2.0},
}


@pytest.fixture(scope="module")
def result():
    return torquer.simulate(torquer.Scenario.model_validate(SCENARIO))


@pytest.fixture
def folder(result, tmp_path):
    torquer.save(result, tmp_path / "result.nc")
    return tmp_path


def test_vectors_have_a_column_for_each_component(result):
    frame = torquer.to_dataframe(result, ["omega_body", "altitude"])
    assert [*frame.columns] == ["omega_body_x", "omega_body_y", "omega_body_z", "altitude"]
    assert np.array_equal(frame.to_numpy()[:, :3], result["omega_body"].values)
    assert frame.index.name == "time_s" and np.array_equal(frame.index, result["time"])
    assert frame.attrs["units"] == {
        "omega_body_x": "rad/s", "omega_body_y": "rad/s", "omega_body_z": "rad/s", "altitude": "m"
    }  # fmt: skip


def test_derived_quantities_are_variables(result):
    frame = torquer.to_dataframe(result, ["rate", "sun_angle"], every_s=20.0)
    expected = derive(result).sel(time=frame.index.values)
    assert np.array_equal(frame["rate"], expected["rate"])
    assert np.array_equal(frame["sun_angle_y"], expected["sun_angle"].sel(axis="y"))


def test_all_is_all_that_changes_over_time(result):
    frame = torquer.to_dataframe(result)
    names = {re.sub("_[xyzw]$", "", column) for column in frame.columns}
    assert names == {n for n, v in result.variables.items() if v.dims[:1] == ("time",)} - {"time"}
    assert len(frame) == result.sizes["time"]


@pytest.mark.parametrize(
    ("every_s", "times"),
    [(2.0, np.arange(0.0, 121.0, 2.0)), (40.0, [0.0, 40.0, 80.0, 120.0]),
     (30.9, [0.0, 30.0, 62.0, 92.0]), (1000.0, [0.0])],
)  # fmt: skip
def test_rows_are_the_records_nearest_to_the_times(result, every_s, times):
    frame = torquer.to_dataframe(result, ["altitude"], every_s)
    assert [*frame.index] == [*times]


@pytest.mark.parametrize("every_s", [0.0, -2.0, 1.0, float("nan"), float("inf")])
def test_times_closer_than_the_records_are_refused(result, every_s):
    with pytest.raises(ValueError, match=r"every_s: must be at least .* 2 s; received"):
        torquer.to_dataframe(result, ["altitude"], every_s)


def test_unknown_names_get_a_hint(result):
    with pytest.raises(ValueError, match=r"variables: must .*did you mean omega_body.*omega_bdy"):
        torquer.to_dataframe(result, ["omega_bdy"])


def test_a_table_of_469_gib_is_refused_before_it_is_read():
    """As xarray's own `to_dataframe` asks for: the product of all dimensions."""
    values = np.broadcast_to(np.zeros(()), (1000, 62_947_000))
    large = xr.Dataset({"b_body": (("time", "axis"), values)}, {"time": np.arange(1000.0)})
    words = r"at most 2 GiB; received 469 GiB in 1000 rows, of which b_body 469 GiB: choose"
    with pytest.raises(ValueError, match=words):
        torquer.to_dataframe(large)


def test_sizes_of_the_greatest_variables_are_told(result, monkeypatch):
    monkeypatch.setattr(table, "MOST_BYTES", 1 << 12)
    assert len(torquer.to_dataframe(result, ["altitude"])) == 61
    with pytest.raises(ValueError, match=r"of which q_body_to_inertial .* MiB, .*, or every_s$"):
        torquer.to_dataframe(result)
    assert len(torquer.to_dataframe(result, every_s=120.0)) == 2


def test_csv_has_units_in_its_head(result, tmp_path):
    path = torquer.write_table(result, tmp_path / "a.csv", ["omega_body", "utc"], 40.0)
    assert path.read_text().splitlines()[0] == (
        "time_s,omega_body_x [rad/s],omega_body_y [rad/s],omega_body_z [rad/s],utc"
    )
    back = pandas.read_csv(path, index_col="time_s", parse_dates=["utc"])
    assert np.array_equal(back["omega_body_x [rad/s]"], result["omega_body"].values[::20, 0])
    assert (back["utc"].values == result["utc"].values[::20]).all()


def test_parquet_has_units_beside_its_columns(result, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    path = torquer.write_table(result, tmp_path / "a.parquet", ["omega_body", "altitude", "utc"])
    back = parquet.read_table(path)
    assert back.column_names[0] == "time_s" and back.num_rows == result.sizes["time"]
    assert back.schema.field("altitude").metadata == {b"units": b"m"}
    assert np.array_equal(back["omega_body_z"].to_numpy(), result["omega_body"].values[:, 2])


def test_another_ending_is_refused(result, tmp_path):
    with pytest.raises(ValueError, match=r"path: must end with \.csv or \.parquet; received"):
        torquer.write_table(result, tmp_path / "a.xlsx")


def test_a_campaign_has_a_row_for_each_member():
    result = artificial(5)
    frame = torquer.to_dataframe(result)
    assert len(frame) == 5 and frame.index.name == "member"
    assert "initial.rate_deg_s_2" in frame and not any("series" in name for name in frame)
    with pytest.raises(ValueError, match="every_s: must be left out for a campaign; received 5"):
        torquer.to_dataframe(result, every_s=5.0)


def test_the_method_of_a_result_is_the_function(result):
    frame = result.torquer.to_dataframe(["altitude"], every_s=40.0)
    assert frame.equals(torquer.to_dataframe(result, ["altitude"], 40.0))


def test_the_command_prints_csv(folder, capsys):
    given = ["table", str(folder), "--variables", "rate", "--variables", "altitude"]
    assert answer([*given, "--every-s", "60"]) == 0
    head, *rows = capsys.readouterr().out.splitlines()
    assert head == "time_s,rate [deg/s],altitude [m]" and len(rows) == 3


def test_the_command_writes_a_file(folder, capsys):
    out = folder / "table.csv"
    assert answer(["table", str(folder / "result.nc"), "--out", str(out)]) == 0
    assert capsys.readouterr().out == f"{out}\n" and len(out.read_text().splitlines()) == 62


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (["--variables", "nothing"], "--variables: must be among those of the result"),
        (["--every-s", "0.1"], "--every-s: must be at least the time between records, 2 s"),
        (["--out", "table.xlsx"], "--out: must end with .csv or .parquet; received table.xlsx"),
    ],
)
def test_the_command_names_its_options(folder, capsys, given, words):
    assert answer(["table", str(folder), *given]) == 2
    assert capsys.readouterr().err.startswith(f"error: {words}")


def test_what_is_no_result(tmp_path, capsys):
    assert answer(["table", str(tmp_path)]) == 2
    error = capsys.readouterr().err
    assert error.startswith("error: RESULT: must hold result.nc or campaign.nc; received")
