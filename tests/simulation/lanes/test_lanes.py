"""Members side by side fly as each does alone, to the bit."""

import itertools
import re
from pathlib import Path

import numba
import numpy as np
import pytest
from numba import types
from slow_cases import slow_after

from torquer import law
from torquer.compile import engine
from torquer.compile.lanes import LANES, type_with
from torquer.computer.blocks.law import Law
from torquer.environment.local import LocalEnvironment
from torquer.environment.table import build
from torquer.scenario.load import load_scenario, scenario_from_text
from torquer.simulation.lanes.group import Lanes, Pieces, why_not_in_lanes
from torquer.simulation.lanes.laws import law_in_lanes
from torquer.simulation.lanes.packing import pack_member
from torquer.simulation.loop.calibrated import drive_coils_step
from torquer.simulation.loop.due import attitude_sensor_step, gyro_step, magnetometer_step
from torquer.simulation.loop.members import END, Many, draw, each
from torquer.simulation.propagate.adaptive import Auto
from torquer.simulation.propagate.adaptive_lanes import order_5_phase, order_8_phase
from torquer.simulation.propagate.interval import rk4_phase
from torquer.simulation.propagate.lane_stages import own_stage_phase
from torquer.simulation.setup.run import prepare
from torquer.simulation.setup.simulate import simulate
from torquer.spacecraft.sensors.attitude_sensor import Sky
from torquer.spacecraft.sensors.devices import STREAMS

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="lanes are compiled code")
EXAMPLES = Path(__file__).parents[3] / "examples"

