"""Blocks of the computer: parameters by name, vectors, memory as a record, log; what is refused."""

import re
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier
from typing import NamedTuple

import numpy as np
import pytest
from law_cases import by_hand, compiled, inputs

import torquer
from torquer.compile import engine
from torquer.computer.blocks.block import Axis
from torquer.computer.blocks.law import Law

ROW = inputs(2.0, b=(1.0, 2.0, 3.0))
BOTH = pytest.mark.parametrize("call", [compiled, by_hand])
COMPILED = pytest.mark.skipif(
    not engine.COMPILED, reason="the compiler reports what does not compile"
)


class Gains(NamedTuple):
    """A record within the parameters."""

    rate: float
    axis: tuple


@torquer.law(
    parameters={"gain": 2.0, "axis": (0.0, 0.6, 0.8), "inner": Gains(3.0, (1.0, 0.0, -1.0))},
    memory={"calls": 1.0, "last_t": (0.0, 0.0, 0.0), "flag": 0.0},
    log={"calls": "1", "field": "T"},
)
def named(inputs, parameters, memory):
    p, b = parameters, inputs.b_body_t
    memory.calls += 1.0
    memory.field = (b[0] * b[0] + b[1] * b[1] + b[2] * b[2]) ** 0.5
    memory.last_t[0], memory.last_t[1], memory.last_t[2] = b
    along = p.axis[0] * b[0] + p.axis[1] * b[1] + p.axis[2] * b[2]
    return (p.gain * along, p.inner.rate * p.inner.axis[2], memory.calls)


def answer(call, law, row=ROW, cells=None):
    """The dipole, and the cells of memory that are left."""
    cells = law.first_memory() if cells is None else cells
    found = call(law)(row, law.pack(), cells)
    return getattr(found, "dipole_a_m2", found), cells


@BOTH
def test_parameters_are_read_by_name_vectors_and_records_of_them(call):
    dipole, _ = answer(call, named)
    assert dipole == pytest.approx((2.0 * 3.6, -3.0, 2.0), rel=1e-15)
    other = named.with_parameters(axis=[1, 0, 0], gain=5, inner=Gains(1.0, (0.0, 0.0, 7.0)))
    dipole, _ = answer(call, other)
    assert dipole == pytest.approx((5.0, 7.0, 2.0), rel=1e-15)


@torquer.law(memory={"rows": ((1.0, 2.0, 3.0), (4.0, 5.0, 6.0)), "calls": 0.0})
def with_matrix(inputs, parameters, memory):
    memory.rows[1, 0] += memory.rows[0, 2]
    memory.calls += 1.0
    return (memory.rows[1, 0], memory.rows[0][1], memory.calls)


@BOTH
def test_memory_may_hold_a_matrix(call):
    dipole, cells = answer(call, with_matrix)
    assert dipole == (7.0, 2.0, 1.0) and cells.tolist() == [1.0, 2.0, 3.0, 7.0, 5.0, 6.0, 1.0]
    assert with_matrix.with_memory(cells).memory["rows"] == ((1.0, 2.0, 3.0), (7.0, 5.0, 6.0))


@BOTH
def test_a_record_of_memory_shares_the_cells(call):
    _, cells = answer(call, named)
    assert cells == pytest.approx([2.0, 1.0, 2.0, 3.0, 0.0, 14.0**0.5], rel=1e-15)
    cells[0] = 41.0
    dipole, cells = answer(call, named, cells=cells)
    assert dipole[2] == cells[0] == 42.0


def test_parameters_may_be_read_by_place_too():
    @torquer.law(parameters={"gain": 2.0, "axis": (3.0, 4.0, 5.0)})
    def by_place(inputs, parameters, memory):
        return (parameters[0], parameters[1][2], 0.0)

    assert answer(compiled, by_place)[0] == (2.0, 5.0, 0.0)


