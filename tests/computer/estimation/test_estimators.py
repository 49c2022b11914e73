"""What holds for every estimator, and which laws may fly with it."""

import dataclasses
import itertools
from pathlib import Path

import numpy as np
import pytest
from law_cases import UNKNOWN, by_hand, compiled, inputs
from law_examples import EXAMPLES
from messages import message_of
from on_board import OnBoard
from pydantic import TypeAdapter
from scipy.spatial.transform import Rotation

import torquer
from torquer import simulate
from torquer.compile import engine
from torquer.computer.computer import make_computer
from torquer.computer.estimation import ESTIMATORS, AnyEstimator
from torquer.computer.interface import UNKNOWN_ESTIMATE
from torquer.computer.laws import LAWS, AnyLaw
from torquer.simulation.outside.host import Host
from torquer.simulation.setup.run import prepare

OWN = Path(__file__).parents[3] / "examples" / "own_parts.py"
#: Keys of an example of each estimator. The filters' are of the kind that tests of them fly.
NOISE = {"magnetometer_noise_nt": 50.0, "sun_noise_deg": 0.5}
KEYS = {
    "attitude_sensor": {},
    "law": {},
    "none": {},
    "rate_from_field": {"interval_s": 1.5},
    "triad": NOISE,
    "kalman_gyro": {
        **NOISE,
        "angle_random_walk_deg_sqrt_s": 0.1,
        "rate_random_walk_deg_s_sqrt_s": 0.01,
        "gyro_bias_sigma_deg_s": 0.1,
        "record_covariance": True,
    },
    "kalman_dynamics": {
        **NOISE,
        "inertia_kg_m2": (1.0, 1.0, 1.0),
        "torque_noise_n_m_sqrt_s": 0.1,
        "rate_sigma_deg_s": 60.0,
        "record_covariance": True,
    },
}
KEYS["user"] = {"file": OWN, "parameters": {"share": 0.3}}
WORKING = [kind for kind, spec in ESTIMATORS.items() if hasattr(spec, "estimator")]
EVERY = pytest.mark.parametrize("kind", WORKING)
SPECS = TypeAdapter(AnyEstimator)


def example(kind):
    return SPECS.validate_python({"kind": kind, **KEYS[kind]}).estimator()


def readings(n=40, turn=None):
    """What a computer reads while it turns; `turn` (matrix): the same in other body axes."""
    rng, rows = np.random.default_rng(3), []
    turn = np.eye(3) if turn is None else turn
    omega, b, sun = np.array([0.1, -0.06, 0.08]), 3e-5 * rng.normal(size=3), (0.6, 0.0, 0.8)
    for i in range(n):
        attitude = Rotation.from_rotvec([1.0, -2.0, 0.5]) * Rotation.from_rotvec(0.5 * i * omega)
        b = b + 1e-6 * rng.normal(size=3)
        field = attitude.inv().apply(b) + 5e-8 * rng.normal(size=3)
        seen = attitude.inv().apply(sun) + 0.008 * rng.normal(size=3)
        seen /= np.linalg.norm(seen)
        read = omega + 0.002 * rng.normal(size=3)
        vectors = (turn @ v for v in (field, 1e-6 * rng.normal(size=3), read, seen))
        q = attitude * Rotation.from_matrix(turn.T)
        place = [size * rng.normal(size=3) for size in (7e6, 7e3)]
        wheels = turn @ rng.normal(size=3) * 1e-3
        coils = turn @ rng.normal(size=3)
        place = [*place, b, (0, 0, 0), sun]
        rows.append(inputs(0.5 * i, *vectors, q.as_quat(), wheels, *place, coils))
    return rows


def estimates(function, estimator, rows):
    """Numbers of each estimate, and the memory that is left."""
    packed, cells = estimator.pack(), estimator.first_memory()
    found = [function(row, packed, cells) for row in rows]
    return [np.hstack([np.ravel(part) for part in estimate]) for estimate in found], cells


def test_every_estimator_has_its_example_here():
    assert set(KEYS) == set(ESTIMATORS)


