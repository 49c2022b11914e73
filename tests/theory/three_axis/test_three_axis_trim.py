"""The trim of a hold's residual dipole: its time constant and its conditions."""

import math

import pytest
from attitude_holds import CUBESAT, hold

from torquer.theory.three_axis.gain_search import DesignTask, least_held
from torquer.theory.three_axis.sampled import Cycle, SampledHold
from torquer.theory.three_axis.trim import FILTERED, OBSERVED, design_trim


def made(cycle, **changed):
    held = hold(**{**CUBESAT, **changed})
    task = DesignTask(SampledHold(held, cycle), limit_a_m2=0.2)
    return task, design_trim(task)


def test_it_takes_a_quarter_of_a_revolution_and_half_of_the_coils():
    task, found = made(Cycle(3.0, 0.5))
    period_s = 2.0 * math.pi / task.sampled.hold.rate_rad_s
    assert found.spec.time_constant_s == pytest.approx(0.25 * period_s, rel=5e-3)
    assert found.spec.coil_duty == pytest.approx(6.0 / 7.0, rel=1e-3)
    assert found.spec.greatest_dipole_a_m2 == pytest.approx(0.5 * 0.2 * 6.0 / 7.0, rel=5e-3)
    assert found.spec.inertia_kg_m2 == task.sampled.hold.body.inertia
    observed = least_held(task.sampled.maps.b_body_t)
    assert found.slowest_s == pytest.approx(found.spec.time_constant_s / observed, rel=5e-3)
    assert found.verdict.state == "valid" and 0.3 < observed < 0.7


@pytest.mark.parametrize(
    "changed, cycle, limit",
    [({"inclination_deg": 5.0}, Cycle(3.0), OBSERVED), ({}, Cycle(60.0), FILTERED)],
    ids=["equator", "long cycle"],
)
def test_what_it_cannot_do_is_said(changed, cycle, limit):
    _, found = made(cycle, **changed)
    assert [doubt.limit for doubt in found.verdict.doubts] == [limit]
    assert found.spec.time_constant_s >= 64.0 * sum(cycle) * 0.99
