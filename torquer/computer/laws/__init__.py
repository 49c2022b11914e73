"""Control laws, one file each; adding one is one file and its line in `built_in`.

A law answers with a command: a dipole for the coils, a torque on the body for the wheels, or both.

    >>> torquer.LAWS["bdot"](gain_a_m2_s_per_t=2e4).gain_a_m2_s_per_t
    20000.0
"""

from typing import Annotated, Any

from pydantic import Field

from torquer.computer.blocks.user import GivenLaw, UserLaw
from torquer.computer.laws.bdot import Bdot as Bdot
from torquer.computer.laws.built_in import BUILT_IN, BuiltIn
from torquer.computer.scheme import Scheme

#: Laws by the kind that a scenario names.
LAWS: dict[str, type[Any]] = {**BUILT_IN, "user": UserLaw}

#: A law in a scenario: one of `LAWS`; in a result also a law that was given in Python.
AnyLaw = Annotated[BuiltIn | UserLaw | GivenLaw, Field(discriminator="kind")]
#: The only law of a scenario: any law, or a scheme.
OnlyLaw = Annotated[BuiltIn | UserLaw | GivenLaw | Scheme, Field(discriminator="kind")]
