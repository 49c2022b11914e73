"""A user's module: counts the energy that the coils use, and reports it once a minute."""

from torquer.base.spec import Spec
from torquer.flight.software import Module, Reason


class Settings(Spec):
    """What commands may change and the non-volatile memory keeps."""

    watts_per_a2_m4: float = 0.1
    """Power of the coils for one (A m^2)^2."""


class CoilEnergy(Module):
    name = "coil_energy"
    period_s = 1.0
    Settings = Settings

    def __init__(self, settings):
        super().__init__(settings)
        self.energy_j = 0.0
        self.steps = 0

    def step(self, core):
        dipole, _ = core.commanded
        power_w = self.settings.watts_per_a2_m4 * sum(m * m for m in dipole)
        self.energy_j += power_w * self.period_s
        self.steps += 1
        if self.steps % 60 == 0:
            core.send("coil_energy", (self.energy_j, power_w))

    def on_clear_energy(self, core, values):
        self.energy_j = 0.0
        return Reason.DONE