def test_places_in_arrays_are_those_of_the_names():
    assert named.pack().tolist() == [2.0, 0.0, 0.6, 0.8, 3.0, 1.0, 0.0, -1.0]
    assert named.places() == {"gain": (0, 1), "axis": (1, 3), "inner": (4, 4)}
    assert named.first_memory().tolist() == [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    assert named.logged() == {"calls": (0, (), "1", ()), "field": (5, (), "T", ())}
    assert named.record_from(named.pack()) == named.parameters
    record = named.record_of(np.arange(6.0))
    assert (record.calls, record.flag, record.field) == (0.0, 4.0, 5.0)
    assert record.last_t.tolist() == [1.0, 2.0, 3.0]


def test_new_numbers_reuse_compiled_blocks_and_new_shapes_recompile():
    @torquer.law(parameters={"axis": (1.0, 2.0, 3.0)})
    def law(inputs, parameters, memory):
        return (parameters.axis[0], parameters.axis[1], float(len(parameters.axis)))

    other = law.with_parameters(axis=(4.0, 5.0, 6.0))
    assert other.compile() is law.compile() and other.in_loop() is law.in_loop()
    shorter = Law("law", law.function, {"axis": (1.0, 2.0)})
    assert shorter.compile() is not law.compile()
    assert answer(compiled, shorter)[0] == (1.0, 2.0, 2.0)
    assert answer(compiled, other)[0] == (4.0, 5.0, 3.0)


def test_threads_that_need_one_block_get_the_same_function():
    """Runs that threads prepare at once: each finds the function that the first has compiled."""

    @torquer.law
    def asked_by_many(inputs, parameters, memory):
        return (inputs.t_s, 0.0, 0.0)

    together = Barrier(4)

    def in_loop(_):
        together.wait()
        return asked_by_many.in_loop()

    with ThreadPoolExecutor(4) as threads:
        assert len({id(each) for each in threads.map(in_loop, range(4))}) == 1


@BOTH
def test_one_function_may_have_parameters_of_several_types(call):
    """Names tell them apart, not only sizes."""

    def f(inputs, parameters, memory):
        return (parameters.x, parameters.y, 0.0)

    one, two = Law("f", f, {"x": 1.0, "y": 2.0}), Law("f", f, {"y": 1.0, "x": 2.0})
    assert answer(call, one)[0] == (1.0, 2.0, 0.0)
    assert answer(call, two)[0] == (2.0, 1.0, 0.0)


def test_law_may_answer_with_dipole_torque_or_command():
    def three(inputs, parameters, memory):
        return inputs.b_body_t

    def both(inputs, parameters, memory):
        return torquer.Command(inputs.b_body_t, (4.0, 5.0, 6.0))

    def one_part(inputs, parameters, memory):
        return torquer.Command(torque_n_m=inputs.b_body_t, dipole_a_m2=(0.0, 0.0, 0.0))

    zero, b = (0.0, 0.0, 0.0), (1.0, 2.0, 3.0)
    for law, dipole, torque in (
        (Law("three", three), b, zero),
        (Law("three", three, answers="torque"), zero, b),
        (Law("both", both, answers="command"), b, (4.0, 5.0, 6.0)),
        (Law("one_part", one_part, answers="command"), zero, b),
    ):
        command = compiled(law)(ROW, law.pack(), law.first_memory())
        assert (command.dipole_a_m2, command.torque_n_m) == (dipole, torque)


@COMPILED
@pytest.mark.parametrize(
    ("answers", "body", "expected"),
    [
        ("dipole", "return torquer.Command()", r"\(x, y, z\); received one that returns Command"),
        (
            "torque",
            "return (1.0, 2.0)",
            r"\(x, y, z\); received one that returns a tuple of 2 numbers$",
        ),
        ("command", "return inputs.b_body_t", "torquer.Command; received one that returns a tuple"),
        ("command", "return 1.0", "torquer.Command; received one that returns a number$"),
        ("dipole", "return (parameters.speed, 0.0, 0.0)", r".*without a field 'speed'"),
        ("dipole", "return (memory.speed, 0.0, 0.0)", r".*memory has no 'speed'"),
        ("dipole", "return parameters.axis[3]", r".*"),
        ("command", "return torquer.Command()", "torquer.Command; received one that returns Comma"),
        (
            "command",
            "return torquer.Command(torque_n_m=inputs.b_body_t)",
            ".*must be given all its fields",
        ),
    ],
)
def test_a_wrong_answer_or_name_is_one_clear_line(tmp_path, answers, body, expected):
    file = tmp_path / "law.py"
    file.write_text(
        "import torquer\n\n\n@torquer.law(parameters={'gain': 1.0, 'axis': (1.0, 0.0, 0.0)}, "
        f"memory={{'t_s': 0.0}}, answers={answers!r})\n"
        f"def mine(inputs, parameters, memory):\n    {body}\n"
    )
    from torquer.computer.blocks.user import load_law

    must = r"law mine: must compile as \(inputs, parameters, memory\) -> "
    with pytest.raises(ValueError, match=f"^{must}{expected}") as caught:
        load_law(file)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ({"speed": 1.0}, "parameter must be one of: gain, axis, inner; received 'speed'"),
        ({"axis": 1.0}, "parameter axis must be 3 numbers; received 1.0"),
        ({"axis": (1.0, 2.0)}, "parameter axis must be 3 numbers; received (1.0, 2.0)"),
        (
            {"inner": (1.0, 2.0)},
            "parameter inner must be (a number, 3 numbers); received (1.0, 2.0)",
        ),
        ({"gain": (1.0,)}, "parameter gain must be a number; received (1.0,)"),
    ],
)
def test_unknown_parameters_and_other_shapes_are_refused(values, expected):
    with pytest.raises(ValueError, match=f"^{re.escape('law named: ' + expected)}$"):
        named.with_parameters(**values)


