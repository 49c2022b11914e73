"""The variables of a result: dimensions, unit, frame, meaning, and the record that each is read in.

Results take their attributes from this table, and `docs/variables.md` is made from it.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from torquer.computer.interface import GYRO, SENSORS
from torquer.spacecraft.sensors.device import MOST_PARTS, XYZ, XYZW, Device
from torquer.spacecraft.sensors.devices import DEVICES, Flown

_PARTS: dict[str, Iterable[str]] = {"component": "xyzw", "axis": "xyz"}
#: Numbers in a row of other dimensions.
_COUNTS = {"sensor": len(SENSORS), "cell": MOST_PARTS}
#: Where numbers stand in a record: its field, and the place in the field where that holds several.
Cell = tuple[Any, ...]


class Variable(NamedTuple):
    """A variable of a result."""

    name: str
    dims: tuple[str, ...]
    """() for a single number"""
    units: str
    frame: str
    meaning: str
    key: str = ""
    """name in the record that it is read from; "" if it is computed"""
    when: str = ""
    """which results have it; "" for all"""
    row: int | None = None
    """row of the field `key` that it is read from, of a field with a row for each sensor"""
    width: int = 0
    """numbers in a row of it, where its dimension does not say; else 0"""

    @property
    def attributes(self) -> dict[str, str]:
        """Attributes of the variable in a Dataset: those that are not empty."""
        given = {"units": self.units, "frame": self.frame, "long_name": self.meaning}
        return {name: text for name, text in given.items() if text}

    @property
    def cells(self) -> list[Cell]:
        """Where its numbers stand in the record."""
        last = self.dims[-1] if self.dims[1:] else ""
        if self.row is not None:
            first = (self.key, self.row)
            return [(*first, k) for k in range(self.size)] if last else [first]
        if last in _PARTS:
            return [(f"{self.key}_{c}",) for c in _PARTS[last]]
        return [(self.key, k) for k in range(self.size)] if last else [(self.key,)]

    @property
    def size(self) -> int:
        """Numbers in a row of it."""
        last = self.dims[-1]
        if self.width:
            return self.width
        return len(tuple(_PARTS[last])) if last in _PARTS else _COUNTS.get(last, 1)


_TIME, _XYZ, _XYZW = ("time",), ("time", "axis"), ("time", "component")
_WHEEL = ("time", "wheel")
_WHEELS = "with reaction wheels"
_ESTIMATE = "with an estimator other than the sensors themselves, or a law that states an estimate"
_INPUTS = "with `simulation.record_inputs`"
_AUTO = "with adaptive steps"
_RK4 = "with RK4"
_MODES = "with modes or a scheme"
_BELIEVED = "with `control.ephemeris` other than the truth"


def _only(when: str, *variables: Variable) -> tuple[Variable, ...]:
    """Variables that the same results have."""
    return tuple(each._replace(when=when) for each in variables)


#: Devices whose readings are in every result, by the symbols of their variables.
RECORDED_READINGS = ("b", "omega", "sun")
_DIMS = {XYZ: _XYZ, XYZW: _XYZW}


def _reading(device: Device, key: str = "readings") -> Variable:
    """The last reading of a device: read from `KNOWN`, or by `key` from another record."""
    name, dims = f"{device.symbol}_measured", _DIMS.get(device.parts, ("time", "cell"))
    row = DEVICES.index(device) if key == "readings" else None
    return Variable(name, dims, device.units, device.frame, device.meaning, key, row=row)


def _time_of(device: Device) -> Variable:
    """When a device was read last, from `KNOWN`."""
    meaning = f"time of the last reading of the {device.said}"
    row = DEVICES.index(device)
    return Variable(f"{device.symbol}_time", _TIME, "s", "", meaning, "read_s", row=row)


#: Readings and times of all devices, as they stand in `KNOWN`, by the names of their variables.
KNOWN_READINGS = {
    each.name: each for device in DEVICES for each in (_reading(device), _time_of(device))
}
# fmt: off
COORDINATES = (
    Variable("time", _TIME, "s", "", "time since the start"),
    Variable("utc", _TIME, "", "", "the same instants in UTC (datetime64)"),
    Variable("axis", ("axis",), "", "", "x, y, z"),
    Variable("component", ("component",), "", "", "x, y, z, w of a quaternion, scalar last"),
    Variable("wheel", ("wheel",), "", "", "number of a wheel, from 0, in the order of the layout",
             when=_WHEELS),
    Variable("sensor", ("sensor",), "", "", "names of the sensors, as conditions have them",
             when=_ESTIMATE),
    Variable("mode", ("mode",), "", "", "names of the states, REGION.STATE", when=_MODES),
)
#: Read from `ROW`.
RECORDED = (
    Variable("q_body_to_inertial", _XYZW, "1", "body to J",
             "true attitude quaternion: takes body components to inertial ones", "q"),
    Variable("omega_body", _XYZ, "rad/s", "body", "true absolute angular velocity", "omega"),
    Variable("dipole_body", _XYZ, "A m^2", "body",
             "dipole of the coils, residual dipole included, as it acts", "dipole"),
    Variable("command_body", _XYZ, "A m^2", "body", "dipole that the computer commanded last",
             "command"),
    *(_reading(device, f"{device.symbol}_measured") for device in DEVICES
      if device.symbol in RECORDED_READINGS),
)
#: Read from `ROW` where there are wheels.
TORQUE = Variable(
    "torque_command_body", _XYZ, "N m", "body",
    "torque on the body that the computer commanded the wheels to give last", "torque", _WHEELS,
)
#: Read from `KNOWN`.
ESTIMATED = _only(_ESTIMATE,
    Variable("q_estimated", _XYZW, "1", "body to J", "estimated attitude quaternion", "estimate_q"),
    Variable("omega_estimated", _XYZ, "rad/s", "body", "estimated angular velocity",
             "estimate_omega"),
    Variable("gyro_bias_estimated", _XYZ, "rad/s", "body",
             "estimated bias of the gyro; NaN where none is estimated", "estimate_bias"),
    Variable("estimate_time", _TIME, "s", "", "time to which the estimate applies", "estimate_s"),
    Variable("attitude_sigma", _TIME, "rad", "body",
             "standard deviation of the attitude that the estimator states", "sigma_rad"),
    Variable("rate_sigma", _TIME, "rad/s", "body",
             "standard deviation of the rate that the estimator states", "sigma_rad_s"),
    Variable("isolated", ("time", "sensor"), "1", "",
             "1 while the estimator judges a sensor's readings to be wrong, else 0", "isolated"),
)
#: Read from `KNOWN` where all that the computer knows is recorded.
INPUTS = _only(_INPUTS,
    *(_reading(device) for device in DEVICES if device.symbol not in RECORDED_READINGS),
    *map(_time_of, DEVICES),
    Variable("control_time", _TIME, "s", "", "time of the last control step", "t_s"),
    Variable("coil_dipole_on_board", _XYZ, "A m^2", "body",
             "mean dipole of the coils between the last two control steps, as the computer "
             "believes", "coils"),
    Variable("position_on_board", _XYZ, "m", "J", "position that the computer assumes", "position"),
    Variable("velocity_on_board", _XYZ, "m/s", "J", "velocity that the computer assumes",
             "velocity"),
    Variable("b_on_board", _XYZ, "T", "J", "field by the computer's model", "model_b"),
    Variable("b_rate_on_board", _XYZ, "T/s", "J",
             "rate of change of the model's field along the orbit", "model_b_rate"),
    Variable("sun_on_board", _XYZ, "1", "J", "direction to the Sun that the computer assumes",
             "to_sun"),
    Variable("sunlit_fraction_on_board", _TIME, "1", "",
             "visible part of the Sun's disc that the computer assumes", "sunlit_fraction"),
)
#: Of a satellite with several gyros, read from `KNOWN`.
_GYRO_UNITS = Variable("gyro_units", _TIME, "1", "", "which of several gyros the rate that laws "
                       "read is of: the sum of 1, 2, 4 and so on, in their order", "gyro_units",
                       when=_INPUTS)
#: Read from `CELLS` at the end.
COILS = (
    Variable("coil_energy", (), "J", "",
             "electrical energy of the coils; if no power is given, for 1 W of each at its limit",
             "coil_energy_j"),
    Variable("peak_coil_dipole", (), "A m^2", "", "greatest dipole of a coil in the whole run",
             "peak_dipole_a_m2"),
)
#: Read from `CELLS` at the end of a run with adaptive steps.
ADAPTIVE = (
    Variable("integration_error", (), "rad", "",
             "attitude error at the end: sum of the steps' estimates", "error_rad", _AUTO),
    Variable("steps", (), "1", "", "number of integration steps", "steps", _AUTO),
    Variable("least_step", (), "s", "", "shortest integration step; NaN: none",
             "least_step_s", _AUTO),
)
#: Read from `CELLS` at the end of a run with RK4.
FIXED = (
    Variable("rk4_lag", (), "rad", "", "approximate phase lag of the rotation due to the steps",
             "lag", _RK4),
)
COMPUTED = (
    Variable("omega_orbital", _XYZ, "rad/s", "body",
             "angular velocity relative to the orbital frame"),
    Variable("momentum_inertial", _XYZ, "N m s", "J", "angular momentum of body and wheels"),
    Variable("b_body", _XYZ, "T", "body", "true geomagnetic field"),
    Variable("b_inertial", _XYZ, "T", "J", "true geomagnetic field"),
    Variable("position_inertial", _XYZ, "m", "J", "position from the Earth's centre"),
    Variable("velocity_inertial", _XYZ, "m/s", "J", "velocity"),
    Variable("sun_inertial", _XYZ, "1", "J", "direction to the Sun, also in eclipse"),
    Variable("sunlit_fraction", _TIME, "1", "", "visible part of the Sun's disc: 0 in the umbra"),
    Variable("position_believed", _XYZ, "m", "J", "position by the models on board",
             when=_BELIEVED),
    Variable("b_believed", _XYZ, "T", "J",
             "geomagnetic field by the models on board, at the position that they give",
             when=_BELIEVED),
    Variable("latitude", _TIME, "deg", "", "geodetic latitude, WGS84"),
    Variable("longitude", _TIME, "deg", "", "longitude, east positive"),
    Variable("altitude", _TIME, "m", "", "height above the ellipsoid WGS84"),
    Variable("wheel_momentum", _WHEEL, "N m s", "wheel axis",
             "momentum of each wheel relative to the body", when=_WHEELS),
    Variable("wheel_speed", _WHEEL, "rad/s", "wheel axis",
             "speed of each wheel relative to the body", when=_WHEELS),
    Variable("wheel_torque", _WHEEL, "N m", "wheel axis", "commanded torque of each motor",
             when=_WHEELS),
    Variable("mode_REGION", _TIME, "", "",
             "state of a region, as a number; names in the attribute `flag_meanings`; -1: none",
             when=_MODES),
    Variable("mode_entered", ("mode",), "s", "",
             "time at which each state was entered last; NaN: never", when=_MODES),
    Variable("mode_entries", ("mode",), "1", "", "how often each state was entered", when=_MODES),
    Variable("mean_step", (), "s", "", "mean integration step; NaN: none", when=_AUTO),
    Variable("rk4_damping", (), "1", "",
             "fraction of the nutation or libration amplitude damped by the steps, at most",
             when=_RK4),
    Variable("checkpoint", ("checkpoint_cell",), "", "",
             "internal state of the loop, from which the run can be resumed"),
)
# fmt: on
VARIABLES = (*RECORDED, *COMPUTED, TORQUE, *ESTIMATED, *INPUTS, *COILS, *ADAPTIVE, *FIXED)
_BY_NAME = {each.name: each for each in (*COORDINATES, *VARIABLES)}

#: Logs: their names, dimensions and units are those that laws and estimators declare.
LOGS = (
    "What laws and estimators log is recorded as `KEY.NAME` over `time` (vectors over `time`, "
    "`axis`; other vectors and matrices over dimensions of their own), by the name in their `log`, "
    "with the unit given there. Filters with `record_covariance` log their `states` over `time` "
    "and `KEY.state`, and the `covariance` of their errors over `time`, `KEY.error` and "
    "`KEY.other_error`; these coordinates hold names such as `gyro_bias_x`, and `KEY.state_units`, "
    "`KEY.error_units` their units."
)

ATTRIBUTES = {
    "scenario": "the whole scenario that was flown, as JSON; `torquer.Scenario` reads it",
    "laws": "laws and estimators as JSON: name, parameters, text, how flown; `torquer.flown_laws`",
    "seed": "seed of all random numbers",
    "how_it_ended": "complete, stopped, interrupted or failed",
    "ended": "how the run ended in full, with the time and the reason",
    "ended_by": "the condition `simulation.end_when` that ended the run before its time, in words",
    "versions": "versions of torquer, Python and the libraries that the bits depend on, as JSON",
    "processor": "kind of processor that the code was compiled for",
    "table_relative_error": "proven bound on the relative error of the tabulated environment",
    "conventions": "frames and units in short",
    "digest": "SHA-256 of the data from which a run is resumed",
}


def describe(values: Mapping[str, Any]) -> dict:
    """Values by the names of variables, as xarray takes them: with dimensions and attributes."""
    return {name: (_BY_NAME[name].dims, each, _BY_NAME[name].attributes)
            for name, each in values.items()}  # fmt: skip


def column(record: np.ndarray, cell: Cell) -> np.ndarray:
    """A number of a record at all its rows, to read or to write."""
    return record[cell[0]][(slice(None), *cell[1:])]


def read(record: np.ndarray, variables: Iterable[Variable]) -> dict:
    """Variables from the rows of a record, as xarray takes them."""
    found = {}
    for each in variables:
        c = np.array([column(record, cell) for cell in each.cells])
        found[each.name] = each.dims, c.T if len(c) > 1 else c[0], each.attributes
    return found


def estimated(units: Sequence[Flown]) -> tuple[Variable, ...]:
    """`ESTIMATED`, of a satellite that has several devices of a kind."""
    count = len(SENSORS) + len(units)
    return tuple(
        each._replace(width=count) if each.dims[1:] == ("sensor",) else each for each in ESTIMATED
    )


def inputs(units: Sequence[Flown]) -> tuple[Variable, ...]:
    """`INPUTS`, and of each of several devices of a kind the last reading and its time."""
    found = list(INPUTS)
    for each in units:
        device, name = each.device, f"{each.device.several}.{each.name}"
        own = (device.units, device.frame, f"{device.meaning}, of {each.name}", "readings")
        dims = _DIMS.get(device.parts, ("time", "cell"))
        found.append(Variable(name, dims, *own, _INPUTS, each.row))
        when = f"time of the last reading of the {device.said} {each.name}"
        found.append(Variable(f"{name}.time", _TIME, "s", "", when, "read_s", _INPUTS, each.row))
    if any(each.device.integrates or each.device is DEVICES[GYRO] for each in units):
        found.append(_GYRO_UNITS)
    return tuple(found)


def write(result, variables: Iterable[Variable], record: np.ndarray, rows) -> None:
    """Write variables of a result back into rows of a record."""
    for each in variables:
        values = result[each.name].values
        values = values[:, None] if values.ndim == 1 else values
        for k, cell in enumerate(each.cells):
            column(record, cell)[rows] = values[:, k]
