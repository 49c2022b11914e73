"""Torque budget: every disturbance torque along a motion, compared with the coils' torque."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from torquer.analysis.attitude import orbital_axes
from torquer.environment.earth.gravity import gravity_gradient_vector
from torquer.environment.ephemeris import ModelErrors, model_errors
from torquer.environment.light import light_along
from torquer.maths.geometry.attitudes import to_body
from torquer.scenario.initial import InitialMotion
from torquer.scenario.spec import Scenario
from torquer.simulation.results.flown import flown_scenario
from torquer.simulation.setup.own_functions import needs_of_own, own_torques
from torquer.spacecraft.actuators.coils import Coils
from torquer.spacecraft.disturbance import TORQUES
from torquer.spacecraft.disturbance.acting import hung_in, magnets_in
from torquer.spacecraft.disturbance.along import (
    Along,
    acting_along,
    air_along,
    coefficients_along,
    dipole_along,
    gravity_along,
    held_along,
    magnets_along,
)
from torquer.spacecraft.disturbance.held import NO_HELD_TORQUE
from torquer.spacecraft.disturbance.unmodelled import harmonic_torque

if TYPE_CHECKING:  # half a second of importing, which notes need not wait for
    import xarray as xr

#: Names of the torques as tables show them, in their order.
NAMES = {
    "gravity_gradient": "gravity gradient",
    "aerodynamic": "aerodynamic",
    **{key: key.replace("_", " ") for key in TORQUES if key != "unmodelled"},
    "magnets": "magnets and rods",
    "own": "of your own",
    "suspension": "bench: weight, friction",
    "unmodelled": "unmodelled",
    "constant_and_random": "constant, random",
    "all": "all disturbances",
    "coils": "coils (control)",
}


class Budget(NamedTuple):
    """Torques along a motion at n instants.

    `disturbance`: torques (n, 3) N m, body, by key of `NAMES`; `control`: that of the coils
    without their residual dipole, None for a motion that is not flown; `available` (n,): what the
    coils can give in any direction across the field, None without coils; `models`: errors of the
    models on board, from which laws compute their dipoles, None where they are the truth.
    """

    t_s: np.ndarray
    disturbance: dict[str, np.ndarray]
    control: np.ndarray | None
    available: np.ndarray | None
    models: ModelErrors | None

    @property
    def total(self) -> np.ndarray:
        """Sum of the disturbance torques (n, 3)."""
        return np.sum([*self.disturbance.values(), np.zeros((len(self.t_s), 3))], axis=0)


def budget_along_run(result: xr.Dataset) -> Budget:
    """The budget of a run, along its recorded motion."""
    r, b = result["position_inertial"].values, result["b_inertial"].values
    q, omega = result["q_body_to_inertial"].values, result["omega_body"].values
    t_s, dipole = result["time"].values, result["dipole_body"].values
    return _budget(flown_scenario(result), t_s, r, b, q, omega, dipole)


def budget_while_held(scenario: Scenario) -> Budget:
    """The budget of a satellite that holds its initial attitude for the length of the run.

    The attitude is held in the frame of `initial.reference`, without the initial rate.
    """
    record = scenario.simulation.record_s
    t_s = record * np.arange(round(scenario.length_s / record) + 1)
    r, v = scenario.orbit_environment().state(t_s)
    field = scenario.orbit_environment().field(t_s, r, v)
    return _budget(scenario, t_s, r, field, *_held_motion(scenario.initial, r, v), None)


def _held_motion(initial: InitialMotion, r, v) -> tuple[np.ndarray, np.ndarray]:
    """Attitudes (n, 4) and rates (n, 3) of what holds the attitude at the start in its frame."""
    from scipy.spatial.transform import Rotation

    attitude = initial.attitude
    if initial.reference == "inertial":
        return np.tile(attitude, (len(r), 1)), np.zeros((len(r), 3))
    q = (orbital_axes(r, v) * Rotation.from_quat(attitude)).as_quat()
    turning = np.cross(r, v) / np.sum(r**2, axis=1, keepdims=True)
    return q, to_body(q, turning)


def _budget(scenario: Scenario, t_s, r, b, q, omega, dipole) -> Budget:
    along, coils = _along(scenario, t_s, r, b, q, omega), scenario.spacecraft.coils
    found = _disturbances(scenario, t_s, along)
    control = available = None
    if coils is not None:
        if dipole is not None:
            control = dipole_along(dipole - coils.residual_dipole_a_m2, along)
        available = torque_across_field(coils, to_body(along.q, along.b_t))
    named = {name: found[name] for name in NAMES if name in found}
    truth, believed = scenario.orbit_environment(), scenario.believed_environment()
    return Budget(t_s, named, control, available, model_errors(truth, believed, t_s))


def _along(scenario: Scenario, t_s, r, b, q, omega) -> Along:
    """The given motion, field and position, and the other quantities that torques depend on."""
    environment, none = scenario.orbit_environment(), np.zeros((len(t_s), 3))
    angle = scenario.orbit_angle() or (0.0, 0.0)
    of_own = needs_of_own(scenario)
    pushes = scenario.disturbance is not None and scenario.disturbance.solar_pressure is not None
    pushes = pushes or "light" in of_own
    parts = (
        b,
        gravity_gradient_vector(np.ascontiguousarray(r)),
        environment.flow(t_s) if scenario.spacecraft.aerodynamics or "air" in of_own else none,
        light_along(environment.shadow, r, environment.sun(t_s)) if pushes else none,
        angle[0] + angle[1] * t_s,
        q,
        omega,
    )
    return Along(*(np.ascontiguousarray(part) for part in parts))


def _disturbances(scenario: Scenario, t_s, along: Along) -> dict[str, np.ndarray]:
    craft = scenario.spacecraft
    found: dict[str, np.ndarray] = {}
    packed = craft.body.pack(craft.aerodynamics, None, scenario.acting_torques())
    steps = np.round(t_s / scenario.grid_s).astype(np.int64)
    if scenario.environment.gravity_gradient:
        found["gravity_gradient"] = gravity_along(packed.inertia, along)
    if craft.aerodynamics:
        found["aerodynamic"] = air_along(packed.surface, along)
    for name, constants in zip(TORQUES, packed.acting, strict=False):
        if getattr(scenario.disturbance, name, None) is not None and name != "unmodelled":
            found[name] = acting_along(constants, along)
    if own := own_torques(scenario):
        found["own"] = np.sum([acting_along(torque, along) for torque in own], axis=0)
    if scenario.disturbance and scenario.disturbance.suspension:
        found["suspension"] = acting_along(hung_in(packed.acting), along)
    if craft.has_magnets():
        found["magnets"] = magnets_along(magnets_in(packed.acting), along)
    if scenario.disturbance and scenario.disturbance.unmodelled:
        found["unmodelled"] = _unmodelled_torque(scenario, steps, along)
    if craft.coils and any(craft.coils.residual_dipole_a_m2):
        dipole = np.tile(craft.coils.residual_dipole_a_m2, (len(steps), 1))
        of_coils = dipole_along(dipole, along)
        found["residual_dipole"] = found.get("residual_dipole", 0.0) + of_coils
    if (held := scenario.held_torque()) != NO_HELD_TORQUE:
        found["constant_and_random"] = held_along(held, scenario.seed, steps)
    return found


def _unmodelled_torque(scenario: Scenario, steps: np.ndarray, along: Along) -> np.ndarray:
    """The torque with the coefficients that hold at each instant."""
    cells = coefficients_along(scenario.unmodelled_torque(), scenario.seed, steps)
    jumps = np.flatnonzero(np.any(np.diff(cells, axis=0) != 0.0, axis=1)) + 1
    spans = zip([0, *jumps], [*jumps, len(steps)], strict=True)
    parts = [
        acting_along(harmonic_torque(1.0, cells[first]), along.rows(slice(first, last)))
        for first, last in spans
    ]
    return np.concatenate(parts)


def torque_across_field(coils: Coils, b_body: np.ndarray) -> np.ndarray:
    """Torque [N m] (n,) that coils can give in any direction across a field (n, 3) in the body.

    The torques of dipoles within the limits fill a polygon across the field, with two edges along
    each coil's torque g = limit axis x B; this is the distance of the nearest edge,
    the least of sum_k |g_k . n_j| over the coils j, with n_j perpendicular to g_j.
    """
    greatest = coils.limits_a_m2()[:, None] * np.array(coils.axes)
    per_coil = np.cross(greatest[None], b_body[:, None])
    along = b_body / np.linalg.norm(b_body, axis=1, keepdims=True)
    across = np.cross(along[:, None], per_coil)
    length = np.linalg.norm(across, axis=2, keepdims=True)
    edges = np.divide(across, length, out=np.zeros_like(across), where=length > 0.0)
    reach = np.sum(np.abs(np.einsum("nki,nji->njk", per_coil, edges)), axis=2)
    # a coil along the field has no edge
    return np.min(np.where(length[:, :, 0] > 1e-12 * np.max(length), reach, np.inf), axis=1)


def coil_reach(coils: Coils) -> np.ndarray:
    """Largest dipole [A m^2] of the coil set along each body axis [3]."""
    return np.abs(np.array(coils.axes)).T @ coils.limits_a_m2()


class Row(NamedTuple):
    """A torque in the table, [N m]: mean and RMS about the body axes, RMS and greatest size.

    `share`: RMS size over the mean torque that the coils can give; None without coils.
    """

    mean_n_m: tuple[float, float, float]
    rms_n_m: tuple[float, float, float]
    rms_size_n_m: float
    greatest_size_n_m: float
    share: float | None


def budget_rows(budget: Budget) -> dict[str, Row]:
    """The table, by key of `NAMES`: each disturbance torque, their sum, the coils' own torque."""
    torques = {**budget.disturbance, "all": budget.total}
    if budget.control is not None:
        torques["coils"] = budget.control
    usual = None if budget.available is None else float(np.mean(budget.available))
    return {name: _row(torque, usual) for name, torque in torques.items()}


