"""Kernels and laws made at random that may fail: indices, whole numbers and constants unchecked."""

import math
from random import Random

from flight.c99.generated import PRELUDE, Maker

# ruff: noqa: E501  the text of kernels

#: Functions of the library that Numba has, too.
LIBRARY = ("sin", "cos", "tan", "exp", "expm1", "log", "log1p", "log10", "sinh", "tanh", "atan")
COMPILED = PRELUDE.replace("\ndef ", "\n@numba.njit\ndef ").replace(
    "import math", "import math\nimport numba"
)
OF_CONSTANTS = "\n".join(
    f"@numba.njit\ndef {name}_through(x):\n    return math.{name}(x)\n" for name in LIBRARY
)
HEAD = f"""{COMPILED}
{OF_CONSTANTS}
class Parameters(NamedTuple):
    gain: float
    table: tuple
    count: float


@numba.njit
def picked(memory, k):
    return memory[k]


@numba.njit
def whole_of(x):
    return int(x)
"""
SPECIAL = (0.0, -0.0, 1.0, -1.5, 5e-324, 1e308, 1e20, math.inf, -math.inf, math.nan, 9.3e18, 3.0)


class Unchecked(Maker):
    """As `Maker`, with indices that may leave their tables and numbers that may leave 64 bits."""

    def number(self, depth: int) -> str:
        if depth <= 0 or self.random.random() < 0.7:
            return super().number(depth)
        a, n, x = self.number(depth - 1), self.whole(depth - 1), self.random.uniform(0.01, 0.99)
        return self.one_of(
            f"memory[{n}]", f"v[{n}]", f"TABLE[{n}]", f"picked(memory, {n})", f"(1.0 / {a})",
            f"{self.one_of(*LIBRARY)}_through({x!r})", f"math.{self.one_of(*LIBRARY)}({x!r})",
            f"{self.one_of(*LIBRARY)}_through({a})", f"float({n})",
        )  # fmt: skip

    def whole(self, depth: int) -> str:
        if depth <= 0 or self.random.random() < 0.6:
            return super().whole(depth)
        a, n, m = self.number(depth - 1), self.whole(depth - 1), self.whole(0)
        return self.one_of(
            f"int({a})", f"whole_of({a})", f"whole_of({self.one_of('1e30', '-3.7', '9.2e18')})", f"({n} * 4503599627370449)",
            f"({n} * {m})", f"math.floor({a})", f"({n} // {m})", f"({n} % {m})", f"abs({n} - {m})", f"min(max({n}, 0), 5)",
        )  # fmt: skip

    def _body(self) -> str:
        """Statements; Numba does not know a star in a tuple."""
        text = "\n".join(self.block(1, "    "))
        return text.replace("(v[0], *v[:2])", "(v[0], v[0], v[1])")

    def kernel(self, name: str) -> str:
        """A kernel as `Maker`'s, with smaller blocks."""
        body = self._body()
        return (
            f"def {name}(x, y, n, m, v, memory):\n    total, count, found = 0.5, n % 3, x > y\n"
            f"{body}\n    return ({self.number(2)}, total, count, found, v)\n"
        )

    def law(self, name: str) -> str:
        """A law of the field, the rate, parameters and cells."""
        body = self._body()
        return (
            f"def {name}(inputs, parameters, memory):\n"
            f"    x, y, v = inputs.b_body_t[0], parameters.gain, inputs.b_body_t\n"
            f"    n, m = int(inputs.t_s), int(parameters.count)\n"
            f"    total, count, found = parameters.table[m % 3], n % 3, x > y\n"
            f"{body}\n    return ({self.number(1)}, total, float(count) if found else v[2])\n"
        )


def text_of(random: Random, count: int, what: str) -> str:
    """A module of so many; `what`: "kernel" or "law"."""
    made = (getattr(Unchecked(random), what)(f"{what}_{k}") for k in range(count))
    return HEAD + "\n\n".join(made)


def number_of(random: Random) -> float:
    """A float, often a special one."""
    return random.choice(SPECIAL) if random.random() < 0.3 else random.uniform(-4.0, 4.0)


def whole_of(random: Random) -> int:
    """A whole number, sometimes the least or a large one."""
    return (
        random.choice((-(2**63), 2**53, 10**6)) if random.random() < 0.1 else random.randint(-7, 7)
    )
