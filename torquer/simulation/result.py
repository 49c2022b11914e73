"""The result of a run as an `xarray.Dataset`: units, frames, scenario, versions, a checkpoint."""

from __future__ import annotations

import hashlib
import json
import math
import platform
from typing import TYPE_CHECKING

import numpy as np

import torquer
from torquer.engine import processor
from torquer.geometry.attitudes import dcm_body_to_reference
from torquer.geometry.frames import geodetic_from_ecef
from torquer.plugin import source_mark, source_text
from torquer.scenario.spec import Scenario
from torquer.simulation.prepare import log_of
from torquer.simulation.run import Run
from torquer.simulation.state import ROW, Record, State, arrays_of
from torquer.time import utc_at
from torquer.wheel_array.layout import total_momentum

if TYPE_CHECKING:  # half a second of importing, which a run need not wait for
    import xarray as xr

#: How a run can have ended: at its end, at the time asked for, by the keyboard, by a failure.
COMPLETE, STOPPED, INTERRUPTED, FAILED = "complete", "stopped", "interrupted", "failed"
_XYZ = ("time", "axis")
#: Recorded vectors: name, name in the record, unit, frame, meaning.
RECORDED = (
    ("q_body_to_inertial", "q", "1", "body to J", "attitude quaternion (x, y, z, w)"),
    ("omega_body", "omega", "rad/s", "body", "absolute angular velocity"),
    ("dipole_body", "dipole", "A m^2", "body", "dipole of the coils, residual dipole included"),
    ("b_measured", "b_measured", "T", "body", "last magnetometer reading"),
    ("omega_measured", "omega_measured", "rad/s", "body", "last gyro reading"),
    ("sun_measured", "sun_measured", "1", "body", "last Sun sensor reading (zeros: not seen)"),
    ("command_body", "command", "A m^2", "body", "dipole that the computer asked for last"),
)
TORQUE = (
    "torque_command_body", "torque", "N m", "body",
    "torque on the body that the computer asked the wheels for last",
)  # fmt: skip


def places(name: str) -> list[int]:
    """Places of a vector in a row of the record."""
    return [k for k, cell in enumerate(ROW.names) if cell.rpartition("_")[0] == name]


def _vectors(rows: np.ndarray, recorded) -> dict:
    """Variables of the data set from rows of the record."""
    cells = rows.view(np.float64).reshape(len(rows), len(ROW.names))
    return {
        name: (
            ("time", "component" if len(places(key)) == 4 else "axis"),
            cells[:, places(key)],
            {"units": unit, "frame": frame, "long_name": meaning},
        )
        for name, key, unit, frame, meaning in recorded
    }


def part_of(run: Run) -> xr.Dataset:
    """The record of the run's piece so far and all that follows from it."""
    record = run.rows()
    t_s = record.rows["step"] * run.plan.step_s
    variables = _vectors(record.rows, RECORDED) | logged(run, record) | modes_recorded(run, record)
    coordinates = _coordinates(run.scenario, t_s)
    if len(run.plan.plant.rotors.rows):
        variables |= _of_wheels(run, record)
        coordinates["wheel"] = np.arange(len(run.state.rotors))
    if len(record.estimate):
        variables |= _of_estimate(record.estimate)
    import xarray as xr

    data = xr.Dataset(variables, coords=coordinates)
    return data.assign(_surroundings(run, t_s, data))


def with_state(part: xr.Dataset, run: Run, how: str, ended: str) -> xr.Dataset:
    """A part, or all parts joined, with what is known of the whole run.

    `how` is one of the words above; `ended` says in full how the run ended.
    """
    modes = _entered(run)
    data = part.assign(_totals(run)).assign(_checkpoint(run)).assign(modes)
    data = data.set_coords("mode") if modes else data
    data = data.assign_attrs(_attributes(run, how, ended))
    return data.assign_attrs(digest=digest_of(data))


def of_the_whole(result: xr.Dataset) -> list[str]:
    """Names of the variables that are known of the whole run, not of each record."""
    return [name for name, values in result.data_vars.items() if "time" not in values.dims]


