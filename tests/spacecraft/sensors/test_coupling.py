"""A magnetometer among coils and iron: each coil's field, the driver's, soft iron."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from torquer import Law, ScenarioError, simulate
from torquer.analysis.notes.notes import write_notes
from torquer.compile import engine
from torquer.compile.engine import kernel, records
from torquer.spacecraft.actuators.coils import COIL_STATE, Coils
from torquer.spacecraft.sensors import magnetometer
from torquer.spacecraft.sensors.magnetometer import MOST_COUPLED, Magnetometer

in_flight = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")

B = (1e-5, -3e-5, 2e-5)
SOFT = ((1.02, 0.01, -0.03), (0.0, 0.97, 0.02), (0.04, -0.01, 1.01))
#: Field [nT per A m^2] of three coils, a row each.
COUPLING = ((120.0, -40.0, 10.0), (15.0, 80.0, -60.0), (-25.0, 30.0, 200.0))
OFFSET = (30.0, -20.0, 5.0)
DRIVEN = {"coil_coupling_nt_per_a_m2": COUPLING, "coil_offset_nt": OFFSET, "soft_iron": SOFT}
RUN = {"duration_s": 60.0, "step_s": 1.0, "record_s": 1.0, "record_inputs": True}


@kernel
def disturbed_field(constants, coils, state):
    return magnetometer.disturbed_field(constants, B, coils, state)


def seen(dipoles, coils=None, target=None, **keys):
    """Field at the sensor [T] with dipoles [A m^2] of the coils, as they are wound."""
    packed = (coils or Coils(limit_a_m2=9.0)).pack()
    state = records(np.zeros(len(packed.rows), COIL_STATE))
    state["dipole_a_m2"] = dipoles
    state["mean_a_m2"] = dipoles if target is None else target
    return np.array(disturbed_field(Magnetometer(**keys).pack(), packed, state))


def test_each_coil_has_a_field_of_its_own():
    dipoles = np.array([1.5, -2.0, 0.5])
    expected = B + 1e-9 * dipoles @ COUPLING
    found = seen(dipoles, coil_coupling_nt_per_a_m2=COUPLING)
    assert found == pytest.approx(expected, abs=1e-19)


def test_coils_of_any_axes_and_number_count_each():
    """Two coils along one axis: only their own vectors tell them apart."""
    rng = np.random.default_rng(1)
    axes = rng.normal(size=(MOST_COUPLED, 3))
    coupling, dipoles = rng.normal(size=(2, MOST_COUPLED, 3))[0] * 100.0, np.arange(6.0) - 2.0
    found = seen(dipoles, Coils(limit_a_m2=9.0, axes=axes), coil_coupling_nt_per_a_m2=coupling)
    assert found == pytest.approx(B + 1e-9 * dipoles @ coupling, abs=1e-19)


def test_a_coil_wired_the_wrong_way_round_has_the_opposite_field():
    coils = Coils(limit_a_m2=9.0, polarity=(1, -1, 0))
    found = seen((1.5, -2.0, 0.5), coils, coil_coupling_nt_per_a_m2=COUPLING)
    assert found == pytest.approx(B + 1e-9 * np.array([1.5, 2.0, 0.0]) @ COUPLING, abs=1e-19)


def test_the_driver_has_a_field_while_it_drives_any_coil():
    """Not while coils that are off decay."""
    offset = {"coil_offset_nt": OFFSET}
    with_driver = np.add(B, 1e-9 * np.array(OFFSET))
    assert seen((0.0, 0.0, 1e-6), **offset) == pytest.approx(with_driver, abs=1e-19)
    assert tuple(seen((0.0, 0.0, 0.0), **offset)) == B
    assert tuple(seen((0.0, 0.0, 1.0), target=0.0, **offset)) == B
    eight = Coils(limit_a_m2=1.0, axes=np.random.default_rng(2).normal(size=(8, 3)))
    assert seen((*[0.0] * 7, 1.0), eight, **offset) == pytest.approx(with_driver, abs=1e-19)


def test_soft_iron_distorts_the_outside_field_alone():
    dipoles = (1.0, 2.0, -1.0)
    outside = np.array(SOFT) @ B
    found = seen(dipoles, soft_iron=SOFT, coil_coupling_nt_per_a_m2=COUPLING)
    assert found == pytest.approx(outside + 1e-9 * np.array(dipoles) @ COUPLING, abs=1e-19)


def wanted(t_s):
    return (2.0 * np.sin(0.31 * t_s), 2.5 * np.cos(0.47 * t_s), np.sign(np.sin(0.2 * t_s)))


def flown(make, magnetometers, coils=None, control=None):
    """Result of coils that are driven as `wanted`, and the field in the body [n, 3] T."""
    law = Law("ask", lambda inputs, parameters, memory: wanted(inputs.t_s), compiled=False)
    given = {"spacecraft.coils": {"limit_a_m2": 3.0} | (coils or {}), "simulation": RUN}
    given |= {f"spacecraft.{key}": value for key, value in magnetometers.items()}
    given["control"] = {"law": {"kind": "off"}, **(control or {})}
    result = simulate(make(given), law)
    to_body = Rotation.from_quat(result["q_body_to_inertial"].values).inv()
    return result, to_body.apply(result["b_inertial"].values)


def dipoles_before(result):
    """Dipole [n, 3] with which each reading is taken: that of the control step before."""
    return np.vstack([np.zeros(3), result["dipole_body"].values[:-1]])


@in_flight
def test_readings_in_flight_have_the_field_of_what_flows(make):
    """A coil that is reversed for a time, one that is stuck: of both what flows."""
    failures = [
        {"coil": 0, "kind": "reversed", "from_s": 20.0, "until_s": 40.0},
        {"coil": 1, "kind": "stuck", "dipole_a_m2": -1.5, "from_s": 30.0},
    ]
    own = DRIVEN | {"bias_nt": [100.0, -50.0, 20.0], "scale_error": [0.02, 0.0, -0.01]}
    result, b = flown(make, {"magnetometer": own}, {"failures": failures})
    dipoles = dipoles_before(result)
    # a coil changes where a failure begins, before the sensors are read there
    dipoles[20, 0], dipoles[40, 0], dipoles[30, 1] = -dipoles[20, 0], -dipoles[40, 0], -1.5
    outside = b @ np.transpose(SOFT) + 1e-9 * dipoles @ COUPLING
    outside += 1e-9 * np.array(OFFSET) * np.any(dipoles, axis=1, keepdims=True)
    expected = outside * np.array([1.02, 1.0, 0.99]) + 1e-9 * np.array([100.0, -50.0, 20.0])
    assert result["b_measured"].values[1:-1] == pytest.approx(expected[1:-1], abs=1e-14)
    assert np.abs(outside - b).max() > 300e-9


@in_flight
def test_of_several_each_reads_the_coils_by_its_own_matrix(make):
    """One without a matrix keeps the bits of one whose neighbour has none either."""
    units = {"near": DRIVEN, "far": {"noise_nt": 5.0}}
    result, b = flown(make, {"magnetometers": units})
    plain, _ = flown(make, {"magnetometers": units | {"near": {}}})
    far = result["magnetometers.far"].values
    assert np.array_equal(far, plain["magnetometers.far"].values, equal_nan=True)
    dipoles = dipoles_before(result)
    near = b @ np.transpose(SOFT) + 1e-9 * dipoles @ COUPLING
    near += 1e-9 * np.array(OFFSET) * np.any(dipoles, axis=1, keepdims=True)
    assert result["magnetometers.near"].values[1:-1] == pytest.approx(near[1:-1], abs=1e-14)


@in_flight
def test_an_isotropic_matrix_is_the_scalar(make):
    one, _ = flown(make, {"magnetometer": {"coil_disturbance_nt_per_a_m2": 250.0}})
    many, _ = flown(make, {"magnetometer": {"coil_coupling_nt_per_a_m2": 250.0 * np.eye(3)}})
    np.testing.assert_allclose(many["b_measured"], one["b_measured"], rtol=0, atol=1e-19)


@in_flight
def test_a_window_keeps_the_coils_out_of_the_readings(make):
    window = {"sample_s": 1.0, "measure_s": 2.0, "actuate_s": 3.0}
    result, b = flown(make, {"magnetometer": DRIVEN}, control=window)
    at = np.arange(61) % 5 == 2  # the end of the window: the last reading before the command
    expected = b @ np.transpose(SOFT)
    assert result["b_measured"].values[at][1:] == pytest.approx(expected[at][1:], abs=1e-14)


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("magnetometer", {"coil_coupling_nt_per_a_m2": COUPLING[:2]},
         r"spacecraft.magnetometer.coil_coupling_nt_per_a_m2: must have a vector for each of the "
         r"coils \(3\); received 2$"),
        ("magnetometers", {"a": {"coil_coupling_nt_per_a_m2": [[1, 2, 3]] * 4}, "b": {}},
         r"spacecraft.magnetometers.a.coil_coupling_nt_per_a_m2: must have a vector for each of "
         r"the coils \(3\); received 4$"),
        ("magnetometer", {"coil_coupling_nt_per_a_m2": COUPLING,
                          "coil_disturbance_nt_per_a_m2": 3.0},
         "spacecraft.magnetometer.coil_disturbance_nt_per_a_m2: must be left out with "
         "coil_coupling_nt_per_a_m2; received 3$"),
        ("magnetometer", {"soft_iron": [[1, 0, 0], [0, 1, 0], [1, 1, 0]]},
         "spacecraft.magnetometer.soft_iron: must be a matrix that can be inverted; received one "
         "of determinant 0$"),
        ("magnetometer", {"coil_coupling_nt_per_a_m2": [[1, 2, 3]] * 7},
         "spacecraft.magnetometer.coil_coupling_nt_per_a_m2: must have 1 to 6 vectors, one for "
         "each coil; received 7$"),
        ("magnetometer", {"coil_coupling_nt_per_a_m2": []},
         "spacecraft.magnetometer.coil_coupling_nt_per_a_m2: must have 1 to 6 vectors, one for "
         "each coil; received 0$"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_refused(make, key, value, message):
    with pytest.raises(ScenarioError, match=message):
        make({f"spacecraft.{key}": value, "spacecraft.coils.limit_a_m2": 3.0})


def test_without_coils_there_is_no_coupling(make):
    message = r"must have a vector for each of the coils \(0\); received 3"
    without = make({"control.law": {"kind": "off"}}).replace("spacecraft.coils", None)
    with pytest.raises(ScenarioError, match=message):
        without.replace("spacecraft.magnetometer.coil_coupling_nt_per_a_m2", COUPLING)


FILTER = {"kind": "kalman_gyro", "sensors": ["magnetometer", "sun"], "magnetometer_noise_nt": 10.0,
          "sun_noise_deg": 0.5, "angle_random_walk_deg_sqrt_s": 1e-3,
          "rate_random_walk_deg_s_sqrt_s": 1e-5, "gyro_bias_sigma_deg_s": 0.1}  # fmt: skip


def lasting_errors(make, **keys):
    """The notes on errors of the magnetometer for which a filter has no room."""
    law = {"kind": "bdot", "gain_a_m2_s_per_t": 1e5}
    changes = {"control.estimator": FILTER, "control.law": law}
    changes |= {"spacecraft.coils.limit_a_m2": 2.0, "spacecraft.magnetometer": keys}
    return [note for note in write_notes(make(changes)) if "leaves no room" in note]


def test_filters_are_told_of_matrix_driver_and_iron_as_of_the_scalar(make):
    assert lasting_errors(make) == []
    (scalar,) = lasting_errors(make, coil_disturbance_nt_per_a_m2=250.0)
    assert "500 nT of each component (the coils' own dipole)" in scalar
    matrix = 250.0 * np.eye(3)
    assert lasting_errors(make, coil_coupling_nt_per_a_m2=matrix) == [scalar]
    (driver,) = lasting_errors(make, coil_offset_nt=[40.0, 40.0, -40.0])
    assert "40 nT of each component (the coils' driver)" in driver
    (iron,) = lasting_errors(make, soft_iron=0.01 * np.ones((3, 3)) + np.eye(3))
    assert "(soft iron)" in iron


def test_the_law_is_told_of_the_matrix_as_of_the_scalar(make):
    def notes(**keys):
        law = {"kind": "bdot", "gain_a_m2_s_per_t": 2e5}
        changes = {"control.law": law, "spacecraft.magnetometer": keys}
        return [note for note in write_notes(make(changes)) if "own dipole" in note]

    (scalar,) = notes(coil_disturbance_nt_per_a_m2=500.0)
    assert notes(coil_coupling_nt_per_a_m2=500.0 * np.eye(3)) == [scalar]
    turned = Rotation.from_euler("xyz", [20, 30, 40], degrees=True).as_matrix()
    assert notes(coil_coupling_nt_per_a_m2=500.0 * turned) == [scalar]
    assert notes(coil_coupling_nt_per_a_m2=5.0 * np.eye(3)) == []