def _row(torque: np.ndarray, usual: float | None) -> Row:
    size = np.linalg.norm(torque, axis=1)
    rms = float(np.sqrt(np.mean(size**2)))
    return Row(
        tuple(np.mean(torque, axis=0).tolist()),
        tuple(np.sqrt(np.mean(torque**2, axis=0)).tolist()),
        rms,
        float(np.max(size)),
        rms / usual if usual else None,
    )


def models_as_plain(models: ModelErrors) -> dict[str, float]:
    """Errors of the models on board as plain data, units in the keys: root mean squares."""
    return {
        "field_nt": 1e9 * models.field_t,
        "strength_nt": 1e9 * models.strength_t,
        "angle_deg": float(np.degrees(models.angle_rad)),
        "position_km": 1e-3 * models.position_m,
    }


def as_plain(budget: Budget) -> dict:
    """The table as plain data, units in the keys."""
    available = None
    if (reach := budget.available) is not None:
        available = {
            "mean_n_m": float(reach.mean()),
            "least_n_m": float(reach.min()),
            "greatest_n_m": float(reach.max()),
        }
    return {
        "duration_s": float(budget.t_s[-1]),
        "torques": {name: row._asdict() for name, row in budget_rows(budget).items()},
        "coils_across_field": available,
        "models_on_board": None if budget.models is None else models_as_plain(budget.models),
    }
