"""Laws of the user's own: the decorator, files, one clear line per mistake, no stale code."""

import os
import re
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from law_cases import by_hand, compiled, inputs

import torquer
from torquer.compile import engine
from torquer.computer.blocks.law import Law, as_law
from torquer.computer.blocks.user import UserLaw, load_law

ROW = inputs(2.0, b=(1.0, 2.0, 3.0))
HEAD = "import torquer\n\n@torquer.law\n"
BODY = "def mine(inputs, parameters, memory):\n    "
GOOD = HEAD + "def mine(inputs, parameters, memory):\n    return inputs.b_body_t\n"


def written(folder, text, name="law.py"):
    file = folder / name
    file.write_text(text)
    return file


def answer(law):
    """One answer of a law, compiled if it is a compiled one."""
    parameters, memory = law.pack(), law.first_memory()
    if law.compiled:
        return compiled(law)(ROW, parameters, memory).dipole_a_m2
    return by_hand(law)(ROW, parameters, memory)


def test_the_decorator_makes_a_law_with_defaults():
    @torquer.law
    def plain(inputs, parameters, memory):
        return inputs.b_body_t

    assert (plain.name, plain.values(), plain.memory) == ("plain", {}, ())
    assert plain.compiled
    assert plain(ROW) == (1.0, 2.0, 3.0)
    assert answer(plain) == (1.0, 2.0, 3.0)


def test_the_decorator_takes_parameters_and_memory():
    @torquer.law(parameters={"gain": 2.0, "offset": 0.5}, memory=[1.0, 4.0])
    def tuned(inputs, parameters, memory):
        memory[1] += 1.0
        return (parameters[0] * inputs.t_s + parameters[1], memory[0], memory[1])

    assert tuned.memory == (1.0, 4.0)
    assert tuned.pack().tolist() == [2.0, 0.5]
    assert answer(tuned) == (4.5, 1.0, 5.0)
    other = tuned.with_parameters(offset=1.5)
    assert other.pack().tolist() == [2.0, 1.5] and tuned.pack().tolist() == [2.0, 0.5]
    message = "law tuned: parameter must be one of: gain, offset; received 'speed'"
    with pytest.raises(ValueError, match=f"^{message}$"):
        tuned.with_parameters(speed=1.0)
    assert torquer.law(lambda inputs, parameters, memory: (0.0, 0.0, 0.0), memory=3).memory == (
        0.0,
        0.0,
        0.0,
    )


def test_parameters_of_a_law_without_any_are_reported():
    message = "law f: parameter must be one of: none; received 'gain'"
    with pytest.raises(ValueError, match=f"^{message}$"):
        Law("f", lambda m, p, q: (0.0, 0.0, 0.0)).with_parameters(gain=1.0)


@pytest.mark.parametrize(
    "bad", [float("nan"), float("inf"), "much", None, True, np.True_, 10**400, 1j]
)
def test_parameters_must_be_finite_numbers(bad):
    law = Law("f", lambda m, p, q: (0.0, 0.0, 0.0), {"gain": bad})
    message = f"law f: parameter gain must be a finite number; received {bad!r}"
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        law.pack()


def test_parameters_may_be_any_real_numbers():
    values = {"a": 1, "b": np.int64(2), "c": np.float32(0.5), "d": Fraction(1, 4), "e": np.uint8(3)}
    packed = Law("f", lambda m, p, q: (0.0, 0.0, 0.0), values).pack()
    assert packed.dtype == np.float64 and packed.tolist() == [1.0, 2.0, 0.5, 0.25, 3.0]


def test_undecorated_function_is_a_law_in_plain_python(tmp_path):
    def own(inputs, parameters, memory):
        return (memory.size, 0.0, 0.0)

    class Callable:
        def __call__(self, inputs, parameters, memory):
            return own(inputs, parameters, memory)

    law = as_law(own)
    assert (law.name, law.compiled, law.values()) == ("own", False, {})
    assert answer(law) == (16, 0.0, 0.0)
    assert as_law(law) is law
    assert as_law(Callable()).name == "Callable"
    text = "def own(m, p, s):\n    return (s.size, 0.0, 0.0)\nalias = own\n"
    from_file = load_law(written(tmp_path, text), "alias")
    assert from_file.name == "alias" and answer(from_file) == (16, 0.0, 0.0)
    with pytest.raises(ValueError, match=r"^law: must be a torquer.Law or a function; received 3$"):
        as_law(3)


