"""The result of a run as an `xarray.Dataset`: units, frames, scenario, versions, a checkpoint."""

from __future__ import annotations

import json
import os
import platform
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import torquer
from torquer.geometry.frames import geodetic_from_ecef
from torquer.plugin import source_mark, source_text
from torquer.simulation import step as loop
from torquer.simulation.run import Run
from torquer.simulation.spec import Scenario
from torquer.spacecraft.rotors import INERTIA
from torquer.time import utc_at
from torquer.wheel_array.layout import total_momentum

if TYPE_CHECKING:  # half a second of importing, which a run need not wait for
    import xarray as xr

#: What a stored result takes beside its numbers, and some more [bytes].
_OVERHEAD = 2**18
#: How a run can have ended: at its end, at the time asked for, by the keyboard, by a failure.
COMPLETE, STOPPED, INTERRUPTED, FAILED = "complete", "stopped", "interrupted", "failed"
_XYZ = ("time", "axis")
#: Recorded columns: name, first and last column, unit, frame, meaning.
_RECORDED = (
    ("q_body_to_inertial", 1, 5, "1", "body to J", "attitude quaternion (x, y, z, w)"),
    ("omega_body", 5, 8, "rad/s", "body", "absolute angular velocity"),
    ("dipole_body", 8, 11, "A m^2", "body", "dipole of the coils, residual dipole included"),
    ("b_measured", 11, 14, "T", "body", "last magnetometer reading"),
    ("omega_measured", 14, 17, "rad/s", "body", "last gyro reading"),
    ("sun_measured", 17, 20, "1", "body", "last Sun sensor reading (zeros: Sun not seen)"),
    ("command_body", 20, 23, "A m^2", "body", "dipole that the law asked for last"),
)


def part_of(run: Run) -> xr.Dataset:
    """The record of the run's piece so far and all that follows from it."""
    rows = run.rows()
    t_s = rows[:, 0] * run.plan.step_s
    variables = {
        name: (
            ("time", "component" if last - first == 4 else "axis"),
            rows[:, first:last],
            {"units": unit, "frame": frame, "long_name": meaning},
        )
        for name, first, last, unit, frame, meaning in _RECORDED
    }
    coordinates = _coordinates(run.scenario, t_s)
    if run.plan.wheels:
        variables |= _of_wheels(run, rows)
        coordinates["wheel"] = np.arange(run.state.wheels.shape[1])
    import xarray as xr

    data = xr.Dataset(variables, coords=coordinates)
    return data.assign(_surroundings(run, t_s, rows))


def with_state(part: xr.Dataset, run: Run, how: str, ended: str) -> xr.Dataset:
    """A part, or all parts joined, with what is known of the whole run.

    `how` is one of the words above; `ended` says in full how the run ended.
    """
    data = part.assign(_totals(run)).assign(_checkpoint(run))
    return data.assign_attrs(_attributes(run, how, ended))


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


def _of_wheels(run: Run, rows) -> dict:
    """What is recorded of the wheels, with their speeds."""
    asked, momentum, motor = _wheel_columns(run, rows)
    inertia = run.plan.wheels.rotors.rows[:, INERTIA]
    told = (
        ("wheel_momentum", momentum, "N m s", "momentum relative to the body"),
        ("wheel_speed", momentum / inertia, "rad/s", "speed relative to the body"),
        ("wheel_torque", motor, "N m", "torque that the motor is asked for"),
    )
    shown = {
        name: (("time", "wheel"), values, {"units": unit, "frame": "wheel axis", "long_name": text})
        for name, values, unit, text in told
    }
    meaning = "torque on the body that the law of the wheels asked for last"
    attributes = {"units": "N m", "frame": "body", "long_name": meaning}
    return {**shown, "torque_command_body": (_XYZ, asked, attributes)}


