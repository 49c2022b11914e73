"""From a scenario to what the loop takes: plan, integrator, state, record."""

import functools
import math
from collections.abc import Callable, Mapping
from typing import Any, cast

import numpy as np

from torquer.base.columns import array_of, put_numbers, stacked, unstacked
from torquer.base.computing import by_scenario
from torquer.base.shared import shared
from torquer.compile.engine import records
from torquer.computer.allocation import (
    NO_ALLOCATION,
    NO_ALLOCATION_STATE,
    first_allocation,
    make_allocation,
)
from torquer.computer.blocks.block import Block, Logged
from torquer.computer.blocks.law import Law, as_law
from torquer.computer.blocks.user import as_spec
from torquer.computer.calibration import nothing_calibrated
from torquer.computer.computer import (
    NO_ESTIMATOR,
    OF_LAW,
    SENSOR_READINGS,
    Blocks,
    estimates,
    first_board,
    make_computer,
    parameter_places,
)
from torquer.computer.interface import KNOWN, ROWS, TACHOMETERS
from torquer.computer.laws import LAWS
from torquer.computer.modes.table import (
    NO_MODES,
    ModeState,
    ModeTable,
    first_state as first_mode_state,
)
from torquer.environment.along_orbit import OrbitEnvironment
from torquer.maths.geometry.attitudes import to_body
from torquer.maths.geometry.vec3 import as_matrix, as_vector
from torquer.maths.integrate.dop853 import workspace
from torquer.maths.integrate.rk4 import MOST_NUTATION, MOST_TURN
from torquer.scenario.control import whole_steps
from torquer.scenario.held import judged_by_modes
from torquer.scenario.spec import (
    Scenario,
    Spacecraft,
    check_fits,
    check_own_reading,
    check_stated,
    sampling_steps,
)
from torquer.simulation.loop.state import (
    AT_CELLS,
    CELLS,
    ROW,
    SENSOR,
    Dynamics,
    Plan,
    Plant,
    Record,
    State,
)
from torquer.simulation.loop.timetable import Sampling, Timetable, longest_interval, make_timetable
from torquer.simulation.propagate.adaptive import Auto
from torquer.simulation.propagate.fixed_steps import Rk4, Splitting
from torquer.simulation.setup.ending import NOT_YET
from torquer.simulation.setup.own_functions import own_sensor, own_torques
from torquer.simulation.setup.several import make_selection, unit_rows
from torquer.spacecraft.actuators.coils import COIL_STATE, NO_COILS, CoilSet, coil_targets
from torquer.spacecraft.actuators.rotors import NO_ROTORS, ROTOR_STATE
from torquer.spacecraft.actuators.turning import WORK_ROWS
from torquer.spacecraft.body import Rigid
from torquer.spacecraft.disturbance import unmodelled
from torquer.spacecraft.disturbance.acting import magnets_in
from torquer.spacecraft.disturbance.magnets import ROD_STATE, first_memory
from torquer.spacecraft.failures import (
    COIL_FAILURE,
    COMPUTER_FAILURE,
    SENSOR_FAILURE,
    Failures,
)
from torquer.spacecraft.sensors.device import Device
from torquer.spacecraft.sensors.devices import (
    DEVICES,
    SEVERAL,
    SensorSets,
    UnitCounts,
    UnitSets,
    example_of,
)

#: The first step that adaptive steps try [s].
_FIRST_STEP_S = 1.0


