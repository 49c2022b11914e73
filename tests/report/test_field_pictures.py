"""Pictures of the field: written, not blank, and the numbers in them are right."""

import json
import re

import matplotlib.image
import numpy as np
import pytest
from unpacking import unpacked

from torquer.analysis.field.cone import averaged_cone, with_cone
from torquer.analysis.field.globe import dip_poles, elements_on_grid, extremes
from torquer.analysis.field.orbit import OrbitCase, field_dataset
from torquer.base.time import parse_utc
from torquer.environment.field import Averaged, DirectDipole, Igrf14, TiltedDipole
from torquer.environment.field.along import angles_deg
from torquer.environment.orbit import Circular
from torquer.report.common.html import PACKED
from torquer.report.common.scales import split_where_wrapped
from torquer.report.field.along import draw_along
from torquer.report.field.cone import cone_figure, draw_cone, write_cone_page
from torquer.report.field.map import draw_map

START = parse_utc("2025-07-01T00:00:00Z")
MODELS = (Igrf14(degree=3), DirectDipole(), TiltedDipole(), Averaged())
LABELS = ["igrf14:3", "direct_dipole", "tilted_dipole", "averaged"]


@pytest.fixture(scope="module")
def orbit():
    return Circular(altitude_km=550.0, inclination_deg=51.7, raan_deg=77.0)


def fields_on(orbit, models=MODELS, count=181, name="550 km, $51.7"):
    case = OrbitCase(orbit, START, "sidereal", name=name)
    return field_dataset(models, case, np.linspace(0.0, orbit.period_s, count), "start")


@pytest.fixture(scope="module")
def along(orbit):
    return fields_on(orbit)


@pytest.fixture(scope="module")
def paths(along, orbit):
    return with_cone(along, averaged_cone(orbit))


def grid_of(model, alt_km=0.0, step_deg=5.0):
    grid = elements_on_grid(model, 2025.0, alt_km, step_deg)
    return grid.assign_attrs(title="a title", element="F")


@pytest.fixture(scope="module")
def grid():
    return grid_of(Igrf14(degree=6))


def inked(path):
    """Share of the pixels that are not white; a blank picture has none."""
    pixels = matplotlib.image.imread(path)[..., :3]
    return float(np.mean(np.any(pixels < 0.98, axis=-1)))


def colours_in(path, *colours):
    """Whether every colour (#rrggbb) has pixels of its own."""
    pixels = np.round(255 * matplotlib.image.imread(path)[..., :3]).astype(int)
    wanted = [[int(c[i : i + 2], 16) for i in (1, 3, 5)] for c in colours]
    return all(np.any(np.abs(pixels - colour).max(axis=-1) <= 2) for colour in wanted)


def test_pictures_along_an_orbit(along, tmp_path):
    paths = draw_along(along, tmp_path)
    assert set(paths) == {"inertial", "orbital"}
    for path in paths.values():
        assert 0.02 < inked(path) < 0.5
        assert colours_in(path, "#0072B2", "#D55E00", "#009E73", "#E69F00")


def test_one_model_has_no_panel_of_angles(orbit, tmp_path):
    path = draw_along(fields_on(orbit, MODELS[:1], 5), tmp_path)["inertial"]
    # head, four panels of 1.51 inch, foot
    assert matplotlib.image.imread(path).shape[0] == pytest.approx(150 * (1.12 + 4 * 1.51), abs=2)


def test_line_across_the_angle_seam_breaks_at_the_edge():
    x, y = split_where_wrapped([340.0, 350.0, 10.0, 20.0], [1.0, 2.0, 4.0, 5.0], low=0.0)
    assert x == pytest.approx([340, 350, 360, np.nan, 0, 10, 20], nan_ok=True)
    assert y == pytest.approx([1, 2, 3, np.nan, 3, 4, 5], nan_ok=True)
    back, _ = split_where_wrapped([10.0, 350.0], [0.0, 2.0], low=0.0)
    assert back == pytest.approx([10, 0, np.nan, 360, 350], nan_ok=True)
    assert split_where_wrapped([1.0, 2.0], [3.0, 4.0], low=0.0)[0].tolist() == [1.0, 2.0]


