"""The quantities that telemetry may hold: the names, frames and units of a simulated result.

A session is an `xarray.Dataset` with the coordinates `time` [s since the first row] and `utc`
(datetime64[ns]); every variable of `QUANTITIES` is optional, a number that is missing is NaN.
"""

from typing import NamedTuple

import numpy as np
import xarray as xr

from torquer.ground.telemetry.reading.positions import FORMS
from torquer.simulation.results.variables import VARIABLES
from torquer.spacecraft.sensors.device import MOST_PARTS
from torquer.spacecraft.sensors.devices import DEVICES

_KNOWN = {each.name: each for each in VARIABLES}
_DIMENSIONS: dict[str, list] = {
    "axis": list("xyz"),
    "component": list("xyzw"),
    "cell": list(range(MOST_PARTS)),
}


class Quantity(NamedTuple):
    """What a variable of a session is: its dimension ("" for a single number), unit and frame."""

    dimension: str
    units: str
    frame: str
    meaning: str

    @property
    def size(self) -> int:
        """Numbers in a row."""
        return len(_DIMENSIONS[self.dimension]) if self.dimension else 1


def _as_in_results(name: str) -> Quantity:
    known = _KNOWN[name]
    return Quantity("".join(known.dims[1:]), known.units, known.frame, known.meaning)


_AS_IN_RESULTS = (
    *(f"{device.symbol}_measured" for device in DEVICES),
    *("dipole_body", "coil_dipole_on_board", "sunlit_fraction"),
)
#: Every variable of a session by its name.
QUANTITIES: dict[str, Quantity] = {
    **{name: _as_in_results(name) for name in _AS_IN_RESULTS},
    "temperature": Quantity("", "K", "", "temperature of the magnetometer"),
    "position_j": Quantity("axis", "m", "J", "position from the Earth's centre"),
    "velocity_j": Quantity("axis", "m/s", "J", "velocity"),
}
#: What columns of a file may hold: the quantities, and positions in other forms.
COLUMNS: dict[str, Quantity] = QUANTITIES | {
    name: Quantity("axis", "m", "", form.meaning) for name, form in FORMS.items()
}
#: Numbers [SI] that no sensor sends, whatever its unit was taken for.
ABSURD = 1e12
#: Names of results that sessions have under another name.
RENAMED = {"position_inertial": "position_j", "velocity_inertial": "velocity_j"}

#: Factors of units by the unit of the package, and what is added after it.
UNITS: dict[str, dict[str, float]] = {
    "T": {"T": 1.0, "mT": 1e-3, "uT": 1e-6, "nT": 1e-9, "G": 1e-4, "mG": 1e-7},
    "rad": {"rad": 1.0, "mrad": 1e-3, "deg": np.pi / 180.0, "arcsec": np.pi / 648e3},
    "T/s": {"T/s": 1.0, "uT/s": 1e-6, "nT/s": 1e-9},
    "rad/s": {
        "rad/s": 1.0, "mrad/s": 1e-3, "deg/s": np.pi / 180.0, "mdeg/s": np.pi / 180e3,
        "deg/h": np.pi / 648e3, "rpm": np.pi / 30.0,
    },
    "A m^2": {"A m^2": 1.0, "mA m^2": 1e-3},
    "N m s": {"N m s": 1.0, "mN m s": 1e-3},
    "m": {"m": 1.0, "km": 1e3},
    "m/s": {"m/s": 1.0, "km/s": 1e3},
    "K": {"K": 1.0, "degC": 1.0},
    "1": {"1": 1.0, "%": 0.01},
}  # fmt: skip
_OFFSETS = {"degC": 273.15}
#: Other spellings of units.
SPELLINGS = {
    "µT": "uT", "μT": "uT", "nanotesla": "nT", "microtesla": "uT", "tesla": "T",
    "gauss": "G", "Gs": "G", "dps": "deg/s", "°/s": "deg/s", "deg_s": "deg/s", "rad_s": "rad/s",
    "Am2": "A m^2", "A*m^2": "A m^2", "A m2": "A m^2", "A m²": "A m^2", "Am^2": "A m^2",
    "mAm2": "mA m^2", "Nms": "N m s", "mNms": "mN m s",
    "Am²": "A m^2", "A·m²": "A m^2", "A.m2": "A m^2", "A-m^2": "A m^2", "A·m^2": "A m^2",
    "mA m2": "mA m^2", "mA m²": "mA m^2", "nt": "nT", "ut": "uT", "Gauss": "G", "mgauss": "mG",
    "mGauss": "mG", "Tesla": "T", "degree/s": "deg/s", "degrees/s": "deg/s",
    "rad/sec": "rad/s", "deg/sec": "deg/s",
    "нТл": "nT", "мкТл": "uT", "Тл": "T", "Гс": "G", "град/с": "deg/s", "рад/с": "rad/s",  # noqa: RUF001
    "км": "km", "м": "m", "м/с": "m/s", "км/с": "km/s",  # noqa: RUF001
    "deg_C": "degC", "celsius": "degC", "Kelvin": "K", "kelvin": "K",
    "°C": "degC", "C": "degC", "Celsius": "degC", "": "1",
}  # fmt: skip


def parse_unit(text: str) -> str:
    """The unit in the spelling of `UNITS`, whatever the spelling received."""
    return SPELLINGS.get(text.strip(), text.strip())


def units_for(name: str) -> list[str]:
    """The units that a quantity may have."""
    return list(UNITS[COLUMNS[name].units])


def in_si(name: str, unit: str, values: np.ndarray) -> np.ndarray:
    """Values [n] or [n, k] of a quantity in the unit of the package."""
    factor = UNITS[COLUMNS[name].units][unit]
    if name == "position_geodetic":  # the unit is the height's
        return values * [1.0, 1.0, factor]
    return factor * values + _OFFSETS.get(unit, 0.0)


def make_session(utc: np.ndarray, values: dict[str, np.ndarray], **attributes: str) -> xr.Dataset:
    """A session of UTC stamps (datetime64[ns], ascending) [n] and values by name, SI.

    ValueError for names that no quantity has, shapes that do not fit, stamps that descend.
    """
    utc = np.asarray(utc, dtype="datetime64[ns]")
    if len(utc) and np.any(np.diff(utc) < np.timedelta64(0)):
        raise ValueError("utc: must ascend; received stamps that go back")
    time = (utc - utc[:1]) / np.timedelta64(1, "s")
    variables: dict[str, tuple] = {}
    dimensions: set[str] = set()
    for name, given in values.items():
        if name not in QUANTITIES:
            raise ValueError(f"{name}: must be one of {', '.join(QUANTITIES)}; received {name!r}")
        quantity = QUANTITIES[name]
        shape = (len(utc), quantity.size) if quantity.dimension else (len(utc),)
        if np.shape(given) != shape:
            raise ValueError(f"{name}: must have shape {shape}; received {np.shape(given)}")
        dims = ("time", quantity.dimension) if quantity.dimension else ("time",)
        about = {"units": quantity.units, "frame": quantity.frame, "long_name": quantity.meaning}
        about = {key: text for key, text in about.items() if text}
        variables[name] = (dims, np.asarray(given, dtype=float), about)
        dimensions.update(dims[1:])
    coordinates = {
        "time": ("time", time, {"units": "s", "long_name": "time since the first row"}),
        "utc": ("time", utc, {"long_name": "UTC"}),
        **{name: _DIMENSIONS[name] for name in sorted(dimensions)},
    }
    return xr.Dataset(variables, coordinates, attributes)
