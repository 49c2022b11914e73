"""Non-monotonic detumbling: brake so that the momentum left can be braked later, too.

The momentum h = J omega can be changed across the field b1 now, and across the field b2 that comes
after a look-ahead time. The impulses s1 and s2 that leave least of it,

    min  a |h - b1 x s1 - b2 x s2|^2 + |h - b1 x s1|^2 + |s1|^2 + |s2|^2,

have a closed form. With p = b2 - b1 (b1.b2), c = a/(1 + a), g = a - c and u = b1 x s1

    (2 + c) u + g p (p.u) = (1 + c) (h - b1 (b1.h)) + g p (b2.h),  s1 = u x b1,

and the dipole is m = k s1. The momentum may grow for a while: it falls from one look-ahead time to
the next, not at each instant. J. Willis, P. Fisch, A. Seletskiy, Z. Manchester, "Building a better
B-dot: fast detumbling with non-monotonic Lyapunov functions", IEEE Aerospace Conference (2024), who
bend k s1 to each coil's limit by a hyperbolic tangent; here the coils' own saturation ends it.

b2 follows from the rate of the field along the orbit, which is that in the body plus omega x B. A
search coil reads the former; without one, the field is followed in axes that the gyro carries
along, by a filter whose time [s] averages the noise of both.

Valid with an inertia that is known well enough for the direction of h; a gyro without bias to speak
of; coils that can take out the momentum in a few look-ahead times; an orbit along which the field
turns; a rate of the field better than differences of a noisy magnetometer. The impulses
that are found are those wanted, not those that the coils can give: k sets how near to their limit
they work.
"""

from typing import ClassVar, Literal, NamedTuple

from pydantic import Field

from torquer.base.spec import Inertia
from torquer.compile.engine import inlined, kernel
from torquer.computer.blocks.parameters import InertiaNumbers, NotNegative
from torquer.computer.laws.law_spec import LawSpec
from torquer.maths.geometry.quaternion import from_rotation_vector, rotate_inverse
from torquer.maths.geometry.vec3 import (
    add,
    add_scaled,
    as_symmetric,
    cross,
    dot,
    norm,
    put_vector,
    read_vector,
    scale,
    sub,
    sym_vec,
    unit,
)

_ZERO = (0.0, 0.0, 0.0)


class NonMonotonicParameters(NamedTuple):
    """k [A m^2/(N m s)], a [1], look-ahead and filter time [s], J."""

    gain: float
    ahead: float
    look_ahead_s: float
    filter_s: NotNegative
    inertia: InertiaNumbers


@inlined
def impulse_now(h, b1, b2, a):
    """s1 of the minimum above [N m s]; b1, b2: unit vectors."""
    c = a / (1.0 + a)
    g, p = a - c, add_scaled(b2, -dot(b1, b2), b1)
    across = add_scaled(h, -dot(b1, h), b1)
    wanted = add_scaled(scale(1.0 + c, across), g * dot(b2, h), p)
    along = g * dot(p, wanted) / (2.0 + c + g * dot(p, p))
    return scale(1.0 / (2.0 + c), cross(add_scaled(wanted, -along, p), b1))


@inlined
def _command(inputs, parameters, b, rate):
    """The dipole for a field b [T] and its rate along the orbit [T/s], both in the body."""
    p, later = parameters, add_scaled(b, parameters.look_ahead_s, rate)
    h = sym_vec(p.inertia, inputs.estimate.omega_body_rad_s)
    if norm(b) == 0.0 or norm(later) == 0.0:
        return (0.0, 0.0, 0.0)
    return scale(p.gain, impulse_now(h, unit(b), unit(later), p.ahead))


@kernel
def non_monotonic_derivative(inputs, parameters, memory):
    """The law with the field's rate in the body read directly."""
    b, omega = inputs.b_body_t, inputs.estimate.omega_body_rad_s
    return _command(inputs, parameters, b, add(inputs.b_rate_body_t_s, cross(omega, b)))


@kernel
def non_monotonic(inputs, parameters, memory):
    """The law with a rate of the field that magnetometer and gyro give.

    Field and rate are carried to the new axes of the body, and corrected by the reading: an
    alpha-beta filter, alpha = 2 T/time, beta = alpha^2/(2 - alpha). After a gap longer than the
    filter's time it begins anew. Memory: time, field and rate.
    """
    b, t_s = inputs.b_body_t, inputs.read_at.magnetometer_s
    known_b, rate = read_vector(memory.b_body_t), read_vector(memory.rate_t_s)
    interval_s = t_s - memory.t_s
    if memory.has_reading == 0.0 or interval_s > parameters.filter_s:
        known_b, rate = b, (0.0, 0.0, 0.0)
        memory.has_reading, memory.t_s = 1.0, t_s
    elif interval_s > 0.0:
        alpha = min(1.0, 2.0 * interval_s / parameters.filter_s)
        beta = alpha * alpha / (2.0 - alpha)
        turn = from_rotation_vector(scale(interval_s, inputs.estimate.omega_body_rad_s))
        rate = rotate_inverse(turn, rate)
        known_b = add_scaled(rotate_inverse(turn, known_b), interval_s, rate)
        off = sub(b, known_b)
        known_b = add_scaled(known_b, alpha, off)
        rate = add_scaled(rate, beta / interval_s, off)
        memory.t_s = t_s
    put_vector(memory.b_body_t, known_b)
    put_vector(memory.rate_t_s, rate)
    return _command(inputs, parameters, b, rate)


class _NonMonotonic(LawSpec):
    """Non-monotonic detumbling."""

    gain_a_m2_per_n_m_s: float = Field(gt=0.0)
    """Gain k: the dipole for a unit of the impulse wanted of the coils."""
    ahead: float = Field(default=100.0, gt=0.0)
    """Weight a of the momentum that is left after the look-ahead time, against the one now."""
    look_ahead_s: float = Field(default=600.0, ge=0.0)
    """Time after which the field b2 is expected; best is a tenth of an orbit."""
    inertia_kg_m2: Inertia
    """Inertia tensor of the body that the computer assumes, in the frame of its axes."""

    def _with_filter(self, filter_s: float) -> NonMonotonicParameters:
        return NonMonotonicParameters(
            self.gain_a_m2_per_n_m_s,
            self.ahead,
            self.look_ahead_s,
            filter_s,
            as_symmetric(self.inertia_kg_m2),
        )


class NonMonotonic(_NonMonotonic):
    """Non-monotonic detumbling from magnetometer and gyro."""

    kind: Literal["non_monotonic"] = "non_monotonic"
    kernel: ClassVar = non_monotonic
    memory: ClassVar = {"has_reading": 0.0, "t_s": 0.0, "b_body_t": _ZERO, "rate_t_s": _ZERO}
    needs: ClassVar = frozenset({"magnetometer", "rate"})
    filter_s: float = Field(default=30.0, gt=0.0)
    """Time of the filter that finds the field's rate: short against that in which the field turns
    along the orbit, long against the step of control.
    """

    def parameters(self) -> NonMonotonicParameters:
        """Gain, weight, times, inertia."""
        return self._with_filter(self.filter_s)


class NonMonotonicDerivative(_NonMonotonic):
    """Non-monotonic detumbling with the field's rate in the body read directly (search coil)."""

    kind: Literal["non_monotonic_derivative"] = "non_monotonic_derivative"
    kernel: ClassVar = non_monotonic_derivative
    needs: ClassVar = frozenset({"magnetometer", "search_coil", "rate"})

    def parameters(self) -> NonMonotonicParameters:
        """Gain, weight, times, inertia; the rate is read, so nothing is filtered."""
        return self._with_filter(0.0)
