"""All pictures of a campaign, as PNG."""

from pathlib import Path

import xarray as xr
from matplotlib.figure import Figure

from torquer.report.campaign.bands import draw_bands, series_by_signal
from torquer.report.campaign.convergence import draw_convergence
from torquer.report.campaign.correlation import draw_correlations, draw_scatter
from torquer.report.campaign.distribution import draw_distribution
from torquer.report.campaign.sobol import draw_sobol
from torquer.report.common.figure import save_figures


def draw_all(result: xr.Dataset, summary: dict, folder: Path) -> dict[str, Path]:
    """Write all pictures for which there are values; their paths by name."""
    figures: dict[str, Figure | None] = {}
    for name, each in summary["outcomes"].items():
        if each["mean"] is not None:
            figures[f"distribution_{name}"] = draw_distribution(result, summary, name)
    for names in series_by_signal(result):
        figures[f"series_{names[0]}"] = draw_bands(result, summary, names)
    figures["scatter"] = draw_scatter(result, summary)
    figures["correlations"] = draw_correlations(result, summary)
    figures["sobol"] = draw_sobol(summary)
    figures["convergence"] = draw_convergence(result, summary)
    return save_figures(figures, folder)
