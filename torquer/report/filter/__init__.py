"""Pictures and page of a filter's statistics, pictures of its expected accuracy."""

from pathlib import Path

from torquer.analysis.filter_check import FilterCheck


def write_filter_report(found: FilterCheck, out_dir) -> dict[str, Path]:
    """Write `plots/*.png` and `report.html` of a filter check into a folder; paths by name."""
    from torquer.report.filter.page import write_page
    from torquer.report.filter.pictures import draw_all

    folder = Path(out_dir)
    (folder / "plots").mkdir(parents=True, exist_ok=True)
    paths = draw_all(found, folder / "plots")
    paths["report"] = write_page(found, paths, folder / "report.html")
    return paths
