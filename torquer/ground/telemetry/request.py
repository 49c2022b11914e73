"""What `torquer telemetry` is asked, by a caller in Python or on the command line."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Literal

from torquer.base.limits import RequestError, at_least, positive, request

#: Age of elements [days] up to which they are taken, unless another is asked for.
MOST_AGE_DAYS = 30.0
Model = Literal[
    "bias", "scale", "non-orthogonality", "shift", "coils", "temperature", "all", "attitude"
]


@request
class TelemetryRequest:
    """What `torquer.ground.telemetry.check` is asked.

    TelemetryRequest(orbit=Path("my_satellite.tle"), model="shift")
    """

    orbit: Path | None = None
    """Elements of one satellite in two lines or OMM (of several sets the nearest), OEM, SP3, or a
    TOML file with a table [orbit], such as a scenario [position_j of the telemetry]."""
    satellite: str | None = None
    """Name or catalogue number of the satellite in a file of several orbits."""
    most_age_days: Annotated[float, positive()] = MOST_AGE_DAYS
    """Days between epoch and telemetry up to which elements are taken."""
    mapping: Path | None = None
    """How columns become quantities [none: files of torquer]."""
    model: Model | None = None
    """Last part of the calibration: each holds those before it, but `temperature` no coils.
    `attitude` is bias and a whole matrix by the logged quaternions instead [chosen by blocks of
    time held out]."""
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
    begins at its `start`. It is simulated alongside the calibrated readings, which fits its
    inertia, gain and residual dipole [none]."""

    def __post_init__(self) -> None:
        pair = {key: getattr(self, key) for key in ("clock_sigma_s", "along_track_sigma_km")}
        missing = [key for key, value in pair.items() if value is None]
        if len(missing) == 1:
            raise RequestError(
                missing[0],
                "must be given, as the error of clock or elements alone splits no shift; received "
                "none",
            )


@contextmanager
def mistakes_in_file(key: str) -> Iterator[None]:
    """Within the block, mistakes in the file that a key of the request names are its own."""
    try:
        yield
    except RequestError:
        raise
    except ValueError as error:
        lines = (line.removeprefix(f"{key}: ") for line in str(error).split("\n"))
        raise RequestError(key, "; ".join(lines)) from None