def with_given(
    scenario: Scenario, law: Law | Callable | None, laws: Mapping[str, Law | Callable] | None
) -> tuple[Scenario, dict[str, Law]]:
    """The scenario that is flown with laws given in Python, and those laws by name.

    `law` takes the place of all the scenario's laws and modes, those in `laws` of the ones of
    their names.
    """
    control = scenario.control
    of_satellite = functools.partial(_of_satellite, scenario)
    if law is not None:
        given = {"law": as_law(law, "law").filled(of_satellite)}
        changed = {"law": _spec(given["law"]), "laws": {}, "modes": None, "estimators": {}}
    elif laws:
        if control.law is not None and control.law.kind != "off":
            raise ValueError(
                "laws: must be left out for a scenario with control.law, in whose place only `law` "
                f"can be given; received {', '.join(laws)}"
            )
        made = {name: as_law(each, f"laws.{name}") for name, each in laws.items()}
        given = {name: each.filled(of_satellite) for name, each in made.items()}
        own = {name: _spec(each) for name, each in given.items()}
        changed = {"law": None, "laws": control.laws | own}
    else:
        return scenario, {}
    for name, each in given.items():
        if each.name != "off":
            check_fits("law" if law is not None else f"laws.{name}", each, scenario)
    return scenario.model_copy(update={"control": control.model_copy(update=changed)}), given


def _spec(law: Law):
    law.pack()
    return as_spec(law, LAWS)


def make_blocks(scenario: Scenario, given: Mapping[str, Law] | None = None) -> Blocks:
    """Laws and estimators of a scenario; ValueError if the satellite lacks what they need."""
    control, given = scenario.control, given or {}
    of_satellite = functools.partial(_of_satellite, scenario)
    laws = {
        name: (given.get(name) or spec.law()).filled(of_satellite)
        for name, spec in control.named().laws.items()
    }
    for name, law in laws.items():
        if law.name != "off":
            check_fits(control.key_of(name), law, scenario)
    estimators = {"estimator": control.estimator, **control.estimators}
    check_stated(laws.values(), control)
    own = {name: spec for name, spec in estimators.items() if hasattr(spec, "estimator")}
    units = scenario.spacecraft.units()
    made = {name: spec.estimator(units) for name, spec in own.items()}
    for name, estimator in made.items():
        key = "estimator" if name == "estimator" else f"estimators.{name}"
        check_own_reading(f"control.{key}", estimator, scenario.spacecraft)
    return Blocks(laws, made)


@by_scenario
def _earth_at_start(around: OrbitEnvironment) -> tuple:
    return as_matrix(around.dcm_to_ecef(np.zeros(1))[0])


def _of_satellite(scenario: Scenario, name: str) -> tuple:
    """What a law asks of the scenario: see `torquer.computer.blocks.law.OF_SATELLITE`."""
    craft = scenario.spacecraft
    if name == "to_ecef":
        return _earth_at_start(scenario.orbit_environment())
    if name == "inertia_kg_m2":
        return as_matrix(unstacked(stacked(craft.body.inertia), 2))
    if craft.coils is None:
        raise ValueError(f"spacecraft.coils: must be given for a law that asks for {name}")
    return as_vector(craft.coils.reach_a_m2())


def modes_for(scenario: Scenario, blocks: Blocks) -> tuple[ModeTable, ModeState]:
    """The mode table of a scenario and its state at the start."""
    modes = scenario.control.named().modes
    if modes is None:
        return NO_MODES, first_mode_state(NO_MODES, [])
    laws = {name: number for number, name in enumerate(blocks.laws)}
    numbers, places = estimator_numbers(scenario, blocks), parameter_places(blocks)
    craft, wanted = scenario.spacecraft, judged_by_modes(scenario.control)
    if wanted is not None and wanted.targets:
        earth = _of_satellite(scenario, "to_ecef")
        wanted = wanted._replace(targets=wanted.targets._replace(to_ecef=earth))
    return modes.pack(laws, numbers, places, craft.rows(), craft.unit_kinds(), wanted)


def estimator_numbers(scenario: Scenario, blocks: Blocks) -> dict[str, int]:
    """The number by which the computer knows an estimator, by the names of the scenario."""
    trivial = {"attitude_sensor": SENSOR_READINGS, "law": OF_LAW, "none": NO_ESTIMATOR}
    own = {name: number for number, name in enumerate(blocks.estimators)}
    specs = {"estimator": scenario.control.estimator, **scenario.control.estimators}
    return trivial | {
        name: own[name] if name in own else trivial[spec.kind] for name, spec in specs.items()
    }