def _wheel_columns(run: Run, rows) -> list:
    """Views of the record: torque asked for (n, 3), momentum and motor torque of each wheel."""
    return np.split(rows[:, loop.COLUMNS :], [3, 3 + run.state.wheels.shape[1]], axis=1)


def _surroundings(run: Run, t_s, rows) -> dict:
    """Orbit, field, Sun and momentum at the recorded instants, from the models themselves."""
    around = run.scenario.surroundings()
    r, v = around.state(t_s)
    b = around.field(t_s, r, v)
    lat, lon, height = geodetic_from_ecef(np.einsum("nij,nj->ni", around.dcm_to_ecef(t_s), r))
    q, omega = rows[:, 1:5], rows[:, 5:8]
    to_inertial = _matrices(q)
    to_body = to_inertial.transpose(0, 2, 1)
    body = run.scenario.spacecraft.body
    momentum = omega @ np.array(body.inertia_kg_m2) + np.array(body.wheel_momentum_n_m_s)
    if run.plan.wheels:
        axes = run.plan.wheels.rotors.rows[:, :3]
        momentum = momentum + total_momentum(axes, _wheel_columns(run, rows)[1])
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
        "coil_energy": ((), float(run.state.cells[loop.ENERGY]), {"units": "J", "long_name": note}),
        "peak_coil_dipole": ((), float(run.state.cells[loop.PEAK]), {"units": "A m^2"}),
        **_of_steps(run),
    }


def _of_steps(run: Run) -> dict:
    """What RK4 did to the motion by itself."""
    if run.scenario.simulation.integrator != "rk4":
        return {}
    taken = "part of the amplitude of nutation and libration that RK4's steps took, at most"
    behind = "phase lag of the rotation that RK4's steps made, about"
    damping, lag = -np.expm1(-run.state.cells[loop.DAMPING]), run.state.cells[loop.LAG]
    return {
        "rk4_damping": ((), float(damping), {"units": "1", "long_name": taken}),
        "rk4_lag": ((), float(lag), {"units": "rad", "long_name": behind}),
    }


def _matrices(q: np.ndarray) -> np.ndarray:
    """Direction cosines [n, 3, 3] of quaternions [n, 4], by scipy."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_quat(q).as_matrix()


def _attributes(run: Run, how: str, ended: str) -> dict:
    import numba
    import scipy
    import xarray as xr

    versions = {
        "torquer": torquer.__version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "numba": numba.__version__,
        "scipy": scipy.__version__,
        "xarray": xr.__version__,
    }
    return {
        "scenario": run.scenario.model_dump_json(),
        **_law_attributes(run),
        "seed": str(run.scenario.seed),
        "how_it_ended": how,
        "ended": ended,
        "versions": json.dumps(versions),
        "table_relative_error": run.relative_error,
        "conventions": "see torquer.conventions; SI units; quaternions scalar-last",
    }


def _stored(run: Run) -> tuple:
    """The arrays that hold the loop's state between steps."""
    state = run.state
    return (state.cells, state.coils, state.wheels, state.memory, state.wheel_memory)


def _checkpoint(run: Run) -> dict:
    """The loop's state, bit for bit, as one vector."""
    values = np.concatenate([run.state.step, *(array.ravel() for array in _stored(run))])
    meaning = {"long_name": "state of the loop, to resume"}
    return {"checkpoint": ("checkpoint_cell", values, meaning)}


def scenario_of(result: xr.Dataset) -> Scenario:
    """The scenario that was flown, its laws named in it."""
    return Scenario.model_validate_json(result.attrs["scenario"])


def _law_attributes(run: Run) -> dict[str, str]:
    """What a result says of its laws: `law` of the coils, `wheel_law` of the wheels."""
    said = {}
    for prefix, law in zip(("law", "wheel_law"), run.laws, strict=False):
        said |= {
            prefix: law.name,
            f"{prefix}_parameters": json.dumps({k: float(v) for k, v in law.parameters.items()}),
            f"{prefix}_source": source_mark(law.function),
            f"{prefix}_text": source_text(law.function),
            f"{prefix}_runs_as": "compiled"
            if law.compiled
            else "plain Python (slow: not decorated)",
        }
    return said


