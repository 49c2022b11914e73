"""Work of `smooth`: the smoothed attitude of a run, its file and its picture."""

from pathlib import Path

from torquer.analysis.filters.smoothing import accuracy_of, smoothed
from torquer.base.strict_json import json_text
from torquer.cli.app import SmoothOptions
from torquer.cli.commands.compare import loaded
from torquer.cli.output import make_writable, table, table_console, writing_to
from torquer.simulation.results.file import save, understood

_WIDTH = 100


def smooth(path: Path, how: SmoothOptions) -> int:
    """Smooth, write the result, print how accurate it is."""
    result = loaded(path, "RESULT")
    with understood(path):
        found = smoothed(result)
    out = how.out or (path if path.is_dir() else path.parent)
    make_writable(out)
    from torquer.report.filter.smoothed import draw_smoothed

    with writing_to(out):
        save(found, out / "smoothed.nc")
        draw_smoothed(result, found, out / "smoothed.png")
    accuracy = accuracy_of(result, found)
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
