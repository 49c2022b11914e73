"""A satellite from its file to a verdict: detumbling, hold, sensors, wheels and faults in turn."""

from collections.abc import Callable
from dataclasses import dataclass

from torquer.analysis.notes.orbit_notes import orbit_notes
from torquer.base.rows import Row, as_html
from torquer.design.gain_sweep import GainSweep
from torquer.design.mission_parts import FAILS, LEFT_OUT, PARTS, STATES, Part, walk
from torquer.design.requests import MissionRequest
from torquer.scenario.spec import Scenario


@dataclass(frozen=True)
class MissionDesign:
    """What each part of the design says of a satellite."""

    scenario: Scenario
    request: MissionRequest
    parts: tuple[Part, ...]

    @property
    def state(self) -> str:
        """'holds', 'doubtful' or 'fails': that of the worst part."""
        walked = [part.state for part in self.parts if part.state != LEFT_OUT]
        return max(walked, key=STATES.index, default=LEFT_OUT)

    @property
    def fails(self) -> bool:
        """Whether a part fails."""
        return self.state == FAILS

    def open_points(self) -> list[str]:
        """What is left to decide, by the name of the part, and what holds for all of them."""
        found = [f"{part.name}: {point}" for part in self.parts for point in part.open]
        return [*found, *orbit_notes(self.scenario)]

    def table(self) -> list[list[Row]]:
        """A line for each part."""
        return [
            [
                Row("", "part", text=part.name),
                Row("state", "verdict", part.state, text=part.state),
                Row("words", value=part.words),
                Row("open", value=[*part.open]),
            ]
            for part in self.parts
        ]

    def data(self) -> dict:
        """Plain data: verdicts, and what each function of a part says."""
        return {
            "name": self.scenario.name,
            "verdict": self.state,
            "parts": {
                part.name: {"state": part.state, "words": part.words, "open": [*part.open],
                            "answer": part.data}
                for part in self.parts
            },
            "open": self.open_points(),
        }  # fmt: skip

    def lines(self) -> list[str]:
        """The verdicts and the open points."""
        width = max(len(part.name) for part in self.parts) + 2
        return [
            f"{self.scenario.name}: {self.state}",
            *(f"{part.name:{width}}{part.state:10}{part.words}" for part in self.parts),
            *(f"open: {point}" for point in self.open_points()),
        ]

    def _repr_html_(self) -> str:
        return as_html(self.table(), [*(p.words for p in self.parts), *self.open_points()])


def mission(
    scenario: Scenario,
    request: MissionRequest = MissionRequest(),
    progress: Callable[[float], None] | None = None,
) -> MissionDesign:
    """Walk a satellite through all parts of its design that it has, and say what each holds.

        found = mission(torquer.load_scenario("my_satellite.toml"))
        found.state                 # "holds", "doubtful" or "fails"
        found.parts[0].answer       # what `detumble` gave
        found.open_points()

    Each part is the function of `torquer.design`, or the analysis, of its name; a part that the
    satellite lacks is left out with the reason; one that its function refuses is doubtful. The
    faults are flown with the gain of B-dot that the first part chose. `progress`: called with the
    fraction done.
    """
    parts: list[Part] = []
    for name in PARTS:
        parts.append(walk(name, scenario, request))
        if isinstance(found := parts[-1].answer, GainSweep) and found.law is not None:
            scenario = found.with_gain()
        if progress:
            progress(len(parts) / len(PARTS))
    return MissionDesign(scenario, request, tuple(parts))