@pytest.mark.parametrize("kind", ESTIMATORS)
def test_kind_is_the_key_and_specs_survive_json(kind):
    spec = SPECS.validate_python({"kind": kind, **KEYS[kind]})
    assert type(spec) is ESTIMATORS[kind] and spec.kind == kind
    assert SPECS.validate_json(SPECS.dump_json(spec)) == spec


@pytest.mark.parametrize(
    "kind",
    [
        # tests/compile/test_no_jit.py compares the filters in a process without the compiler
        pytest.param(kind, marks=[pytest.mark.slow] if kind.startswith("kalman") else [])
        for kind in WORKING
    ],
)
def test_plain_python_gives_the_same(kind):
    estimator, rows = example(kind), readings()
    one, memory = estimates(by_hand(estimator), estimator, rows)
    other, kept = estimates(compiled(estimator), estimator, rows)
    assert np.array(other) == pytest.approx(np.array(one), rel=1e-12, abs=1e-15, nan_ok=True)
    assert kept == pytest.approx(memory, rel=1e-12, nan_ok=True)


@EVERY
def test_what_it_says_to_give_becomes_known_and_nothing_else(kind):
    found, _ = estimates(compiled(example(kind)), example(kind), readings())
    gives = ESTIMATORS[kind].gives
    for need, part in (("attitude", slice(1, 5)), ("rate", slice(5, 8))):
        assert np.isfinite(found[-1][part]).all() == (need in gives)
        assert np.isnan(found[-1][part]).all() == (need not in gives)


@EVERY
def test_the_rate_turns_with_the_body_axes(kind):
    turn = Rotation.from_rotvec([0.7, -1.1, 0.4]).as_matrix()
    one, _ = estimates(compiled(example(kind)), example(kind), readings())
    other, _ = estimates(compiled(example(kind)), example(kind), readings(turn=turn))
    expected = np.array(one)[:, 5:8] @ turn.T
    assert np.array(other)[:, 5:8] == pytest.approx(expected, rel=1e-9, abs=1e-12, nan_ok=True)


@EVERY
def test_all_that_it_remembers_is_its_memory(kind):
    estimator, rows = example(kind), readings()
    whole, _ = estimates(compiled(estimator), estimator, rows)
    _, cells = estimates(compiled(estimator), estimator, rows[:17])
    packed = estimator.pack()
    function = compiled(estimator)
    rest = [function(row, packed, cells) for row in rows[17:]]
    rest = [np.hstack([np.ravel(part) for part in estimate]) for estimate in rest]
    assert np.array_equal(whole[17:], rest, equal_nan=True)


#: A satellite with all that any law drives.
WHEELS = {"layout": {"kind": "orthogonal"}, "momentum_limit_n_m_s": 1.0, "torque_limit_n_m": 0.1}


LAWS_OF_SCENARIOS = TypeAdapter(AnyLaw)
#: Laws that come with the package.
LAW_SPECS = {
    kind: LAWS_OF_SCENARIOS.validate_python({"kind": kind, **EXAMPLES[kind]})
    for kind in LAWS
    if kind != "user"
}


def expected_of(kind, estimator) -> str:
    """The message about a law with an estimator that does not give what the law needs, or ""."""
    missing = LAW_SPECS[kind].law().needs - ESTIMATORS[estimator].gives
    for need in ("attitude", "rate"):
        if need in missing:
            return (
                f"control.estimator: must give the {need}, which control.law ({kind}) needs; "
                f"received '{estimator}'"
            )
    if estimator == "law" and kind != "magneto_gyro":
        return (
            "control.estimator: must be of another kind than 'law', unless a law states an "
            f"estimate (magneto_gyro); received laws {kind}"
        )
    return ""


def test_laws_needing_more_than_an_estimator_gives_are_rejected(make):
    expected, found = {}, {}
    for kind, estimator in itertools.product(LAW_SPECS, ESTIMATORS):
        law, keys = {"kind": kind, **EXAMPLES[kind]}, {"kind": estimator, **KEYS[estimator]}
        control = {"law": law, "estimator": keys}
        expected[kind, estimator] = expected_of(kind, estimator)
        found[kind, estimator] = message_of(make, {"control": control, "spacecraft.wheels": WHEELS})
    assert found == expected


