"""Control laws, one file each; adding one is one file and its line in `built_in`.

A law answers with a command: a dipole for the coils, a torque on the body for the wheels, or both.
"""

from typing import Annotated, Union

from pydantic import Field

from torquer.control.bdot import Bdot as Bdot
from torquer.control.built_in import BUILT_IN
from torquer.control.scheme import Scheme
from torquer.control.user import GivenLaw, UserLaw

#: Laws by the kind that a scenario names.
LAWS = {**BUILT_IN, "user": UserLaw}

#: A law in a scenario: one of `LAWS`; in a result also a law that was given in Python.
AnyLaw = Annotated[Union[(*LAWS.values(), GivenLaw)], Field(discriminator="kind")]
#: The only law of a scenario: any law, or a scheme.
OnlyLaw = Annotated[Union[(*LAWS.values(), GivenLaw, Scheme)], Field(discriminator="kind")]