def test_vectors_must_be_finite_numbers():
    law = named.with_parameters(axis=(0.0, float("nan"), 0.0))
    message = "law named: parameter axis must be finite numbers; received (0.0, nan, 0.0)"
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        law.pack()


def test_memory_at_the_start_may_be_given_as_cells():
    law = named.with_memory([5.0, 1.0, 2.0, 3.0, 4.0, 6.0])
    assert law.memory == {"calls": 5.0, "last_t": (1.0, 2.0, 3.0), "flag": 4.0, "field": 6.0}
    message = "law named: memory must have 6 cells, as the block has; received 2"
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        named.with_memory([1.0, 2.0])


@pytest.mark.parametrize("key", ["size", "T", "mean", "dtype"])
def test_names_that_records_have_for_themselves_are_refused(key):
    message = f"f: a name in memory must not be an attribute of NumPy's records; received '{key}'"
    for keys in ({"memory": {key: 0.0}}, {"log": {key: "1"}}):
        with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
            Law("f", lambda inputs, parameters, memory: (0.0, 0.0, 0.0), **keys)


def quiet(inputs, parameters, memory):
    return 0.0, 0.0, 0.0


@pytest.mark.parametrize("log", [{"a/b": "T"}, {"x": (Axis("a b", ("u",), "T"),)}])
def test_names_in_a_log_can_be_stored(log):
    message = r"^f: log: a name must be of letters, digits, '_' and '-' .*; received 'a[/ ]b'$"
    with pytest.raises(ValueError, match=message):
        Law("f", quiet, log=log)


@pytest.mark.parametrize("unit", ["a\0", "\ud800", None, 5, ("T",)])
def test_units_in_a_log_can_be_stored(unit):
    message = f"f: log x: unit: must be text without NUL, to be stored; received {unit!r}"
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        Law("f", quiet, log={"x": unit})


def test_names_of_functions_and_parameters_can_be_stored():
    with pytest.raises(ValueError, match=r"^name: must be text without NUL, to be stored; "):
        Law("a\0b", quiet)
    for key in ("a b", "class", "_a", 5):
        message = "f: parameters must be named as variables in Python are, and not begin with '_'; "
        with pytest.raises(ValueError, match=f"^{message}received {key!r}$"):
            Law("f", quiet, {key: 1.0})


def test_a_log_needs_memory_by_names():
    def f(inputs, parameters, memory):
        return (0.0, 0.0, 0.0)

    message = "f: memory must be given by names for a log; received cells without names"
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        Law("f", f, (), 3, log={"x": "T"})
    assert Law("f", f, (), 0, log={"x": "T"}).memory == {"x": 0.0}


@pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
@pytest.mark.parametrize("plain", [False, True])
def test_what_a_law_logs_is_in_the_result(make, plain):
    import dataclasses

    law = dataclasses.replace(named, compiled=not plain)
    result = torquer.simulate(make({"simulation.duration_s": 60.0}), law=law)
    size = np.linalg.norm(result["b_measured"], axis=1)
    assert result["law.field"].values == pytest.approx(size, rel=1e-14)
    assert result["law.field"].attrs["units"] == "T"
    # at the end of a run the computer is not asked any more
    assert result["law.calls"].values.tolist() == [2.0 + t for t in range(0, 60, 10)] + [61.0]


def logs_matrices(inputs, parameters, memory):
    memory.four[3] = inputs.t_s
    memory.square[0][1] = -inputs.t_s
    memory.labelled[1] = 2.0 * inputs.t_s
    return (0.0, 0.0, 0.0)


@pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
def test_vectors_and_matrices_in_a_log_keep_their_shape(make, tmp_path):
    """Components with names have a coordinate of names and one of units, and survive a file and a
    resumed run."""
    law = Law(
        "logs",
        logs_matrices,
        (),
        {"four": (0.0,) * 4, "square": ((0.0, 0.0), (0.0, 0.0)), "labelled": (0.0, 0.0)},
        {"four": "T", "square": "1", "labelled": (Axis("part", ("left", "right"), ("m", "s")),)},
        compiled=False,
    )
    scenario = make({"simulation.duration_s": 60.0})
    result = torquer.simulate(scenario, law=law)
    assert result["law.four"].dims == ("time", "law.four_0")
    assert result["law.square"].dims == ("time", "law.square_0", "law.square_1")
    assert result["law.square"].values[1].tolist() == [[0.0, -10.0], [0.0, 0.0]]
    assert result["law.labelled"].sel({"law.part": "right"}).values[:2].tolist() == [0.0, 20.0]
    assert result["law.part_units"].values.tolist() == ["m", "s"]
    torquer.save(result, tmp_path / "result.nc")
    assert torquer.load(tmp_path / "result.nc").identical(result)
    stopped = torquer.simulate(scenario, law=law, until_s=35.0)
    assert torquer.resume(stopped, law=law)["law.square"].identical(result["law.square"])
