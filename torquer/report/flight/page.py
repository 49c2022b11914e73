"""The report as one self-contained page: it opens anywhere and loads nothing."""

import io
import json
from pathlib import Path

from torquer.analysis.summary import summary_rows, time_or_never, unchanged_in_words
from torquer.base.language import Message, joined, message, told
from torquer.computer.modes.diagram import svg
from torquer.computer.modes.layout import layout
from torquer.computer.modes.spec import MAIN, Modes
from torquer.report.common.html import encode, page as page_of
from torquer.report.common.sources import sources_data
from torquer.report.flight.budget_rows import HEAD, budget_table, reach_in_words
from torquer.report.flight.ground_track import track_figure
from torquer.report.flight.interactive import panel_figure
from torquer.report.flight.notes import notes
from torquer.report.flight.orbit_scene import orbit_figure
from torquer.report.flight.panels.panel import Panel, Picture, about_ranges
from torquer.report.flight.scene import chapters, scene_figure
from torquer.report.flight.setting import LABELS, setting
from torquer.report.flight.verdict import verdict_data
from torquer.report.flight.view import View
from torquer.scenario.toml_text import to_toml
from torquer.simulation.results.file import put

#: Height of plots on a page beyond which pictures are folded.
_OPEN_PX = 7000
_ABOUT_MODES = message(
    "Each state runs the laws named in its box and adds their commands; a transition is taken "
    "when its condition holds. The strips above the plots show when each state was active; a "
    "region that never changed has none."
)
#: Height of a diagram from which it is folded.
_TALL_PX = 700
_MODES_HEAD = (
    message("State"),
    message("Entered"),
    message("Last entered at"),
    message("Share of time"),
)


def write_page(view: View, pictures, path: Path, overview_png: Path | None = None) -> Path:
    """Write the page; `overview_png` is shown where scripts are not run."""
    return put(path, page(view, pictures, overview_png))


def page(view: View, pictures, overview_png: Path | None = None) -> str:
    """The page's text."""
    modes = view.scenario.control.named().modes
    shown = _fold([_picture(view, picture) for picture in pictures])
    in_space = [_track(view), _motion(view), _orbit(view)]
    budget = _budget(view)
    texts = {
        "verdict": verdict_data(view),
        "notes": [told(note) for note in notes(view)],
        "summary": summary_rows(view.summary, verdict=False),
        "setting": setting(view),
        "contents": _contents(bool(modes), shown, bool(budget), in_space),
        "modes": _modes(view, modes) if modes else None,
        "pictures": shown,
        "budget": budget,
        "in_space": in_space,
        "sources": sources_data(view.result),
    }
    return page_of(
        "flight.html",
        view.scenario.name,
        **_all_told(texts),
        description=view.scenario.description,
        overview=encode(_in_few_colours(overview_png)) if overview_png else "",
        scenario=to_toml(json.loads(view.result.attrs["scenario"])),
        laws=[(told(title), text) for title, text in _law_texts(view)],
        versions=list(json.loads(view.result.attrs["versions"]).items()),
    )


def _all_told(texts):
    """Data with its texts in the language of the reader; figures have theirs already."""
    if isinstance(texts, dict):
        return {k: each if k == "figure" else _all_told(each) for k, each in texts.items()}
    if isinstance(texts, list | tuple):
        return [_all_told(each) for each in texts]
    return told(texts) if isinstance(texts, Message) else texts


def _in_few_colours(png: Path) -> bytes:
    """The picture with 256 colours, a third of the bytes."""
    from PIL import Image

    data = io.BytesIO()
    with Image.open(png) as image:
        image.convert("RGB").quantize(256, Image.Quantize.FASTOCTREE).save(data, "PNG")
    return data.getvalue()


def _contents(modes: bool, pictures, budget: bool, in_space) -> list[tuple[str, str]]:
    """Targets and labels of the links at the head of the page."""
    return [
        *([("modes", message("Modes"))] if modes else []),
        *((each["id"], each["title"]) for each in pictures),
        *([("torque_budget", message("Torque budget"))] if budget else []),
        *((each["id"], each["title"]) for each in in_space),
        ("sources", message("Sources to cite")),
        ("scenario", message("Scenario")),
    ]


def _modes(view: View, modes: Modes) -> dict:
    """The section as the page's template takes it: diagram, a table for each region."""
    uses = view.summary["modes"]
    entered = {name: sum(use["entries"] > 0 for use in uses[name].values()) for name in uses}
    changed = [name for name in uses if name == MAIN or entered[name] > 1]
    return {
        "caption": _ABOUT_MODES,
        "diagram": encode(svg(modes).encode()),  # as an image it keeps its style to itself
        "tall": layout(modes).height > _TALL_PX,
        "head": _MODES_HEAD,
        "regions": [_region(name, uses[name]) for name in changed],
        "unchanged": unchanged_in_words({k: v for k, v in uses.items() if k not in changed}),
    }


