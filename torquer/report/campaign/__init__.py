"""The report on a campaign: distributions, bands over time, correlations, one HTML page."""

from pathlib import Path

import xarray as xr


def write_campaign_report(result: xr.Dataset, out: Path) -> list[Path]:
    """Write `report.html` and `plots/*.png` of a campaign into a folder; return the paths.

    The folder is created if missing.
    """
    from torquer.campaign.contents import independent
    from torquer.campaign.summary import campaign_summary
    from torquer.report.campaign.page import write_page
    from torquer.report.campaign.pictures import draw_all
    from torquer.simulation.results.file import own_folder

    folder = Path(out)
    own_folder(folder / "plots")
    summary, result = campaign_summary(result), independent(result)
    pictures = draw_all(result, summary, folder / "plots")
    page = write_page(result, summary, pictures, folder / "report.html")
    return [page, *pictures.values()]


def compare_campaigns(a: xr.Dataset, b: xr.Dataset, out: Path) -> list[Path]:
    """Write `report.html` and `plots/*.png` on how two campaigns differ; return the paths.

    The folder is created if missing. `ValueError` for campaigns without a common outcome.
    """
    from torquer.campaign.comparison import comparison
    from torquer.campaign.contents import independent
    from torquer.report.campaign.compared import draw_compared, write_compared
    from torquer.simulation.results.file import own_folder

    folder, found = Path(out), comparison(a, b)
    a, b = independent(a), independent(b)
    own_folder(folder / "plots")
    pictures = draw_compared(a, b, found, folder / "plots")
    page = write_compared(a, b, found, folder / "report.html")
    return [page, *pictures.values()]
