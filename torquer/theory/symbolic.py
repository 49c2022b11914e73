"""Symbolic averaging of the flight laws themselves: averaged equations as formulas and LaTeX.

For laws that are polynomials in field, rate and direction cosines, in the averaged field (Z) and
fast rotation. Needs sympy.

A law's kernel is rebuilt as plain Python that works on polynomials: the compiled helpers that it
calls are replaced by their sources, and the two that use a quaternion by ones that use direction
cosines. Angles enter by their cosines and sines as independent unknowns, reciprocals as unknowns
of their own; the mean of a monomial cos^a x sin^b x over a turn is known, and squares of
sines are eliminated by sin^2 = 1 - cos^2.
"""

import math
from collections.abc import Mapping
from types import FunctionType, ModuleType, SimpleNamespace

from torquer.computer.blocks.law import Law
from torquer.theory.slow.averaging import exact_inputs
from torquer.theory.slow.evolution.model import Slow

try:
    import sympy
    from sympy.polys.polyerrors import BasePolynomialError
except ImportError as error:  # pragma: no cover - depends on what is installed
    raise ImportError("torquer.theory.symbolic: needs sympy; pip install sympy") from error

#: Symbols of the equations: p = sin^2(Theta)/2, l = L/L0, and those of the satellite.
p, length, momentum, strength, transverse, axial, rate = sympy.symbols(
    "p l L0 B0 A C omega0", positive=True
)
#: Unit vector to the Sun in Z.
sun = sympy.symbols("S1 S2 S3", real=True)
rho, sigma, theta = sympy.symbols("rho sigma theta", real=True)
#: Slow angles, fast angles (chi = 2u), and the cone's half-angle.
ANGLES = ("rho", "sigma", "theta", "phi", "psi", "chi", "Theta")
SLOW_ANGLES = {"rho": rho, "sigma": sigma, "theta": theta}
#: Unknowns that come with their reciprocals.
DIVISORS = (length, momentum, transverse, axial, strength)


#: Errors of operations that lead out of the polynomials.
_NOT_POLYNOMIAL = (TypeError, AttributeError, ValueError, BasePolynomialError)


class Attitude:
    """Stands for the quaternion body to Z in a symbolic law: direction cosines (rows)."""

    def __init__(self, rows):
        self.rows = rows


