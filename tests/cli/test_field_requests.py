"""The field from Python: the numbers of `--json`, units, notebooks, mistakes named by their key."""

import numpy as np
import pytest

from torquer.analysis.field import (
    FieldConeRequest,
    FieldMapRequest,
    FieldOrbitRequest,
    FieldPointRequest,
    extremes,
    field_cone,
    field_map,
    field_orbit,
    field_point,
    field_points,
)
from torquer.base.limits import RequestError

CIRCLE = {"altitude_km": 550.0, "inclination_deg": 51.7, "start": "2025-07-01"}


def test_a_point_is_what_the_command_prints(call, strict_json):
    words = ("--lat", "55.75", "--lon", "37.62", "--date", "2025-07-01")
    found = field_point(FieldPointRequest(lat=55.75, lon=37.62, date="2025-07-01"))
    assert found.data() == strict_json(call("field", "point", *words, "--json")[1])
    assert found.lines() == call("field", "point", *words)[1].splitlines()
    table = found._repr_html_()
    assert table.count("<td>D declination</td>") == 1 and found.rates[6].unit == "deg/yr"


def test_places_of_a_file_have_units_and_dates(tmp_path):
    path = tmp_path / "places.csv"
    path.write_text("lat,lon,date\n55.75,37.62,2025-07-01\n-33,200,1999.5\n")
    found = field_points(FieldPointRequest(points=path))
    one = field_point(FieldPointRequest(lat=-33.0, lon=200.0, date="1999.5"))
    values = {f"{row.label[0]}": row.value for row in one.elements}
    assert {name: float(found[name][1]) for name in values} == values
    assert found["D"].attrs["units"] == "deg" and found["Z_per_year"].attrs["units"] == "nT/yr"
    assert found["date"].values[1] == np.datetime64("1999-07-02T12:00")


def test_a_map_holds_all_elements_and_its_extremes(call, strict_json):
    asked = FieldMapRequest(model="tilted_dipole", alt_km=500.0, element="Z")
    grid = field_map(asked)
    words = ("--model", "tilted_dipole", "--alt-km", "500", "--element", "Z", "--json")
    answer = strict_json(call("field", "map", *words)[1])
    assert extremes(grid) == {key: answer[key] for key in ("least", "greatest")}
    assert grid["H"].dims == ("lat", "lon") and grid["H"].attrs["units"] == "nT"


def test_fields_along_an_orbit_are_those_of_the_command(call, strict_json):
    found = field_orbit(FieldOrbitRequest(**CIRCLE, step_s=300.0, model=["averaged"]))
    words = ("--altitude-km", "550", "--inclination-deg", "51.7", "--start", "2025-07-01")
    more = ("--step-s", "300", "--model", "averaged", "--json")
    (answer,) = strict_json(call("field", "orbit", *words, *more)[1])["fields"]
    assert np.round(1e9 * found["b_orbital"][0], 4).values.tolist() == answer["b_orbital_nt"]
    assert found["b_orbital"].attrs == {"units": "T", "frame": "X"}


def test_the_cone_stands_beside_its_paths():
    found = field_cone(FieldConeRequest(inclination_deg=51.7, model=["averaged", "igrf14:1"]))
    off = found["off_cone"].max("time")
    assert float(off.sel(model="averaged")) < 1e-9 < 1.0 < float(off.sel(model="igrf14:1"))
    assert found.attrs["half_angle_deg"] == pytest.approx(60.0761, abs=1e-4)


@pytest.mark.parametrize(
    ("ask", "says"),
    [
        (lambda: FieldPointRequest(lat=91.0), "lat: must lie within -90..90 deg; received 91"),
        (lambda: field_point(FieldPointRequest(lat=1.0)),
         "lon: must be given, or points; received nothing"),
        (lambda: FieldMapRequest(element="Q"), "element: must be one of X, Y, Z, H, F, D, I; "),
        (lambda: field_map(FieldMapRequest(date="2031")),
         "date: field model igrf14: date must lie within 1900.0..2030.0; received 2031"),
        (lambda: FieldOrbitRequest(step_s=0.0), "step_s: must be a positive number; received 0"),
        (lambda: field_orbit(FieldOrbitRequest(altitude_km=500.0)),
         "inclination_deg: must be given; received nothing"),
        (lambda: field_orbit(FieldOrbitRequest()),
         "orbit: must be given by altitude_km and inclination_deg, by tle or by scenario; "
         "received none of them"),
        (lambda: field_orbit(FieldOrbitRequest(**CIRCLE | {"altitude_km": -3.0})),
         "altitude_km: must be greater than 0; received -3"),
    ],
)  # fmt: skip
def test_a_mistake_names_its_key(ask, says):
    with pytest.raises(RequestError) as error:
        ask()
    assert str(error.value).startswith(says)
