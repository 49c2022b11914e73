"""Orbits: position and velocity of the satellite. One entry per kind.

Every orbit is a frozen spec with `state(t_s, start_utc, dut1_s) -> r_m [n, 3], v_m_s [n, 3]` in
the inertial frame that its `frame` names, `rate_rad_s(start_utc)` and `period_s`. `dut1_s`, UT1 -
UTC at the start, matters for numerical orbits only, whose forces depend on the Earth's rotation.

    >>> torquer.ORBITS["circular"](altitude_km=550, inclination_deg=97.6).altitude_km
    550.0
"""

from typing import Annotated

from pydantic import Field

from torquer.base.spec import by_kind
from torquer.environment.orbit.bench import Bench
from torquer.environment.orbit.circular import Circular
from torquer.environment.orbit.drifting import Drifting
from torquer.environment.orbit.from_file import FileOrbit
from torquer.environment.orbit.kepler import Kepler
from torquer.environment.orbit.numerical import Numerical
from torquer.environment.orbit.sgp4 import Sgp4
from torquer.environment.orbit.user import UserOrbit

_Orbits = Circular | Kepler | Drifting | Sgp4 | Numerical | FileOrbit | UserOrbit | Bench

#: Every orbit by its `kind`.
ORBITS = by_kind(_Orbits)

#: Any orbit, discriminated by `kind`.
AnyOrbit = Annotated[_Orbits, Field(discriminator="kind")]

__all__ = [
    "ORBITS",
    "AnyOrbit",
    "Bench",
    "Circular",
    "Drifting",
    "FileOrbit",
    "Kepler",
    "Numerical",
    "Sgp4",
    "UserOrbit",
]
