"""Every variable and attribute of a result, described: the source of `docs/variables.md`.

A test compares dimensions, units and frames with those of results, and finds what is missing.
"""

from typing import NamedTuple


class Variable(NamedTuple):
    """A variable of a result; `dims` in words of xarray, "" for a single number."""

    name: str
    dims: str
    units: str
    frame: str
    meaning: str
    when: str = ""
    """Which results have it; "" for all."""


_XYZ = "time, axis"
_WHEELS = "with reaction wheels"
_ESTIMATE = "with an estimator other than the sensors themselves"
_AUTO = "with adaptive steps"
_RK4 = "with RK4"
_MODES = "with modes or a scheme"

COORDINATES = (
    Variable("time", "time", "s", "", "time since the start"),
    Variable("utc", "time", "", "", "the same instants in UTC (datetime64)"),
    Variable("axis", "axis", "", "", "x, y, z"),
    Variable("component", "component", "", "", "x, y, z, w of a quaternion, scalar last"),
    Variable(
        "wheel", "wheel", "", "", "number of a wheel, from 0, in the order of the layout", _WHEELS
    ),
    Variable("mode", "mode", "", "", "names of the states, REGION.STATE", _MODES),
)

VARIABLES = (
    Variable(
        "q_body_to_inertial",
        "time, component",
        "1",
        "body to J",
        "true attitude quaternion: takes body components to inertial ones",
    ),
    Variable("omega_body", _XYZ, "rad/s", "body", "true absolute angular velocity"),
    Variable(
        "omega_orbital", _XYZ, "rad/s", "body", "angular velocity relative to the orbital frame"
    ),
    Variable("momentum_inertial", _XYZ, "N m s", "J", "angular momentum of body and wheels"),
    Variable(
        "dipole_body",
        _XYZ,
        "A m^2",
        "body",
        "dipole of the coils, residual dipole included, as it acts",
    ),
    Variable("command_body", _XYZ, "A m^2", "body", "dipole that the computer commanded last"),
    Variable("b_body", _XYZ, "T", "body", "true geomagnetic field"),
    Variable("b_inertial", _XYZ, "T", "J", "true geomagnetic field"),
    Variable("b_measured", _XYZ, "T", "body", "last magnetometer reading"),
    Variable("omega_measured", _XYZ, "rad/s", "body", "last gyro reading"),
    Variable(
        "sun_measured",
        _XYZ,
        "1",
        "body",
        "last reading of the Sun sensors, a unit vector; zeros where the Sun is not seen",
    ),
    Variable("position_inertial", _XYZ, "m", "J", "position from the Earth's centre"),
    Variable("velocity_inertial", _XYZ, "m/s", "J", "velocity"),
    Variable("sun_inertial", _XYZ, "1", "J", "direction to the Sun, also in eclipse"),
    Variable("lit", "time", "1", "", "visible part of the Sun's disc: 0 in the umbra"),
    Variable("latitude", "time", "deg", "", "geodetic latitude, WGS84"),
    Variable("longitude", "time", "deg", "", "longitude, east positive"),
    Variable("altitude", "time", "m", "", "height above the ellipsoid WGS84"),
    Variable(
        "torque_command_body",
        _XYZ,
        "N m",
        "body",
        "torque on the body that the computer commanded the wheels to give last",
        _WHEELS,
    ),
    Variable(
        "wheel_momentum",
        "time, wheel",
        "N m s",
        "wheel axis",
        "momentum of each wheel relative to the body",
        _WHEELS,
    ),
    Variable(
        "wheel_speed",
        "time, wheel",
        "rad/s",
        "wheel axis",
        "speed of each wheel relative to the body",
        _WHEELS,
    ),
    Variable(
        "wheel_torque",
        "time, wheel",
        "N m",
        "wheel axis",
        "commanded torque of each motor",
        _WHEELS,
    ),
    Variable(
        "q_estimated",
        "time, component",
        "1",
        "body to J",
        "estimated attitude quaternion",
        _ESTIMATE,
    ),
    Variable("omega_estimated", _XYZ, "rad/s", "body", "estimated angular velocity", _ESTIMATE),
    Variable(
        "gyro_bias_estimated",
        _XYZ,
        "rad/s",
        "body",
        "estimated bias of the gyro; NaN where none is estimated",
        _ESTIMATE,
    ),
    Variable("estimate_time", "time", "s", "", "time to which the estimate applies", _ESTIMATE),
    Variable(
        "attitude_sigma",
        "time",
        "rad",
        "body",
        "standard deviation of the attitude that the estimator states",
        _ESTIMATE,
    ),
    Variable(
        "rate_sigma",
        "time",
        "rad/s",
        "body",
        "standard deviation of the rate that the estimator states",
        _ESTIMATE,
    ),
    Variable(
        "mode_REGION",
        "time",
        "",
        "",
        "state of a region, as a number; names in the attribute `flag_meanings`; -1: none",
        _MODES,
    ),
    Variable("mode_entered", "mode", "s", "", "time at which each state was entered last", _MODES),
    Variable("mode_entries", "mode", "1", "", "how often each state was entered", _MODES),
    Variable(
        "coil_energy",
        "",
        "J",
        "",
        "electrical energy of the coils; if no power is given, for 1 W of each at its limit",
    ),
    Variable("peak_coil_dipole", "", "A m^2", "", "greatest dipole of a coil in the whole run"),
    Variable(
        "integration_error",
        "",
        "rad",
        "",
        "attitude error at the end: sum of the steps' estimates",
        _AUTO,
    ),
    Variable("steps", "", "1", "", "number of integration steps", _AUTO),
    Variable("mean_step", "", "s", "", "mean integration step", _AUTO),
    Variable("least_step", "", "s", "", "shortest integration step", _AUTO),
    Variable(
        "rk4_damping",
        "",
        "1",
        "",
        "fraction of the nutation or libration amplitude damped by the steps, at most",
        _RK4,
    ),
    Variable(
        "rk4_lag", "", "rad", "", "approximate phase lag of the rotation due to the steps", _RK4
    ),
    Variable(
        "checkpoint",
        "checkpoint_cell",
        "",
        "",
        "internal state of the loop, from which the run can be resumed",
    ),
)

