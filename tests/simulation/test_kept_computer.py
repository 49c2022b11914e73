"""A flight that keeps the scenario's computer: the bits of `simulate`, and what directs it."""

import math

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings

from torquer import Flight, RunStopped, law, resume, simulate
from torquer.compile import engine
from torquer.computer.interface import Command
from torquer.simulation.setup import size

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")

#: Detumbling, and three states that only flags or commands lead to.
MODES = {
    "flags": ["coils_lost", "spare"],
    "regions": {
        "control": {
            "states": {
                "detumbling": {
                    "laws": ["damping"],
                    "transitions": [
                        {"to": "off", "when": {
                            "signal": "flag", "flag": "coils_lost", "above": 0.5}},
                        {"to": "slow", "when": {"signal": "rate_deg_s", "below": 0.001,
                                                "back_above": 0.5, "threshold": "slow_deg_s"}},
                    ],
                },
                "slow": {"set": {"damping.gain": 1e5}, "laws": ["damping"],
                         "commanded": True},
                "off": {"coils": "off",
                        "transitions": [{"to": "detumbling", "when": {
                            "signal": "flag", "flag": "coils_lost", "below": 0.5}}]},
            },
        },
        "clock": {
            "states": {
                "tick": {"transitions": [{"to": "tock", "at_most_s": 60.0}]},
                "tock": {"transitions": [{"to": "tick", "at_most_s": 60.0}]},
            },
        },
    },
}  # fmt: skip
KEYS = {
    "spacecraft.magnetometer": {"noise_nt": 50.0},
    "spacecraft.coils": {"limit_a_m2": 3.0, "lag_s": 0.7},
    "control": {
        "laws": {"damping": {"kind": "bdot", "gain_a_m2_s_per_t": 1e6}},
        "modes": MODES,
        "sample_s": 3.0,
    },
    "simulation": {"duration_s": 602.0, "record_s": 7.0},
    "seed": 7,
}


def fly(flight, most=None, direct=None):
    """Go on with the computer's own commands; `direct(flight, step)` may direct it before."""
    steps = 0
    while steps != most and flight.read() is not None:
        if direct:
            direct(flight, steps)
        flight.command()
        steps += 1
    return steps


def kept(make, **keys):
    return Flight(make(KEYS | keys), keeps_computer=True)


def same(a, b):
    """Whether all variables are the same, bit for bit, the checkpoint too."""
    assert set(a.variables) == set(b.variables)
    for name in a.variables:
        x, y = a[name].values, b[name].values
        assert np.array_equal(x, y, equal_nan=x.dtype.kind == "f"), name
    return True


@pytest.fixture
def short_pieces(monkeypatch):
    """Runs computed in pieces of ten rows."""
    monkeypatch.setattr(size, "_PIECE_ROWS", 10)


def test_a_flight_left_alone_is_the_run(make, short_pieces):
    flight = kept(make)
    assert fly(flight) == 201
    assert same(flight.result(), simulate(make(KEYS)))


def test_what_is_read_is_what_the_computer_knew_and_answered(make):
    flight = kept(make)
    inputs = flight.read()
    assert inputs.t_s == 0.0 and flight.answer == Command()  # B-dot needs two readings
    flight.command()
    inputs = flight.read()
    assert inputs.t_s == 3.0 and math.hypot(*flight.answer.dipole_a_m2) > 0.0
    assert repr(flight.read()) == repr(inputs)  # not commanded yet: it stands


def test_a_flag_moves_the_table_at_the_next_control_step(make):
    seen = {}

    def direct(flight, step):
        seen[step] = flight.modes()["control"]
        if step in (10, 20):
            flight.set_flag("coils_lost", step == 10)

    flight = kept(make)
    fly(flight, direct=direct)
    assert [k for k, state in seen.items() if state == "off"] == [*range(11, 21)]
    dipole = flight.result()["command_body"].values
    assert np.all(dipole[5:8] == 0.0) and np.all(np.any(dipole[10:] != 0.0, axis=1))  # 35 to 49 s


