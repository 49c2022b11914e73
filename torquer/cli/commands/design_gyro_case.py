"""The case of `torquer design magneto-gyro`: satellite and orbit of a scenario, what is refused."""

import math
from dataclasses import dataclass

import numpy as np

from torquer.base.conventions import EARTH_RADIUS_M, MU_EARTH_M3_S2
from torquer.cli.commands.design import GyroOptions
from torquer.computer.laws.pointing import HeldAttitude
from torquer.maths.geometry.attitudes import dcm_body_to_reference
from torquer.scenario.resolution import momentum_at_start
from torquer.scenario.spec import Scenario
from torquer.spacecraft.actuators.coils import Coils
from torquer.theory.magneto_gyro.along_orbit import FieldAlong, field_along
from torquer.theory.magneto_gyro.capture import filter_rate_for
from torquer.theory.magneto_gyro.craft import BRAKED, GyroCraft, greatest_tip_off

#: Least tip-off rate designed for, unless another is given, and the greatest [deg/s].
_USUAL, _GREATEST = 3.0, 30.0
#: Variation of the orbit's radius beyond which a circular orbit is worth a note.
_CIRCULAR = 0.01


@dataclass(frozen=True)
class GyroCase:
    """What is designed for; the orbit as a circular one of the same period; notes."""

    scenario: Scenario
    craft: GyroCraft
    along: FieldAlong
    inclination_deg: float
    altitude_km: float
    tip_off_deg_s: float
    filter_rate_rad_s: float
    notes: tuple[str, ...]

    @property
    def coils(self) -> Coils:
        """The coils, which a case has."""
        coils = self.scenario.spacecraft.coils
        assert coils is not None
        return coils


def case_of(scenario: Scenario, how: GyroOptions) -> GyroCase:
    """The case of a scenario; ValueError for a satellite on which the system cannot work."""
    craft, notes = craft_of(scenario)
    tip_off = _tip_off(scenario, how)
    inclination, varies = _orbit_of(scenario)
    if varies > _CIRCULAR:
        notes = (*notes, f"the orbit's radius varies by {100.0 * varies:.2g} %: linear theory is "
                         "that of a circular orbit with the same period")  # fmt: skip
    altitude_m = np.cbrt(MU_EARTH_M3_S2 / craft.orbital_rate_rad_s**2) - EARTH_RADIUS_M
    along = field_along(scenario.orbit_environment(), scenario.believed_environment())
    return GyroCase(
        scenario, craft, along, inclination, 1e-3 * float(altitude_m), tip_off,
        _filter_rate(how, tip_off), notes,
    )  # fmt: skip


def noise_intensity(scenario: Scenario, craft: GyroCraft, strength_t: float) -> float:
    """Intensity per 1/nu0 of the noise of readings, of the field's strength, a step at a time."""
    control, noise_nt = scenario.control, scenario.spacecraft.magnetometer.noise_nt
    interval_s = control.cycle_s / control.steps_in_cycle
    return (1e-9 * noise_nt / strength_t) ** 2 * craft.orbital_rate_rad_s * interval_s


def craft_of(scenario: Scenario) -> tuple[GyroCraft, tuple[str, ...]]:
    """The satellite in the axes of the attitude that is held, and what is left out.

    ValueError for a satellite on which the system cannot work.
    """
    craft, notes = scenario.spacecraft, []
    if craft.coils is None:
        raise ValueError("spacecraft.coils: must be given for magnetic control; received none")
    held = held_attitude(scenario)
    turn = dcm_body_to_reference(np.array(held.q_wanted() if held else (0, 0, 0, 1.0)))
    inertia = turn @ np.array(craft.body.inertia_kg_m2) @ turn.T
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


def held_attitude(scenario: Scenario) -> HeldAttitude | None:
    """The attitude that a law of the scenario holds, relative to the orbital frame."""
    laws = scenario.control.named().laws.values()
    held = [x for x in laws if isinstance(x, HeldAttitude) and x.reference == "orbital"]
    return held[0] if held else None


def _tip_off(scenario: Scenario, how: GyroOptions) -> float:
    """Tip-off rate [deg/s]: as asked for, else the usual one or that of the scenario."""
    if how.tip_off_deg_s is not None:
        return how.tip_off_deg_s
    own = float(np.linalg.norm(scenario.initial.rate_deg_s))
    if own > _GREATEST:
        raise ValueError(
            f"initial.rate_deg_s: must be at most {_GREATEST:g} deg/s, or --tip-off-deg-s must be "
            f"given; received {own:.4g} deg/s"
        )
    return max(_USUAL, own)


def _filter_rate(how: GyroOptions, tip_off_deg_s: float) -> float:
    tip_off = math.radians(tip_off_deg_s)
    found = how.filter_rate_rad_s or filter_rate_for(tip_off)
    if tip_off > greatest_tip_off(found):
        raise ValueError(
            f"--filter-rate-rad-s: must be at least {tip_off / BRAKED:.4g} to brake "
            f"{tip_off_deg_s:g} deg/s (--tip-off-deg-s); received {found:g}"
        )
    return found


def _orbit_of(scenario: Scenario) -> tuple[float, float]:
    """Inclination [deg]; by which part the radius of the first revolution varies."""
    times = np.linspace(0.0, scenario.orbit.period_s, 100)
    r, v = scenario.orbit_environment().state(times)
    normal, radius = np.cross(r[0], v[0]), np.linalg.norm(r, axis=1)
    inclination = math.degrees(math.acos(normal[2] / np.linalg.norm(normal)))
    return inclination, float((radius.max() - radius.min()) / radius.mean())
