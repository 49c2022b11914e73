"""One page of A4 about an answer, for reviews.

    torquer.page(result).savefig("page.pdf")

As for `plot`, the functions that answer stand below those that draw, so this function knows all
kinds.
"""

from functools import singledispatch
from typing import Any

import xarray as xr
from matplotlib.figure import Figure

from torquer.analysis.filters.filter_check import FilterCheck
from torquer.design.coil_design import CoilSizes
from torquer.design.gain_sweep import GainSweep
from torquer.design.gyro.answer import GyroDesign
from torquer.design.three_axis_answer import ThreeAxisAnswer
from torquer.report.campaign.one_page import campaign_page
from torquer.report.common.one_page import Page, draw_page
from torquer.report.filter.one_page import filter_page
from torquer.report.flight.one_page import run_page
from torquer.report.theory.one_page import coil_page, gain_page, gyro_page, three_axis_page


def page(answer: Any) -> Figure:
    """One page of A4: satellite, question, verdict, two plots, numbers, models, sources.

    Of the result of a run or of a campaign, of a filter check, or of an answer of `torquer.design`.
    `page(answer).savefig("page.pdf")` writes it. What does not fit is left out; the page says how
    much. TypeError for an answer without a page.

        >>> torquer.page(result).savefig("page.pdf")
    """
    return draw_page(contents(answer))


@singledispatch
def contents(answer: Any) -> Page:
    """What stands on the page of an answer; TypeError for one without."""
    kinds = sorted(kind.__name__ for kind in contents.registry if kind is not object)
    raise TypeError(
        f"page: must be given one of {', '.join(kinds)}; received {type(answer).__name__}"
    )


@contents.register
def _of_result(result: xr.Dataset) -> Page:
    return (campaign_page if "campaign" in result.attrs else run_page)(result)


contents.register(CoilSizes, coil_page)
contents.register(FilterCheck, filter_page)
contents.register(GainSweep, gain_page)
contents.register(GyroDesign, gyro_page)
contents.register(ThreeAxisAnswer, three_axis_page)
