"""The models with constant coefficients, derived in symbols from the laws that fly.

Euler's equations of the satellite with its wheel, the reading of the magnetometer and the laws' own
functions, to first order about the orbital attitude in the 'computed field' (cos, b, -sin), are
written in the text's states. That the coefficients come out constant is found, not assumed. Units
as in the package. Needs sympy.
"""

import functools
from types import SimpleNamespace
from typing import NamedTuple

import sympy

from torquer.computer.laws.magneto_gyro import stage_1, stage_2
from torquer.theory.magneto_gyro.frozen import STATES_1, STATES_2
from torquer.theory.magneto_gyro.loop import field_deviation
from torquer.theory.symbolic import on_symbols

#: Symbols of both models: stiffness, moment about the pitch axis over J, field along the normal.
h, pitch_inertia, b = sympy.symbols("h lambda b")
#: Of stage 1: K/[(1 + b^2) J nu0^2], N/[(1 + b^2) J nu0], damping and frequency of the filters.
k, n, xi, omega = sympy.symbols("k n xi omega")
#: Of stage 2: `Stage2Gains`, of angles, of rates, of the estimator, of the compensator.
GAINS = sympy.symbols("d1:4 n1:4 k1:7 e1:4")
#: Torque and error of the magnetometer about t', w, s'.
INPUTS = sympy.symbols("eps_t eps_y eps_s d_t d_y d_s")
_COS, _SIN = sympy.symbols("c s")


class Model(NamedTuple):
    """x' = A x + G u in symbols: names of the states, A `[order, order]`, G `[order, 6]`."""

    states: tuple[str, ...]
    matrix: sympy.ImmutableMatrix
    inputs: sympy.ImmutableMatrix


def _symbolic(function):
    """A kernel's function that takes symbols."""
    return on_symbols(function, SimpleNamespace(root=sympy.sqrt))


def _cross(a, d):
    return sympy.Matrix(a).cross(sympy.Matrix(d))


def _orbital(turned):
    """Components along t, w, s of those along t', w, s'."""
    x, y, z = turned
    return _COS * x + _SIN * z, y, _COS * z - _SIN * x


def _turn(v):
    """Components along t', w, s' of those along t, w, s."""
    x, y, z = v
    return _COS * x - _SIN * z, y, _SIN * x + _COS * z


def _accelerations(angles, rates, torque):
    """Euler's equations with a wheel, solved for the second derivatives of the angles."""
    moments, normal = sympy.diag(1, pitch_inertia, 1), sympy.Matrix([0, 1, 0])
    wheel = (h + 2 - pitch_inertia) * normal
    rates = sympy.Matrix(rates)
    spin = rates + normal - _cross(angles, normal)
    moment = sympy.Matrix(torque) - spin.cross(moments * spin + wheel)
    return moments.inv() * moment + rates.cross(normal)


def _stage_1(angles, rates, slope, second, torque, error):
    """Derivatives of the loop of stage 1; `slope`, `second`: how q and q_1 of W differ from those
    of the computed field, whose derivative the filters are taken to find exactly."""
    field, field_slope, square = (_COS, b, -_SIN), (-_SIN, 0, -_COS), 1 + b**2
    off = _symbolic(field_deviation)(angles, error, field)
    reading = tuple(x + y for x, y in zip(field, off, strict=True))
    reading_slope = tuple(x + y for x, y in zip(field_slope, slope, strict=True))
    u = _symbolic(stage_1.angle_function)(reading, field, square)
    v = _symbolic(stage_1.rate_function)(reading, reading_slope, field, field_slope, square)
    gains = k * square, n * square
    dipole = _symbolic(stage_1.capture_dipole)(reading, u, v, square, *gains)
    total = _cross(dipole, reading) + sympy.Matrix(torque)
    driven = [x + omega**2 * y for x, y in zip(second, off, strict=True)]
    damped = [-(omega**2) * q - 2 * xi * omega * x for q, x in zip(slope, driven, strict=True)]
    return rates, _accelerations(angles, rates, total), driven, damped


