"""Whether a run has ended by its condition: looked at at each record, of one member or of many."""

from typing import NamedTuple

import numpy as np

from torquer.scenario.change import with_values
from torquer.scenario.ending import EndWhen
from torquer.scenario.spec import Scenario
from torquer.simulation.loop.state import Dynamics, State
from torquer.simulation.results.momenta import Carried, momentum_size
from torquer.spacecraft.actuators.rotors import Rotors

#: Of what a member remembers: nothing yet.
NOT_YET = np.inf


class Seen(NamedTuple):
    """What n members remember: the signal at the start, since when the condition holds [s]."""

    start: np.ndarray
    since_s: np.ndarray


def has_ended(when: EndWhen, t_s: float, signal: np.ndarray, seen: Seen) -> np.ndarray:
    """Whether the condition has held long enough at a record (n,); `seen` goes on with it.

    Not at the start: no run is without a step.
    """
    seen.start[...] = np.where(seen.start == NOT_YET, signal, seen.start)
    value = signal / np.where(seen.start == 0.0, np.nan, seen.start) if when.of_start else signal
    holds = value < when.below if when.below is not None else value > when.above
    seen.since_s[...] = np.where(holds, np.minimum(seen.since_s, t_s), NOT_YET)
    return holds & (t_s > 0.0) & (t_s - seen.since_s >= when.for_s * (1.0 - 1e-12))


def fastest_axis_deg_s(omega_body: np.ndarray) -> np.ndarray:
    """Greatest size [deg/s] of the rates (..., 3) [rad/s] about the axes of the body."""
    return np.degrees(np.abs(omega_body).max(axis=-1))


def end_signal(
    when: EndWhen, omega_body: np.ndarray, carried: Carried | None, wheels_n_m_s: np.ndarray | None
) -> np.ndarray:
    """The signal (r, n) of a condition; the momenta may be None if it needs none."""
    if when.signal == "rate_fastest_axis_deg_s":
        return fastest_axis_deg_s(omega_body)
    if when.signal == "rate_deg_s" or carried is None or wheels_n_m_s is None:
        return np.degrees(np.linalg.norm(omega_body, axis=-1))
    return momentum_size(carried, omega_body, wheels_n_m_s)


def carried_by(dynamics: Dynamics, rotors: Rotors) -> Carried:
    """What the body and the wheels of one satellite carry, as of one member."""
    axes = np.stack([rotors.rows[f"axis_{c}"] for c in "xyz"], axis=-1)
    rigid = dynamics.rigid
    return Carried(np.array([rigid.inertia]), np.array([rigid.wheel_momentum]), axes[None])


def ends_now(when: EndWhen, t_s: float, state: State, dynamics: Dynamics, rotors: Rotors) -> bool:
    """Whether a satellite's run ends by its condition at a record, where it stands."""
    cells = state.cells
    omega = np.stack([cells[f"omega_{c}"] for c in "xyz"], axis=-1)[None]
    carried, wheels = carried_by(dynamics, rotors), np.zeros((1, 1, 0))
    if len(rotors.rows):
        axial = carried.wheel_axes[0] @ omega[0, 0]
        wheels = (state.rotors["momentum"] - rotors.rows["inertia"] * axial)[None, None]
    signal = end_signal(when, omega, carried, wheels)[0]
    return bool(has_ended(when, t_s, signal, Seen(cells["start_signal"], cells["holds_since_s"])))


def flown_whole(scenario: Scenario) -> Scenario:
    """The scenario without a condition that ends its run early."""
    if scenario.simulation.end_when is None:
        return scenario
    return with_values(scenario, {"simulation.end_when": None})
