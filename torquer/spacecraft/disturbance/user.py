"""A torque of the user's own: a compiled function, called by its address."""

import math
from typing import Literal, NamedTuple

from torquer.base.user_code import UserCode
from torquer.base.user_source import attributes_read
from torquer.compile.engine import caller, inlined
from torquer.maths.geometry.vec3 import norm, scale

#: Most parameters of a function: all functions are called with as many numbers.
MOST_PARAMETERS = 12


class TorqueInputs(NamedTuple):
    """What a torque may depend on; vectors in body axes.

    `t_s`: time since the start; `omega_body_rad_s`: absolute rate; `b_body_t`: field;
    `up_body`: unit vector away from the Earth's centre; `light_body_pa`: direction to the Sun with
    the length of the pressure of its light, zero in the umbra; `flow_body`: velocity relative to
    the air times the root of its density [sqrt(Pa)]; `argument_of_latitude_rad`: that at the start,
    and on by the mean orbital rate.

        >>> def drag(here):  # a torque of your own: `disturbance.own.NAME` names its file
        ...     return tuple(-1e-6 * rate for rate in here.omega_body_rad_s)
        >>> here = torquer.TorqueInputs(
        ...     t_s=0.0, omega_body_rad_s=(0.5, 0.0, -0.5), b_body_t=(2e-5, 0.0, 0.0),
        ...     up_body=(0.0, 0.0, 1.0), light_body_pa=(0.0, 0.0, 0.0), flow_body=(0.0, 0.0, 0.0),
        ...     argument_of_latitude_rad=0.0,
        ... )
        >>> drag(here)
        (-5e-07, -0.0, 5e-07)
    """

    t_s: float = 0.0
    omega_body_rad_s: tuple = (0.0, 0.0, 0.0)
    b_body_t: tuple = (0.0, 0.0, 0.0)
    up_body: tuple = (0.0, 0.0, 0.0)
    light_body_pa: tuple = (0.0, 0.0, 0.0)
    flow_body: tuple = (0.0, 0.0, 0.0)
    argument_of_latitude_rad: float = 0.0


class OwnTorque(NamedTuple):
    """A torque of the user's own for kernels: address of its function, the orbit's angle at the
    start [rad] and the time that it takes per radian [s], numbers of its parameters."""

    address: int
    start_rad: float
    s_per_rad: float
    parameters: tuple


NO_PARAMETERS = (0.0,) * MOST_PARAMETERS


def signature():
    """Signature of the compiled function."""
    import numba

    numbers = numba.types.UniTuple(numba.types.float64, 3)
    return numbers(numba.typeof(TorqueInputs()), numba.typeof(NO_PARAMETERS))


_call = caller(signature)


@inlined
def _or_zero(vector):
    if len(vector) == 0:
        return (0.0, 0.0, 0.0)
    return vector


@inlined
def _direction(vector):
    size = norm(vector)
    return scale(1.0 / size if size > 0.0 else 0.0, vector)


@inlined
def own_torque(own, local_body, omega_body):
    """Torque [N m, body] as the user's function returns it."""
    angle = local_body.orbit_angle[0]
    here = TorqueInputs(
        (angle - own.start_rad) * own.s_per_rad,
        omega_body,
        local_body.b_t,
        _direction(local_body.gravity_gradient),
        _or_zero(local_body.light),
        _or_zero(local_body.flow),
        angle,
    )
    return _call(own.address, here, own.parameters)


@inlined
def as_torque(answer):
    """What a function returned, as three floats."""
    x, y, z = answer
    return (float(x), float(y), float(z))


@inlined
def no_torque():
    """The answer of a function that raised an error: the run ends there."""
    return (math.nan, math.nan, math.nan)


class UserTorque(UserCode):
    """A torque of your own: a function `(here, **parameters)` in a Python file.

    `here` is a `torquer.TorqueInputs`; the function returns three numbers [N m] in body axes. It is
    compiled, and called at every stage of a step: it must be smooth and keep nothing in mind.
    """

    kind: Literal["user"]
    place = "disturbance.own"
    takes = 1
    returns = "a function (here) that compiles and returns three numbers [N m]"

    def needs(self) -> frozenset[str]:
        """What is tabulated for it: of "light", "air", "up"."""
        used = attributes_read(self.plain())
        return frozenset(need for need, name in _TABULATED.items() if used is None or name in used)


_TABULATED = {"light": "light_body_pa", "air": "flow_body", "up": "up_body"}
