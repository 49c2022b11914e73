"""Notes on how fast a law can brake: lines of the field in a tumbling body, laws of all kinds."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from tip_off import SCENARIO

from torquer.analysis.notes.sampling_notes import field_lines_rad_s, sampling_notes
from torquer.scenario.change import with_values
from torquer.scenario.load import scenario_from_text

#: A PocketQube: R. Fonod and E. Gill, IAC-18-C1.3.11.
POCKETQUBE = np.diag([1.731e-3, 1.7235e-3, 2.643e-4])
LAW = """
import torquer

@torquer.law
def mine(inputs, parameters, memory):
    b = inputs.b_body_t
    return (-b[0], -b[1], -b[2])
"""


def lines_deg_s(inertia, rates_deg_s):
    found = field_lines_rad_s(np.array(inertia), np.radians(rates_deg_s))
    return sorted(np.degrees([rate for rate, part in found if part > 0.1]))


def test_a_slender_body_has_lines_beyond_its_own_rate():
    """At 180 deg/s about each axis, 312 deg/s in all, one line is at 409 deg/s."""
    found = lines_deg_s(POCKETQUBE, [180.0, 180.0, 180.0])
    assert found == pytest.approx([103.5, 152.5, 256.0, 408.6], rel=2e-3)


@pytest.mark.parametrize("rates", [[10.0, 0.0, 0.0], [3.0, -4.0, 12.0]])
def test_a_ball_has_one_line(rates):
    found = [rate for rate in lines_deg_s(0.3 * np.eye(3), rates) if rate > 1e-9]
    assert found == pytest.approx([np.linalg.norm(rates)] * len(found))


def test_a_body_at_rest_has_none():
    assert field_lines_rad_s(POCKETQUBE, np.zeros(3)) == []


@pytest.mark.parametrize("moments", [(2.0, 2.0, 0.5), (1.0, 1.0, 1.7), (3.0, 1.0, 1.0)])
def test_lines_are_those_of_the_free_motion(moments):
    """Of a symmetric body: the spectrum of a fixed direction in its axes has these lines alone."""
    j1, j2, j3 = moments

    def motion(t, y):
        p, q, r, x, y, z = y
        return [
            (j2 - j3) / j1 * q * r, (j3 - j1) / j2 * r * p, (j1 - j2) / j3 * p * q,
            y * r - z * q, z * p - x * r, x * q - y * p,
        ]  # fmt: skip

    omega, t = np.array([0.5, 0.4, 0.9]), np.linspace(0.0, 2000.0, 2**14, endpoint=False)
    start = np.concatenate([omega, [0.36, 0.48, 0.8]])
    seen = solve_ivp(motion, (0.0, t[-1]), start, "DOP853", t, rtol=1e-9, atol=1e-11).y[3:]
    power = np.abs(np.fft.rfft(seen * np.hanning(len(t)), axis=1)).max(axis=0)
    peaks = 1 + np.flatnonzero((power[1:-1] > power[:-2]) & (power[1:-1] >= power[2:]))
    peaks = peaks[power[peaks] > 0.02 * power[peaks].max()]
    step = 2.0 * np.pi / 2000.0
    known = np.array(
        [rate for rate, part in field_lines_rad_s(np.diag(moments), omega) if part > 0.02]
    )
    for peak in step * peaks:
        assert np.abs(known - peak).min() < 1.5 * step, peak


@pytest.fixture
def own(tmp_path):
    (tmp_path / "law.py").write_text(LAW)
    law = {"kind": "user", "file": str(tmp_path / "law.py")}
    times = {"control.sample_s": 0.25, "simulation": {"duration_s": 900.0, "record_s": 20.0}}
    body = {"spacecraft.body.inertia_kg_m2": POCKETQUBE.tolist()}
    return with_values(scenario_from_text(SCENARIO), {"control.law": law, **times, **body})


def test_a_law_of_ones_own_is_told_of_the_fastest_line(own):
    (note,) = sampling_notes(own.replace("initial.rate_deg_s", [180.0, 180.0, 180.0]))
    assert "up to 409 deg/s" in note and "above the 360 deg/s that a law of differences" in note
    assert sampling_notes(own.replace("initial.rate_deg_s", [150.0, 150.0, 150.0])) == []


def test_laws_without_differences_have_a_limit_of_their_own(own):
    """Held for 0.25 s: 720 deg/s by gyro, 360 deg/s by differences."""
    bcross = {"kind": "bcross", "gain_n_m_s": 1e-5}
    fast = own.replace("initial.rate_deg_s", [180.0, 180.0, 180.0])
    assert sampling_notes(fast.replace("control.law", bcross)) == []
    faster = fast.replace("initial.rate_deg_s", [400.0, 400.0, 400.0])
    (note,) = sampling_notes(faster.replace("control.law", bcross))
    assert "above the 720 deg/s that this law can brake" in note
    normalised = {"kind": "bdot_normalised", "gain_n_m_s": 1e-5}
    (note,) = sampling_notes(fast.replace("control.law", normalised))
    assert "above the 360 deg/s that this law can brake" in note
    bdot = {"kind": "bdot", "gain_a_m2_s_per_t": 1e3}
    assert sampling_notes(fast.replace("control.law", bdot)) == [], "it has a note of its own"
