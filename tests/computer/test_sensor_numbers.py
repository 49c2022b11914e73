"""Sensors are numbered once, in the interface; filters have channels, made from these numbers."""

import re
from pathlib import Path
from types import SimpleNamespace
from typing import get_args

import pytest

import torquer
from torquer.computer import interface
from torquer.computer.blocks.plugin import plain_function
from torquer.computer.estimation.isolation import STUCK, USED
from torquer.computer.estimation.kalman import isolate
from torquer.computer.estimation.measurements.measurement import CHANNELS, FIRST_CELL, SENSOR_OF
from torquer.computer.estimation.sensor_keys import NOISE_KEYS, SENSOR_LABELS, SensorKeys
from torquer.computer.interface import KNOWN, SENSORS, SHORT_NAMES

PACKAGE = Path(torquer.__file__).parent
NAMES = "|".join((*SENSORS, "sensors")).upper()
#: Where a file gives such a name a value, alone or among others.
NAMED = re.compile(rf"^\(?[A-Z_, \n]*\b({NAMES})\b[A-Z_, \n]*\)? =", re.M)


def test_the_numbers_of_sensors_are_their_places():
    assert [getattr(interface, name.upper()) for name in SENSORS] == [*range(len(SENSORS))]


def test_no_other_file_numbers_sensors():
    texts = {path: path.read_text(encoding="utf-8") for path in PACKAGE.rglob("*.py")}
    found = {path.relative_to(PACKAGE).as_posix() for path in texts if NAMED.search(texts[path])}
    assert found == {"computer/interface.py"}


def test_times_and_flags_are_recorded_in_sensor_number_order():
    for name, first in (("{}_s", "b_s"), ("isolated_{}", "isolated_b")):
        place = KNOWN.names.index(first)
        wanted = [name.format(short) for short in SHORT_NAMES]
        assert [*KNOWN.names[place : place + len(SENSORS)]] == wanted


def test_filter_knows_its_sensors_by_their_channel_names():
    (choice, _) = get_args(SensorKeys.model_fields["sensors"].annotation)
    assert [*get_args(choice)] == [*SENSOR_OF] == [*NOISE_KEYS]
    assert len(SENSOR_LABELS) == CHANNELS


@pytest.mark.parametrize("channel", range(CHANNELS))
def test_an_isolated_channel_is_its_sensor_on_board(channel):
    states = [STUCK if k == channel else USED for k in range(CHANNELS)]
    memory = SimpleNamespace(isolated=states, rate_error=0.0, unrest=0.0)
    parameters = SimpleNamespace(sensing=SimpleNamespace(has_gyro=1.0))
    number = [*SENSOR_OF.values()][min(channel, FIRST_CELL)]
    flags = plain_function(isolate)(parameters, memory)
    assert flags == tuple(float(k == number) for k in range(len(SENSORS)))
