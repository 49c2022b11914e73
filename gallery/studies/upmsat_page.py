"""The page's section on UPMSat-2, and its picture, of the stored results."""

import functools

import numpy as np

from gallery.drawing import BLUE, RED, label, new_figure
from gallery.studies.flying import read
from gallery.studies.study import Study
from gallery.studies.upmsat import CASES, NAME, above_wanted, column, fly, settled_h

#: Published: expected off the normal [deg], rate above the wanted one [orbital rates], its range.
EXPECTED_DEG, EXPECTED, EXPECTED_RANGE = 2.5, 1.7, (1.5, 3.0)
#: Measured in orbit: angle to the Sun moved by, and its standard deviation [deg].
MEASURED_DEG, MEASURED_SD_DEG = 2.2, 2.5
PICTURE = "img/study-upmsat.png"
_CALLED = {
    "tilted dipole": "law at any time, tilted dipole; RK4, 0.1 s",
    "all of the field": "law at any time, IGRF to degree 13",
    "short steps": "the same, steps of 0.02 s",
    "a tenth of the gain": "the same, a tenth of the gain",
    "a hundredth": "the same, a hundredth of the gain",
    "on board": "cycle on board, IGRF, errors of devices",
    "on board, short steps": "the same, steps of 0.02 s",
    "between cycles": "the same, field's rate from one cycle to the next",
}
#: What the picture shows, and its names there.
_SHOWN = {
    "tilted dipole": "tilted dipole",
    "all of the field": "IGRF",
    "a tenth of the gain": "IGRF, gain / 10",
    "on board": "cycle on board",
    "between cycles": "rate between cycles",
}
_ABOUT = """\
A. Porras-Hermoso, J. Piqueras, J. Cubas, E. Roibás-Millán, *On-orbit performance analysis of
spinning spacecraft magnetic control laws. Application to the UPMSat-2 mission*, Measurement 225
(2024) 113962 (DOI 10.1016/j.measurement.2023.113962), Tables 1 and 2, section 2 and Figs. 2, 3
and 12; its expectation is that of J. Cubas, A. Farrahi, S. Pindado (2015). A satellite of 50 kg
at 518 km has coils of 15 A m2. They obey m = -k (dB/dt + ω x B) with k = 1e8 and ω = 0.1 rad/s
about its third axis, which is to settle along the orbit's normal. On board, a cycle takes 2 s:
five readings of the field in one second, then half a second of dipole, then rest."""
_HOW = """\
Means over the second half of 30 revolutions, with standard errors of the starts, which we draw:
any attitude, up to 3 deg/s about each axis. The rate is that above 0.1 rad/s, in orbital rates:
its mean, and the range of the mean start. The hours are those until the axis stays within 10 deg
of the normal, where it does so in the first half. Devices on board have the printed errors, in
drawn directions: 25 nT, 2 nT of noise, 0.075 A m2."""
_STANDS = """\
**What stands, what does not, and why.** The law does what its authors say, in orbit and here: the
axis settles along the normal within {hours:.1f} h from each of {most_starts} drawn starts. With a
tilted dipole the range of the rate is the published one: a dipole's field turns at 1.5 orbital
rates over the pole and at 3 over the equator. With all of the field it is {least:.1f} to
{most:.1f}. The mean is not the published 1.7 but {mean:.2f} orbital rates. With a gain of 1e8 the
body follows the field's direction at any time, and that turns twice in an orbit. The paper itself
has 1.7 as the limit of small gains. A tenth of the gain still has {tenth:.2f}, and with a
hundredth {weak} of {starts} starts do not settle in 30 revolutions. The published 2.5 deg off the
normal lie between a dipole's {dipole:.1f} and the {whole:.1f} of the whole field; a tenth of the
gain has {less:.1f}. On board the coils are on for a quarter of the time, and it is {board:.1f} deg.
In orbit the angle of the axis to the Sun was on average {measured} deg from that of the normal,
with a standard deviation of {measured_sd} deg. Ours are {moved:.1f} and {moved_sd:.1f} deg: the
scatter is what the law makes, but a mean offset it does not make over whole orbits. Telemetry came
from above one station only. How the field's rate is formed matters more than the gain: from the
mean of one cycle to that of the next it comes a second late, and the axis is {late:.1f} deg off.
Short steps change the angles by at most {steps:.1g} deg."""


