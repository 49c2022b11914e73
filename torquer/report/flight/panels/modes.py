"""Modes over time: a strip for each region that changed, above the panels of every picture."""

from dataclasses import replace

from torquer.analysis.mode_use import RegionRecord
from torquer.base.language import message
from torquer.computer.modes.spec import MAIN
from torquer.report.common.colours import BLUE, GREEN, GREY, ORANGE, PINK, RED, SKY
from torquer.report.flight.panels.panel import Bar, Panel, Picture
from torquer.report.flight.view import View

_COLOURS = (SKY, ORANGE, GREEN, PINK, BLUE, RED, GREY)
#: States beyond the colours have them again, paler.
_OPACITIES = (0.5, 0.2)


def strip(view: View, region: RegionRecord) -> Panel:
    """The states of a region, without those it was never in."""
    title = (
        message("Mode") if region.name == MAIN else message("Mode: {region}", region=region.name)
    )
    found = zip(region.states, region.spans(view.t_s), strict=True)
    bars = (_bar(k, state, tuple(spans)) for k, (state, spans) in enumerate(found) if spans)
    return Panel(title, "", (), bars=tuple(bars))


def _bar(number: int, state: str, spans) -> Bar:
    again, place = divmod(number, len(_COLOURS))
    return Bar(state, spans, _COLOURS[place], _OPACITIES[again % len(_OPACITIES)])


def with_modes(view: View, picture: Picture) -> Picture:
    """The picture below the strips of the first region and of all others that changed."""
    strips = [strip(view, region) for region in view.regions]
    shown = strips[:1] + [each for each in strips[1:] if len(each.bars) > 1]
    return replace(picture, panels=(*shown, *picture.panels))
