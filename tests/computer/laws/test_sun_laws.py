"""Laws that turn an axis to the Sun by a wanted torque: what they want, steps and their ends."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from law_cases import inputs
from scipy.spatial.transform import Rotation

from torquer import simulate
from torquer.compile import engine
from torquer.computer.laws.panel_tracking import PanelTracking
from torquer.computer.laws.spin_to_sun import SpinToSun
from torquer.computer.laws.sun_cross import SunCross, dipole_for

AXIS, J = (0.0, 0.0, 1.0), (1.0, 1.2, 1.5)
ZERO = (0.0, 0.0, 0.0)
MANY = settings(deadline=None)
unit = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1)


def called(spec):
    """The law's dipole for its inputs; it remembers."""
    law = spec.law()
    memory = law.record_of(law.first_memory())
    return lambda known: law(known, law.parameters, memory)


@MANY
@given(field=unit, torque=unit)
def test_torque_is_the_wanted_one_less_its_part_along_field(field, torque):
    b = 3e-5 * np.array(field)
    along = b / np.linalg.norm(b)
    made = np.cross(dipole_for(torque, tuple(b)), b)
    assert made == pytest.approx(torque - along * np.dot(torque, along), abs=1e-12)
    assert dipole_for(torque, ZERO) == ZERO


@MANY
@given(field=unit, sun=unit)
def test_the_cross_product_turns_the_axis_to_the_sun(field, sun):
    b, sun = 3e-5 * np.array(field), np.array(sun) / np.linalg.norm(sun)
    law = called(SunCross(gain_n_m=1e-4, axis=AXIS))
    torque = np.cross(law(inputs(0.0, b=b, sun=sun)), b)
    # d(e.s)/dt grows with the torque's part along e x s
    assert np.dot(torque, np.cross(AXIS, sun)) >= -1e-18
    assert law(inputs(0.0, b=b)) == pytest.approx(ZERO, abs=0.0)


def panels(**keys):
    """The law with gains of its own and Chibis-M's axes: x3 to the Sun, about x1."""
    return PanelTracking(difference_gain_n_m=3e-4, brightest_gain_n_m=1e-4, **keys)


@MANY
@given(field=unit, sun=unit, turn=st.integers(0, 1000))
def test_panel_tracking_wants_what_the_currents_of_six_panels_say(field, sun, turn):
    """Panel by panel: the cosine of each that is lit, the brightest one's normal."""
    b, sun = 3e-5 * np.array(field), np.array(sun) / np.linalg.norm(sun)
    e1, e2, e3 = Rotation.random(random_state=turn).as_matrix().T
    normals = np.array([e1, -e1, e2, -e2, e3, -e3])
    currents = np.maximum(0.0, normals @ sun)
    wanted = 3e-4 * (currents[2] - currents[3]) * e3
    wanted += 1e-4 * np.cross(e1, normals[currents.argmax()])
    law = called(panels(axis=tuple(e1), turning_axis=tuple(e3)))
    found = np.cross(law(inputs(0.0, b=b, sun=sun)), b)
    along = b / np.linalg.norm(b)
    assert found == pytest.approx(wanted - along * (along @ wanted), abs=1e-15)


@MANY
@given(sun=unit)
def test_panel_tracking_never_turns_the_axis_from_the_sun(sun):
    """d(e1.s)/dt grows with the torque's part along e1 x s, in a field across it."""
    sun = np.array(sun) / np.linalg.norm(sun)
    to_sun = np.cross(AXIS, sun)
    if np.linalg.norm(to_sun) < 1e-6:
        return
    b = 3e-5 * np.cross(to_sun, AXIS) / np.linalg.norm(to_sun)
    torque = np.cross(called(panels())(inputs(0.0, b=b, sun=sun)), b)
    assert torque @ to_sun >= -1e-18


def test_unsigned_difference_turns_the_axis_past_the_sun():
    """A body that turns about e3 alone, braked, the Sun at an angle on either side of e1. SDOT has
    the norm of the difference: from one side it drives the axis round by the far side."""

    def path(difference, angle, rate=0.0, step=0.05):
        angles = [angle]
        for _ in range(4000):
            rate -= step * (difference(angle) + rate)
            angle += step * rate
            angles.append(angle)
        return np.abs(angles)

    for start in (-0.3, 0.3):
        assert path(np.sin, start)[-1] < 1e-6 < 0.3 == path(np.sin, start).max()
    assert path(lambda a: abs(np.sin(a)), -0.3).max() > np.pi