#: Logs: their names, dimensions and units are those that laws and estimators declare.
LOGS = (
    "What laws and estimators log is recorded as `KEY.NAME` over `time` (vectors over `time`, "
    "`axis`), by the name in their `log`, with the unit given there."
)

ATTRIBUTES = {
    "scenario": "the whole scenario that was flown, as JSON; `torquer.Scenario` reads it",
    "laws": "laws and estimators as JSON: name, parameters, text, how they ran; `torquer.laws_of`",
    "seed": "seed of all random numbers",
    "how_it_ended": "complete, stopped, interrupted or failed",
    "ended": "the same in full, with the time and the reason",
    "versions": "versions of torquer, Python and the libraries that the bits depend on, as JSON",
    "processor": "kind of processor that the code was compiled for",
    "table_relative_error": "proven bound on the relative error of the tabulated environment",
    "conventions": "frames and units in short",
    "digest": "SHA-256 of the data from which a run is resumed",
}


def variables_page() -> str:
    """The page, in Markdown."""
    head = [
        "# Variables of a result",
        "",
        "Made from the code by `docs/generate.py`. `torquer.simulate` and `torquer.load` give an",
        "`xarray.Dataset` with these variables; `result.nc` has the same. SI units throughout;",
        "`result.torquer.derived()` gives derived quantities, in degrees and rpm. J is",
        "the inertial frame J2000; body axes are those of the scenario's inertia tensor.",
        "",
        "The control step at the very end of a run is not executed: there, readings and commands",
        "are those of the step before.",
        "",
    ]
    tables = (("Coordinates", COORDINATES), ("Variables", VARIABLES))
    parts = [line for title, rows in tables for line in _table(title, rows)]
    attributes = [f"| `{name}` | {meaning} |" for name, meaning in ATTRIBUTES.items()]
    told = ["## Attributes", "", "| name | meaning |", "|---|---|", *attributes, ""]
    return "\n".join([*head, *parts, "## Logs", "", LOGS, "", *told])


def _table(title: str, rows) -> list[str]:
    lines = [
        f"| `{v.name}` | {v.dims or 'none'} | {v.units} | {v.frame} | {_meaning(v)} |" for v in rows
    ]
    return [
        f"## {title}",
        "",
        "| name | dimensions | unit | frame | meaning |",
        "|---|---|---|---|---|",
        *lines,
        "",
    ]


def _meaning(variable: Variable) -> str:
    return f"{variable.meaning} ({variable.when})" if variable.when else variable.meaning
