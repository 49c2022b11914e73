"""The logic of Sun pointing by S-dot as parallel regions. Source of the logic: SDOT, Fig. 3.18.

Damping goes on above 0.7 deg/s and off below 0.5; S-dot rests in the shadow; an axis that has
been away from the Sun for an hour is turned by S-dot reversed for ten minutes, again and again.
"""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from flown_modes import Flown, Z, reading, spinning

from torquer.computer.modes.check import findings
from torquer.computer.modes.spec import Modes

FILE = Path(__file__).parents[2] / "data" / "sun_pointing_modes.toml"
MODES = Modes.model_validate(tomllib.loads(FILE.read_text()))
ORBIT_S, LIT_S, STEP_S = 5500.0, 3400.0, 10.0
AWAY = (np.sin(np.radians(170.0)), 0.0, np.cos(np.radians(170.0)))


def lit_at(t_s):
    """Sunlight in the first part of every orbit."""
    return t_s % ORBIT_S < LIT_S


def flown(until_s, sun=lambda t_s: AWAY, rate_deg_s=lambda t_s: 0.6):
    """Times, and the states of the three regions after each reading."""
    run, found = Flown(MODES), []
    times = np.arange(0.0, until_s, STEP_S)
    for t in times:
        run(reading(t, sun=sun(t) if lit_at(t) else (0.0, 0.0, 0.0), **spinning(rate_deg_s(t))))
        found.append(run.now)
    return times, np.array(found).T


def test_shadow_pauses_but_does_not_reset_the_wrong_way_hour():
    """3600 s of sunlight are not full within one orbit's 3400 s: the rest is of the next one."""
    times, (_, _, capture) = flown(20000.0)
    began = times[1:][(capture[1:] == "wrong_way") & (capture[:-1] == "watching")]
    sunlit = np.array([lit_at(t) for t in times])
    since = STEP_S * np.cumsum(sunlit)
    assert began[0] == pytest.approx(ORBIT_S + 3600.0 - LIT_S, abs=3 * STEP_S)
    assert np.interp(began[0], times, since) == pytest.approx(3600.0, abs=3 * STEP_S)
    assert len(began) == 3
    assert np.sum(capture == "wrong_way") * STEP_S == pytest.approx(3 * 600.0, abs=STEP_S)


def test_the_attempts_end_once_the_axis_has_turned():
    times, (_, _, capture) = flown(40000.0, sun=lambda t: AWAY if t < 7000.0 else Z)
    assert "wrong_way" in capture and set(capture[times > 8000.0]) == {"watching"}


def test_s_dot_is_reversed_in_the_light_only():
    times, (pointing, _, capture) = flown(20000.0)
    dark = np.array([not lit_at(t) for t in times])
    settled = dark & np.roll(dark, 3) & (times > 30.0)
    assert set(pointing[settled]) == {"shadow"}
    assert np.any(pointing == "reversed") and np.any(capture[settled] == "watching")
    lasting = (capture == "wrong_way") & np.roll(capture == "wrong_way", 3)
    assert set(pointing[lasting & ~dark]) == {"reversed"}


def test_damping_has_its_hysteresis_in_light_and_shadow_alike():
    times, (_, damping, _) = flown(12000.0, rate_deg_s=lambda t: 0.6 - 0.15 * np.cos(t / 800.0))
    rates = 0.6 - 0.15 * np.cos(times / 800.0)
    assert set(damping[rates > 0.701]) == {"on"} and set(damping[rates < 0.499]) == {"off"}
    changes = np.flatnonzero(damping[1:] != damping[:-1]) + 1
    assert [damping[i] for i in changes] == ["on", "off"] * 2 + ["on"]
    assert all(rates[i] > 0.7 if damping[i] == "on" else rates[i] < 0.5 for i in changes)


def test_the_checker_finds_nothing_but_that_the_watch_may_last():
    found = [x for x in findings(MODES) if x.kind not in ("switching rate", "hysteresis")]
    assert [(x.kind, x.states) for x in found] == [("waits for the unknown", ("watching",))]
