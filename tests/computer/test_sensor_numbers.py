"""Sensors are numbered once, in the interface; filters have channels, made from these numbers."""

import importlib.util
import re
from pathlib import Path
from typing import NamedTuple, get_args

import numpy as np
import pytest

import torquer
from torquer.base.user_source import plain_function
from torquer.computer import interface
from torquer.computer.estimation.channels import isolate, isolate_units
from torquer.computer.estimation.filter import NO_UNITS
from torquer.computer.estimation.isolation_states import STUCK, USED
from torquer.computer.estimation.measurements.table import (
    BY_NAME,
    CHANNELS,
    DEVICE_OF,
    FIRST_CELL,
    UNITS_AT,
)
from torquer.computer.estimation.sensor_keys import NOISE_KEYS, SENSOR_LABELS, SensorKeys
from torquer.computer.inputs import Inputs, read_inputs
from torquer.computer.interface import ROWS, SENSORS, nothing_known, reading_places
from torquer.spacecraft.sensors.device import MOST_PARTS, MOST_UNITS
from torquer.spacecraft.sensors.devices import DEVICES, Sensors

PACKAGE = Path(torquer.__file__).parent
NAMES = "|".join((*SENSORS, "sensors")).upper()
#: Where a file gives such a name a value, alone or among others.
NAMED = re.compile(rf"^\(?[A-Z_, \n]*\b({NAMES})\b[A-Z_, \n]*\)? =", re.M)


def test_the_numbers_of_sensors_are_their_places_in_the_table():
    assert [device.name for device in DEVICES] == [*SENSORS]
    named = {name.upper(): number for number, name in enumerate(SENSORS)}
    found = {name: number for name, number in vars(interface).items() if name in named}
    assert found and found == {name: named[name] for name in found}


def test_no_other_file_numbers_sensors():
    texts = {path: path.read_text(encoding="utf-8") for path in PACKAGE.rglob("*.py")}
    found = {path.relative_to(PACKAGE).as_posix() for path in texts if NAMED.search(texts[path])}
    assert found == {"computer/interface.py"}


def made_files():
    spec = importlib.util.spec_from_file_location("made_code", PACKAGE.parent / "docs/made_code.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.made_files()


def test_made_files_are_those_that_the_table_makes():
    for path, text in made_files().items():
        assert text == (PACKAGE.parent / path).read_text(encoding="utf-8"), path


def test_each_device_has_its_reading_and_its_time_in_the_inputs():
    known = nothing_known()
    known["readings"] = 10.0 * np.arange(ROWS)[:, None] + np.arange(MOST_PARTS)
    known["read_s"] = np.arange(ROWS)
    inputs = plain_function(read_inputs)(known.view(np.recarray)[0])
    assert inputs.read_at._fields == tuple(f"{name}_s" for name in SENSORS)
    assert inputs.read_at == tuple(range(len(SENSORS)))
    for number, device in enumerate(DEVICES):
        wanted = tuple(10.0 * number + k for k in range(device.count))
        assert getattr(inputs, device.given) == wanted
        assert tuple(known.view(np.float64)[reading_places(device.name)]) == wanted
    for unit, (read_s, *reading) in enumerate(inputs.units):
        row = len(SENSORS) + unit
        assert (read_s, reading) == (row, [10.0 * row + k for k in range(MOST_PARTS)])


def test_scenarios_have_a_key_for_each_device_that_they_can_describe():
    one = {device.name: device.spec for device in DEVICES if device.spec}
    several = {device.several: device.spec for device in DEVICES if device.several}
    assert {*one, *several} == {*Sensors.model_fields}
    for name, field in Sensors.model_fields.items():
        spec = one.get(name, several.get(name))
        assert spec in (field.annotation, *get_args(field.annotation)), name


def test_filter_knows_its_sensors_by_their_channel_names():
    (choice, _) = get_args(SensorKeys.model_fields["sensors"].annotation)
    assert [*get_args(choice)] == [*BY_NAME] == [*NOISE_KEYS]
    assert len(SENSOR_LABELS) == UNITS_AT


class Memory(NamedTuple):
    """What is asked of a filter's memory."""

    isolated: np.ndarray
    unit_constants: np.ndarray
    rate_error: float = 0.0
    unrest: float = 0.0


class Sensing(NamedTuple):
    """What is asked of a filter's sensors."""

    has_gyro: float = 1.0


class Parameters(NamedTuple):
    """What is asked of a filter's parameters."""

    sensing: Sensing = Sensing()


def make_memory(*isolated, units=NO_UNITS):
    states = [STUCK if k in isolated else USED for k in range(CHANNELS)]
    return Memory(np.array(states, float), np.array(units))


@pytest.mark.parametrize("channel", range(UNITS_AT))
def test_an_isolated_channel_is_its_sensor_on_board(channel):
    memory = make_memory(channel)
    parameters = Parameters()
    number = SENSORS.index(DEVICE_OF[[*BY_NAME][min(channel, FIRST_CELL)]].name)
    inputs = Inputs(0.0)
    flags = plain_function(isolate)(inputs, parameters, memory)
    assert flags == tuple(float(k == number) for k in range(len(SENSORS)))


def test_a_kind_is_isolated_once_all_of_its_units_are():
    row = np.zeros((1, len(NO_UNITS[0])))  # a magnetometer
    units = np.concatenate([row, row, NO_UNITS * (MOST_UNITS - 2)])
    parameters = Parameters()
    inputs = Inputs(0.0)
    number = SENSORS.index(DEVICE_OF[next(iter(BY_NAME))].name)
    for wrong in ((), (0,), (1,), (0, 1)):
        memory = make_memory(*(UNITS_AT + unit for unit in wrong), units=units)
        flags = plain_function(isolate)(inputs, parameters, memory)
        assert flags[number] == float(wrong == (0, 1))
        own = plain_function(isolate_units)(memory)
        assert own == tuple(float(unit in wrong) for unit in range(MOST_UNITS))
