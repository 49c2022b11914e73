"""A decorated law has the sensors that it names, itself or in what it calls; others are not read."""

import numba
import pytest

import torquer
from torquer.control.law import as_law


@numba.njit
def toward(inputs):
    return inputs.sun_body


def through(inputs):
    return toward(inputs)


def made_with(helper):
    @torquer.law
    def closed(inputs, parameters, memory):
        return helper(inputs)

    return closed


@torquer.law
def by_field(inputs, parameters, memory):
    return inputs.b_body_t


@torquer.law
def by_sun(inputs, parameters, memory):
    return inputs.sun_body


@torquer.law
def by_helper(inputs, parameters, memory):
    return through(inputs)


@torquer.law
def by_coil_and_age(inputs, parameters, memory):
    x, y, z = inputs.b_rate_body_t_s
    return x, y, z + 0.0 * inputs.read_at.sun_sensors_s


@pytest.mark.parametrize(
    ("law", "sensors"),
    [
        (by_field, set()),
        (by_sun, {"sun"}),
        (by_helper, {"sun"}),
        (made_with(toward), {"sun"}),
        (by_coil_and_age, {"sun", "search_coil"}),
    ],
)
def test_a_law_has_the_sensors_that_it_names(law, sensors):
    assert law.needs == sensors


def test_a_plain_function_has_all_sensors():
    assert as_law(lambda inputs, parameters, memory: inputs[4]).needs == {"sun", "search_coil"}
