"""Atmospheric density models, one per kind.

Every one is a frozen spec with `density(t_s, start_utc, r_ecef_m) -> [n] kg/m^3`; those that
compile also have `pack()`, which `torquer.environment.earth.atmosphere.air.density` takes.
"""

from typing import Annotated, Union

from pydantic import Field

from torquer.environment.earth.atmosphere.exponential import Exponential
from torquer.environment.earth.atmosphere.gost import Gost, mean_f107
from torquer.environment.earth.atmosphere.nrlmsis import Nrlmsis

#: Every density model by its `kind`.
ATMOSPHERES = {"gost": Gost, "exponential": Exponential, "nrlmsis": Nrlmsis}

#: Any density model, discriminated by `kind`.
AnyAtmosphere = Annotated[
    Union[tuple(ATMOSPHERES.values())],  # noqa: UP007
    Field(discriminator="kind"),
]

__all__ = ["ATMOSPHERES", "AnyAtmosphere", "Exponential", "Gost", "Nrlmsis", "mean_f107"]
