"""A satellite with two magnetometers, `panel` and `side`, of which `side` sticks after a minute."""

import re
import tomllib
from pathlib import Path

from torquer.computer.interface import SENSORS
from torquer.scenario.load import scenario_from_data

#: Where the stuck one has its bit among those for sensors that are judged wrong.
SIDE = 1 << (len(SENSORS) + 1)
_EXAMPLE = Path(__file__).parents[1] / "examples" / "which_sensors.toml"
_BOTH = """\
[[spacecraft.magnetometers]]
name = "panel"
noise_nt = 200

[[spacecraft.magnetometers]]
name = "side"
noise_nt = 200
failures = [{ kind = "stuck", from_s = 60, until_s = 1e6 }]
"""
_CHANGES = {
    r"\[spacecraft\.magnetometer\]\nnoise_nt = 200\n": _BOTH,
    r"(?m)^rate_deg_s = .*$": "rate_deg_s = [0.6, -0.5, 0.6]",
    r'kind = "wheel_pd"\n(.+\n)+': 'kind = "off"\n',
}


def two_magnetometers_text() -> str:
    """The scenario, with a filter that notices, as a file has it."""
    text = _EXAMPLE.read_text(encoding="utf-8")
    for old, new in _CHANGES.items():
        text, count = re.subn(old, new, text)
        assert count == 1, old
    return text


def two_magnetometers(duration_s: float = 120.0):
    """The scenario."""
    scenario = scenario_from_data(tomllib.loads(two_magnetometers_text()))
    return scenario.replace("simulation.duration_s", duration_s)
