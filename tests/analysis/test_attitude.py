"""Orbital axes and attitude error against the kernels and rotations of scipy."""

import numpy as np
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from torquer.analysis.attitude import attitude_error_deg, orbital_axes
from torquer.environment.orbit import kepler
from torquer.maths.geometry.frames import dcm_orbital_to_inertial


def test_orbital_axes_are_those_of_the_laws():
    r, v = kepler.states(np.linspace(0.0, 5e3, 7), 7.2e6, 0.2, (30.0, 63.0, 50.0), 0.4)
    matrices = orbital_axes(r, v).as_matrix()
    for n in range(7):
        known = dcm_orbital_to_inertial(tuple(r[n].tolist()), tuple(v[n].tolist()))
        np.testing.assert_allclose(matrices[n], known, atol=1e-14)


@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.floats(0.0, 179.0),
    st.booleans(),
)
def test_attitude_error_is_the_rotation_that_was_made(seed, degrees, orbital):
    rng = np.random.default_rng(seed)
    wanted, frames = Rotation.random(random_state=rng), Rotation.random(5, random_state=rng)
    axis = rng.normal(size=(5, 3))
    turns = degrees * axis / np.linalg.norm(axis, axis=1, keepdims=True)
    body = wanted * Rotation.from_rotvec(turns, degrees=True)
    if orbital:
        body = frames * body
    answer = attitude_error_deg(body.as_quat(), wanted.as_quat(), frames if orbital else None)
    np.testing.assert_allclose(answer, turns, atol=1e-6)
