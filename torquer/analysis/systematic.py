"""Systematic error of a filter whose models on board are not the truth.

What the field on board differs from the true one enters every reading alike, so a filter neither
averages it out nor states it. The error is propagated along a nominal motion with the gains of the
filter: e = F e, then e = e - P H^T R^-1 (H e + d) at readings, d the difference of the models and P
the covariance after them. The gravity gradient on board is taken as true.
"""

import numpy as np

from torquer.analysis.linear_covariance import (
    Expected,
    Motion,
    held_motion,
    kalman_filter,
    nominal,
)
from torquer.analysis.observability import information, transitions
from torquer.estimation.expected import Nominal
from torquer.geometry.attitudes import to_body
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
    phi, gained = transitions(spec, seen), information(spec, seen)
    pulled = _pulled(scenario, spec, seen)
    errors = np.zeros((len(seen.t_s), gained.shape[1]))
    before = np.zeros(gained.shape[1])
    for k, covariance in enumerate(expected.covariance):
        errors[k] = before - covariance @ (gained[k] @ before + pulled[k])
        if k < len(phi):
            before = phi[k] @ errors[k]
    return errors[:, :3]


def _pulled(scenario: Scenario, spec, seen: Nominal) -> np.ndarray:
    """H^T R^-1 d (k, n) of each instant's readings, d: true less believed, in the body."""
    believed, sensing = scenario.believed_environment(), spec.sensing()
    r, v = believed.state(seen.t_s)
    sun = believed.sun(seen.t_s) - r
    sun /= np.linalg.norm(sun, axis=1)[:, None]
    out = np.zeros((len(seen.t_s), 3 * len(spec.initial_variances())))
    if sensing.r_field:
        off = to_body(seen.q, seen.b - believed.field(seen.t_s, r, v))
        out[:, :3] += np.cross(off, to_body(seen.q, seen.b)) / sensing.r_field
        if spec.magnetometer_bias_sigma_nt:
            out[:, -3:] += off / sensing.r_field
    if sensing.r_sun:
        off = to_body(seen.q, seen.sun - sun)
        pulled = np.cross(off, to_body(seen.q, seen.sun)) / sensing.r_sun
        out[:, :3] += np.where(seen.seen[:, None], pulled, 0.0)
    return out
