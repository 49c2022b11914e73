"""`torquer theory`: averaged motion of a satellite under a law, and gains for a time."""

from pathlib import Path
from typing import Annotated

from cyclopts import App

from torquer.base.strict_json import json_text
from torquer.cli.app import read_help
from torquer.cli.examples import show_examples
from torquer.cli.options import FLAT, Json, options
from torquer.cli.output import make_writable, print_answer, writing_to
from torquer.theory.averaged.requests import LawRequest

app = App(name="theory", help_epilogue=show_examples("theory"), version_flags=[])
app.command(
    "torquer.cli.commands.theory_magneto_gyro:magneto_gyro",
    name="magneto-gyro",
    help=read_help("theory_magneto_gyro", "magneto_gyro"),
    help_epilogue=show_examples("theory magneto-gyro"),
)


@options
class TheoryOptions:
    """The scenario, what is printed, and where the pictures go."""

    scenario: Path | None = None
    """Scenario file that gives law, satellite and orbit."""
    design: bool = False
    """Print a table of gains and times instead."""
    latex: bool = False
    """Equations in LaTeX, by sympy."""
    out: Path | None = None
    """Folder for evolution.png and map.png."""
    json: Json = False


@app.default
def theory(
    law: str | None = None,
    /,
    *,
    how: Annotated[LawRequest, FLAT] = LawRequest(),
    to: TheoryOptions = TheoryOptions(),
) -> int:
    """Averaged motion under LAW: small parameter, times, limit motions, equations, pictures.

    LAW: bdot, nutation_damping, spin_up, reorientation, preliminary_1, preliminary_2 or sdot.
    """
    from torquer.theory.averaged.answer import law_gains, law_motion

    scenario = _scenario(to.scenario)
    if to.design:
        _check_alone(to)
        return print_answer(law_gains(law, how, scenario), to.json)
    found = law_motion(law, how, scenario)
    formulas = _latex(found.case.law) if to.latex else ""
    pictures = [] if to.out is None else _draw(found, to.out)
    if to.json:
        more = {"latex": formulas, "pictures": pictures}
        print(json_text(found.data() | {key: each for key, each in more.items() if each}))
    else:
        print(*found.lines(formulas.splitlines()), *pictures, sep="\n")
    return 0


def _scenario(path: Path | None):
    if path is None:
        return None
    from torquer.scenario.load import load_scenario

    return load_scenario(path)


def _check_alone(to: TheoryOptions) -> None:
    """ValueError for what a table of gains does not have."""
    for option in ("--out",) * (to.out is not None) + ("--latex",) * to.latex:
        raise ValueError(f"{option}: must not be given with --design; received both")


def _latex(law: str) -> str:
    try:
        from torquer.theory.averaged.latex import law_latex
    except ImportError:
        raise ValueError(
            "--latex: needs sympy: pip install 'torquer[symbolic]'; received an installation "
            "without it"
        ) from None
    return law_latex(law)


def _draw(found, out: Path) -> list[str]:
    from torquer.report.common.figure import save_figure
    from torquer.report.theory.law_motion import draw_law_motion

    make_writable(out)
    figures = draw_law_motion(found)
    with writing_to(out):
        return [str(save_figure(each, out / f"{name}.png")) for name, each in figures.items()]
