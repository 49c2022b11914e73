"""The disturbance torques that act on a body, added; their kernels are chosen by type."""

from torquer.compile.engine import inlined
from torquer.compile.when_compiling import when_compiling
from torquer.environment.local import in_body
from torquer.maths.geometry.vec3 import add
from torquer.spacecraft.disturbance import TORQUES
from torquer.spacecraft.disturbance.magnets import Magnets, magnet_torque, with_rods
from torquer.spacecraft.disturbance.suspension import Hung, is_tilted, suspension_torque
from torquer.spacecraft.disturbance.unmodelled import harmonic_torque
from torquer.spacecraft.disturbance.user import OwnTorque, own_torque

_KERNELS = {type(torque.none): torque.kernel for torque in TORQUES.values()}
_KERNELS |= {Hung: suspension_torque, Magnets: magnet_torque, OwnTorque: own_torque}


def acting_torque(constants, local_body, omega_body):
    """Torque [N m, body] by its constants."""
    return _KERNELS[type(constants)](constants, local_body, omega_body)


def hung_in(acting):
    """The suspension among the constants of torques, () for none."""
    return next((each for each in acting if type(each) is Hung), ())


def magnets_in(acting):
    """The magnets among the constants of torques, () for none."""
    return next((each for each in acting if type(each) is Magnets), ())


def add_torques(torque, acting, local_body, omega_body):
    """A torque [N m, body] and those of the constants, one after another."""
    if len(acting) == 0:
        return torque
    total = add(torque, acting_torque(acting[0], local_body, omega_body))
    return add_torques(total, acting[1:], local_body, omega_body)


@when_compiling
def _overload() -> None:
    from numba.extending import overload

    from torquer.compile.numba_private import INLINED_OPTIONS

    @overload(acting_torque, jit_options=INLINED_OPTIONS)
    def choose(constants, local_body, omega_body):
        kernel = _KERNELS[constants.instance_class]
        return lambda constants, local_body, omega_body: kernel(constants, local_body, omega_body)

    def found(acting, kind):
        """A kernel that gives the constants of a kind, () for none: they may stand anywhere."""
        for place, each in enumerate(acting):
            if getattr(each, "instance_class", None) is kind:
                return lambda acting: acting[place]
        return lambda acting: ()

    @overload(hung_in, jit_options=INLINED_OPTIONS)
    def find_hung(acting):
        return found(acting, Hung)

    @overload(magnets_in, jit_options=INLINED_OPTIONS)
    def find_magnets(acting):
        return found(acting, Magnets)

    @overload(add_torques, jit_options=INLINED_OPTIONS)
    def one_by_one(torque, acting, local_body, omega_body):
        return add_torques


@inlined
def with_acting(torque, acting, local, q, omega_body):
    """A torque [N m, body] plus those that act alongside it; `acting`: () for none."""
    if len(acting) == 0:
        return torque
    return add_torques(torque, acting, in_body(local, q), omega_body)


@inlined
def leaves_bearing(acting, local, q):
    """Whether a body on a bearing is tilted beyond its limit; never one without."""
    return _is_beyond(hung_in(acting), local, q)


@inlined
def _is_beyond(hung, local, q):
    if len(hung) == 0:
        return False
    return is_tilted(hung, in_body(local, q))


@inlined
def with_coefficients(acting, cells):
    """The torques with the present coefficients (15 cells) of the unmodelled one, the last."""
    present = harmonic_torque(acting[-1].is_on, cells)
    return acting[:-1] + (present,)  # noqa: RUF005 (kernels know no stars)


@inlined
def with_memory(acting, memory):
    """The torques with what rods, if there are any, remember: those stand last but one."""
    return _with_memory(acting, magnets_in(acting), memory)


@inlined
def _with_memory(acting, magnets, memory):
    if len(magnets) == 0:
        return acting
    present = with_rods(magnets, memory)
    return acting[:-2] + (present, acting[-1])  # noqa: RUF005 (kernels know no stars)
