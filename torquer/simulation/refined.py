"""The error that the steps of a run make, measured: the same run again with finer steps."""

from collections.abc import Callable, Mapping

import numpy as np
import xarray as xr

from torquer.control.law import Law
from torquer.scenario.spec import Scenario
from torquer.simulation.simulate import simulate

#: How much finer the tolerance is in the second run; and the fixed steps, of order 4 or less.
_FINER_TOLERANCE, _FINER_STEP = 1e-3, 0.25
_LEAST = {"tolerance_deg": 1e-10, "tolerance": 1e-14}


def with_finer_steps(scenario: Scenario) -> Scenario:
    """The same scenario with a tolerance 1000 times finer, or with a quarter of the step.

    ValueError where the tolerance is the finest already.
    """
    simulation = scenario.simulation
    if simulation.step_s is not None and simulation.integrator != "dop853":
        return scenario.replace("simulation.step_s", _FINER_STEP * simulation.step_s)
    name = "tolerance_deg" if simulation.integrator == "auto" else "tolerance"
    tolerance = getattr(simulation, name)
    if tolerance <= _LEAST[name]:
        raise ValueError(
            f"simulation.{name}: must be above {_LEAST[name]:g} for a finer one to compare with; "
            f"received {tolerance:g}"
        )
    return scenario.replace(f"simulation.{name}", max(_FINER_TOLERANCE * tolerance, _LEAST[name]))


def integration_error(
    scenario: Scenario,
    law: Law | Callable | None = None,
    laws: Mapping[str, Law | Callable] | None = None,
) -> xr.Dataset:
    """How far a run is from the same run with finer steps, at the recorded instants.

    `attitude_error` (time) [rad], `rate_error` (time) [rad/s]; both runs have the same readings'
    noise and the same laws. Takes a few times the computing of the run itself.
    """
    plain, fine = (simulate(s, law, laws=laws) for s in (scenario, with_finer_steps(scenario)))
    p, q = plain.q_body_to_inertial.values, fine.q_body_to_inertial.values
    apart = np.minimum(np.linalg.norm(p - q, axis=1), np.linalg.norm(p + q, axis=1))
    rate = np.linalg.norm(plain.omega_body.values - fine.omega_body.values, axis=1)
    return xr.Dataset(
        {
            "attitude_error": ("time", 4.0 * np.arcsin(0.5 * apart), {"units": "rad"}),
            "rate_error": ("time", rate, {"units": "rad/s"}),
        },
        {"time": plain.time},
    )
