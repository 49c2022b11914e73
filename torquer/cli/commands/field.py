"""`torquer field`: the field at a point, along an orbit, over the globe, as a cone."""

from pathlib import Path
from typing import Annotated

from torquer.analysis.field.requests import (
    FieldConeRequest,
    FieldMapRequest,
    FieldOrbitRequest,
    FieldPointRequest,
)
from torquer.base.strict_json import json_text
from torquer.cli.loading import load_given
from torquer.cli.options import FLAT, Json, options
from torquer.cli.output import make_writable, print_answer, say, writing_to


@options
class MapOptions:
    """Where the map goes."""

    out: Path = Path("runs/field")
    """Folder for map_<element>.png."""
    json: Json = False


@options
class OrbitOptions:
    """The scenario, and where the pictures go."""

    scenario: Path | None = None
    """Scenario file with orbit, start and first field model."""
    out: Path | None = None
    """Folder for inertial.png and orbital.png."""
    json: Json = False


@options
class ConeOptions:
    """Where the picture and the page go."""

    out: Path = Path("runs/field")
    """Folder for cone.png and cone.html."""
    json: Json = False


def point(
    *, how: Annotated[FieldPointRequest, FLAT] = FieldPointRequest(), json: Json = False
) -> int:
    """X, Y, Z, H, F, D, I at a place and date, and their secular variation; or at many places.

    With --points it prints CSV.
    """
    from torquer.analysis.field.point import field_point, field_points

    if how.points is None:
        return print_answer(field_point(how), json)
    from torquer.analysis.field.answers import places_csv, places_data

    places = field_points(how)
    print(json_text(places_data(places)) + "\n" if json else places_csv(places), end="")
    return 0


def map_(
    *, how: Annotated[FieldMapRequest, FLAT] = FieldMapRequest(), to: MapOptions = MapOptions()
) -> int:
    """A map of an element of the field over the globe, with its extremes."""
    from torquer.analysis.field.answers import map_data, map_lines
    from torquer.analysis.field.globe import field_map
    from torquer.report.field.map import draw_map

    grid = field_map(how)
    make_writable(to.out)
    with writing_to(to.out):
        path = draw_map(grid, how.element, to.out / f"map_{how.element}.png")
    if to.json:
        print(json_text({**map_data(grid), "picture": str(path)}))
    else:
        say(*map_lines(grid), path)
    return 0


def orbit(
    *,
    how: Annotated[FieldOrbitRequest, FLAT] = FieldOrbitRequest(),
    to: OrbitOptions = OrbitOptions(),
) -> int:
    """The field along an orbit, under one model or several side by side [igrf14]."""
    from torquer.analysis.field.answers import orbit_data, orbit_lines
    from torquer.analysis.field.orbit import field_orbit

    along = field_orbit(how, load_given(to.scenario))
    if to.out is not None:
        from torquer.report.field.along import draw_along

        make_writable(to.out)
        with writing_to(to.out):
            files = draw_along(along, to.out)
    if to.json:
        written = {} if to.out is None else {"files": [str(file) for file in files.values()]}
        print(json_text(orbit_data(along) | written, None))
        return 0
    say(*orbit_lines(along))
    if to.out is not None:
        say(f"\n{to.out}: inertial.png, orbital.png")
    return 0


def cone(*, how: Annotated[FieldConeRequest, FLAT], to: ConeOptions = ConeOptions()) -> int:
    """Paths of the field vector over a circular orbit, and the cone of the averaged field."""
    from torquer.analysis.field.answers import cone_data, cone_lines
    from torquer.analysis.field.cone import field_cone
    from torquer.report.field.cone import draw_cone, write_cone_page

    paths = field_cone(how)
    make_writable(to.out)
    files = [to.out / "cone.png", to.out / "cone.html"]
    with writing_to(to.out):
        draw_cone(paths, files[0])
        write_cone_page(paths, files[1])
    if to.json:
        print(json_text(cone_data(paths) | {"files": [str(file) for file in files]}))
    else:
        say(*cone_lines(paths), f"{to.out}: cone.png, cone.html")
    return 0
