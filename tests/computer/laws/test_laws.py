"""What holds for every control law: signature, finite output, frames, memory, no allocation."""

import numba
import numpy as np
import pytest
from known import put_known
from law_cases import UNKNOWN, ZERO, by_hand, compiled, inputs
from law_examples import EXAMPLES, of_scenario
from numba.core.runtime import _nrt_python, rtsys
from pydantic import TypeAdapter
from scipy.spatial.transform import Rotation
from slow_cases import slow_after

from torquer.compile import engine
from torquer.compile.engine import kernel
from torquer.computer.blocks.adapter import find_inputs_type
from torquer.computer.blocks.law import Law
from torquer.computer.computer import call_law
from torquer.computer.informed import NEEDS
from torquer.computer.interface import KNOWN, UNKNOWN_ESTIMATE, Ephemeris
from torquer.computer.laws import LAWS, AnyLaw

USER_FILE = """
import torquer

@torquer.law(parameters={"gain": 4e4}, memory={"calls": 0.0})
def braking(inputs, parameters, memory):
    memory.calls += 1.0
    x, y, z = inputs.omega_body_rad_s
    bx, by, bz = inputs.b_body_t
    k = parameters.gain / memory.calls
    return (k * (y * bz - z * by), k * (z * bx - x * bz), k * (x * by - y * bx))
"""
#: Keys that hold vectors and tensors in body axes: other body axes, other numbers.
OF_THE_BODY = {
    "axis": (0.0, 0.0, 1.0),
    "first_coil": None,
    "turning_axis": (1.0, 0.0, 0.0),
    "second_axis": None,
    "pitch_axis": (0.0, 1.0, 0.0),
    "inertia_kg_m2": None,
    "wanted_momentum_n_m_s": (0.0, 0.0, 0.0),
    "rate_gains_n_m_s_per_t2": None,
    "angle_gains_n_m_per_t2": None,
    "mean_projection": None,
}
EVERY = pytest.mark.parametrize("kind", LAWS)
SPECS = TypeAdapter(AnyLaw)


@pytest.fixture(scope="module")
def example(tmp_path_factory):
    """The example of a kind of law, as `Law`."""
    file = tmp_path_factory.mktemp("law") / "law.py"
    file.write_text(USER_FILE)

    def make(kind, turn=None) -> Law:
        keys = {k: str(file) if k == "file" else v for k, v in EXAMPLES[kind].items()}
        if turn is not None:
            keys |= turned_keys(kind, keys, turn)
        return SPECS.validate_python({"kind": kind, **keys}).law().filled(of_scenario)

    return make


def turned_keys(kind, keys, turn):
    """What of an example is given in body axes, given in turned ones; defaults count too."""
    found = {}
    for key in OF_THE_BODY.keys() & LAWS[kind].model_fields.keys():
        value = np.array(keys.get(key, OF_THE_BODY[key]))
        found[key] = (turn @ value @ turn.T if value.ndim >= 2 else turn @ value).tolist()
    if "euler_deg" in LAWS[kind].model_fields:
        wanted = Rotation.from_euler("ZYX", keys["euler_deg"], degrees=True)
        wanted = wanted * Rotation.from_matrix(turn.T)
        found["euler_deg"] = wanted.as_euler("ZYX", degrees=True).tolist()
    return found


def readings(n=40, turn=None, seed=3):
    """What a computer knows while it turns; `turn` (matrix): the same in other body axes."""
    rng = np.random.default_rng(seed)
    turn = np.eye(3) if turn is None else turn
    rows = []
    for i in range(n):
        b, b_rate = 3e-5 * rng.normal(size=3), 1e-6 * rng.normal(size=3)
        omega, sun = 0.1 * rng.normal(size=3), rng.normal(size=3)
        sun = sun / np.linalg.norm(sun) if i % 3 else np.zeros(3)
        q = Rotation.random(random_state=i) * Rotation.from_matrix(turn.T)
        place = [size * rng.normal(size=3) for size in (7e6, 7e3, 3e-5, 1e-7)]
        vectors = (turn @ v for v in (b, b_rate, omega, sun))
        wheels = turn @ rng.normal(size=3)
        model_sun = Rotation.random(random_state=i).as_matrix()[0]
        rows.append(inputs(0.5 * i, *vectors, q.as_quat(), wheels, *place, model_sun))
    return rows


