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
from torquer.analysis.goals import find_goals, goal_signal
from torquer.campaign.faults.fly import simulate_or_stop
from torquer.campaign.faults.kinds import Fault, find_faults
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
#: States of safe mode and detumbling.
SAFE = ("safe", "safe_spin_up", "safe_reversed", "detumbling")
#: The best outcome first.
OUTCOMES = ("science", "1X", "coarse", "again", "Sun", "slow", "spins")


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
    (goal,) = find_goals(whole)
    error_deg = float(goal_signal(goal, tail, whole).max())
    rate_deg_s = float(np.degrees(np.linalg.norm(tail.omega_body.values, axis=1)).max())
    third = Rotation.from_quat(tail.q_body_to_inertial.values).as_matrix()[:, :, 2]
    sun = tail.sun_inertial.values
    cosine = np.sum(third * sun, axis=1) / np.linalg.norm(sun, axis=1)
    sun_deg = float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))).max())
    meanings = tail.mode_stabilisation.attrs["flag_meanings"].split()
    there = [meanings[int(number)] for number in tail.mode_stabilisation.values]
    if error_deg < 30.0:
        return Ending("science" if error_deg < 5.0 else "coarse", error_deg, "deg")
    if sun_deg < 60.0:
        return Ending("1X" if {*there} == {"one_axis"} else "Sun", sun_deg, "deg")
    if there[-1] not in SAFE:
        return Ending("again", rate_deg_s, "deg/s")
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
- *again*: attitude control by wheels goes on after it was lost for a while, as it is when a device
  is given another chance; the rate is the greatest of that while;
- *Sun*: the third axis within 60 deg of the Sun, in safe mode;
- *slow*: in safe mode or B-dot, below 1 deg/s, the Sun not captured (yet);
- *spins*: the same, up to the rate shown. The release is at 2.2 deg/s.

Whatever is lost ends in safe mode or better. What the source promises comes out: without Sun
sensors science goes on with magnetometer and gyro; without a gyro as before in the light, with the
field alone in the shadow; with one coil less as before; without a magnetometer by Sun sensors and
gyro, lost in science for eight to nine hours (up to 43 deg at the end of a shadow), then by S-dot.

S-dot needs a spin. A satellite that has none when it loses its magnetometer takes a day or more
until it is captured (of all starts S-dot captures [three quarters in a
day](../theory/sdot.md)); with a magnetometer the coils give it one. A coil that is stuck on is a
magnet, against which the others can only brake.

What each guard reads, and what it does not see:

- *Sensors*: each other, the models and, for a wrong sign, what the coils do. Not seen: a fault
  within the tolerance.
- *Coils*: how the momentum changes, by gyro and tachometers. Not seen: a coil that is not used.
- *Wheels*: how long the acquisition takes, and the momentum by the tachometers. Not seen: a wheel
  without which science is reached.
- *End of B-dot*: the rate by the field, while the magnetometer is not suspected. Not seen: a spin
  about the field, for minutes.
- *Spin*: whatever turns, gyro, field or Sun, whichever is suspected. Not seen: a dipole that is
  stuck on.
- *Wrong side of the Sun*: the Sun sensors alone; S-dot reversed for ten minutes does no harm.
""".splitlines()


def main():
    """Fly all and write the page."""
    rows = {"none": [ending(None, mode) for mode in STRIKES]}
    for fault in find_faults(scenario()):
        rows[fault.name] = [ending(fault, mode) for mode in STRIKES]
        print(fault.name, *rows[fault.name], sep="; ", flush=True)
    PAGE.write_text(page(rows), encoding="utf-8")


if __name__ == "__main__":
    main()