HEAD = """
start = 2012-03-04T10:31:47Z
orbit = { kind = "circular", altitude_km = 550, inclination_deg = 60 }
environment.field.kind = "averaged"
spacecraft.body.inertia_kg_m2 = [1.0, 1.3, 1.7]
initial.rate_deg_s = [1.0, -0.6, 0.8]
"""
PLAIN = """
spacecraft.coils.limit_a_m2 = 3.0
control = { law = { kind = "bdot_rate", gain_a_m2_s_per_t = 1e5 }, sample_s = 1.0 }
simulation = { duration_s = 900, record_s = 20, step_s = 1.0 }
"""
#: A satellite with all that members in lanes may have: two scenarios have it, compiled once.
ERRORS = """
spacecraft.coils = { axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], limit_a_m2 = 1.0, \
saturation = "clip", lag_s = 0.7, power_at_limit_w = 2.0, failures = [COILS], \
resolution_a_m2 = 0.05, dead_band_a_m2 = [0.05, 0.1, 0.02, 0], random_error = 0.02 }
spacecraft.magnetometer = { noise_nt = 50, bias_nt = [100, 0, -50], resolution_nt = 20, \
sample_s = 1.5, delay_s = 0.5, misalignment_deg = [1, 2, 3], \
coil_coupling_nt_per_a_m2 = [[30, 2, 1], [-2, 40, 3], [5, 6, 50], [10, -20, 30]], \
coil_offset_nt = [5, -6, 7], soft_iron = [[1.02, 0, 0.01], [0, 1, 0], [0.03, 0, 0.99]], \
failures = [MAGNETOMETER] }
spacecraft.gyro = { noise_deg_s = 0.01, bias_deg_s = [0.1, 0, 0], bias_drift_deg_s_sqrt_s = 1e-3, \
range_deg_s = 20, resolution_deg_s = 1e-3 }
spacecraft.search_coil = { noise_nt_s = 20, bias_nt_s = [5, -8, 2], resolution_nt_s = 3, \
sample_s = 3.0, delay_s = 1.5, scale_error = [0.01, 0, -0.02], misalignment_deg = [1, 2, 3] }
spacecraft.attitude_sensor = { noise_deg = 0.1, error_deg = [0.1, 0.2, 0.3], \
boresight = [0, 3, 4], boresight_noise_deg = 0.3, sun_exclusion_deg = 40, moon_exclusion_deg = 30, \
earth_exclusion_deg = 20, rate_limit_deg_s = 8 }
spacecraft.horizon_sensor = { axis = [0, 0, -1], half_field_deg = 80, noise_deg = 0.2, \
bias_deg = [0.1, 0, 0.2], horizon_km = 8, rate_limit_deg_s = 8, sample_s = 2.0, delay_s = 0.5 }
spacecraft.sun_cells = { normals = [[1, 0, 0], [-1, 0, 0], [0, 1, 1]], half_field_deg = 80, \
noise = 0.01, scale_error = [0.05, 0, -0.05], albedo = 0.3, sample_s = 3.0, delay_s = 1.5 }
spacecraft.sun_sensors = { axes = [[1, 0, 0], [-1, 0, 0], [0, 1, 1]], \
half_field_deg = [60, 80, 50], noise_deg = 0.5, albedo = 0.3, sample_s = 4.0, \
bias_deg = [[0.1, 0, 0], [0, 0.5, 0], [0, 0, 1]], failures = [SUN_SENSORS], \
blind_zones = [{ axis = [1, 0, 0], half_angle_deg = 10, sensors = [0, 2] }] }
disturbance.constant_torque_n_m = [1e-6, 0, 0]
disturbance.random_torque_n_m = 1e-6
simulation = { duration_s = 900, record_s = 15, step_s = 0.5 }
"""
DISTURBANCES = """
environment.atmosphere.kind = "exponential"
spacecraft.aerodynamics.parts = [{ kind = "plate", axis = [0, 1, 1], area_m2 = 2.0, \
centre_m = [0, 0, 0.5] }]
disturbance.unmodelled = { constant_n_m = 1e-6, harmonic_1_n_m = 2e-6, harmonic_2_n_m = 3e-6, \
hold_s = 50.0 }
disturbance.solar_pressure.parts = [{ kind = "plate", axis = [0, 1, 1], area_m2 = 20.0, \
centre_m = [0, 0, 5], specular_reflectivity = 0.3 }, { kind = "sphere", radius_m = 0.3, \
centre_m = [0.1, 0, 0] }]
"""
#: Left out of the other scenario, as numbers.
MORE_DISTURBANCES = """
disturbance.residual_dipole = { constant_a_m2 = [0.1, 0, 0], amplitude_a_m2 = [0, 0.2, 0.1], \
cycles_per_orbit = 7.5, phase_deg = 20 }
disturbance.eddy_currents.damping_n_m_s_per_t2 = [[1e4, 1e3, 0], [1e3, 2e4, 0], [0, 0, 3e4]]
"""
LAWS = """
control.ephemeris = { along_track_error_m = 3e4, clock_error_s = 5.0, \
field = { kind = "igrf14", held_at_year = 2015 } }
control.sample_s = 1.5
control.measure_s = 3.0
control.actuate_s = 3.0
control.control_while_actuating = true
control.laws.braking = { kind = "bdot", gain_a_m2_s_per_t = 1e6 }
control.laws.damping = { kind = "bdot_derivative", gain_a_m2_s_per_t = 1e5 }
control.laws.turning = { kind = "preliminary_1", gain_a_m2_per_t = 1e3, axis = [0, 0, 1], \
target = "sun" }
control.laws.holding = { kind = "three_axis", angle_gain_n_m_per_t2 = 1.0, \
rate_gain_n_m_s_per_t2 = 1e3, reference = "orbital" }
"""
MODES = """
control.sample_s = 3.0
control.failures = [{ kind = "halted", from_s = 200, until_s = 230 }]
control.estimators.by_field = { kind = "rate_from_field" }
control.laws.damping = { kind = "bdot", gain_a_m2_s_per_t = 2e5 }
control.laws.turning = { kind = "preliminary_1", gain_a_m2_per_t = 1e3, axis = [1, 0, 0], \
target = "sun" }
control.modes.inertia_kg_m2 = [1.0, 1.3, 1.7]
control.modes.noise = { magnetometer_noise_nt = 100, sun_noise_deg = 1.0, gyro_noise_deg_s = 0.02, \
rate_tolerance_deg_s = 0.1 }
control.modes.states.damping = { laws = ["damping"], estimator = "by_field", transitions = [ \
{ to = "turning", when = { signal = "rate_deg_s", below = 1.5 } }, \
{ to = "failing", when = { signal = "sensor_suspected", sensor = "magnetometer", above = 0.5 } }] }
control.modes.states.failing = { laws = ["turning"], coils_off = ["y"], transitions = [ \
{ to = "damping", at_least_s = 30, back_off = 1.5, most_entries = 3 }] }
control.modes.states.turning = { laws = ["turning"], \
set = { "turning.gain" = 2e3 }, transitions = [ \
{ to = "damping", when = { signal = "rate_deg_s", above = 2.0 } }] }
"""
FAILURES = {
    "MAGNETOMETER": """{ kind = "zeros", from_s = 400, until_s = 500 }, \
{ kind = "noise", noise_nt = 3000, from_s = 500, until_s = 600 }, \
{ kind = "swapped", axes = "xz", from_s = 550, until_s = 650 }, \
{ kind = "stuck", from_s = 700 }""",
    "SUN_SENSORS": """{ kind = "silent", from_s = 300, until_s = 350 }, \
{ kind = "bias", bias_deg = [5, -3, 2], from_s = 500 }""",
    "COILS": """{ coil = 1, kind = "reversed", from_s = 100, until_s = 600 }, \
{ coil = 0, kind = "stuck", dipole_a_m2 = 0.5, from_s = 301, until_s = 500 }, \
{ coil = 2, kind = "dead", from_s = 650 }""",
}