def collect_needs(blocks: Blocks) -> frozenset[str]:
    """What all blocks need."""
    return frozenset().union(*(block.needs for block in blocks.all()))


def signals_need(scenario: Scenario) -> frozenset[str]:
    """What the conditions of the modes need."""
    modes = scenario.control.named().modes
    return frozenset() if modes is None else modes.needs


def choose_integrator(scenario: Scenario) -> Auto | Rk4 | Splitting:
    """The integrator; its type chooses the code of `propagate`."""
    simulation = scenario.simulation
    if simulation.integrator == "auto":
        count = len(wheels.layout.rows()) if (wheels := scenario.spacecraft.wheels) else 0
        rates = simulation.error_rates(scenario.orbit.period_s)
        longest_s = simulation.max_step_s or math.inf
        return Auto(*rates, longest_s, np.zeros((WORK_ROWS, count)), workspace(7).tableau)
    if simulation.integrator == "splitting":
        return Splitting(*scenario.spacecraft.body.pack_principal())
    return Rk4(MOST_NUTATION, MOST_TURN)


@shared
def timetable_for(scenario: Scenario, needs: frozenset[str]) -> Timetable:
    """When the sensors that are needed are read and the computer controls."""
    craft, control, step_s = scenario.spacecraft, scenario.control, scenario.grid_s
    flown = {each.row: (key, each) for key, each in craft.flown().items()}
    read = {row: _sampling(key, each.spec, step_s) for row, (key, each) in flown.items()}
    read |= {DEVICES.index(device): Sampling() for device in craft.standing_in(needs)}
    if craft.wheels is not None:
        read[TACHOMETERS] = Sampling()
    return make_timetable(
        whole_steps("cycle", control.cycle_s, step_s),
        round(control.measure_s / step_s),
        whole_steps("sample_s", control.sample_s, step_s),
        read,
        control.control_while_actuating,
        [number for number in read if _device_of(craft, number).by_coils],
    )


def _device_of(craft: Spacecraft, row: int) -> Device:
    """The device of a number on board."""
    if row < len(DEVICES):
        return DEVICES[row]
    return next(each.device for each in craft.flown().values() if each.row == row)


def _sampling(name: str, spec, step_s: float) -> Sampling:
    return Sampling(*sampling_steps(f"spacecraft.{name}", spec, step_s))


@shared
def oldest_readings_s(scenario: Scenario, timetable: Timetable) -> tuple[float, ...]:
    """How old readings of each sensor become before the next one arrives [s]; 0 if it has none."""
    delays_s = {each.row: each.spec.delay_s for each in scenario.spacecraft.flown().values()}
    intervals = [longest_interval(timetable, row) for row in range(ROWS)]
    return tuple(
        scenario.grid_s * interval + (delays_s.get(row, 0.0) if interval else 0.0)
        for row, interval in enumerate(intervals)
    )


def make_plan(
    scenario: Scenario,
    blocks: Blocks,
    table: ModeTable,
    modes: ModeState,
    stops: bool,
    driven_from_outside: bool,
) -> Plan:
    """Constants of a run for the loop."""
    simulation, step_s = scenario.simulation, scenario.grid_s
    needs = collect_needs(blocks) | signals_need(scenario)
    wheels = scenario.spacecraft.wheels
    allocation, estimator = NO_ALLOCATION, estimator_numbers(scenario, blocks)["estimator"]
    timetable = timetable_for(scenario, needs)
    oldest_s = oldest_readings_s(scenario, timetable)
    table, selection = table._replace(oldest_s=oldest_s), make_selection(scenario, oldest_s)
    if wheels is not None:
        driven = any(law.drives_wheels for law in blocks.laws.values())
        allocation = by_scenario(make_allocation)(wheels, step_s, driven)
    plan = Plan(
        plant=make_plant(scenario, needs),
        timetable=timetable,
        computer=make_computer(blocks, estimator, table, selection),
        allocation=allocation,
        needs_ephemeris="ephemeris" in needs,
        stops=stops,
        driven_from_outside=driven_from_outside,
        step_s=step_s,
        record_steps=whole_steps("record_s", simulation.record_s, step_s),
        log_cells=np.array([cell for *_, cells in make_log(blocks) for cell in cells], np.int64),
        first_board=first_board(
            blocks, ModeState(*(part.copy() for part in modes)), estimator, selection
        ),
    )
    return records(plan)


