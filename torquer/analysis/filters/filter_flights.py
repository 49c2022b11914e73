"""Flights of a scenario's filter: its estimates beside the truth, run after run."""

import math
from collections.abc import Callable, Iterable

import numpy as np

from torquer.analysis.control_cycle import control_times
from torquer.analysis.filters.filter_statistics import FilterRuns
from torquer.analysis.filters.filter_verdict import WHY_NOT_STARTED
from torquer.analysis.filters.linear_covariance import Motion, kalman_filter
from torquer.computer.estimation.measurements.table import DEVICE_OF
from torquer.maths.geometry.attitudes import rotation_vector
from torquer.scenario.control import common_divisor, whole_steps
from torquer.scenario.resolution import part_damped, told_of_steps
from torquer.scenario.spec import Scenario
from torquer.simulation.loop.members import RUNNING
from torquer.simulation.loop.state import Record
from torquer.simulation.outside.library import Library
from torquer.simulation.setup.ending import flown_whole
from torquer.simulation.setup.prepare import make_log
from torquer.simulation.setup.run import Run, prepare
from torquer.simulation.setup.stopped import reason
from torquer.spacecraft.actuators.coils import NO_COILS
from torquer.spacecraft.actuators.rotors import rotor_axis
from torquer.spacecraft.sensors.gyro import fill_drift


def fly_filter(
    members: Iterable[Scenario],
    flown: Callable[[], None] | None = None,
    library: Library | None = None,
) -> FilterRuns:
    """Fly runs with a filter on one orbit; its estimates and the truth.

    At the records that fall on control steps: ValueError if not all do (`simulation.record_s` must
    be a multiple of the control cycle), unless there are some at every control step; and for a run
    that stops early. `flown` is called after each run; `library`: the computer in C of all runs.
    """
    piece, found, motions, costs = None, [], [], []
    for member in members:
        member = flown_whole(member)  # all runs must have the same records
        run = prepare(member, piece=piece, library=library)
        piece = piece or run.piece
        rows = control_rows(member)
        recorded = record_run(run)
        motions.append(_motion(run, recorded, rows))
        found.append([part[rows] for part in _fly(run, recorded)])
        costs.append(run.state.cells[0][["damping", "lag"]].tolist())
        if flown:
            flown()
    errors, covariance, rejected, starts, why, *each = map(np.stack, zip(*found, strict=True))
    innovations = dict(zip(measured_by(member), each, strict=True))
    t_s = motions[0].t_s
    damping, lag = np.max(costs, axis=0)
    steps = (*told_of_steps(float(part_damped(damping)), math.degrees(lag)),)
    return FilterRuns(t_s, errors, covariance, innovations, rejected, starts, why, motions, steps)


def control_rows(scenario: Scenario) -> np.ndarray:
    """Numbers of the records to evaluate: those on control steps; see `fly_filter`."""
    control, record_s = scenario.control, scenario.simulation.record_s
    count = math.ceil(scenario.length_s / record_s - 1e-9)
    if record_s == finest_record_s(scenario):
        rows = np.round(control_times(scenario) / record_s).astype(int)
        return rows[rows < count]
    cycle = "control.sample_s" if control.measure_s == 0.0 else "the control cycle"
    whole_steps("simulation.record_s", record_s, control.cycle_s, cycle)
    return np.arange(count)


def finest_record_s(scenario: Scenario) -> float:
    """Record interval that has every control step among its records."""
    control = scenario.control
    if control.measure_s == 0.0:
        return control.sample_s
    assert control.actuate_s is not None
    return common_divisor({"sample_s": control.sample_s, "actuate_s": control.actuate_s})


def record_run(run: Run) -> Record:
    """The record of a whole run."""
    parts: list[Record] = []
    run.keep = lambda run: parts.append(run.rows())
    ended = run.advance_to(run.steps)
    if ended != RUNNING:
        raise ValueError(f"seed {run.scenario.seed}: {reason(run, ended)}")
    parts.append(run.rows())
    return Record(*(np.concatenate(each) for each in zip(*parts, strict=True)))


def _motion(run: Run, recorded: Record, at: np.ndarray) -> Motion:
    """The motion that was flown."""
    rows, rotors = recorded.rows[at], run.plan.plant.rotors
    count = len(rotors.rows)
    axes = np.reshape([rotor_axis(rotors.rows, k) for k in range(count)], (count, 3))
    momentum = recorded.wheels[at, :count] @ axes
    q = np.stack([rows[f"q_{c}"] for c in "xyzw"], axis=1)
    omega = np.stack([rows[f"omega_{c}"] for c in "xyz"], axis=1)
    return Motion(run.scenario.simulation.record_s * at, q, omega, momentum)