def test_panel_tracking_needs_axes_at_right_angles_and_the_sun():
    with pytest.raises(ValueError, match="turning_axis: must be at right angles to the axis"):
        panels(turning_axis=(0.0, 0.1, 1.0))
    law = called(panels())
    assert np.array_equal(np.abs(law(inputs(0.0, b=(1e-5, 2e-5, 3e-5)))), np.zeros(3))


def spun(rates, suns=None, **keys):
    """Errors that the torque goes against at successive steps, in a field across all of them."""
    law = called(SpinToSun(gain_n_m=1.0, momentum_n_m_s=0.15, inertia_kg_m2=J, **keys))
    found = []
    for k, omega in enumerate(rates):
        sun = (1.0, 0.0, 0.0) if suns is None else suns[k]
        m = law(inputs(float(k), b=(0.0, 1.0, 0.0), omega=omega, sun=sun))
        found.append(np.cross(m, (0.0, 1.0, 0.0)))
    return np.array(found)


def test_momentum_goes_first_to_the_axis_then_to_the_sun():
    """Steps: too slow; spinning; nutation beyond the first angle, within the second; beyond."""
    full = 0.1
    wobble = [(full * np.tan(np.radians(a)) * 1.5, 0.0, full) for a in (0.0, 20.0, 40.0, 20.0)]
    torques = spun([(0.0, 0.0, 0.5 * full), *wobble])
    axis, sun = np.array(AXIS), np.array((1.0, 0.0, 0.0))
    targets = [axis, sun, sun, axis, axis]
    for torque, target, omega in zip(torques, targets, [(0.0, 0.0, 0.05), *wobble], strict=True):
        wanted = target - np.array(J) * omega / 0.15
        assert torque == pytest.approx([wanted[0], 0.0, wanted[2]], abs=1e-12)


def test_without_the_sun_the_spin_is_kept():
    torques = spun([(0.0, 0.0, 0.09)] * 2, suns=[(1.0, 0.0, 0.0), ZERO])
    assert torques[0] == pytest.approx([1.0, 0.0, -0.9], abs=1e-12)
    assert torques[1] == pytest.approx([0.0, 0.0, 0.1], abs=1e-12)


BRAKE = {"kind": "bdot_rate", "gain_a_m2_s_per_t": 5e6}
SUN = {
    "environment.sun_direction": [0.3, 0.5, 0.8],
    "environment.eclipse": "none",
    "environment.gravity_gradient": False,
    "spacecraft.body.inertia_kg_m2": J,
    "spacecraft.coils.limit_a_m2": 3.0,
    "control": {"sample_s": 1.0},
}


@pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
@pytest.mark.parametrize(
    ("laws", "within_deg"),
    [
        ({"pointing": {"kind": "sun_cross", "gain_n_m": 1e-4}, "damping": BRAKE}, 10.0),
        ({"pointing": {"kind": "spin_to_sun", "gain_n_m": 3e-5, "momentum_n_m_s": 0.05,
                       "inertia_kg_m2": J, "begin_deg": 5.0}}, 10.0),
        ({"pointing": {"kind": "panel_tracking", "difference_gain_n_m": 1e-4,
                       "brightest_gain_n_m": 1e-4}, "damping": BRAKE}, 50.0),
    ],
)  # fmt: skip
def test_the_axis_ends_at_the_sun(make, laws, within_deg):
    changes = SUN | {"control.laws": laws, "simulation": {"revolutions": 10, "record_s": 60.0}}
    result = simulate(make(changes))
    angle = np.degrees(np.arccos(result.sun_measured.values[:, 2]))
    assert angle[-100:].max() < within_deg < 90.0 < angle[0]
    if laws["pointing"]["kind"] == "panel_tracking":  # only the angle about its turning axis ends
        assert np.abs(result.sun_measured.values[-100:, 1]).max() < 0.01
