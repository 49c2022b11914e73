"""Errors of the ephemeris on board over a day: the table of design/0016.

What the exported kernels give for the elements of the start, every 10 s, less the environment of
the simulation, whose field is IGRF-14 to degree 13 here; of the field root mean square and
greatest. `python benchmarks/on_board_ephemeris.py`
"""

from pathlib import Path

import numpy as np

import torquer
from torquer.computer.on_board_environment import ephemeris_along
from torquer.environment.field import FIELDS
from torquer.flight.c99.ephemeris import find_ephemeris

EXAMPLES = Path(__file__).parents[1] / "examples"
CASES = (
    ("chibis_m_day", "kepler"),
    ("chibis_m_detumble", "sgp4"),
    ("chibis_m_detumble", "kepler"),
    ("five_days", "sgp4"),
    ("five_days", "kepler"),
)
DEGREES = (4, 8, 13)
T_S = np.arange(0.0, 86400.0, 10.0)


def errors(name: str, kind: str, degree: int) -> tuple[float, float, float, float, float]:
    """Greatest error of the position [km]; rms and greatest of the field [nT]; greatest of the Sun
    [deg]; percentage of instants with another answer to whether half of the Sun is seen."""
    scenario = torquer.load_scenario(EXAMPLES / f"{name}.toml")
    full = scenario.environment.model_copy(update={"field": FIELDS["igrf14"]()})
    own = scenario.control.ephemeris.model_copy(update={"field": FIELDS["igrf14"](degree=degree)})
    control = scenario.control.model_copy(update={"ephemeris": own})
    scenario = scenario.model_copy(update={"environment": full, "control": control})
    truth, on_board = scenario.orbit_environment(), find_ephemeris(scenario, kind)
    nowhere = np.zeros((len(T_S), 3))
    found = ephemeris_along(kind, on_board.models, on_board.elements, T_S, nowhere, nowhere)
    r, v = truth.state(T_S)
    sun = truth.sun(T_S) - r
    sun /= np.linalg.norm(sun, axis=1)[:, None]
    field_nt = 1e9 * _lengths(found[:, 6:9] - truth.field(T_S, r, v))
    apart = np.degrees(2.0 * np.arcsin(0.5 * _lengths(found[:, 12:15] - sun)))
    lit = truth.sunlit_fraction(T_S, r) > 0.5
    return (
        float(1e-3 * _lengths(found[:, :3] - r).max()),
        float(np.sqrt(np.mean(field_nt**2))),
        float(field_nt.max()),
        float(apart.max()),
        100.0 * float(np.mean((found[:, 15] > 0.5) != lit)),
    )


def _lengths(vectors: np.ndarray) -> np.ndarray:
    return np.linalg.norm(vectors, axis=1)


def _shown(error: float) -> str:
    """Two digits, more above 100."""
    return f"{error:.0f}" if error >= 10.0 else f"{error:.2g}"


def main() -> None:
    """Print the table."""
    print("| scenario | place by | degree | position, km | field, nT | Sun, deg | light, % |")
    print("|---|---|---|---|---|---|---|")
    for name, kind in CASES:
        for degree in DEGREES:
            km, rms, most, sun, light = errors(name, kind, degree)
            print(
                f"| {name} | {kind} | {degree} | {km:.2g} | {_shown(rms)} / {_shown(most)} "
                f"| {sun:.2g} | {light:.2g} |"
            )


if __name__ == "__main__":
    main()
