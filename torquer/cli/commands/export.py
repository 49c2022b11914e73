"""`torquer export`: the on-board computer of a scenario for flight."""

import shlex
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from torquer.base.strict_json import json_text
from torquer.cli.loading import load_usable
from torquer.cli.options import CodeOptions, Json, options
from torquer.cli.output import make_writable, say, writing_to

_Framework = Literal["fprime", "cfs", "freertos"]


@options
class ExportOptions:
    """Options of `torquer export c`."""

    out: Annotated[Path, Parameter(help="Folder for the C files; files of an export are replaced.")]
    steps: int | None = None
    """Control steps that are flown and recorded for the replay [2000]."""
    real: Literal["double", "float"] = "double"
    """Precision: with "float" all but times is computed in single precision, with other bits."""
    ephemeris: Literal["given", "kepler", "sgp4"] | None = None
    """Ephemeris on board: model field and Sun. The position is handed in ("given"), or position and
    velocity come from a Kepler orbit that drifts by J2, or from SGP4 [all is handed in]."""
    prefix: str = "adcs"
    """What the names of files, functions, types and macros begin with."""
    framework: Annotated[_Framework | None, Parameter(name="--for")] = None
    """Write a component for F Prime, an app for cFS or a task for FreeRTOS around it, too."""
    json: Json = False


def c(scenario: Path, *, how: ExportOptions, code: CodeOptions = CodeOptions()) -> int:
    """Write estimators, modes and laws of SCENARIO as C99, with a replay that compares bits."""
    from torquer.flight.c99.export import STEPS, export_c
    from torquer.flight.c99.notes import export_notes

    satellite = load_usable(scenario, code, None)
    make_writable(how.out)
    with writing_to(how.out):
        steps = STEPS if how.steps is None else how.steps
        files = export_c(
            satellite, how.out, steps, how.real, how.ephemeris, how.prefix, how.framework
        )
    if how.json:
        print(json_text({"scenario": satellite.name, "files": [str(file) for file in files]}))
        return 0
    names = ", ".join(str(file.relative_to(how.out)) for file in files)
    for note in export_notes(satellite):
        say(f"note: {note}")
    say(f"{satellite.name}: written to {how.out}: {names}")
    say(_how_to_build(how.out))
    return 0


def _how_to_build(folder: Path) -> str:
    """What builds an export and replays it, from where the command was given."""
    source, build = (shlex.quote(str(each)) for each in (folder, folder / "build"))
    steps = (f"cmake -S {source} -B {build}", f"cmake --build {build}", f"ctest --test-dir {build}")
    return f"build and replay: {' && '.join(steps)}"