def section() -> str:
    """The section as Markdown."""
    flown, low, high = read(NAME)["cases"], *EXPECTED_RANGE
    lines = [
        "## UPMSat-2: B-dot with a wanted rate, in orbit",
        "",
        _ABOUT,
        "",
        "| flown | starts | off the normal, deg | at most | rate above 0.1 rad/s | range | hours |",
        "|---|---|---|---|---|---|---|",
        f"| published, expected | - | {EXPECTED_DEG} | - | {EXPECTED} | {low} to {high} | - |",
        f"| published, in orbit | 1 | {MEASURED_DEG} (by the Sun) | - | - | - | - |",
        *(_row(case) for case in CASES if case in flown),
        "",
        _HOW,
        "",
        f"![Angle from the normal]({PICTURE})",
        "",
        _verdict(),
    ]
    return "\n".join(lines)


def _row(case: str) -> str:
    least, most = (above_wanted(case, key).mean() for key in ("least_rad_s", "most_rad_s"))
    hours = settled_h(case)
    cells = (
        _CALLED[case],
        str(len(hours)),
        _mean(column(case, "off_deg"), 2),
        f"{column(case, 'off_most_deg').max():.1f}",
        _mean(above_wanted(case, "rate_rad_s"), 2),
        f"{least:.2f} to {most:.2f}",
        _mean(hours, 1) if np.isfinite(hours).all() else "-",
    )
    return f"| {' | '.join(cells)} |"


def _mean(values: np.ndarray, digits: int) -> str:
    error = values.std(ddof=1) / len(values) ** 0.5
    return f"{values.mean():.{digits}f} ± {error:.{digits}f}"


def moved_by_steps(case: str, short: str) -> float:
    """Degrees by which short steps move the mean angle from the normal at most."""
    few = column(short, "off_deg")
    return float(np.abs(few - column(case, "off_deg")[: len(few)]).max())


def _verdict() -> str:
    """What stands, what does not, and why."""
    off = {case: column(case, "off_deg").mean() for case in CASES}
    rate = {case: above_wanted(case, "rate_rad_s").mean() for case in CASES}
    whole = "all of the field"
    steps = ((whole, "short steps"), ("on board", "on board, short steps"))
    return _STANDS.format(
        hours=max(settled_h(case).max() for case in (whole, "on board")),
        least=above_wanted(whole, "least_rad_s").mean(),
        most=above_wanted(whole, "most_rad_s").mean(),
        mean=rate[whole],
        tenth=rate["a tenth of the gain"],
        weak=np.isnan(settled_h("a hundredth")).sum(),
        starts=len(settled_h("a hundredth")),
        most_starts=min(len(settled_h(case)) for case in (whole, "on board")),
        dipole=off["tilted dipole"],
        less=off["a tenth of the gain"],
        whole=off[whole],
        board=off["on board"],
        late=off["between cycles"],
        measured=MEASURED_DEG,
        measured_sd=MEASURED_SD_DEG,
        moved=column("on board", "sun_moved_deg").mean(),
        moved_sd=column("on board", "sun_sd_deg").mean(),
        steps=max(moved_by_steps(*each) for each in steps),
    )


def picture():
    """Angle from the normal of each start, by case."""
    figure, axes = new_figure("UPMSat-2: how far the third axis is off the normal", 1, 3.0)
    rows = np.arange(len(_SHOWN))[::-1]
    for row, case in zip(rows, _SHOWN, strict=True):
        off = column(case, "off_deg")
        axes[0].plot(off, np.full(len(off), row), "o", color=BLUE, ms=4)
    axes[0].axvline(EXPECTED_DEG, color=RED, ls=":", label="expected")
    axes[0].axvline(MEASURED_DEG, color="#777777", ls="--", label="in orbit, by the Sun")
    axes[0].set(xlim=(0.0, None), ylim=(-0.6, len(_SHOWN) - 0.4))
    axes[0].set_yticks(rows, _SHOWN.values())
    label(axes[0], "mean angle from the normal [deg]", "law and field")
    return figure


STUDY = Study(
    NAME, {case: functools.partial(fly, case) for case in CASES}, section, (PICTURE, picture)
)