@pytest.mark.parametrize("element", list("FXYZHDI"))
def test_every_element_has_a_map(grid, element, tmp_path):
    path = draw_map(grid, element, tmp_path / f"{element}.png")
    assert inked(path) > 0.5
    assert colours_in(path, "#b03a2e")


def test_maps_of_models_without_a_turn_can_be_drawn(tmp_path):
    dipole = grid_of(DirectDipole(), 500.0, 10.0)
    for element in "DY":
        assert inked(draw_map(dipole, element, tmp_path / "map.png")) > 0.3


def test_map_shows_the_south_atlantic_anomaly_and_the_dip_poles():
    grid = grid_of(Igrf14(degree=8))
    least = extremes(grid)["least"]
    assert least["latitude_deg"] == pytest.approx(-26.0, abs=5.0)
    assert least["longitude_deg"] == pytest.approx(-59.0, abs=6.0)
    assert least["value"] == pytest.approx(22060.0, rel=0.01)
    north, south = dip_poles(grid)
    assert north[0] == pytest.approx(86.0, abs=5.0)
    assert south == (pytest.approx(-64.0, abs=5.0), pytest.approx(136.0, abs=10.0))
    values = grid["I"].values
    assert values.shape == (37, 73)
    assert grid["I"].attrs["units"] == "deg" and grid["F"].attrs["units"] == "nT"
    assert values[:, 0] == pytest.approx(values[:, -1])


def test_the_cone_is_that_of_the_averaged_field(along, orbit):
    shape = averaged_cone(orbit)
    b = along["b_y"].sel(model="averaged").values
    assert np.linalg.norm(b, axis=-1) == pytest.approx(shape.b0_t, rel=1e-12)
    assert angles_deg(b, shape.axis_y) == pytest.approx(shape.half_angle_deg, rel=1e-12)
    rim = shape.rim_ut()
    assert np.linalg.norm(rim, axis=1) == pytest.approx(1e6 * shape.b0_t)
    assert angles_deg(rim, shape.axis_y) == pytest.approx(shape.half_angle_deg)
    assert shape.y_from_z.T @ shape.y_from_z == pytest.approx(np.eye(3), abs=1e-15)


def test_direct_dipole_strays_about_a_degree_from_the_cone(paths):
    """The greatest deviation over all inclinations lies near 52 deg."""
    off = paths["off_cone"].sel(model="direct_dipole").max()
    assert float(off) == pytest.approx(1.09, abs=0.01)


@pytest.mark.parametrize("inclination_deg", [0.0, 51.7, 90.0, 180.0])
def test_cones_of_every_inclination_are_drawn(inclination_deg, tmp_path):
    orbit = Circular(altitude_km=550.0, inclination_deg=inclination_deg)
    paths = with_cone(fields_on(orbit, count=61), averaged_cone(orbit))
    path = draw_cone(paths, tmp_path / "cone.png")
    assert 0.02 < inked(path) < 0.6
    assert colours_in(path, "#0072B2")


def test_the_page_is_whole_and_loads_nothing(paths, tmp_path):
    titled = paths.assign_attrs(title="<b>5 & 6</b>")
    path = write_cone_page(titled, tmp_path / "cone.html")
    text = path.read_text(encoding="utf-8")
    assert "default-src 'none'" in text and "&lt;b&gt;5 &amp; 6&lt;/b&gt;" in text
    assert "<b>5" not in text
    assert not re.search(r'<(script|link|img)[^>]+(src|href)="http', text)
    assert text.rstrip().endswith("</html>") and 'id="plotly">H4sI' in text
    (figure,) = re.findall(rf'<script type="{PACKED}">(.*?)</script>', text)
    assert json.loads(unpacked(figure)) == json.loads(json.dumps(cone_figure(paths)))


def test_the_figure_in_space_holds_the_vectors(paths):
    figure = cone_figure(paths)
    lines = {trace["name"]: trace for trace in figure["data"] if "hovertemplate" in trace}
    assert list(lines) == LABELS
    for m, name in enumerate(LABELS):
        drawn = np.array([lines[name][axis] for axis in "xyz"]).T
        assert drawn == pytest.approx(1e6 * paths["b_y"].values[m], abs=6e-4)
    assert lines["averaged"]["customdata"][45] == pytest.approx(90.0, abs=0.05)
    assert {trace["type"] for trace in figure["data"]} == {"mesh3d", "scatter3d"}
    assert figure["frames"] == []