def _stage_2(angles, rates, seen, seen_rates, compensation, torque, error):
    """Derivatives of the loop of stage 2."""
    field, guide = (_COS, b, -_SIN), stage_2.Guide(_COS, _SIN, 1, 1)
    gains, craft = stage_2.Stage2Gains(*GAINS), stage_2.Gyrostat(h, pitch_inertia)
    off = _symbolic(field_deviation)(angles, error, field)
    reading = tuple(x + y for x, y in zip(field, off, strict=True))
    dipole = _symbolic(stage_2.control_dipole)(seen, seen_rates, gains, guide)
    control = _cross(dipole, field)
    total = control + _cross(compensation, field) + sympy.Matrix(torque)
    theta, chi = _symbolic(stage_2.seen_angles)(reading, field, guide)
    d_theta, d_chi = theta - seen[1], chi - _turn(seen)[2]
    of_angles, of_rates = _symbolic(stage_2.corrections)(d_theta, d_chi, gains, guide, craft)
    model = _symbolic(stage_2.model_accelerations)(seen, seen_rates, tuple(control), craft)
    return (
        rates,
        _accelerations(angles, rates, total),
        [x + y for x, y in zip(seen_rates, of_angles, strict=True)],
        [x + y for x, y in zip(model, of_rates, strict=True)],
        _symbolic(stage_2.compensation_rate)(d_theta, d_chi, gains, guide),
    )


def _linear_part(expressions, variables) -> sympy.Matrix:
    """Derivatives `[expressions, variables]` where all variables are zero.

    All but one are set to zero before each derivative is taken: what is left is short.
    """
    whole, zero = [*map(sympy.sympify, expressions)], dict.fromkeys(variables, sympy.Integer(0))
    columns = []
    for each in variables:
        others = {name: value for name, value in zero.items() if name != each}
        columns.append([x.xreplace(others).diff(each).xreplace(zero) for x in whole])
    return sympy.Matrix(columns).T


def _constant(expression):
    """An entry, in which cosine and sine must cancel."""
    exact = sympy.nsimplify(sympy.expand(expression))  # kernels have floating-point signs
    found = sympy.factor(sympy.rem(exact, _COS**2 + _SIN**2 - 1, _SIN))
    if found.has(_COS, _SIN):
        raise ArithmeticError(f"model: entries must be constant; received {found}")
    return found


def _model(rates, triples: int, states, to_states) -> Model:
    """The loop in axes that turn with the field, then in the text's states.

    `to_states` maps the triples along t', w, s' to the text's states.
    """
    turned = sympy.symbols(f"y0:{3 * triples}")
    split = [turned[i : i + 3] for i in range(0, len(turned), 3)]
    given = [_orbital(each) for each in (*split, INPUTS[:3], INPUTS[3:])]
    slopes = [x for each in rates(*given) for x in _turn(each)]
    both = _linear_part(slopes, (*turned, *INPUTS)).applyfunc(_constant)
    matrix, inputs = both[:, : len(turned)], both[:, len(turned) :]
    for i in range(0, len(turned), 3):  # the axes turn: (t', s')' = (-s', t')
        matrix[i, i + 2] -= 1
        matrix[i + 2, i] += 1
    whole = to_states * matrix * to_states.inv()
    whole = whole.applyfunc(sympy.factor)
    return Model(states, whole.as_immutable(), (to_states * inputs).as_immutable())


def _to_states(states, of_triples: dict[str, list[tuple[int, int]]]) -> sympy.Matrix:
    """Rows by the names of states: (place, factor) pairs of the triples' numbers."""
    size = len(states)
    rows = sympy.zeros(size, size)
    for i, name in enumerate(states):
        for place, factor in of_triples[name]:
            rows[i, place] = factor
    return rows


_MOTION = {
    "phi": [(0, 1)], "theta": [(1, 1)], "chi": [(2, 1)],
    "phi'": [(3, 1), (2, -1)], "theta'": [(4, 1)], "chi'": [(5, 1), (0, 1)],
}  # fmt: skip


@functools.cache
def order_12() -> Model:
    """Stage 1."""
    places = dict(zip(("Z", "Y", "X", "Z1", "Y1", "X1"), range(6, 12), strict=True))
    filters = {name: [(place, 1)] for name, place in places.items()}
    return _model(_stage_1, 4, STATES_1, _to_states(STATES_1, {**_MOTION, **filters}))


@functools.cache
def order_15() -> Model:
    """Stage 2: X_i, Y_i, Z_i for i = 1, 2 are estimates less true values."""
    seen = {
        "X1": [(6, 1), (0, -1)], "Y1": [(7, 1), (1, -1)], "Z1": [(8, 1), (2, -1)],
        "X2": [(9, 1), (8, -1), (3, -1), (2, 1)], "Y2": [(10, 1), (4, -1)],
        "Z2": [(11, 1), (6, 1), (5, -1), (0, -1)],
        "Y3": [(12, 1)], "Z3": [(13, -1)], "Y4": [(14, 1)],
    }  # fmt: skip
    return _model(_stage_2, 5, STATES_2, _to_states(STATES_2, {**_MOTION, **seen}))