def answers(function, law, rows):
    """Dipole and torque for each row, and the memory that is left."""
    memory, parameters = law.first_memory(), law.pack()
    commands = [function(row, parameters, memory) for row in rows]
    return np.array([[*c.dipole_a_m2, *c.torque_n_m] for c in commands]), memory


def test_every_law_has_its_example_here():
    assert set(EXAMPLES) == set(LAWS)


@EVERY
def test_kind_is_the_key_and_specs_survive_json(kind):
    spec = SPECS.validate_python({"kind": kind, **EXAMPLES[kind]})
    assert type(spec) is LAWS[kind] and spec.kind == kind
    assert SPECS.validate_json(SPECS.dump_json(spec)) == spec


@EVERY
def test_law_compiles_and_answers_with_finite_commands(kind, example):
    law = example(kind)
    assert law.compiled
    for seed in range(3):
        found, _ = answers(compiled(law), law, readings(seed=seed))
        assert found.shape == (40, 6) and np.all(np.isfinite(found))
        for driven, part in ((law.drives_coils, found[:, :3]), (law.drives_wheels, found[:, 3:])):
            assert np.any(part) == (driven and kind != "off")


@EVERY
def test_it_answers_with_finite_commands_when_nothing_is_measured(kind, example):
    law = example(kind)
    place = {
        "r": (7e6, 0.0, 0.0), "v": (0.0, 7e3, 2e3), "model_b": ZERO, "model_b_rate": ZERO,
        "model_sun": (0.6, 0.0, -0.8),
    }  # fmt: skip
    rows = [inputs(t, q=(0.0, 0.6, 0.0, 0.8), **place) for t in range(5)]
    lost = [row._replace(b_body_t=ZERO, b_rate_body_t_s=ZERO) for row in readings(20)]
    for case in (rows, lost):
        assert np.all(np.isfinite(answers(compiled(law), law, case)[0]))


@EVERY
def test_plain_python_gives_the_same(kind, example):
    law = example(kind)
    rows = readings()
    parameters, memory, plain = law.pack(), law.first_memory(), by_hand(law)
    by_python = np.array([plain(row, parameters, memory) for row in rows])
    found, kept = answers(compiled(law), law, rows)
    by_machine = {"dipole": found[:, :3], "torque": found[:, 3:], "command": found}[law.answers]
    assert by_machine == pytest.approx(by_python.reshape(40, -1), rel=1e-12, abs=1e-15)
    assert kept == pytest.approx(memory, rel=1e-12)


@EVERY
def test_commands_turn_with_the_body_axes(kind, example):
    """Other body axes, a law's own axes and inertia given in them: the same command."""
    law = example(kind)
    turn = Rotation.from_rotvec([0.7, -1.1, 0.4]).as_matrix()
    one, _ = answers(compiled(law), law, readings())
    law = example(kind, turn)
    other, _ = answers(compiled(law), law, readings(turn=turn))
    for part in (slice(0, 3), slice(3, 6)):
        tolerance = 1e-13 * (1.0 + np.abs(one[:, part]).max())
        assert other[:, part] == pytest.approx(one[:, part] @ turn.T, abs=tolerance)


@EVERY
def test_all_that_it_remembers_is_its_memory(kind, example):
    """Stopped, its memory stored, and gone on with: the same answers, to the bit."""
    law, rows = example(kind), readings()
    whole, _ = answers(compiled(law), law, rows)
    again, _ = answers(compiled(law), law, rows)
    assert np.array_equal(whole, again)
    _, memory = answers(compiled(law), law, rows[:17])
    parameters = law.pack()
    commands = [compiled(law)(row, parameters, memory) for row in rows[17:]]
    rest = [[*c.dipole_a_m2, *c.torque_n_m] for c in commands]
    assert np.array_equal(whole[17:], rest)
    assert np.array_equal(parameters, law.pack())


