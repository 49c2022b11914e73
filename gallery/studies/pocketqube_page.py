"""The page's section on the PocketQube, and its picture, of the stored results."""

import functools

import numpy as np

from gallery.drawing import BLUE, RED, label, new_figure
from gallery.studies.flying import read
from gallery.studies.pocketqube import CASES, LAWS, NAME, fly, fly_alone
from gallery.studies.study import Study

#: Published: members, stopped, mean and standard deviation of the time to stop [h], time on [h].
PUBLISHED = {"plain": (500, 500, 22.53, 4.84, 36.61), "weighted": (500, 500, 22.63, 4.83, 34.82)}
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
Means have standard errors; the greatest rate is a median. Our members follow the published
distributions, with draws of our own, so that means may differ by chance. Of {draws} draws
{impossible:.0f} % are no bodies, as three moments of inertia drawn apart may break the triangle
inequality; we draw these again."""
_STANDS = """\
**What stands, what does not, and why.** With the published step all members stop, and the weight
changes the time on by {saved} (published: -4.9 %). But at this rate the step itself brakes.
Without coils or torques it takes {damped:.0f} % of the momentum in an hour. With exact free
rotation between the torques no member stops in 32 orbits: all spin up. The reason is the
sampling. A body with 180 deg/s about each axis sees one line of the field at 409 deg/s, and a
mean dipole held for a quarter of a second brakes up to 360 deg/s only. At 10 Hz the law brakes:
all members stop, after about twice the published time, as no step helps. What stands is the
saving by the weight: at 10 Hz it changes the time on by {saved_then} and the time to stop by
{delayed}. (It counts the turning in a step, and so is smaller at 10 Hz.) The authors themselves
advise a finer solver."""


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
        "| flown | law | members | stopped | time to stop, h | time on, h | greatest rate, deg/s |",
        "|---|---|---|---|---|---|---|",
        *(_published(law) for law in LAWS),
        *(_row(case, law) for case in CASES if case in cases for law in LAWS),
        "",
        _HOW.format(draws=draws["draws"], impossible=100.0 * draws["impossible"]),
        "",
        f"![Time to stop]({PICTURE})",
        "",
        _verdict(free),
    ]
    return "\n".join(lines)


PICTURE = "img/study-pocketqube.png"


def _published(law: str) -> str:
    count, stopped, mean, sd, on = PUBLISHED[law]
    return (
        f"| published | {law} | {count} | {stopped} | {mean} ± {sd / count**0.5:.2f} | {on} | - |"
    )


def _row(case: str, law: str) -> str:
    found = columns(case, law)
    stopped = np.isfinite(found["stopped_h"])
    times = (_mean(found[key][stopped]) for key in ("stopped_h", "on_h"))
    return (
        f"| {_CALLED[case]} | {law} | {len(stopped)} | {stopped.sum()} | {' | '.join(times)} | "
        f"{np.median(found['greatest_deg_s']):.0f} |"
    )


def _mean(values: np.ndarray) -> str:
    if len(values) < 2:
        return "-" if not len(values) else f"{values[0]:.1f}"
    return f"{values.mean():.1f} ± {values.std(ddof=1) / len(values) ** 0.5:.1f}"


def change(case: str, key: str) -> tuple[float, float]:
    """Mean change by the weight within members, and its standard error [%]; of those that stop."""
    plain, weighted = (columns(case, law)[key] for law in LAWS)
    parts = 100.0 * (weighted / plain - 1.0)
    parts = parts[np.isfinite(parts)]
    return float(parts.mean()), float(parts.std(ddof=1) / len(parts) ** 0.5)


def _change(case: str, key: str) -> str:
    mean, error = change(case, key)
    return f"{round(mean, 1) + 0.0:+.1f} ± {error:.1f} %"


def _verdict(free: dict) -> str:
    """What stands, what does not, and why."""
    return _STANDS.format(
        saved=_change("as published", "on_h"),
        damped=100.0 * free["rk4"],
        saved_then=_change("10 Hz", "on_h"),
        delayed=_change("10 Hz", "stopped_h"),
    )


def picture():
    """Time to stop of each member by case: plain and weighted side by side."""
    figure, axes = new_figure("A PocketQube at 312 deg/s: time to stop", 1, 3.4)
    cases = [case for case in CASES if case in read(NAME)["cases"]]
    for place, case in enumerate(cases):
        for side, (law, colour) in enumerate(zip(LAWS, (BLUE, RED), strict=True)):
            times = columns(case, law)["stopped_h"]
            spread = np.linspace(-0.08, 0.08, len(times)) + place - 0.15 + 0.3 * side
            name = f"{law} B-dot" if place == 0 else None
            axes[0].plot(spread, times, ".", color=colour, ms=4, label=name)
            if not np.isfinite(times).any():
                axes[0].annotate("none stops", (place, 0.0), xytext=(0, 6), ha="center",
                                 textcoords="offset points", fontsize=9.5)  # fmt: skip
    axes[0].set_xticks(range(len(cases)), [_CALLED[case].replace(", ", ",\n") for case in cases])
    axes[0].set(xlim=(-0.5, len(cases) - 0.5), ylim=(0.0, None))
    label(axes[0], "", "time to stop [h]")
    return figure


STUDY = Study(
    NAME,
    {"free": fly_alone} | {case: functools.partial(fly, case) for case in CASES},
    section,
    (PICTURE, picture),
)
