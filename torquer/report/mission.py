"""A mission's design as one page: verdicts, open points, each part, the files beside it."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from torquer.base.strict_json import json_text
from torquer.campaign.faults.contents import fault_table
from torquer.campaign.faults.fly import FaultCampaign
from torquer.design.gain_sweep import GainSweep
from torquer.design.gyro.answer import GyroDesign
from torquer.design.mission_design import MissionDesign
from torquer.design.mission_parts import Part
from torquer.design.mission_pointing import FlownLaws
from torquer.design.pointing_answer import PointingBudget
from torquer.design.three_axis_answer import ThreeAxisAnswer
from torquer.design.wheel_report import WheelReport
from torquer.report.common.figure import save_figure, save_figures
from torquer.report.common.html import card, cards, picture
from torquer.report.flight.panels import pictures
from torquer.report.flight.png import draw_picture
from torquer.report.flight.view import make_view
from torquer.report.theory.designs import draw_design, draw_gains
from torquer.report.theory.magneto_gyro import draw_gyro_design
from torquer.report.theory.pointing import draw_pointing
from torquer.report.wheels.page import write_all
from torquer.scenario.toml_text import to_toml
from torquer.simulation.results.file import put

#: Pictures of a flight that are written.
_OF_FLIGHT = ("attitude_error", "wheels")


def write_mission(found: MissionDesign, folder: Path) -> list[Path]:
    """Write mission.html, mission.json, and each part's pictures, laws and scenarios."""
    made = {part.name: _write_part(part, folder) for part in found.parts}
    page = put(folder / "mission.html", _page(found, made))
    return [
        page,
        put(folder / "mission.json", json_text(found.data()) + "\n"),
        *(path for paths in made.values() for path in paths),
    ]


def _write_part(part: Part, folder: Path) -> list[Path]:
    for kind, write in _WRITE.items():
        if isinstance(part.answer, kind):
            return write(part.answer, folder)
    return []


def _gain(sweep: GainSweep, folder: Path) -> list[Path]:
    plain = sweep.with_gain().model_dump(mode="json", exclude_unset=True, exclude_none=True)
    return [
        save_figure(draw_gains(sweep), folder / "gains.png"),
        put(folder / "detumbling.toml", to_toml(plain)),
    ]


def _laws(answer: ThreeAxisAnswer, folder: Path) -> list[Path]:
    return [
        save_figure(draw_design(answer), folder / "hold.png"),
        *(put(folder / f"hold_{name}.toml", text) for name, text in answer.tables().items()),
    ]


def _gyro(made: GyroDesign, folder: Path) -> list[Path]:
    return [
        *save_figures(draw_gyro_design(made), folder).values(),
        put(folder / "pitch_wheel.toml", to_toml({"control": {"law": made.law}})),
    ]


def _worst(found: FaultCampaign, folder: Path) -> list[Path]:
    scenario = found.scenario_of(found.worst())
    plain = scenario.model_dump(mode="json", exclude_unset=True, exclude_none=True)
    return [put(folder / "worst_fault.toml", to_toml(plain))]


def _flown(found: FlownLaws, folder: Path) -> list[Path]:
    view = make_view(found.result)
    return [
        save_figure(draw_picture(view, each), folder / f"{each.name}.png")
        for each in pictures(view) if each.name in _OF_FLIGHT
    ]  # fmt: skip


def _budget(found: PointingBudget, folder: Path) -> list[Path]:
    return [save_figure(draw_pointing(found), folder / "pointing.png")]


#: What is written of each kind of answer, pictures first.
_WRITE: dict[type, Callable[[Any, Path], list[Path]]] = {
    GainSweep: _gain,
    ThreeAxisAnswer: _laws,
    GyroDesign: _gyro,
    WheelReport: write_all,
    FlownLaws: _flown,
    PointingBudget: _budget,
    FaultCampaign: _worst,
}


def _page(found: MissionDesign, made: dict[str, list[Path]]) -> str:
    head = ("part", "verdict", "in words")
    verdicts = [(part.name, part.state, part.words) for part in found.parts]
    opened = [{"line": point} for point in found.open_points()] or [{"line": "none"}]
    files = [(name, ", ".join(path.name for path in paths)) for name, paths in made.items()]
    return cards(
        f"{found.scenario.name}: {found.state}",
        [
            card("verdicts", "Verdicts", "", {"grid": (head, verdicts)}),
            card("open", "Open points", "", *opened),
            *(_card(part, made[part.name]) for part in found.parts if part.answer is not None),
            card("files", "Files", "", {"pairs": [row for row in files if row[1]]}),
        ],
        description=found.scenario.description,
    )


def _card(part: Part, files: list[Path]) -> dict:
    pictures = [picture(path, f"{part.name}: {path.stem}") for path in files
                if path.suffix == ".png"]  # fmt: skip
    table = {"grid": fault_table(part.answer)} if isinstance(part.answer, FaultCampaign) else {}
    text = {"text": "\n".join(part.lines)}
    id = part.name.replace(" ", "-")
    return card(id, f"{part.name}: {part.state}", part.words, *pictures, table, text)
