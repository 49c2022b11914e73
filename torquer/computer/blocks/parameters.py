"""What numbers of parameters may be, where no key of its own says so: types of their fields.

A parameter of a law or estimator of the package that follows from several keys, or in no proportion
to one, has one of these in its `NamedTuple`. For a tuple the limits are those of each number in it.
"""

from typing import Annotated

from torquer.base.validate import quantity_range
from torquer.computer.blocks.limits import FREE, Limits

_POSITIVE = Limits(0.0, above=1)
_INERTIA = quantity_range("inertia_kg_m2")
_MOMENTUM = quantity_range("momentum_n_m_s")[1]
Positive = Annotated[float, _POSITIVE]
#: A size, a variance; of what may be left out, 0 is none.
NotNegative = Annotated[float, Limits(0.0)]
#: 1 or 0.
OnOff = Annotated[float, Limits(0.0, 1.0)]
Share = Annotated[float, Limits(0.0, 1.0)]
Cosine = Annotated[float, Limits(-1.0, 1.0)]
#: A unit vector or an attitude's quaternion: its numbers are set one by one, so that only the last
#: one makes the length 1 again.
UnitNumbers = Annotated[tuple, Limits(-1.0, 1.0)]
#: Inertia (xx, yy, zz, xy, xz, yz) [kg m^2] and momentum [N m s] have the ranges that keys have.
InertiaNumbers = Annotated[
    tuple, (Limits(*_INERTIA),) * 3 + (Limits(-_INERTIA[1], _INERTIA[1]),) * 3
]
InverseInertiaNumbers = Annotated[tuple, (_POSITIVE,) * 3 + (FREE,) * 3]
MomentumNumbers = Annotated[tuple, Limits(-_MOMENTUM, _MOMENTUM)]
#: Either sign and any size has a meaning.
AnyNumber = Annotated[float, FREE]
AnyNumbers = Annotated[tuple, FREE]
