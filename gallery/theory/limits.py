"""Limits of the theory that only entries need."""

import numpy as np

from torquer.theory.validity import Limit

HELD = Limit(
    "tilt [rad]", -0.5, 0.5, "the gravity gradient can balance no more",
    of="steady tilt against the gravity gradient", shown="asin(2x)/2 has no value beyond",
    refuses=True,
)  # fmt: skip


def check_regular(name: str, cosine) -> None:
    """ValueError where the cosine of an angle, by which rates are divided, is zero."""
    if np.min(np.abs(cosine), initial=1.0) < 1e-9:
        raise ValueError(f"{name}: must not be 90 deg, where the angles are singular; received it")
