"""Quantities that a motion conserves: their change is the error of the integration."""

import numpy as np
import xarray as xr

from torquer.analysis.attitude import orbital_axes
from torquer.environment.orbit.circular import Circular
from torquer.scenario.spec import Scenario
from torquer.simulation.results.dataset import flown_scenario


def conserved_quantities(result: xr.Dataset) -> dict[str, np.ndarray]:
    """The conserved quantities of a run at its n records, by name; {} if there are none.

    Without external torques `momentum` (n, 3) [N m s, inertial] and, without reaction wheels,
    `energy` (n,) [J]; with the gravity gradient alone, on a circular orbit and without reaction
    wheels, the `jacobi_integral` (n,) [J].
    """
    scenario = flown_scenario(result)
    if not _has_no_torque_but_gravity(scenario, result):
        return {}
    if scenario.environment.gravity_gradient:
        circular = isinstance(scenario.orbit, Circular) and scenario.spacecraft.wheels is None
        return {"jacobi_integral": _jacobi_integral(result)} if circular else {}
    found = {"momentum": result["momentum_inertial"].values}
    if scenario.spacecraft.wheels is None:
        found["energy"] = _energy(result)
    return found


def relative_drifts(found: dict[str, np.ndarray]) -> dict[str, float]:
    """Greatest change since the start, relative to the greatest magnitude, by name."""
    drifts = {}
    for name, values in found.items():
        rows = values.reshape(len(values), -1)
        amount = np.linalg.norm(rows, axis=1).max()
        change = np.linalg.norm(rows - rows[0], axis=1).max()
        drifts[name] = float(change / amount) if amount > 0.0 else 0.0
    return drifts


def _has_no_torque_but_gravity(scenario: Scenario, result: xr.Dataset) -> bool:
    craft = scenario.spacecraft
    coils_off = craft.coils is None or (
        float(result["peak_coil_dipole"]) == 0.0 and not any(craft.coils.residual_dipole_a_m2)
    )
    passive = craft.aerodynamics is None and not craft.has_magnets()
    return coils_off and passive and scenario.disturbance is None


def _energy(result: xr.Dataset) -> np.ndarray:
    """Energy of rotation [J]; the wheels of the body spin at constant speed."""
    return 0.5 * _form(result, result["omega_body"].values)


def _jacobi_integral(result: xr.Dataset) -> np.ndarray:
    """E + 3/2 omega0^2 e.J e - omega0 n.H, with the unit radius vector e and the orbit normal n.

    H is the momentum of body and wheels; the integral is constant on a circular orbit without
    control.
    """
    from scipy.spatial.transform import Rotation

    scenario = flown_scenario(result)
    omega0 = scenario.orbit.rate_rad_s(scenario.start)
    axes = orbital_axes(result["position_inertial"].values, result["velocity_inertial"].values)
    normal, up = axes.apply([0.0, 1.0, 0.0]), axes.apply([0.0, 0.0, 1.0])
    to_body = Rotation.from_quat(result["q_body_to_inertial"].values).inv()
    gravity = 1.5 * omega0**2 * _form(result, to_body.apply(up))
    return (
        _energy(result)
        + gravity
        - omega0 * np.sum(normal * result["momentum_inertial"].values, axis=1)
    )


def _form(result: xr.Dataset, v: np.ndarray) -> np.ndarray:
    """v.J v of vectors (n, 3) in body axes."""
    inertia = np.asarray(flown_scenario(result).spacecraft.body.inertia)
    return np.sum(v * (v @ inertia), axis=1)
