"""`torquer export`: the on-board computer of a scenario for flight."""

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from torquer.cli.options import CodeOptions, Json, options


@options
class ExportOptions:
    """Options of `torquer export c`."""

    out: Annotated[Path, Parameter(help="Folder for the C files; files of an export are replaced.")]
    steps: int | None = None
    """Control steps that are flown and recorded for the replay [2000]."""
    real: Literal["double", "float"] = "double"
    """Precision: with "float" all but times is computed in single precision, with other bits."""
    ephemeris: Literal["given", "kepler", "sgp4"] | None = None
    """Ephemeris on board: model field and Sun at a position that is handed in ("given"), or with
    position and velocity by a Kepler orbit that drifts by J2 or by SGP4 [all is handed in]."""
    json: Json = False


def c(scenario: Path, *, how: ExportOptions, code: CodeOptions = CodeOptions()) -> int:
    """Write estimators, modes and laws of SCENARIO as C99, with a replay that compares bits."""
    from torquer.cli.commands import export_work

    return export_work.export(scenario, how, code)