#: A law that fails at t = 2 s in one of several ways, and would answer silently without a guard.
FAILING = """
import torquer

@torquer.law(parameters={"way": 0.0}, memory=3)
def failing(inputs, parameters, memory):
    way, i, x = int(parameters.way), int(inputs.t_s) + 1, 0.0
    if way == 0:
        x = memory[i]
    elif way == 1:
        memory[i] = 1.0
    elif way == 2:
        x = 1.0 / (1.0 / (inputs.t_s - 2.0))
    elif way == 3 and inputs.t_s > 1.0:
        raise ValueError("no")
    elif way == 4:
        x = checked(inputs.t_s)
    return (x, 0.0, 0.0)

@torquer.law(memory=3)
def too_few(inputs, parameters, memory):
    return memory[: int(4.0 - inputs.t_s)]
"""
WAYS = (
    "reads past the end", "writes past the end", "divides by zero", "raises", "a helper raises",
)  # fmt: skip
CHECKED = (
    "import numba\n\n@numba.njit\ndef checked(x):\n    if x > 1.0:\n        raise ValueError\n"
    "    return x\n\n"
)


@pytest.fixture(scope="module")
def failing(tmp_path_factory):
    return written(tmp_path_factory.mktemp("law"), CHECKED + FAILING)


@pytest.mark.parametrize("way", [*WAYS, "answers with an array of two"])
def test_a_law_that_fails_answers_with_no_numbers(failing, way):
    law = load_law(failing, "too_few")
    if way in WAYS:
        law = load_law(failing, "failing").with_parameters(way=float(WAYS.index(way)))
    assert np.isnan(answer(law)).all()
    before = compiled(law)(ROW._replace(t_s=1.0), law.pack(), np.ones(3))
    assert np.isfinite(before.dipole_a_m2).all()


def test_laws_of_one_line_and_of_one_factory_are_distinguished(tmp_path):
    text = (
        "import torquer\n\n\ndef made(k):\n    @torquer.law\n    def mine(m, p, s):\n"
        "        return (k, 0.0, 0.0)\n    return mine\n\n\n"
        "one, two = made(1.0), made(2.0)\n"
        "a, b = [torquer.law(f) for f in "
        "(lambda m, p, s: (3.0, 0.0, 0.0), lambda m, p, s: (4.0 + s.size, 0.0, 0.0))]\n"
    )
    file = written(tmp_path, text)
    for _ in range(2):  # compiled, then from the cache
        answers = [answer(load_law(file, name))[0] for name in ("one", "two", "a", "b")]
        assert answers == [1.0, 2.0, 3.0, 4.0]


def test_a_law_from_a_file(tmp_path):
    law = load_law(written(tmp_path, GOOD))
    assert (law.name, law.compiled) == ("mine", True)
    assert answer(law) == (1.0, 2.0, 3.0)


def test_one_of_several_by_its_name(tmp_path):
    two = GOOD + GOOD.replace("mine", "other").replace("inputs.b_body_t", "(0, 1, 2)")
    file = written(tmp_path, two)
    assert answer(load_law(file, "mine")) == (1.0, 2.0, 3.0)
    assert answer(load_law(file, "other")) == (0.0, 1.0, 2.0)


def test_an_undecorated_function_runs_as_plain_python_and_says_so(tmp_path):
    text = "def slow(inputs, parameters, memory):\n    return [1.0, 2.0, sum(memory)]\n"
    law = load_law(written(tmp_path, text), "slow")
    assert not law.compiled
    assert answer(law) == [1.0, 2.0, 0.0]


def test_a_law_may_call_kernels_of_the_package(tmp_path):
    text = (
        "import torquer\nfrom torquer.maths.geometry.vec3 import cross\n\n"
        "@torquer.law(parameters={'k': 2.0})\n"
        "def mine(inputs, parameters, memory):\n"
        "    return cross((parameters[0], 0.0, 0.0), inputs.b_body_t)\n"
    )
    assert answer(load_law(written(tmp_path, text))) == (0.0, -6.0, 4.0)


