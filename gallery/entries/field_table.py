"""FIELD section 4: which field model for which study, with our own evidence.

Five of the table's 24 signs are lost in the text; they stay lost here, and where a row is short of
one, which of its places is empty is our reading. So there is nothing to agree with. Added: how
far each simple model's vector is from that of IGRF over a day on FIELD's orbit (1000 km, 82.5 deg).
"""

import numpy as np

from gallery.cones import angle_between_deg
from gallery.drawing import MODEL_COLOURS, label, new_figure
from gallery.entry import Answer, Entry, Verdict, lost
from gallery.four_models import MODELS, Case, scenario

GOOD, HALF, BAD, LOST = "+", "±", "-", "?"
#: Study: signs of IGRF/WMM, tilted dipole, direct dipole, averaged. A row with an asterisk has
#: three signs in the text without a gap; its empty place is the one that the prose leaves for it.
TABLE = {
    "simulation, refined": (GOOD, LOST, BAD, BAD),
    "simulation, preliminary *": (BAD, GOOD, LOST, HALF),
    "transient motion": (GOOD, GOOD, GOOD, GOOD),
    "accuracy of attitude *": (GOOD, LOST, HALF, HALF),
    "analysis, orbital frame *": (BAD, BAD, GOOD, LOST),
    "analysis, inertial frame": (BAD, LOST, HALF, GOOD),
}
_COLOURS = {GOOD: "#bfe3d4", HALF: "#fbe8bf", BAD: "#f4cdbd", LOST: "#eeeeee"}
CASE = Case((0.0, 0.0, 0.0), 1.0, 0.0, 1.0)


def errors_deg(t_s) -> dict[str, np.ndarray]:
    """Angle [n] deg of each simple model's vector to that of IGRF."""
    fields = {}
    for model in MODELS:
        environment = scenario(CASE, model).orbit_environment()
        fields[model] = environment.field(t_s, *environment.state(t_s))
    best = fields.pop("IGRF-14")
    return {model: angle_between_deg(b, best) for model, b in fields.items()}


def compute() -> Answer:
    """The table as data; mean errors of direction over a day."""
    t_s = np.arange(0.0, 86400.0, 20.0)
    errors = errors_deg(t_s)
    mean = {model: float(error.mean()) for model, error in errors.items()}
    signs = [sign for row in TABLE.values() for sign in row]
    checks = (
        lost("signs of the table that the text has lost, of 24", signs.count(LOST)),
        *(lost(f"mean error of direction over a day: {model}", mean[model], "deg")
          for model in errors),
    )  # fmt: skip
    largest = ", ".join(f"{m} {errors[m].max():.1f} deg" for m in errors)
    note = (
        f"Greatest angle to IGRF-14 over a day: {largest}; means are in the table. Prose of the "
        "section: IGRF for refined studies, the tilted dipole before it or in its place."
    )
    return Answer(checks, {"table": table(), "errors": curves(t_s, errors)}, note)


def table():
    """The table as a picture."""
    figure, (axes,) = new_figure("Which field model for which study (FIELD section 4)", height=3.3)
    axes.axis("off")
    cells = axes.table(
        cellText=[list(row) for row in TABLE.values()],
        cellColours=[[_COLOURS[sign] for sign in row] for row in TABLE.values()],
        rowLabels=list(TABLE),
        colLabels=["IGRF / WMM", "tilted dipole", "direct dipole", "averaged"],
        cellLoc="center",
        bbox=(0.31, 0.08, 0.69, 0.92),
    )
    cells.auto_set_font_size(False)
    cells.set_fontsize(10)
    for cell in cells.get_celld().values():
        cell.set_edgecolor("#ffffff")
        cell.set_linewidth(1.5)
    axes.text(0.31, 0.0, "+ good   ± with care   - not   ? sign lost   * its place, too",
              transform=axes.transAxes, fontsize=9.5, color="#555555", va="center")  # fmt: skip
    return figure


def curves(t_s, errors):
    """Errors over the first five revolutions or so."""
    figure, (axes,) = new_figure("Direction of the field: angle to IGRF-14, 1000 km, 82.5 deg")
    for model, error in errors.items():
        axes.plot(t_s / 3600.0, error, color=MODEL_COLOURS[model], lw=1.1, label=model)
    label(axes, "time [h]", "angle to IGRF-14 [deg]")
    axes.set(xlim=(0.0, 9.0), ylim=(0.0, None))
    return figure


ENTRY = Entry(
    ids=("FIELD-table",),
    compute=compute,
    declared=Verdict.LOST,
    reason="five of the 24 signs are lost in the text, in three rows their places, too",
)
