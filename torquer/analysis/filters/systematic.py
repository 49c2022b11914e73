"""Systematic error of a filter whose models on board are not the truth.

What the field on board differs from the true one enters every reading alike, so a filter neither
averages it out nor states it. The error is propagated along a nominal motion with the gains of the
filter: e = F e, then e = e - P H^T R^-1 (H e + d) at readings, d the difference of the models and P
the covariance after them. The gravity gradient on board is taken as true.
"""

import numpy as np

from torquer.analysis.filters.linear_covariance import (
    Expected,
    Motion,
    held_motion,
    kalman_filter,
    nominal,
    surroundings,
)
from torquer.analysis.filters.observability import reading_information, transitions
from torquer.computer.estimation.expected import Nominal
from torquer.scenario.spec import Scenario


def systematic_error(
    scenario: Scenario, expected: Expected, motion: Motion | None = None
) -> np.ndarray:
    """Attitude errors (k, 3) [rad, body] that the models on board cause; zeros for the truth.

    `expected`: by `expected_accuracy` along the same motion, that of `held_motion` unless another
    is given.
    """
    if scenario.believed_environment() == scenario.orbit_environment():
        return np.zeros((len(expected.t_s), 3))
    spec = kalman_filter(scenario)
    seen = nominal(scenario, motion or held_motion(scenario))
    phi, (gained, pulled) = transitions(spec, seen), _model_information(scenario, spec, seen)
    errors = np.zeros((len(seen.t_s), gained.shape[1]))
    before = np.zeros(gained.shape[1])
    for k, covariance in enumerate(expected.covariance):
        errors[k] = before - covariance @ (gained[k] @ before + pulled[k])
        if k < len(phi):
            before = phi[k] @ errors[k]
    return errors[:, :3]


def _model_information(scenario: Scenario, spec, seen: Nominal) -> tuple[np.ndarray, np.ndarray]:
    """`reading_information` with what the models on board give."""
    believed = scenario.believed_environment()
    r, v = believed.state(seen.t_s)
    sun = believed.sun(seen.t_s) - r
    sun /= np.linalg.norm(sun, axis=1)[:, None]
    nadir = -r / np.linalg.norm(r, axis=1)[:, None]
    assumed = surroundings(believed.field(seen.t_s, r, v), sun, nadir)
    return reading_information(spec, seen, assumed)
