"""Momentum bias in closed loop: pitch, nutation, the wheel's momentum; log; plain Python."""

import dataclasses
import math

import numpy as np
import pytest
from law_cases import inputs
from scipy.spatial.transform import Rotation

from torquer import simulate
from torquer.compile import engine
from torquer.computer.laws.bias_momentum import BiasMomentum, bias_momentum
from torquer.maths.geometry.frames import dcm_orbital_to_inertial
from torquer.scenario.load import scenario_from_data

FLIGHT = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
UNLOADING, TRANSVERSE, BIAS = 1e-3, 1.0, 0.1
LAW = {
    "kind": "bias_momentum",
    "bias_momentum_n_m_s": BIAS,
    "pitch_inertia_kg_m2": 1.2,
    "bandwidth_rad_s": 0.05,
    "nutation_gain_a_m2_s_per_t": 2e6,
    "unloading_gain_per_s": UNLOADING,
}
RPM_AT_BIAS = 6000.0 * BIAS / 0.4


def flight(law=(), excess=0.0, rate_deg_s=0.0, pitch_deg=0.0, **changes):
    """A satellite with a pitch wheel beside two that stand, on a circular orbit."""
    data = {
        "start": "2025-03-01T00:00:00Z",
        "orbit": {"kind": "circular", "altitude_km": 550.0, "inclination_deg": 70.0},
        "environment": {
            "field": {"kind": "averaged"},
            "gravity_gradient": False,
            "earth_rotation": "sidereal",
        },
        "spacecraft": {
            "body": {"inertia_kg_m2": [TRANSVERSE, 1.2, TRANSVERSE]},
            "coils": {"limit_a_m2": 20.0},
            "wheels": {
                "layout": {"kind": "orthogonal"},
                "momentum_limit_n_m_s": 0.4,
                "torque_limit_n_m": 0.01,
                "initial_speed_rpm": [0.0, RPM_AT_BIAS * (1.0 + excess / BIAS), 0.0],
                "allocation": "least_squares",
            },
        },
        "initial": {
            "reference": "orbital",
            "rate_relative_to": "orbital",
            "rate_deg_s": [rate_deg_s, 0.0, 0.0],
            "euler_deg": [0.0, pitch_deg, 0.0],
        },
        "control": {"sample_s": 1.0, "law": {**LAW, **dict(law)}},
        "simulation": {"duration_s": 6000.0, "step_s": 0.5, "record_s": 10.0},
    }
    return scenario_from_data(data | changes)


def nutation_deg(result):
    """Angle between the pitch axis and the momentum of body and wheels."""
    axis = Rotation.from_quat(result["q_body_to_inertial"]).apply([0.0, 1.0, 0.0])
    momentum = result["momentum_inertial"].values
    sine = np.linalg.norm(np.cross(axis, momentum), axis=1)
    return np.degrees(np.arctan2(sine, np.sum(axis * momentum, axis=1)))


@FLIGHT
def test_pitch_nutation_and_the_wheels_momentum_come_to_rest_together():
    result = simulate(flight(excess=0.03, rate_deg_s=0.5, pitch_deg=20.0))
    pitch, nutation = np.degrees(result["law.pitch_rad"]), nutation_deg(result)
    excess = result["law.momentum_error_n_m_s"].values
    assert (pitch[0], nutation[0]) == pytest.approx((20.0, 3.8), abs=0.2)
    assert np.abs(pitch[-60:]).max() < 0.02 and nutation[-60:].max() < 0.03
    assert excess[0] == pytest.approx(0.03, rel=1e-6) and np.abs(excess[-60:]).max() < 1.5e-4


@FLIGHT
def test_wheel_momentum_returns_to_bias_at_the_gains_rate():
    for excess in (0.03, -0.03):
        result = simulate(flight(excess=excess))
        t, error = result["time"].values, result["law.momentum_error_n_m_s"].values
        settled = (t > 600.0) & (t < 4000.0)
        slope = np.polyfit(t[settled], np.log(error[settled] / excess), 1)[0]
        assert slope == pytest.approx(-UNLOADING, rel=0.01)
        wheel = result["wheel_momentum"].values[:, 1]
        assert wheel == pytest.approx(BIAS + error, rel=0.0, abs=2e-4)


@FLIGHT
def test_nutation_decays_by_the_field_across_the_pitch_axis():
    """-d ln(angle)/dt = n (B^2 - (B.e)^2)/(2 J) for a body that is round about its pitch axis."""
    result = simulate(flight({"unloading_gain_per_s": 0.0}, rate_deg_s=0.3))
    t, angle, b = result["time"].values, nutation_deg(result), result["b_body"].values
    across = b[:, 0] ** 2 + b[:, 2] ** 2
    rate = 2e6 * across / (2.0 * TRANSVERSE)
    fallen = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(t) * (rate[1:] + rate[:-1]))])
    part = (t > 100.0) & (t < 2000.0)
    slope = np.polyfit(fallen[part], np.log(angle[part]), 1)[0]
    assert slope == pytest.approx(-1.0, rel=0.05)
    assert fallen[part][-1] > 1.0