def without(need, row):
    """Inputs of which a part that a law may need is not known, or is something else."""
    estimate, unknown, place = row.estimate, UNKNOWN_ESTIMATE, row.ephemeris
    q, omega = unknown.q_body_to_inertial, unknown.omega_body_rad_s
    return {
        "ephemeris": row._replace(ephemeris=Ephemeris()),
        "place": row._replace(
            ephemeris=place._replace(r_inertial_m=UNKNOWN, v_inertial_m_s=UNKNOWN)
        ),
        "model_field": row._replace(
            ephemeris=place._replace(b_inertial_t=UNKNOWN, b_rate_inertial_t_s=UNKNOWN)
        ),
        "model_sun": row._replace(ephemeris=place._replace(sun_inertial=UNKNOWN)),
        "attitude": row._replace(
            estimate=estimate._replace(q_body_to_inertial=q), q_body_to_inertial=q
        ),
        "rate": row._replace(
            estimate=estimate._replace(omega_body_rad_s=omega), omega_body_rad_s=omega
        ),
        "magnetometer": row._replace(b_body_t=UNKNOWN),
        "tachometers": row._replace(wheel_momentum_body_n_m_s=UNKNOWN),
        "sun": row._replace(sun_body=UNKNOWN),
        "search_coil": row._replace(b_rate_body_t_s=UNKNOWN),
    }[need]


@EVERY
def test_law_uses_exactly_the_inputs_it_declares(kind, example):
    """What a law does not need may be unknown: the same command. What it needs may not."""
    if kind == "user":  # the decorator takes attitude and rate for granted
        pytest.skip("says nothing of what it takes from the estimate")
    law, rows = example(kind), readings()
    whole, _ = answers(compiled(law), law, rows)
    tried = {"ephemeris", *NEEDS}
    tried -= {"coil_dipole"}  # taken by a stage of a law that these readings do not lead to
    used = {
        need
        for need in tried
        if not np.array_equal(
            answers(compiled(law), law, [without(need, row) for row in rows])[0], whole
        )
    }
    assert used == law.needs & tried


#: Laws that theory asks with inputs by value come first: they are compiled in any case.
BY_VALUE = ["bdot_rate", "three_axis"]


@pytest.mark.skipif(not engine.COMPILED, reason="in plain Python the inputs are one object")
@pytest.mark.parametrize("kind", slow_after(2, sorted(LAWS, key=lambda kind: kind not in BY_VALUE)))
def test_inputs_by_value_match_the_record_of_the_loop(kind, example):
    law, rows = example(kind), readings(12)
    assert law.in_loop().signature().args[0] == numba.from_dtype(KNOWN)[::1]
    whole, kept = answers(compiled(law), law, rows)
    by_value = law.compile()
    assert by_value.signature().args[0] == find_inputs_type()
    found, memory = answers(by_value.compiled, law, rows)
    assert np.array_equal(found, whole) and np.array_equal(memory, kept)


@kernel
def call_often(law, known, parameters, memory, times):
    total = 0.0
    for i in range(times):
        now = known[0]
        now.t_s = float(i)
        now.read_s[0] = now.t_s
        now.readings[0, 0] = 1e-5 * np.cos(0.1 * i)
        now.readings[0, 2] = 1e-5 * np.sin(0.1 * i)
        m = call_law(law, known, parameters, memory)
        total += m.dipole_a_m2[0] + m.torque_n_m[1]
    return total


def allocations(law: Law) -> list[int]:
    """How often memory was asked for in 10 and in 10 000 calls of a law."""
    made, parameters, memory = law.in_loop(), law.pack(), law.first_memory()
    known = np.zeros(1, KNOWN)
    put_known(known, readings(2)[1])
    call_often(made.address, known, parameters, memory, 2)
    on = _nrt_python.memsys_stats_enabled()
    _nrt_python.memsys_enable_stats()
    counts = []
    try:
        for times in (10, 10_000):
            before = rtsys.get_allocation_stats().alloc
            call_often(made.address, known, parameters, memory, times)
            counts.append(rtsys.get_allocation_stats().alloc - before)
    finally:
        if not on:
            _nrt_python.memsys_disable_stats()
    return counts


COUNTED = pytest.mark.skipif(not engine.COMPILED, reason="counts what compiled code allocates")


@COUNTED
@EVERY
def test_calls_allocate_nothing(kind, example):
    few, many = allocations(example(kind))
    assert few == many <= 5


@COUNTED
def test_a_law_that_allocates_would_be_noticed():
    def wasteful(inputs, parameters, memory):
        parts = np.empty(3 + int(inputs.t_s))
        parts[:] = inputs.t_s
        return (parts[0], parts[1], parts[2])

    few, many = allocations(Law("wasteful", wasteful))
    assert many - few >= 9_990
