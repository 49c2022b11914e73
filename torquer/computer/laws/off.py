"""No control: the satellite moves freely under the environment's torques."""

from typing import ClassVar, Literal

from torquer.compile.engine import kernel
from torquer.computer.laws.law_spec import LawSpec


@kernel
def zero_command(inputs, parameters, memory):
    """No dipole of the coils, no torque of the wheels."""
    return (0.0, 0.0, 0.0)


class Off(LawSpec):
    """No control."""

    kind: Literal["off"] = "off"
    kernel: ClassVar = zero_command