def with_errors(text, failures):
    """All errors with more of the scenario, and what fails of each sensor."""
    return re.sub("|".join(FAILURES), lambda found: failures.get(found[0], ""), ERRORS) + text


#: As much as members may have of what flies in lanes, scenario by scenario.
SCENARIOS = {
    "plain": PLAIN,
    "errors and disturbances of all kinds, laws that see the Sun": with_errors(
        LAWS + DISTURBANCES + MORE_DISTURBANCES, {}
    ),
    "modes, an estimator, sensors that fail": with_errors(MODES + DISTURBANCES, FAILURES),
}
STATED = """
start = 2026-03-21T00:00:00Z
orbit = { kind = "circular", altitude_km = 830, inclination_deg = 98.8 }
environment.field.kind = "igrf14"
spacecraft.body = { inertia_kg_m2 = [3800, 2200, 3600], wheel_momentum_n_m_s = [0, 30, 0] }
spacecraft.coils.limit_a_m2 = 250.0
initial = { reference = "orbital", euler_deg = [5, -4, 5], rate_deg_s = [0.02, -0.02, 0.02] }
control.estimator.kind = "law"
simulation = { duration_s = 6000, record_s = 100, step_s = 1.0 }
[control.laws.gyro]
LAW
[control.laws.holding]
kind = "three_axis"
rate_gain_n_m_s_per_t2 = 5.65e7
angle_gain_n_m_per_t2 = 1.72e4
"""
RATES = np.linspace(0.2, 3.0, 21)


def motions(run):
    """First motions of 21 members."""
    first = np.array(run.state.cells.view(np.float64)[:7])
    moved = np.tile(first, (len(RATES), 1))
    moved[:, 4:] *= RATES[:, None]
    return moved


def alone(scenario, run, motion, seed, given):
    """Attitude and rate of one member at its records."""
    own = prepare(scenario.replace("seed", int(seed)), laws=given, piece=run.piece)
    own.state.cells.view(np.float64)[:7] = motion
    if wheels := scenario.spacecraft.wheels:
        own.state.rotors[:] = wheels.first_state(own.plan.plant.rotors, motion[4:])
    assert own.advance_to(own.steps) == 0
    rows = own.rows().rows
    kept = np.column_stack([rows[name] for name in rows.dtype.names[1:8]])
    return kept, own.state.cells[0]


def fly_both(scenario, given=None, rows=(0, 7, 15, 16, 20)):
    """Some members beside others and alone."""
    run = prepare(scenario, laws=given)
    assert why_not_in_lanes(run) == ""
    lanes, seeds = Lanes(run, Pieces(run)), np.arange(100, 100 + len(RATES))
    flown = lanes.fly(lanes.numbers_of(motions(run)), seeds)
    assert not flown.failed.any()
    for row in rows:
        kept, cells = alone(scenario, run, motions(run)[row], seeds[row], given)
        yield flown.motion[: len(kept), :, row], kept, flown.cells[row], cells


