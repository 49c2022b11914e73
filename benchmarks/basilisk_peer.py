"""The detumbling task as far as Basilisk (package `bsk`) has it, for its cost per second.

Not the same task, and cheaper on every count where it differs: the field (WMM, degree 12) and
the law run once a second, between the integrator's steps, and the field is held over the step,
where the other rivals evaluate it in every RK4 stage; the Earth stands still. On the other
hand Basilisk integrates the orbit with the attitude, which the others have in closed form.

Basilisk has no B-dot module (its `mtb...` modules unload wheels). The law comes in two ways:
- `constant_dipole`: no law, the coils hold a given dipole: compiled modules only, a lower bound;
- `bdot`: the law as a `NumbaModel`, compiled to machine code inside Basilisk (needs numba).
Nothing is recorded in either.
"""

import importlib.util
import time

from detumble_task import COEFFICIENTS, MU_M3_S2, Task

WMM_FILE = COEFFICIENTS.with_name("WMM2025.COF")
WMM_YEAR = 2025.5
TASK_NAME = "one_second"


def _bdot_module(task: Task):
    """Finite-difference B-dot with saturation: magnetometer message in, coil command out."""
    from Basilisk.architecture import messaging
    from Basilisk.architecture.numbaModel import NumbaModel

    class Bdot(NumbaModel):
        def __init__(self):
            super().__init__()
            self.tamInMsg = messaging.TAMSensorBodyMsgReader()
            self.commandOutMsg = messaging.MTBCmdMsg()
            self.memory.b_before = [0.0, 0.0, 0.0]
            self.memory.calls = 0
            self.memory.gain, self.memory.limit = task.gain, task.dipole_max

        @staticmethod
        def UpdateStateImpl(tamInMsgPayload, commandOutMsgPayload, memory):
            for axis in range(3):
                b = tamInMsgPayload.tam_B[axis]
                wanted = -memory.gain * (b - memory.b_before[axis]) if memory.calls > 0 else 0.0
                dipole = min(max(wanted, -memory.limit), memory.limit)
                commandOutMsgPayload.mtbDipoleCmds[axis] = dipole
                memory.b_before[axis] = b
            memory.calls += 1

    return Bdot()


def _spacecraft(task: Task):
    """Rigid body on the circular orbit about a point-mass Earth; RK4 is Basilisk's default."""
    import numpy as np
    from Basilisk.simulation import spacecraft
    from Basilisk.utilities import simIncludeGravBody

    body = spacecraft.Spacecraft()
    body.ModelTag = "spacecraft"
    body.hub.mHub = 50.0
    body.hub.IHubPntBc_B = np.diag(task.moments).tolist()
    earth = simIncludeGravBody.gravBodyFactory()
    planet = earth.createEarth()
    planet.isCentralBody, planet.mu = True, MU_M3_S2
    earth.addBodiesTo(body)
    speed, i = task.orbit_rate_rad_s * task.radius_m, task.inclination_rad
    body.hub.r_CN_NInit = [[task.radius_m], [0.0], [0.0]]
    body.hub.v_CN_NInit = [[0.0], [speed * np.cos(i)], [speed * np.sin(i)]]
    body.hub.sigma_BNInit = [[0.0], [0.0], [0.0]]
    body.hub.omega_BN_BInit = 3 * [[task.rate_rad_s]]
    return body, planet


def _coils(task: Task, body):
    """Three magnetorquers along the body axes; the message with their limits must stay alive."""
    from Basilisk.architecture import messaging
    from Basilisk.simulation import MtbEffector

    layout = messaging.MTBArrayConfigMsgPayload()
    layout.numMTB = 3
    layout.GtMatrix_B = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
    layout.maxMtbDipoles = 3 * [task.dipole_max]
    layout_message = messaging.MTBArrayConfigMsg().write(layout)
    coils = MtbEffector.MtbEffector()
    coils.mtbParamsInMsg.subscribeTo(layout_message)
    body.addDynamicEffector(coils)
    return coils, layout_message


