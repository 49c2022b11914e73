"""The satellite's clock as the ground knows it: pace, and seconds that a header can name."""

import time

import pytest

from torquer.ground.archive import EPOCH_MS
from torquer.ground.satellite_clock import SatelliteClock


@pytest.fixture
def at(monkeypatch):
    """Sets the time of this machine."""
    now = [1000.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])

    def set_to(t_s):
        now[0] = 1000.0 + t_s

    return set_to


def test_nothing_is_known_before_telemetry():
    clock = SatelliteClock()
    assert clock.latest_ms is clock.now_ms() is clock.seconds_in(30.0) is None


@pytest.mark.parametrize("pace", [1.0, 5.0, 60.0])
def test_it_goes_at_its_pace(at, pace):
    clock = SatelliteClock()
    for k in range(30):
        at(0.1 * k)
        clock.hear(EPOCH_MS + 50_000 + round(100 * k * pace))
    assert clock.seconds_in(30.0) == pytest.approx(50.0 + pace * 32.9, abs=0.2)
    at(4.9)
    assert clock.now_ms() == clock.latest_ms + 2000
    assert clock.seconds_in(30.0) == pytest.approx(50.0 + pace * 34.9, abs=0.2)


@pytest.mark.parametrize("pace", [0.0, -1.0, 20_000.0])
def test_a_time_that_no_header_can_name(at, pace):
    """Too fast, or a clock that was set back or stands."""
    clock = SatelliteClock()
    for k in range(4):
        at(1.0 * k)
        clock.hear(EPOCH_MS + 10**10 + round(1000 * k * pace))
    assert clock.seconds_in(30.0) is None