def tip_off():
    """The example of a campaign, whose sensors have errors: flights of twins compile it, too."""
    scenario = load_scenario(EXAMPLES / "tip_off_campaign.toml")
    times = {"duration_s": 900.0, "record_s": 20.0, "step_s": 1.0}
    scenario = scenario.replace("spacecraft.magnetometer.coil_disturbance_nt_per_a_m2", 30.0)
    return scenario.replace("simulation", times).replace("initial.rate_deg_s", [1.0, -0.6, 0.8])


@pytest.mark.parametrize("name", slow_after(2, ["plain", "tip-off", *[*SCENARIOS][1:]]))
def test_member_flown_side_by_side_matches_its_own_flights_bits(name):
    scenario = tip_off() if name == "tip-off" else scenario_from_text(HEAD + SCENARIOS[name])
    for beside, kept, cells, own in fly_both(scenario):
        assert np.array_equal(beside, kept)
        for total in ("coil_energy_j", "peak_dipole_a_m2"):
            assert cells[total] == own[total], total
        for key in ("damping", "lag"):  # how well the step follows
            assert cells[key] == own[key], key


def test_an_estimate_that_a_law_states_is_each_members_own():
    """Another law uses it, from the second stage of the first on."""
    text = (EXAMPLES / "magneto_gyro.toml").read_text()
    own = text.partition("[control.law]")[2].partition("[simulation]")[0]
    scenario = scenario_from_text(STATED.replace("LAW", own))
    for beside, kept, _, _ in fly_both(scenario, rows=(0, 20)):
        assert np.array_equal(beside, kept)
    assert np.isfinite(simulate(scenario).q_estimated.values[-1]).all()


@law
def following_its_coils(inputs, parameters, memory):
    """Half of what the coils have done, and some of the field."""
    m, b = inputs.coil_dipole_body_a_m2, inputs.b_body_t
    return (0.1 - 0.5 * m[0], 1e3 * b[1] - 0.5 * m[1], 0.2 - 0.5 * m[2])


@pytest.mark.parametrize("name", slow_after(1, [*SCENARIOS][:2]))
def test_coil_history_is_known_side_by_side_as_alone(name):
    """Coils with and without lag and measurement window."""
    scenario = scenario_from_text(HEAD + SCENARIOS[name])
    control = scenario.control.model_dump(exclude_unset=True, exclude={"law", "laws"})
    scenario = scenario.replace("control", control | {"law": {"kind": "off"}})
    for beside, kept, cells, own in fly_both(scenario, {"own": following_its_coils}, (0, 20)):
        assert np.array_equal(beside, kept)
        for axis in "xyz":
            assert cells[f"reached_{axis}"] == own[f"reached_{axis}"] != 0.0


def types_in(of_type):
    """A type and, of a tuple, those in it."""
    inner = of_type.types if isinstance(of_type, types.BaseTuple) else ()
    return [of_type, *(each for part in inner for each in types_in(part))]


@pytest.mark.parametrize("name", SCENARIOS)
def test_no_lane_holds_an_array(name):
    """A lane's tuple is made without references of its own: an array in it would be freed."""
    run = prepare(scenario_from_text(HEAD + SCENARIOS[name]))
    plant, dynamics = run.plan.plant, run.dynamics
    own = pack_member(plant, dynamics, run.state)
    for constants, layout in ((plant, own.of_loop), (dynamics, own.of_dynamics)):
        made = type_with(numba.typeof(constants), layout.plant)
        assert not any(isinstance(each, types.Array) for each in types_in(made))


def test_sun_sensors_leave_the_places_of_what_moves_the_body():
    """It is compiled once, with them and without; the loop, which reads them, for each."""
    sensors = 'spacecraft.sun_sensors.preset = "dss3"\n'
    runs = [prepare(scenario_from_text(HEAD + more + PLAIN)) for more in ("", sensors)]
    without, own = (pack_member(run.plan.plant, run.dynamics, run.state) for run in runs)
    assert own.of_dynamics == without.of_dynamics and own.of_loop != without.of_loop
    assert len(own.numbers) == len(without.numbers)


