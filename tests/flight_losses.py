"""Each single fault in each mode of Chibis-M's flight software: what the flight ends in.

`python tests/flight_losses.py` flies them all in ten minutes and writes the page
docs/faults/chibis_m_flight.md.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from torquer import Scenario, load_scenario
from torquer.analysis.goals import goals_of, signal_of
from torquer.campaign.faults.fly import simulate_or_stop
from torquer.campaign.faults.kinds import Fault, faults_of
from torquer.scenario.change import value_at, with_values

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "faults" / "chibis_m_flight.md"
#: When faults strike [s], by the mode of the flight without a fault then; POINT2DIR is commanded.
STRIKES = {
    "safe": 60.0,
    "B-dot": 1800.0,
    "waiting": 4000.0,
    "TRIAD, 3X": 4700.0,
    "MAG_DSS, 3X": 5100.0,
    "science": 6000.0,
    "science, shadow": 8000.0,
    "POINT2DIR": 10020.0,
    "1X": 12000.0,
}
COMMANDED = ("POINT2DIR", "1X")
TURN_S = 9900.0
#: The best outcome first.
OUTCOMES = ("science", "1X", "coarse", "Sun", "slow", "spins")


class Ending(NamedTuple):
    """What the last revolution of a flight was: the outcome, the number that describes it."""

    outcome: str
    value: float
    unit: str

    def __str__(self):
        return f"{self.outcome} {self.value:.2g} {self.unit}"


def scenario():
    """The example."""
    return load_scenario(ROOT / "examples" / "chibis_m_flight.toml")


def ending(fault: Fault | None, mode: str) -> Ending:
    """What a flight with a fault that strikes in a mode ends in."""
    whole = turning() if mode in COMMANDED else scenario()
    return ending_of(simulate_or_stop(fault.strikes(whole, STRIKES[mode]) if fault else whole))


def turning() -> Scenario:
    """The example with a transition in place of the command for a turn."""
    key = "control.modes.regions.stabilisation.states.science.transitions"
    own = value_at(scenario(), key)
    now = [{"signal": "time_s", "above": TURN_S - 0.5}, {"signal": "time_s", "below": TURN_S + 9.5}]
    return with_values(scenario(), {key: [*own, {"to": "point2dir", "when": now}]})


def ending_of(result) -> Ending:
    """What the last revolution of a flight was."""
    whole = scenario()
    t = result["time"].values
    tail = result.isel(time=np.flatnonzero(t >= t[-1] - whole.orbit.period_s))
    (goal,) = goals_of(whole)
    error_deg = float(signal_of(goal, tail).max())
    rate_deg_s = float(np.degrees(np.linalg.norm(tail.omega_body.values, axis=1)).max())
    third = Rotation.from_quat(tail.q_body_to_inertial.values).as_matrix()[:, :, 2]
    sun = tail.sun_inertial.values
    cosine = np.sum(third * sun, axis=1) / np.linalg.norm(sun, axis=1)
    sun_deg = float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))).max())
    meanings = tail.mode_stabilisation.attrs["flag_meanings"].split()
    there = {meanings[int(number)] for number in tail.mode_stabilisation.values}
    if error_deg < 30.0:
        return Ending("science" if error_deg < 5.0 else "coarse", error_deg, "deg")
    if sun_deg < 60.0:
        return Ending("1X" if there == {"one_axis"} else "Sun", sun_deg, "deg")
    return Ending("slow" if rate_deg_s < 1.0 else "spins", rate_deg_s, "deg/s")


def page(rows: dict[str, list[Ending]]) -> str:
    """The page: a row for each fault, a column for each mode in which it strikes."""
    flat = [each for row in rows.values() for each in row]
    counts = {name: sum(each.outcome == name for each in flat) for name in OUTCOMES}
    head = ["fault", *STRIKES]
    lines = [
        *TEXT,
        "",
        f"Of {len(flat)} flights: {', '.join(f'{n} {name}' for name, n in counts.items())}.",
        "",
        f"| {' | '.join(head)} |",
        f"|{' --- |' * len(head)}",
        *(f"| {' | '.join([name, *map(str, row)])} |" for name, row in rows.items()),
    ]
    return "\n".join(lines) + "\n"


TEXT = """# Single faults of Chibis-M's flight software

The modes of `examples/chibis_m_flight.toml`, flown for 24 h with every single fault that
`torquer faults` knows of its sensors, coils, wheels and computer, in each mode. No flag is raised:
what is found, the tables find. Made by `python tests/flight_losses.py`; the outcome is that of the
last revolution, with its greatest angle or rate:

- *science*: orbital attitude within 5 deg; *coarse*: within 30 deg;
- *1X*: the third axis held to the Sun by wheels, as commanded;
- *Sun*: in safe mode, the third axis within 60 deg of the Sun;
- *slow*: in safe mode or B-dot, turning at less than 1 deg/s, the Sun not (yet) captured;
- *spins*: the same, up to the rate shown. The release is at 2.2 deg/s.""".splitlines()


def main():
    """Fly all and write the page."""
    rows = {"none": [ending(None, mode) for mode in STRIKES]}
    for fault in faults_of(scenario()):
        rows[fault.name] = [ending(fault, mode) for mode in STRIKES]
        print(fault.name, *rows[fault.name], sep="; ", flush=True)
    PAGE.write_text(page(rows), encoding="utf-8")


if __name__ == "__main__":
    main()
