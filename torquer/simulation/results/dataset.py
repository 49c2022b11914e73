"""The result of a run as an `xarray.Dataset`: units, frames, scenario, versions, a checkpoint."""

from __future__ import annotations

import hashlib
import json
import math
import platform
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from torquer.base.time import utc_at
from torquer.base.user_source import source_mark, source_text
from torquer.base.version import VERSION
from torquer.computer.blocks.block import Block, Logged
from torquer.computer.computer import Blocks, estimates
from torquer.computer.interface import SENSORS
from torquer.environment.along_orbit import OrbitEnvironment
from torquer.environment.ephemeris import EphemerisModels
from torquer.maths.geometry.attitudes import dcm_body_to_reference
from torquer.maths.geometry.frames import geodetic_from_ecef
from torquer.scenario.resolution import part_damped
from torquer.scenario.spec import Scenario
from torquer.simulation.loop.state import Record, State, find_arrays
from torquer.simulation.results.flown import flown_scenario as flown_scenario
from torquer.simulation.results.variables import (
    ADAPTIVE,
    COILS,
    FIXED,
    RECORDED,
    TORQUE,
    describe,
    estimated,
    inputs,
    read,
)
from torquer.simulation.setup.prepare import make_log
from torquer.simulation.setup.run import Run, Uplink
from torquer.spacecraft.wheel_array.layout import total_momentum

if TYPE_CHECKING:  # half a second of importing, which a run need not wait for
    import xarray as xr

#: How a run can have ended: at its end, at the time asked for, by the keyboard, by a failure.
COMPLETE, STOPPED, INTERRUPTED, FAILED = "complete", "stopped", "interrupted", "failed"


def record_dataset(run: Run) -> xr.Dataset:
    """The record of the run's piece so far and all that follows from it."""
    record = run.rows()
    t_s = record.rows["step"] * run.plan.step_s
    variables = (
        read(record.rows, RECORDED) | logged_variables(run, record) | modes_recorded(run, record)
    )
    coordinates, units = _coordinates(run.scenario, t_s), run.scenario.spacecraft.units()
    if len(run.plan.plant.rotors.rows):
        variables |= _wheel_variables(run, record)
        coordinates["wheel"] = np.arange(len(run.state.rotors))
    if estimates(run.plan.computer):
        variables |= read(record.known, estimated(units))
        coordinates["sensor"] = [*SENSORS, *(each.name for each in units)]
    if run.scenario.simulation.record_inputs:
        variables |= read(record.known, inputs(units))
    import xarray as xr

    data = xr.Dataset(variables, coords=coordinates | log_axes(run))
    return data.assign(_orbit_environment(run, t_s, data))


def with_state(part: xr.Dataset, run: Run, how: str, ended: str) -> xr.Dataset:
    """A part, or all parts joined, with what is known of the whole run.

    `how` is one of the words above; `ended` says in full how the run ended.
    """
    modes = _entries(run)
    data = part.assign(_totals(run)).assign(_checkpoint(run)).assign(modes)
    data = data.set_coords("mode") if modes else data
    data = data.assign_attrs(_attributes(run, how, ended))
    return data.assign_attrs(digest=digest_result(data))


def whole_run_names(result: xr.Dataset) -> list[str]:
    """Names of the variables that are known of the whole run, not of each record."""
    return [name for name, values in result.data_vars.items() if "time" not in values.dims]


def _coordinates(scenario: Scenario, t_s):
    return {
        **describe({"time": t_s}),
        "utc": ("time", utc_at(scenario.start, t_s).astype("datetime64[ns]")),
        "axis": ["x", "y", "z"],
        "component": ["x", "y", "z", "w"],
    }


def _wheel_variables(run: Run, record: Record) -> dict:
    """What is recorded of the wheels, with their speeds."""
    momentum, motor = np.split(record.wheels, 2, axis=1)
    speed = momentum / run.plan.plant.rotors.rows["inertia"]
    return {
        **describe({"wheel_momentum": momentum, "wheel_speed": speed, "wheel_torque": motor}),
        **read(record.rows, [TORQUE]),
    }


def logged_variables(run: Run, record: Record) -> dict:
    """What laws and estimators log, named by their keys."""
    variables, at = {}, 0
    for name, block, part, cells in make_log(run.blocks):
        values, at = record.log[:, at : at + len(cells)], at + len(cells)
        said = {"long_name": f"{name}, logged by {block.kind.name} {block.name}"}
        attributes = said if part.axes else {"units": part.unit, **said}
        dims = ("time", *_logged_dims(name, part))
        variables[name] = (dims, values.reshape(len(values), *part.shape), attributes)
    return variables


def _logged_dims(name: str, part: Logged) -> tuple[str, ...]:
    """Dimensions of a logged value at an instant: its own unless it is a vector of three."""
    if part.axes:
        return tuple(f"{name.partition('.')[0]}.{axis.name}" for axis in part.axes)
    if part.shape == (3,):
        return ("axis",)
    return tuple(f"{name}_{k}" for k in range(len(part.shape)))


