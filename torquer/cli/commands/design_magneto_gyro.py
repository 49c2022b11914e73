"""`torquer design magneto-gyro`: gains of the magneto-gyroscopic system."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from torquer.cli.options import FLAT, CodeOptions, Json
from torquer.cli.output import print_answer, writing_to
from torquer.design.requests import MagnetoGyroRequest


def magneto_gyro(
    scenario: Path,
    /,
    *,
    how: Annotated[MagnetoGyroRequest, FLAT] = MagnetoGyroRequest(),
    out: Annotated[Path | None, Parameter(help="Folder for law, scenario and pictures.")] = None,
    json: Json = False,
    code: CodeOptions = CodeOptions(),
) -> int:
    """Gains of the magneto-gyroscopic system: magnetometer, coils and a pitch wheel.

    SCENARIO describes the satellite: inertia, wheel_momentum_n_m_s of its body, orbit, field, model
    on board, noise and bias of the magnetometer. Its own laws and modes are replaced in
    scenario.toml, which flies from the tip-off rate until the satellite points.
    """
    from torquer.cli.compiling import compiling_shown
    from torquer.cli.loading import load_usable
    from torquer.design.gyro.gains import magneto_gyro as answer

    satellite = load_usable(scenario, code, out)
    with compiling_shown():
        made = answer(satellite, how)
    return print_answer(made, json, out, [] if out is None else _write(made, out))


def _write(made, out: Path) -> list[Path]:
    """law.toml, scenario.toml with the law in a mode table and a campaign, and the pictures."""
    from torquer.design.gyro.flown_scenario import campaign_table
    from torquer.report.common.figure import save_figures
    from torquer.report.theory.magneto_gyro import draw_gyro_design
    from torquer.scenario.toml_text import to_toml
    from torquer.simulation.results.file import put

    data = made.scenario.model_dump(mode="json", exclude_unset=True, exclude_none=True)
    data["campaign"] = campaign_table(made.scenario, made.case.tip_off_deg_s)
    with writing_to(out):
        return [
            put(out / "law.toml", to_toml({"control": {"law": made.law}})),
            put(out / "scenario.toml", to_toml(data)),
            *save_figures(draw_gyro_design(made), out).values(),
        ]
