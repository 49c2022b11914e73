"""Mode tables driven reading by reading, and drawn: the logic of SDOT's block diagrams.

A table is evaluated once a second by the kernel that the simulation runs, on what a computer would
know. Thresholds are found by halving, from the side on which the state is kept.
"""

import math
from collections.abc import Callable

import numpy as np
from matplotlib.patches import FancyBboxPatch

from gallery.drawing import BLUE, COLOURS, GREY
from torquer.compile.engine import records
from torquer.computer.blocks.adapter import flat
from torquer.computer.interface import PLACES, UNKNOWN_ESTIMATE, Ephemeris, nothing_known
from torquer.computer.modes.graph import find_edges
from torquer.computer.modes.layout import ROW, layout
from torquer.computer.modes.spec import Modes, Region
from torquer.computer.modes.table import switch_modes
from torquer.report.common.figure import sheet
from torquer.spacecraft.sensors.devices import DEVICES

#: Turns of a search by halving: to a millionth of the interval.
_HALVINGS = 20


class Logic:
    """A mode table in its first states at time zero."""

    def __init__(self, modes: Modes, laws=(), estimators=()):
        self.regions = list(modes.regions)
        self.names = [name for region in modes.regions.values() for name in region.states]
        numbered = ({name: k for k, name in enumerate(names)} for names in (laws, estimators))
        self.table, self.state = modes.pack(*numbered)
        self.t_s = 0.0

    def __call__(self, seconds: int = 1, **known) -> "Logic":
        """So many seconds of the same knowledge: see `_record`."""
        for _ in range(seconds):
            switch_modes(self.table, self.state, _record(self.t_s, **known))
            self.t_s += 1.0
        return self

    def now(self, region: str) -> str:
        """The state of a region."""
        number = int(self.state.regions["state"][self.regions.index(region)])
        return self.names[number]

    def lasts_s(self, region: str, longest_s: int, **known) -> float:
        """Seconds until a region leaves its state; infinite if it has not by then."""
        begun_s, state = self.t_s, self.now(region)
        while self.t_s <= begun_s + longest_s:
            if self(**known).now(region) != state:
                return self.t_s - 1.0 - begun_s
        return math.inf


def _record(t_s, sun_deg=None, rate_deg_s=0.0, error_deg=0.0, sigma_deg=0.1, age_s=0.0):
    """What the computer knows: `sun_deg`: third axis to the Sun, None unseen; `rate_deg_s`: about
    the second axis; `error_deg`: of the attitude to the inertial frame; age of the estimate."""
    known = nothing_known()
    known["t_s"] = t_s
    half, sun = math.radians(0.5 * error_deg), math.radians(sun_deg or 0.0)
    seen = (0.0, 0.0, 0.0) if sun_deg is None else (math.sin(sun), 0.0, math.cos(sun))
    for number, device in enumerate(DEVICES):
        if device.given == "sun_body":
            known["readings"][0, number, : device.count] = seen
    estimate = UNKNOWN_ESTIMATE._replace(
        t_s=t_s - age_s,
        q_body_to_inertial=(math.sin(half), 0.0, 0.0, math.cos(half)),
        omega_body_rad_s=(0.0, math.radians(rate_deg_s), 0.0),
        sigma_rad=math.radians(sigma_deg),
    )
    numbers = known.view(np.float64)
    numbers[PLACES["estimate_s"].start :] = [*flat(estimate), *flat(Ephemeris())]
    return records(known)[0]


def turning_point(kept: Callable[[float], bool], inside: float, outside: float) -> float:
    """The value up to which something is kept, between one where it is and one where it is not."""
    if not kept(inside) or kept(outside):
        raise ValueError(
            f"turning point: must be kept at {inside:g} only; received {kept(inside)} there and "
            f"{kept(outside)} at {outside:g}"
        )
    for _ in range(_HALVINGS):
        middle = 0.5 * (inside + outside)
        inside, outside = (middle, outside) if kept(middle) else (inside, middle)
    return 0.5 * (inside + outside)


