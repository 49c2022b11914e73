"""Reports: summary tables, pictures, self-contained HTML, by what they show."""

from collections.abc import Callable
from pathlib import Path


def write_report(
    result, out_dir, progress: Callable[[float], None] | None = None
) -> dict[str, Path]:
    """Write `plots/*.png` and `report.html` of a result into a folder; return the paths by name.

    A run with modes has its state diagram beside them, `plots/modes.svg`. The folder is created if
    missing. `progress` is called with the fraction done, 0..1.
    `ValueError` for a result without records.
    """
    from torquer.control.modes.diagram import svg
    from torquer.report.flight.page import write_page
    from torquer.report.flight.panels import pictures
    from torquer.report.flight.png import draw_all
    from torquer.report.flight.view import view_of

    view = view_of(result)
    shown = pictures(view)
    folder = Path(out_dir)
    (folder / "plots").mkdir(parents=True, exist_ok=True)
    report = progress or (lambda part: None)
    paths = draw_all(view, shown, folder / "plots", lambda part: report(0.8 * part))
    if modes := view.scenario.control.named().modes:
        paths["modes"] = folder / "plots" / "modes.svg"
        paths["modes"].write_text(svg(modes), encoding="utf-8")
    paths["report"] = write_page(view, shown, folder / "report.html", paths["overview"])
    report(1.0)
    return paths
