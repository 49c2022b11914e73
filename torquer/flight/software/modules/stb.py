"""STB, stabilisation: which of its modes works, and with which actuators.

After SDOT 3.3, Table 3.5. Which laws work is decided by the mode table's regions.
"""

from __future__ import annotations

from pydantic import Field

from torquer.base.spec import Spec
from torquer.flight.packets.reasons import Reason
from torquer.flight.software.modules.aos import number_modes
from torquer.flight.software.modules.module import Module


class StbSettings(Spec):
    """Settings of stabilisation."""

    region: str = "stabilisation"
    """Region of the mode table that chooses the laws."""
    modes: dict[str, str] = Field(
        default={
            "safe": "SAFE",
            "safe_spin_up": "SAFE",
            "safe_reversed": "SAFE",
            "detumbling": "DETUMB",
            "acquisition": "3X",
            "science": "SCIENCE",
            "point2dir": "POINT2DIR",
            "one_axis": "1X",
        }
    )
    """Mode in telemetry by the state of that region."""
    actuators: str = "actuators"
    """Region whose state, stb_00 to stb_tw, shows which actuators are in use, if there is one."""
    spin_guard: str = "spin"
    """Region made with the preset 'spin_guard', if there is one: while it is in 'coils_off', the
    coils are off, since the satellite has been spun up."""
    idle_after_s: float = Field(default=30.0, gt=0.0)
    """Without that region: time without a command after which an actuator is not in use."""


class Stb(Module):
    """Follows the mode of stabilisation and the actuators in use."""

    name = "stb"
    Settings = StbSettings

    def __init__(self, settings: StbSettings):
        super().__init__(settings)
        self.mode = self.works = self.actuators = self.spun_up = 0
        self.dipole_s = self.torque_s = -1e9
        self._numbers: dict[str, int] = {}
        self._actuators: dict[str, int] = {}

    def start(self, core) -> None:
        """Number the modes as telemetry does."""
        self._numbers = number_modes(core.dictionary, "stb_mode", self.settings.modes)
        labels = core.dictionary.labels.get("actuators", ())
        self._actuators = {label.lower(): number for number, label in enumerate(labels)}

    def step(self, core) -> None:
        """Note mode, actuators and a spin-up; a change of actuators and a spin-up are events."""
        dipole, torque = core.commanded
        if dipole[0] or dipole[1] or dipole[2]:
            self.dipole_s = core.t_s
        if torque[0] or torque[1] or torque[2]:
            self.torque_s = core.t_s
        now = core.modes
        self.mode = self._numbers.get(now.get(self.settings.region, ""), 0)
        spun_up = int(now.get(self.settings.spin_guard) == "coils_off")
        if spun_up > self.spun_up:
            core.report("stb", Reason.SPUN_UP)
        self.spun_up = spun_up
        since = core.t_s - self.settings.idle_after_s
        coils, wheels = self.dipole_s > since, self.torque_s > since
        self.works = int(coils or wheels)
        state = now.get(self.settings.actuators)
        if state is None:
            self.actuators = coils + 2 * wheels
            return
        actuators = self._actuators.get(state, 0)
        if actuators != self.actuators:
            core.report("stb", Reason.ACTUATORS_CHANGED, actuators)
        self.actuators = actuators

    def status(self) -> dict[str, float]:
        """Mode, whether an actuator works, actuators in use, whether a spin-up keeps coils off."""
        return {
            "mode": self.mode,
            "works": self.works,
            "actuators": self.actuators,
            "spun_up": self.spun_up,
        }