def _coordinates(scenario: Scenario, t_s):
    return {
        "time": ("time", t_s, {"units": "s", "long_name": "time since the start"}),
        "utc": ("time", utc_at(scenario.start, t_s).astype("datetime64[ns]")),
        "axis": ["x", "y", "z"],
        "component": ["x", "y", "z", "w"],
    }


def _of_wheels(run: Run, record: Record) -> dict:
    """What is recorded of the wheels, with their speeds."""
    momentum, motor = np.split(record.wheels, 2, axis=1)
    inertia = run.plan.plant.rotors.rows["inertia"]
    kept = (
        ("wheel_momentum", momentum, "N m s", "momentum relative to the body"),
        ("wheel_speed", momentum / inertia, "rad/s", "speed relative to the body"),
        ("wheel_torque", motor, "N m", "torque that the motor is asked for"),
    )
    shown = {
        name: (("time", "wheel"), values, {"units": unit, "frame": "wheel axis", "long_name": text})
        for name, values, unit, text in kept
    }
    return {**shown, **_vectors(record.rows, [TORQUE])}


def logged(run: Run, record: Record) -> dict:
    """What laws and estimators log, named by their keys."""
    variables, at = {}, 0
    for name, block, unit, cells in log_of(run.blocks):
        values, at = record.log[:, at : at + len(cells)], at + len(cells)
        attributes = {
            "units": unit,
            "long_name": f"{name}, logged by {block.kind.name} {block.name}",
        }
        vector = len(cells) == 3
        dims = ("time", "axis") if vector else ("time",)
        if len(cells) in (1, 3):
            variables[name] = (dims, values if vector else values[:, 0], attributes)
        else:
            variables |= {
                f"{name}_{k}": ("time", values[:, k], attributes) for k in range(len(cells))
            }
    return variables


def modes_recorded(run: Run, record: Record) -> dict:
    """The state of every region, as numbers with their meanings."""
    variables, first = {}, 0
    for k, (name, region) in enumerate(regions_of(run.scenario).items()):
        meanings = " ".join(region.states)
        values = np.where(np.isnan(record.modes[:, k]), -1, record.modes[:, k] - first)
        attributes = {
            "long_name": f"state of the region {name}",
            "flag_values": list(range(len(region.states))),
            "flag_meanings": meanings,
        }
        variables[f"mode_{name}"] = ("time", values.astype(np.int64), attributes)
        first += len(region.states)
    return variables


def regions_of(scenario: Scenario) -> dict:
    """Regions of a mode table or a scheme; none for laws that always work."""
    modes = scenario.control.named().modes
    return modes.regions if modes else {}


def _entered(run: Run) -> dict:
    """When each state was entered last, and how often."""
    regions, states = regions_of(run.scenario), run.state.board.modes.states
    if not regions:
        return {}
    names = [f"{name}.{state}" for name, region in regions.items() for state in region.states]
    entered = np.where(states["entries"] > 0.0, states["entered_s"], np.nan)
    last = {"units": "s", "long_name": "time at which the state was entered last"}
    return {
        "mode": ("mode", names),
        "mode_entered": ("mode", entered, last),
        "mode_entries": ("mode", states["entries"].copy(), {"units": "1"}),
    }


#: What is kept of an estimate: name, names in the record, dimension, unit, frame, meaning.
ESTIMATED = (
    ("q_estimated", "estimate_q", "component", "1", "body to J", "estimated attitude (x, y, z, w)"),
    ("omega_estimated", "estimate_omega", "axis", "rad/s", "body", "estimated angular velocity"),
    ("gyro_bias_estimated", "estimate_bias", "axis", "rad/s", "body", "estimated bias of the gyro"),
    ("estimate_time", "estimate_s", None, "s", "", "time of the estimate"),
    (
        "attitude_sigma",
        "sigma_rad",
        None,
        "rad",
        "body",
        "standard deviation of the attitude, estimated",
    ),
    (
        "rate_sigma",
        "sigma_rad_s",
        None,
        "rad/s",
        "body",
        "standard deviation of the rate, estimated",
    ),
)