@pytest.mark.parametrize(
    ("text", "name", "expected"),
    [
        ("def f(:\n", None, r"law.file: must import; received SyntaxError.* \(FILE, line 1\)$"),
        ("x = 1\n1 / 0\n", None, r"law.file: .* received ZeroDivisionError.* \(FILE, line 2\)$"),
        ("exit()\n", None, "law.file: must import; received SystemExit"),
        ("import sys\nsys.exit(3)\n", None, r"law.file: must import; received SystemExit\(3\)"),
        ("import no_such_thing\n", None, "law.file: must import; received ModuleNotFoundError"),
        (
            "x = 1\n",
            None,
            "law.file: must hold one @torquer.law, .*; received none",
        ),
        (
            GOOD + GOOD.replace("mine", "other"),
            None,
            "law.file: must hold one @torquer.law, or `function` name one; received mine, other",
        ),
        (
            "x = 1\n",
            "g",
            "law.function: must be defined in the file; received 'g', .* FILE",
        ),
        (
            "x = 1\n",
            "x",
            "law.function: must be defined in the file; received 'x', .* FILE",
        ),
        (
            HEAD + BODY + "return (0.0, 1.0)\n",
            None,
            "LAW as .*received one that returns a tuple of 2 numbers$",
        ),
        (HEAD + BODY + "return 1.0\n", None, "LAW as .*received one that returns a number$"),
        (HEAD + BODY + "pass\n", None, "LAW as .*received one that returns nothing$"),
        (
            HEAD + BODY + "return imputs.t_s\n",
            None,
            r"LAW .*'imputs' is not def.* \(NAME, line \d+\)$",
        ),
        (
            HEAD + BODY + "return inputs.b\n",
            None,
            r"LAW .*Inputs without a field 'b' \(NAME, line \d+\)$",
        ),
        *(
            (
                HEAD + BODY + f"{statement}\n    return (0.0, 0.0, 0.0)\n",
                None,
                r"LAW .*received: a statement that cannot be compiled \(NAME, line \d+\); "
                "compiled=False runs the law as plain Python$",
            )
            for statement in (
                "x, *rest = inputs.b_body_t",
                "import math",
                "global COUNT\n    COUNT = 1.0",
                "class Own:\n        pass",
                "match inputs.b_body_t:\n        case (x, y, z):\n            pass",
            )
        ),
        *(
            (
                HEAD + BODY + f"inputs.t_s {sign} 1.0\n    return (0.0, 0.0, 0.0)\n",
                None,
                r"LAW .*received: Inputs\.t_s, which cannot be set",
            )
            for sign in ("=", "+=")
        ),
    ],
)
@pytest.mark.skipif(not engine.COMPILED, reason="the compiler reports what does not compile")
def test_a_mistake_is_one_clear_line(tmp_path, text, name, expected):
    file = written(tmp_path, text)
    expected = expected.replace("NAME", re.escape(file.name))
    expected = expected.replace("FILE", re.escape(str(file)))
    expected = expected.replace("LAW", "law mine: must compile")
    with pytest.raises(ValueError, match=f"^{expected}") as caught:
        load_law(file, name)
    assert "\n" not in str(caught.value)


#: What is said after 'received' of a law with such a statement, and what to do.
STATEMENTS = {
    "with open('x'):\n        pass": ": a `with` statement, which cannot be compiled",
    "with open('x') as f:\n        pass": ": a `with` statement, which cannot be compiled",
    "x = 1.0\n    del x":
        ": a `del` statement, which cannot be compiled (NAME, line 7); leave it out",
    "x = sum(b for b in inputs.b_body_t)":
        ": a generator expression, which cannot be compiled (NAME, line 6); write a loop",
    "try:\n        x = 1.0 / inputs.t_s\n    except ZeroDivisionError:\n        x = 0.0":
        ": an `except` of one kind of error, which cannot be compiled (NAME, line 8); write",
    "if (x := inputs.t_s) > 1.0:\n        return (x, 0.0, 0.0)":
        ": a value whose type is not known, which cannot be compiled (NAME, line 6); set it in a",
    "x = open('x')": ": open, which cannot be compiled (NAME, line 6); compiled=False runs",
    "x = input()": ": input, which cannot be compiled (NAME, line 6); compiled=False runs",
    "x = time.time()": ": time.time, which cannot be compiled (NAME, line 6); compiled=False runs",
    "x = eval('1.0')": ": eval, which cannot be compiled (NAME, line 6); compiled=False runs",
    "yield (0.0, 0.0, 0.0)": " a generator or coroutine",
    "yield from inputs.b_body_t": " a generator or coroutine",
}  # fmt: skip


