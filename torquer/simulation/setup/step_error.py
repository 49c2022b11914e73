"""The error that the steps of a run make, measured: the same run again with finer steps."""

from collections.abc import Callable, Mapping

import numpy as np
import xarray as xr

from torquer.computer.blocks.law import Law
from torquer.maths.geometry.quaternion import angle_between
from torquer.scenario.spec import Scenario
from torquer.simulation.results.dataset import COMPLETE, flown_scenario
from torquer.simulation.setup.simulate import simulate

#: How much finer the tolerance is in the second run, and how much shorter the steps.
_FINER_TOLERANCE, _LEAST_TOLERANCE_DEG = 1e-3, 1e-10
_SHORTER, _SHORTER_FIXED = 0.5, 0.25


def with_finer_steps(result: xr.Dataset) -> Scenario:
    """The scenario of a result with finer steps.

    A tolerance 1000 times finer or, with fixed steps, a quarter of the step. Adaptive steps are
    shorter than half of the mean step too, as those may be much better than their tolerance which
    an event ended.
    """
    scenario = flown_scenario(result)
    simulation = scenario.simulation
    if simulation.integrator != "auto":
        return scenario.replace("simulation.step_s", _SHORTER_FIXED * simulation.step_s)
    finer = max(_FINER_TOLERANCE * simulation.tolerance_deg, _LEAST_TOLERANCE_DEG)
    shorter_s = max(_SHORTER * float(result["mean_step"]), 1e-3)
    scenario = scenario.replace("simulation.tolerance_deg", finer)
    return scenario.replace("simulation.max_step_s", shorter_s)


def integration_error(
    flown: Scenario | xr.Dataset,
    law: Law | Callable | None = None,
    laws: Mapping[str, Law | Callable] | None = None,
    progress: Callable[[float], None] | None = None,
) -> xr.Dataset:
    """How far a run is from the same run with finer steps, at the recorded instants.

    `flown`: the result of a complete run, or a scenario, which is run first. `attitude_error`
    (time) [rad], `rate_error` (time) [rad/s]; both runs have the same readings' noise and the same
    laws. Takes a few times the computing of the run itself. ValueError for a run that ended early.

        >>> error = torquer.integration_error(result)
        >>> bool(error["attitude_error"].max() < 1e-4)  # rad
        True
    """
    plain = simulate(flown, law, laws=laws) if isinstance(flown, Scenario) else flown
    if plain.attrs["how_it_ended"] != COMPLETE:
        raise ValueError(f"flown: must be a complete run; received one that {plain.attrs['ended']}")
    fine = simulate(with_finer_steps(plain), law, laws=laws, progress=progress)
    angle = angle_between(plain.q_body_to_inertial.values, fine.q_body_to_inertial.values)
    rate = np.linalg.norm(plain.omega_body.values - fine.omega_body.values, axis=1)
    return xr.Dataset(
        {
            "attitude_error": ("time", angle, {"units": "rad"}),
            "rate_error": ("time", rate, {"units": "rad/s"}),
        },
        {"time": plain.time},
    )
