"""Laws that come with the package: each has its line here."""

from torquer.base.spec import by_kind
from torquer.computer.laws.bcross import Bcross
from torquer.computer.laws.bdot import Bdot, BdotDerivative, BdotModel, BdotRate
from torquer.computer.laws.bdot_normalised import BdotNormalised, BdotWeighted
from torquer.computer.laws.bias_momentum import BiasMomentum
from torquer.computer.laws.dipole_trim import DipoleTrim
from torquer.computer.laws.magneto_gyro.law import MagnetoGyro
from torquer.computer.laws.momentum_projection import MomentumProjection
from torquer.computer.laws.non_monotonic import NonMonotonic, NonMonotonicDerivative
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
from torquer.computer.laws.wheel_tracking import WheelTracking

BuiltIn = (
    Off
    | Bdot
    | BdotRate
    | BdotDerivative
    | BdotModel
    | BdotNormalised
    | BdotWeighted
    | Bcross
    | MomentumProjection
    | NonMonotonic
    | NonMonotonicDerivative
    | Sdot
    | SdotRate
    | SunCross
    | SpinToSun
    | PanelTracking
    | NutationDamping
    | NutationDampingRate
    | NutationDampingDerivative
    | SpinUp
    | Reorientation
    | Preliminary1
    | Preliminary2
    | ThreeAxis
    | PeriodicGains
    | ProjectedPd
    | SlidingMode
    | DipoleTrim
    | Unloading
    | WheelPd
    | WheelLyapunov
    | WheelOneAxis
    | WheelTracking
    | BiasMomentum
    | MagnetoGyro
)

#: Laws that come with the package, by kind.
BUILT_IN = by_kind(BuiltIn)
