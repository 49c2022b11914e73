"""The page's section on a single coil, of the stored results."""

import functools

import numpy as np

from gallery.drawing import COLOURS, label, new_figure
from gallery.studies.flying import read
from gallery.studies.single_coil import CASES, NAME, STARTS, fly, minutes_of
from gallery.studies.study import Study, draw_share

#: Published: whether a start is detumbled within 150 min, by law.
PUBLISHED = {"B-dot": ("no", "no", "yes", "no"), "prediction": ("yes", "yes", "yes", "no")}
LIMIT_MIN = 150.0
PICTURE = "img/study-single-coil.png"
_CALLED = {
    "B-dot": "B-dot without dead band",
    **{f"dead band of {nt_s} nT/s": f"B-dot, dead band of {nt_s} nT/s" for nt_s in (50, 100, 200)},
    "ten hours": "B-dot, dead band of 100 nT/s, 10 h",
    "B-dot at 10 Hz": "B-dot, dead band of 100 nT/s, at 10 Hz",
    "B-dot, precise": "B-dot, dead band of 100 nT/s, errors of 1e-6 deg",
    "predicted": "prediction, field held",
    "predicted, field turns": "prediction, field turns as the body does",
    "predicted, precise": "prediction, field held, errors of 1e-6 deg",
}

_ABOUT = """\
K. Kondo, I. Kolmanovsky, Y. Yoshimura, M. Bando, S. Nagasaki, T. Hanada, *Nonlinear Model
Predictive Detumbling of Small Satellites with a Single-axis Magnetorquer* (arXiv:2401.11536,
2024), Tables 1 to 4. A satellite of 0.02, 0.03 and 0.04 kg m2 at 313 km has one coil of 1 A m2,
along its first axis, which gives no torque about that axis. Four starts of up to 3 deg/s about an
axis are printed. A start is detumbled once each rate is below 0.1 deg/s; flights end after 150
min. B-dot has the full dipole, with a dead band. The other law takes the dipole that costs least
over 10 predicted steps of 1 s, with the printed weights."""
_HOW = """\
Each cell has the share of first attitudes from which the start is detumbled, in percent with its
standard error. In brackets is the median time of those, in minutes. The error is that of a share
with two more attitudes of either result, so that 0 and 100 % have one, too. Our copy of the paper
has lost the dead band; first attitudes, sampling (1 Hz here) and integration are not printed. We
draw attitudes isotropically. The paper continues a solution by C/GMRES; we solve each prediction
to 1e-9 A m2. It predicts with a dipole's field, ours with the measured one: held, or turning as
the body does."""
_STANDS = """\
**What stands, what does not, and why.** Prediction detumbles with one coil: {held} of our flights
within 150 min, {turns} if the predicted field turns. That includes the start for which the paper
has a no: {fourth} of {fourths} attitudes. The paper has one attitude for each start, and the
attitude decides. That B-dot with one coil mostly fails stands, too. With a dead band of 100 nT/s,
which is what a rate of 0.1 deg/s makes of the field, {b_dot} of {b_dots} flights are detumbled:
{low} to {high} % of the attitudes, by start. The rate about the coil remains, and only the body's
own coupling takes it away. Waiting helps little: {ten} in ten hours. The dead band, which we do
not know, decides as much as the law: {bare} without one, {wide} with 200 nT/s. A coil that never
rests nearly always keeps an axis too fast. Steps do not matter: with errors of 1e-6 deg {moved}."""


def section() -> str:
    """The section as Markdown."""
    flown = read(NAME)["cases"]
    lines = [
        "## One coil: B-dot or model prediction?",
        "",
        _ABOUT,
        "",
        f"| flown | attitudes | {' | '.join(f'start {start}' for start in STARTS)} |",
        f"|---|---|{'---|' * len(STARTS)}",
        *(f"| published, {law} | 1 | {' | '.join(said)} |" for law, said in PUBLISHED.items()),
        *(_row(case) for case in CASES if case in flown),
        "",
        _HOW,
        "",
        f"![Share that is detumbled]({PICTURE})",
        "",
        _verdict(),
    ]
    return "\n".join(lines)


def _row(case: str) -> str:
    cells = (_cell(minutes_of(case, start)) for start in STARTS)
    return f"| {_CALLED[case]} | {len(minutes_of(case, '1'))} | {' | '.join(cells)} |"


def _cell(minutes: np.ndarray) -> str:
    percent, error = share(minutes)
    there = minutes[np.isfinite(minutes)]
    when = f" ({np.median(there):.0f})" if len(there) else ""
    return f"{percent:.0f} ± {error:.0f}{when}"


def share(minutes: np.ndarray) -> tuple[float, float]:
    """Share [%] that is detumbled, and its standard error: as of two more with either result.

    So that a share of all or of none has one, too.
    """
    n, there = len(minutes), np.isfinite(minutes).sum()
    likely = (there + 2.0) / (n + 4.0)
    return 100.0 * there / n, 100.0 * float((likely * (1.0 - likely) / (n + 4.0)) ** 0.5)


def of_all(case: str) -> np.ndarray:
    """Minutes of all starts of a case, one after the other."""
    return np.concatenate([minutes_of(case, start) for start in STARTS])


def moved_by_steps(case: str, precise: str) -> float:
    """Minutes by which small errors move a time at most; infinite if one is there alone."""
    few = np.concatenate([minutes_of(precise, start) for start in STARTS])
    count = len(few) // len(STARTS)
    same = np.concatenate([minutes_of(case, start)[:count] for start in STARTS])
    if (np.isnan(few) != np.isnan(same)).any():
        return np.inf
    return float(np.nanmax(np.abs(few - same), initial=0.0))


def _differ(seconds: float) -> str:
    """By how much times differ, in words; records are 10 s apart."""
    if seconds == 0.0:
        return "no time differs by as much as the 10 s between records"
    return f"times differ by at most {seconds:.0f} s, with a record every 10 s"


def _count(case: str) -> str:
    return f"{np.isfinite(of_all(case)).sum()} of {len(of_all(case))}"


def _verdict() -> str:
    """What stands, what does not, and why."""
    band = "dead band of 100 nT/s"
    by_start = [share(minutes_of(band, start))[0] for start in STARTS]
    last = minutes_of("predicted", "4")
    moved = max(
        moved_by_steps(band, "B-dot, precise"), moved_by_steps("predicted", "predicted, precise")
    )
    return _STANDS.format(
        held=_count("predicted"),
        turns=_count("predicted, field turns"),
        fourth=np.isfinite(last).sum(),
        fourths=len(last),
        b_dot=np.isfinite(of_all(band)).sum(),
        b_dots=len(of_all(band)),
        low=round(min(by_start)),
        high=round(max(by_start)),
        bare=_count("B-dot"),
        wide=_count("dead band of 200 nT/s"),
        ten=_count("ten hours"),
        moved=_differ(60.0 * moved),
    )


def picture():
    """Share that is detumbled over time, of all starts together: B-dot and prediction."""
    figure, axes = new_figure("One coil: flights that are detumbled, of all four starts", 1, 3.2)
    shown = ("dead band of 100 nT/s", "B-dot", "predicted", "predicted, field turns")
    for case, colour in zip(shown, COLOURS, strict=False):
        draw_share(axes[0], of_all(case), LIMIT_MIN, color=colour, label=_CALLED[case])
    axes[0].set(xlim=(0.0, LIMIT_MIN), ylim=(0.0, 100.0))
    label(axes[0], "time [min]", "share [%]", columns=2)
    return figure


STUDY = Study(
    NAME, {case: functools.partial(fly, case) for case in CASES}, section, (PICTURE, picture)
)