NO_ROWS = ((0.0, 0.0), (0.0, 0.0), (0.0, 0.0))


@law(memory={"rows": NO_ROWS, "calls": 0.0, "b_before": (0.0, 0.0, 0.0)}, parameters={"gain": 2e5})
def remembering(inputs, parameters, memory):
    b, k = inputs.b_body_t, parameters.gain
    before = memory.b_before
    change = (b[0] - before[0], b[1] - before[1], b[2] - before[2])
    memory.calls += 1.0
    memory.b_before[0], memory.b_before[1], memory.b_before[2] = b
    memory.rows[2, 1] = memory.calls
    if memory.rows[2, 1] == 1.0:
        return (0.0, 0.0, 0.0)
    return (-k * change[0], -k * change[1], -k * change[2])


@law(memory=2)
def counting(inputs, parameters, memory):
    memory[0] += 1.0
    memory[1] = inputs.t_s
    return (0.01 * memory[0], 0.0, 1e-5 * memory[1])


@pytest.mark.parametrize("own", [remembering, counting], ids=lambda own: own.name)
def test_laws_of_users_keep_a_memory_for_each_member(own: Law):
    off = 'control.laws.own = { kind = "off" }\ncontrol.sample_s = 1.0\n'
    rest = PLAIN.split("control")[0] + "simulation" + PLAIN.split("simulation")[1]
    scenario = scenario_from_text(HEAD + off + rest)
    for beside, kept, _, _ in fly_both(scenario, {"own": own}, rows=(3, 19)):
        assert np.array_equal(beside, kept)


@pytest.mark.parametrize("own", [remembering, counting], ids=lambda own: own.name)
def test_computers_of_members_restart_as_each_does_alone(own: Law):
    """With the memory and the parameters that each had at the start."""
    off = 'control.laws.own = { kind = "off" }\ncontrol.sample_s = 1.0\n'
    rest = PLAIN.split("control")[0] + "simulation" + PLAIN.split("simulation")[1]
    failed = "control.failures = [{ kind = 'restarted', from_s = 200, until_s = 230 }]\n"
    scenario = scenario_from_text(HEAD + off + failed + rest)
    for beside, kept, _, _ in fly_both(scenario, {"own": own}, rows=(3, 19)):
        assert np.array_equal(beside, kept)


def test_member_tumbling_too_fast_for_the_step_ends_alone():
    scenario = scenario_from_text(HEAD + PLAIN)
    run = prepare(scenario)
    lanes, first = Lanes(run, Pieces(run)), motions(run)
    usual = lanes.fly(lanes.numbers_of(first), np.zeros(len(first), np.int64))
    first[4, 4:] *= 1e4
    flown = lanes.fly(lanes.numbers_of(first), np.zeros(len(first), np.int64))
    assert flown.failed.tolist() == [row == 4 for row in range(len(first))]
    others = ~flown.failed
    assert np.array_equal(flown.motion[..., others], usual.motion[..., others])


ZERO = (0.0, 0.0, 0.0)
LOCAL = LocalEnvironment(ZERO, ZERO, ())
AROUND, LEFT, STEPS = (LOCAL,) * 6, (0.0,) * 6, Auto(1e-12, 1e-15, np.inf, (), ())
SKY = Sky(ZERO, ZERO, ZERO, 2.0)
#: Loops over what moves members, by name; over their devices.
MOVING = {
    "rk4": lambda members: each(members, rk4_phase, LOCAL, LOCAL, LOCAL, ZERO, 1.0),
    "order 5": lambda members: each(members, order_5_phase, STEPS, AROUND, LEFT, 1.0),
    "order 8": lambda members: each(members, order_8_phase, STEPS, LOCAL, 1.0),
    "environment": lambda members, table: each(
        members, own_stage_phase, 1, 0.5, table, 0, 1.0, 1.0
    ),
}
LOOPS = MOVING | {
    "draw": lambda members: draw(members, 1.0, 0, 1),
    "magnetometer": lambda members: each(members, magnetometer_step, 0, ZERO, 0.0),
    "attitude sensor": lambda members: each(members, attitude_sensor_step, 0, SKY, 0.0),
    "gyro": lambda members: each(members, gyro_step, 0, 0.0, 0.0),
    "coils": lambda members: each(members, drive_coils_step),
}