@pytest.mark.skipif(not engine.COMPILED, reason="the compiler reports what does not compile")
@pytest.mark.parametrize("statement", STATEMENTS)
def test_a_statement_that_does_not_compile_is_named(tmp_path, statement):
    text = f"import time\n{HEAD}{BODY}{statement}\n    return (0.0, 0.0, 0.0)\n"
    file = written(tmp_path, text)
    with pytest.raises(ValueError) as caught:
        load_law(file)
    must = "law mine: must compile as (inputs, parameters, memory) -> (x, y, z); received"
    found = str(caught.value)
    assert found.startswith(must + STATEMENTS[statement].replace("NAME", file.name))
    assert "\n" not in found and "vec3" not in found


@pytest.mark.skipif(not engine.COMPILED, reason="the compiler reports what does not compile")
@pytest.mark.parametrize("body", ["return (0.0, 0.0, 0.0)", "yield (0.0, 0.0, 0.0)"])
def test_an_async_law_is_refused(tmp_path, body):
    file = written(tmp_path, HEAD + "async " + BODY + body + "\n")
    with pytest.raises(ValueError, match=r"^law mine: .*; received a generator or coroutine$"):
        load_law(file)


#: What compiled code takes of NumPy: a law at as many seconds.
NUMPY_THAT_COMPILES = {
    "np.cross(inputs.b_body_t, (0.0, 0.0, 2.0))": (4.0, -2.0, 0.0),
    "2.0 * np.array(inputs.b_body_t)": (2.0, 4.0, 6.0),
    "np.zeros(3)": (0.0, 0.0, 0.0),
    "np.array(inputs.b_body_t) / np.linalg.norm(np.array((0.0, 3.0, 4.0)))": (0.2, 0.4, 0.6),
}
VEC3 = "; vectors are tuples: torquer.maths.geometry.vec3 has add, scale, dot, cross, norm for them"
PLAINLY = "; or compiled=False runs the law as plain Python"
CANNOT = ", which cannot be compiled (NAME, line 6)"
#: What it does not, and what the message says after 'received'.
NUMPY_THAT_DOES_NOT = {
    "np.linalg.norm(inputs.b_body_t)": ": norm(tuple of 3 numbers)" + CANNOT + VEC3 + PLAINLY,
    "np.dot(inputs.b_body_t, inputs.b_body_t)":
        ": dot(tuple of 3 numbers, tuple of 3 numbers)" + CANNOT + VEC3 + PLAINLY,
    "np.diag([1.0, 2.0, 3.0])": ": diag(list(number))" + CANNOT + VEC3 + PLAINLY,
    "np.einsum('i,i', np.zeros(3), np.zeros(3))": ": numpy.einsum" + CANNOT + VEC3 + PLAINLY,
    "np.no_such(3)": ": AttributeError(\"module 'numpy' has no attribute 'no_such'\")",
    "np.zeros((3, 3))": " one that returns an array of 2 dimensions" + VEC3,
    "np.zeros(3) if inputs.t_s else inputs.b_body_t":
        ": a value that is of several types: array, tuple of 3 numbers (NAME, line 6)"
        + VEC3 + PLAINLY,
    "tuple(np.zeros(3))": ": tuple(array)" + CANNOT + VEC3 + PLAINLY,
    "-2.0 * inputs.b_body_t": ": number * tuple of 3 numbers" + CANNOT + VEC3,
    "-inputs.b_body_t": ": -(tuple of 3 numbers)" + CANNOT + VEC3,
    "inputs.b_body_t + inputs.b_body_t": " one that returns a tuple of 6 numbers" + VEC3,
}  # fmt: skip


