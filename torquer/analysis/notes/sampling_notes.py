"""How fast the field turns past a tumbling body, against what sampled control of any law brakes.

In a body that nutates the field has several lines. With the momentum h, the moments A across and C
about the axis that circulates, they stand at the precession h/A, at the spin relative to it
n = w (A - C)/A, and at their sum and difference. Sampled control drives those that lie above the
limit of its sampling, pi/(d + a) for differences over d and dipoles held for a.
"""

import math
from collections.abc import Iterator

import numpy as np

from torquer.analysis.notes.uses import Use, notes_on_laws
from torquer.computer.blocks.user import GivenLaw, UserLaw
from torquer.computer.laws.bcross import Bcross
from torquer.computer.laws.bdot_normalised import BdotNormalised
from torquer.computer.laws.momentum_projection import MomentumProjection
from torquer.computer.laws.non_monotonic import NonMonotonic, NonMonotonicDerivative
from torquer.scenario.spec import Scenario
from torquer.theory.averaged.sampling import law_sampling, sampling_by_differences

#: Least part of the field's amplitude that a line must have.
_LEAST = 0.1
_OWN = (UserLaw, GivenLaw)
_DETUMBLING = (BdotNormalised, Bcross, MomentumProjection, NonMonotonic, NonMonotonicDerivative)


def sampling_notes(scenario: Scenario) -> list[str]:
    """Notes on laws at the start, of which others do not tell how fast a rotation they brake."""
    return [*notes_on_laws(scenario, _CHECKS)]


def field_lines_rad_s(inertia: np.ndarray, omega_body: np.ndarray) -> list[tuple[float, float]]:
    """Rates [rad/s] and greatest amplitudes (of 1) of a fixed field's lines in a turning free body.

    `inertia` (3, 3) [kg m^2], `omega_body` (3,) [rad/s]. Of three unlike moments those across the
    axis that circulates are taken as their mean.
    """
    moments, axes = np.linalg.eigh(inertia)
    omega = axes.T @ omega_body
    h = moments * omega
    size = float(np.linalg.norm(h))
    if size == 0.0:
        return []
    along = 2 if size**2 > 2.0 * moments[1] * float(0.5 * omega @ h) else 0
    across = float(np.mean(np.delete(moments, along)))
    spin = float(omega[along]) * (across - moments[along]) / across
    precession, cosine = size / across, float(h[along]) / size
    sine = math.sqrt(max(0.0, 1.0 - cosine * cosine))
    lines = [(precession, sine), (spin, sine)]
    lines += [(precession + spin, 0.5 * (1.0 + cosine)), (precession - spin, 0.5 * (1.0 - cosine))]
    return [(abs(rate), part) for rate, part in lines]


def _line_notes(scenario: Scenario, use: Use) -> Iterator[str]:
    law, coils = use.law, scenario.spacecraft.coils
    if not use.at_start or coils is None or not isinstance(law, _OWN + _DETUMBLING):
        return
    own = isinstance(law, _OWN)
    sampling = sampling_by_differences(scenario) if own else law_sampling(scenario, law)
    limit = sampling.limit_rad_s
    omega = np.array(scenario.motion_at_start()[4:])
    lines = field_lines_rad_s(np.array(scenario.spacecraft.body.inertia), omega)
    fastest = max((rate for rate, part in lines if part >= _LEAST), default=0.0)
    if fastest > limit:
        yield (
            f"the field turns past this body at up to {math.degrees(fastest):.3g} deg/s at the "
            f"start, above the {math.degrees(limit):.3g} deg/s that "
            f"{'a law of differences' if own else 'this law'} can brake with {sampling.in_words}: "
            "it may spin the body up"
        )


_CHECKS = {"the rate of the field in the body": _line_notes}
