"""Elements of the field on a grid over the globe: extremes and dip poles."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from torquer.environment.field.globe import Elements, at_geodetic, elements


@dataclass(frozen=True)
class FieldMap:
    """Elements `[lat, lon]` on a grid of degrees that includes both poles and both 180 deg."""

    lat_deg: np.ndarray
    lon_deg: np.ndarray
    found: Elements

    @staticmethod
    def unit_of(element: str) -> str:
        """Unit of an element: 'deg' or 'nT'."""
        return "deg" if element in ("D", "I") else "nT"

    def values(self, element: str) -> np.ndarray:
        """An element `[lat, lon]` in its unit."""
        return getattr(self.found, f"{element.lower()}_{self.unit_of(element).lower()}")

    def extremes(self, element: str) -> dict:
        """Minimum and maximum on the grid with their positions."""
        values = self.values(element)
        return {
            name: self._at(values, np.unravel_index(pick(values), values.shape))
            for name, pick in (("least", np.argmin), ("greatest", np.argmax))
        }

    def _at(self, values, cell) -> dict:
        return {
            "value": float(values[cell]),
            "latitude_deg": float(self.lat_deg[cell[0]]),
            "longitude_deg": float(self.lon_deg[cell[1]]),
        }

    @cached_property
    def dips(self) -> tuple[tuple[float, float], ...]:
        """Latitude and longitude of the dip poles, north and south, where H is smallest."""
        half = self.lat_deg >= 0.0
        found = []
        for side in (half, ~half):
            h = np.where(side[:, None], self.found.h_nt, np.inf)
            row, column = np.unravel_index(np.argmin(h), h.shape)
            found.append((float(self.lat_deg[row]), float(self.lon_deg[column])))
        return tuple(found)


def field_map(model, decimal_year: float, alt_km: float, step_deg: float = 1.0) -> FieldMap:
    """The elements over the globe at a height above the ellipsoid; `step_deg` divides 180."""
    lat = np.linspace(-90.0, 90.0, round(180.0 / step_deg) + 1)
    lon = np.linspace(-180.0, 180.0, round(360.0 / step_deg) + 1)
    b = at_geodetic(model, decimal_year, lat[:, None], lon[None, :], alt_km)
    return FieldMap(lat, lon, elements(b))
