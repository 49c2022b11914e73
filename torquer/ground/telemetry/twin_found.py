"""What a fitted twin says of a satellite."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr

from torquer.ground.telemetry.twin_flights import INERTIA
from torquer.scenario.spec import Scenario


class Twin(NamedTuple):
    """What was found.

    `names`, `values`, `covariance`: elements of the inertia [kg m^2], residual dipole [A m^2], both
    over the gain where `only_ratio`, and otherwise the gain if it shows. `saturated`: part of the
    commands at the limit of a coil. `chi2` of `freedoms`: squares of the errors over their
    variances. `window_s`: what the twin follows, of `session_s`. `undetermined`: directions of
    which the telemetry says nothing. `doubt`: why the covariance cannot be relied on, "" if it can.
    `data` over `time`: the twin's `b_body` [T] and `omega_body` [rad/s] with the readings.
    `scenario`: the twin as found, from its start; `onward`: from the start of its last leg;
    `members`: tables `[[campaign.correlated]]` of what may be there instead. Without a fit there
    are no values, and `data`, `scenario` and `onward` are None.
    """

    names: tuple[str, ...]
    values: np.ndarray
    covariance: np.ndarray
    only_ratio: bool
    saturated: float
    chi2: float
    freedoms: int
    window_s: float
    session_s: float
    undetermined: tuple[str, ...]
    doubt: str
    data: xr.Dataset | None
    scenario: Scenario | None
    onward: Scenario | None = None
    members: tuple[dict, ...] = ()

    @property
    def fits(self) -> bool:
        """Whether the twin follows the telemetry."""
        return self.scenario is not None

    @property
    def sigmas(self) -> dict[str, float]:
        """Standard deviations by name."""
        sigmas = np.sqrt(np.diag(self.covariance)).tolist()
        return dict(zip(self.names, sigmas, strict=True))

    def of(self, name: str) -> float:
        """A value by its name."""
        return float(self.values[self.names.index(name)])

    @property
    def verdict(self) -> str:
        """What is known, or that nothing is."""
        minutes = f"{self.window_s / 60.0:.1f} of {self.session_s / 60.0:.1f} min"
        if not self.fits:
            return f"no twin fits: the best one follows {minutes} of the telemetry"
        parts = {name: 100.0 * self.sigmas[name] / self.of(name) for name in self.names}
        over = "/gain" if self.only_ratio else ""
        worst = max(parts[f"inertia_{each}{over}"] for each in INERTIA[:3])
        text = f"twin: inertia{over} to {worst:.2g} %"
        if "gain" in parts:
            text += f", gain to {parts['gain']:.2g} %"
        share = f"{100.0 * self.saturated:.0f} % of the commands saturate the coils"
        if self.only_ratio:
            how = share if self.saturated else "the coils are never saturated"
            text += f"; only J/gain is known: {how}"
        elif "gain" not in parts:
            text += f", its gain is not known: {share}"
        if self.doubt:
            text += f"; do not rely on these errors: {self.doubt}"
        return text if self.window_s >= self.session_s else f"{text}; follows {minutes}"
