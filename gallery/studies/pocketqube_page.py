"""The page's section on the PocketQube, and its picture, of the stored results."""

import functools
import textwrap

import numpy as np

from gallery.drawing import BLUE, GREEN, RED, label, new_figure
from gallery.studies.flying import read
from gallery.studies.pocketqube import CASES, LAWS, NAME, fly, fly_alone
from gallery.studies.study import Study, draw_share
from torquer.campaign.statistics import rate_interval

#: Three times 180 deg/s.
START_DEG_S = 180.0 * 3.0**0.5
#: Published: members, stopped, mean and standard deviation of the time to stop [h], time on [h].
PUBLISHED = {"plain": (500, 500, 22.53, 4.84, 36.61), "weighted": (500, 500, 22.63, 4.83, 34.82)}
#: Names in the picture, and how long members fly at most [h].
_SHORT = {
    "as published": "RK4, 0.125 s",
    "converged": "exact free rotation",
    "10 Hz": "exact free rotation, 10 Hz",
}
_FLOWN_H = {"as published": 48.8, "converged": 48.8, "10 Hz": 109.8}
_CALLED = {
    "as published": "RK4, 0.125 s, as published",
    "converged": "the same, exact free rotation",
    "10 Hz": "10 Hz, exact free rotation, 72 orbits",
}

_ABOUT = """\
R. Fonod, E. Gill, *Magnetic Detumbling of Fast-tumbling Picosatellites*, IAC-18-C1.3.11, and the
public simulator of it (DOI 10.5281/zenodo.21346158). A satellite of 0.6 kg leaves its deployer at
180 deg/s about each axis, at a height of 350 km. Its coils of 2 mA m2 have one pulse in each
quarter of a second; two noisy magnetometers measure in between. B-dot acts on the direction of
the field. The study weights its gain by how fast the body tumbles, to save current. Its 500
members have their own mass, inertia, coils, residual dipole and bias. A member has stopped once
it is below 5 deg/s about each axis."""
_HOW = """\
Means have standard errors; sd is the standard deviation of the members, the greatest rate is a
median. Times are those of members that stopped; the time on is the sum over the three coils. Our
members follow the published distributions, with draws of our own: the rows with fewer have the
first of the same 500. Of {draws} draws {impossible:.0f} % are no bodies, as three moments of
inertia drawn apart may break the triangle inequality; we draw these again. The members fly as a
campaign, each until it has stopped."""
_STANDS = """\
**What stands, what does not, and why.** With the published step all members stop. Our mean time
to stop differs from the published one by {apart} with the plain law, and by {apart_weighted} with
the weighted one. {weight} But at this rate the step itself brakes. Without coils or torques it
takes {damped:.0f} % of the momentum in an hour. With exact free rotation between the torques, of
{count} members {faster} turn faster after 32 orbits than at the start, and {stopped} stopped by
then (95 % interval {low:.1f} to {high:.1f} %). The reason is the sampling. A body with 180 deg/s
about each axis sees one line of the field at 409 deg/s, and a mean dipole held for a quarter of a
second brakes up to 360 deg/s only. At 10 Hz the law brakes: all {count_then} members stop, after
{slower:.1f} times as long as the same members with the published step, as no step helps. What
stands is the saving by the weight: at 10 Hz it changes the time on by {saved_then} and the time
to stop by {delayed}. (It counts the turning in a step, and so is smaller at 10 Hz.) The authors
themselves advise a finer solver."""
_WEIGHT = """\
The weight changes the mean time on by {saved} (published: {published:.2f} %) and the mean time to
stop by {delayed} ({published_delay:+.2f} %). The paper prints no error of its saving. With
our own error for both, the savings differ by {gap:.2f} ± {gap_error:.2f} %: our draws are not
theirs, and we know no other reason."""


def columns(case: str, law: str) -> dict[str, np.ndarray]:
    """Numbers of a case's members [n] by what they are; NaN for one that did not stop."""
    rows = [row[law] for row in read(NAME)["cases"][case]["rows"]]
    return {key: np.array([row[key] for row in rows], dtype=float) for key in rows[0]}


def section() -> str:
    """The section as Markdown."""
    cases = read(NAME)["cases"]
    free, draws = cases["free"]["rows"]
    lines = [
        "## A PocketQube at 312 deg/s: plain and weighted B-dot",
        "",
        _ABOUT,
        "",
        "| flown | law | members | stopped | time to stop, h | sd, h | time on, h "
        "| greatest rate, deg/s |",
        "|---|---|---|---|---|---|---|---|",
        *(_published(law) for law in LAWS),
        *(_row(case, law) for case in CASES if case in cases for law in LAWS),
        "",
        _filled(_HOW.format(draws=draws["draws"], impossible=100.0 * draws["impossible"])),
        "",
        f"![Time to stop]({PICTURE})",
        "",
        _filled(_verdict(free)),
    ]
    return "\n".join(lines)


def _filled(text: str) -> str:
    return textwrap.fill(text, 99, break_on_hyphens=False)


PICTURE = "img/study-pocketqube.png"