def _region(name: str, uses: dict) -> dict:
    """Entries into the states of a region, and their shares of the time."""
    rows = [
        (
            state,
            message("{count} times", count=use["entries"])
            if use["entries"] != 1
            else message("once"),
            time_or_never(use["last_entered_s"]),
            f"{use['share']:.1%}",
        )
        for state, use in uses.items()
    ]
    return {"title": "" if name == MAIN else name, "rows": rows}


def _picture(view: View, picture: Picture) -> dict:
    ranges = about_ranges(picture)
    caption = joined(" ", [picture.caption, ranges]) if ranges else picture.caption
    groups: dict[str, list] = {}
    for panel in picture.panels:
        groups.setdefault(panel.fold, []).append(
            {
                "title": panel.title,
                "name": _in_words(panel),
                "figure": panel_figure(view, panel),
                "linked": panel.window is None,
            }
        )
    return {"id": picture.name, "title": picture.title, "caption": caption, "groups": groups}


def _fold(shown: list[dict]) -> list[dict]:
    """The pictures; those that would make the page longer than can be looked through, folded."""
    height = 0
    for each in shown:
        heights = [panel["figure"]["layout"]["height"] for panel in each["groups"].get("", ())]
        height += sum(heights)
        each["folded"] = height > _OPEN_PX
    return shown


def _in_words(panel: Panel) -> str:
    """Text alternative of a plot, with its keyboard controls."""
    if panel.bars:
        states = ", ".join(bar.label for bar in panel.bars)
        return message("{title} over time: {states}.", title=panel.title, states=states)
    lines = ", ".join(dict.fromkeys(line.label for line in panel.lines))
    return message(
        "{title}, {label}, over time: {lines}. Arrow keys move, plus and minus zoom, 0 shows all.",
        title=panel.title,
        label=panel.y_label,
        lines=lines,
    )


def _budget(view: View) -> dict | None:
    if not view.budget.disturbance:
        return None
    unit, rows = budget_table(view.budget)
    caption = message(
        "In {unit}, over the recorded motion. {reach}",
        unit=unit,
        reach=reach_in_words(view.budget),
    )
    return {"caption": caption, "head": HEAD, "rows": rows}


def _track(view: View) -> dict:
    field = view.scenario.environment.field
    along_orbit_only = not hasattr(field, "b_earth_fixed")
    caption = (
        message("The {kind} field is defined along the orbit only and has no map.", kind=field.kind)
        if along_orbit_only
        else message(
            "Background: |B| of the scenario's field model ({kind}) at the mean altitude.",
            kind=field.kind,
        )
    )
    words = message("Ground track on a map of longitude and latitude.")
    return _in_space("ground_track", message("Ground track"), caption, words, track_figure(view))


def _motion(view: View) -> dict:
    named = (joined(": ", [part.name, part.description]) for part in chapters(view))
    caption = message(
        "Directions from the satellite in the inertial frame: body axes x, y, z with a box of the "
        "same inertia, the magnetic field B, the angular momentum L with its path over the run "
        "(grey), the Sun (grey in eclipse) and nadir. Lengths are not to scale. {spacing}.",
        spacing=joined("; ", named),
    )
    words = joined(" ", [message("Animation of the satellite's attitude."), _KEYS])
    return _in_space("motion", message("Motion in space"), caption, words, scene_figure(view))


def _orbit(view: View) -> dict:
    """The Earth with the orbit and the field line."""
    when = message("The run")
    if view.end_s > view.revolution_s:
        when = message("The last revolution")
    caption = (
        message(
            "{when} around the Earth in the inertial frame, with the field line through the "
            "satellite (pink), the body axes x, y, z (not to scale) and the day side of the Earth.",
            when=when,
        )
        if hasattr(view.scenario.environment.field, "b_earth_fixed")
        else message(
            "{when} around the Earth in the inertial frame, the body axes x, y, z (not to scale) "
            "and the day side of the Earth.",
            when=when,
        )
    )
    animation = message("Animation of the satellite on its orbit around the Earth.")
    words = joined(" ", [animation, _KEYS])
    return _in_space("orbit", message("Orbit and field"), caption, words, orbit_figure(view))


_KEYS = message(
    "The space bar plays, left and right arrows step, up and down arrows rotate the view."
)


def _in_space(id: str, title: str, caption: str, words: str, figure: dict) -> dict:
    return {"id": id, "title": title, "caption": caption, "name": words, "figure": figure}


def _law_texts(view: View) -> list[tuple[str, str]]:
    """Source text of user laws, as flown, each once."""
    texts = {law["text"]: (key, law["name"]) for key, law in view.laws.items() if law["text"]}
    return [
        (message("{kind} {key}", kind=LABELS[view.kind_of(key)], key=name), text)
        for text, (key, name) in texts.items()
    ]