class Algebra:
    """Polynomials in cosines, sines, the satellite's constants and their reciprocals."""

    def __init__(self, others):
        angles = [f"{kind}_{name}" for name in ANGLES for kind in "cs"]
        constants = [str(symbol) for symbol in DIVISORS]
        reciprocals = [f"per_{symbol}" for symbol in DIVISORS]
        self.others = [s for s in others if s not in DIVISORS]
        names = [*angles, *constants, *reciprocals, *(str(s) for s in self.others)]
        self.ring = sympy.ring(names, sympy.QQ)[0]
        self.gens = dict(zip(names, self.ring.gens, strict=True))
        self.place = {name: i for i, name in enumerate(names)}

    def turn(self, name):
        """Cosine and sine of an angle."""
        return self.gens[f"c_{name}"], self.gens[f"s_{name}"]

    def of(self, value):
        """A number, a symbol or a polynomial of symbols as an element."""
        value = sympy.nsimplify(value)
        return self.ring.from_expr(
            value.subs({s: sympy.Symbol(str(s)) for s in value.free_symbols})
        )

    def reduce(self, element):
        """Reduced: without squares of sines and products with a reciprocal."""
        pairs = [(self.place[str(s)], self.place[f"per_{s}"]) for s in DIVISORS]
        found = self.ring.zero
        for powers, coefficient in element.terms():
            powers, rest = list(powers), self.ring.one
            for one, other in pairs:
                both = min(powers[one], powers[other])
                powers[one] -= both
                powers[other] -= both
            for name in ANGLES:
                c, _ = self.turn(name)
                at = self.place[f"s_{name}"]
                if powers[at] > 1:
                    rest *= (1 - c**2) ** (powers[at] // 2)
                    powers[at] %= 2
            found += rest * self.ring({tuple(powers): coefficient})
        return found

    def mean(self, element, name):
        """Mean over a turn of an angle."""
        at_c, at_s = self.place[f"c_{name}"], self.place[f"s_{name}"]
        found = {}
        for powers, coefficient in element.terms():
            a, b = powers[at_c], powers[at_s]
            if a % 2 == 0 and b % 2 == 0:
                rest = list(powers)
                rest[at_c] = rest[at_s] = 0
                key = tuple(rest)
                found[key] = found.get(key, 0) + coefficient * self.ring.domain.from_sympy(
                    _mean_powers(a, b)
                )
        return self.ring(found)

    def root(self, square):
        """Square root of an element that reduces to one square term."""
        terms = self.reduce(square).terms()
        powers, coefficient = terms[0]
        number = sympy.sqrt(sympy.Rational(str(coefficient)))
        if len(terms) > 1 or any(n % 2 for n in powers) or not number.is_rational:
            raise TypeError("a square root remains")
        halves = tuple(n // 2 for n in powers)
        return Root(self, self.ring({halves: self.ring.domain.from_sympy(number)}))

    def printed(self, element):
        """The element as a formula in functions of the slow angles and p."""
        expression = self.reduce(element).as_expr()
        for name, angle in SLOW_ANGLES.items():
            c, s = (sympy.Symbol(f"{kind}_{name}") for kind in "cs")
            expression = expression.subs({c: sympy.cos(angle), s: sympy.sin(angle)})
        named = {sympy.Symbol(str(s)): s for s in (*DIVISORS, *self.others)}
        named |= {sympy.Symbol(f"per_{s}"): 1 / s for s in DIVISORS}
        c = sympy.Symbol("c_Theta")
        expression = sympy.expand(expression).subs(c, sympy.sqrt(1 - 2 * p)).subs(named)
        return sympy.factor(sympy.expand(expression))


class Root:
    """A positive length, which kernels only compare with zero and divide by."""

    def __init__(self, algebra, element):
        self.algebra, self.element = algebra, element

    def __gt__(self, other):
        return True

    def __rtruediv__(self, other):
        algebra, inverse = self.algebra, self.algebra.ring.one
        ((powers, coefficient),) = self.element.terms()
        divisors = {algebra.place[str(s)]: algebra.gens[f"per_{s}"] for s in DIVISORS}
        for at, power in enumerate(powers):
            if power and at not in divisors:
                raise TypeError("a quotient remains")
            if power:
                inverse *= divisors[at] ** power
        return inverse * algebra.of(other) / coefficient


def _mean_powers(a, b) -> sympy.Rational:
    """Mean of cos^a sin^b over a turn, a and b even."""
    double = sympy.factorial2
    return double(a - 1) * double(b - 1) / double(a + b)


def _cross(a, b):
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def _times(rows, vector):
    return tuple(sum(x * v for x, v in zip(row, vector, strict=True)) for row in rows)


def _transpose(rows):
    return tuple(zip(*rows, strict=True))


def _product(one, other):
    return _transpose([_times(one, column) for column in _transpose(other)])


def _about(axis, turn, ring):
    """Rows of the turn about axis 0, 1 or 2: components in the turned frame to the old ones."""
    rows = [[ring.one if i == j else ring.zero for j in range(3)] for i in range(3)]
    j, k = (axis + 1) % 3, (axis + 2) % 3
    rows[j][j] = rows[k][k] = turn[0]
    rows[j][k], rows[k][j] = -turn[1], turn[1]
    return rows


def on_symbols(function, algebra, known=None):
    """A kernel's function rebuilt to work on polynomials, with all kernels that it calls."""
    plain = getattr(function, "py_func", function)
    known = {} if known is None else known
    if plain in known:
        return known[plain]
    names = dict(plain.__globals__)
    rebuilt = FunctionType(plain.__code__, names, plain.__name__, plain.__defaults__)
    known[plain] = rebuilt
    instead = {
        "rotate_inverse": lambda q, v: _times(_transpose(q.rows), v),
        "rotate": lambda q, v: _times(q.rows, v),
    }
    for name in plain.__code__.co_names:
        value = names.get(name)
        if name in instead:
            names[name] = instead[name]
        elif isinstance(value, ModuleType) and value is math:
            names[name] = SimpleNamespace(sqrt=algebra.root, nan=math.nan)
        elif hasattr(value, "py_func") or isinstance(value, FunctionType):
            names[name] = on_symbols(value, algebra, known)
    return rebuilt


def _mean_torque(law: Law, algebra: Algebra, parameters):
    """Means over psi, phi, u of the torque in L, and of its part that changes theta."""
    ring, gens, turn = algebra.ring, algebra.gens, algebra.turn
    to_z = _product(_about(2, turn("sigma"), ring), _about(1, turn("rho"), ring))
    to_l = _product(_about(2, turn("psi"), ring), _about(0, turn("theta"), ring))
    to_l = _product(to_l, _about(2, turn("phi"), ring))
    (cc, cs), (chi_c, chi_s) = turn("Theta"), turn("chi")
    b_z = [gens["B0"] * x for x in (-cs * chi_s, cs * chi_c, cc)]
    dcm = _product(to_z, to_l)
    x, y, z = (gens["L0"] * gens["l"] * e for e in to_l[2])
    omega = (x * gens["per_A"], y * gens["per_A"], z * gens["per_C"])
    models = (b_z, [ring.zero] * 3, [algebra.of(s) for s in sun])
    inputs = on_symbols(exact_inputs, algebra)(ring.zero, Attitude(dcm), omega, models)
    m = on_symbols(law.function, algebra)(inputs, parameters, [])
    m = [algebra.reduce(algebra.ring.one * x) for x in m]
    torque = _times(to_l, _cross(m, [algebra.reduce(x) for x in inputs.b_body_t]))
    c, s = turn("psi")
    for x in (*torque, torque[1] * c - torque[0] * s):
        for name in ("psi", "phi", "chi"):
            x = algebra.mean(x, name)
        yield algebra.reduce(x)


def _in_ring(algebra: Algebra, value):
    """A symbol, a number or a vector of them as laws take it."""
    if isinstance(value, tuple):
        return tuple(_in_ring(algebra, part) for part in value)
    return value if isinstance(value, float | int) else algebra.of(value)


def averaged_equations(law: Law, symbols: Mapping | None = None) -> Slow:
    """Derivatives of l, rho, sigma, theta by u as formulas, averaged over psi, phi and u.

    `symbols` puts symbols in place of the law's parameters by name, such as
    {"gain": sympy.Symbol("k")}, a tuple of them for a vector; the others keep their numbers. The
    result holds these, the symbols of this module (l, L0, B0, A, C, omega0, p; S1, S2, S3) and rho,
    sigma, theta. ValueError for a law with memory, and for one that is not a polynomial.
    """
    if len(law.first_memory()):
        raise ValueError(f"law {law.name}: must have no memory to be averaged")
    unknown = set(symbols or {}) - set(law.values())
    if unknown:
        raise ValueError(f"law {law.name}: must have the parameters {', '.join(sorted(unknown))}")
    free = {s for value in (symbols or {}).values() for s in sympy.sympify(value).free_symbols}
    algebra = Algebra(sorted(free | set(sun), key=str))
    replaced = {name: _in_ring(algebra, value) for name, value in (symbols or {}).items()}
    parameters = law.parameters._replace(**replaced) if replaced else law.parameters
    try:
        means = [algebra.printed(x) for x in _mean_torque(law, algebra, parameters)]
    except _NOT_POLYNOMIAL as error:
        raise ValueError(
            f"law {law.name}: must be a polynomial in field, rate and direction cosines to be "
            f"averaged in symbols; received {error}"
        ) from error
    first, second, third, nutation = (x / (momentum * rate) for x in means)
    around = second / (length * sympy.sin(rho))
    return Slow(*map(sympy.factor, (third, first / length, around, nutation / length)))


def as_latex(equations: Slow) -> str:
    """The four equations as one LaTeX environment; the prime is d/du."""
    symbols = ("l", r"\rho", r"\sigma", r"\theta")
    rows = [
        f"{left}' &= {sympy.latex(right, fold_func_brackets=True)}"
        for left, right in zip(symbols, equations, strict=True)
    ]
    return "\\begin{aligned}\n" + " \\\\\n".join(rows) + "\n\\end{aligned}"