def _published(law: str) -> str:
    count, stopped, mean, sd, on = PUBLISHED[law]
    error = sd / count**0.5
    return f"| published | {law} | {count} | {stopped} | {mean} ± {error:.2f} | {sd} | {on} | - |"


def _row(case: str, law: str) -> str:
    found = columns(case, law)
    stopped = np.isfinite(found["stopped_h"])
    time, on = (found[key][stopped] for key in ("stopped_h", "on_h"))
    sd = f"{time.std(ddof=1):.2f}" if len(time) > 1 else "-"
    return (
        f"| {_CALLED[case]} | {law} | {len(stopped)} | {stopped.sum()} | {_mean(time)} | {sd} | "
        f"{_mean(on)} | {np.median(found['greatest_deg_s']):.0f} |"
    )


def _mean(values: np.ndarray) -> str:
    if len(values) < 2:
        return "-" if not len(values) else f"{values[0]:.1f}"
    error = values.std(ddof=1) / len(values) ** 0.5
    places = 2 if error < 0.5 else 1
    return f"{values.mean():.{places}f} ± {error:.{places}f}"


def apart(law: str) -> tuple[float, float]:
    """Our mean time to stop less the published one [h], and its standard error."""
    count, _, mean, sd, _ = PUBLISHED[law]
    ours = columns("as published", law)["stopped_h"]
    error = (sd**2 / count + ours.var(ddof=1) / len(ours)) ** 0.5
    return float(ours.mean() - mean), float(error)


def change(case: str, key: str) -> tuple[float, float]:
    """Change of a mean by the weight, and its standard error [%]: members fly both laws."""
    plain, weighted = (columns(case, law)[key] for law in LAWS)
    there = np.isfinite(plain + weighted)
    plain, weighted = plain[there], weighted[there]
    ratio = weighted.mean() / plain.mean()
    rest = (weighted - ratio * plain) / plain.mean()
    return 100.0 * float(ratio - 1.0), 100.0 * float(rest.std(ddof=1) / len(rest) ** 0.5)


def _change(case: str, key: str) -> str:
    mean, error = change(case, key)
    return f"{mean:+.2f} ± {error:.2f} %"


def _verdict(free: dict) -> str:
    """What stands, what does not, and why."""
    spun, late, soon = (columns(case, "plain") for case in ("converged", "10 Hz", "as published"))
    count, stopped = len(spun["stopped_h"]), int(np.isfinite(spun["stopped_h"]).sum())
    chance, count_then = rate_interval(stopped, count), len(late["stopped_h"])
    plain, weighted = PUBLISHED["plain"], PUBLISHED["weighted"]
    saved, error = change("as published", "on_h")
    published = 100.0 * (weighted[4] / plain[4] - 1.0)
    weight = _WEIGHT.format(
        saved=_change("as published", "on_h"),
        published=published,
        gap=saved - published,
        gap_error=2.0**0.5 * error,
        delayed=_change("as published", "stopped_h"),
        published_delay=100.0 * (weighted[2] / plain[2] - 1.0),
    )
    return _STANDS.format(
        apart=_apart("plain"),
        apart_weighted=_apart("weighted"),
        weight=weight,
        damped=100.0 * free["rk4"],
        count=count,
        faster=np.count_nonzero(spun["final_deg_s"] > START_DEG_S),
        stopped=f"{stopped} {'has' if stopped == 1 else 'have'}",
        low=100.0 * chance.low,
        high=100.0 * chance.high,
        count_then=count_then,
        slower=late["stopped_h"].mean() / soon["stopped_h"][:count_then].mean(),
        saved_then=_change("10 Hz", "on_h"),
        delayed=_change("10 Hz", "stopped_h"),
    )


def _apart(law: str) -> str:
    mean, error = apart(law)
    return f"{mean:+.2f} ± {error:.2f} h"


def picture():
    """Share of the members that have stopped, over time, by case and law."""
    figure, axes = new_figure("A PocketQube at 312 deg/s: members that have stopped", 1, 3.4)
    for case, colour in zip(CASES, (BLUE, RED, GREEN), strict=True):
        for law, line in zip(LAWS, ("-", ":"), strict=True):
            times, name = columns(case, law)["stopped_h"], _SHORT[case] if line == "-" else None
            draw_share(axes[0], times, _FLOWN_H[case], color=colour, ls=line, label=name)
    axes[0].plot([], [], ":", color="#222222", label="dotted: weighted")
    _, _, mean, sd, _ = PUBLISHED["plain"]
    axes[0].errorbar(mean, 50.0, xerr=sd, fmt="o", color="#222222", ms=4, capsize=3,
                     label="published, mean and sd")  # fmt: skip
    axes[0].set(xlim=(0.0, max(_FLOWN_H.values())), ylim=(-2.0, 102.0))
    label(axes[0], "time [h]", "share that has stopped [%]", columns=3)
    return figure


STUDY = Study(
    NAME,
    {"free": fly_alone} | {case: functools.partial(fly, case) for case in CASES},
    section,
    (PICTURE, picture),
)
