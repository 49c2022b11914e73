"""`torquer field`: the field at a point, along an orbit, over the globe, as a cone."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from torquer.base.limits import positive, within
from torquer.cli.options import Json, options

LATITUDE, LONGITUDE = within(-90.0, 90.0, "deg"), within(-180.0, 360.0, "deg")
#: Heights for which a model of the core field is meaningful.
HEIGHT = within(-10.0, 50_000.0, "km")
Date = Annotated[
    str, Parameter(help="Date (00:00 UTC), time with a zone, or decimal year such as 2025.5.")
]
Model = Annotated[
    str,
    Parameter(help="igrf14, wmm2025, tilted_dipole or direct_dipole; igrf14:6 stops at degree 6."),
]
Models = Annotated[
    list[str] | None,
    Parameter(
        help="Repeatable: igrf14, wmm2025, tilted_dipole, direct_dipole, averaged; "
        "igrf14:6 stops at degree 6."
    ),
]
Degree = Annotated[int | None, Parameter(help="Maximum degree of igrf14 or wmm2025 [all].")]


@options
class PointOptions:
    """Options of `torquer field point`."""

    lat: Annotated[float | None, LATITUDE] = None
    """Latitude [deg]."""
    lon: Annotated[float | None, LONGITUDE] = None
    """East longitude, -180..360 [deg]."""
    alt_km: Annotated[float, HEIGHT] = 0.0
    """Height [km]."""
    date: str | None = None
    """Date (00:00 UTC), time with a zone, or decimal year such as 2025.5; --points may have its
    own."""
    points: Path | None = None
    """CSV file of places instead of --lat and --lon: columns lat, lon, and as needed alt_km and
    date. Prints CSV."""
    model: Model = "igrf14"
    degree: Degree = None
    extrapolate: bool = False
    """Allow dates beyond the model's validity, with a note."""
    geocentric: bool = False
    """Geocentric latitude, height above the sphere of radius 6371.2 km [geodetic, WGS84]."""
    json: Json = False


@options
class MapOptions:
    """Options of `torquer field map`."""

    date: Date = "2025-01-01"
    alt_km: Annotated[float, HEIGHT] = 0.0
    """Height above the ellipsoid [km]."""
    element: str = "F"
    """F, X, Y, Z, H, D or I."""
    model: Model = "igrf14"
    degree: Degree = None
    out: Path = Path("runs/field")
    """Folder for map_<element>.png."""
    json: Json = False


@options
class OrbitOptions:
    """Options of `torquer field orbit`."""

    altitude_km: float | None = None
    """Circular orbit: altitude [km]."""
    inclination_deg: float | None = None
    """Circular orbit: inclination [deg]."""
    raan_deg: float | None = None
    """Circular orbit: RAAN [deg] [0]."""
    tle: Path | None = None
    """File with a two-line element set."""
    scenario: Path | None = None
    """Scenario file with orbit, start and first field model."""
    start: str | None = None
    """Start: date (00:00 UTC), time with a zone, or decimal year such as 2025.5 [epoch of the
    TLE]."""
    revolutions: Annotated[float | None, positive()] = None
    """Duration in revolutions [1]."""
    duration_min: Annotated[float | None, positive()] = None
    """Duration in minutes."""
    step_s: Annotated[float, positive()] = 30.0
    """Time step [s]."""
    ut1_minus_utc_s: Annotated[float | None, within(-0.9, 0.9)] = None
    """UT1 - UTC at the start [s] [that of the scenario, else 0]."""
    model: Models = None
    out: Path | None = None
    """Folder for inertial.png and orbital.png."""
    json: Json = False


@options
class ConeOptions:
    """Options of `torquer field cone`."""

    inclination_deg: float
    """Inclination of the circular orbit [deg]."""
    altitude_km: float = 550.0
    """Altitude of the circular orbit [km]."""
    raan_deg: float = 0.0
    """RAAN of the orbit [deg]."""
    date: Date = "2025-01-01"
    revolutions: Annotated[float, positive()] = 1.0
    """Length of the paths in revolutions."""
    model: Models = None
    out: Path = Path("runs/field")
    """Folder for cone.png and cone.html."""
    json: Json = False


def point(*, how: PointOptions = PointOptions()) -> int:
    """X, Y, Z, H, F, D, I at a place and date, and their secular variation; or at many places."""
    from torquer.cli.commands import field_at as work

    return work.points(how.points, how) if how.points else work.point(how)


def orbit(*, how: OrbitOptions = OrbitOptions()) -> int:
    """The field along an orbit, under one model or several side by side [igrf14]."""
    from torquer.cli.commands import field_along as work

    return work.orbit(how)


def map_(*, how: MapOptions = MapOptions()) -> int:
    """A map of an element of the field over the globe, with its extremes."""
    from torquer.cli.commands import field_at as work

    return work.globe(how)


def cone(*, how: ConeOptions) -> int:
    """Paths of the field vector over a circular orbit, and the cone of the averaged field."""
    from torquer.cli.commands import field_along as work

    return work.cone(how)
