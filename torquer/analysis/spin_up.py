"""Whether the rotation grew for good while the coils worked, whatever the law."""

import math
from collections.abc import Iterator

import numpy as np
import xarray as xr

from torquer.computer.modes.together import SPINS
from torquer.scenario.mission import ORBITAL_RATES
from torquer.scenario.spec import Scenario
from torquer.simulation.results.dataset import flown_scenario
from torquer.theory.averaged.sampling import sampling_by_differences

#: Part of a run, at its end, in which the energy must not come down again.
LAST = 0.1
#: Records of that part that are looked at, at most.
_MOST = 5000
#: Least growth of the energy that is told, over what it was.
_GROWN = 1.1
#: Part of the limit of sampled control from which on it may be the reason.
_NEAR = 0.5
#: Where a pulse stands in its period, in words.
PLACE_WORDS = {"begin": "at the beginning", "middle": "in the middle", "end": "at the end"}
#: The greatest field in low orbit [T].
_GREATEST_FIELD_T = 6e-5


def may_be_spun_up(scenario: Scenario) -> bool:
    """Whether coils alone drive the rotation, and no law is meant to spin the body up."""
    craft = scenario.spacecraft
    kinds = {spec.kind for spec in scenario.control.named().laws.values()}
    return craft.coils is not None and craft.wheels is None and not kinds & {*SPINS}


def rotation_energy_j(scenario: Scenario, omega_body: np.ndarray) -> np.ndarray:
    """Energy of rotation [J] of the scenario's body at rates (..., 3) [rad/s]."""
    inertia = np.asarray(scenario.spacecraft.body.inertia)
    return 0.5 * np.einsum("...i,ij,...j->...", omega_body, inertia, omega_body)


def has_grown(scenario: Scenario, first_j, last_j):
    """Whether an energy of rotation grew from `first_j` to `last_j` [J], numbers or arrays.

    By a tenth at least, by more than gravity and the body's own dipole give back, and to a rotation
    that is not the orbital one.
    """
    craft, orbital = scenario.spacecraft, scenario.orbit.rate_rad_s(scenario.start)
    moments = craft.body.principal()[0]
    own = float(np.linalg.norm(craft.coils.residual_dipole_a_m2)) if craft.coils else 0.0
    lent = 1.5 * orbital**2 * float(np.ptp(moments)) + 2.0 * own * _GREATEST_FIELD_T
    slow = 0.5 * float(np.max(moments)) * (ORBITAL_RATES * orbital) ** 2
    return (last_j > _GROWN * first_j) & (last_j - first_j > lent) & (last_j > slow)


def spin_up_notes(result: xr.Dataset) -> Iterator[str]:
    """A note if the body rotates faster for good than at the start of a run with coils."""
    scenario = flown_scenario(result)
    count = result.sizes["time"]
    if not may_be_spun_up(scenario) or count < 2 or not float(result["peak_coil_dipole"]) > 0.0:
        return
    rows = np.unique(np.linspace((1.0 - LAST) * (count - 1), count - 1, _MOST).astype(int))
    omega = result["omega_body"]
    first, last = omega[:1].values, omega[rows[0] :][rows - rows[0]].values
    began, least = (rotation_energy_j(scenario, each).min() for each in (first, last))
    if has_grown(scenario, began, least):
        rates = [math.degrees(np.linalg.norm(each)) for each in (first[0], last[-1])]
        limit = limit_text(scenario, rates[1])
        yield (
            f"the body rotates faster at the end, {rates[1]:.4g} deg/s, than at the start, "
            f"{rates[0]:.4g} deg/s, while the coils worked" + f"; {limit}" * bool(limit)
        )


def limit_text(scenario: Scenario, rate_deg_s: float) -> str:
    """Up to which rotation control that is sampled as in a scenario brakes; "" for a rate far below
    that, which it does not explain."""
    sampling = sampling_by_differences(scenario)
    if not rate_deg_s > _NEAR * math.degrees(sampling.limit_rad_s):
        return ""
    whole, short = map(math.degrees, sampling.limits_rad_s)
    at = PLACE_WORDS[scenario.spacecraft.coils.pwm_place]
    pulses = f", by short pulses {at} of each period up to {short:.3g} deg/s"
    return (
        "a law that takes differences of readings, sampled as here, brakes rotation up to "
        f"{whole:.3g} deg/s{pulses * (short != whole)}"
    )