def restore(run: Run, result: xr.Dataset) -> None:
    """Bring a freshly prepared run to where a result of the same scenario and laws stopped."""
    given, began = _law_attributes(run), result.attrs
    for prefix, law in zip(("law", "wheel_law"), run.laws, strict=False):
        keys = (prefix, f"{prefix}_parameters")
        if any(given[key] != began.get(key) for key in keys):
            raise ValueError(
                f"{prefix}: must be {' '.join(began.get(key, 'none') for key in keys)}, with which "
                f"the run began; received {' '.join(given[key] for key in keys)}"
            )
        if given[f"{prefix}_source"] != began.get(f"{prefix}_source", ""):
            raise ValueError(
                f"{prefix} {law.name}: must be the one with which the run began; its file, or one "
                "beside it, has been edited since"
            )
    _restore_state(run, result["checkpoint"].values)
    run.piece, run.relative_error = None, float(began["table_relative_error"])
    run.enter()
    _restore_record(run, result)


def _restore_state(run: Run, cells: np.ndarray) -> None:
    size = 1 + sum(array.size for array in _stored(run))
    if cells.shape != (size,):
        raise ValueError(
            f"result: its checkpoint must have {size} cells, as this scenario and law have; "
            f"received {cells.size}"
        )
    run.state.step[0] = int(cells[0])
    at = 1
    for array in _stored(run):
        array.flat = cells[at : at + array.size]
        at += array.size


def _restore_record(run: Run, result: xr.Dataset) -> None:
    """The rows of the piece in which the run stands; those before are complete as they are."""
    steps = np.arange(result.sizes["time"]) * run.plan.record_steps
    due = -(-int(run.state.step[0]) // run.plan.record_steps)
    t_s = result["time"].values
    if len(t_s) < due or not np.array_equal(t_s, steps * run.plan.step_s):
        raise ValueError(
            f"result: must have every row of its record to go on from; received {len(t_s)} rows, "
            f"of {due} or more"
        )
    here = slice(run.first_row, min(len(t_s), run.first_row + len(run.record)))
    rows = np.arange(here.start, here.stop) % len(run.record)
    part = result.isel(time=here)
    run.record[rows, 0] = steps[here]
    for name, first, last, *_ in _RECORDED:
        run.record[rows, first:last] = part[name].values
    if run.plan.wheels:
        names = ("torque_command_body", "wheel_momentum", "wheel_torque")
        run.record[rows, loop.COLUMNS :] = np.hstack([part[name].values for name in names])


def save(result: xr.Dataset, path, how: dict | None = None) -> None:
    """Write a result as NetCDF; what stood there before is replaced when all is written.

    `how`: more arguments of `xarray.Dataset.to_netcdf`.
    """
    path = Path(path)
    unfinished = path.with_name(path.name + ".part")
    _reserve(unfinished, result.nbytes + _OVERHEAD)
    result.to_netcdf(unfinished, engine="h5netcdf", **(how or {}))
    os.replace(unfinished, path)


def _reserve(path: Path, size: int) -> None:
    """OSError if a file cannot have that size: HDF5 itself crashes on a full disk."""
    if not hasattr(os, "posix_fallocate"):  # not on Windows
        return
    try:
        with path.open("wb") as file:
            os.posix_fallocate(file.fileno(), 0, size)
    except OSError:
        path.unlink(missing_ok=True)
        raise


def load(path) -> xr.Dataset:
    """Read a result back."""
    import xarray as xr

    return xr.load_dataset(path, engine="h5netcdf")


def attributes_of(path) -> dict:
    """What a stored result says of itself, without its numbers."""
    import h5py

    with h5py.File(path) as file:
        return dict(file.attrs)
