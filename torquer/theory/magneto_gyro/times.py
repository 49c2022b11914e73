"""How long it takes from tip-off to pointing: a mean over releases, by parts.

1. Braking. Stage 1 commands -N V/B^2 across the field, as B-dot with a gain N/B^2 does; the coils
   saturate (`theory.detumbling`). Its filters make the dipole late by
   atan(2 d w_f w/(w_f^2 - w^2)) at the rate w: the cosine of that is left, nothing at w = w_f.
2. Turning the wheel. Its momentum H is turned to the orbit normal, by 90 deg on average, under the
   mean torque at the rate at which N w is the command K pi/2 of that angle; or, if that takes
   longer, stage 1 decays with its degree to the angle at which stage 2 may begin.
3. The switch, late by the time constant of its means; stage 1 decays with its degree meanwhile.
4. Stage 2, from what is then left of the angle at which it may begin, with its degree.
"""

import math
from typing import NamedTuple

import numpy as np

from torquer.theory.magneto_gyro.capture import DAMPING, Stage1Design
from torquer.theory.magneto_gyro.craft import GyroCraft
from torquer.theory.slow.detumbling import Tumbling, braking_torque_n_m

#: Orbital rates at which braking is counted as done, and rates of the integral.
_BRAKED, _RATES = 3.0, 60


class Hysteresis(NamedTuple):
    """Angle [rad] at which stage 2 may begin, time constant of the means [s]."""

    angle_rad: float
    mean_time_s: float


class TimeToPoint(NamedTuple):
    """Parts of the mean time to point [s], the angle left at the switch [rad], what it decays with
    [1/s]."""

    braking_s: float
    turning_s: float
    switch_s: float
    left_rad: float
    decay_per_s: float

    @property
    def stage_2_s(self) -> float:
        """When stage 2 begins [s]."""
        return self.braking_s + self.turning_s + self.switch_s

    def below(self, angle_rad: float) -> float:
        """When the error stays below an angle [s]."""
        decay = math.log(max(1.0, self.left_rad / angle_rad)) / self.decay_per_s
        return self.stage_2_s + decay


def time_to_point(
    craft: GyroCraft,
    tumbling: Tumbling,
    first: Stage1Design,
    degree: float,
    tip_off_rad_s: float,
    hysteresis: Hysteresis,
) -> TimeToPoint:
    """Mean time to point, from a tip-off rate; `degree` of stage 2 per 1/nu0.

    For the satellite of `examples/magneto_gyro.toml`, with coils of 100 to 1000 A m^2, tip-off
    rates of 1 to 6 deg/s, inclinations of 45 and 98.8 deg (six cases, 12 flights of each), it is
    0.84 to 0.97 of the mean time flown to 5 deg, 0.98 to 1.07 of that to 1 deg.
    """
    rate, angle_rad = craft.orbital_rate_rad_s, 0.5 * math.pi
    gain = first.rate_gain * craft.momentum_unit / float(np.mean(tumbling.fields_t**2))
    tumbling = tumbling._replace(sampling=tumbling.sampling._replace(difference_s=0.0))
    braking = _braking_s(tumbling, gain, tip_off_rad_s, _BRAKED * rate, first.filter_rate_rad_s)
    equal = first.angle_gain / first.rate_gain * angle_rad * rate
    torque = float(braking_torque_n_m(tumbling, gain, [equal])[0])
    decaying = math.log(angle_rad / hysteresis.angle_rad) / (first.degree * rate)
    turning = craft.wheel_n_m_s * angle_rad / torque if torque > 0.0 else math.inf
    turning = max(turning, decaying)
    left = hysteresis.angle_rad * math.exp(-first.degree * rate * hysteresis.mean_time_s)
    return TimeToPoint(braking, turning, hysteresis.mean_time_s, left, degree * rate)


def phase_left(rate_rad_s, filter_rate_rad_s: float):
    """Cosine of the lag of stage 1's filters at a rate: the part of a dipole that brakes."""
    part = np.asarray(rate_rad_s) / filter_rate_rad_s
    return np.cos(np.arctan2(2.0 * DAMPING * part, 1.0 - part**2))


def _braking_s(tumbling, gain, from_rad_s, below_rad_s, filter_rate_rad_s) -> float:
    if from_rad_s <= below_rad_s:
        return 0.0
    w = np.geomspace(below_rad_s, from_rad_s, _RATES)
    torque = braking_torque_n_m(tumbling, gain, w) * phase_left(w, filter_rate_rad_s)
    if not (torque > 0.0).all():
        return math.inf
    return float(tumbling.inertia_kg_m2 * np.trapezoid(w / torque, np.log(w)))
