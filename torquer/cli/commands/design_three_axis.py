"""`torquer design three-axis`: gains for three axes by coils alone."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from torquer.cli.options import FLAT, CodeOptions, Json
from torquer.cli.output import make_writable, print_answer, writing_to
from torquer.design.requests import ThreeAxisRequest

_NOTHING = "control: must be given; received nothing"


def three_axis(
    scenario: Path | None = None,
    /,
    *,
    how: Annotated[ThreeAxisRequest, FLAT] = ThreeAxisRequest(),
    out: Annotated[Path | None, Parameter(help="Folder for map.png and the laws as TOML.")] = None,
    json: Json = False,
    code: CodeOptions = CodeOptions(),
) -> int:
    """Gains for three-axis control by coils alone: by formula, refined, and a periodic regulator.

    SCENARIO describes the satellite, if given; otherwise the options do. A law of SCENARIO that
    holds an attitude is assessed, too. A run counts as captured if its error stays within
    --capture-within-deg over the last revolution, whatever the law.
    """
    from torquer.design.three_axis_gains import three_axis as answer

    satellite = None if scenario is None else _load(scenario, code)
    if out is not None:
        make_writable(out)
    found = answer(satellite, how)
    return print_answer(found, json, out, [] if out is None else _write(found, out))


def _load(path: Path, code: CodeOptions):
    """The scenario of a file; without a law an error that says which lines are enough."""
    from torquer.cli.loading import load_checked
    from torquer.scenario.load import ScenarioError

    try:
        return load_checked(path, code)
    except ScenarioError as error:
        enough = (
            ' (for a design a table [control] with sample_s and law = { kind = "off" } is enough)'
        )
        raise ScenarioError(str(error).replace(_NOTHING, _NOTHING + enough)) from None


def _write(found, out: Path) -> list[Path]:
    """map.png and a TOML file of each law."""
    from torquer.report.common.figure import save_figure
    from torquer.report.theory.designs import draw_design
    from torquer.simulation.results.file import put

    with writing_to(out):
        picture = save_figure(draw_design(found), out / "map.png")
        laws = found.tables().items()
        return [picture, *(put(out / f"{name}.toml", text) for name, text in laws)]
