"""Disturbance torques besides gravity gradient and air: one file each, listed in `TORQUES`.

A torque's file has its spec, a table within `[disturbance]` whose `pack(parts)`, or
`pack(parts, body)` if it depends on the inertia, gives a named tuple of constants; and its kernel
`torque(constants, local_body, omega_body)` [N m, body], where `local_body` is a `LocalEnvironment`
in body axes. Those that a satellite has act at every stage of
a step. The held torque is no such plug-in: it does not depend on motion or place.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from pydantic import Field

from torquer.base.spec import Spec, Vector
from torquer.maths.geometry.vec3 import as_vector
from torquer.spacecraft.disturbance.eddy_currents import (
    NO_EDDY_CURRENTS,
    EddyCurrents,
    eddy_current_torque,
)
from torquer.spacecraft.disturbance.energy_sink import (
    NO_SINK,
    EnergySink,
    energy_sink_torque,
)
from torquer.spacecraft.disturbance.held import FOR_EVER, HeldTorque
from torquer.spacecraft.disturbance.magnets import Magnets
from torquer.spacecraft.disturbance.residual_dipole import (
    NO_DIPOLE,
    ResidualDipole,
    residual_dipole_torque,
)
from torquer.spacecraft.disturbance.solar_pressure import (
    NO_SUNLIT_SURFACE,
    SolarPressure,
    solar_pressure_torque,
)
from torquer.spacecraft.disturbance.suspension import Hung, Suspension
from torquer.spacecraft.disturbance.unmodelled import (
    NO_HARMONICS,
    UnmodelledTorque,
    unmodelled_torque,
)
from torquer.spacecraft.disturbance.user import UserTorque
from torquer.spacecraft.parts import AnyPart


class Torque(NamedTuple):
    """A torque: its spec, its kernel, and the constants with which there is none.

    `depends_on_rate`: it changes with the body's rate, which the splitting integrator excludes;
    `needs_body`: its `pack` takes the body's spec, too.
    """

    spec: type[Spec]
    kernel: Callable
    none: tuple
    depends_on_rate: bool = False
    needs_body: bool = False


#: By key of `[disturbance]`. The unmodelled one stands last: its constants change in flight.
TORQUES = {
    "solar_pressure": Torque(SolarPressure, solar_pressure_torque, NO_SUNLIT_SURFACE),
    "residual_dipole": Torque(ResidualDipole, residual_dipole_torque, NO_DIPOLE),
    "eddy_currents": Torque(EddyCurrents, eddy_current_torque, NO_EDDY_CURRENTS, True),
    "energy_sink": Torque(EnergySink, energy_sink_torque, NO_SINK, True, True),
    "unmodelled": Torque(UnmodelledTorque, unmodelled_torque, NO_HARMONICS),
}


def _packed(torque: Torque, spec, parts, body) -> tuple:
    """Constants of a torque."""
    return spec.pack(parts, body) if torque.needs_body else spec.pack(parts)


class Disturbance(Spec):
    """Disturbance torques besides the gravity gradient (`environment`) and the air (`spacecraft`).

    The effect of a random torque depends on how long it is held: its spectral density is sigma^2
    times that interval.
    """

    constant_torque_n_m: Vector = (0.0, 0.0, 0.0)
    """Constant torque, fixed in the body."""
    random_torque_n_m: float = Field(default=0.0, ge=0.0)
    """Standard deviation about each axis of a random torque."""
    random_hold_s: float | None = Field(default=None, gt=0.0)
    """Time for which the random torque is held before it is drawn again; left out:
    `control.sample_s`.
    """
    solar_pressure: SolarPressure | None = None
    """Solar radiation pressure; left out: none."""
    residual_dipole: ResidualDipole | None = None
    """Residual dipole that varies along the orbit; left out: none."""
    eddy_currents: EddyCurrents | None = None
    """Eddy currents; left out: none."""
    energy_sink: EnergySink | None = None
    """Liquid or a flexible part that damps a nutation from within; left out: none."""
    own: dict[str, UserTorque] = Field(default_factory=dict)
    """Torques of your own under names of your choice."""
    unmodelled: UnmodelledTorque | None = None
    """Torque of unknown nature with harmonics of the orbit; left out: none."""
    suspension: Suspension | None = None
    """Weight and friction on the bearing of a test bench (orbit.kind 'bench'); left out: none."""

    def pack_held(self, hold_steps: int) -> HeldTorque:
        """The constant and the random torque for kernels."""
        constant = as_vector(self.constant_torque_n_m)
        steps = hold_steps if self.random_torque_n_m > 0.0 else FOR_EVER
        return HeldTorque(constant, self.random_torque_n_m, steps)

    def pack(
        self,
        parts: tuple[AnyPart, ...],
        hung: Hung | None = None,
        magnets: Magnets | tuple[()] = (),
        body: Any = None,
    ) -> tuple:
        """Constants of the torques of `TORQUES`, in its order, for kernels; () for none of them.

        `parts`, `body`: of the satellite. One type for all satellites that have any: a loop is
        compiled once.
        `hung`, `magnets`: constants of the suspension and of magnets, which stand before the last:
        they make another type, and what is compiled for other satellites does not know of them.
        """
        given = {name: getattr(self, name) for name in TORQUES}
        rare = (*(() if hung is None else (hung,)), *((magnets,) if magnets else ()))
        if not any(given.values()) and not rare and not self.own:
            return ()
        packed = tuple(
            torque.none if given[name] is None else _packed(torque, given[name], parts, body)
            for name, torque in TORQUES.items()
        )
        return (*packed[:-1], *rare, packed[-1])