def test_some_laws_need_no_estimate():
    """Else the test above would refuse everything, or nothing."""
    uninformed = {
        kind for kind, spec in LAW_SPECS.items() if not spec.law().needs & {"attitude", "rate"}
    }
    assert {"off", "bdot", "bdot_derivative", "unloading"} < uninformed < set(LAWS)


@torquer.law(needs=("rate",))
def needs_the_rate(inputs, parameters, memory):
    return inputs.estimate.omega_body_rad_s


@torquer.law(needs=("attitude",))
def needs_the_attitude(inputs, parameters, memory):
    x, y, z, _ = inputs.estimate.q_body_to_inertial
    return (x, y, z)


def test_law_is_not_called_while_the_estimate_is_insufficient():
    laws = {"rate": needs_the_rate, "attitude": needs_the_attitude}
    q, omega = (0.5, 0.5, 0.5, 0.5), (1.0, 2.0, 3.0)
    unknown = UNKNOWN_ESTIMATE.q_body_to_inertial
    for row, dipole in (
        (inputs(q=q, omega=omega), (1.5, 2.5, 3.5)),
        (inputs(q=unknown, omega=omega), (1.0, 2.0, 3.0)),
        (inputs(q=q, omega=UNKNOWN), (0.5, 0.5, 0.5)),
        (inputs(q=unknown, omega=UNKNOWN), (0.0, 0.0, 0.0)),
    ):
        assert OnBoard(laws)(row).dipole_a_m2 == dipole


def test_what_a_law_may_need_is_reported():
    with pytest.raises(ValueError) as error:
        torquer.law(needs=("sun",))(lambda inputs, parameters, memory: (0.0, 0.0, 0.0))
    assert str(error.value) == (
        "law <lambda>: needs must be of ephemeris, attitude, rate; received 'sun'"
    )


@pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
def test_law_without_estimator_sees_readings_and_no_estimate(make):
    @torquer.law(log={"known": "1"})
    def looking(inputs, parameters, memory):
        omega, q = inputs.estimate.omega_body_rad_s, inputs.estimate.q_body_to_inertial
        memory.known = 1.0 if omega[0] == omega[0] or q[3] == q[3] else 0.0
        return inputs.omega_body_rad_s

    for kind, known in (("none", 0.0), ("attitude_sensor", 1.0)):
        control = {"law": {"kind": "off"}, "estimator": {"kind": kind}}
        result = simulate(make({"control": control, "simulation.duration_s": 50.0}), law=looking)
        assert np.array_equal(result["law.known"], np.full(6, known))
        assert np.abs(result["command_body"]).max() > 0.001


@pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
def test_an_estimator_in_plain_python_gives_the_same_run(make):
    """The host takes its estimates; the law stays compiled."""
    control = {
        "law": {"kind": "bdot_rate", "gain_a_m2_s_per_t": 1e6},
        "estimator": {"kind": "rate_from_field"},
    }
    run = prepare(make({"control": control, "simulation.duration_s": 100.0}))
    plain = run.blocks.estimators["estimator"]
    hosted = prepare(run.scenario)
    blocks = hosted.blocks._replace(
        estimators={"estimator": dataclasses.replace(plain, compiled=False)}
    )
    computer = make_computer(blocks, hosted.plan.computer.estimator, hosted.plan.computer.modes)
    hosted.host = Host(computer, hosted.state.board, blocks)
    hosted.plan = hosted.plan._replace(computer=hosted.host.computer)
    for each in (run, hosted):
        each.advance_to(each.steps)
    one, other = run.record.rows, hosted.record.rows
    for name in ("omega_x", "dipole_y", "q_z"):
        assert other[name] == pytest.approx(one[name], rel=1e-12, abs=1e-15, nan_ok=True)
