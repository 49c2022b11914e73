"""Work of `smooth`: the smoothed attitude of a run, its file and its picture."""

from pathlib import Path

from torquer.analysis.filters.smoothing import accuracy_of, smoothed
from torquer.base.strict_json import json_text
from torquer.cli.commands.compare import loaded
from torquer.cli.options import Json, options
from torquer.cli.output import make_writable, table, table_console, writing_to
from torquer.simulation.results.file import save, understood

_WIDTH = 100


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
    run = loaded(result, "RESULT")
    with understood(result):
        found = smoothed(run)
    out = how.out or (result if result.is_dir() else result.parent)
    make_writable(out)
    from torquer.report.filter.smoothed import draw_smoothed

    with writing_to(out):
        save(found, out / "smoothed.nc")
        draw_smoothed(run, found, out / "smoothed.png")
    accuracy = accuracy_of(run, found)
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
    table_console(_WIDTH).print(table(head, rows, accuracy.scenario))
    print(f"{out}: smoothed.nc, smoothed.png")
    return 0
