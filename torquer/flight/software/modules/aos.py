"""AOS, attitude determination: the state vector that the other modules and the ground use.

After SDOT 3.3: attitude and rate relative to the orbital and the inertial frame, with a time
stamp. It may be undefined; after 10 s it is out of date. Which estimator works is decided by the
mode table's region of attitude determination.
"""

from __future__ import annotations

import math

from pydantic import Field

from torquer.base.spec import Spec
from torquer.computer.laws.pointing import to_orbital_frame
from torquer.flight.packets.reasons import Reason
from torquer.flight.software.modules.module import Module
from torquer.flight.software.modules.state_vector import StateVector

#: Numbers of a reading that is sent by command.
_NUMBERS = 3


class AosSettings(Spec):
    """Settings of attitude determination."""

    region: str = "determination"
    """Region of the mode table that chooses the estimator."""
    modes: dict[str, str] = Field(
        default={
            "aos_off": "OFF",
            "sdot": "SDOT",
            "bdot": "BDOT",
            "waiting": "BDOT",
            "triad": "TRIAD",
            "kalman_mag_dss": "KALMAN_MAG_DSS",
            "kalman_mag_dss_wrate": "KALMAN_MAG_DSS_WRATE",
            "kalman_mag_wrate": "KALMAN_MAG_WRATE",
            "kalman_dss_wrate": "KALMAN_DSS_WRATE",
        }
    )
    """Mode in telemetry by the state of that region."""


class Aos(Module):
    """Makes the state vector at each step."""

    name = "aos"
    Settings = AosSettings
    period_s = 0.1

    def __init__(self, settings: AosSettings):
        super().__init__(settings)
        self.mode = self.sunlit = self.works = 0
        self.was_valid = True
        self._numbers: dict[str, int] = {}

    def start(self, core) -> None:
        """Number the modes as telemetry does."""
        self._numbers = number_modes(core.dictionary, "aos_mode", self.settings.modes)

    def step(self, core) -> None:
        """Put the state vector into its queue; report to the ground when it is lost."""
        inputs = core.inputs
        e, place = inputs.estimate, inputs.ephemeris
        q_orbital, omega_orbital, rate, q_size = to_orbital_frame(
            e.q_body_to_inertial, e.omega_body_rad_s, place.r_inertial_m, place.v_inertial_m_s
        )
        sunlit = place.sunlit_fraction > 0.0 or any(inputs.sun_body)
        state = StateVector(
            e.t_s,
            q_orbital,
            e.q_body_to_inertial,
            omega_orbital,
            e.omega_body_rad_s,
            rate,
            q_size,
            e.sigma_rad,
            sunlit,
        )
        core.cdh.put("state", state)
        self.sunlit, self.works = int(sunlit), int(state.is_valid(inputs.t_s))
        self.mode = self._numbers.get(core.modes.get(self.settings.region, ""), 0)
        if self.was_valid and not self.works:
            known = math.isfinite(rate + q_size)
            core.report("aos", Reason.STALE_STATE if known else Reason.STATE_LOST)
        self.was_valid = bool(self.works)

    def on_read_sensor(self, core, values) -> Reason:
        """Send the latest reading of a device as it is, by the id of its driver."""
        device, unit = values
        name = core.module_of(device)
        if name is None:
            return Reason.VALUE
        raw = getattr(core.modules[name], "raw", None)
        if raw is None or core.lacks(name):
            return Reason.NOT_AVAILABLE
        found = raw(core, unit)
        if found is None:
            return Reason.VALUE
        taken_s, *numbers = found
        age_s = core.t_s - taken_s if math.isfinite(taken_s) else math.nan
        rest = [0.0] * (_NUMBERS - len(numbers))
        is_on = int(core.status(name).get("power", 1))
        core.send("reading", (device, unit, is_on, len(numbers), age_s, *numbers, *rest))
        return Reason.DONE

    def status(self) -> dict[str, float]:
        """Mode, whether the Sun shines, whether there is a valid state vector."""
        return {"mode": self.mode, "sunlit": self.sunlit, "works": self.works}


def number_modes(dictionary, label: str, modes: dict[str, str]) -> dict[str, int]:
    """Number of the telemetry's mode by the state of a region; unknown labels are left out."""
    labels = list(dictionary.labels.get(label, ()))
    return {state: labels.index(mode) for state, mode in modes.items() if mode in labels}
