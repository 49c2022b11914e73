"""The satellite of the magneto-gyroscopic system and its limits: wheel, tip-off rate, bias."""

import math
from dataclasses import dataclass, replace

from torquer.computer.laws.magneto_gyro.stage_2 import Gyrostat
from torquer.theory.magneto_gyro.loop import Satellite
from torquer.theory.validity import Limit, within

_POSITIVE = {
    name: Limit(name, 0.0, open=True)
    for name in ("inertia_kg_m2", "orbital_rate_rad_s", "mean_square_t2", "filter_rate_rad_s")
}
#: Part of the filter's natural frequency up to which stage 1 brakes: beyond it the derivative has
#: the wrong sign, and the satellite is spun up.
BRAKED = 0.8


@dataclass(frozen=True)
class GyroCraft:
    """Moments of inertia about roll, pitch, yaw; momentum of the wheel along the orbit normal."""

    inertia_kg_m2: tuple[float, float, float]
    wheel_n_m_s: float
    orbital_rate_rad_s: float

    def __post_init__(self):
        within(_POSITIVE["inertia_kg_m2"], self.inertia_kg_m2)
        within(_POSITIVE["orbital_rate_rad_s"], self.orbital_rate_rad_s)

    @property
    def inertia(self) -> float:
        """J [kg m^2]: root of the product of the moments about roll and yaw."""
        return math.sqrt(self.inertia_kg_m2[0] * self.inertia_kg_m2[2])

    @property
    def pitch_inertia(self) -> float:
        """lambda: moment about the pitch axis over J."""
        return self.inertia_kg_m2[1] / self.inertia

    @property
    def momentum_unit(self) -> float:
        """J nu0 [N m s]."""
        return self.inertia * self.orbital_rate_rad_s

    @property
    def torque_unit(self) -> float:
        """J nu0^2 [N m]."""
        return self.momentum_unit * self.orbital_rate_rad_s

    @property
    def stiffness(self) -> float:
        """h = [H + nu0 J (lambda - 2)]/(J nu0): roll and yaw are stiff with h + 1."""
        return self.wheel_n_m_s / self.momentum_unit + self.pitch_inertia - 2.0

    @property
    def gyrostat(self) -> Gyrostat:
        """What the estimator knows of it."""
        return Gyrostat(self.stiffness, self.pitch_inertia)

    def satellite(self, gravity: bool = True) -> Satellite:
        """The satellite of the periodic models, with or without gravity gradient."""
        x, y, z = (i / self.inertia for i in self.inertia_kg_m2)
        return Satellite(x, y, z, self.wheel_n_m_s / self.momentum_unit, float(gravity))

    def wheel_at(self, stiffness: float) -> float:
        """Momentum of the wheel [N m s] that gives a stiffness h.

        Stage 1 needs h > 0; in the exact model parts of 0 < h < 1.5 are unstable, too. At h = 2,
        for a field without a part along the pitch axis, roll and yaw part in the turning axes: the
        coils do not control one, and the field does not show it.
        """
        return (stiffness + 2.0 - self.pitch_inertia) * self.momentum_unit

    def with_wheel(self, wheel_n_m_s: float) -> "GyroCraft":
        """This satellite with another wheel."""
        return replace(self, wheel_n_m_s=float(wheel_n_m_s))

    def bias_dipole(self, bias_t: float, mean_square_t2: float) -> float:
        """Dipole [A m^2] along pitch that a magnetometer's bias along pitch is taken for.

        2 h J nu0^2 d <1/B_ts^2>: a smaller dipole cannot be distinguished from the bias. For
        the field of a dipole the mean of 1/B_ts^2 in the orbit's plane is 5/4 over the mean
        square. Against the exact model, h from 3.5 to 12 and five sets of weights: 0.87 to 1.01
        of it.
        """
        within(_POSITIVE["mean_square_t2"], mean_square_t2)
        inverse = 1.25 / mean_square_t2
        return 2.0 * self.stiffness * self.torque_unit * bias_t * inverse


def greatest_tip_off(filter_rate_rad_s: float) -> float:
    """Greatest rate of the satellite [rad/s] that stage 1 brakes with a filter."""
    within(_POSITIVE["filter_rate_rad_s"], filter_rate_rad_s)
    return BRAKED * filter_rate_rad_s
