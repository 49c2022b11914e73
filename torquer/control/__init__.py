"""Control laws, one file each; adding one is one file and one line here."""

from typing import Annotated, Union

from pydantic import Field

from torquer.control.bdot import Bdot, BdotDerivative, BdotRate
from torquer.control.off import Off
from torquer.control.user import UserLaw

LAWS = {
    "off": Off,
    "bdot": Bdot,
    "bdot_rate": BdotRate,
    "bdot_derivative": BdotDerivative,
    "user": UserLaw,
}

AnyLaw = Annotated[Union[tuple(LAWS.values())], Field(discriminator="kind")]  # noqa: UP007
