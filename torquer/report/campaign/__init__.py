"""The report on a campaign: distributions, bands over time, correlations, one HTML page."""

from collections.abc import Sequence
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


def compare_several_campaigns(results: Sequence[xr.Dataset], out: Path) -> list[Path]:
    """The same of two to six campaigns, each against the first."""
    from torquer.campaign.contents import independent
    from torquer.campaign.several import compare_several
    from torquer.report.campaign.several import write_several
    from torquer.simulation.results.file import own_folder

    folder, found = Path(out), compare_several(results)
    own_folder(folder / "plots")
    return write_several([independent(each) for each in results], found, folder)
