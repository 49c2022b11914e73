"""What `torquer validate` tells of disturbance torques and Sun sensors."""

import numpy as np
import pytest

from torquer.analysis.notes.disturbance_notes import disturbance_notes
from torquer.analysis.notes.notes import write_notes

#: Nothing to remark: coils of 3 A m^2, sensors on all sides.
SOUND = {
    "spacecraft.sun_sensors": {
        "axes": [[1, 0, 0], [-1, 0, 0]],
        "half_field_deg": 80.0,
        "albedo": 0.3,
        "bias_deg": [1.0, 0.0, 0.0],
        "blind_zones": [{"axis": [0, 0, 1], "half_angle_deg": 20}],
    },
    "disturbance": {
        "constant_torque_n_m": [1e-6, 0, 0],
        "solar_pressure": {"parts": [{"kind": "sphere", "radius_m": 1, "centre_m": [0, 0, 0.1]}]},
        "residual_dipole": {"constant_a_m2": [0.1, 0, 0]},
        "eddy_currents": {"damping_n_m_s_per_t2": 1e4},
        "unmodelled": {"constant_n_m": 1e-7, "harmonic_1_n_m": 1e-7, "hold_s": 100.0},
    },
}
UNMODELLED = SOUND["disturbance"]["unmodelled"]


def test_sound_values_need_no_note(make):
    assert disturbance_notes(make(SOUND)) == []
    assert disturbance_notes(make()) == []


@pytest.mark.parametrize(
    ("key", "value", "expected"),
    [
        ("disturbance.constant_torque_n_m", [1e-3, 0, 0],
         "the constant torque of 0.001 N m exceeds what the coils can give in a field of 4e-05 "
         "T, 0.00021 N m"),
        ("disturbance.residual_dipole", {}, "residual_dipole has no effect: its dipoles are zero"),
        ("disturbance.residual_dipole", {"constant_a_m2": [4, 0, 0], "amplitude_a_m2": [2, 0, 0]},
         "the residual dipole of up to 6 A m^2 exceeds the coils' greatest, 5.2 A m^2"),
        ("disturbance.solar_pressure.parts", [{"kind": "sphere", "radius_m": 1.0}],
         "disturbance.solar_pressure gives no torque with the parts as given: each has its centre"),
        ("disturbance.eddy_currents.damping_n_m_s_per_t2", 0.0, "its damping is zero"),
        ("disturbance.eddy_currents.damping_n_m_s_per_t2", [0.0, 0.0, 1e7],
         "eddy currents brake the rotation within about 61 s, less than a revolution"),
        ("disturbance.unmodelled", {"hold_s": 100.0},
         "disturbance.unmodelled has no effect: its sizes are zero"),
        ("disturbance.unmodelled", UNMODELLED | {"hold_s": 600.0},
         "does not jump: its coefficients are held for 600 s, as long as the run or longer"),
        ("disturbance.unmodelled", UNMODELLED | {"harmonic_2_n_m": 1e-6},
         "is 1.7e-06 N m (RMS), beyond the greatest gravity-gradient torque of 1.3e-06 N m"),
        ("spacecraft.sun_sensors.bias_deg", [[0, 0, 1], [0, 6, 8]],
         "a Sun sensor's bias of 10 deg is more than a small mounting error"),
        ("spacecraft.sun_sensors.half_field_deg", [80.0, 45.0],
         "their fields of view are wider than +-45 deg"),
        ("spacecraft.sun_sensors.blind_zones",
         [{"axis": [1, 0, 0], "half_angle_deg": 81, "sensors": [0]}],
         "Sun sensor 0 sees nothing: its field of view is within a blind zone"),
    ],
)  # fmt: skip
def test_doubtful_values_are_reported(make, key, value, expected):
    scenario = make(SOUND).replace(key, value)
    (note,) = disturbance_notes(scenario)
    assert expected in note and "\n" not in note
    assert note in write_notes(scenario)


def test_the_size_of_the_unmodelled_torque_is_its_rms(make):
    """Over many draws and a revolution."""
    random = np.random.default_rng(1)
    u = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
    waves = np.stack([np.ones_like(u), np.sin(u), np.cos(u), np.sin(2 * u), np.cos(2 * u)])
    sizes = np.array([1.0, 2.0, 2.0, 3.0, 3.0])
    drawn = random.normal(size=(4000, 3, 5)) * sizes
    rms = np.sqrt(np.mean(np.sum((drawn @ waves) ** 2, axis=1)))
    assert rms == pytest.approx(np.sqrt(3.0) * np.sqrt(1.0 + 4.0 + 9.0), rel=0.02)
    given = UNMODELLED | {"constant_n_m": 1e-4, "harmonic_1_n_m": 2e-4, "harmonic_2_n_m": 3e-4}
    (note,) = disturbance_notes(make(SOUND).replace("disturbance.unmodelled", given))
    assert f"is {1e-4 * np.sqrt(42.0):.2g} N m (RMS)" in note
