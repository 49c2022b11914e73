"""`torquer compare`, `smooth`, `table`: runs side by side; attitude in hindsight; tables."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from torquer.base.strict_json import json_text
from torquer.cli.loading import load_result, open_result
from torquer.cli.options import Json, as_options, options
from torquer.cli.output import make_writable, say, table, table_console, writing_to
from torquer.simulation.results.file import explain_errors, save

_WIDTH, _SMOOTHED_WIDTH = 160, 100


def compare(
    *results: Path,
    out: Annotated[Path | None, Parameter(help="Folder for the pictures [not drawn].")] = None,
    json: Json = False,
) -> int:
    """Compare two to six runs: RESULTS are their output folders or result.nc files."""
    from torquer.report.common.figure import save_figure
    from torquer.report.flight.compared import MOST, compare as compared_of

    if not 2 <= len(results) <= MOST:
        raise ValueError(f"RESULTS: must be 2 to {MOST} runs; received {len(results)}")
    if out is not None:
        make_writable(out)
    opened = [load_result(path, "RESULTS") for path in results]
    names = _names(results)
    with explain_errors(", ".join(names)):
        compared = compared_of(*opened, names=names)
    if out is not None:
        with writing_to(out):
            picture = save_figure(compared.plot(), out / "compared.png")
    if json:
        print(json_text(compared.as_plain()))
        return 0
    screen, head = table_console(_WIDTH), ["", *names]
    if compared.changed:
        screen.print(table(head, _change(compared.changed), "Keys that differ"))
    screen.print(table(head, compared.rows(), "Key numbers"))
    if out is not None:
        say(picture)
    return 0


def _names(paths: Sequence[Path]) -> list[str]:
    """The names of the folders; their full paths if two names are the same."""
    folders = [path if path.is_dir() or path.name != "result.nc" else path.parent for path in paths]
    short = [folder.resolve().name for folder in folders]
    if len(set(short)) == len(short):
        return short
    whole = [str(folder) for folder in folders]
    if len(set(whole)) < len(whole):
        raise ValueError(f"RESULTS: must be different runs; received {', '.join(whole)}")
    return whole


def _change(changed: dict[str, list]) -> list[tuple[str, ...]]:
    return [
        (key, *("not given" if value is None else str(value) for value in values))
        for key, values in changed.items()
    ]


@options
class SmoothOptions:
    """Options of `torquer smooth`."""

    out: Path | None = None
    """Folder for smoothed.nc and smoothed.png [that of RESULT]."""
    json: Json = False


def smooth(result: Path, *, how: SmoothOptions = SmoothOptions()) -> int:
    """Smooth the attitude of a run: RESULT is its output folder or result.nc.

    What the readings of the whole run tell about each of its control steps, with the errors to be
    expected. The run must have had a Kalman filter, simulation.record_inputs = true, and a record
    at every control step.
    """
    from torquer.analysis.filters.smoothing import measure_accuracy, smooth_run
    from torquer.report.filter.pictures import draw_smoothed

    run = load_result(result, "RESULT")
    with explain_errors(result):
        found = smooth_run(run)
    out = how.out or (result if result.is_dir() else result.parent)
    make_writable(out)
    with writing_to(out):
        save(found, out / "smoothed.nc")
        draw_smoothed(run, found, out / "smoothed.png")
    accuracy = measure_accuracy(run, found)
    if how.json:
        print(json_text(accuracy._asdict()))
        return 0
    head = ("attitude, about each axis", "filter", "smoothed")
    rows = [
        (name, *(f"{value:.3g} deg" for value in values))
        for name, values in (
            ("error, rms", (accuracy.filter_deg, accuracy.smoothed_deg)),
            ("stated, rms", (accuracy.filter_sigma_deg, accuracy.smoothed_sigma_deg)),
            ("greatest error, whole angle",
             (accuracy.filter_greatest_deg, accuracy.smoothed_greatest_deg)),
        )
    ]  # fmt: skip
    table_console(_SMOOTHED_WIDTH).print(table(head, rows, accuracy.scenario))
    say(f"{out}: smoothed.nc, smoothed.png")
    return 0


@options
class TableOptions:
    """Options of `torquer table`."""

    variables: list[str] | None = None
    """This variable, of the result or derived; may be repeated [all of the result]."""
    every_s: float | None = None
    """Of a run the records nearest to multiples of this time [all records]."""
    out: Path | None = None
    """File to write, .csv or .parquet [CSV on standard output]."""


def table_(result: Path, *, how: TableOptions = TableOptions()) -> int:
    """Write variables of RESULT, a run or a campaign, as a table: a row a record or member.

    RESULT is its output folder or file. Vectors have a column for each component, such as
    omega_body_x; the head has the units. Derived are such as rate, sun_angle and attitude_error.
    """
    from torquer.analysis.table import csv_text, to_dataframe, write_table

    with explain_errors(result):
        opened = open_result(result, "RESULT")
    asked = how.variables, how.every_s
    try:
        if how.out is None:
            print(csv_text(to_dataframe(opened, *asked)), end="")
            return 0
        with writing_to(how.out, what="file"):
            write_table(opened, how.out, *asked)
    except ValueError as error:
        names = {"variables": "--variables", "every_s": "--every-s", "path": "--out"}
        raise ValueError(as_options(str(error), names)) from None
    say(how.out)
    return 0
