"""What the functions of `torquer.analysis.field` are asked; the options of `torquer field` are the
same.

These classes stand apart from the functions, so that the help of a command loads no compiler.
"""

from pathlib import Path
from typing import Annotated

from torquer.base.limits import Range, RequestError, positive, request, within

LATITUDE, LONGITUDE = within(-90.0, 90.0, "deg"), within(-180.0, 360.0, "deg")
#: Heights for which a model of the core field is meaningful.
HEIGHT = within(-10.0, 50_000.0, "km")
#: The elements in the order of `Elements`.
ELEMENTS = {
    "X": "north", "Y": "east", "Z": "down", "H": "horizontal", "F": "total",
    "D": "declination", "I": "inclination",
}  # fmt: skip


def element_unit(element: str) -> str:
    """Unit of an element: 'deg' or 'nT'."""
    return "deg" if element in "DI" else "nT"


@request
class FieldPointRequest:
    """What `field_point` and `field_points` are asked.

    FieldPointRequest(lat=55.75, lon=37.62, alt_km=550.0, date="2025-07-01", model="wmm2025")
    """

    lat: Annotated[float | None, LATITUDE] = None
    """Latitude [deg]."""
    lon: Annotated[float | None, LONGITUDE] = None
    """East longitude, -180..360 [deg]."""
    alt_km: Annotated[float, HEIGHT] = 0.0
    """Height [km]."""
    date: str | None = None
    """Date (00:00 UTC), time with a zone, or decimal year such as 2025.5; a file of places may have
    its own."""
    points: Path | None = None
    """CSV file of places instead of latitude and longitude: columns lat, lon, and as needed alt_km
    and date."""
    model: str = "igrf14"
    """igrf14, wmm2025, tilted_dipole or direct_dipole; igrf14:6 stops at degree 6."""
    degree: int | None = None
    """Maximum degree of igrf14 or wmm2025 [all]."""
    extrapolate: bool = False
    """Allow dates beyond the model's validity, with a note."""
    geocentric: bool = False
    """Geocentric latitude, height above the sphere of radius 6371.2 km [geodetic, WGS84]."""


@request
class FieldMapRequest:
    """What `field_map` is asked.

    FieldMapRequest(element="Z", date="2025-07-01", alt_km=500.0)
    """

    date: str = "2025-01-01"
    """Date (00:00 UTC), time with a zone, or decimal year such as 2025.5."""
    alt_km: Annotated[float, HEIGHT] = 0.0
    """Height above the ellipsoid [km]."""
    element: str = "F"
    """F, X, Y, Z, H, D or I."""
    model: str = "igrf14"
    """igrf14, wmm2025, tilted_dipole or direct_dipole; igrf14:6 stops at degree 6."""
    degree: int | None = None
    """Maximum degree of igrf14 or wmm2025 [all]."""

    def __post_init__(self):
        if self.element not in ELEMENTS:
            must = f"must be one of {', '.join(ELEMENTS)}; received {self.element!r}"
            raise RequestError("element", must)


@request
class FieldOrbitRequest:
    """What `field_orbit` is asked: a circular orbit, an element set, or no orbit where a scenario
    has it.

    FieldOrbitRequest(altitude_km=550.0, inclination_deg=97.6, start="2025-07-01",
                      model=["igrf14", "tilted_dipole"])
    """

    altitude_km: float | None = None
    """Circular orbit: altitude [km]."""
    inclination_deg: float | None = None
    """Circular orbit: inclination [deg]."""
    raan_deg: float | None = None
    """Circular orbit: RAAN [deg] [0]."""
    tle: Path | None = None
    """File with a two-line element set."""
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
    model: list[str] | None = None
    """Repeatable: igrf14, wmm2025, tilted_dipole, direct_dipole, averaged; igrf14:6 stops at
    degree 6."""


@request
class FieldConeRequest:
    """What `field_cone` is asked.

    FieldConeRequest(inclination_deg=51.6, altitude_km=500.0, model=["igrf14", "averaged"])
    """

    inclination_deg: float
    """Inclination of the circular orbit [deg]."""
    altitude_km: float = 550.0
    """Altitude of the circular orbit [km]."""
    raan_deg: float = 0.0
    """RAAN of the orbit [deg]."""
    date: str = "2025-01-01"
    """Date (00:00 UTC), time with a zone, or decimal year such as 2025.5."""
    revolutions: Annotated[
        float, Range("lie within 0..500, 0 left out", lambda count: 0.0 < count <= 500.0)
    ] = 1.0
    """Length of the paths in revolutions."""
    model: list[str] | None = None
    """Repeatable: igrf14, wmm2025, tilted_dipole, direct_dipole, averaged; igrf14:6 stops at
    degree 6."""
