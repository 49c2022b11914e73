"""What a magneto-gyroscopic system is designed for: a scenario's satellite, orbit, tip-off rate."""

import math
from dataclasses import dataclass

import numpy as np

from torquer.base.conventions import EARTH_RADIUS_M, MU_EARTH_M3_S2
from torquer.base.limits import RequestError
from torquer.design.requests import MagnetoGyroRequest
from torquer.scenario.spec import Scenario
from torquer.spacecraft.actuators.coils import Coils
from torquer.theory.magneto_gyro.along_orbit import FieldAlong, field_along
from torquer.theory.magneto_gyro.capture import filter_rate_for
from torquer.theory.magneto_gyro.craft import BRAKED, GyroCraft, greatest_tip_off
from torquer.theory.magneto_gyro.own_dipole import TURNED_1
from torquer.theory.magneto_gyro.satellite import make_craft, own_dipole

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
    def own_dipole(self) -> np.ndarray:
        """The satellite's own dipole in orbital axes, in units of J nu0^2/A `[3]`."""
        return own_dipole(self.scenario, self.craft, self.along.strength_t)

    @property
    def most_angle_gain(self) -> float:
        """K/(J nu0^2) with which the coils still follow where stage 2 may begin."""
        unit_a_m2 = self.craft.torque_unit / self.along.strength_t
        most = float(self.coils.limits_a_m2().min()) / unit_a_m2
        return most / math.sin(math.radians(TURNED_1.most))

    @property
    def coils(self) -> Coils:
        """The coils, which a case has."""
        coils = self.scenario.spacecraft.coils
        assert coils is not None
        return coils


def make_case(scenario: Scenario, request: MagnetoGyroRequest) -> GyroCase:
    """The case of a scenario; ValueError for a satellite on which the system cannot work."""
    craft, notes = make_craft(scenario)
    tip_off = _tip_off(scenario, request)
    inclination, varies = _describe_orbit(scenario)
    if varies > _CIRCULAR:
        notes = (*notes, f"the orbit's radius varies by {100.0 * varies:.2g} %: linear theory is "
                         "that of a circular orbit with the same period")  # fmt: skip
    altitude_m = np.cbrt(MU_EARTH_M3_S2 / craft.orbital_rate_rad_s**2) - EARTH_RADIUS_M
    along = field_along(scenario.orbit_environment(), scenario.believed_environment())
    return GyroCase(
        scenario, craft, along, inclination, 1e-3 * float(altitude_m), tip_off,
        _filter_rate(request, tip_off), notes,
    )  # fmt: skip


def _tip_off(scenario: Scenario, request: MagnetoGyroRequest) -> float:
    """Tip-off rate [deg/s]: as asked for, else the usual one or that of the scenario."""
    if request.tip_off_deg_s is not None:
        return request.tip_off_deg_s
    own = float(np.linalg.norm(scenario.initial.rate_deg_s))
    if own > _GREATEST:
        raise RequestError(
            "initial.rate_deg_s",
            f"must be at most {_GREATEST:g} deg/s, or tip_off_deg_s must be given; received "
            f"{own:.4g} deg/s",
            "tip_off_deg_s",
        )
    return max(_USUAL, own)


def _filter_rate(request: MagnetoGyroRequest, tip_off_deg_s: float) -> float:
    tip_off = math.radians(tip_off_deg_s)
    found = request.filter_rate_rad_s or filter_rate_for(tip_off)
    if tip_off > greatest_tip_off(found):
        raise RequestError(
            "filter_rate_rad_s",
            f"must be at least {tip_off / BRAKED:.4g} to brake {tip_off_deg_s:g} deg/s "
            f"(tip_off_deg_s); received {found:g}",
            "tip_off_deg_s",
        )
    return found


def _describe_orbit(scenario: Scenario) -> tuple[float, float]:
    """Inclination [deg]; by which part the radius of the first revolution varies."""
    times = np.linspace(0.0, scenario.orbit.period_s, 100)
    r, v = scenario.orbit_environment().state(times)
    normal, radius = np.cross(r[0], v[0]), np.linalg.norm(r, axis=1)
    inclination = math.degrees(math.acos(normal[2] / np.linalg.norm(normal)))
    return inclination, float((radius.max() - radius.min()) / radius.mean())
