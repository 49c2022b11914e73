"""The report on a wheel design as one self-contained page with the envelope in 3D."""

from pathlib import Path

import numpy as np

from torquer.design.wheel_report import WheelReport
from torquer.design.wheel_tables import failure_rows, layout_rows, lost_label, summary_rows
from torquer.report.common.colours import BLUE, ORANGE
from torquer.report.common.html import card, cards
from torquer.report.common.interactive import MENU, layout
from torquer.report.common.space import line, xyz
from torquer.report.wheels.pictures import FACE, draw_all, draw_sweep, needed_momenta
from torquer.simulation.results.file import put
from torquer.spacecraft.wheel_array.demand import Ellipsoid
from torquer.spacecraft.wheel_array.envelope import Envelope, momentum_envelope

#: Place of the menu of failures, over the figure.
_MENU = {**MENU, "x": 0.0, "xanchor": "left", "y": 1.0, "yanchor": "top"}


def write_all(report: WheelReport, folder: Path) -> list[Path]:
    """Write all pictures of a report, that of the sweep if there is one, and wheels.html."""
    design, found = report.design, report.found
    made = draw_all(design, found, folder)
    if report.swept:
        made.append(draw_sweep(design, report.swept, folder / "sweep.png"))
    return [*made, write_page(design, found, folder / "wheels.html")]


def write_page(design, report: dict, path: Path) -> Path:
    """Write the page."""
    title = report["description"] or report["name"]
    caption = (
        "Blue: momentum envelope [N m s]. Orange: momentum needed to rotate at "
        f"{needed_momenta(design, report)[1]:.4g} deg/s about any axis. Drag to rotate; the menu "
        "selects failed wheels; click a legend entry to hide it."
    )
    figure = {"figure": make_figure(design, report), "words": "Momentum envelope in body axes."}
    rows = [
        card("momentum", "Momentum envelope", caption, figure),
        card("summary", "The array", "", {"pairs": summary_rows(report)}),
        _title("failures", failure_rows(report)),
    ]
    if len(report["layouts"]) > 1:
        rows.append(_title("layouts", layout_rows(report)))
    return put(path, cards(title, rows))


def _title(id: str, content) -> dict:
    """A card with a table, its units below the title."""
    heading, head, rows = content
    title, _, units = heading.partition(": ")
    return card(id, title, units, {"grid": (head, list(rows))})


def make_figure(design, report: dict) -> dict:
    """The plotly figure: an envelope per failure case, one of them shown, and the ellipsoid."""
    array, (ellipsoid, rate) = design.wheels.array(), needed_momenta(design, report)
    cases = [case["lost"] for case in report["failures"]]
    data = [_ellipsoid_trace(ellipsoid, rate)]
    for number, lost in enumerate(cases):
        data += _envelope_traces(momentum_envelope(array.without(*lost)), number == 0)
    reach = momentum_envelope(array).vertices.max(axis=0)
    scene: dict[str, object] = {
        f"{axis}axis": {"title": {"text": name}, "range": [-1.05 * side, 1.05 * side],
                        "color": "#808080", "gridcolor": "rgba(128,128,128,0.3)",
                        "showbackground": False, "nticks": 3 + round(5 * side / float(reach.max()))}
        for axis, name, side in zip("xyz", ("x1", "x2", "x3"), reach.tolist(), strict=True)
    }  # fmt: skip
    scene |= {"aspectmode": "data", "dragmode": "orbit",
              "camera": {"eye": {"x": 2.2, "y": -1.95, "z": 1.15}}}  # fmt: skip
    menu = {**_MENU, "buttons": [_button(cases, number) for number in range(len(cases))]}
    return {
        "data": data,
        "frames": [],  # marks the figure as one in 3D for the page's script
        "layout": layout(640, scene=scene, margin={"l": 0, "r": 0, "t": 40, "b": 0},
                         updatemenus=[menu]),
    }  # fmt: skip


def _button(cases, number: int) -> dict:
    shown = [True] + [n == number for n in range(len(cases)) for _ in range(2)]
    lost = lost_label(cases[number])
    label = "all wheels" if not cases[number] else f"failed: {lost}"
    return {"label": label, "method": "restyle", "args": [{"visible": shown}]}


def _envelope_traces(envelope: Envelope, visible: bool) -> list[dict]:
    """Transparent faces, and edges as one broken line."""
    points = envelope.vertices
    i, j, k = envelope.triangles().T.tolist()
    same = {"visible": visible, "hoverinfo": "skip", "legendgroup": "envelope"}
    faces = {
        "type": "mesh3d", **xyz(points, 4), "i": i, "j": j, "k": k, "color": FACE, "opacity": 0.3,
        "flatshading": True, "name": "envelope", "showlegend": True, **same,
    }  # fmt: skip
    gap = [np.full(3, np.nan)]
    ends = [point for pair in envelope.edges for point in (*points[list(pair)], *gap)]
    broken = np.reshape(ends, (-1, 3))
    edges = line(broken, BLUE, 3, "edges", showlegend=False, **same) | xyz(broken, 4)
    return [faces, edges]


def _ellipsoid_trace(ellipsoid: Ellipsoid, rate: float) -> dict:
    points, triangles = ellipsoid.mesh(24, 48)
    i, j, k = triangles.T.tolist()
    return {
        "type": "mesh3d", **xyz(points, 4), "i": i, "j": j, "k": k, "color": ORANGE, "opacity": 1.0,
        "hoverinfo": "skip", "name": f"needed for {rate:.4g} deg/s", "showlegend": True,
        "lighting": {"ambient": 0.6, "diffuse": 0.6},
    }  # fmt: skip
