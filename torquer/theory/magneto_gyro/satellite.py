"""The satellite of the magneto-gyroscopic system, from a scenario."""

import math

import numpy as np

from torquer.computer.laws.pointing import HeldAttitude
from torquer.maths.geometry.attitudes import dcm_body_to_reference
from torquer.scenario.resolution import momentum_at_start
from torquer.scenario.spec import Scenario
from torquer.theory.magneto_gyro.craft import GyroCraft


def noise_intensity(scenario: Scenario, craft: GyroCraft, strength_t: float) -> float:
    """Intensity per 1/nu0 of the noise of readings, of the field's strength, a step at a time."""
    control, noise_nt = scenario.control, scenario.spacecraft.one_of("magnetometer").noise_nt
    interval_s = control.cycle_s / control.steps_in_cycle
    return (1e-9 * noise_nt / strength_t) ** 2 * craft.orbital_rate_rad_s * interval_s


def make_craft(scenario: Scenario) -> tuple[GyroCraft, tuple[str, ...]]:
    """The satellite in the axes of the attitude that is held, and what is left out.

    ValueError for a satellite on which the system cannot work.
    """
    craft, notes = scenario.spacecraft, []
    if craft.coils is None:
        raise ValueError("spacecraft.coils: must be given for magnetic control; received none")
    held, turn = held_attitude(scenario), _turn(scenario)
    inertia = turn @ np.array(craft.body.inertia) @ turn.T
    wheel = turn @ momentum_at_start(craft, np.zeros(3))
    if np.abs(inertia - np.diag(np.diag(inertia))).max() > 1e-9 * inertia.max():
        notes.append("products of inertia are left out of the design")
    if np.hypot(wheel[0], wheel[2]) > 1e-3 * abs(wheel[1]):
        notes.append("the wheel's momentum across the pitch axis is left out of the design")
    if held is None:
        notes.append("no law of the scenario holds an attitude in orbit: the body's axes are to be "
                     "those of the orbital frame")  # fmt: skip
    if craft.wheels is not None:
        notes.append("the wheels of spacecraft.wheels are taken to keep their initial momentum")
    x, y, z = np.diag(inertia).tolist()
    made = GyroCraft((x, y, z), float(wheel[1]), 2.0 * math.pi / scenario.orbit.period_s)
    if made.stiffness <= 0.0:
        raise ValueError(
            "spacecraft.body.wheel_momentum_n_m_s: must be above "
            f"{made.wheel_at(0.0):.4g} N m s along the orbit normal, (2 - lambda) J nu0; received "
            f"{made.wheel_n_m_s:g}"
        )
    return made, tuple(notes)


def own_dipole(scenario: Scenario, craft: GyroCraft, strength_t: float) -> np.ndarray:
    """The satellite's own dipole in the axes of the attitude that is held, in J nu0^2/A `[3]`."""
    coils = scenario.spacecraft.coils
    own = np.zeros(3) if coils is None else np.array(coils.residual_dipole_a_m2)
    return _turn(scenario) @ own * (strength_t / craft.torque_unit)


def _turn(scenario: Scenario) -> np.ndarray:
    """From body axes to those of the attitude that is held."""
    held = held_attitude(scenario)
    return dcm_body_to_reference(np.array(held.q_wanted() if held else (0, 0, 0, 1.0)))


def held_attitude(scenario: Scenario) -> HeldAttitude | None:
    """The attitude that a law of the scenario holds, relative to the orbital frame."""
    laws = scenario.control.named().laws.values()
    held = [x for x in laws if isinstance(x, HeldAttitude) and x.reference == "orbital"]
    return held[0] if held else None
