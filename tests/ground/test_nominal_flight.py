"""The shipped limits in a flight of which all goes well: they do not cry wolf."""

import pytest
from onboard_ground import scenario

from torquer.compile import engine
from torquer.computer.names import Names
from torquer.flight.packets.software_file import load_link
from torquer.flight.packets.station import Station
from torquer.flight.software.core import Core
from torquer.ground.alarm import Now
from torquer.ground.alarms import Alarms
from torquer.ground.limits import Limits
from torquer.ground.recording import Judge

#: From boot by acquisition to science, with some time there [control steps of a second].
STEPS = 8000


@pytest.mark.slow
@pytest.mark.skipif(not engine.COMPILED, reason="a whole flight: minutes without JIT")
def test_from_boot_to_science_only_the_saturated_wheel_calls():
    core, link = Core(scenario(864000.0), None, None), load_link()
    station, limits = Station(link), Limits(link.dictionary, Names({}, (), {}, {}, ()))
    judge, alarms, modes, events = Judge(station, link.dictionary), Alarms(set()), {}, []
    for step in range(STEPS):
        for _, row in judge.rows(station.receive(core.tick()), 0):
            for rule, verdict, value in limits.judge(row, modes):
                now = Now(1000 * step, float(step))
                if event := alarms.judge(rule, verdict, value, row.time_ms, now):
                    events.append((event.what, event.alarm.key, event.alarm.severity))
    assert modes == {"extended.stb_mode": 3}, "science"
    assert {(key, severity) for _, key, severity in events} == {("wheels.speed_5", "warning")}
