"""What made a run stop, in one line."""

import numpy as np

from torquer.simulation.loop.members import BAD_STATE, COARSE_STEP, TILTED
from torquer.simulation.outside.host import what_failed
from torquer.simulation.propagate.adaptive import LEAST_STEP_S, MOST_STEPS
from torquer.simulation.setup.own_faults import find_own_fault
from torquer.simulation.setup.run import Run


def _jumps(run: Run) -> str:
    """What else makes steps vanish."""
    own = run.scenario.disturbance.own if run.scenario.disturbance else {}
    return "".join(
        f"; if disturbance.own.{name} jumps, fixed steps (simulation.step_s) take it"
        for name in own
    )


def reason(run: Run, ended: int) -> str:
    """What made the loop stop, with the time and the state: one line."""
    t, cells = run.now_s, run.state.cells.view(np.float64)
    shown = ", ".join(f"{x:.6g}" for x in cells[:7])
    if fault := find_own_fault(run, ended):
        return f"{fault}; quaternion and rate at t = {t:g} s: {shown}"
    if ended == BAD_STATE and run.state.cells[0]["next_step_s"] <= LEAST_STEP_S:
        return (
            f"the motion is too fast for adaptive steps after t = {t:g} s: they became shorter "
            f"than {LEAST_STEP_S:g} s, or more than {MOST_STEPS} to the next event; last "
            f"quaternion and rate: {shown}{_jumps(run)}"
        )
    if ended == BAD_STATE:
        return (
            f"the state stopped being finite after t = {t:g} s; last quaternion and rate: {shown}"
        )
    if ended == TILTED:
        limit = run.scenario.disturbance.suspension.tilt_limit_deg
        return (
            f"the body tilts beyond the bearing's {limit:g} deg (disturbance.suspension."
            f"tilt_limit_deg) and strikes its ring after t = {t:g} s; last quaternion and rate: "
            f"{shown}"
        )
    if ended == COARSE_STEP:
        return (
            f"simulation.step_s: must be shorter for RK4 to follow the motion from t = {t:g} s on, "
            f"or left out for adaptive steps; received {run.plan.step_s:g} s; quaternion and rate: "
            f"{shown}"
        )
    failed = what_failed(run.blocks, run.plan, run.state)
    return f"{failed} at t = {t:g} s; quaternion and rate: {shown}"
