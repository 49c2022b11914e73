"""What the translator does not know is refused in one line: file, line, construct, what instead."""

import re
from pathlib import Path

import numpy as np
import pytest
from flight.c99.test_generated import module_of

from torquer.flight.c99.program import Program
from torquer.flight.c99.refusal import Refused
from torquer.flight.c99.types import INT, REAL, Array, Tuple

HEAD = "import math, os, random, time\nimport numpy as np\n"
HEAD += "from torquer.maths.geometry.vec3 import add\n"
HEAD += "TABLE = np.zeros(3)\nGAINS = (1.0, 2, 3.0)\n"
HEAD += "BASE, SINGLE, SMALL = 1.1, np.float32(0.1), np.int32(3)\n"
HEAD += "def power(x, y):\n    return abs(x) ** y\n"
HEAD += "def copied(to, of):\n    to[:] = of\n"
HEAD += "def again(x, n, v, cells):\n    return again(x, n, v, cells)\n"
HEAD += "def two(x):\n    return x, 1.0\n"
TYPES = [REAL, INT, Tuple((REAL,) * 3), Array((6,))]
#: Body of a kernel, and a word of what is to be written instead.
BODIES = {
    "return sum(v)": "loop",
    "return math.hypot(x, x)": "math.sqrt",
    "return np.sin(x)": "math",
    "return x ** 2": "x * x",
    "return 2.0 ** x": "math.exp",
    "return n ** n": "product",
    "return n << 2": "product",
    "return abs(x) ** n": "float(n)",
    "return math.pow(x, n)": "float(n)",
    "return math.pow(x, 2.0)": "x * x",
    "return x * BASE ** 3": "x * x",
    "return power(x, 0.5)": "math.sqrt",
    "half = 0.5\n    return power(x, half)": "math.sqrt",
    "half = 0.5\n    return abs(x) ** half": "math.sqrt",
    "return math.log(x, 2.0)": "quotient",
    "return np.sign(n)": "(n > 0) - (n < 0)",
    "return np.floor(n)": "whole",
    "return x in (1.0, x)": "==",
    "return n + 9007199254740993": "2**53",
    "return int(math.inf)": "finite",
    "return x * SINGLE": "float",
    "return n * SMALL": "int",
    "return v[0.5:]": "int(",
    "a, b = cells[0:3], cells[1:4]\n    b[:] = a\n    return x": "overlap",
    "return copied(cells[0:3], cells[1:4])": "overlap",
    "a, b = cells[0:3], cells[3:6]\n    b[::-1] = a\n    return x": "loop",
    "ω = x\n    return ω": "letters",
    "return math.radians(x)": "math.pi",
    "return np.clip(x, 0.0, 1.0)": "min(max(",
    "return x & 1": "whole numbers",
    "return [x, x]": "tuple",
    "return {0: x}[0]": "variables",
    "return (lambda y: y)(x)": "def",
    "return max(v)": "not with a tuple",
    "return max(x, 0)": "0.0",
    "return round(x)": "math.floor",
    "return x if n > 0 else 0": "0.0",
    "return x or 1.0": "truths",
    "return v + v": "vec3",
    "return v[n + 7:]": "constants",
    "return v[4]": "index",
    "return cells[6]": "0 to 5",
    "return cells[x]": "int(",
    "return GAINS[n]": "constant index",
    "return TABLE[0]": "memory",
    "return f'{x}'": "text",
    "return unknown_name": "define",
    "return again(x, n, v, cells)": "loop",
    "return two(x, x)": "arguments",
    "return two(*cells)": "memory.b[0]",
    "return add(v, x)[0]": "a float is a tuple",
    "return cells[n % 3 :][0]": "constants",
    "return cells[1 : n % 3][0]": "constants",
    "k = n % 3 + 6\n    return cells[k]": "0 to 5",
    "return x / 0.0": "not 0",
    "return n // 0": "not 0",
    "try:\n        x = cells[n]\n    except Exception:\n        x = 0.0\n    return x": "leave",
    "return (x, cells)": "stay where they are",
    "return cells": "numbers",
    "return y": "define",
    "y = z\n    z = 1.0\n    return y": "before it is read",
    "y = 0\n    y = x\n    return y": "0.0",
    "y = x\n    y = v\n    return y": "one type",
    "if n > 0:\n        return x": "at the end",
    "if n > 0:\n        return x\n    return v": "one type",
    "v[0] = x\n    return x": "tuples",
    "cells[0] = v\n    return x": "number",
    "for k in range(0, n, n):\n        x += 1.0\n    return x": "constant step",
    "for k in range(3):\n        x += 1.0\n    else:\n        x = 0.0\n    return x": "else",
    "for k in cells:\n        x += k\n    return x": "tuple",
    "for k, y in enumerate(v):\n        x += y\n    return x": "range",
    "for y in GAINS:\n        x += y\n    return x": "one type",
    "while n > 0:\n        n -= 1\n    else:\n        x = 0.0\n    return x": "else",
    "try:\n        x = 1.0 / x\n    except ValueError:\n        x = 0.0\n    return x": "leave",
    "raise ValueError": "nan",
    "assert x > 0.0\n    return x": "leave",
    "import math\n    return x": "outside",
    "def inner(y):\n        return y\n    return inner(x)": "outside",
    "global TABLE\n    return x": "memory",
    "return [y for y in v][0]": "loop",
    "a, b = v\n    return a": "parts",
    "a, *b = v\n    return a": "as many names",
    "return x is n": "==",
    "return x in cells": "tuple",
    "(y := x)\n    return x": "does nothing",
    "return print(x)": "leave it out",
    "print('x')\n    return x": "leave it out",
    "return np.random.rand()": "the same inputs have the same answer",
    "return np.random.default_rng(1).normal()": "the same inputs have the same answer",
    "np.random.seed(1)\n    return x": "the same inputs have the same answer",
    "return random.random()": "the same inputs have the same answer",
    "return random.gauss(0.0, x)": "the same inputs have the same answer",
    "return time.time()": "inputs.t_s",
    "return os.getpid()": "nothing is read on board",
    "x = open('x')\n    return x": "nothing is read on board",
    "return input()": "nothing is read on board",
    "with open('x') as f:\n        pass\n    return x": "nothing is opened on board",
    "return eval('1.0')": "what it computes",
    "return getattr(v, 'x')": "a.b",
    "return globals()['x']": "name",
    "return sorted(v)[0]": "min and max",
    "yield x\n    return x": "return one answer",
    "x = yield\n    return x": "return one answer",
    "yield from v\n    return x": "return one answer",
    "del n\n    return x": "leave it out",
    "y = n\n    def f():\n        nonlocal y\n    return x": "outside",
    "match n:\n        case 1:\n            x = 1.0\n    return x": "elif",
    "return v.x": "field",
    "return cells[::2][0]": "loop",
    "return math.floor(x=x)": "places",
    "return x < v": "numbers",
    "x.y = 1.0\n    return x": "field",
    "cells[1:3] = x\n    return x": "loop",
}  # fmt: skip