@shared
def make_plant(scenario: Scenario, needs: frozenset[str]) -> Plant:
    """Constants of the satellite's devices for the loop."""
    craft, wheels = scenario.spacecraft, scenario.spacecraft.wheels
    return Plant(
        coils=_coil_constants(craft),
        rotors=by_scenario(type(wheels).pack)(wheels, scenario.grid_s) if wheels else NO_ROTORS,
        sensors=_with_own(
            SensorSets(
                *(sensor_constants(device, craft, needs) for device in DEVICES if device.read)
            ),
            scenario,
        ),
        units=UnitSets(*(unit_rows(craft, device) for device in SEVERAL.values())),
        unit_counts=UnitCounts(*(len(getattr(craft, key)) for key in SEVERAL)),
        tachometer_noise_rad_s=wheels.speed_noise_rad_s if wheels else 0.0,
        shadow=scenario.orbit_environment().shadow,
        failures=collect_failures(scenario),
    )


@shared
def _coil_constants(craft: Spacecraft) -> CoilSet:
    return craft.coils.pack() if craft.coils else NO_COILS


def _with_own(sensors: SensorSets, scenario: Scenario) -> SensorSets:
    """The constants with the compiled sensor of the user's own, if there is one."""
    own = own_sensor(scenario)
    return sensors if own is None else cast(Any, sensors)._replace(own_sensor=own)


def make_dynamics(scenario: Scenario, plant: Plant) -> Dynamics:
    """Constants of what moves the body for `propagate`."""
    dynamics = Dynamics(
        rigid=_rigid_body(scenario),
        coils=plant.coils,
        rotors=plant.rotors if scenario.spacecraft.wheels else (),
        held=scenario.held_torque(),
        unmodelled=scenario.unmodelled_torque(),
        switching=(plant.coils.pwm_period_s,) if plant.coils.pwm_period_s > 0.0 else (),
    )
    return records(dynamics)


@shared
def _rigid_body(scenario: Scenario) -> Rigid:
    """Constants of the body and of the torques that act on it."""
    craft, wheels = scenario.spacecraft, scenario.spacecraft.wheels
    tensor = wheels.rotor_tensor_kg_m2() if wheels else None
    acting = own_torques(scenario) + scenario.acting_torques()
    return craft.body.pack(craft.aerodynamics, tensor, acting)


@shared
def collect_failures(scenario: Scenario) -> Failures:
    """All failures of a run."""
    craft = scenario.spacecraft
    sensors = [
        failure.row(each.row, each.device.count, each.device.turns)
        for each in craft.flown().values()
        for failure in each.spec.failures
    ]
    coils = [failure.row() for failure in craft.coils.failures] if craft.coils else []
    computer = [failure.row() for failure in scenario.control.failures]
    return Failures(
        np.array(sensors, SENSOR_FAILURE),
        np.array(coils, COIL_FAILURE),
        np.array(computer, COMPUTER_FAILURE),
    )


@shared
def sensor_constants(device: Device, craft: Spacecraft, needs: frozenset[str]):
    """Constants of a device for kernels; ideal ones where it is left out and needed."""
    if device.name in (flown := craft.flown()):
        return device.constants(flown[device.name].spec)
    if device.need in needs and device.stands_in:
        return device.ideal
    return device.constants(example_of(device)) if device.absent is None else device.absent


