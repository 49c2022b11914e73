"""Laws that come with the package: each has its line here."""

from torquer.computer.laws.bdot import Bdot, BdotDerivative, BdotModel, BdotRate
from torquer.computer.laws.bias_momentum import BiasMomentum
from torquer.computer.laws.magneto_gyro.law import MagnetoGyro
from torquer.computer.laws.nutation_damping import (
    NutationDamping,
    NutationDampingDerivative,
    NutationDampingRate,
)
from torquer.computer.laws.off import Off
from torquer.computer.laws.panel_tracking import PanelTracking
from torquer.computer.laws.periodic_gains import PeriodicGains
from torquer.computer.laws.preliminary_1 import Preliminary1
from torquer.computer.laws.preliminary_2 import Preliminary2
from torquer.computer.laws.projected_pd import ProjectedPd
from torquer.computer.laws.reorientation import Reorientation
from torquer.computer.laws.sdot import Sdot, SdotRate
from torquer.computer.laws.sliding_mode import SlidingMode
from torquer.computer.laws.spin_to_sun import SpinToSun
from torquer.computer.laws.spin_up import SpinUp
from torquer.computer.laws.sun_cross import SunCross
from torquer.computer.laws.three_axis import ThreeAxis
from torquer.computer.laws.unloading import Unloading
from torquer.computer.laws.wheel_lyapunov import WheelLyapunov
from torquer.computer.laws.wheel_one_axis import WheelOneAxis
from torquer.computer.laws.wheel_pd import WheelPd

BUILT_IN = {
    "off": Off,
    "bdot": Bdot,
    "bdot_rate": BdotRate,
    "bdot_derivative": BdotDerivative,
    "bdot_model": BdotModel,
    "sdot": Sdot,
    "sdot_rate": SdotRate,
    "sun_cross": SunCross,
    "spin_to_sun": SpinToSun,
    "panel_tracking": PanelTracking,
    "nutation_damping": NutationDamping,
    "nutation_damping_rate": NutationDampingRate,
    "nutation_damping_derivative": NutationDampingDerivative,
    "spin_up": SpinUp,
    "reorientation": Reorientation,
    "preliminary_1": Preliminary1,
    "preliminary_2": Preliminary2,
    "three_axis": ThreeAxis,
    "periodic_gains": PeriodicGains,
    "projected_pd": ProjectedPd,
    "sliding_mode": SlidingMode,
    "unloading": Unloading,
    "wheel_pd": WheelPd,
    "wheel_lyapunov": WheelLyapunov,
    "wheel_one_axis": WheelOneAxis,
    "bias_momentum": BiasMomentum,
    "magneto_gyro": MagnetoGyro,
}
