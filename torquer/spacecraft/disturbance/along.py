"""Torques along a recorded motion, by the kernels of the loop."""

from typing import NamedTuple

import numpy as np

from torquer.compile.engine import kernel
from torquer.environment.earth.gravity import gravity_gradient_torque
from torquer.environment.local import LocalEnvironment, in_body
from torquer.maths.geometry.attitudes import to_body
from torquer.maths.geometry.vec3 import cross, put_vector, read_vector
from torquer.spacecraft.aerodynamics import aerodynamic_force_and_torque
from torquer.spacecraft.disturbance.acting import acting_torque
from torquer.spacecraft.disturbance.held import torque_held
from torquer.spacecraft.disturbance.magnets import (
    Magnets,
    first_memory,
    magnet_torque,
    remember_field,
)
from torquer.spacecraft.disturbance.unmodelled import draw_coefficients


class Along(NamedTuple):
    """A motion and the environment along it, at n instants; vectors [n, 3] in the inertial frame.

    Field [T], gravity-gradient vector [1/s], air's flow [sqrt(Pa)], light [Pa]; the orbit's angle
    [rad] (n,); attitude [n, 4], rate in the body [rad/s].
    """

    b_t: np.ndarray
    gravity_gradient: np.ndarray
    flow: np.ndarray
    light: np.ndarray
    orbit_angle: np.ndarray
    q: np.ndarray
    omega: np.ndarray

    def rows(self, which: slice) -> "Along":
        """Some of the instants."""
        return Along(*(part[which] for part in self))


@kernel
def _look_at(along, k):
    """The local environment in body axes at instant k."""
    local = LocalEnvironment(
        read_vector(along.b_t[k]),
        read_vector(along.gravity_gradient[k]),
        read_vector(along.flow[k]),
        read_vector(along.light[k]),
        (along.orbit_angle[k],),
    )
    return in_body(local, (along.q[k, 0], along.q[k, 1], along.q[k, 2], along.q[k, 3]))


@kernel
def _acting(constants, along, out):
    for k in range(out.shape[0]):
        put_vector(
            out[k], acting_torque(constants, _look_at(along, k), read_vector(along.omega[k]))
        )


@kernel
def _gravity(inertia, along, out):
    for k in range(out.shape[0]):
        put_vector(out[k], gravity_gradient_torque(inertia, _look_at(along, k).gravity_gradient))


@kernel
def _air(surface, along, out):
    for k in range(out.shape[0]):
        put_vector(out[k], aerodynamic_force_and_torque(surface, _look_at(along, k).flow)[1])


@kernel
def _dipoles(dipoles, along, out):
    for k in range(out.shape[0]):
        put_vector(out[k], cross(read_vector(dipoles[k]), _look_at(along, k).b_t))


@kernel
def _fill_held(held, seed, steps, out):
    for k in range(out.shape[0]):
        put_vector(out[k], torque_held(held, seed, steps[k]))


@kernel
def _magnets(magnets, along, out):
    for k in range(out.shape[0]):
        b_body = _look_at(along, k).b_t
        remember_field(magnets, magnets.memory, b_body)
        put_vector(out[k], magnet_torque(magnets, _look_at(along, k), (0.0, 0.0, 0.0)))


@kernel
def _coefficients(unmodelled, seed, steps, out):
    for k in range(out.shape[0]):
        step = steps[k] - steps[k] % unmodelled.hold_steps
        draw_coefficients(unmodelled, seed, step, out[k])


def _fill(fill, count: int, *arguments, columns: int = 3) -> np.ndarray:
    out = np.zeros((count, columns))
    fill(*arguments, out)
    return out


def acting_along(constants, along: Along) -> np.ndarray:
    """Torque [n, 3] N m, body, by constants of `TORQUES`."""
    return _fill(_acting, len(along.q), constants, along)


def magnets_along(magnets: Magnets, along: Along) -> np.ndarray:
    """Torque [n, 3] N m, body, of magnets, whose rods know the field at these instants alone."""
    (b_body,) = to_body(along.q[:1], along.b_t[:1])
    present = magnets._replace(memory=first_memory(magnets, b_body))
    return _fill(_magnets, len(along.q), present, along)


def gravity_along(inertia: tuple, along: Along) -> np.ndarray:
    """Gravity-gradient torque [n, 3] N m, body; `inertia` as `sym_vec` takes it."""
    return _fill(_gravity, len(along.q), inertia, along)


def air_along(surface, along: Along) -> np.ndarray:
    """Aerodynamic torque [n, 3] N m, body."""
    return _fill(_air, len(along.q), surface, along)


def dipole_along(dipoles_body_a_m2: np.ndarray, along: Along) -> np.ndarray:
    """Torque [n, 3] N m, body, of dipoles [n, 3] in the field."""
    return _fill(_dipoles, len(along.q), np.ascontiguousarray(dipoles_body_a_m2), along)


def held_along(held, seed: int, steps: np.ndarray) -> np.ndarray:
    """Constant and random torque [n, 3] N m, body, from these steps on."""
    return _fill(_fill_held, len(steps), held, seed, steps)


def coefficients_along(unmodelled, seed: int, steps: np.ndarray) -> np.ndarray:
    """Coefficients [n, 15] N m of the unmodelled torque from these steps on."""
    return _fill(_coefficients, len(steps), unmodelled, seed, steps, columns=15)
