"""Pictures and page of a filter's statistics, pictures of its expected accuracy."""

from pathlib import Path

from torquer.analysis.filters.filter_check import FilterCheck
from torquer.simulation.results.file import own_folder


def write_filter_report(found: FilterCheck, out_dir) -> dict[str, Path]:
    """Write `plots/*.png`, `report.html` and `page.pdf` of a filter check into a folder.

    Returns the paths by name.
    """
    from torquer.report.common.one_page import save_page
    from torquer.report.filter.one_page import filter_page
    from torquer.report.filter.page import write_page
    from torquer.report.filter.pictures import draw_all

    folder = Path(out_dir)
    own_folder(folder / "plots")
    paths = draw_all(found, folder / "plots")
    paths["page"] = save_page(filter_page(found), folder)
    paths["report"] = write_page(found, folder / "report.html")
    return paths
