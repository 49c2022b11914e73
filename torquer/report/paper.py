"""Figures of a run or a campaign for one column of a journal.

torquer.write_paper_figures(result, "paper")
"""

from pathlib import Path

import xarray as xr
from matplotlib.figure import Figure

from torquer.report.campaign.paper import campaign_figures
from torquer.report.common.paper import save_paper
from torquer.report.flight.paper import run_figures


def paper_figures(result: xr.Dataset) -> dict[str, Figure]:
    """Each plot of a run or a campaign by itself, 88 mm wide with text of 8 pt, by name.

    A figure's label is its caption: `figure.get_label()`.

        >>> figures = torquer.paper_figures(result)
        >>> figures["momentum_1"].get_size_inches().round(2).tolist()[0]  # 88 mm
        3.46
    """
    return (campaign_figures if "campaign" in result.attrs else run_figures)(result)


def write_paper_figures(result: xr.Dataset, out_dir) -> list[Path]:
    """Write `paper_figures` into a folder as NAME.png, .pdf and .svg; the captions, captions.txt.

    The folder is created if missing. Returns the paths.

        >>> paths = torquer.write_paper_figures(result, "paper")
        >>> sorted({path.suffix for path in paths})
        ['.pdf', '.png', '.svg', '.txt']
    """
    return save_paper(paper_figures(result), Path(out_dir))
