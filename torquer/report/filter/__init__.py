"""Pictures and page of a filter's statistics, pictures of its expected accuracy."""

from pathlib import Path

from torquer.analysis.filters.filter_check import FilterCheck
from torquer.simulation.results.file import own_folder


def write_filter_report(found: FilterCheck, out_dir) -> dict[str, Path]:
    """Write `plots/*.png` and `report.html` of a filter check into a folder; paths by name."""
    from torquer.report.filter.page import write_page
    from torquer.report.filter.pictures import draw_all

    folder = Path(out_dir)
    own_folder(folder / "plots")
    paths = draw_all(found, folder / "plots")
    paths["report"] = write_page(found, folder / "report.html")
    return paths
