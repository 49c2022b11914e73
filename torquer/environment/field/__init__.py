"""Geomagnetic field models, one interface (`torquer.environment.field.model.FieldModel`).

IGRF-14 and WMM2025 (the field at a place and date), tilted dipole (the Earth's daily rotation),
direct dipole (the uneven rotation along the orbit), averaged (the field that theory can integrate).

    >>> "igrf14" in torquer.FIELDS
    True
"""

from typing import Annotated

from pydantic import Field

from torquer.base.spec import by_kind
from torquer.environment.field.averaged import Averaged
from torquer.environment.field.direct_dipole import DirectDipole
from torquer.environment.field.gauss import Gauss, Igrf14, Wmm2025
from torquer.environment.field.globe import Elements, at_geodetic, elements
from torquer.environment.field.helmholtz_coils import HelmholtzCoils
from torquer.environment.field.model import FieldModel
from torquer.environment.field.tilted_dipole import TiltedDipole
from torquer.environment.field.user import UserField

_Fields = Igrf14 | Wmm2025 | TiltedDipole | DirectDipole | Averaged | HelmholtzCoils | UserField

#: Every field model by its `kind`.
FIELDS = by_kind(_Fields)

#: Any field model, discriminated by `kind`.
AnyField = Annotated[_Fields, Field(discriminator="kind")]

__all__ = [
    "FIELDS",
    "AnyField",
    "Averaged",
    "DirectDipole",
    "Elements",
    "FieldModel",
    "Gauss",
    "HelmholtzCoils",
    "Igrf14",
    "TiltedDipole",
    "UserField",
    "Wmm2025",
    "at_geodetic",
    "elements",
]
