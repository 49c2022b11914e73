"""Sun sensors and search coil are read for a user's law unless its code shows it needs none."""

import functools

import numba
import pytest

import torquer
from torquer.computer.blocks.law import as_law, needed_readings

ALL = {"sun", "search_coil", "horizon"}


@numba.njit
def toward(inputs):
    return inputs.sun_body


def by_field(inputs, parameters, memory):
    sun_body, gain = inputs.b_body_t, 2.0
    return gain * inputs.omega_body_rad_s[0], inputs.t_s - memory[0], sun_body[2]


def by_sun(inputs, parameters, memory):
    return inputs.sun_body if inputs.t_s > 3.0 else parameters.axis


def by_coil(measured, parameters, memory):
    x, y, z = measured.b_rate_body_t_s
    return x, y, z


def by_age(inputs, parameters, memory):
    return inputs.read_at.sun_sensors_s, 0.0, 0.0


def through_helper(inputs, parameters, memory):
    return toward(inputs)


def by_place(inputs, parameters, memory):
    return inputs[4]


def by_name(inputs, parameters, memory):
    return getattr(inputs, "sun_body")  # noqa: B009


def renamed(inputs, parameters, memory):
    known = inputs
    return known.sun_body


def within(inputs, parameters, memory):
    return tuple(inputs.sun_body[k] for k in range(3))


class Called:
    def __call__(self, inputs, parameters, memory):
        return inputs.sun_body


CASES = [
    (by_field, set()),
    (by_sun, {"sun"}),
    (by_coil, {"search_coil"}),
    (by_age, ALL),
    (through_helper, ALL),
    (by_place, ALL),
    (by_name, ALL),
    (renamed, ALL),
    (Called(), ALL),
    (functools.partial(by_sun), ALL),
    (lambda inputs, parameters, memory: inputs.b_body_t, set()),
]


@pytest.mark.parametrize(("function", "readings"), CASES)
def test_what_a_law_uses_is_read_for_it(function, readings):
    assert needed_readings(function) == readings
    assert as_law(function).needs == readings


def test_a_comprehension_may_read_everything_or_what_it_names():
    assert needed_readings(within) >= {"sun"}


@pytest.mark.parametrize("function", [by_field, by_sun, by_coil, through_helper])
def test_a_decorated_law_is_read_as_the_plain_function_is(function):
    assert torquer.law(memory=1)(function).needs == as_law(function).needs
