"""`torquer theory`: averaged motion under a law, gains for a time, the gyroscopic system."""

from pathlib import Path
from typing import Annotated

from cyclopts import App

from torquer.base.strict_json import json_text
from torquer.cli.examples import show_examples
from torquer.cli.loading import load_checked, load_given
from torquer.cli.options import FLAT, CodeOptions, Json, options
from torquer.cli.output import print_answer, save_pictures, say
from torquer.theory.averaged.requests import LawRequest
from torquer.theory.magneto_gyro.requests import GyroModelsRequest

app = App(name="theory", help_epilogue=show_examples("theory"), version_flags=[])


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

    scenario = load_given(to.scenario)
    if to.design:
        _check_alone(to)
        return print_answer(law_gains(law, how, scenario), to.json)
    found = law_motion(law, how, scenario)
    formulas = _latex(found.case.law) if to.latex else ""
    pictures: list[str] = []
    if to.out is not None:
        from torquer.report.theory.law_motion import draw_law_motion

        pictures = save_pictures(draw_law_motion(found), to.out)
    if to.json:
        more = {"latex": formulas, "pictures": pictures}
        print(json_text(found.data() | {key: each for key, each in more.items() if each}))
    else:
        say(*found.lines(formulas.splitlines()), *pictures)
    return 0


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


@options
class GyroModelsOptions:
    """Where the pictures go."""

    out: Path | None = None
    """Folder for pictures of stability, roots, errors and the answer to a dipole, with SCENARIO."""
    json: Json = False


@app.command(name="magneto-gyro", help_epilogue=show_examples("theory magneto-gyro"))
def magneto_gyro(
    scenario: Path | None = None,
    /,
    *,
    how: Annotated[GyroModelsRequest, FLAT] = GyroModelsRequest(),
    to: GyroModelsOptions = GyroModelsOptions(),
    code: CodeOptions = CodeOptions(),
) -> int:
    """Models of the magneto-gyroscopic system with constant coefficients, text against law.

    The rows of the text next to those that sympy derives from the law, with what must be corrected;
    characteristic polynomials; why a constant dipole leaves no error. With SCENARIO, whose law is
    magneto_gyro: its numbers, and the exact model in the field of a dipole.
    """
    from torquer.theory.magneto_gyro.models import gyro_models

    if to.out is not None and scenario is None:
        raise ValueError("--out: must be given with SCENARIO, whose numbers are drawn")
    models = gyro_models(None if scenario is None else load_checked(scenario, code), how)
    pictures: list[str] = []
    if to.out is not None:
        from torquer.report.theory.magneto_gyro_models import draw_gyro_models

        pictures = save_pictures(draw_gyro_models(models), to.out)
    if to.json:
        print(json_text(models.data() | ({"pictures": pictures} if pictures else {})))
    else:
        say(*models.lines(), *pictures)
    return 0
