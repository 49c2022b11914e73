"""Where a magneto-gyroscopic design holds: the satellite's own dipole, upside down, flights."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from torquer.compile import engine
from torquer.design.failure import RUNS
from torquer.design.gyro import failure
from torquer.design.gyro.answer import _angle_text
from torquer.design.gyro.domain import _with_remedy
from torquer.design.gyro.flown_scenario import steps_of
from torquer.design.gyro.gains import magneto_gyro
from torquer.design.pointing_flights import PointingFlights
from torquer.design.requests import MagnetoGyroRequest
from torquer.scenario.load import scenario_from_text
from torquer.theory.magneto_gyro.accuracy import follow_revolution
from torquer.theory.magneto_gyro.capture import DAMPING, design_stage_1
from torquer.theory.magneto_gyro.craft import GyroCraft
from torquer.theory.magneto_gyro.loop import DIPOLE, field_at
from torquer.theory.magneto_gyro.own_dipole import (
    TURNED_1,
    TURNED_2,
    turned_in_stage_1,
    turned_in_stage_2,
)
from torquer.theory.magneto_gyro.stage_1 import STAGE_1, stage_1_driven_by
from torquer.theory.magneto_gyro.stage_2 import driven_by, stage_2_loop
from torquer.theory.magneto_gyro.stage_2_gains import Stage2Weights, stage_2_gains
from torquer.theory.validity import Doubt

needs_jit = pytest.mark.skipif(not engine.COMPILED, reason="whole flights: minutes without JIT")
CRAFT = GyroCraft((3800.0, 2200.0, 3600.0), 30.0, 1.0317e-3)
#: A 3U with its long axis to the nadir.
LONG = GyroCraft((0.0429, 0.0429, 0.0068), 1.5e-4, 1.1068e-3)
OWN, NORMAL, FREQUENCY = np.array([0.3, -0.2, 0.1]), -0.1, 97.0


def long_cubesat(wheel_n_m_s=1.5e-4, dipole_a_m2=0.005):
    return scenario_from_text(f"""
        start = 2026-07-01T00:00:00Z
        mission = {{ attitude_error_below_deg = 15 }}
        [orbit]
        kind = "circular"
        altitude_km = 500
        inclination_deg = 97.4
        [spacecraft.body]
        inertia_kg_m2 = [0.0429, 0.0429, 0.0068]
        wheel_momentum_n_m_s = [0, {wheel_n_m_s}, 0]
        [spacecraft.coils]
        limit_a_m2 = 0.24
        residual_dipole_a_m2 = [{dipole_a_m2}, {dipole_a_m2}, {dipole_a_m2}]
        [spacecraft.magnetometer]
        noise_nt = 100
        [initial]
        reference = "orbital"
        rate_deg_s = [3.0, -2.5, 3.1]
        [control]
        sample_s = 1.0
        measure_s = 1.0
        actuate_s = 4.0
        law = {{ kind = "off" }}
        [control.ephemeris]
        field = {{ kind = "igrf14", degree = 8 }}
        [simulation]
        revolutions = 15
        record_s = 20.0
        """)


def driven(matrix, inputs, order):
    """The right-hand side of a loop that the dipole turns."""

    def rates(tau, x):
        torque = np.cross(OWN, field_at(tau, DIPOLE["along"], DIPOLE["up"], NORMAL))
        return matrix(tau) @ x + inputs(tau) @ np.array([*torque, 0.0, 0.0, 0.0])

    return lambda start, length: solve_ivp(
        rates, (start, start + length), np.zeros(order), method="BDF", rtol=1e-7, atol=1e-10,
        max_step=0.02,
    ).y[:3]  # fmt: skip


def test_the_dipole_turns_stage_1_as_an_integration_says():
    loop = STAGE_1.with_parameters(
        **CRAFT.satellite()._asdict(), damping=DAMPING, frequency=FREQUENCY, angle_gain=4.0,
        rate_gain=4.0, normal=NORMAL,
    )  # fmt: skip
    integrate = driven(loop.matrix, lambda tau: stage_1_driven_by(loop, tau), 12)
    turns = 3  # of a degree of 0.6: the start is forgotten to 1e-5
    late = integrate(0.0, 2.0 * math.pi * turns)[:, -400:]
    assert turned_in_stage_1(loop, OWN, NORMAL) == pytest.approx(
        np.linalg.norm(late, axis=0).max(), rel=0.02
    )
    assert turned_in_stage_1(loop, 2.0 * OWN, NORMAL) == pytest.approx(
        2.0 * turned_in_stage_1(loop, OWN, NORMAL)
    )
    assert turned_in_stage_1(loop, 0.0 * OWN, NORMAL) == 0.0


def test_the_dipole_turns_stage_2_until_it_is_found():
    gains = stage_2_gains(CRAFT.gyrostat, Stage2Weights(27.7, 182.0, 109.0, 45.5))
    loop = stage_2_loop(CRAFT.satellite(), CRAFT.gyrostat, gains, normal=NORMAL)
    integrate = driven(loop.matrix, lambda tau: driven_by(loop, tau), 15)
    greatest = max(
        np.linalg.norm(integrate(start, 2.0 * math.pi), axis=0).max()
        for start in np.arange(8) * math.pi / 4.0
    )
    found = turned_in_stage_2(follow_revolution(loop), OWN, NORMAL)
    assert found == pytest.approx(greatest, rel=0.02)


def test_stage_1_is_not_held_upside_down():
    """Without the condition the greatest degree is that of a K which the gravity gradient beats."""
    gravity = 3.0 * (0.0429 - 0.0068) / LONG.inertia
    found = design_stage_1(LONG, 0.16362)
    assert found.holds and found.upside_down < 0.0 < found.degree
    assert found.angle_gain > gravity > 6.0
    free = GyroCraft((0.0429, 0.0429, 0.0425), 1.5e-4, 1.1068e-3)
    assert design_stage_1(free, 0.16362).upside_down < 0.0


@pytest.mark.parametrize("dipole", [5.0, 8.0])
def test_a_dipole_asks_for_greater_gains(dipole):
    own = (dipole, dipole, dipole)
    usual, found = design_stage_1(LONG, 0.16362), design_stage_1(LONG, 0.16362, (0.0,), own)
    assert found.angle_gain * found.rate_gain > usual.angle_gain * usual.rate_gain
    assert found.holds and TURNED_1.holds(math.degrees(found.turned_rad))
    bounded = design_stage_1(LONG, 0.16362, (0.0,), own, most_angle_gain=8.0)
    assert bounded.angle_gain == usual.angle_gain and not TURNED_1.holds(
        math.degrees(bounded.turned_rad)
    )


@needs_jit
def test_what_the_design_says_of_the_dipole():
    made = magneto_gyro(long_cubesat(), MagnetoGyroRequest(tip_off_deg_s=5.0, fly=0))
    (doubt,) = made.verdict.doubts
    allowed = 0.005 * math.sqrt(3.0) * TURNED_2.most / doubt.value
    assert doubt.limit == TURNED_2 and doubt.value == pytest.approx(66.0, abs=1.0)
    assert (
        f"(before the dipole is found, stage 1 begins again); of the satellite's 0.00866 A m^2 "
        f"(spacecraft.coils.residual_dipole_a_m2) at most {allowed:.3g} may be left" in doubt.text
    )
    data = made.data()
    assert data["verdict"]["state"] == "doubtful"
    assert data["dipole_turns_rad"] == pytest.approx(math.radians(doubt.value))
    text = "\n".join(made.lines())
    assert f"doubtful: {doubt.text}" in text
    assert "turned by the satellite's own dipole: stage 1 by 11 deg, stage 2 by 66 deg" in text
    remedied = long_cubesat(dipole_a_m2=0.99 * allowed / math.sqrt(3.0))
    after = magneto_gyro(remedied, MagnetoGyroRequest(tip_off_deg_s=5.0, fly=0))
    assert after.verdict.state == "valid" and "valid" in after.lines()


@needs_jit
@pytest.mark.slow
@pytest.mark.parametrize(
    ("wheel_n_m_s", "dipole_a_m2", "state"),
    [(1.5e-4, 0.0005, "valid"), (1e-3, 0.0005, "valid"), (1.5e-4, 0.005, "doubtful")],
)
def test_flights_agree_with_the_verdict(wheel_n_m_s, dipole_a_m2, state):
    case = long_cubesat(wheel_n_m_s, dipole_a_m2)
    made = magneto_gyro(case, MagnetoGyroRequest(tip_off_deg_s=5.0, fly=8))
    never = np.isinf(made.flights.settled_s(5.0)).sum()
    assert made.verdict.state == state
    assert (never == 0) == (state == "valid")
    said = any("releases do not stay below 5 deg" in line for line in made.verdict.lines())
    assert said == (never > 0) == (made.failure is not None)
    if made.failure is not None:
        _check_failure(made)


def test_few_starts_of_long_flights_are_flown():
    """The answer comes in minutes: 16 starts of short flights, 4 of those of many days."""
    short = long_cubesat(1.5e-4, 0.005)
    assert steps_of(short) < 1e5 and failure._starts(short) == RUNS
    long = short.replace("simulation.revolutions", 500.0)
    assert steps_of(long) > 2e6 and failure._starts(long) == 4


def _check_failure(made):
    """The dipole limits; a value found for it is verified by other starts."""
    why = made.failure
    assert why.limiting == "residual dipole" and why.without["residual dipole"].is_enough
    (found,) = (each for each in why.found if each.lever == "residual dipole")
    assert 0.0 < found.value < 0.005 * math.sqrt(3.0)
    assert found.runs == 16 and found.verified >= 15
    assert any(line.startswith("works: residual dipole") for line in made.lines())
    assert made.data()["failure"]["limiting"] == "residual dipole"


@needs_jit
def test_a_failure_names_the_dipole_and_what_may_be_left(monkeypatch):
    """With flights that point up to a dipole of 2 mA m^2, or with another law."""
    made = magneto_gyro(long_cubesat(), MagnetoGyroRequest(evaluations=10, fly=0))

    def fly(scenario, campaign, count):
        own = np.linalg.norm(scenario.spacecraft.coils.residual_dipole_a_m2)
        law = scenario.control.laws["magneto_gyro"]
        error = 1.0 if own < 2e-3 or law.filter_damping == 0.5 else 90.0
        return PointingFlights(60.0 * np.arange(500.0), np.full((count, 500), error))

    monkeypatch.setattr(failure, "fly_releases", fly)
    found = failure.explain_pointing(made, {"other gains": made.law | {"filter_damping": 0.5}})
    assert found.limiting == "residual dipole" and found.flown.arrived == 0
    assert found.share("residual dipole") == pytest.approx(89.0 / 90.0)
    values = {each.lever: each for each in found.found}
    assert 1.6e-3 < values["residual dipole"].value < 2e-3
    assert values["residual dipole"].verified == 16
    assert values["limit of the coils"].value is None
    assert found.works()[0] == "other gains: 16 of 16, median 1 deg"
    assert set(values) == {"residual dipole", "limit of the coils"}


@pytest.mark.parametrize(("never", "told"), [(0, False), (1, False), (2, True), (10, True)])
def test_a_tenth_of_the_releases_may_not_point(never, told):
    error_deg = np.ones((10, 5))
    error_deg[:never] = 90.0
    flights = PointingFlights(60.0 * np.arange(5.0), error_deg)
    assert failure.fails(flights) == told and not failure.fails(None)


def test_an_angle_beyond_linear_theory_has_no_number():
    assert _angle_text(math.radians(54.3)) == "54"
    assert _angle_text(math.radians(90.5)) == "more than 90"
    case = SimpleNamespace(coils=SimpleNamespace(residual_dipole_a_m2=[1e-3] * 3))
    told = [_with_remedy(case, Doubt(TURNED_1, angle)).text for angle in (54.3, 3680.0)]
    for text, angle in zip(told, ("= 54.3", "more than 90"), strict=True):
        assert text.startswith(f"angle by the own dipole in stage 1 [deg] {angle}: must be at most")
    assert "at most 7.06e-06 may be left" in told[1]
