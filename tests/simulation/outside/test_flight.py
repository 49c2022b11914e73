"""A flight driven from outside: the same bits as the loop's own run; there and back again."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from integrators import INTEGRATORS, by

import torquer
from torquer import Flight, RunStopped, law, simulate
from torquer.compile import engine
from torquer.simulation.results.dataset import flown_scenario
from torquer.simulation.setup import size

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")

GAIN = 1e6
#: All that remembers or draws random numbers: noise, drift, lag, a measurement window, late
#: readings.
FULL = {
    "spacecraft.magnetometer": {"noise_nt": 50.0, "coil_disturbance_nt_per_a_m2": 100.0},
    "spacecraft.gyro": {"noise_deg_s": 0.01, "bias_drift_deg_s_sqrt_s": 0.001,
                        "sample_s": 1.0, "delay_s": 0.5},
    "spacecraft.sun_sensors": {"axes": [[1, 0, 0], [-1, 2, 0]], "half_field_deg": 80.0,
                               "noise_deg": 0.1},
    "spacecraft.coils": {"limit_a_m2": 3.0, "lag_s": 0.7},
    "control": {"law": {"kind": "bdot", "gain_a_m2_s_per_t": GAIN},
                "sample_s": 3.0, "measure_s": 6.0, "actuate_s": 4.0},
    "simulation": {"duration_s": 602.0, "step_s": 0.5, "record_s": 7.0},
    "seed": 7,
}  # fmt: skip
WHEELS = {
    "spacecraft.wheels": {
        "layout": {"kind": "regular_pyramid", "count": 4, "gamma_deg": 54.7},
        "momentum_limit_n_m_s": 1.0,
        "torque_limit_n_m": 0.02,
        "coulomb_friction_n_m": 5e-4,
    },
}
#: Of the loop, not of what is on board: laws' names, their memory in the checkpoint.
ON_BOARD = ("checkpoint",)


class Bdot:
    """Finite-difference B-dot as software of its own; its state is a plain dictionary."""

    def __init__(self):
        self.before = None
        self.dipole = (0.0, 0.0, 0.0)

    def __call__(self, inputs):
        t, b = inputs.read_at.magnetometer_s, inputs.b_body_t
        if self.before is not None and t > self.before[0]:
            factor = -GAIN / (t - self.before[0])
            self.dipole = tuple(
                factor * (now - then) for now, then in zip(b, self.before[1], strict=True)
            )
        if self.before is None or t > self.before[0]:
            self.before = (t, b)
        return self.dipole


def fly(flight, software, most=None):
    """Answer control steps until the end, or so many; how many were answered."""
    answered = 0
    while answered != most and (inputs := flight.read()) is not None:
        flight.command(software(inputs))
        answered += 1
    return answered


def numbers(inputs):
    """All numbers of inputs as text: equal for equal ones, unknown or not."""
    return repr(inputs)


def same_flight(a, b):
    """Whether all that was recorded is the same, bit for bit."""
    names = set(a.variables) - set(ON_BOARD)
    assert names == set(b.variables) - set(ON_BOARD)
    for name in names:
        assert np.array_equal(
            a[name].values, b[name].values, equal_nan=a[name].dtype.kind == "f"
        ), name
    return a.attrs["table_relative_error"] == b.attrs["table_relative_error"]


@pytest.fixture
def short_pieces(monkeypatch):
    """Runs computed in pieces of ten rows."""
    monkeypatch.setattr(size, "_PIECE_ROWS", 10)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_bdot_outside_flies_as_bdot_on_board(make, integrator):
    scenario = make(FULL | by(integrator))
    flight = Flight(scenario)
    assert fly(flight, Bdot()) == 60 * 3 + 1  # of each cycle, at 0, 3 and 6 s; the last at 600 s
    assert flight.done and flight.now_s == 602.0
    result = flight.result()
    assert (result.attrs["how_it_ended"], result.attrs["ended"]) == ("complete", "complete")
    assert same_flight(result, simulate(scenario))


def test_a_long_flight_goes_through_its_pieces(make, short_pieces):
    """A boundary lies at 70 s, between the control steps at 66 and 73 s, where nothing is due."""
    scenario = make(FULL | {"control.actuate_s": 5.0})
    flight = Flight(scenario)
    fly(flight, Bdot())
    assert same_flight(flight.result(), simulate(scenario))


def test_what_is_read_is_what_a_law_is_given(make):
    """Every field of the inputs, at every control step."""
    scenario, given, shown = make(FULL), [], []

    @law(needs=("ephemeris",), compiled=False)
    def watching(inputs, parameters, memory):
        given.append(inputs)
        return (0.1, 0.0, 0.0)

    simulate(scenario, watching)
    flight = Flight(scenario)
    fly(flight, lambda inputs: shown.append(inputs) or (0.1, 0.0, 0.0))
    assert list(map(numbers, shown)) == list(map(numbers, given))
    assert type(shown[0]) is torquer.Inputs
    assert np.all(np.isfinite(shown[0].ephemeris.b_inertial_t))


def test_software_outside_knows_what_its_coils_have_done(make):
    """Within their limits; off in the measurement window; the same after a restoration."""
    flight = Flight(make({**FULL, "spacecraft.coils": {"limit_a_m2": 3.0}}))
    answer = []
    for k in range(8):
        if k == 5:
            before = flight.snapshot()
        answer.append(flight.read().coil_dipole_body_a_m2)
        flight.command((6.0, 1.0 + k, 0.0))
    off = (0.0, 0.0, 0.0)
    expected = [off, off, off, (3.0, 1.5, 0.0), off, off, (3.0, 3.0, 0.0), off]
    assert np.array(answer) == pytest.approx(np.array(expected), abs=1e-15)
    flight.restore(before)
    flight.read()
    flight.command((6.0, 6.0, 0.0))
    assert flight.read().coil_dipole_body_a_m2 == answer[6]


def test_reading_again_changes_nothing(make):
    flight, calm = Flight(make(FULL)), Flight(make(FULL))
    for _ in range(20):
        first = flight.read()
        assert numbers(flight.read()) == numbers(first) == numbers(calm.read())
        assert flight.now_s == first.t_s
        flight.command((0.3, 0.0, 0.0))
        calm.command((0.3, 0.0, 0.0))


def test_a_command_is_held_until_the_next_one(make):
    """Left out, a part of the command is zero, whatever the last one was."""
    flight = Flight(make({"simulation.record_s": 1.0, "control.sample_s": 5.0} | WHEELS))
    commands = [((1.0, -2.0, 0.5), (1e-3, 2e-3, -1e-3)), ((0.5, 0.0, 0.0),), ()]
    for command in commands:
        flight.read()
        flight.command(*command)
    flight.read()
    result = flight.result()
    dipoles, torques = result.command_body.values, result.torque_command_body.values
    assert dipoles[:5].tolist() == [[1.0, -2.0, 0.5]] * 5
    assert dipoles[5:10].tolist() == [[0.5, 0.0, 0.0]] * 5
    assert dipoles[10:15].tolist() == [[0.0, 0.0, 0.0]] * 5
    assert torques[:5].tolist() == [[1e-3, 2e-3, -1e-3]] * 5
    assert torques[5:15].tolist() == [[0.0, 0.0, 0.0]] * 10


@pytest.mark.parametrize("pieces", [1, 2, 5], ids="{} pieces".format)
def test_a_flight_restored_goes_on_as_it_did(make, monkeypatch, pieces):
    """Both sides go back: a detour of other commands leaves no trace, however often."""
    rows = -(-602 // 7)
    monkeypatch.setattr(size, "_PIECE_ROWS", -(-rows // pieces))
    scenario = make(FULL)
    whole, software = simulate(scenario), Bdot()
    flight = Flight(scenario)
    for _ in range(4):
        fly(flight, software, 30)
        before = flight.snapshot(software)
        for detour in (25, 181):
            fly(flight, lambda inputs: (3.0, -3.0, 3.0), detour)
            software = flight.restore(before)
    fly(flight, software)
    assert same_flight(flight.result(), whole)


def test_snapshots_of_several_instants_are_restored_in_any_order(make, short_pieces):
    scenario, software, snapshots = make(FULL), Bdot(), []
    whole, flight = simulate(scenario), Flight(scenario)
    while (inputs := flight.read()) is not None:
        snapshots.append((inputs, flight.snapshot(software)))
        flight.command(software(inputs))
    assert same_flight(flight.result(), whole)
    for k in (0, 180, 3, 90, 91, 20, 0):
        inputs, snapshot = snapshots[k]
        software = flight.restore(snapshot)
        assert numbers(flight.read()) == numbers(inputs)
        fly(flight, software)
        assert same_flight(flight.result(), whole)


def test_software_handed_over_is_copied(make):
    """What the software does after the snapshot, or after it was restored, does not change it."""
    flight, software = Flight(make(FULL)), {"dipole": [1.0, 2.0]}
    snapshot = flight.snapshot(software)
    software["dipole"].append(3.0)
    restored = flight.restore(snapshot)
    restored["dipole"].append(4.0)
    assert flight.restore(snapshot) == {"dipole": [1.0, 2.0]}
    assert flight.restore(flight.snapshot()) is None


def test_a_snapshot_between_read_and_command_waits_for_the_command(make):
    flight = Flight(make(FULL | {"control": {"law": {"kind": "off"}, "sample_s": 3.0}}))
    inputs = flight.read()
    waiting = flight.snapshot()
    ends = []
    for dipole in ((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (1.0, 0.0, 0.0)):
        flight.restore(waiting)
        assert numbers(flight.read()) == numbers(inputs)
        flight.command(dipole)
        fly(flight, lambda inputs: (0.0, 0.0, 0.0), 5)
        ends.append(numbers(flight.read()))
    assert ends[0] == ends[2] != ends[1]


def test_externally_driven_wheels_turn_as_those_driven_by_law(make):
    stiffness, damping = 0.02, 0.3

    def wheel_torque(inputs):
        q, omega = inputs.estimate.q_body_to_inertial, inputs.estimate.omega_body_rad_s
        sign = -1.0 if q[3] < 0.0 else 1.0
        return tuple(-sign * stiffness * q[k] - damping * omega[k] for k in range(3))

    @law(answers="torque", compiled=False)
    def holding(inputs, parameters, memory):
        return wheel_torque(inputs)

    scenario = make(WHEELS | {"spacecraft.coils": None, "spacecraft.gyro": {"noise_deg_s": 0.01}})
    flight = Flight(scenario)
    while (inputs := flight.read()) is not None:
        flight.command(torque_n_m=wheel_torque(inputs))
    result = flight.result()
    assert same_flight(result, simulate(scenario, holding))
    assert np.abs(result.wheel_torque.values).max() > 1e-3


def test_an_estimator_on_board_works_once_a_control_step(make, short_pieces):
    """Its estimates, recorded and read, are those of a run with a law on board."""
    scenario = make(
        FULL
        | {
            "control.law": {"kind": "bdot_rate", "gain_a_m2_s_per_t": GAIN},
            "control.estimator": {"kind": "rate_from_field"},
        }
    )

    def rate_bdot(inputs):
        w, b = inputs.estimate.omega_body_rad_s, inputs.b_body_t
        cross = (w[1] * b[2] - w[2] * b[1], w[2] * b[0] - w[0] * b[2], w[0] * b[1] - w[1] * b[0])
        return tuple(GAIN * c if np.isfinite(c) else 0.0 for c in cross)

    @law(compiled=False)
    def on_board(inputs, parameters, memory):
        return rate_bdot(inputs)

    flight = Flight(scenario)
    fly(flight, rate_bdot)
    result, own = flight.result(), simulate(scenario, on_board)
    assert same_flight(result, own)
    assert np.isfinite(result.omega_estimated.values[2:]).all()


def test_estimator_none_leaves_attitude_and_rate_unknown(make):
    inputs = Flight(make({"control.estimator": {"kind": "none"}})).read()
    assert np.all(np.isnan(inputs.estimate.omega_body_rad_s))
    assert inputs.omega_body_rad_s == pytest.approx(np.radians([1.0, -0.6, 0.8]))


def test_a_result_underway_and_one_afterwards(make):
    scenario = make(FULL)
    flight = Flight(scenario)
    fly(flight, Bdot(), 50)
    flight.read()
    part = flight.result()
    assert part.attrs["how_it_ended"] == "stopped"
    assert part.attrs["ended"] == f"stopped at t = {flight.now_s:g} s"
    assert part.time.values[-1] == 7.0 * (flight.now_s // 7.0)
    whole = simulate(scenario)
    rows = part.sizes["time"] - 1
    assert np.array_equal(part.omega_body.values[:rows], whole.omega_body.values[:rows])


def test_motion_that_the_step_does_not_follow_stops_the_flight(make):
    """The result so far comes with it, and the flight can be taken back and go another way."""
    strong = {"spacecraft.coils.limit_a_m2": 1e6, "simulation.duration_s": 300.0}
    flight = Flight(make(strong))
    fly(flight, lambda inputs: (0.0, 0.0, 0.0), 20)
    before = flight.snapshot()
    with pytest.raises(RunStopped, match=r"^simulation\.step_s: must be shorter .* from t = "):
        fly(flight, lambda inputs: (1e6, 0.0, 0.0))
    flight.restore(before)
    with pytest.raises(RunStopped) as stopped:
        fly(flight, lambda inputs: (1e6, 0.0, 0.0))
    result = stopped.value.result
    assert not stopped.value.interrupted
    assert result.attrs["how_it_ended"] == "failed"
    assert result.attrs["ended"] == str(stopped.value)
    assert result.time.values[-1] >= 20.0
    flight.restore(before)
    assert fly(flight, lambda inputs: (0.0, 0.0, 0.0)) == 280
    assert flight.result().attrs["ended"] == "complete"


def test_the_last_row_too_must_be_followed(make):
    """As in `simulate`: the loop itself looks at the step only where it goes on."""
    scenario = make({"spacecraft.coils.limit_a_m2": 1e5, "simulation.duration_s": 20.0})

    def late(inputs):
        return (1e5 if inputs.t_s >= 15.0 else 0.0, 0.0, 0.0)

    @law(compiled=False)
    def strong(inputs, parameters, memory):
        return late(inputs)

    with pytest.raises(RunStopped) as own:
        simulate(scenario, strong)
    with pytest.raises(RunStopped) as outside:
        fly(Flight(scenario), late)
    assert str(outside.value) == str(own.value)
    assert "t = 20 s" in str(own.value)


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ({"dipole_a_m2": 1.0}, "dipole_a_m2: must be three numbers; received 1.0"),
        ({"dipole_a_m2": (1.0, 2.0)}, r"dipole_a_m2: must be three numbers; received \(1.0, 2.0\)"),
        ({"dipole_a_m2": "abc"}, "dipole_a_m2: must be three numbers; received 'abc'"),
        ({"dipole_a_m2": None}, "dipole_a_m2: must be three numbers; received None"),
        (
            {"dipole_a_m2": (1.0, float("nan"), 0.0)},
            r"dipole_a_m2: must be finite; received \(1.0, nan, 0.0\)",
        ),
        (
            {"torque_n_m": (0.0, 1e-3, 0.0)},
            r"torque_n_m: must be zero for a satellite without such actuators; received \(0.0, 0.0",
        ),
        ({"torque_n_m": (0.0, "x", 0.0)}, "torque_n_m: must be three numbers"),
    ],
)
def test_impossible_command_is_refused_and_the_next_one_taken(make, command, message):
    flight = Flight(make(FULL))
    inputs = flight.read()
    with pytest.raises(ValueError, match=f"^{message}"):
        flight.command(**command)
    assert numbers(flight.read()) == numbers(inputs)
    flight.command((0.1, 0.0, 0.0))
    assert flight.read().t_s > inputs.t_s


def test_a_dipole_without_coils_is_refused(make):
    flight = Flight(make(WHEELS | {"spacecraft.coils": None}))
    flight.read()
    with pytest.raises(ValueError, match=r"^dipole_a_m2: must be zero for a satellite without"):
        flight.command((0.1, 0.0, 0.0))
    flight.command(torque_n_m=np.array([1e-3, 0.0, 0.0]))


def test_a_command_must_follow_a_read(make):
    flight = Flight(make(FULL))
    with pytest.raises(ValueError, match=r"^command: must follow a read of its own; received a"):
        flight.command((0.1, 0.0, 0.0))
    flight.read()
    flight.command((0.1, 0.0, 0.0))
    with pytest.raises(ValueError, match=r"^command: must follow a read"):
        flight.command((0.1, 0.0, 0.0))
    fly(flight, lambda inputs: (0.0, 0.0, 0.0))
    with pytest.raises(ValueError, match=r"^command: must follow a read"):
        flight.command((0.1, 0.0, 0.0))
    assert flight.read() is None


def test_a_flight_is_of_a_scenario_with_actuators(make):
    with pytest.raises(ValueError, match=r"^scenario: must be a torquer Scenario .* received 'x'"):
        Flight("x")
    with pytest.raises(ValueError, match=r"^spacecraft\.coils: must be given for "):
        Flight(make({"spacecraft.coils": None}))


def test_the_result_can_be_read_back_with_its_scenario(make):
    flight = Flight(make(FULL))
    fly(flight, Bdot(), 3)
    result = flight.result()
    assert flown_scenario(result).simulation == make(FULL).simulation
    assert "flight" in result.attrs["laws"]


CASE = """
import numpy as np
from torquer import Flight, scenario_from_text

