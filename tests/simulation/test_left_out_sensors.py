"""Sensors that are left out are ideal: the Sun sensor, too."""

import numpy as np
import pytest

import torquer
from torquer import simulate
from torquer.compile import engine

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")

ALL_SKY = {"axes": [[1, 0, 0], [-1, 0, 0]], "half_field_deg": 90.0}
ORBIT = {
    "orbit.inclination_deg": 10.0,
    "simulation": {"revolutions": 1, "step_s": 2.0, "record_s": 10.0},
    "control.sample_s": 2.0,
}
POINTED = {"kind": "preliminary_1", "gain_a_m2_per_t": 1e5, "target": "sun"}
LAWS = {
    "pointed": POINTED,
    "in a scheme": {"kind": "scheme", "stages": [{"laws": [POINTED]}]},
}


@torquer.law
def along_the_sun(inputs, parameters, memory):
    return inputs.sun_body


def plain(inputs, parameters, memory):
    return inputs.sun_body


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_sun_law_without_sensors_flies_as_with_all_sky_ones(make, law):
    without = simulate(make(ORBIT | {"control.law": law}))
    given = simulate(make(ORBIT | {"control.law": law, "spacecraft.sun_sensors": ALL_SKY}))
    assert np.abs(without.dipole_body.values).max() > 0.1
    assert np.array_equal(without.omega_body.values, given.omega_body.values)


@pytest.mark.parametrize("law", [along_the_sun, plain], ids=["compiled", "plain Python"])
def test_the_users_law_sees_the_sun_while_it_is_lit(make, law):
    result = simulate(make(ORBIT | {"simulation.revolutions": 0.7}), law)
    sunlit_fraction = result.sunlit_fraction.values[:-1] >= 0.5
    asked = result.command_body.values[:-1]
    assert 0 < sunlit_fraction.sum() < sunlit_fraction.size
    assert np.array_equal(np.any(asked != 0.0, axis=1), sunlit_fraction)
    assert np.linalg.norm(asked[sunlit_fraction], axis=1) == pytest.approx(1.0)


def test_nobody_pays_for_a_sun_that_no_law_reads(make):
    result = simulate(make())
    assert not result.sun_measured.values.any()
