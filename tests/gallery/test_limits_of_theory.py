"""Limits of series and linear leans against the truth."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import mathieu_a, mathieu_b

from gallery.theory.mathieu import (
    first_tongue,
    first_tongue_of_strength,
    half_trace,
    half_trace_series,
    mathieu_equation,
    mathieu_parameters,
    multipliers_from_half_trace,
)
from gallery.theory.pitch_wheel import (
    PitchWheel,
    pitch_offset_averaged_polar,
    pitch_offset_direct_dipole,
    pitch_wheel_response as pitch_response,
)
from gallery.theory.planar_magnet import (
    tracking_motion,
)
from gallery.theory.steady_bdot import (
    PITCH,
    ROLL,
    SteadyBdot,
    mean_offset,
    motion_from_rest,
    published_offset,
    published_swing,
    steady_bdot_response,
)
from torquer.compile import engine
from torquer.theory.periodic.floquet import monodromy


def one_line(error) -> bool:
    return "\n" not in str(error) and 0 < len(str(error)) < 400


# ------------------------------------------------------------ series


def exact_tongue(chi, side):
    """lambda^2 on an edge for given chi > 0."""
    value = (mathieu_b, mathieu_a)[side]
    return brentq(lambda x: x - value(1, 0.5 * x * chi), 0.05, 60.0, xtol=1e-13)


@pytest.mark.parametrize(("chi", "off"), [(0.3, 2.3e-3), (1.0, 0.0924)])
def test_the_tongue_is_off_by_what_the_docstring_says(chi, off):
    found = [abs(first_tongue(chi)[side] / exact_tongue(chi, side) - 1.0) for side in (0, 1)]
    assert max(found) == pytest.approx(off, rel=0.05)


def test_tongue_of_a_strength_errs_as_the_docstring_says():
    def off(s):
        exact = [float(mathieu_b(1, s / 2)), float(mathieu_a(1, s / 2))]
        return np.abs(np.array(first_tongue_of_strength(s)) / exact - 1.0).max()

    assert off(4.0) == pytest.approx(0.006, abs=5e-4)
    assert 0.05 < off(6.5) < 0.1
    assert off(6.5) > 1.5 * off(6.0)


@pytest.mark.parametrize("lambda2", [0.3, 1.0, 2.7, 4.0, 9.0, 25.0, 100.0])
def test_half_trace_series_holds_to_a_tenth_within_its_limit(lambda2):
    chi = math.sqrt(0.3 * 16.0 / (math.pi * math.sqrt(lambda2))) * (1.0 - 1e-12)
    exact = float(half_trace(monodromy(mathieu_equation, **mathieu_parameters(lambda2, chi))))
    assert abs(half_trace_series(lambda2, chi) - exact) < 0.1
    with pytest.raises(ValueError, match=r"^pi lambda chi\^2/16: must lie within 0\.\.0\.3 "):
        half_trace_series(lambda2, 1.01 * chi)


def test_small_multipliers_are_not_lost():
    a = np.array([1e9, -1e9, 1e150, 1.5, -0.3])
    rho = multipliers_from_half_trace(a)
    assert np.prod(rho, axis=-1) == pytest.approx(np.ones(5), rel=1e-14)
    assert rho[0, 1] == pytest.approx(5e-10, rel=1e-12)
    assert np.all(np.abs(rho[:, 0]) >= 1.0 - 1e-15)


# ------------------------------------------------------------ leans against gravity


@pytest.mark.parametrize("lean", [0.1, 0.34])
def test_lean_limit_is_where_gravity_departs_from_linear_law(lean):
    """The whole equations come to rest at asin(2x)/2: a tenth more at x = 0.34."""
    case = SteadyBdot(ratio=0.98, eps=0.06 * lean, inclination_deg=90.0).as_published()
    linear = published_offset(case)
    assert linear.pitch == pytest.approx(lean) and linear.notes == ()
    found = mean_offset(case, 120, 40) if engine.COMPILED else None
    if found:
        assert found.pitch == pytest.approx(0.5 * math.asin(2.0 * lean), rel=5e-3)
    assert 0.5 * math.asin(0.68) / 0.34 == pytest.approx(1.1, abs=1e-3)


def test_leans_are_noted_and_then_refused():
    def offset(ratio):
        return published_offset(SteadyBdot(ratio=ratio, eps=0.1, inclination_deg=90.0))

    (note,) = offset(0.92).notes
    assert note.startswith("tilt [rad] = 0.417: must lie within -0.34..0.34 (the linear")
    with pytest.raises(ValueError, match=r"^tilt \[rad\]: must lie within -0\.5\.\.0\.5 \("):
        offset(0.999)
    wild = steady_bdot_response(SteadyBdot(ratio=0.999, eps=0.1, inclination_deg=90.0))
    assert any(note.startswith("tilt [rad]") for note in wild.notes)
    assert steady_bdot_response(SteadyBdot(ratio=0.5, eps=0.01, inclination_deg=50.0)).notes == ()


def test_a_satellite_that_falls_over_is_refused_in_one_line():
    for eps in (3.0, 100.0):
        case = SteadyBdot(ratio=0.5, eps=eps, inclination_deg=50.0)
        with pytest.raises(ValueError, match=r"^eps: must keep the axis above the horizontal"):
            motion_from_rest(case, 2.0)


def test_swing_errs_by_a_tenth_where_its_note_begins():
    case = SteadyBdot(ratio=0.3, eps=0.01, inclination_deg=50.0).as_published()
    u, x = motion_from_rest(case, 0.1 / 0.01 / (2.0 * math.pi))
    pitch, roll, notes = published_swing(case, u[:-1])
    assert notes == ()
    lean = published_offset(case)
    off = max(np.abs(x[:-1, PITCH] - pitch).max() / (2.0 * lean.pitch),
              np.abs(x[:-1, ROLL] - roll).max() / (2.0 * abs(lean.roll)))  # fmt: skip
    assert off == pytest.approx(0.1, abs=0.03)
    assert published_swing(case, [20.0]).notes[0].startswith("eps u = 0.2: must lie within 0..0.1")


def test_a_mean_that_is_not_settled_is_noted():
    case = SteadyBdot(ratio=0.8, eps=2e-3, inclination_deg=50.0).as_published()
    assert mean_offset(case, 2, 1).notes[0].startswith("change = ")
    with pytest.raises(ValueError, match=r"^last: must lie within 1\.\.1 .*; received 8"):
        mean_offset(case, 2, 8)


WHEEL = PitchWheel(inertia_kg_m2=(10.0, 13.0, 12.0), wheel_momentum_n_m_s=0.02, gain_a_m2_s_t=2.5e5,
                   altitude_km=600.0, inclination_deg=90.0)  # fmt: skip


def test_pitch_that_gravity_does_not_hold_is_refused_or_noted():
    strong = WHEEL.model_copy(update={"gain_a_m2_s_t": 1e8})
    for formula in (pitch_offset_direct_dipole, pitch_offset_averaged_polar):
        assert 0.0 < formula(WHEEL) < 0.1
        with pytest.raises(ValueError, match=r"^tilt \[rad\]: must lie within -0\.34\.\.0\.34"):
            formula(strong)
    assert pitch_response(WHEEL).notes == ()
    assert any(note.startswith("tilt") for note in pitch_response(strong).notes)
    upside = WHEEL.model_copy(update={"inertia_kg_m2": (13.0, 10.0, 12.0)})
    assert any(note.startswith("growth of a free") for note in pitch_response(upside).notes)


# ------------------------------------------------------------ tracking


def test_tracking_stays_near_the_field():
    ahead = tracking_motion(0.5, 9.0, 0)
    assert np.abs(ahead[:, 0]).max() < 0.5 * math.pi
    for eta, lambda2 in ((2.9, 16.0), (0.5, 16.0), (-2.9, 3.9)):
        try:
            found = tracking_motion(eta, lambda2, 0)
            assert np.abs(found[:, 0]).max() < 0.5 * math.pi
        except ArithmeticError as error:
            assert one_line(error)
