"""What a satellite meets along its orbit: the geomagnetic field, the Sun, the Earth's shadow.

    from torquer.environment import FIELDS, Environment, OrbitEnvironment

`Environment` is the table of a scenario file, `OrbitEnvironment` the environment along one orbit
from one start: position, field, Sun and sunlit fraction of its disc at any time. Models of the
field are in `torquer.environment.field`; the Earth's rotation, gravity and atmosphere in
`torquer.environment.earth`.
"""

from typing import TYPE_CHECKING

from torquer.base.lazy import lazily

if TYPE_CHECKING:
    from torquer.environment.along_orbit import (
        Environment as Environment,
        OrbitEnvironment as OrbitEnvironment,
    )
    from torquer.environment.field import (
        FIELDS as FIELDS,
        Elements as Elements,
        FieldModel as FieldModel,
        at_geodetic as at_geodetic,
        elements as elements,
    )
    from torquer.environment.field.along import (
        FieldsAlong as FieldsAlong,
        angles_deg as angles_deg,
        fields_along as fields_along,
    )
    from torquer.environment.field.at_point import (
        PointField as PointField,
        point_field as point_field,
        yearly_change as yearly_change,
    )
    from torquer.environment.local import LocalEnvironment as LocalEnvironment
    from torquer.environment.sun import (
        ECLIPSES as ECLIPSES,
        Shadow as Shadow,
        find_shadow as find_shadow,
        sun_position as sun_position,
        sunlit_fraction as sunlit_fraction,
    )
    from torquer.environment.table import (
        ProvenTable as ProvenTable,
        Table as Table,
        build_proven as build_proven,
    )

__getattr__, __dir__, __all__ = lazily(__name__, __file__)
