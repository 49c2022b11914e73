"""What holds for every control law: signature, finite output, frames, memory, no allocation."""

import numpy as np
import pytest
from numba.core.runtime import _nrt_python, rtsys
from pydantic import TypeAdapter
from scipy.spatial.transform import Rotation

from torquer import engine
from torquer.control import LAWS, WHEEL_LAWS, AnyLaw, AnyWheelLaw
from torquer.control.law import Law, compile_law
from torquer.conventions import Measured
from torquer.engine import kernel

USER_FILE = """
import torquer

@torquer.law(parameters={"gain": 4e4}, memory=1)
def braking(measured, parameters, memory):
    memory[0] += 1.0
    x, y, z = measured.omega_body_rad_s
    bx, by, bz = measured.b_body_t
    k = parameters[0] / memory[0]
    return (k * (y * bz - z * by), k * (z * bx - x * bz), k * (x * by - y * bx))
"""
#: One line per law: the keys of an example.
EXAMPLES = {
    "off": {},
    "bdot": {"gain_a_m2_s_per_t": 1e5},
    "bdot_rate": {"gain_a_m2_s_per_t": 1e5},
    "bdot_derivative": {"gain_a_m2_s_per_t": 1e5},
    "bdot_model": {"gain_a_m2_s_per_t": 1e5},
    "nutation_damping": {"gain_a_m2_s_per_t": 1e5, "axis": [0.0, 0.6, 0.8]},
    "nutation_damping_rate": {"gain_a_m2_s_per_t": 1e5},
    "nutation_damping_derivative": {"relay_dipole_a_m2": 0.8, "axis": [1.0, 2.0, -2.0]},
    "spin_up": {
        "relay_dipole_a_m2": 0.1,
        "target_rate_deg_s": 8.0,
        "axis": [0.0, -1.0, 0.0],
        "first_coil": [1.0, 0.0, 1.0],
    },
    "reorientation": {
        "gain_a_m2_per_n_m_s_t": 1e6,
        "target": [1.0, 1.0, 0.0],
        "momentum_n_m_s": 0.05,
        "inertia_kg_m2": [[1.49, 0.054, 0.0442], [0.054, 1.51, 0.0], [0.0442, 0.0, 1.56]],
    },
    "preliminary_1": {"gain_a_m2_per_t": 5e5, "target": "sun", "axis": [0.0, 0.6, 0.8]},
    "preliminary_2": {
        "gain_a_m2_per_t": 5e5,
        "target": [0.0, -0.6, 0.8],
        "inertia_kg_m2": [[1.49, 0.054, 0.0442], [0.054, 1.51, 0.0], [0.0442, 0.0, 1.56]],
    },
    "three_axis": {
        "rate_gain_n_m_s_per_t2": 1e5,
        "angle_gain_n_m_per_t2": 30.0,
        "euler_deg": [40, 20, -10],
    },
    "wheel_pd": {
        "bandwidth_rad_s": 0.1,
        "euler_deg": [40, 20, -10],
        "orbital_rate_rad_s": 1e-3,
        "inertia_kg_m2": [[1.49, 0.054, 0.0442], [0.054, 1.51, 0.0], [0.0442, 0.0, 1.56]],
    },
    "wheel_lyapunov": {
        "rate_gain_n_m_s": 0.1,
        "angle_gain_n_m": 0.01,
        "euler_deg": [40, 20, -10],
        "inertia_kg_m2": [[1.49, 0.054, 0.0442], [0.054, 1.51, 0.0], [0.0442, 0.0, 1.56]],
    },
    "unloading": {
        "gain_per_s": 1e-3,
        "wanted_momentum_n_m_s": [0.1, 0.2, -0.1],
        "dead_band_n_m_s": 0.3,
    },
    "scheme": {
        "axis": [0.0, 0.6, 0.8],
        "target": [1.0, 1.0, 0.0],
        "inertia_kg_m2": [[1.49, 0.054, 0.0442], [0.054, 1.51, 0.0], [0.0442, 0.0, 1.56]],
        "stages": [
            {
                "laws": [
                    {"kind": "nutation_damping", "gain_a_m2_s_per_t": 1e5},
                    {"kind": "preliminary_2", "gain_a_m2_per_t": 5e5},
                ],
                "until": {"nutation_below_deg": 60.0, "at_most_s": 6.0},
            },
            {
                "laws": [
                    {"kind": "spin_up", "gain_a_m2_per_t": 1e4},
                    {"kind": "nutation_damping", "gain_a_m2_s_per_t": 2e4},
                    {"kind": "bdot", "gain_a_m2_s_per_t": 2e4},
                ],
                "until": {"spin_above_deg_s": 2.0, "at_least_s": 3.0},
            },
            {
                "laws": [
                    {
                        "kind": "reorientation",
                        "gain_a_m2_per_n_m_s_t": 1e6,
                        "target": "sun",
                        "momentum_n_m_s": 0.05,
                    },
                    {"kind": "bdot_model", "gain_a_m2_s_per_t": 1e4},
                ],
                "until": {"at_most_s": 300.0},
            },
        ],
    },
    "user": {"file": "law.py", "parameters": {"gain": 5e4}},
}
#: Keys that hold vectors and tensors in body axes: other body axes, other numbers.
OF_THE_BODY = {
    "axis": (0.0, 0.0, 1.0),
    "first_coil": None,
    "inertia_kg_m2": None,
    "wanted_momentum_n_m_s": (0.0, 0.0, 0.0),
}
#: Laws of the coils and of the wheels; 'off' and 'user' may be either.
ALL = {**WHEEL_LAWS, **LAWS}
EVERY = pytest.mark.parametrize("kind", ALL)
ZERO = (0.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def example(tmp_path_factory):
    """The example of a kind of law, as `Law`."""
    file = tmp_path_factory.mktemp("law") / "law.py"
    file.write_text(USER_FILE)

    def make(kind, turn=None) -> Law:
        keys = {k: str(file) if k == "file" else v for k, v in EXAMPLES[kind].items()}
        if turn is not None:
            keys |= turned_keys(kind, keys, turn)
        return adapter_of(kind).validate_python({"kind": kind, **keys}).law()

    return make


def adapter_of(kind):
    """What reads the keys of a kind of law."""
    return TypeAdapter(AnyLaw if kind in LAWS else AnyWheelLaw)


def turned_keys(kind, keys, turn):
    """What of an example is given in body axes, given in turned ones; defaults count too."""
    found = {}
    for key in OF_THE_BODY.keys() & ALL[kind].model_fields.keys():
        value = np.array(keys.get(key, OF_THE_BODY[key]))
        found[key] = (turn @ value @ turn.T if value.ndim == 2 else turn @ value).tolist()
    if "euler_deg" in ALL[kind].model_fields:
        wanted = Rotation.from_euler("ZYX", keys["euler_deg"], degrees=True)
        wanted = wanted * Rotation.from_matrix(turn.T)
        found["euler_deg"] = wanted.as_euler("ZYX", degrees=True).tolist()
    return found


def readings(n=40, turn=None, seed=3):
    """What a computer measures while it turns; `turn` (matrix): the same from other body axes."""
    rng = np.random.default_rng(seed)
    turn = np.eye(3) if turn is None else turn
    rows = []
    for i in range(n):
        b, b_rate = 3e-5 * rng.normal(size=3), 1e-6 * rng.normal(size=3)
        omega, sun = 0.1 * rng.normal(size=3), rng.normal(size=3)
        sun = sun / np.linalg.norm(sun) if i % 3 else np.zeros(3)
        vectors = [tuple((turn @ v).tolist()) for v in (b, b_rate, omega, sun)]
        q = Rotation.random(random_state=i) * Rotation.from_matrix(turn.T)
        sizes = (7e6, 7e3, 3e-5, 1e-7)
        known = [tuple((size * rng.normal(size=3)).tolist()) for size in sizes]
        known.append(tuple((turn @ rng.normal(size=3)).tolist()))
        rows.append(Measured(0.5 * i, *vectors, tuple(q.as_quat().tolist()), *known))
    return rows


def compiled(law):
    """The law's compiled function, called from Python; under a disabled compiler the plain one."""
    found = compile_law(law.function)
    return found.compiled if engine.COMPILED else found


def answers(function, law, rows):
    memory, parameters = np.array(law.memory), law.pack()
    return np.array([function(row, parameters, memory) for row in rows]), memory


def test_every_law_has_its_example_here():
    assert set(EXAMPLES) == set(ALL)


@EVERY
def test_kind_is_the_key_and_specs_survive_json(kind):
    adapter = adapter_of(kind)
    spec = adapter.validate_python({"kind": kind, **EXAMPLES[kind]})
    assert type(spec) is ALL[kind] and spec.kind == kind
    assert adapter.validate_json(adapter.dump_json(spec)) == spec


@EVERY
def test_it_compiles_and_answers_with_finite_dipoles(kind, example):
    law = example(kind)
    assert law.compiled
    for seed in range(3):
        found, _ = answers(compiled(law), law, readings(seed=seed))
        assert found.shape == (40, 3) and np.all(np.isfinite(found))


@EVERY
def test_it_answers_with_finite_dipoles_when_nothing_is_measured(kind, example):
    law = example(kind)
    there = ((0.0, 0.6, 0.0, 0.8), (7e6, 0.0, 0.0), (0.0, 7e3, 2e3), ZERO, ZERO)
    rows = [Measured(float(t), ZERO, ZERO, ZERO, ZERO, *there) for t in range(5)]
    lost = [row._replace(b_body_t=ZERO, b_rate_body_t_s=ZERO) for row in readings(20)]
    for case in (rows, lost):
        assert np.all(np.isfinite(answers(compiled(law), law, case)[0]))


@EVERY
def test_plain_python_gives_the_same(kind, example):
    law = example(kind)
    rows = readings()
    by_python, memory = answers(law, law, rows)
    by_machine, kept = answers(compiled(law), law, rows)
    assert by_machine == pytest.approx(by_python, rel=1e-12, abs=1e-15)
    assert kept == pytest.approx(memory, rel=1e-12)


@EVERY
def test_dipoles_turn_with_the_body_axes(kind, example):
    """Other body axes, a law's own axes and inertia given in them: the same dipole."""
    law = example(kind)
    turn = Rotation.from_rotvec([0.7, -1.1, 0.4]).as_matrix()
    one, _ = answers(compiled(law), law, readings())
    law = example(kind, turn)
    other, _ = answers(compiled(law), law, readings(turn=turn))
    assert other == pytest.approx(one @ turn.T, abs=1e-13 * (1.0 + np.abs(one).max()))


@EVERY
def test_all_that_it_remembers_is_its_memory(kind, example):
    """Stopped, its memory stored, and gone on with: the same answers, to the bit."""
    law, rows = example(kind), readings()
    whole, _ = answers(compiled(law), law, rows)
    again, _ = answers(compiled(law), law, rows)
    assert np.array_equal(whole, again)
    _, memory = answers(compiled(law), law, rows[:17])
    parameters = law.pack()
    rest = [compiled(law)(row, parameters, memory) for row in rows[17:]]
    assert np.array_equal(whole[17:], rest)
    assert np.array_equal(parameters, law.pack())


@kernel
def call_often(law, parameters, memory, times):
    total = 0.0
    for i in range(times):
        b = (1e-5 * np.cos(0.1 * i), 2e-5, 1e-5 * np.sin(0.1 * i))
        rate, omega, sun = (1e-7, 0.0, -1e-7), (0.01, 0.02, -0.03), (0.0, 0.6, 0.8)
        q, r, v = (0.0, 0.6, 0.0, 0.8), (7e6, 0.0, 0.0), (0.0, 7e3, 2e3)
        row = Measured(float(i), b, rate, omega, sun, q, r, v, b, rate, omega)
        m = law(row, parameters, memory)
        total += m[0] + m[1] + m[2]
    return total


def allocations(law: Law) -> list[int]:
    """How often memory was asked for in 10 and in 10 000 calls of a law."""
    function, parameters, memory = compile_law(law.function), law.pack(), np.array(law.memory)
    call_often(function, parameters, memory, 2)
    on = _nrt_python.memsys_stats_enabled()
    _nrt_python.memsys_enable_stats()
    counts = []
    try:
        for times in (10, 10_000):
            before = rtsys.get_allocation_stats().alloc
            call_often(function, parameters, memory, times)
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
    def wasteful(measured, parameters, memory):
        parts = np.empty(3 + int(measured.t_s))
        parts[:] = measured.t_s
        return (parts[0], parts[1], parts[2])

    few, many = allocations(Law("wasteful", wasteful))
    assert many - few >= 9_990
