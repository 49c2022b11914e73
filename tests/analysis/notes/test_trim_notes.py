"""Notes on the law `dipole_trim`: what a scenario says against what the law knows."""

from pathlib import Path

import pytest

from torquer.analysis.notes.trim_notes import trim_notes
from torquer.scenario.load import load_scenario

EXAMPLE = load_scenario(Path(__file__).parents[3] / "examples/residual_dipole.toml")


def test_nothing_is_said_of_the_example():
    assert trim_notes(EXAMPLE) == []


@pytest.mark.parametrize(
    "key, value, said",
    [
        ("control.laws.trim.coil_duty", 1.0,
         "trim: the coils are on for 85.7 % of the time, and coil_duty of the law is 1: it trims "
         "85.7 % of the dipole"),
        ("control.laws.trim.time_constant_s", 30.0,
         "trim: time_constant_s of 30 s is below 48 s, 16 times the longest interval between "
         "control steps: the law takes every interval for a gap, and estimates nothing"),
        ("control.laws.trim.greatest_dipole_a_m2", 0.005,
         "trim: greatest_dipole_a_m2 of 0.005 A m^2 is less than the residual dipole, 0.00866 "
         "A m^2: the rest is not trimmed"),
        ("control.laws.trim.greatest_dipole_a_m2", 0.3,
         "trim: greatest_dipole_a_m2 of 0.3 A m^2 is more than a coil gives in the mean, "
         "0.206 A m^2"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_said(key, value, said):
    assert trim_notes(EXAMPLE.replace(key, value)) == [said]


def test_wheels_are_said_to_mislead_it():
    wheels = {
        "layout": {"kind": "orthogonal"}, "momentum_limit_n_m_s": 0.05, "torque_limit_n_m": 1e-3,
        "speed_limit_rpm": 6000.0,
    }  # fmt: skip
    assert trim_notes(EXAMPLE.replace("spacecraft.wheels", wheels)) == [
        "trim: dipole_trim does not know the torques of the wheels, and takes them for a dipole's"
    ]