def make_log(blocks: Blocks) -> list[tuple[str, Block, Logged, range]]:
    """What is logged: name in the result, block, its part, cells of the board's memory."""
    found, first = [], 0
    for key, block in blocks.by_key().items():
        for name, part in block.logged().items():
            cells = range(first + part.first, first + part.first + part.cells)
            found.append((f"{key}.{name}", block, part, cells))
        first += len(block.first_memory())
    return found


def first_state(
    scenario: Scenario, plan: Plan, dynamics: Dynamics, blocks: Blocks, modes: ModeState, r_m, v_m_s
) -> State:
    """State at the start."""
    cells = records(np.zeros(1, CELLS))
    cells["next_step_s"] = cells["slow_step_s"] = _FIRST_STEP_S
    cells["least_step_s"] = np.inf
    cells["start_signal"] = cells["holds_since_s"] = NOT_YET
    motion = first_motion(scenario, r_m, v_m_s)
    coils, goal = _first_coils(plan.plant.coils)
    cells = put_numbers(put_numbers(cells, 0, motion), CELLS.names.index("goal_x"), array_of(goal))
    sensors = np.zeros(ROWS, SENSOR)
    sensors["t_s"] = -np.inf  # as long as none is on its way
    rotors, allocation = np.zeros(0, ROTOR_STATE), NO_ALLOCATION_STATE
    if dynamics.rotors:
        rotors = _first_rotors(scenario.spacecraft.wheels, plan.plant.rotors, motion[4:])
        allocation = first_allocation(plan.allocation)
    state = State(
        at=np.zeros(AT_CELLS, dtype=np.int64),
        cells=cells,
        sensors=sensors,
        coils=coils,
        rotors=rotors,
        held=array_of(dynamics.held.constant_n_m),
        coefficients=np.zeros(unmodelled.CELLS if dynamics.unmodelled else 0),
        rods=first_rods(scenario, dynamics, motion[None])[0],
        allocation=allocation,
        calibration=nothing_calibrated(),
        board=first_board(blocks, modes, plan.computer.estimator, plan.computer.selection),
    )
    return records(state)


@shared
def first_motion(scenario: Scenario, r_m, v_m_s) -> np.ndarray:
    """Attitude and rate at the start: 7 numbers."""
    return scenario.initial.motion(r_m, v_m_s)


@by_scenario
def _first_coils(coils: CoilSet) -> tuple[np.ndarray, list[float]]:
    """State of the coils at the start, and the numbers of their goal."""
    state = records(np.zeros(len(coils.rows), COIL_STATE))
    goal = coil_targets(coils, state)
    return state, [*goal.dipole_a_m2, goal.power_w, goal.greatest_a_m2]


@by_scenario
def _first_rotors(wheels, rotors, omega) -> np.ndarray:
    return wheels.first_state(rotors, omega)


@by_scenario
def first_rods(scenario: Scenario, dynamics: Dynamics, motions: np.ndarray) -> list[np.ndarray]:
    """What hysteresis rods remember at the start, for each of the motions (n, 7)."""
    magnets = magnets_in(dynamics.rigid.acting)
    if not magnets:
        return [records(np.zeros(0, ROD_STATE)) for _ in motions]
    t_s, environment = np.zeros(1), scenario.orbit_environment()
    b = environment.field(t_s, *environment.state(t_s))
    b_body = to_body(np.ascontiguousarray(motions[:, :4]), np.repeat(b, len(motions), axis=0))
    return [first_memory(magnets, each) for each in b_body]


def empty_record(plan: Plan, rows: int, inputs: bool) -> Record:
    """A record of so many rows; `inputs`: with all that the computer knows."""
    wheels = 2 * len(plan.plant.rotors.rows)
    known = rows if inputs or estimates(plan.computer) else 0
    record = Record(
        np.zeros(rows, ROW),
        np.full((rows, wheels), np.nan),
        np.full((rows, len(plan.log_cells)), np.nan),
        np.full(known, np.nan, KNOWN),
        np.full((rows, len(plan.computer.modes.regions)), np.nan),
    )
    record.rows.view(np.float64)[:] = np.nan
    return records(record)