def with_numpy(folder, expression, decorator="@torquer.law"):
    text = f"import numpy as np\n{HEAD}{BODY}return {expression}\n"
    return written(folder, text.replace("@torquer.law", decorator))


def test_a_law_may_return_an_array_of_three(tmp_path):
    *others, last = NUMPY_THAT_COMPILES
    lines = [f"if inputs.t_s == {k}:\n        return {each}\n" for k, each in enumerate(others)]
    body = "    ".join([*lines, f"return {last}\n"])
    law = load_law(written(tmp_path, f"import numpy as np\n{HEAD}{BODY}{body}"))
    for t_s, expected in enumerate(NUMPY_THAT_COMPILES.values()):
        found = compiled(law)(ROW._replace(t_s=float(t_s)), law.pack(), law.first_memory())
        np.testing.assert_allclose(found.dipole_a_m2, expected, rtol=1e-15)


@pytest.mark.skipif(not engine.COMPILED, reason="the compiler reports what does not compile")
@pytest.mark.parametrize("expression", NUMPY_THAT_DOES_NOT)
def test_law_error_says_what_works_instead_of_numpy(tmp_path, expression):
    file = with_numpy(tmp_path, expression)
    with pytest.raises(ValueError) as caught:
        load_law(file)
    must = "law mine: must compile as (inputs, parameters, memory) -> (x, y, z); received"
    assert str(caught.value) == must + NUMPY_THAT_DOES_NOT[expression].replace("NAME", file.name)


def test_what_the_message_names_works(tmp_path):
    norm = "np.diag((1.0, 2.0, 3.0)) @ inputs.b_body_t / np.linalg.norm(inputs.b_body_t)"
    plain = load_law(with_numpy(tmp_path, norm, "@torquer.law(compiled=False)"))
    expected = np.array([1.0, 4.0, 9.0]) / np.sqrt(14.0)
    np.testing.assert_allclose(answer(plain), expected, rtol=1e-15)
    vectors = (
        "vec3.scale(vec3.dot(inputs.b_body_t, inputs.b_body_t), "
        "vec3.add(inputs.b_body_t, "
        "vec3.cross(inputs.b_body_t, (0.0, 0.0, vec3.norm((0.0, 3.0, 4.0))))))"
    )
    text = f"from torquer.maths.geometry import vec3\n{HEAD}{BODY}return {vectors}\n"
    law = load_law(written(tmp_path, text, "vectors.py"))
    np.testing.assert_allclose(answer(law), (14.0 * 11.0, 14.0 * -3.0, 14.0 * 3.0), rtol=1e-15)


@pytest.mark.skipif(not engine.COMPILED, reason="the compiler reports what does not compile")
def test_wrong_arguments_are_one_clear_line(tmp_path):
    file = written(tmp_path, HEAD + "def mine(inputs, parameters):\n    return (0.0, 0.0, 0.0)\n")
    with pytest.raises(ValueError, match=r"^law mine: must compile as .*takes 2 arguments"):
        load_law(file)


def test_a_file_that_is_not_there_is_reported(tmp_path):
    for path in (tmp_path / "none.py", tmp_path):
        message = re.escape(f"law.file: must be an existing file; received {path}")
        with pytest.raises(ValueError, match=f"^{message}$"):
            load_law(path)


def test_a_file_that_is_not_python_is_reported(tmp_path):
    file = written(tmp_path, GOOD, "law.txt")
    message = f"law.file: must be a Python file (.py); received {file}"
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        load_law(file)


def test_files_of_one_name_in_two_folders_are_two_laws(tmp_path):
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
    one = load_law(written(tmp_path / "a", GOOD))
    other = load_law(written(tmp_path / "b", GOOD.replace("inputs.b_body_t", "(9, 9, 9)")))
    assert answer(one) == (1.0, 2.0, 3.0) and answer(other) == (9.0, 9.0, 9.0)