def log_axes(run: Run) -> dict:
    """Coordinates along the dimensions of logged values: labels, and their units."""
    found = {}
    for name, _, part, _ in make_log(run.blocks):
        for dim, axis in zip(_logged_dims(name, part), part.axes, strict=False):
            found |= {dim: list(axis.labels), f"{dim}_units": (dim, list(axis.units))}
    return found


def modes_recorded(run: Run, record: Record) -> dict:
    """The state of every region, as numbers with their meanings."""
    variables, numbers = {}, mode_numbers(run.scenario, record)
    for name, region in mode_regions(run.scenario).items():
        attributes = {
            "long_name": f"state of the region {name}",
            "flag_values": list(range(len(region.states))),
            "flag_meanings": " ".join(region.states),
        }
        variables[f"mode_{name}"] = ("time", numbers[name], attributes)
    return variables


def mode_numbers(scenario: Scenario, record: Record) -> dict[str, np.ndarray]:
    """The number of the state of every region at every record, -1 where it is not known."""
    found, first = {}, 0
    for k, (name, region) in enumerate(mode_regions(scenario).items()):
        values = np.where(np.isnan(record.modes[:, k]), -1, record.modes[:, k] - first)
        found[name] = values.astype(np.int64)
        first += len(region.states)
    return found


def mode_regions(scenario: Scenario) -> dict:
    """Regions of a mode table or a scheme; none for laws that always work."""
    modes = scenario.control.named().modes
    return modes.regions if modes else {}


def _entries(run: Run) -> dict:
    """When each state was entered last, and how often."""
    regions, states = mode_regions(run.scenario), run.state.board.modes.states
    if not regions:
        return {}
    names = [f"{name}.{state}" for name, region in regions.items() for state in region.states]
    entered = np.where(states["entries"] > 0.0, states["entered_s"], np.nan)
    times = {"mode_entered": entered, "mode_entries": states["entries"].copy()}
    return {"mode": ("mode", names), **describe(times)}


def _orbit_environment(run: Run, t_s, data: xr.Dataset) -> dict:
    """Orbit, field, Sun and momentum at the recorded instants, from the models themselves."""
    environment = run.scenario.orbit_environment()
    r, v = environment.state(t_s)
    b = environment.field(t_s, r, v)
    lat, lon, height = geodetic_from_ecef(np.einsum("nij,nj->ni", environment.dcm_to_ecef(t_s), r))
    q, omega = data["q_body_to_inertial"].values, data["omega_body"].values
    to_inertial = dcm_body_to_reference(q)
    to_body = to_inertial.transpose(0, 2, 1)
    body = run.scenario.spacecraft.body
    momentum = omega @ np.array(body.inertia) + np.array(body.wheel_momentum_n_m_s)
    if len(run.plan.plant.rotors.rows):
        axes = np.array(run.scenario.spacecraft.wheels.array().axes)
        momentum = momentum + total_momentum(axes, data["wheel_momentum"].values)
    sun = sun_direction(environment, t_s, r)
    return _believed_variables(run, t_s) | describe({
        "position_inertial": r,
        "velocity_inertial": v,
        "b_inertial": b,
        "b_body": _turn(to_body, b),
        "sun_inertial": sun,
        "omega_orbital": rate_in_orbit(to_body, omega, r, v),
        "momentum_inertial": _turn(to_inertial, momentum),
        "sunlit_fraction": environment.sunlit_fraction(t_s, r),
        "latitude": np.degrees(lat),
        "longitude": np.degrees(lon),
        "altitude": height,
    })  # fmt: skip


def rate_in_orbit(dcm_inertial_to_body, omega_body, r, v) -> np.ndarray:
    """Angular velocity (n, 3) [rad/s] relative to the orbital frame, in body axes."""
    turning = np.cross(r, v) / np.sum(r * r, axis=1)[:, None]
    return omega_body - _turn(dcm_inertial_to_body, turning)


def sun_direction(environment: OrbitEnvironment, t_s, r) -> np.ndarray:
    """Direction (n, 3) from positions r (n, 3) [m] to the Sun, in J."""
    sun = environment.sun(t_s) - r
    return sun / np.linalg.norm(sun, axis=1)[:, None]


def _turn(matrices, values) -> np.ndarray:
    return np.einsum("nij,nj->ni", matrices, values)


def _believed_variables(run: Run, t_s) -> dict:
    """Position and field by the models on board, where they are not the truth."""
    believed, truth = run.believed(), run.scenario.orbit_environment()
    if all(environment == truth for _, environment in believed):
        return {}
    position, field = np.empty((2, len(t_s), 3))
    ends_s = [from_s for from_s, _ in believed[1:]] + [np.inf]
    for (from_s, environment), end_s in zip(believed, ends_s, strict=True):
        rows = (t_s > from_s) & (t_s <= end_s)
        if not rows.any():
            continue
        r, v = environment.state(t_s[rows])
        position[rows], field[rows] = r, environment.field(t_s[rows], r, v)
    return describe({"position_believed": position, "b_believed": field})