@pytest.mark.parametrize("body", BODIES)
def test_what_is_not_known_is_refused_in_one_line(body, tmp_path: Path):
    text = f"{HEAD}def kernel(x, n, v, cells):\n    {body}\n"
    kernel = module_of(text, tmp_path).kernel
    with pytest.raises(Refused) as refused:
        Program().function(kernel, TYPES)
    message = str(refused.value)
    first, last = HEAD.count("\n") - 3, text.count("\n")
    assert "\n" not in message
    assert BODIES[body] in message
    line = re.match(r"made\.py, line (\d+): .* has no translation to C; ", message)
    assert line is not None and first <= int(line[1]) <= last


def test_an_async_function_is_refused_as_one(tmp_path: Path):
    kernel = module_of("async def kernel(x):\n    return x\n", tmp_path).kernel
    with pytest.raises(Refused, match=r"^made\.py, line 1: a function with async .* with def$"):
        Program().function(kernel, [REAL])


def test_a_file_edited_since_it_was_loaded_is_refused(tmp_path: Path):
    module = module_of("def kernel(x):\n    return x\n", tmp_path)
    (tmp_path / "made.py").write_text("def kernel(x):\n    return -x\n")
    with pytest.raises(Refused, match="edited since it was loaded"):
        Program().function(module.kernel, [REAL])


def test_a_kernel_without_text_is_refused():
    with pytest.raises(Refused, match="has no text in Python"):
        Program().function(np.sin, [REAL])
