"""Kernels made at random from every construct that the translator knows, as Python text."""

from random import Random

# ruff: noqa: E501, F541  the text of kernels

PRELUDE = '''
import math
from typing import NamedTuple

LIMIT, TABLE = 0.75, (1.5, -2.25, 1e-310)


class Pair(NamedTuple):
    first: float
    second: tuple
    number: int = 3


def bump(memory, k, by):
    """Changes the memory and answers with what is in it."""
    memory[k] += by
    return memory[k]


def peek(memory, k):
    return memory[k] - memory[5 - k]


def is_positive(memory, k):
    memory[k] = memory[k] - 0.5
    return memory[k] > 0.0


def turned(v, x):
    return (v[1], -v[2], v[0] * x)


def large(v, w, x):
    return (v[0], v[1], v[2], w[0], w[1], w[2], x, -x, x * x, 1.0)


def of_large(t, k):
    return t[k] - t[9 - k]


def choose(x, y, apply):
    return apply(x, y)


def power(x, y):
    return abs(x) ** y


def signed(x, y):
    return math.copysign(x, y) if y == y else x


def less(x, y):
    return x - y


def pair_of(x, n, v):
    return Pair(second=v, first=x, number=n)
'''


class Maker:
    """Text of expressions and statements by their type; `depth` bounds how far they nest."""

    def __init__(self, random: Random):
        self.random, self.count = random, 0

    def one_of(self, *choices):
        return self.random.choice(choices)

    def number(self, depth: int) -> str:
        """An expression that is a float."""
        r = self.random
        leaf = self.one_of("x", "y", "v[0]", "v[-1]", "total", "memory[2]", "LIMIT", "1e-310", "(x + math.inf)",
                           f"{r.uniform(-3, 3):.3f}", "v[n % 3]", "memory[-1]")  # fmt: skip
        if depth <= 0:
            return leaf
        a, b, n = self.number(depth - 1), self.number(depth - 1), self.whole(depth - 1)
        return self.one_of(
            leaf, f"({a} + {b})", f"({a} - {b})", f"{a} * {b}", f"({a} / {b})", f"-{a}", f"({a} // {b})",
            f"({a} % {b})", f"power({a} + memory[1], {b} - memory[4])", f"({a} if {self.truth(depth - 1)} else {b})",
            f"min({a}, {b})", f"max({a}, {b}, x)", f"abs({a})", f"float({n})", f"({a} * {n})",
            f"({n} / {self.whole(0)})", f"math.sqrt(abs({a}))", f"math.sin({a})", f"math.atan2({a}, {b})",
            f"signed({a}, {b})", f"bump(memory, {n} % 6, {a})", f"peek(memory, {n} % 6)",
            f"turned(v, {a})[{r.randrange(3)}]", f"of_large(large(v, turned(v, y), {a}), {n} % 10)",
            f"choose({a}, {b}, less)", f"pair_of({a}, {n}, v).second[1]", f"TABLE[{n} % 3]",
            f"({a}, {b}, total)[{r.randrange(-3, 3)}]", f"(+{a})", f"math.fmod({a}, {b})",
        )  # fmt: skip

    def whole(self, depth: int) -> str:
        """An expression that is a small integer."""
        leaf = self.one_of("n", "m", "3", "-2", "len(v)", "count", "memory.shape[0]")
        if depth <= 0:
            return leaf
        a, b = self.whole(depth - 1), self.whole(depth - 1)
        return self.one_of(
            leaf, f"({a} + {b})", f"({a} - {b})", f"(({a} * {b}) % 11)", f"({a} // {b})", f"({a} % {b})",
            f"-{a}", f"abs({a})", f"min({a}, {b})", f"max({a}, {b})", f"({a} & {b})", f"({a} | {b})",
            f"({a} ^ {b})", f"int(math.fmod({self.number(depth - 1)}, 50.0))",
            f"({a} if {self.truth(depth - 1)} else {b})", f"pair_of(x, {a}, v).number",
            f"int({self.truth(depth - 1)})",
        )  # fmt: skip

    def truth(self, depth: int) -> str:
        """An expression that is a truth."""
        if depth <= 0:
            return self.one_of("x < y", "n > m", "n != 2", "x == x", "True", "found")
        a, b, c = self.number(depth - 1), self.number(depth - 1), self.number(depth - 1)
        p, q = self.truth(depth - 1), self.truth(depth - 1)
        op, other = self.one_of("<", "<=", ">", ">=", "==", "!="), self.one_of("<", "<=", ">")
        n = self.whole(depth - 1)
        return self.one_of(
            f"({a} {op} {b})", f"({a} {op} {b} {other} {c})", f"({p} and {q})", f"({p} or {q})",
            f"(not {p})", f"is_positive(memory, {n} % 6)", f"math.isnan({a})", f"math.isfinite({a})",
            f"({n} {op} {self.whole(depth - 1)} {other} {a})", f"({n} in (1, n, 4))", f"bool({n})",
            f"({p} == {q})", f"({n} not in (0, m))",
        )  # fmt: skip

    def block(self, depth: int, indent: str, in_loop: bool = False) -> list[str]:
        """Statements, at least one."""
        lines = []
        for _ in range(self.random.randrange(1, 4)):
            lines += self.statement(depth, indent, in_loop)
        return lines

    def name(self, word: str) -> str:
        self.count += 1
        return f"{word}{self.count}"

    def statement(self, depth: int, indent: str, in_loop: bool) -> list[str]:
        a, n, t = self.number(2), self.whole(1), self.truth(2)
        simple = self.one_of(
            f"total = {a}", f"total += {a}", f"total -= {a}", f"total *= {self.number(1)}",
            f"memory[{n} % 6] = {a}", f"memory[n % 6] -= {self.number(1)}", f"found = {t}",
            f"total, x = {a}, total", f"memory[0], memory[1] = memory[1], {a}", f"v = turned(v, {a})",
            f"x, y = y, x", f"memory[3] = memory[4] = {a}", f"count = {n} % 5", "pass",
            f"first, (second, _, third) = {a}, turned(v, x)\n{indent}total += first * second - third",
            "memory[:] = total", f"bump(memory, {n} % 6, {self.number(1)})", f"v = (v[0], *v[:2])",
        )  # fmt: skip
        if depth <= 0 or self.random.random() < 0.45:
            return [f"{indent}{simple}"]
        return self.compound(depth, indent, in_loop)

    def compound(self, depth: int, indent: str, in_loop: bool) -> list[str]:
        """An if, a loop, or a jump out of one."""
        deeper, k = f"{indent}    ", self.name("k")
        jump = [f"{deeper}{self.one_of('break', 'continue')}"] if in_loop else []
        kind = self.one_of("if", "else", "elif", "range", "down", "while", "tuple", "used", "jump")
        inner = self.block(depth - 1, deeper, in_loop)
        loop = self.block(depth - 1, deeper, True)
        if kind == "if":
            return [f"{indent}if {self.truth(2)}:", *inner]
        if kind == "else":
            return [f"{indent}if {self.truth(1)}:", *inner, f"{indent}else:",
                    *self.block(depth - 1, deeper, in_loop)]  # fmt: skip
        if kind == "elif":
            return [
                f"{indent}if {self.truth(1)}:",
                *inner,
                f"{indent}elif {self.truth(2)}:",
                *inner,
            ]
        if kind == "range":
            low, high = self.one_of("0", "m % 3", "4"), self.one_of("3", "n % 4", "count % 4", "-1")
            return [
                f"{indent}for {k} in range({low}, {high}):",
                *loop,
                f"{deeper}total += float({k})",
            ]
        if kind == "down":
            step = self.one_of("-1", "-2", "2", "3")
            return [f"{indent}for {k} in range(n % 5, m % 7, {step}):", *loop]
        if kind == "while":
            return [f"{indent}{k} = 0", f"{indent}while {k} < 3 and {self.truth(1)}:",
                    f"{deeper}{k} += 1", *loop]  # fmt: skip
        if kind == "tuple":
            return [
                f"{indent}for {k} in (x, {self.number(1)}, v[1]):",
                *loop,
                f"{deeper}total -= {k}",
            ]
        if kind == "used":  # the variable is set within the loop and read after it
            return [f"{indent}{k} = 7", f"{indent}for {k} in range(n % 4):", *loop,
                    f"{deeper}{k} += 1", f"{indent}total += float({k})"]  # fmt: skip
        return [f"{indent}if {self.truth(1)}:", *(jump or inner)]

    def kernel(self, name: str) -> str:
        """A kernel `(x, y, n, m, v, memory)` that answers with all that it has found."""
        body = "\n".join(self.block(3, "    "))
        early = f"    if {self.truth(1)}:\n        return (x, total, count, found, v)\n"
        return (
            f"def {name}(x, y, n, m, v, memory):\n    total, count, found = 0.5, n % 3, x > y\n"
            f"{body}\n{early if self.random.random() < 0.3 else ''}"
            f"    return ({self.number(2)}, total, count, found, v)\n"
        )


def module_text(random: Random, count: int) -> str:
    """A module of so many kernels, named kernel_0, kernel_1, ..."""
    return PRELUDE + "\n\n".join(Maker(random).kernel(f"kernel_{k}") for k in range(count))