def _fly(run: Run, recorded: Record) -> tuple[np.ndarray, ...]:
    """Errors, covariance, readings rejected, starts, reasons for none, innovations by sensor."""
    rows, known, logged = recorded.rows, recorded.known, _read_log(run, recorded.log)
    spec = kalman_filter(run.scenario)
    q, true = (np.stack([each[f"{key}_{c}"] for c in "xyzw"], axis=1)
               for each, key in ((known, "estimate_q"), (rows, "q")))  # fmt: skip
    t_s = run.scenario.simulation.record_s * np.arange(len(rows))
    omega = np.stack([rows[f"omega_{c}"] for c in "xyz"], axis=1)
    truth = true_states(run.scenario, t_s, omega)
    errors = np.hstack([rotation_vector(q, true), truth - logged["states"]])
    covariance = logged["covariance"].reshape(len(rows), *[3 * len(spec.initial_variances())] * 2)
    started = np.isfinite(q[:, 0])
    errors[~started], covariance[~started] = np.nan, np.nan
    nothing = np.zeros((len(rows), 1))
    counts = [logged.get(name, nothing)[:, 0] for name in ("rejected", "starts", WHY_NOT_STARTED)]
    units = run.scenario.spacecraft.units()
    of_units = logged.get("innovation_units", np.empty((len(rows), 0))).reshape(len(rows), -1, 3)
    single = {each.name: of_units[:, k] for k, each in enumerate(spec.measured(units))}
    innovations = [
        single[name] if name in single else logged[f"innovation_{name}"]
        for name in measured_by(run.scenario)
    ]
    return errors, covariance, *counts, *innovations


def measured_by(scenario: Scenario) -> list[str]:
    """What a scenario's filter measures with: kinds of sensors, or each of several by name."""
    spec, found = kalman_filter(scenario), []
    units = spec.measured(scenario.spacecraft.units())
    for sensor in spec.sensors:
        own = [each.name for each in units if each.device is DEVICE_OF[sensor]]
        found += own or [sensor]
    return found


def _read_log(run: Run, log: np.ndarray) -> dict[str, np.ndarray]:
    """What the estimator logged, by name."""
    found, first = {}, 0
    for name, _, _, cells in make_log(run.blocks):
        if name.startswith("estimator."):
            found[name.removeprefix("estimator.")] = log[:, first : first + len(cells)]
        first += len(cells)
    return found


def true_states(scenario: Scenario, t_s: np.ndarray, omega: np.ndarray) -> np.ndarray:
    """True values (k, n - 3) of the states of a scenario's filter beyond the attitude.

    At the times `t_s` (k,), at which the body's rate was `omega` (k, 3). NaN for the bias of the
    gyro where there is not one gyro.
    """
    craft = scenario.spacecraft
    coils = craft.coils.pack() if craft.coils else NO_COILS
    constant: dict = {"residual_dipole": coils.residual_a_m2}
    constant["magnetometer_bias"] = craft.one_of("magnetometer").pack().bias_t
    for name in ("magnetometer", "gyro"):
        sensor = craft.one_of(name)
        constant[f"{name}_scale"] = sensor.scale_error
        constant[f"{name}_misalignment"] = np.radians(sensor.misalignment_deg)
    found = []
    for name in [*kalman_filter(scenario).initial_variances()][1:]:
        if name == "rate":
            found.append(omega)
        elif name == "gyro_bias" and "gyro" not in craft.flown():
            # of several gyros it is the bias of whichever is read at the time
            found.append(np.full((len(t_s), 3), np.nan))
        elif name == "gyro_bias":
            found.append(_drift(scenario, t_s))
        else:
            found.append(np.tile(constant[name], (len(t_s), 1)))
    return np.hstack(found)


def _drift(scenario: Scenario, t_s: np.ndarray) -> np.ndarray:
    """The gyro's bias (k, 3) at its latest readings before the times `t_s`."""
    gyro, read_s = scenario.spacecraft.gyro.pack(), control_times(scenario)
    if own_s := scenario.spacecraft.gyro.sample_s:
        read_s = np.arange(0.0, t_s[-1] + own_s, own_s)
    latest = np.searchsorted(read_s, t_s * (1.0 + 1e-12) + 1e-9, side="right") - 1
    out = np.zeros((len(read_s), 3))
    fill_drift(gyro, scenario.seed, read_s, out)
    return out[latest] + np.array(gyro.bias_rad_s)
