"""The geomagnetic field at places, over the globe, along an orbit, as a cone; field lines.

    from torquer.analysis.field import FieldPointRequest, field_point

    field_point(FieldPointRequest(lat=55.75, lon=37.62, alt_km=550.0, date="2025-07-01")).data()

Each question is a request, whose numbers are checked when it is made, and a function: `torquer
field point | map | orbit | cone` asks the same ones. What has a value at each place or time is an
`xarray.Dataset` with units; `torquer.report.field` draws it.
"""

from typing import TYPE_CHECKING

from torquer.base.lazy import lazily

if TYPE_CHECKING:
    from torquer.analysis.field.cone import (
        ConeShape as ConeShape,
        cone_in as cone_in,
        field_cone as field_cone,
    )
    from torquer.analysis.field.globe import (
        dip_poles as dip_poles,
        extremes as extremes,
        field_map as field_map,
    )
    from torquer.analysis.field.lines import field_lines as field_lines
    from torquer.analysis.field.orbit import field_orbit as field_orbit
    from torquer.analysis.field.point import (
        FieldPoint as FieldPoint,
        field_point as field_point,
        field_points as field_points,
    )
    from torquer.analysis.field.requests import (
        FieldConeRequest as FieldConeRequest,
        FieldMapRequest as FieldMapRequest,
        FieldOrbitRequest as FieldOrbitRequest,
        FieldPointRequest as FieldPointRequest,
    )

__getattr__, __dir__, __all__ = lazily(__name__, __file__)