def test_a_commanded_state_is_entered_as_by_a_transition(make):
    """Its parameters are set, its entry counted; the time in it starts."""

    def direct(flight, step):
        if step == 10:
            flight.command_mode("control", "slow")

    flight = kept(make)
    fly(flight, 11, direct)
    assert flight.modes()["control"] == "detumbling"
    flight.read()
    assert flight.modes() == {"control": "slow", "clock": "tick"}
    assert flight.parameter("damping.gain") == (1e5,)
    result = flight.result()
    entered = result["mode_entered"].sel(mode="control.slow")
    assert float(entered) == 33.0 and result["mode_entries"].sel(mode="control.slow") == 1


def test_a_held_region_stays_and_goes_on_when_released(make):
    """Its clock runs on: what was due for long happens at once; other regions do not care."""
    seen = {}

    def direct(flight, step):
        seen[3 * step] = flight.modes()["clock"]
        if step in (5, 50):
            flight.hold("clock", step == 5)
        if step == 30:
            flight.command_mode("clock", "tock")

    flight = kept(make)
    fly(flight, direct=direct)
    changes = [t for t in seen if t and seen[t] != seen[t - 3]]
    assert changes[:3] == [93, 153, 213]  # commanded while held; 60 s later it was due; released
    assert changes[2:] == [*range(213, 600, 60)]


def test_commands_go_past_the_computer(make):
    flight = kept(make)
    for _ in range(3):
        flight.read()
        flight.command(dipole_a_m2=(0.1, 0.2, 0.3))
    assert flight.read().coil_dipole_body_a_m2 == pytest.approx((0.1, 0.2, 0.3), abs=0.03)


def test_a_threshold_is_changed_in_flight(make):
    """The rate is about 5 deg/s: below a threshold of 50 it is slow."""
    flight = kept(make)
    fly(flight, 5)
    assert flight.parameter("modes.slow_deg_s") == (0.001,)
    with pytest.raises(ValueError, match=r"modes.slow_deg_s: must be less than 0.5; received 50"):
        flight.set_parameter("modes.slow_deg_s", 50.0)
    flight.set_parameter("modes.slow_deg_s", 0.4)
    assert flight.parameter("modes.slow_deg_s") == pytest.approx((0.4,))
    keys = {"control.modes.regions.control.states.detumbling.transitions": [
        {"to": "slow", "when": {"signal": "rate_deg_s", "below": 0.001, "threshold": "slow"}},
        {"to": "off", "when": {"signal": "flag", "flag": "spare", "above": 0.5}},
    ]}  # fmt: skip
    free = Flight(make(KEYS).replace(*keys.popitem()), keeps_computer=True)
    fly(free, 5)
    free.set_parameter("modes.slow", 50.0)
    fly(free, 1)
    assert free.modes()["control"] == "slow"


def test_a_restart_is_that_of_a_computer_that_failed(make):
    """As a failure that ends at that control step; modes, parameters, memory from the start."""
    failing = make(
        KEYS | {"control.failures": [{"kind": "restarted", "from_s": 29.0, "until_s": 30.0}]}
    )
    flight = kept(make)

    def direct(flight, step):
        if step == 9:
            flight.restart_computer()

    fly(flight, direct=direct)
    a, b = flight.result(), simulate(failing)
    for name in ("q_body_to_inertial", "omega_body", "command_body", "mode_control", "mode_clock"):
        assert np.array_equal(a[name].values, b[name].values), name


