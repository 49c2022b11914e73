"""`torquer design detumble`: the gain of B-dot."""

import sys
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from torquer.cli.options import FLAT, CodeOptions, Json
from torquer.cli.output import make_writable, print_answer, progress_bar, writing_to
from torquer.design.requests import DetumbleRequest

_OUT = Parameter(help="Folder for gains.png and the scenario with the gain.")


def detumble(
    scenario: Path,
    /,
    *,
    how: Annotated[DetumbleRequest, FLAT] = DetumbleRequest(),
    out: Annotated[
        Path | None, Parameter(help="Folder for gains.png and the scenario with the gain.")
    ] = None,
    json: Json = False,
    code: CodeOptions = CodeOptions(),
) -> int:
    """Which gain for B-dot? From theory with saturation, sampling and lag, then flown.

    SCENARIO describes the satellite and its control cycle. The same releases are flown with each
    gain. With --within-s the least gain is chosen with which most stop in time; without it the
    least with which most stop, nine in ten of them at most 10 % later than with any other.
    """
    from torquer.cli.loading import load_checked
    from torquer.design.detumbling import detumble as answer

    satellite = load_checked(scenario, code)
    if out is not None:
        make_writable(out)
    with _progress() as progress:
        sweep = answer(satellite, how, progress)
    return print_answer(sweep, json, out, [] if out is None else _write(sweep, out))


@contextmanager
def _progress():
    """Callback for a bar on a terminal; None elsewhere."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.progress import MofNCompleteColumn, TimeRemainingColumn

    with progress_bar(MofNCompleteColumn(), TimeRemainingColumn()) as bar:
        task = bar.add_task("flights", total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def _write(sweep, out: Path) -> list[Path]:
    """gains.png, and scenario.toml with the gain chosen."""
    from torquer.report.common.figure import save_figure
    from torquer.report.theory.designs import draw_gains
    from torquer.scenario.toml_text import to_toml
    from torquer.simulation.results.file import put

    plain = sweep.with_gain().model_dump(mode="json", exclude_unset=True, exclude_none=True)
    with writing_to(out):
        return [
            save_figure(draw_gains(sweep), out / "gains.png"),
            put(out / "scenario.toml", to_toml(plain)),
        ]