def names_in(key: str, dimension: str | None) -> list[str]:
    parts = {"component": "xyzw", "axis": "xyz"}
    return [f"{key}_{c}" for c in parts[dimension]] if dimension else [key]


def _of_estimate(estimate: np.ndarray) -> dict:
    """What the estimator believes."""
    variables = {}
    for name, key, dimension, unit, frame, meaning in ESTIMATED:
        values = np.column_stack([estimate[part] for part in names_in(key, dimension)])
        attributes = {"units": unit, "frame": frame, "long_name": meaning}
        dims = ("time", dimension) if dimension else ("time",)
        variables[name] = (dims, values if dimension else values[:, 0], attributes)
    return variables


def _surroundings(run: Run, t_s, data: xr.Dataset) -> dict:
    """Orbit, field, Sun and momentum at the recorded instants, from the models themselves."""
    around = run.scenario.surroundings()
    r, v = around.state(t_s)
    b = around.field(t_s, r, v)
    lat, lon, height = geodetic_from_ecef(np.einsum("nij,nj->ni", around.dcm_to_ecef(t_s), r))
    q, omega = data["q_body_to_inertial"].values, data["omega_body"].values
    to_inertial = dcm_body_to_reference(q)
    to_body = to_inertial.transpose(0, 2, 1)
    body = run.scenario.spacecraft.body
    momentum = omega @ np.array(body.inertia_kg_m2) + np.array(body.wheel_momentum_n_m_s)
    if len(run.plan.plant.rotors.rows):
        axes = np.array(run.scenario.spacecraft.wheels.array().axes)
        momentum = momentum + total_momentum(axes, data["wheel_momentum"].values)
    turning = np.cross(r, v) / np.sum(r * r, axis=1)[:, None]
    sun = around.sun(t_s) - r
    sun /= np.linalg.norm(sun, axis=1)[:, None]

    def vector(values, unit, frame, meaning):
        return (_XYZ, values, {"units": unit, "frame": frame, "long_name": meaning})

    def turned(matrices, values):
        return np.einsum("nij,nj->ni", matrices, values)

    return {
        "position_inertial": vector(r, "m", "J", "position"),
        "velocity_inertial": vector(v, "m/s", "J", "velocity"),
        "b_inertial": vector(b, "T", "J", "geomagnetic field"),
        "b_body": vector(turned(to_body, b), "T", "body", "geomagnetic field"),
        "sun_inertial": vector(sun, "1", "J", "direction to the Sun"),
        "omega_orbital": vector(
            omega - turned(to_body, turning), "rad/s", "body", "rate relative to the orbital frame"
        ),
        "momentum_inertial": vector(
            turned(to_inertial, momentum), "N m s", "J", "angular momentum of body and wheels"
        ),
        "lit": ("time", around.lit(t_s, r), {"units": "1", "long_name": "visible part of the Sun"}),
        "latitude": ("time", np.degrees(lat), {"units": "deg", "long_name": "geodetic latitude"}),
        "longitude": ("time", np.degrees(lon), {"units": "deg", "long_name": "longitude"}),
        "altitude": ("time", height, {"units": "m", "long_name": "height above WGS84"}),
    }


def _totals(run: Run) -> dict:
    """What the coils, and the integrator by itself, have done since the start."""
    coils = run.scenario.spacecraft.coils
    power = coils.power_at_limit_w if coils else None
    note = "electrical energy of the coils" + ("" if power else ", if each took 1 W at its limit")
    return {
        "coil_energy": (
            (),
            float(run.state.cells["coil_energy_j"][0]),
            {"units": "J", "long_name": note},
        ),
        "peak_coil_dipole": ((), float(run.state.cells["peak_dipole_a_m2"][0]), {"units": "A m^2"}),
        **_of_steps(run),
    }


