"""`torquer design`: gains of control laws, coils and benches."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from torquer.cli.compiling import show_progress
from torquer.cli.loading import load_checked, load_usable
from torquer.cli.options import FLAT, CodeOptions, Figure, Json
from torquer.cli.output import make_writable, moving_bar, print_answer, writing_to
from torquer.design.requests import (
    BenchRequest,
    CoilRequest,
    DetumbleRequest,
    MagnetoGyroRequest,
    MissionRequest,
    ThreeAxisRequest,
)

_NOTHING = "control: must be given; received nothing"


def three_axis(
    scenario: Path | None = None,
    /,
    *,
    how: Annotated[ThreeAxisRequest, FLAT] = ThreeAxisRequest(),
    out: Annotated[
        Path | None, Parameter(help="Folder for map.png, page.pdf, the new scenario, laws as TOML.")
    ] = None,
    figure: Figure = None,
    json: Json = False,
    code: CodeOptions = CodeOptions(),
) -> int:
    """Gains for three-axis control by coils alone: by formula, refined, and a periodic regulator.

    SCENARIO describes the satellite, if given; otherwise the options do. A law of SCENARIO that
    holds an attitude is assessed, too. A run counts as captured if its error stays within
    --capture-within-deg over the last revolution, whatever the law.
    """
    from torquer.design.three_axis_gains import three_axis as answer

    _check_figure(figure, out)
    satellite = None if scenario is None else _load_satellite(scenario, code)
    if out is not None:
        make_writable(out)
    with show_progress("gains and flights", total=None):
        found = answer(satellite, how)
        files = [] if out is None else _write_laws(found, out, figure)
    return print_answer(found, json, out, files)


def _load_satellite(path: Path, code: CodeOptions):
    """The scenario of a file; without a law an error that says which lines are enough."""
    from torquer.scenario.load import ScenarioError

    try:
        return load_checked(path, code)
    except ScenarioError as error:
        enough = (
            ' (for a design a table [control] with sample_s and law = { kind = "off" } is enough)'
        )
        raise ScenarioError(str(error).replace(_NOTHING, _NOTHING + enough)) from None


def _check_figure(figure: Figure, out: Path | None) -> None:
    """Figures need a folder: ValueError without one."""
    if figure and out is None:
        raise ValueError(f"--figure: must be given with --out; received {figure} without it")


def _write_laws(found, out: Path, figure: Figure) -> list[Path]:
    """map.png, page.pdf, scenario.toml with the best law, and a table of each law."""
    from torquer.report.common.one_page import save_page
    from torquer.report.common.paper import save_drawn
    from torquer.report.theory.designs import draw_design, gain_map
    from torquer.report.theory.one_page import three_axis_page
    from torquer.scenario.toml_text import to_toml
    from torquer.simulation.results.file import put

    over = gain_map(found)
    plain = found.as_scenario().model_dump(mode="json", exclude_unset=True, exclude_none=True)
    with writing_to(out):
        pictures = save_drawn({"map": draw_design(found, over)}, out, figure)
        page = save_page(three_axis_page(found, over), out)
        tables = {"scenario": to_toml(plain), **found.tables()}
        made = [put(out / f"{name}.toml", text) for name, text in tables.items()]
        return [*pictures, page, *made]


def detumble(
    scenario: Path,
    /,
    *,
    how: Annotated[DetumbleRequest, FLAT] = DetumbleRequest(),
    out: Annotated[
        Path | None, Parameter(help="Folder for gains.png, page.pdf, the new scenario.")
    ] = None,
    figure: Figure = None,
    json: Json = False,
    code: CodeOptions = CodeOptions(),
) -> int:
    """Which gain for B-dot? From theory with saturation, sampling and lag, then flown.

    SCENARIO describes the satellite and its control cycle. The same releases are flown with each
    gain. The gain chosen stops the most of them: in time with --within-s, else at all. Of several
    it is the least; without --within-s only if nine in ten then stop at most 10 % later than with
    any other.
    """
    from torquer.design.detumbling import detumble as answer

    _check_figure(figure, out)
    satellite = load_checked(scenario, code)
    if out is not None:
        make_writable(out)
    given, columns = ("completed", "total"), ("MofNCompleteColumn", "TimeRemainingColumn")
    with moving_bar("flights", given, *columns) as progress:
        sweep = answer(satellite, how, progress)
    files = [] if out is None else _write_gain(sweep, out, figure)
    return print_answer(sweep, json, out, files)


def _write_gain(sweep, out: Path, figure: Figure) -> list[Path]:
    """gains.png, page.pdf, and scenario.toml with the gain chosen."""
    from torquer.report.common.one_page import save_page
    from torquer.report.common.paper import save_drawn
    from torquer.report.theory.designs import draw_gains
    from torquer.report.theory.one_page import gain_page
    from torquer.scenario.toml_text import to_toml
    from torquer.simulation.results.file import put

    plain = sweep.with_gain().model_dump(mode="json", exclude_unset=True, exclude_none=True)
    with writing_to(out):
        return [
            *save_drawn({"gains": draw_gains(sweep)}, out, figure),
            save_page(gain_page(sweep), out),
            put(out / "scenario.toml", to_toml(plain)),
        ]


def magneto_gyro(
    scenario: Path,
    /,
    *,
    how: Annotated[MagnetoGyroRequest, FLAT] = MagnetoGyroRequest(),
    out: Annotated[
        Path | None, Parameter(help="Folder for law, scenario, pictures, page.pdf.")
    ] = None,
    figure: Figure = None,
    json: Json = False,
    code: CodeOptions = CodeOptions(),
) -> int:
    """Gains of the magneto-gyroscopic system: magnetometer, coils and a pitch wheel.

    SCENARIO describes the satellite: inertia, wheel_momentum_n_m_s of its body, orbit, field, model
    on board, noise and bias of the magnetometer. Its own laws and modes are replaced in
    scenario.toml, which runs from the tip-off rate until the satellite points.
    """
    from torquer.design.gyro.gains import magneto_gyro as answer

    _check_figure(figure, out)
    satellite = load_usable(scenario, code, out)
    with show_progress("releases") as progress:
        made = answer(satellite, how, progress and (lambda done, all_: progress(done / all_)))
    files = [] if out is None else _write_gyro(made, out, figure)
    return print_answer(made, json, out, files)


def _write_gyro(made, out: Path, figure: Figure) -> list[Path]:
    """law.toml, scenario.toml with the law in a mode table and a campaign, and the pictures."""
    from torquer.design.gyro.flown_scenario import campaign_table
    from torquer.report.common.one_page import save_page
    from torquer.report.common.paper import save_drawn
    from torquer.report.theory.magneto_gyro import draw_gyro_design
    from torquer.report.theory.one_page import gyro_page
    from torquer.scenario.toml_text import to_toml
    from torquer.simulation.results.file import put

    data = made.scenario.model_dump(mode="json", exclude_unset=True, exclude_none=True)
    data["campaign"] = campaign_table(made.scenario, made.case.tip_off_deg_s)
    with writing_to(out):
        return [
            put(out / "law.toml", to_toml({"control": {"law": made.law}})),
            put(out / "scenario.toml", to_toml(data)),
            *save_drawn(draw_gyro_design(made), out, figure),
            save_page(gyro_page(made), out),
        ]


def mission(
    scenario: Path,
    /,
    *,
    how: Annotated[MissionRequest, FLAT] = MissionRequest(),
    out: Annotated[
        Path | None, Parameter(help="Folder for the page and all files [runs/NAME-mission].")
    ] = None,
    json: Json = False,
    code: CodeOptions = CodeOptions(),
) -> int:
    """All parts of the design of a satellite, one after the other, on one page.

    What the satellite has is designed and flown: detumbling by B-dot, an attitude
    held by coils or with a pitch wheel, filters, reaction wheels, every single fault. Laws of the
    file that hold an attitude are flown, with slews and unloading, and have a pointing budget.
    What it lacks is left out, with the reason. mission.html has the verdicts, the open points and
    the files. Exit code 1 if a part fails.
    """
    from torquer.design.mission_design import mission as answer
    from torquer.report.mission import write_mission

    flown = load_checked(scenario, code)
    folder = out or Path("runs") / f"{flown.name}-mission"
    make_writable(folder)
    with show_progress(flown.name) as progress:
        found = answer(flown, how, progress)
    with writing_to(folder):
        files = write_mission(found, folder)
    print_answer(found, json, folder, files)
    return 1 if found.fails else 0


def coil(*, how: Annotated[CoilRequest, FLAT], json: Json = False) -> int:
    """A magnetorquer with or without a core: power of copper and aluminium, and its wire by gauge.

    The power follows from dipole, diameter and mass alone; the gauge divides it between voltage and
    current. Round turns of bare wire are assumed; the wound section is 60 % metal. A core is a long
    rod of a soft magnetic metal, its gain that of an ellipsoid; a cylinder differs by some 15 %.
    """
    from torquer.design.coil_design import coil as answer

    return print_answer(answer(how), json)


def bench(*, how: Annotated[BenchRequest, FLAT], json: Json = False) -> int:
    """From a B-dot test on a bench to the time in orbit, for the same initial rate.

    Coils at their limits: the time goes with inertia over field. Below the limits: with inertia
    over the square of the field. A test usually begins with the first and ends with the second.
    """
    from torquer.design.bench_scaling import bench as answer

    return print_answer(answer(how), json)