flight = Flight(scenario_from_text('''
start = 2025-03-01T00:00:00Z
orbit = { kind = "circular", altitude_km = 500, inclination_deg = 60 }
environment = { field = { kind = "direct_dipole" }, table_tolerance = 1e-6 }
spacecraft.body.inertia_kg_m2 = [1.0, 1.2, 1.5]
spacecraft.coils.limit_a_m2 = 1.0
spacecraft.magnetometer.noise_nt = 20
initial.rate_deg_s = [1, 2, 3]
control = { law = { kind = "off" }, sample_s = 2.0 }
simulation = { duration_s = 20, record_s = 10 }
'''))
for k in range(10):
    b = flight.read().b_body_t
    before = flight.snapshot(k)
    flight.command((1.0, 1.0, 1.0))
    flight.read()
    assert flight.restore(before) == k
    flight.command((3e4 * b[1], -2e4 * b[0], 0.0))
assert flight.read() is None
result = flight.result()
end = np.hstack([result.q_body_to_inertial.values[-1], result.omega_body.values[-1]])
"""


def test_without_the_compiler_a_flight_is_the_same():
    """The same exchange in plain Python, to rounding, with a snapshot on the way."""
    done = subprocess.run(
        [sys.executable, "-c", CASE + "\nprint(*end)"],
        capture_output=True, text=True, timeout=300,
        env={
            **os.environ, "PYTHONPATH": str(Path(torquer.__file__).parents[1]),
            "NUMBA_DISABLE_JIT": "1",
        },
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    exec(compile(CASE, "case", "exec"), here := {})
    assert np.abs(here["end"][4:]).max() > 0.0
    assert np.abs(here["end"] - np.array(done.stdout.split(), dtype=float)).max() < 1e-12


def test_a_computer_in_c_needs_a_computer_on_board(tmp_path):
    scenario = torquer.load_scenario("examples/my_law.toml")
    with pytest.raises(ValueError, match="computer: must be left out unless keeps_computer=True"):
        torquer.Flight(scenario, computer=tmp_path)
