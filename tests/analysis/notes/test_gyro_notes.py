"""Notes on the law `magneto_gyro`: what they say, and that flights agree."""

import math
from pathlib import Path

import numpy as np
import pytest

from torquer.analysis.attitude import find_attitude_error
from torquer.analysis.notes.gyro_notes import damping_left, gyro_notes
from torquer.scenario.load import load_scenario
from torquer.simulation.setup.simulate import simulate

ROOT = Path(__file__).parents[3]
EXAMPLE = load_scenario(ROOT / "examples/magneto_gyro.toml")
MICRO = load_scenario(ROOT / "examples/magneto_gyro_micro.toml")
LAW = EXAMPLE.control.law


def notes(key, value, scenario=EXAMPLE):
    return gyro_notes(scenario.replace(key, value))


@pytest.mark.parametrize("scenario", [EXAMPLE, MICRO], ids=["two tonnes", "micro"])
def test_nothing_is_said_of_the_examples(scenario):
    assert gyro_notes(scenario) == []


WHEEL = "spacecraft.body.wheel_momentum_n_m_s"
CASES = [
    (WHEEL, (0.0, 5.0, 0.0),
     "a wheel of 5 N m s along the orbit normal cannot hold roll and yaw: stage 1 needs more than "
     "5.362 N m s (h > 0)"),
    (WHEEL, (0.0, 20.0, 0.0),
     "the wheel has 20 N m s along the orbit normal, and bias_momentum_n_m_s of the law is 30"),
    ("control.law.orbital_rate_rad_s", 0.0591,
     "the mean orbital rate is 0.001032 rad/s, and orbital_rate_rad_s of the law is 0.0591"),
    ("orbit.inclination_deg", 165.0,
     "an inclination of 165 deg is too near to the equator for magneto_gyro: the field hardly "
     "turns in the orbit's plane, and below 25 deg some starts are not captured"),
    ("control.law.coil_duty", 0.5,
     "the coils are on for 100 % of the time, and coil_duty of the law is 0.5: stage 2 points "
     "worse"),
    ("initial.rate_deg_s", (0.0, 8.0, 0.0),
     "the initial rate of 8 deg/s is above the 4.5 deg/s that stage 1 brakes with filters of "
     "0.0982 rad/s"),
    ("control.sample_s", 60.0,
     "dipoles held for 60 s leave stage 1 no damping at some rates up to the initial 3 deg/s"),
]  # fmt: skip


@pytest.mark.parametrize(("key", "value", "note"), CASES, ids=[case[0] for case in CASES])
def test_what_is_said(key, value, note):
    assert notes(key, value) == [note]


@pytest.mark.parametrize(("hold_s", "brakes"), [(30.0, True), (50.0, False)])
def test_holds_that_leave_no_damping_do_not_brake(hold_s, brakes):
    scenario = EXAMPLE.replace("control.sample_s", hold_s).replace("simulation.revolutions", 16.0)
    assert (notes("control.sample_s", hold_s) == []) == brakes
    error = np.linalg.norm(find_attitude_error(simulate(scenario)).error_deg[-50:], axis=1)
    assert error.max() < 1.0 if brakes else error.max() > 30.0


def test_the_damping_left_without_holds_is_that_of_the_link():
    """Im of i w w0^2/(w0^2 - w^2 + 2 i z w0 w), over w."""
    w, w0, z = math.radians(3.0), LAW.filter_rate_rad_s, LAW.filter_damping
    link = 1j * w0**2 / (w0**2 - w**2 + 2j * z * w0 * w)
    assert damping_left(LAW, w, 1e-3) == pytest.approx(link.imag, rel=1e-3)