def test_a_law_file_may_import_a_file_next_to_it(tmp_path):
    helper = "import numba\n\n@numba.njit\ndef twice(x):\n    return 2.0 * x\n"
    written(tmp_path, helper, "helper_of_test_user_law.py")
    text = "from helper_of_test_user_law import twice\n" + HEAD + BODY
    law = load_law(written(tmp_path, text + "return (twice(inputs.t_s), 0.0, 0.0)\n"))
    assert answer(law) == (4.0, 0.0, 0.0)


def test_a_law_file_may_define_dataclasses(tmp_path):
    text = (
        "from __future__ import annotations\nfrom dataclasses import dataclass\n\n"
        "@dataclass\nclass Gains:\n    k: float = 3.0\n\nK = Gains().k\n\n"
    )
    law = load_law(written(tmp_path, text + HEAD + BODY + "return (K, 0.0, 0.0)\n"))
    assert answer(law) == (3.0, 0.0, 0.0)


def test_the_spec_of_a_user_law(tmp_path):
    text = HEAD.replace("law\n", "law(parameters={'k': 2.0})\n") + BODY
    file = written(tmp_path, text + "return (parameters[0], 0.0, 0.0)\n")
    spec = UserLaw(kind="user", file=file, parameters={"k": 7.0})
    assert answer(spec.law()) == (7.0, 0.0, 0.0)
    assert answer(UserLaw(kind="user", file=file, function="mine").law()) == (2.0, 0.0, 0.0)
    with pytest.raises(ValueError, match=r"^control\.law\.parameters\.speed: must be one of: k"):
        UserLaw(kind="user", file=file, parameters={"speed": 7.0}).law()
    with pytest.raises(ValueError, match="must be given; received nothing"):
        UserLaw(kind="user")


HELPERS = str(Path(__file__).parents[2])
ASK = f"""
import sys
from pathlib import Path

sys.path.append({HELPERS!r})
from law_cases import compiled, inputs
from torquer.computer.blocks.user import load_law

law = load_law(Path(sys.argv[1]))
print(compiled(law)(inputs(), law.pack(), law.first_memory()).dipole_a_m2[0])
print(sum(law.in_loop().compiled.stats.cache_hits.values()))
"""


def in_a_process(script, *arguments):
    """Last lines that a new process prints."""
    here = Path(torquer.__file__).parents[1]
    path = os.pathsep.join([str(here), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [sys.executable, "-c", script, *map(str, arguments)],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": path, "NUMBA_DISABLE_JIT": "0"},
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


def test_second_process_reuses_the_cached_law_and_notices_an_edit(tmp_path, monkeypatch):
    monkeypatch.setenv("TORQUER_CACHE_DIR", str(tmp_path / "cache"))  # none of an earlier run
    text = "from gains import K\n" + HEAD + BODY + "return (K * SIGN, 0.0, 0.0)\n\nSIGN = 1.0\n"
    written(tmp_path, "K = 2.0\n", "gains.py")
    file = written(tmp_path, text)
    assert in_a_process(ASK, file) == ["2.0", "0"]
    assert in_a_process(ASK, file) == ["2.0", "1"]
    written(tmp_path, text.replace("SIGN = 1.0", "SIGN = -1.0"))
    assert in_a_process(ASK, file) == ["-2.0", "0"]
    written(tmp_path, "K = 5.0\n", "gains.py")
    assert in_a_process(ASK, file) == ["-5.0", "0"]


SCRIPT = f"""
import sys

import torquer
from gains import K

sys.path.append({HELPERS!r})
from law_cases import compiled, inputs


@torquer.law
def mine(inputs, parameters, memory):
    return (K, 0.0, 0.0)


print(compiled(mine)(inputs(), mine.pack(), mine.first_memory()).dipole_a_m2[0])
"""


def test_script_law_notices_an_edit_of_a_neighbouring_file(tmp_path):
    script = written(tmp_path, SCRIPT, "script.py")
    run = (
        f"import runpy, sys; sys.path.insert(0, {str(tmp_path)!r}); runpy.run_path({str(script)!r})"
    )
    for value in ("2.0", "5.0"):
        written(tmp_path, f"K = {value}\n", "gains.py")
        assert in_a_process(run) == [value]
