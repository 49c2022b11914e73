# ruff: noqa: F401 (the imports under TYPE_CHECKING are the list of public names)
"""What a satellite meets along its orbit: the geomagnetic field, the Sun, the Earth's shadow.

    from torquer.environment import FIELDS, Environment, OrbitEnvironment

`Environment` is the table of a scenario file, `OrbitEnvironment` the same along one orbit from one
start: position, field, Sun and lit fraction at any time. Models of the field are in
`torquer.environment.field`; the Earth's rotation, gravity and atmosphere in `torquer.earth`.
"""

from typing import TYPE_CHECKING

from torquer.lazy import lazily

if TYPE_CHECKING:
    from torquer.environment.along_orbit import Environment, OrbitEnvironment
    from torquer.environment.field import FIELDS, Elements, FieldModel, at_geodetic, elements
    from torquer.environment.field.along import FieldsAlong, angles_deg, fields_along
    from torquer.environment.field.at_point import PointField, point_field, yearly_change
    from torquer.environment.local import LocalEnvironment
    from torquer.environment.sun import ECLIPSES, Shadow, lit_fraction, shadow_of, sun_position
    from torquer.environment.table import ProvenTable, Table, build_proven

__getattr__, __dir__, __all__ = lazily(__name__, __file__)
