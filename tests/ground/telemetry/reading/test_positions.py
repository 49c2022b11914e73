"""Positions in other forms, and a place on the ground, become positions in J."""

from datetime import timedelta

import numpy as np
import pytest
from telemetry_session import BIAS, SHIFT_S, START, environment, session

from torquer.ground.telemetry.examine import examine
from torquer.ground.telemetry.modulus import environment_along
from torquer.ground.telemetry.reading.mapping import make_mapping
from torquer.ground.telemetry.reading.read import read
from torquer.maths.geometry.frames import geodetic_from_ecef

T_S = 31.0 * np.arange(20)


def written(tmp_path, names, rows):
    start = np.datetime64("2012-03-04T10:31:47", "ms")
    lines = [",".join(["t", *names, "x", "y", "z"])]
    for t_s, row in zip(T_S, rows, strict=True):
        stamp = f"{start + np.timedelta64(round(1e3 * t_s), 'ms')}Z"
        lines.append(",".join([stamp, *(f"{each:.9f}" for each in row), "1", "2", "3"]))
    path = tmp_path / "a.csv"
    path.write_text("\n".join(lines))
    return path


def mapping(columns, units, **keys):
    return make_mapping(
        {
            "time": "t",
            "columns": {"b_measured": ["x", "y", "z"]} | columns,
            "units": {"b_measured": "nT"} | units,
        }
        | keys
    )


def forms():
    """Position of Chibis-M in J, Earth-fixed, in TEME; m."""
    along = environment()
    r, _ = along.state(T_S)
    teme, _ = along.orbit.state(T_S, along.start, 0.0)
    return r, np.einsum("nij,nj->ni", along.dcm_to_ecef(T_S), r), teme


@pytest.mark.parametrize(("unit", "factor"), [("m", 1.0), ("km", 1e3)])
@pytest.mark.parametrize(("name", "form"), [("position_ecef", 1), ("position_teme", 2)])
def test_cartesian_forms(tmp_path, name, form, unit, factor):
    path = written(tmp_path, ("a", "b", "c"), forms()[form] / factor)
    found = read(path, mapping({name: ["a", "b", "c"]}, {name: unit})).data
    np.testing.assert_allclose(found["position_j"], forms()[0], rtol=0, atol=1e-3)
    assert name not in found


@pytest.mark.parametrize(("unit", "factor"), [("m", 1.0), ("km", 1e3)])
def test_latitude_longitude_and_height(tmp_path, unit, factor):
    lat, lon, height = geodetic_from_ecef(forms()[1])
    rows = np.stack([np.degrees(lat), np.degrees(lon), height / factor], axis=1)
    path = written(tmp_path, ("lat", "lon", "alt"), rows)
    given = mapping({"position_geodetic": ["lat", "lon", "alt"]}, {"position_geodetic": unit})
    np.testing.assert_allclose(read(path, given).data["position_j"], forms()[0], atol=1e-2)


def test_a_place_on_the_ground_turns_with_the_earth(tmp_path):
    """Its Earth-fixed position rests: on the equator the radius is the Earth's."""
    path = written(tmp_path, (), np.empty((len(T_S), 0)))
    r = read(path, mapping({}, {}, place=[0.0, 30.0, 100.0])).data["position_j"].values
    np.testing.assert_allclose(np.linalg.norm(r, axis=1), 6378237.0, atol=1e-6)
    fixed = np.einsum("nij,nj->ni", environment().dcm_to_ecef(T_S), r)
    expected = 6378237.0 * np.array([np.cos(np.pi / 6), 0.5, 0.0])
    np.testing.assert_allclose(fixed, np.tile(expected, (len(T_S), 1)), atol=1e-6)
    turned = np.degrees(np.arccos(r[0] @ r[-1] / 6378237.0**2))
    assert turned == pytest.approx(T_S[-1] * 360.0 / 86164.1, rel=1e-6)


def test_the_field_at_a_place_has_one_strength(tmp_path):
    path = written(tmp_path, (), np.empty((len(T_S), 0)))
    data = read(path, mapping({}, {}, place=[55.75, 37.6, 150.0])).data
    r = data["position_j"].values
    strength = np.linalg.norm(environment_along(data, None).field(T_S, r, r), axis=1)
    assert strength == pytest.approx(52.5e-6, rel=0.01) and np.ptp(strength) < 1e-9


def test_a_magnetometer_is_calibrated_by_positions_of_the_telemetry_without_an_orbit(tmp_path):
    data, _ = session(0)
    t_s, along = data["time"].values, environment()
    r = along.state(t_s + SHIFT_S)[0]
    fixed = np.einsum("nij,nj->ni", along.dcm_to_ecef(t_s), r)
    rows = zip(t_s, 1e9 * data["b_measured"].values, fixed, strict=True)
    text = [",".join([iso(t), *(f"{x:.1f}" for x in (*m, *place))]) for t, m, place in rows]
    path = tmp_path / "a.csv"
    path.write_text("\n".join(["t,x,y,z,a,b,c", *text]))
    found = examine(read(path, mapping({"position_ecef": ["a", "b", "c"]}, {"position_ecef": "m"})))
    assert found.mistakes == () and found.calibration is not None
    np.testing.assert_allclose(1e9 * found.calibration.bias, 1e9 * BIAS, atol=100.0)


def iso(t_s):
    return (START + timedelta(seconds=float(t_s))).strftime("%Y-%m-%dT%H:%M:%SZ")


def test_one_form_only():
    columns = {"position_ecef": ["a", "b", "c"]}
    with pytest.raises(ValueError, match=r"position_ecef: must be the only form .* also place"):
        mapping(columns, {"position_ecef": "m"}, place=[0.0, 0.0, 0.0])
