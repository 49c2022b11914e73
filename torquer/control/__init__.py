"""Control laws, one file each; adding one is one file and its lines in `built_in`.

`LAWS` answer with a dipole for the coils, `WHEEL_LAWS` with a torque on the body for the wheels.
"""

from typing import Annotated, Union

from pydantic import Field

from torquer.control.bdot import Bdot as Bdot
from torquer.control.built_in import BUILT_IN
from torquer.control.off import Off
from torquer.control.scheme import Scheme
from torquer.control.user import GivenLaw, UserLaw
from torquer.control.wheel_lyapunov import WheelLyapunov
from torquer.control.wheel_pd import WheelPd

LAWS = {**BUILT_IN, "scheme": Scheme, "user": UserLaw}

#: What a scenario may hold; a user writes one of `LAWS`, a result may also tell of a given law.
AnyLaw = Annotated[Union[(*LAWS.values(), GivenLaw)], Field(discriminator="kind")]

WHEEL_LAWS = {
    "off": Off,
    "wheel_pd": WheelPd,
    "wheel_lyapunov": WheelLyapunov,
    "user": UserLaw,
}

AnyWheelLaw = Annotated[
    Union[(*WHEEL_LAWS.values(), GivenLaw)],
    Field(discriminator="kind"),
]
