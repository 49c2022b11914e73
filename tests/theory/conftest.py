"""One satellite and the laws of coils, for the tests of their averaged motion."""

import numpy as np
import pytest

from torquer.computer.laws.bdot import BdotRate
from torquer.computer.laws.nutation_damping import NutationDampingRate
from torquer.computer.laws.preliminary_1 import Preliminary1
from torquer.computer.laws.preliminary_2 import Preliminary2
from torquer.computer.laws.reorientation import Reorientation
from torquer.computer.laws.sdot import SdotRate
from torquer.computer.laws.spin_up import SpinUp
from torquer.theory.slow.spinner import Spinner

#: Physical units, so that every factor of the small parameters counts.
SATELLITE = {
    "strength_t": 3e-5,
    "transverse_kg_m2": 1.7,
    "axial_kg_m2": 1.2,
    "momentum_n_m_s": 0.3,
    "orbital_rate_rad_s": 1.1e-3,
    "sun": (0.36, -0.48, 0.8),
}
TARGET = np.array(SATELLITE["sun"])
MOMENTUM = 1.3


@pytest.fixture
def satellite():
    """A satellite on an orbit of this inclination: `satellite(51.7, field=...)`."""
    return lambda inclination_deg, **keys: Spinner(
        inclination_deg=inclination_deg, **(SATELLITE | keys)
    )


@pytest.fixture
def spin_laws():
    """For a gain: name of the evolution -> (law, target as the evolution counts it)."""

    def make(gain):
        inertia = [SATELLITE[k] for k in ("transverse_kg_m2", "transverse_kg_m2", "axial_kg_m2")]
        cone, up = {"target": (0.0, 0.0, 1.0)}, (0.0, 0.0, 1.0)
        precise = Reorientation(
            gain_a_m2_per_n_m_s_t=gain,
            target=TARGET.tolist(),
            momentum_n_m_s=MOMENTUM * SATELLITE["momentum_n_m_s"],
            inertia_kg_m2=inertia,
        )
        first = Preliminary1(gain_a_m2_per_t=gain, **cone)
        second = Preliminary2(gain_a_m2_per_t=gain, inertia_kg_m2=inertia, **cone)
        return {
            "bdot": (BdotRate(gain_a_m2_s_per_t=gain).law(), up),
            "bdot_any_field": (BdotRate(gain_a_m2_s_per_t=gain).law(), up),
            "nutation_damping": (NutationDampingRate(gain_a_m2_s_per_t=gain).law(), up),
            "spin_up": (SpinUp(gain_a_m2_per_t=gain).law(), up),
            "reorientation": (precise.law(), MOMENTUM * TARGET),
            "preliminary_1": (first.law(), up),
            "preliminary_2": (second.law(), up),
            "sdot": (SdotRate(gain_a_m2_s=gain).law(), TARGET),
        }

    return make
