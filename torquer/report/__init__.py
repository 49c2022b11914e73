"""What people look at: summary, pictures, self-contained HTML."""

from collections.abc import Callable
from pathlib import Path


def write_report(
    result, out_dir, progress: Callable[[float], None] | None = None
) -> dict[str, Path]:
    """Write `plots/*.png` and `report.html` of a result into a folder; return the paths by name.

    The folder is made if need be. `progress` is called with the part done, 0..1. `ValueError`
    for a result without a single record.
    """
    from torquer.report.flight.page import write_page
    from torquer.report.flight.panels import pictures
    from torquer.report.flight.png import draw_all
    from torquer.report.flight.view import view_of

    view = view_of(result)
    shown = pictures(view)
    folder = Path(out_dir)
    (folder / "plots").mkdir(parents=True, exist_ok=True)
    told = progress or (lambda part: None)
    paths = draw_all(view, shown, folder / "plots", lambda part: told(0.8 * part))
    paths["report"] = write_page(view, shown, folder / "report.html", paths["overview"])
    told(1.0)
    return paths
