"""Reports: summary tables, pictures, self-contained HTML, by what they show."""

from collections.abc import Callable
from functools import partial
from pathlib import Path


def write_report(
    result, out_dir, progress: Callable[[float], None] | None = None, *, plots: bool = False
) -> dict[str, Path]:
    """Write `report.html` of a result into a folder; return the paths by name.

    With `plots` also `plots/*.png` and, of a run with modes, the state diagram `plots/modes.svg`;
    the page then shows the overview to browsers without scripts. The folder is created if missing.
    `progress` is called with the fraction done, 0..1. `ValueError` for a result without records.

        >>> torquer.write_report(result, "out")["report"].name
        'report.html'
    """
    from torquer.report.flight.page import write_page
    from torquer.report.flight.panels import pictures
    from torquer.report.flight.view import make_view

    view = make_view(result)
    shown = pictures(view)
    folder = Path(out_dir)
    folder.mkdir(parents=True, exist_ok=True)
    paths = {"report": folder / "report.html"}
    if plots:
        return _with_plots(view, shown, folder / "plots", progress) | paths
    write_page(view, shown, paths["report"])
    if progress:
        progress(1.0)
    return paths


def _with_plots(view, shown, folder: Path, progress) -> dict[str, Path]:
    """Draw all pictures into a folder and write the page next to it; paths of the pictures."""
    from torquer.computer.modes.diagram import svg
    from torquer.report.common.figure import save_figure
    from torquer.report.common.side_by_side import done_side_by_side
    from torquer.report.flight.page import write_page
    from torquer.report.flight.png import picture_functions
    from torquer.simulation.results.file import own_folder, put

    own_folder(folder)
    figures = picture_functions(shown)
    paths = {name: folder / f"{name}.png" for name in figures}

    def draw(name: str) -> None:
        save_figure(figures[name](view), paths[name])

    if modes := view.scenario.control.named().modes:
        paths["modes"] = folder / "modes.svg"
        put(paths["modes"], svg(modes))
    # the page shows the overview, which is therefore drawn first, in this process
    page = partial(write_page, view, shown, folder.parent / "report.html", paths["overview"])
    done_side_by_side([partial(draw, name) for name in figures], page, progress)
    return paths
