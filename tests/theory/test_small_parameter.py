"""Where the small-parameter method ends: noted, or refused in one line."""

import math

import numpy as np
import pytest

from torquer.theory.periodic.poincare import (
    departure,
    equidistant_points,
    forced_response,
    periodic_motion,
    small_parameter,
)


def decay(x):
    return -1.0 * x


def test_a_forcing_that_is_not_resolved_is_noted():
    def push(u, x):
        return np.exp(3.0 * np.sin(u))[:, None]

    assert small_parameter(decay, push, [0.0]).notes == ()
    (note,) = small_parameter(decay, push, [0.0], samples=9).notes
    assert note.startswith("tail = ") and "beyond those sampled" in note


def test_a_resonance_is_noted():
    jacobian = np.array([[0.0, 1.0], [-4.02, 0.0]])
    u = equidistant_points(2.0 * math.pi, 16)
    found = forced_response(jacobian, np.stack([0.0 * u, np.cos(2.0 * u)], axis=1))
    assert found.notes[0].startswith("harmonic 2 is 0.005 from an eigenvalue")


def test_periodic_motion_unresolved_by_the_samples_is_refused():
    def rates(u, x):
        return 10.0 * np.cos(10.0 * u)[:, None] - (x - np.sin(10.0 * u)[:, None])

    assert periodic_motion(rates, np.zeros((63, 1))).shape == (63, 1)
    with pytest.raises(ArithmeticError, match="must resolve the motion; 21 leave"):
        periodic_motion(rates, np.zeros((21, 1)))


def test_a_departure_into_a_singular_point_is_refused():
    response = forced_response([[-1.0]], np.ones((8, 1)))
    with pytest.raises(ArithmeticError, match="departure: the motion must stay finite"):
        departure(lambda x: x**2 + 1.0, lambda u, x: 0.0 * x, response, 1.0, 3.0)