DIRECTIONS = st.lists(
    st.tuples(
        st.integers(0, 60),
        st.sampled_from([
            ("set_flag", "coils_lost", True), ("set_flag", "coils_lost", False),
            ("command_mode", "control", "slow"), ("command_mode", "clock", "tock"),
            ("hold", "clock", True), ("hold", "clock", False), ("hold", "control", True),
            ("set_parameter", "damping.gain", 3e5), ("restart_computer",),
            ("calibrate", "magnetometer", (1.0, 0.1, 0, 0, 1.0, 0, 0, 0, -1.0), (1e-6, 0, 0)),
            ("calibrate", "magnetometer"), ("calibrate_coils", (0.5, 1.0, 2.0)),
        ]),
    ),
    max_size=8,
)  # fmt: skip


@given(directions=DIRECTIONS, split=st.integers(0, 60))
@settings(
    max_examples=10, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_directed_flights_go_back_and_resume_to_the_bit(make, directions, split):
    """From a snapshot, from a result in a new flight, and by a plain run to the end."""
    scenario = make(KEYS | {"simulation.duration_s": 182.0})

    def direct(flight, step):
        for at, (call, *arguments) in directions:
            if at == step + flown:
                getattr(flight, call)(*arguments)

    flown, flight = 0, Flight(scenario, keeps_computer=True)
    fly(flight, split, direct)
    flight.read()
    kept, middle = flight.snapshot(), flight.result()
    flown = split
    fly(flight, direct=direct)
    whole = flight.result()
    flight.restore(kept)
    fly(flight, direct=direct)
    assert same(flight.result(), whole)
    other = Flight(scenario, keeps_computer=True)
    other.resume(middle)
    fly(other, direct=direct)
    assert same(other.result(), whole)
    if all(at < split for at, _ in directions):
        assert same(resume(middle), whole)


def test_failing_plain_python_law_stops_flight_and_keeps_the_results(make):
    @law(compiled=False)
    def failing(inputs, parameters, memory):
        return 1.0 / (9.0 - inputs.t_s), 0.0, 0.0

    keys = {"control": {"laws": {"a": {"kind": "off"}}, "sample_s": 3.0}}
    with pytest.raises(ValueError, match="keeps_computer"):
        Flight(make(KEYS)).set_flag("coils_lost", True)
    flight = Flight(make(KEYS | keys), keeps_computer=True, laws={"a": failing})
    with pytest.raises(RunStopped, match=r"must not raise.*at t = 9 s"):
        fly(flight)


@pytest.mark.parametrize(
    ("call", "arguments", "message"),
    [
        ("set_flag", ("coil", True), "flag: must be one of coils_lost, spare; received 'coil'"),
        ("set_flag", ("spare", 1), "on: must be True or False; received 1"),
        ("hold", ("main", True), "region: must be one of control, clock; received 'main'"),
        ("hold", ("clock", None), "on: must be True or False; received None"),
        ("command_mode", ("modes", "tick"),
         "region: must be one of control, clock; received 'modes'"),
        ("command_mode", ("clock", "off"), "clock: must be one of tick, tock; received 'off'"),
        ("set_parameter", ("damping.k", 1.0),
         "name: must be one of damping.gain, modes.slow_deg_s; "
         "received 'damping.k'"),
        ("set_parameter", ("damping.gain", math.nan),
         "damping.gain: must be a finite number; received nan"),
        ("set_parameter", ("damping.gain", (1.0, 2.0)),
         "damping.gain: must be a finite number; received (1.0, 2.0)"),
        ("set_parameter", ("damping.gain", -3e5),
         "damping.gain: must be at least 1e-15, at most 1e+20; received -300000"),
        ("set_parameter", ("modes.slow_deg_s", "x"),
         "modes.slow_deg_s: must be a finite number; received 'x'"),
        ("parameter", ("modes.fast",),
         "name: must be one of damping.gain, modes.slow_deg_s; "
         "received 'modes.fast'"),
    ],
)  # fmt: skip
def test_each_name_is_checked(make, call, arguments, message):
    flight = kept(make)
    with pytest.raises(ValueError) as refused:
        getattr(flight, call)(*arguments)
    assert str(refused.value) == message
