"""Bits by name: texts and numbers, and the sensors of a satellite that has several of a kind."""

import dataclasses

import numpy as np
import pytest
from packet_cases import CHIBIS
from unit_cases import SIDE, two_magnetometers

from torquer.base.explain import ScenarioError
from torquer.computer.interface import SENSORS
from torquer.computer.names import Names
from torquer.flight.packets.bits import dictionary_for, from_words, in_words, values_in_words
from torquer.flight.packets.commands import Sent, command_numbers
from torquer.flight.packets.dictionary import Dictionary, Field, Packet
from torquer.flight.packets.received import field_attributes
from torquer.flight.packets.software_file import load_link
from torquer.scenario.load import load_scenario
from torquer.spacecraft.sensors.device import MOST_UNITS

PARTS = Field(name="parts", type="u32", bits=("heater", "lamp"), description="parts")
NO_NAMES = Names({}, (), {}, {}, ())


@pytest.mark.parametrize(
    ("number", "text"),
    [(0, "none"), (1, "heater"), (3, "heater, lamp"), (6, "lamp, 2"), (1 << 31 | 1, "heater, 31")],
)
def test_a_number_of_bits_is_the_names_of_those_that_are_set(number, text):
    assert in_words(PARTS, number) == text
    assert from_words(PARTS, text) == number


def test_every_number_comes_back_from_its_words():
    for number in np.random.default_rng(1).integers(2**32, size=200).tolist():
        assert from_words(PARTS, in_words(PARTS, number)) == number


def test_bit_that_is_called_none_is_that_bit():
    field = PARTS.model_copy(update={"bits": ("heater", "none")})
    assert from_words(field, "none") == 2


def test_commands_take_names_of_bits():
    packet = Packet(name="switch", id=9, description="switch", module="a", fields=(PARTS,))
    dictionary = Dictionary(name="A", modules={"a": 1}, up={"switch": packet})

    def numbers(value):
        sent = Sent(at_s=0.0, command="switch", values={"parts": value})
        return command_numbers(sent, dictionary, NO_NAMES)[1]

    assert (numbers("lamp,heater"), numbers("none"), numbers(5)) == (3, 0, 5)
    message = r"values\.parts: must be none, or of heater, lamp, with commas between them; .*'lam'"
    with pytest.raises(ScenarioError, match=message):
        numbers("lam")


def test_masks_and_meanings_are_attributes_of_tables():
    found = field_attributes(PARTS.model_copy(update={"bits": ("heater", "a b")}))
    assert (found["flag_masks"], found["flag_meanings"]) == ([1, 2], "heater a_b")


def test_the_sensors_of_a_satellite_are_named_after_the_kinds():
    found = dictionary_for(two_magnetometers(), CHIBIS)
    extended, stored = found.down["extended"], found.down["stored"]
    assert extended.fields[5].bits == stored.fields[5].bits == (*SENSORS, "panel", "side")
    assert in_words(extended.fields[5], SIDE) == "side"
    words = list(values_in_words(extended, (0,) * 5 + (SIDE,) + (0,) * (len(extended.names) - 6)))
    names = extended.names
    assert words[4:7] == [f"{names[4]} none (0)", f"{names[5]} side ({SIDE})", f"{names[6]} 0"]
    same = {name for name in CHIBIS.down if found.down[name] == CHIBIS.down[name]}
    assert same == CHIBIS.down.keys() - {"extended", "stored"}
    assert Dictionary.model_validate_json(found.model_dump_json()) == found
    assert dictionary_for(two_magnetometers(), found) == found


def test_a_number_that_was_not_known_on_board_is_no_number_in_words():
    extended = CHIBIS.down["extended"]
    lowest = [field.unknown_value for _, field, _ in extended.numbers()]
    values = tuple(0 if each is None else each for each in lowest)
    words = dict(each.rsplit(" ", 1) for each in values_in_words(extended, values))
    assert {words[name] for name, each in zip(words, lowest, strict=True) if each is not None} == {
        "unknown"
    }


def test_the_most_sensors_have_bits():
    isolated = CHIBIS.down["extended"].fields[5]
    assert len(SENSORS) + MOST_UNITS <= 32 and isolated.type == "u32"


def test_more_sensors_than_bits_are_named_as_far_as_there_are_bits():
    field = Field(name="wrong", type="u16", bits=SENSORS, description="sensors")
    packet = Packet(name="house", id=1, description="x", fields=(field,))
    dictionary = Dictionary(name="A", modules={"a": 1}, down={"house": packet})
    scenario, units = two_magnetometers(), {f"m{k}": {} for k in range(8)}
    scenario = scenario.replace("spacecraft.magnetometers", units)
    assert dictionary_for(scenario, dictionary).down["house"].fields[0].bits == (
        *SENSORS,
        *list(units)[: 16 - len(SENSORS)],
    )


def test_link_is_the_same_without_several_sensors_or_a_scenario():
    link = load_link()
    assert link.for_satellite(None) is link
    day = link.for_satellite(load_scenario("examples/chibis_m_day.toml"))
    assert day.dictionary is link.dictionary
    named = link.for_satellite(two_magnetometers())
    assert dataclasses.replace(named, dictionary=link.dictionary) == link
    assert named.dictionary != link.dictionary
