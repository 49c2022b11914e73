"""Atmospheric density models, one per kind.

Every one is a frozen spec with `density(t_s, start_utc, r_ecef_m) -> [n] kg/m^3`; those that
compile also have `pack()`, which `torquer.environment.earth.atmosphere.air.density` takes.
"""

from typing import Annotated

from pydantic import Field

from torquer.base.spec import by_kind
from torquer.environment.earth.atmosphere.exponential import Exponential
from torquer.environment.earth.atmosphere.gost import Gost, mean_f107
from torquer.environment.earth.atmosphere.nrlmsis import Nrlmsis
from torquer.environment.earth.atmosphere.user import UserAtmosphere

_Atmospheres = Gost | Exponential | Nrlmsis | UserAtmosphere

#: Every density model by its `kind`.
ATMOSPHERES = by_kind(_Atmospheres)

#: Any density model, discriminated by `kind`.
AnyAtmosphere = Annotated[_Atmospheres, Field(discriminator="kind")]

__all__ = [
    "ATMOSPHERES",
    "AnyAtmosphere",
    "Exponential",
    "Gost",
    "Nrlmsis",
    "UserAtmosphere",
    "mean_f107",
]
