"""How well a law held its attitude: the wanted one, and how far the body was from it."""

import json
from typing import NamedTuple

import numpy as np
import xarray as xr

from torquer.control.three_axis import ThreeAxis
from torquer.control.wheel_lyapunov import WheelLyapunov
from torquer.control.wheel_pd import WheelPd
from torquer.report.series import attitude_error_deg, orbital_axes

#: Attributes that name a run's laws, those of the wheels first, and the laws that hold an attitude.
_HOLDERS = {
    "wheel_law": {spec.model_fields["kind"].default for spec in (WheelPd, WheelLyapunov)},
    "law": {ThreeAxis.model_fields["kind"].default},
}


class Held(NamedTuple):
    """An attitude that a law held, and the deviation from it at the records; n records."""

    orbital: bool
    """Whether the reference is the orbital frame; else it is the inertial one."""
    error_deg: np.ndarray
    """(n, 3): turn vectors from the wanted attitude to the body, in body axes."""
    rate_rad_s: np.ndarray
    """(n, 3): rate relative to the reference, in body axes."""

    @property
    def angle_deg(self) -> np.ndarray:
        """Angle of the whole turn (n,)."""
        return np.linalg.norm(self.error_deg, axis=1)


def held_in(result: xr.Dataset) -> Held | None:
    """The attitude that a built-in law of the run held; None if there was no such law.

    What was wanted is told by the parameters that were flown, not by the scenario: another law
    may have taken the place of the scenario's own.
    """
    for name, kinds in _HOLDERS.items():
        if result.attrs.get(name) in kinds:
            return _held_by(result, json.loads(result.attrs[f"{name}_parameters"]))
    return None


def _held_by(result: xr.Dataset, parameters: dict) -> Held | None:
    if not {"orbital", "q_x", "q_y", "q_z", "q_w"} <= set(parameters):
        return None  # a law of the user's own with a name of ours
    orbital = parameters["orbital"] != 0.0
    wanted = [parameters[f"q_{c}"] for c in "xyzw"]
    frame = None
    if orbital:
        frame = orbital_axes(result["position_inertial"].values, result["velocity_inertial"].values)
    error = attitude_error_deg(result["q_body_to_inertial"].values, wanted, frame)
    rate = result["omega_orbital" if orbital else "omega_body"].values
    return Held(orbital, error, rate)
