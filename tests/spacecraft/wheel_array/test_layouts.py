"""Layouts: presets, losses, mounting, and what is refused."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from torquer.spacecraft.wheel_array import layout
from torquer.spacecraft.wheel_array.layout import WheelArray

PRESETS = {
    "four-sided": layout.four_sided_pyramid(80.5, 45.5),
    "six-sided": layout.regular_pyramid(6, 81.1),
    "five-sided": layout.regular_pyramid(5, 50.0),
    "orthogonal": layout.orthogonal(),
    "skew": layout.orthogonal_and_skew(),
    "icosahedral": layout.icosahedral(),
}


def array(axes, **more):
    return WheelArray(axes=np.asarray(axes).tolist(), **{"momentum_limit_n_m_s": 18.0, **more})


@pytest.mark.parametrize("name", PRESETS)
def test_axes_have_length_one(name):
    assert np.linalg.norm(PRESETS[name], axis=1) == pytest.approx(1.0, abs=1e-15)


def test_the_four_sided_pyramid_has_its_angles():
    axes = layout.four_sided_pyramid(70.0, 21.5)
    assert np.degrees(np.arccos(axes[:, 0])) == pytest.approx(np.full(4, 70.0))
    turn = np.degrees(np.arctan2(np.abs(axes[:, 1]), np.abs(axes[:, 2])))
    assert turn == pytest.approx(np.full(4, 21.5))
    quarters = {(int(np.sign(y)), int(np.sign(z))) for _, y, z in axes}
    assert quarters == {(1, 1), (1, -1), (-1, -1), (-1, 1)}


def test_regular_pyramid_has_equal_neighbours_and_sums_along_height():
    axes = layout.regular_pyramid(6, 81.1)
    assert np.degrees(np.arccos(axes[:, 0])) == pytest.approx(np.full(6, 81.1))
    neighbours = np.sum(axes * np.roll(axes, 1, axis=0), axis=1)
    assert neighbours == pytest.approx(np.full(6, neighbours[0]))
    assert axes.sum(axis=0) == pytest.approx([6.0 * np.cos(np.radians(81.1)), 0.0, 0.0], abs=1e-14)


def test_icosahedral_axes_are_equally_far_from_each_other():
    cosines = np.abs(layout.icosahedral() @ layout.icosahedral().T)
    assert cosines[np.triu_indices(6, 1)] == pytest.approx(np.full(15, 1.0 / np.sqrt(5.0)))


def test_axes_are_made_unit_vectors_and_limits_one_per_wheel():
    wheels = array([[2.0, 0.0, 0.0], [0.0, -3.0, 0.0], [0.0, 3.0, 4.0]], torque_limit_n_m=(1, 2, 3))
    assert np.array(wheels.axes) == pytest.approx(np.array([[1, 0, 0], [0, -1, 0], [0, 0.6, 0.8]]))
    assert wheels.momentum_limits().tolist() == [18.0, 18.0, 18.0]
    assert wheels.torque_limits().tolist() == [1.0, 2.0, 3.0]


def test_lost_wheels_have_no_limits_and_add_up():
    wheels = array(PRESETS["six-sided"], torque_limit_n_m=0.2).without(4).without(1, 4)
    assert wheels.lost == (1, 4)
    assert wheels.momentum_limits().tolist() == [18.0, 0.0, 18.0, 18.0, 0.0, 18.0]
    assert wheels.torque_limits().tolist() == [0.2, 0.0, 0.2, 0.2, 0.0, 0.2]


def test_the_sum_of_momenta_turns_with_the_mounting():
    turn = Rotation.from_euler("xyz", [0.3, -0.8, 1.9]).as_matrix()
    wheels, momenta = array(PRESETS["four-sided"]), np.array([[1.0, -2.0, 5.0, 0.5], [0, 0, 3, 0]])
    plain = layout.total_momentum(wheels.axes, momenta)
    assert plain[1] == pytest.approx(3.0 * np.array(wheels.axes[2]))
    turned = layout.total_momentum(wheels.turned(turn).axes, momenta)
    assert turned == pytest.approx(plain @ turn.T)


def test_an_array_can_be_stored_and_read():
    wheels = array(PRESETS["skew"], torque_limit_n_m=(0.1, 0.2, 0.3, 0.4), lost=(2,))
    assert WheelArray.model_validate_json(wheels.model_dump_json()) == wheels


FLAT = [[1, 0, 0], [0, 1, 0], [1, 1, 0], [1, -1, 0]]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"axes": FLAT}, "axes: must hold three that do not lie in one plane; received"),
        ({"axes": [[1, 0, 0], [0, 0, 0], [0, 0, 1]]}, "axes: must be non-zero vectors"),
        ({"axes": [[1, 0, 0], [0, 1, 0]]}, "must have 3 or more values"),
        ({"axes": np.eye(3).tolist() * 5}, "must have at most 12 values"),
        ({"momentum_limit_n_m_s": -1.0}, "greater than 0"),
        (
            {"momentum_limit_n_m_s": (1.0, 2.0)},
            r"momentum_limit_n_m_s: must be one number or one per wheel \(3\); received 2",
        ),
        (
            {"torque_limit_n_m": (1.0, 2.0, 1.0, 1.0)},
            r"torque_limit_n_m: must be one number or one per wheel \(3\); received 4",
        ),
        ({"momentum_limit_n_m_s": 1e-13}, "momentum_limit_n_m_s: must be from 1e-12 to 1e"),
        ({"torque_limit_n_m": (1.0, 1.0, 1e7)}, r"within a factor of 1e\+06 of one another"),
        ({"lost": (3,)}, r"lost: must be different wheel numbers from 0 to 2; received \(3,\)"),
        ({"lost": (1, 1)}, r"lost: must be different wheel numbers from 0 to 2; received \(1, 1\)"),
    ],
)
def test_what_is_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        WheelArray(**{"axes": np.eye(3).tolist(), "momentum_limit_n_m_s": 1.0, **changes})


def test_axes_of_any_length_are_made_unit_vectors():
    wheels = array([[1e200, 0.0, 0.0], [0.0, 3e-200, 4e-200], [0.0, 0.0, 2.0]])
    assert np.array(wheels.axes) == pytest.approx(
        np.array([[1.0, 0.0, 0.0], [0.0, 0.6, 0.8], [0.0, 0.0, 1.0]])
    )


def test_torques_need_a_torque_limit_and_a_mounting_a_rotation():
    with pytest.raises(ValueError, match="torque_limit_n_m: must be given for torques"):
        array(np.eye(3)).torque_limits()
    with pytest.raises(ValueError, match="rotation: must be a right-handed rotation matrix"):
        array(np.eye(3)).turned(-np.eye(3))
