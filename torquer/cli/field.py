"""`torquer field`: the field at a point, along an orbit, over the globe, as a cone."""

from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

app = App(
    name="field",
    help="The geomagnetic field at a point, along an orbit, over the globe, as a cone.",
    version_flags=[],
)

Json = Annotated[bool, Parameter(help="Print machine-readable JSON.", negative="")]
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
        "igrf14:6 stops at degree 6.",
        negative="",
    ),
]
Degree = Annotated[int | None, Parameter(help="Maximum degree of igrf14 or wmm2025 [all].")]


@app.command
def point(
    *,
    lat: Annotated[float | None, Parameter(help="Latitude [deg].")] = None,
    lon: Annotated[float | None, Parameter(help="East longitude, -180..360 [deg].")] = None,
    alt_km: Annotated[float, Parameter(help="Height [km].")] = 0.0,
    date: Annotated[
        str | None,
        Parameter(
            help="Date (00:00 UTC), time with a zone, or decimal year such as 2025.5; --points may "
            "have its own."
        ),
    ] = None,
    points: Annotated[
        Path | None,
        Parameter(
            help="CSV file of places instead of --lat and --lon: columns lat, lon, and as needed "
            "alt_km and date. Prints CSV."
        ),
    ] = None,
    model: Model = "igrf14",
    degree: Degree = None,
    extrapolate: Annotated[
        bool,
        Parameter(help="Allow dates beyond the model's validity, with a note.", negative=""),
    ] = False,
    geocentric: Annotated[
        bool,
        Parameter(
            help="Geocentric latitude, height above the sphere of radius 6371.2 km "
            "[geodetic, WGS84].",
            negative="",
        ),
    ] = False,
    json: Json = False,
) -> int:
    """X, Y, Z, H, F, D, I at a place and date, and their secular variation; or at many places."""
    from torquer.cli import field_options as options, field_work as work

    chosen = options.extrapolated(options.model_of(model, degree), extrapolate)
    if points is not None:
        if lat is not None or lon is not None:
            raise ValueError("--points: must not be given with --lat and --lon; received both")
        from torquer.cli.field_points import points as at_points

        return at_points(points, alt_km, date, chosen, geocentric, json)
    if lat is None or lon is None or date is None:
        missing = "--lat" if lat is None else "--lon" if lon is None else "--date"
        raise ValueError(f"{missing}: must be given, or --points; received nothing")
    return work.point((lat, lon, alt_km), date, chosen, geocentric, json)


@app.command
def orbit(
    *,
    altitude_km: Annotated[float | None, Parameter(help="Circular orbit: altitude [km].")] = None,
    inclination_deg: Annotated[
        float | None, Parameter(help="Circular orbit: inclination [deg].")
    ] = None,
    raan_deg: Annotated[float | None, Parameter(help="Circular orbit: RAAN [deg] [0].")] = None,
    tle: Annotated[Path | None, Parameter(help="File with a two-line element set.")] = None,
    scenario: Annotated[
        Path | None,
        Parameter(help="Scenario file with orbit, start and first field model."),
    ] = None,
    start: Annotated[
        str | None,
        Parameter(help="Start, in the formats of --date [epoch of the TLE]."),
    ] = None,
    revolutions: Annotated[float | None, Parameter(help="Duration in revolutions [1].")] = None,
    duration_min: Annotated[float | None, Parameter(help="Duration in minutes.")] = None,
    step_s: Annotated[float, Parameter(help="Time step [s].")] = 30.0,
    ut1_minus_utc_s: Annotated[
        float | None,
        Parameter(help="UT1 - UTC at the start [s] [that of the scenario, else 0]."),
    ] = None,
    model: Models = None,
    out: Annotated[Path | None, Parameter(help="Folder for inertial.png and orbital.png.")] = None,
    json: Json = False,
) -> int:
    """The field along an orbit, under one model or several side by side [igrf14]."""
    from torquer.cli import field_options as options, field_work as work

    circular = {
        "altitude_km": altitude_km, "inclination_deg": inclination_deg, "raan_deg": raan_deg
    }  # fmt: skip
    case = options.case_of(circular, tle, scenario, start)
    case = options.with_ut1(case, ut1_minus_utc_s)
    t_s = options.instants(case.orbit.period_s, revolutions, duration_min, step_s)
    return work.orbit(case, options.with_models(case, model), t_s, out, json)


@app.command(name="map")
def map_(
    *,
    date: Date = "2025-01-01",
    alt_km: Annotated[float, Parameter(help="Height above the ellipsoid [km].")] = 0.0,
    element: Annotated[str, Parameter(help="F, X, Y, Z, H, D or I.")] = "F",
    model: Model = "igrf14",
    degree: Degree = None,
    out: Annotated[Path, Parameter(help="Folder for map_<element>.png.")] = Path("runs/field"),
    json: Json = False,
) -> int:
    """A map of an element of the field over the globe, with its extremes."""
    from torquer.cli import field_options as options, field_work as work

    return work.globe(element, date, alt_km, options.model_of(model, degree), out, json)


@app.command
def cone(
    *,
    inclination_deg: Annotated[float, Parameter(help="Inclination of the circular orbit.")],
    altitude_km: Annotated[float, Parameter(help="Altitude of the circular orbit.")] = 550.0,
    raan_deg: Annotated[float, Parameter(help="RAAN of the orbit.")] = 0.0,
    date: Date = "2025-01-01",
    revolutions: Annotated[float, Parameter(help="Length of the paths in revolutions.")] = 1.0,
    model: Models = None,
    out: Annotated[Path, Parameter(help="Folder for cone.png and cone.html.")] = Path("runs/field"),
    json: Json = False,
) -> int:
    """Paths of the field vector over a circular orbit, and the cone of the averaged field."""
    from torquer.cli import field_options as options, field_work as work

    circular = {
        "altitude_km": altitude_km, "inclination_deg": inclination_deg, "raan_deg": raan_deg
    }  # fmt: skip
    case = options.case_of(circular, None, None, date, "--date")
    models = options.with_models(case, model, options.CONE_MODELS)
    t_s = options.instants(case.orbit.period_s, revolutions, None, case.orbit.period_s / 360.0)
    return work.cone(case, models, t_s, out, json)
