"""`torquer theory magneto-gyro`: models of the gyroscopic system, text against law."""

from pathlib import Path
from typing import Annotated

from torquer.base.strict_json import json_text
from torquer.cli.options import FLAT, CodeOptions, Json, options
from torquer.cli.output import make_writable, writing_to
from torquer.theory.magneto_gyro.requests import GyroModelsRequest


@options
class GyroModelsOptions:
    """Where the pictures go."""

    out: Path | None = None
    """Folder for pictures of stability, roots, errors and the answer to a dipole, with SCENARIO."""
    json: Json = False


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
    from torquer.cli.loading import load_checked
    from torquer.theory.magneto_gyro.models import gyro_models

    if to.out is not None and scenario is None:
        raise ValueError("--out: must be given with SCENARIO, whose numbers are drawn")
    models = gyro_models(None if scenario is None else load_checked(scenario, code), how)
    pictures = [] if to.out is None else _draw(models, to.out)
    if to.json:
        print(json_text(models.data() | ({"pictures": pictures} if pictures else {})))
    else:
        print(*models.lines(), *pictures, sep="\n")
    return 0


def _draw(models, out: Path) -> list[str]:
    from torquer.report.common.figure import save_figure
    from torquer.report.theory.magneto_gyro_models import draw_gyro_models

    make_writable(out)
    figures = draw_gyro_models(models)
    with writing_to(out):
        return [str(save_figure(each, out / f"{name}.png")) for name, each in figures.items()]
