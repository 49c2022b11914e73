"""Axes about which actuators cannot act, and momentum that wheels cannot hold."""

import numpy as np
import pytest

from torquer.analysis.notes.notes import write_notes
from torquer.analysis.notes.reach_notes import reach_notes
from torquer.scenario.load import scenario_from_text
from torquer.spacecraft.wheel_array.envelope import momentum_envelope

#: The satellite of the cases.
CASE = """
start = 2024-03-20T06:00:00Z
orbit = { kind = "circular", altitude_km = 550, inclination_deg = 97.6, raan_deg = 337.5 }
spacecraft.body.inertia_kg_m2 = [0.126, 0.167, 0.061]
spacecraft.coils = { limit_a_m2 = 0.2, residual_dipole_a_m2 = [0.01, 0.02, 0.01] }
[spacecraft.wheels]
layout = { kind = "orthogonal" }
momentum_limit_n_m_s = 0.012
torque_limit_n_m = 0.002
speed_limit_rpm = 6000
[initial]
reference = "orbital"
euler_deg = [0, 0, 0]
rate_deg_s = [0, 0, 0]
rate_relative_to = "orbital"
[control]
sample_s = 0.5
[control.laws.wheels]
kind = "wheel_pd"
bandwidth_rad_s = 0.1
inertia_kg_m2 = [0.126, 0.167, 0.061]
[control.laws.coils]
kind = "unloading"
gain_per_s = 1e-3
wanted_momentum_n_m_s = [0, 0, 0]
[simulation]
revolutions = 6
record_s = 5.0
"""
LAYOUT = 'layout = { kind = "orthogonal" }'


def changed(*change):
    text = CASE
    for old, new in zip(change[::2], change[1::2], strict=True):
        assert text.count(old) == 1
        text = text.replace(old, new)
    return scenario_from_text(text)


def pyramid(gamma_deg):
    new = f'layout = {{ kind = "regular_pyramid", count = 4, gamma_deg = {gamma_deg} }}'
    return changed(LAYOUT, new)


def test_the_satellite_of_the_cases_is_sound():
    assert write_notes(changed()) == []


def test_wheels_that_cannot_act_about_an_axis_are_noted():
    (note,) = write_notes(pyramid(0.001))
    assert note.startswith(
        "spacecraft.wheels.layout: the 4 wheels reach 0.048 N m s along [1.0, 0.0, 0.0] in the "
        "body, and "
    )
    assert note.endswith(
        "e-07 N m s across it: they cannot act about the other axes: wheels 0 and 1, 0 and 2, "
        "0 and 3 and others are parallel"
    )


@pytest.mark.parametrize("gamma_deg", [3.0, 20.0, 54.7, 80.0, 87.0])
def test_real_pyramids_are_left_alone(gamma_deg):
    assert reach_notes(pyramid(gamma_deg)) == []


@pytest.mark.parametrize("gamma_deg", [0.1, 0.5, 89.9])
def test_flat_and_thin_pyramids_are_noted(gamma_deg):
    (note,) = reach_notes(pyramid(gamma_deg))
    assert "the 4 wheels reach" in note


def test_uneven_limits_count_as_much_as_axes():
    (note,) = reach_notes(changed("limit_a_m2 = 0.2", "limit_a_m2 = [0.2, 0.2, 0.002]"))
    assert note == (
        "spacecraft.coils.axes: the 3 coils reach 0.002 A m^2 along [0.0, 0.0, 1.0] in the body, "
        "where they are weakest, and 0.2 A m^2 where they are strongest: they cannot act along "
        "this axis"
    )
    (note,) = reach_notes(changed("torque_limit_n_m = 0.002",
                                  "torque_limit_n_m = [0.002, 0.00002, 0.002]"))  # fmt: skip
    assert "the 3 wheels reach 2e-05 N m along [0.0, 1.0, 0.0]" in note


def test_two_coils_and_lost_wheels_are_meant_to_be_few():
    two = "limit_a_m2 = 0.2, axes = [[1, 0, 0], [0, 1, 0]]"
    assert reach_notes(changed("limit_a_m2 = 0.2", two)) == []
    assert reach_notes(changed(LAYOUT, f"{LAYOUT}\nlost = [1]")) == []


def wanting(momentum):
    return changed("wanted_momentum_n_m_s = [0, 0, 0]", f"wanted_momentum_n_m_s = {momentum}")


def test_a_momentum_beyond_the_wheels_is_noted():
    assert write_notes(wanting([0, 0.04, 0])) == [
        "coils: wanted_momentum_n_m_s of 0.04 N m s is beyond the 0.012 N m s that the wheels hold "
        "in this direction: they saturate, and the attitude is lost"
    ]


@pytest.mark.parametrize("direction", [[0, 1, 0], [1, 1, 0], [1, -1, 1]])
def test_the_envelope_is_the_limit_in_each_direction(direction):
    """Wheels along the axes: a cube, whose corner is further than its faces."""
    envelope = momentum_envelope(changed().spacecraft.wheels.array())
    reach = envelope.extent(direction) / np.linalg.norm(direction) * np.array(direction)
    assert reach_notes(wanting((0.99 * reach).tolist())) == []
    assert len(reach_notes(wanting((1.01 * reach).tolist()))) == 1


def test_a_bias_momentum_along_its_axis_counts_too():
    law = """[control.law]
kind = "bias_momentum"
bias_momentum_n_m_s = {bias}
pitch_axis = [0, {sign}, 0]
pitch_inertia_kg_m2 = 0.167
bandwidth_rad_s = 0.1
nutation_gain_a_m2_s_per_t = 1e3
unloading_gain_per_s = 1e-3
"""
    before, _, rest = CASE.partition("[control.laws.wheels]")
    after = rest[rest.index("[simulation]") :]
    for bias, sign, expected in ((0.011, 1, 0), (-0.013, 1, 1), (0.05, -1, 1)):
        text = before + law.format(bias=bias, sign=sign) + after
        found = reach_notes(scenario_from_text(text))
        assert len(found) == expected and all("bias_momentum_n_m_s of 0.0" in n for n in found)


@pytest.mark.parametrize(("delay_s", "noted"), [(4.0, True), (1.0, False)])
def test_old_readings_of_a_wheel_law_are_noted(delay_s, noted):
    sensor = f"[spacecraft.attitude_sensor]\nsample_s = {delay_s}\ndelay_s = {delay_s}\n"
    found = write_notes(changed("[initial]\n", f"{sensor}[initial]\n"))
    assert len(found) == noted
    age = f"readings of spacecraft.attitude_sensor are up to {2.0 * delay_s:g} s old"
    assert all(age in note for note in found)
