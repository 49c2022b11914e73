"""The page of an examination: verdict, findings, pictures, parameters; self-contained HTML."""

from __future__ import annotations

from pathlib import Path

from torquer.ground.telemetry.convention import WAYS_SHOWN
from torquer.ground.telemetry.examination import (
    CHOICE_HEAD,
    PARAMETER_HEAD,
    Examination,
    choice_texts,
    parameter_texts,
)
from torquer.report.common.html import card, cards, picture
from torquer.report.telemetry.pictures import draw_pictures
from torquer.simulation.results.file import put

_WORDS = {
    "causes": (
        "Causes",
        "What each cause that was tried leaves, with bias, scale and non-orthogonality fitted each "
        "time, the most probable at the top. A cause is named where it is 12 nats above 'as "
        "stated' and 6 above every rival, and near what a field that may be anything smooth "
        "leaves. Crosses are not near.",
    ),
    "residual": (
        "Residuals",
        "Strength of the reading minus that of IGRF-14 along the orbit, before and after the "
        "calibration. What is left over the latitude is not noise.",
    ),
    "ellipsoid": (
        "Ellipsoid",
        "Readings near each plane of two axes: a bias moves them off the circle, scale and "
        "non-orthogonality make an ellipse of it.",
    ),
    "attitude": (
        "Attitude",
        "Standard deviation that filter and smoother state, and the innovations: readings less "
        "what the filter expected, over what it expects of their errors. Where the model fits they "
        "are a cloud of unit size without a course.",
    ),
    "twin": (
        "Twin over data",
        "The scenario flown with the parameters found, in legs of five minutes that each begin "
        "with a motion of their own, as noise of the sensors moves the satellite through its law.",
    ),
}


_AHEAD = (
    "The file twin.toml has the twin at the end of the telemetry, with the joint distribution of "
    "what the fit leaves open: torquer campaign flies it onward."
)


def _conventions(found):
    """Ranked ways to read the logged quaternions, as a card."""
    head = ("Scalar", "Sense", "Reference", "Axes", "Error [deg]")
    rows = [
        (each.scalar, each.sense, each.frame, " ".join(each.axes), f"{each.error_deg:.2f}")
        for each in found.ways[:WAYS_SHOWN]
    ]
    title = f"Logged quaternions and the {'field' if found.sensor == 'field' else 'Sun'}"
    said = f"{found.verdict[:1].upper()}{found.verdict[1:]}. Best ways of {len(found.ways)}:"
    return card(f"convention-{found.sensor}", title, said, {"grid": (head, rows)})


def _unknown(twin) -> str:
    """What the telemetry does not say of a twin's parameters."""
    if not twin.undetermined:
        return "The telemetry determines all of them better than what was known beforehand."
    return (
        "Beyond what was known beforehand the telemetry does not determine "
        f"{'; nor '.join(twin.undetermined)}."
    )


def write_telemetry(found: Examination, out: Path) -> list[str]:
    """Write report.html and the pictures of an examination; the names of the files."""
    paths = draw_pictures(found, out)
    pairs = [(row.label, row.text) for row in found.facts]
    verdict = found.verdict
    notes = [("wrong", each.text) for each in found.mistakes]
    notes += [("note", each.text) for each in found.findings]
    made = [card("verdict", verdict[:1].upper() + verdict[1:], "", {"pairs": pairs})]
    if notes:
        made.append(card("findings", "Findings", "", {"grid": (("", "What"), notes)}))
    made += [
        card(name, _WORDS[name][0], _WORDS[name][1], picture(path, _WORDS[name][0]))
        for name, path in paths.items()
    ]
    made += [_conventions(each) for each in found.conventions]
    head = tuple(map(str.capitalize, PARAMETER_HEAD))
    if of_twin := parameter_texts(found.twin):
        said = f"{_unknown(found.twin)} {_AHEAD}"
        made.append(card("twin-parameters", "Twin's parameters", said, {"grid": (head, of_twin)}))
    if rows := parameter_texts(found.calibration):
        caption = (
            "The corrected reading is A (m - bias), A lower triangular with 1 + scale on its "
            "diagonal. Standard deviations allow for the correlation of the residuals."
        )
        made.append(card("parameters", "Calibration", caption, {"grid": (head, rows)}))
    if found.choices:
        grid = (tuple(map(str.capitalize, CHOICE_HEAD)), choice_texts(found.choices))
        caption = "More parameters always fit better; blocks of time held out say which help."
        made.append(card("models", "Models compared", caption, {"grid": grid}))
    source = found.data.attrs.get("source", "telemetry")
    put(out / "report.html", cards(f"{source}: telemetry", made))
    return ["report.html", *(path.name for path in paths.values())]
