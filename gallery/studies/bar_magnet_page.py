"""The page's section on the bar magnet, and its picture, of the stored results."""

import functools

import numpy as np

from gallery.drawing import BLUE, RED, label, new_figure
from gallery.studies.bar_magnet import CASES, COUNTS, NAME, days_of, fly
from gallery.studies.flying import read
from gallery.studies.study import Study, draw_share

#: Published: days until CSSWE stays within 10 deg of the field.
PUBLISHED_DAYS = 6.5
PICTURE = "img/study-bar-magnet.png"
_CALLED = {
    "limiting curves": "rods on their limiting curves, as published; RK4, 0.5 s",
    "short steps": "the same, steps of 0.05 s",
    "loops within": "rods of T. Flatley, D. Henretty (1995): loops within the limiting ones",
}
_ABOUT = """\
D. Gerhardt, S. Palo, *Passive Magnetic Attitude Control for CubeSat Spacecraft*, SmallSat 2010
(SSC10); its abstract states the result: CSSWE settles to within 10 deg of the field after 6.5
days. A bar magnet of 0.29 A m2 turns the satellite of three units along the field; rods 95 mm
long and 1 mm thick brake it. Inertia, magnet, rods, orbit and first rates are those that a
public program quotes from the paper (`examples/passive_magnet.toml`). We have not seen its
tables: the number of rods on an axis, the first attitude, the step and the model of the field
are ours."""
_HOW = """\
A start has settled when whole revolutions stay within 10 deg until the end of 14 days. All
cases have the same first attitudes, drawn isotropically; short steps fly the first of them."""
_STANDS = """\
**What stands, what does not, and why.** The published time lies among ours for rods that jump
from one limiting curve to the other whenever the field along them turns back: {two} with two
rods on an axis, {three} with three. It is one draw of a wide distribution, which the first
attitude alone makes. A step a tenth as long moves single times by up to {moved:.1f} days: each
jump at a turn of the field that comes a little sooner or later sends the motion another way. So
the distribution is what such a model can tell, not a time. What does not stand is the model's
last part. A rod on its limiting curves brakes a small oscillation like dry friction. A real
loop closes as the amplitude falls, and with such loops {within} of {flown} flights settle in 14
days. Which is nearer to a rod, only a measured small loop tells."""


def section() -> str:
    """The section as Markdown."""
    flown = read(NAME)["cases"]
    return "\n".join([
        "## CSSWE: how soon does a bar magnet settle?",
        "",
        _ABOUT,
        "",
        "| flown | rods on an axis | starts | settled in 14 days | days: median, all |",
        "|---|---|---|---|---|",
        f"| published | not known | 1 | 1 | {PUBLISHED_DAYS} |",
        *(_row(case, count) for case in CASES if case in flown for count in COUNTS),
        "",
        _HOW,
        "",
        f"![Days to settle]({PICTURE})",
        "",
        _verdict(),
    ])  # fmt: skip


def _row(case: str, count: int) -> str:
    days = days_of(case, count)
    return (
        f"| {_CALLED[case]} | {count} | {len(days)} | {np.isfinite(days).sum()} | {_days(days)} |"
    )


def _days(days: np.ndarray) -> str:
    if not np.isfinite(np.median(days)):
        return "-"
    error = np.std(days[np.isfinite(days)], ddof=1) * (np.pi / 2.0 / len(days)) ** 0.5
    return f"{np.median(days):.1f} ± {error:.1f}, {days.min():.1f} to {days.max():.1f}"


def _verdict() -> str:
    """What stands, what does not, and why."""
    two, three = (_days(days_of("limiting curves", count)).partition(",")[0] for count in COUNTS)
    within = np.concatenate([days_of("loops within", count) for count in COUNTS])
    return _STANDS.format(
        two=f"{two} days",
        three=f"{three} days",
        moved=max(moved_by_steps(count) for count in COUNTS),
        within=np.isfinite(within).sum(),
        flown=len(within),
    )


def moved_by_steps(count: int) -> float:
    """Days by which short steps move a time at most."""
    short = days_of("short steps", count)
    return float(np.abs(short - days_of("limiting curves", count)[: len(short)]).max())


def picture():
    """Days of each start by the number of rods."""
    figure, axes = new_figure("CSSWE: days until it stays within 10 deg of the field", 1, 3.2)
    for count, colour in zip(COUNTS, (BLUE, RED), strict=True):
        days, rods = days_of("limiting curves", count), f"{count} rods on an axis"
        draw_share(axes[0], days, 14.0, color=colour, label=rods)
    axes[0].axvline(PUBLISHED_DAYS, color="#777777", ls=":", label="published")
    axes[0].set(xlim=(0.0, 14.0), ylim=(0.0, 100.0))
    label(axes[0], "time [days]", "starts that have settled [%]")
    return figure


STUDY = Study(
    NAME, {case: functools.partial(fly, case) for case in CASES}, section, (PICTURE, picture)
)
