"""No control: the satellite moves freely under the environment's torques."""

from typing import Literal

from torquer.base.spec import Spec
from torquer.compile.engine import kernel
from torquer.computer.blocks.law import Law


@kernel
def zero_command(inputs, parameters, memory):
    """No dipole of the coils, no torque of the wheels."""
    return (0.0, 0.0, 0.0)


class Off(Spec):
    """No control."""

    kind: Literal["off"] = "off"

    def law(self) -> Law:
        """The law that asks for nothing."""
        return Law(self.kind, zero_command, spec=self)