def members_for(loop):
    """What a loop takes."""
    run = prepare(scenario_from_text(HEAD + with_errors(LAWS, {})))
    own = pack_member(run.plan.plant, run.dynamics, run.state)
    cells, seeds = np.repeat(own.numbers, LANES), np.zeros(LANES, np.int64)
    rest = (seeds, np.zeros((STREAMS, 3, LANES)), np.zeros(LANES, END), LANES)
    if loop in MOVING:
        return Many(own.of_dynamics, cells, run.dynamics, *rest)
    return Many(own.of_loop, cells, run.plan.plant, *rest)


def assembly_of(function, *arguments):
    """What a function is compiled to for these arguments."""
    compiled = numba.njit(**engine.OPTIONS)(function)
    compiled.compile(tuple(map(numba.typeof, arguments)))
    return "\n".join(compiled.inspect_asm().values())


def is_of_vectors(assembly):
    """Whether products are of vectors; beside them stands the loop of scalars for arrays that
    overlap, which is never taken, and of which some processors' code has several copies in a row.
    """
    of_blocks = {"p": [], "s": []}
    for block in re.split(r"^\.?L\w+:", assembly, flags=re.M):
        products = re.findall(r"\bv?(?:mul|fmadd\d+|fmsub\d+|fnmadd\d+)(p|s)d\b", block)
        for kind, counts in of_blocks.items():
            counts += [products.count(kind)] if kind in products else []
    scalars = sum(count for count, _ in itertools.groupby(of_blocks["s"]))
    return sum(of_blocks["p"]) >= 0.9 * scalars > 0


def multiply_all(a, b, out):
    for i in range(out.shape[0]):
        out[i] = a[i] * b[i]


def has_wide_vectors():
    """Whether code is compiled for vectors of four doubles or more: with two, the compiler takes
    the step in lanes for not worth it."""
    x = np.zeros(16)
    wide = r"\b[yz]mm\d"
    return re.search(wide, assembly_of(multiply_all, x, x, x)) is not None


@pytest.fixture(scope="module")
def wide_vectors():
    if not has_wide_vectors():
        pytest.skip("needs vectors of four doubles (AVX)")


@pytest.mark.parametrize(
    "name", slow_after(len(LOOPS) - 1, sorted(LOOPS, key=lambda name: name == "attitude sensor"))
)
def test_loops_over_members_are_of_vectors(wide_vectors, name):
    """Easily lost, by a store under a condition, a call, or a short loop that is unrolled."""
    table = build(lambda t_s: np.outer(t_s, np.arange(1.0, 10.0)), 10.0, 5.0, 5)
    more = (table,) if name == "environment" else ()
    assert is_of_vectors(assembly_of(LOOPS[name], members_for(name), *more))


def test_a_laws_loop_over_members_is_of_vectors(wide_vectors):
    gain = 1e5

    def braking(inputs, parameters, memory):  # a closure: compiled here, not found in the cache
        (x, y, z), (wx, wy, wz) = inputs.b_body_t, inputs.estimate.omega_body_rad_s
        return (gain * (wy * z - wz * y), gain * (wz * x - wx * z), gain * (wx * y - wy * x))

    law = Law("braking", numba.njit(braking), needs=frozenset({"rate"}))
    assembly = "\n".join(law_in_lanes(law).compiled.inspect_asm().values())
    assert is_of_vectors(assembly)


def test_what_cannot_fly_side_by_side_is_reported():
    scenario = scenario_from_text(HEAD + PLAIN).replace("simulation.integrator", "splitting")
    expected = "an integrator that splits the motion"
    assert expected in why_not_in_lanes(prepare(scenario))