def _field_and_magnetometer(body, wmm_file):
    """World Magnetic Model at the spacecraft and an ideal magnetometer in body axes."""
    from Basilisk.fswAlgorithms import tamComm
    from Basilisk.simulation import magneticFieldWMM, magnetometer

    field = magneticFieldWMM.MagneticFieldWMM()
    field.configureWMMFile(str(wmm_file))
    field.epochDateFractionalYear = WMM_YEAR
    field.addSpacecraftToModel(body.scStateOutMsg)
    sensor = magnetometer.Magnetometer()
    sensor.stateInMsg.subscribeTo(body.scStateOutMsg)
    sensor.magInMsg.subscribeTo(field.envOutMsgs[0])
    reading = tamComm.tamComm()
    reading.dcm_BS = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
    reading.tamInMsg.subscribeTo(sensor.tamDataOutMsg)
    return field, sensor, reading


def assembled(task: Task, law: str, wmm_file=WMM_FILE):
    """The simulation, not yet initialised; `body`: its spacecraft, `alive`: what must outlive this
    function."""
    from Basilisk.architecture import messaging
    from Basilisk.simulation import GravityGradientEffector
    from Basilisk.utilities import SimulationBaseClass, macros

    simulation = SimulationBaseClass.SimBaseClass()
    process = simulation.CreateNewProcess("process")
    process.addTask(simulation.CreateNewTask(TASK_NAME, macros.sec2nano(1.0)))
    body, planet = _spacecraft(task)
    gradient = GravityGradientEffector.GravityGradientEffector()
    gradient.addPlanetName(planet.planetName)
    body.addDynamicEffector(gradient)
    coils, layout = _coils(task, body)
    field, sensor, reading = _field_and_magnetometer(body, wmm_file)
    coils.magInMsg.subscribeTo(field.envOutMsgs[0])
    models = [body, gradient, field, sensor, reading]
    if law == "bdot":
        bdot = _bdot_module(task)
        bdot.tamInMsg.subscribeTo(reading.tamOutMsg)
        command = bdot.commandOutMsg
        models.append(bdot)
    else:
        held = messaging.MTBCmdMsgPayload()
        held.mtbDipoleCmds = 3 * [task.dipole_max]
        command = messaging.MTBCmdMsg().write(held)
    coils.mtbCmdInMsg.subscribeTo(command)
    models.append(coils)
    for priority, model in enumerate(reversed(models)):
        simulation.AddModelToTask(TASK_NAME, model, priority)
    simulation.body, simulation.alive = body, (planet, layout, command, models)
    return simulation


def _measured(task: Task, law: str, seconds: int, repeats: int, wmm_file) -> dict:
    from Basilisk.utilities import macros

    simulation = assembled(task, law, wmm_file)
    simulation.InitializeSimulation()
    best = float("inf")
    for repeat in range(1, repeats + 1):
        simulation.ConfigureStopTime(macros.sec2nano(float(repeat * seconds)))
        start = time.perf_counter()
        simulation.ExecuteSimulation()
        best = min(best, time.perf_counter() - start)
    rate = [float(x) for x in simulation.body.scStateOutMsg.read().omega_BN_B]
    return {"us_per_second": 1e6 * best / seconds, "final_rate_rad_s": rate}


def measure(task: Task, seconds: int = 5000, repeats: int = 3, wmm_file=WMM_FILE) -> dict | None:
    """Wall time per simulated second [us], best of `repeats` stretches of `seconds`, by law.

    None, and one line, without Basilisk; the law `bdot` is left out without numba.
    """
    if importlib.util.find_spec("Basilisk") is None:
        print("Basilisk: not installed (pip install bsk); left out")
        return None
    laws = ["constant_dipole"]
    if importlib.util.find_spec("numba") is not None:
        laws.append("bdot")
    return {law: _measured(task, law, seconds, repeats, wmm_file) for law in laws}


if __name__ == "__main__":
    import sys

    found = measure(Task(), wmm_file=sys.argv[1] if len(sys.argv) > 1 else WMM_FILE)
    for law, values in (found or {}).items():
        rate = ", ".join(f"{x:.5f}" for x in values["final_rate_rad_s"])
        print(f"Basilisk {law}: {values['us_per_second']:.1f} us per simulated second; rate {rate}")
