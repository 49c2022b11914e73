"""Laws that come with the package: each has its line here."""

from torquer.control.bdot import Bdot, BdotDerivative, BdotModel, BdotRate
from torquer.control.bias_momentum import BiasMomentum
from torquer.control.magneto_gyro.law import MagnetoGyro
from torquer.control.nutation_damping import (
    NutationDamping,
    NutationDampingDerivative,
    NutationDampingRate,
)
from torquer.control.off import Off
from torquer.control.panel_tracking import PanelTracking
from torquer.control.periodic_gains import PeriodicGains
from torquer.control.preliminary_1 import Preliminary1
from torquer.control.preliminary_2 import Preliminary2
from torquer.control.projected_pd import ProjectedPd
from torquer.control.reorientation import Reorientation
from torquer.control.sdot import Sdot, SdotRate
from torquer.control.sliding_mode import SlidingMode
from torquer.control.spin_to_sun import SpinToSun
from torquer.control.spin_up import SpinUp
from torquer.control.sun_cross import SunCross
from torquer.control.three_axis import ThreeAxis
from torquer.control.unloading import Unloading
from torquer.control.wheel_lyapunov import WheelLyapunov
from torquer.control.wheel_one_axis import WheelOneAxis
from torquer.control.wheel_pd import WheelPd

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
