"""`torquer telemetry`: what flight data say about a satellite."""

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import App

from torquer.base.limits import at_least, positive
from torquer.cli.examples import examples_of
from torquer.cli.options import CodeOptions, Json, options

app = App(name="telemetry", help_epilogue=examples_of("telemetry"), version_flags=[])


@options
class TelemetryOptions:
    """Options of `torquer telemetry`."""

    orbit: Path | None = None
    """Two-line elements (of several the nearest), or a TOML file with a table [orbit], such as a
    scenario [position_j of the telemetry]."""
    mapping: Path | None = None
    """How columns become quantities [none: files of torquer]."""
    model: (
        Literal["bias", "scale", "non-orthogonality", "shift", "coils", "temperature", "all"] | None
    ) = None
    """Last part of the calibration: each holds those before it, but `temperature` no coils
    [chosen by blocks of time held out]."""
    leave_out_first_min: Annotated[float, at_least(0.0)] = 0.0
    """Minutes at the beginning that are not used."""
    clock_sigma_s: Annotated[float | None, positive()] = None
    """Error of the clock to be expected, with --along-track-sigma-km: splits the shift."""
    along_track_sigma_km: Annotated[float | None, positive()] = None
    """Error of the elements along the track to be expected; about 1 to 3 km for each day of their
    age."""
    filter: Path | None = None
    """TOML file with a table [control.estimator], such as a scenario: its Kalman filter and a
    smoother make an attitude of the calibrated readings [none]."""
    twin: Path | None = None
    """Scenario of the satellite as it is believed to be, on its orbit, with a control cycle that
    begins at its `start`: flown alongside the calibrated readings, its inertia, gain and residual
    dipole are fitted [none]."""
    out: Path | None = None
    """Output folder [runs/FILE-telemetry]."""
    json: Json = False


@app.default
def check(
    *files: Path, how: TelemetryOptions = TelemetryOptions(), code: CodeOptions = CodeOptions()
) -> int:
    """Check the magnetometer in FILES against the field along the orbit, and calibrate it.

    CSV, Parquet, NetCDF, CDF or a ground archive. The strength of the field needs no attitude: it
    finds wrong units and zones, outliers, bias, scale, non-orthogonality and a shift in time, with
    their errors. Logged quaternions are compared with field and Sun: order, sense, frame, axes.
    With --filter an attitude is estimated, forwards and in hindsight, and whether the filter's
    model fits. With --twin the same tip-off is simulated, and says what inertia and gain are;
    `torquer campaign` flies on what its errors leave open, twin.toml. Writes calibrated.nc,
    attitude.nc, twin.nc, twin.toml, report.html and pictures. Exit code 1 for telemetry that cannot
    be used as it is, and for a filter or a twin that does not fit it.
    """
    from torquer.cli.commands import telemetry_work as work

    return work.check(files, how, code)


@options
class ProposeOptions:
    """Options of `torquer telemetry init`."""

    out: Path | None = None
    """The mapping file [FILE.mapping.toml next to where you are]."""
    json: Json = False


@app.command(help_epilogue=examples_of("telemetry init"))
def init(file: Path, *, how: ProposeOptions = ProposeOptions()) -> int:
    """Propose a mapping for FILE, and say what of it is guessed."""
    from torquer.cli.commands import telemetry_work as work

    return work.propose(file, how)
