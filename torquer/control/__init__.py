"""Control laws, one file each; adding one is one file and its lines in `built_in`.

`LAWS` answer with a dipole for the coils, `WHEEL_LAWS` with a torque on the body for the wheels.
"""

from typing import Annotated, Union

from pydantic import Field

from torquer.control.bdot import Bdot as Bdot
from torquer.control.built_in import BUILT_IN
from torquer.control.off import Off
from torquer.control.scheme import Scheme
from torquer.control.user import UserLaw
from torquer.control.wheel_lyapunov import WheelLyapunov
from torquer.control.wheel_pd import WheelPd

LAWS = {**BUILT_IN, "scheme": Scheme, "user": UserLaw}

AnyLaw = Annotated[Union[tuple(LAWS.values())], Field(discriminator="kind")]  # noqa: UP007

WHEEL_LAWS = {
    "off": Off,
    "wheel_pd": WheelPd,
    "wheel_lyapunov": WheelLyapunov,
    "user": UserLaw,
}

AnyWheelLaw = Annotated[Union[tuple(WHEEL_LAWS.values())], Field(discriminator="kind")]  # noqa: UP007