def ways(region: Region) -> set[tuple[str, str]]:
    """Pairs of states that a transition leads from and to."""
    return {(edge.leave, edge.to) for edge in find_edges(region)}


def draw_table(modes: Modes, title: str):
    """A mode table as `torquer modes --picture` lays it out."""
    found = layout(modes)
    scale = 1.0 / 110.0
    figure = sheet(scale * found.width + 0.2, scale * found.height + 0.5, title)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0 - 0.4 / (scale * found.height + 0.5)))
    axes.set(xlim=(0.0, found.width), ylim=(found.height, 0.0))
    axes.axis("off")
    for (y, name), rule in zip(found.titles, (None, *found.rules), strict=False):
        axes.text(15.0, y, name, style="italic", fontsize=7.4, color="#666666")
        if rule is not None:
            axes.axhline(rule, color=GREY, lw=0.6, ls=(0, (2, 4)))
    for number, path in enumerate(found.paths):
        colour = COLOURS[number % len(COLOURS)]
        axes.plot(*zip(*path.corners, strict=True), color=colour, lw=1.0)
        end_x, end_y = path.corners[-1]
        axes.plot(end_x + 4.0, end_y, "<", color=colour, ms=5)
        axes.text(*path.label_at, path.label, fontsize=7.2, parse_math=False)
    for box in found.boxes:
        round_ = {"boxstyle": "round,pad=0,rounding_size=6", "fc": "#f3f6fa", "ec": "#445566"}
        axes.add_patch(FancyBboxPatch((box.x, box.y), box.width, box.height, **round_))
        for row, line in enumerate(box.lines):
            axes.text(box.x + 10.0, box.y + (row + 0.7) * ROW, line, fontsize=7.4,
                      fontweight="normal" if row else "bold", parse_math=False)  # fmt: skip
    return figure


#: Causes of transitions by the first signal that is asked, and their colours.
CAUSES = {
    "rate": ("rate_deg_s", "attitude_rate_deg_s"),
    "accuracy or age": ("attitude_error_deg", "estimate_sigma_deg", "estimate_age_s"),
    "Sun": ("sun_in_view", "axis_to_sun_deg"),
    "anomaly or loss": ("flag", "sensor_suspected", "coil_suspected", "wheel_momentum_n_m_s"),
    "another region": ("in_state",),
}


def cause_of(transition) -> str:
    """What a transition is about: a signal of its own if there is one, else another region."""
    asked = [condition for condition in transition.when if condition.above is not None]
    if any((condition.state or "").endswith(("_lost", "_failed")) for condition in asked):
        return "anomaly or loss"
    signals = {condition.signal for condition in transition.when}
    return next((cause for cause, known in CAUSES.items() if signals & set(known)), "time")


def draw_ways(axes, region: Region, colours: dict[str, str]) -> None:
    """The states of a region on an ellipse, an arrow for each way and cause."""
    states = list(region.states)
    turns = 2.0 * np.pi * np.arange(len(states)) / len(states) + 0.5 * np.pi
    places = dict(zip(states, np.stack([1.6 * np.cos(turns), np.sin(turns)], axis=1), strict=True))
    drawn = {(e.leave, e.to, cause_of(e.transition)): None for e in find_edges(region)}
    bends: dict[tuple[str, str], int] = {}
    for leave, to, cause in drawn:
        bends[leave, to] = bends.get((leave, to), 0) + 1
        bend = 0.02 + 0.11 * bends[leave, to]
        axes.annotate("", places[to], places[leave], arrowprops={
            "arrowstyle": "-|>", "color": colours[cause], "lw": 1.1, "shrinkA": 17, "shrinkB": 17,
            "connectionstyle": f"arc3,rad={bend:.2f}"})  # fmt: skip
    box = {"boxstyle": "round,pad=0.35", "fc": "#f3f6fa", "ec": BLUE, "lw": 0.9}
    for state, place in places.items():
        name = state.replace("_", "\n", 1)
        axes.text(*place, name, ha="center", va="center", fontsize=8.5, bbox=box)
    axes.set(xlim=(-2.1, 2.1), ylim=(-1.35, 1.35))
    axes.axis("off")