def _totals(run: Run) -> dict:
    """What the coils, and the integrator by itself, have done since the start."""
    cells, integrator = run.state.cells[0], run.scenario.simulation.integrator
    of_steps = {"auto": ADAPTIVE, "rk4": FIXED}.get(integrator, ())
    totals = {each.name: float(cells[each.key]) for each in (*COILS, *of_steps)}
    if integrator == "rk4":
        totals["rk4_damping"] = float(part_damped(cells["damping"]))
    if integrator == "auto":
        flown_s = float(run.state.at[0]) * run.plan.step_s
        taken = totals["steps"] > 0.0
        totals["mean_step"] = flown_s / totals["steps"] if taken else math.nan
        totals["least_step"] = totals["least_step"] if taken else math.nan
    return describe(totals)


def versions() -> dict[str, str]:
    """Versions of what bits depend on."""
    import numba
    import scipy
    import xarray as xr

    return {
        "torquer": VERSION,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "numba": numba.__version__,
        "scipy": scipy.__version__,
        "xarray": xr.__version__,
    }


def _attributes(run: Run, how: str, ended: str) -> dict:
    from torquer.compile.ready import processor

    return {
        "scenario": run.scenario.model_dump_json(),
        **law_attributes(run),
        **part_attributes(run.files),
        **_uplinked_attribute(run),
        **_ended_by(run),
        "seed": str(run.scenario.seed),
        "how_it_ended": how,
        "ended": ended,
        "versions": json.dumps(versions()),
        "processor": processor(),
        "table_relative_error": run.relative_error,
        "conventions": "see torquer.base.conventions; SI units; quaternions scalar-last",
    }


def arrays_stored(state: State) -> list[np.ndarray]:
    """The arrays that hold the loop's state between steps, as numbers of eight bytes."""
    return [part.view(np.float64) for part in find_arrays(state[1:])]


def _checkpoint(run: Run) -> dict:
    """The loop's state, bit for bit, as one vector."""
    values = np.concatenate([run.state.at, *(array.ravel() for array in arrays_stored(run.state))])
    return describe({"checkpoint": values})


def digest_result(result: xr.Dataset) -> str:
    """Digest of what a run goes on from: scenario, laws, state."""
    digest = hashlib.sha256(np.ascontiguousarray(result["checkpoint"].values).tobytes())
    for name in ("scenario", "laws", "seed", "how_it_ended", "ended", "table_relative_error"):
        digest.update(str(result.attrs[name]).encode())
    for name in ("parts", "uplinked"):
        digest.update(str(result.attrs.get(name, "")).encode())
    return digest.hexdigest()


def law_attributes(run: Run) -> dict[str, str]:
    """What a result says of its laws and estimators: by key, as JSON."""
    said = {
        key: {
            **known,
            "text": source_text(run.blocks.by_key()[key].function),
            "runs_as": _runs_as(run, run.blocks.by_key()[key]),
        }
        for key, known in identify_blocks(run.blocks).items()
    }
    return {"laws": json.dumps(said)}


def identify_blocks(blocks: Blocks) -> dict[str, dict]:
    """What laws and estimators are, by key: name, parameters, mark of the source."""
    return {
        key: {**json.loads(block.described()), "source": source_mark(block.function)}
        for key, block in blocks.by_key().items()
    }


def part_attributes(files: Mapping[str, Mapping[str, str]]) -> dict[str, str]:
    """What a result says of the files that give its parts, but for laws: by key, as JSON."""
    return {"parts": json.dumps(files)} if files else {}


def _uplinked_attribute(run: Run) -> dict[str, str]:
    """Models of the ephemeris that were given in flight: times and models, as JSON."""
    rows = [(each.from_s, each.models.model_dump(mode="json")) for each in run.uplinked]
    return {"uplinked": json.dumps(rows)} if rows else {}


def _ended_by(run: Run) -> dict[str, str]:
    """The condition that ended a run before its time."""
    when = run.scenario.simulation.end_when
    early = when is not None and run.steps < run.scenario.steps()
    return {"ended_by": when.in_words} if when is not None and early else {}


def uplinked_in(result: xr.Dataset) -> tuple[Uplink, ...]:
    """Models of the ephemeris that the computer of a result was given in flight."""
    rows = json.loads(result.attrs.get("uplinked", "[]"))
    return tuple(Uplink(t_s, EphemerisModels.model_validate(models)) for t_s, models in rows)


def _runs_as(run: Run, block: Block) -> str:
    if run.library is not None:
        return f"exported C ({run.library.fingerprint})"
    return "compiled" if block.compiled else "plain Python (slow: not decorated)"


def flown_laws(result: xr.Dataset) -> dict[str, dict]:
    """Laws and estimators that were flown, by key: name, parameters, text, how they ran.

    >>> {key: law["name"] for key, law in torquer.flown_laws(result).items()}
    {'law': 'bdot'}
    """
    return json.loads(result.attrs["laws"])
