"""Changes by deviations: what they lead to is what was asked, and always possible."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from torquer.base.validate import inertia_tensor
from torquer.campaign.changes import CHANGES

INERTIA = np.array([[1.0, 0.1, -0.05], [0.1, 1.5, 0.02], [-0.05, 0.02, 1.8]])
PLATE = np.diag([1.0, 2.0, 3.0])
ELEMENTS = ([0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2])
OWN = {
    "number": np.array(7.0),
    "vector": np.array([1.0, -2.0, 3.0]),
    "factor": INERTIA,
    "rotation": Rotation.random(random_state=1).as_quat(),
    "inertia": INERTIA,
}


def changed(name, own, deviations):
    rows = np.atleast_2d(deviations)
    return CHANGES[name].of(np.repeat(own[None], len(rows), axis=0), rows)


@pytest.mark.parametrize(("name", "own"), [*OWN.items(), ("inertia", PLATE)])
def test_no_deviation_is_no_change_to_the_bit(name, own):
    assert np.array_equal(changed(name, own, np.zeros(CHANGES[name].numbers))[0], own)


def test_numbers_and_vectors_are_added_factors_multiply():
    assert changed("number", OWN["number"], [[2.0], [-3.0]]).tolist() == [9.0, 4.0]
    assert changed("vector", OWN["vector"], [0.5, 0.0, 1.0])[0].tolist() == [1.5, -2.0, 4.0]
    for name, own in OWN.items():
        found = changed("factor", own, np.log([[2.0], [0.25]]))
        assert np.allclose(found, [2.0 * own, 0.25 * own], rtol=1e-15), name


def test_attitudes_are_turned_about_axes_of_the_body():
    deviations = np.array([[0.1, 0.0, 0.0], [-0.3, 0.7, 2.0], [1e-9, -2e-9, 0.0]])
    found = changed("rotation", OWN["rotation"], deviations)
    turns = Rotation.from_quat(OWN["rotation"]).inv() * Rotation.from_quat(found)
    assert np.allclose(turns.as_rotvec(), deviations, rtol=1e-7, atol=1e-15)
    assert np.allclose(np.linalg.norm(found, axis=1), 1.0, rtol=0.0, atol=1e-15)


def test_inertia_elements_are_added_while_a_body_can_have_them():
    deviations = 0.05 * np.random.default_rng(0).normal(size=(50, 6))
    more = changed("inertia", INERTIA, deviations) - INERTIA
    assert np.allclose(more[:, *ELEMENTS], deviations, atol=1e-15)
    assert np.array_equal(more, np.swapaxes(more, 1, 2))


@settings(max_examples=300, deadline=None)
@given(
    st.lists(st.floats(-10.0, 10.0), min_size=6, max_size=6),
    st.floats(1e-3, 10.0),
    st.sampled_from([INERTIA, PLATE]),
)
def test_every_inertia_is_that_of_a_body(deviations, size, own):
    """A moment beyond the sum of the others, and negative ones, are cut off."""
    found = changed("inertia", own, size * np.array(deviations))[0]
    assert np.allclose(inertia_tensor("inertia", found), found, atol=1e-12)


def test_what_is_cut_off_is_what_no_body_has():
    """Of 1, 1.5 and 3.5 kg m^2 the second moment of mass along the third axis, -0.5, becomes 0."""
    found = changed("inertia", np.diag([1.0, 1.5, 2.0]), [0.0, 0.0, 1.5, 0.0, 0.0, 0.0])[0]
    assert np.allclose(found, np.diag([1.5, 2.0, 3.5]), atol=1e-5)
