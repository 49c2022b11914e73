"""Geomagnetic field models, one interface (`torquer.environment.field.model.FieldModel`).

IGRF-14 and WMM2025 (the field at a place and date), tilted dipole (the Earth's daily rotation),
direct dipole (the uneven rotation along the orbit), averaged (the field that theory can integrate).
"""

from typing import Annotated

from pydantic import Field

from torquer.environment.field.averaged import Averaged
from torquer.environment.field.direct_dipole import DirectDipole
from torquer.environment.field.gauss import Gauss, Igrf14, Wmm2025
from torquer.environment.field.globe import Elements, at_geodetic, elements
from torquer.environment.field.helmholtz_coils import HelmholtzCoils
from torquer.environment.field.model import FieldModel
from torquer.environment.field.tilted_dipole import TiltedDipole

#: Every field model by its `kind`.
FIELDS = {
    "igrf14": Igrf14,
    "wmm2025": Wmm2025,
    "tilted_dipole": TiltedDipole,
    "direct_dipole": DirectDipole,
    "averaged": Averaged,
    "helmholtz_coils": HelmholtzCoils,
}

#: Any field model, discriminated by `kind`.
AnyField = Annotated[
    Igrf14 | Wmm2025 | TiltedDipole | DirectDipole | Averaged | HelmholtzCoils,
    Field(discriminator="kind"),
]

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
    "Wmm2025",
    "at_geodetic",
    "elements",
]
