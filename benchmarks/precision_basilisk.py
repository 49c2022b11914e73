"""Basilisk (package `bsk`) on the free bodies of the work-precision benchmark.

What differs: it integrates the position too (at rest, without gravity); every step of its task
goes through its scheduler and messages, tens of microseconds. Its attitude, Modified Rodrigues
Parameters, changes to the shadow set at the end of a task's step only, so that such a step must
stay below a turn of the body, also with RKF78, which divides it by its tolerances. The gyrostat is
a hub with a balanced wheel, whose inertia is added to the hub's about its axis: the same equations.
"""

import importlib.util
import math
import time
from collections.abc import Iterator
from functools import partial

import numpy as np
from precision_own import Way
from precision_tasks import Task

RK4_STEPS_S = (0.5, 0.2, 0.1, 0.05, 0.02)
TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
#: Longest step of the task with RKF78 [s], and turn of the body in it [rad].
LONGEST_STEP_S, LONGEST_TURN = 10.0, 5.5
_WHEEL_INERTIA = 1e-3
_NAME = "steps"


def basilisk_ways(task: Task) -> Iterator[Way]:
    """RK4 and RKF78, where Basilisk is installed and nothing turns the body."""
    if not task.is_free or importlib.util.find_spec("Basilisk") is None:
        return
    for step_s in RK4_STEPS_S:
        yield Way("basilisk rk4", step_s, partial(_fly, task, "RK4", step_s, None))
    step_s = min(LONGEST_STEP_S, LONGEST_TURN / float(np.linalg.norm(task.rate)))
    step_s = math.floor(step_s) if step_s > 1.0 else 1.0 / math.ceil(1.0 / step_s)
    for tolerance in TOLERANCES:
        yield Way("basilisk rkf78", tolerance, partial(_fly, task, "RKF78", step_s, tolerance))


def _fly(task, integrator, step_s, tolerance):
    """(Seconds of stepping, attitudes)."""
    from Basilisk.utilities import macros

    simulation, body, _alive = _simulation(task, integrator, step_s, tolerance)
    attitudes, seconds = [], 0.0
    for until in task.times_s:
        simulation.ConfigureStopTime(macros.sec2nano(float(until)))
        start = time.process_time()
        simulation.ExecuteSimulation()
        seconds += time.process_time() - start
        attitudes.append(_quaternion(np.array(body.scStateOutMsg.read().sigma_BN)))
    return seconds, np.array(attitudes)


def _quaternion(sigma) -> np.ndarray:
    """Body to inertial, scalar last, from Modified Rodrigues Parameters."""
    square = sigma @ sigma
    return np.array([*(2.0 * sigma), 1.0 - square]) / (1.0 + square)


def _simulation(task, integrator, step_s, tolerance):
    """The assembled simulation, its spacecraft, and what must outlive this function."""
    from Basilisk.simulation import spacecraft, svIntegrators
    from Basilisk.utilities import SimulationBaseClass, macros

    simulation = SimulationBaseClass.SimBaseClass()
    process = simulation.CreateNewProcess("process")
    process.addTask(simulation.CreateNewTask(_NAME, macros.sec2nano(step_s)))
    body = spacecraft.Spacecraft()
    body.ModelTag = "spacecraft"
    body.hub.mHub = 50.0
    body.hub.r_CN_NInit = body.hub.v_CN_NInit = body.hub.sigma_BNInit = 3 * [[0.0]]
    body.hub.omega_BN_BInit = task.rate[:, None].tolist()
    inertia, wheel = _with_wheel(task, simulation, body)
    body.hub.IHubPntBc_B = inertia.tolist()
    steps = getattr(svIntegrators, f"svIntegrator{integrator}")(body)
    if tolerance is not None:
        steps.relTol = steps.absTol = tolerance
    body.setIntegrator(steps)
    simulation.AddModelToTask(_NAME, body, 1)
    simulation.InitializeSimulation()
    return simulation, body, (steps, wheel)


def _with_wheel(task, simulation, body):
    """(Inertia of the hub, what must stay alive of the wheel that carries the momentum)."""
    from Basilisk.architecture import messaging
    from Basilisk.simulation import reactionWheelStateEffector
    from Basilisk.utilities import simIncludeRW

    momentum = float(np.linalg.norm(task.wheel))
    if momentum == 0.0:
        return np.diag(task.inertia), ()
    axis = task.wheel / momentum
    speed = momentum / _WHEEL_INERTIA - axis @ task.rate
    wheels = simIncludeRW.rwFactory()
    wheel = wheels.create(
        "custom", axis.tolist(), Omega=float(speed) * 30.0 / math.pi, Js=_WHEEL_INERTIA,
        RWModel=messaging.BalancedWheels, useMaxTorque=False, u_max=0.0,
    )  # fmt: skip
    effector = reactionWheelStateEffector.ReactionWheelStateEffector()
    wheels.addToSpacecraft("wheels", effector, body)
    simulation.AddModelToTask(_NAME, effector, 2)
    inertia = np.diag(task.inertia) + _WHEEL_INERTIA * np.outer(axis, axis)
    return inertia, (wheels, wheel, effector)
