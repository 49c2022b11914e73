"""`torquer wheels`: capability and saturation of a wheel array on a satellite."""

from pathlib import Path

from torquer.cli.options import Json, options


@options
class WheelsOptions:
    """Options of `torquer wheels`."""

    out: Path | None = None
    """Folder for pictures and the page [not written]."""
    sweep: str | None = None
    """Sweep an angle of the layout: gamma_deg=20:85, or =20:85:14 for 14 points."""
    json: Json = False


def wheels(design: Path, *, how: WheelsOptions = WheelsOptions()) -> int:
    """Capability of the array in the file DESIGN, with up to two failed wheels; saturation.

    With --out also envelope.png, failures.png, accumulation.png and wheels.html, an interactive
    view of the envelope. With --sweep also a table over the angle, and sweep.png.
    """
    from torquer.cli.commands import wheels_work as work

    return work.show(design, how)