def _of_steps(run: Run) -> dict:
    """What the steps did to the motion by themselves."""
    if run.scenario.simulation.integrator == "auto":
        return _of_adaptive_steps(run)
    if run.scenario.simulation.integrator != "rk4":
        return {}
    taken = "relative loss of nutation and libration amplitude to RK4's steps, upper bound"
    behind = "phase lag of the rotation due to RK4's steps, approximate"
    cells = run.state.cells[0]
    damping, lag = -np.expm1(-cells["damping"]), cells["lag"]
    return {
        "rk4_damping": ((), float(damping), {"units": "1", "long_name": taken}),
        "rk4_lag": ((), float(lag), {"units": "rad", "long_name": behind}),
    }


def _of_adaptive_steps(run: Run) -> dict:
    """Estimated error, number and lengths of the steps."""
    cells, flown_s = run.state.cells[0], float(run.state.at[0]) * run.plan.step_s
    error, steps = float(cells["error_rad"]), float(cells["steps"])
    mean_s = flown_s / steps if steps else math.nan
    return {
        "integration_error": (
            (),
            error,
            {
                "units": "rad",
                "long_name": "error of the attitude at the end, sum of the steps' estimates",
            },
        ),
        "steps": ((), steps, {"units": "1", "long_name": "number of integration steps"}),
        "mean_step": ((), mean_s, {"units": "s", "long_name": "mean step"}),
        "least_step": (
            (),
            float(cells["least_step_s"]),
            {"units": "s", "long_name": "shortest step"},
        ),
    }


def versions() -> dict[str, str]:
    """Versions of what bits depend on."""
    import numba
    import scipy
    import xarray as xr

    return {
        "torquer": torquer.__version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "numba": numba.__version__,
        "scipy": scipy.__version__,
        "xarray": xr.__version__,
    }


def _attributes(run: Run, how: str, ended: str) -> dict:
    return {
        "scenario": run.scenario.model_dump_json(),
        **law_attributes(run),
        "seed": str(run.scenario.seed),
        "how_it_ended": how,
        "ended": ended,
        "versions": json.dumps(versions()),
        "processor": processor(),
        "table_relative_error": run.relative_error,
        "conventions": "see torquer.conventions; SI units; quaternions scalar-last",
    }


def arrays_stored(state: State) -> list[np.ndarray]:
    """The arrays that hold the loop's state between steps, as numbers of eight bytes."""
    return [part.view(np.float64) for part in arrays_of(state[1:])]


def _checkpoint(run: Run) -> dict:
    """The loop's state, bit for bit, as one vector."""
    values = np.concatenate([run.state.at, *(array.ravel() for array in arrays_stored(run.state))])
    meaning = {"long_name": "state of the loop, to resume"}
    return {"checkpoint": ("checkpoint_cell", values, meaning)}


def digest_of(result: xr.Dataset) -> str:
    """Digest of what a run goes on from: scenario, laws, state."""
    digest = hashlib.sha256(np.ascontiguousarray(result["checkpoint"].values).tobytes())
    for name in ("scenario", "laws", "seed", "how_it_ended", "ended", "table_relative_error"):
        digest.update(str(result.attrs[name]).encode())
    return digest.hexdigest()


def scenario_of(result: xr.Dataset) -> Scenario:
    """The scenario that was flown, its laws named in it."""
    return Scenario.model_validate_json(result.attrs["scenario"])


def law_attributes(run: Run) -> dict[str, str]:
    """What a result says of its laws and estimators: by key, as JSON."""
    said = {
        key: {
            **json.loads(block.described()),
            "source": source_mark(block.function),
            "text": source_text(block.function),
            "runs_as": "compiled" if block.compiled else "plain Python (slow: not decorated)",
        }
        for key, block in run.blocks.by_key().items()
    }
    return {"laws": json.dumps(said)}


def laws_of(result: xr.Dataset) -> dict[str, dict]:
    """Laws and estimators that were flown, by key: name, parameters, text, how they ran."""
    return json.loads(result.attrs["laws"])