@FLIGHT
@pytest.mark.parametrize("integral_time_s", [None, 200.0])
def test_steady_pitch_torque_is_passed_on_to_the_coils(integral_time_s):
    """The wheel goes T/u off its bias: there the coils take the torque on, and pitch is held."""
    torque = 1e-5
    result = simulate(
        flight(
            {"integral_time_s": integral_time_s} if integral_time_s else {},
            disturbance={"constant_torque_n_m": [0.0, torque, 0.0]},
        )
    )
    pitch, excess = result["law.pitch_rad"].values, result["law.momentum_error_n_m_s"].values
    assert excess[-1] == pytest.approx(torque / UNLOADING, rel=0.02)
    assert np.abs(pitch[-60:]).max() < 1e-4 * math.pi


@FLIGHT
def test_plain_python_flies_the_same():
    scenario = flight(
        {"integral_time_s": 300.0}, excess=0.02, rate_deg_s=0.3, pitch_deg=10.0,
        simulation={"duration_s": 300.0, "step_s": 0.5, "record_s": 10.0},
    )  # fmt: skip
    law = scenario.control.law.law()
    whole, plain = simulate(scenario), simulate(scenario, dataclasses.replace(law, compiled=False))
    for name in ("q_body_to_inertial", "command_body", "torque_command_body", "wheel_momentum"):
        size = np.abs(whole[name].values).max()
        assert plain[name].values == pytest.approx(whole[name].values, rel=0.0, abs=1e-10 * size)
    for name, unit in (("law.pitch_rad", "rad"), ("law.momentum_error_n_m_s", "N m s")):
        assert plain[name].values == pytest.approx(whole[name].values, rel=1e-7, abs=1e-12)
        assert whole[name].attrs["units"] == unit


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ({"reference": "inertial"}, r"reference: .*'orbital'"),
        ({"pitch_axis": (0.0, 0.0, 0.0)}, "pitch_axis: must be non-zero vectors"),
        ({"bandwidth_rad_s": 0.0}, r"bandwidth_rad_s: .*greater than 0"),
        ({"integral_time_s": 0.0}, r"integral_time_s: .*greater than 0"),
        ({"unloading_gain_per_s": -1.0}, r"unloading_gain_per_s: .*greater than or equal to 0"),
    ],
)
def test_keys_are_checked(keys, expected):
    with pytest.raises(ValueError, match=expected):
        BiasMomentum(**(LAW | keys))


PITCH = 0.2
PLACE = {"r": (7e6, 0.0, 0.0), "v": (0.0, 7.5e3, 0.0)}


def asked(law, memory, t_s, read_s, b_t):
    """What the law answers at `t_s`, held at a pitch angle, to a field read at `read_s`."""
    frame = Rotation.from_matrix(np.array(dcm_orbital_to_inertial(*PLACE.values())))
    q = (frame * Rotation.from_euler("y", PITCH)).as_quat()
    known = inputs(t_s, (0.0, b_t, 2e-5), q=q, **PLACE)
    known = known._replace(read_at=known.read_at._replace(magnetometer_s=float(read_s)))
    return bias_momentum(known, law.record_from(law.pack()), memory)


def remembering(**keys):
    """The law without unloading, and its memory at the start."""
    law = BiasMomentum(**(LAW | {"unloading_gain_per_s": 0.0} | keys)).law()
    return law, law.record_of(law.first_memory())


def test_neither_integral_nor_difference_crosses_a_gap():
    """Half an hour in which another law worked: the pitch of now did not last for so long."""
    law, memory = remembering(integral_time_s=200.0)
    for t in range(4):
        asked(law, memory, t, t, 1e-9 * t)
    before = memory.pitch_integral_rad_s
    assert before == pytest.approx(2.0 * 2.0 * math.sin(0.5 * PITCH), rel=1e-9)
    after_gap = asked(law, memory, 1803.0, 1803.0, 3e-5)
    assert memory.pitch_integral_rad_s == before
    assert after_gap.dipole_a_m2 == (0.0, 0.0, 0.0)
    again = asked(law, memory, 1804.0, 1804.0, 3e-5 + 1e-9)
    assert memory.pitch_integral_rad_s == pytest.approx(1.5 * before, rel=1e-9)
    assert again.dipole_a_m2 == pytest.approx((0.0, -2e6 * 1e-9, 0.0), rel=1e-6)


def test_a_slower_magnetometer_gives_the_same_steady_dipole():
    """The field changes by 1 nT/s and is read every 5 s: the interval is that of the readings."""
    law, memory = remembering()
    found = [asked(law, memory, t, t - t % 5, 1e-9 * (t - t % 5)) for t in range(30)]
    for command in found[5:]:
        assert command.dipole_a_m2 == pytest.approx((0.0, -2e6 * 1e-9, 0.0), rel=1e-9)
