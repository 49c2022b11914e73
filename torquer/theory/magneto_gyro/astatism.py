"""Why a constant dipole of the satellite leaves no error: zeros of the text's model of stage 2.

A dipole fixed in the body, along pitch and across it, makes in the turning axes a constant torque
and one that oscillates with nu0. At s = 0 and at s = +-i the model answers with its compensator
alone: the transfer functions of all angles have a zero there. Needs sympy.
"""

import sympy
from sympy.polys.matrices import DomainMatrix

from torquer.theory.magneto_gyro.derivation import Model, b
from torquer.theory.magneto_gyro.frozen import COMPENSATOR

s = sympy.Symbol("s")
#: Torques about t', w, s' of a unit dipole: along pitch, at s = 0; across it, turning, at s = i.
ALONG_PITCH = (sympy.Integer(0), sympy.Integer(0), sympy.Integer(-1))
ACROSS_PITCH = (-b, sympy.Integer(1), sympy.I * b)


def answer(model: Model, torque, at) -> sympy.Matrix:
    """State `[15]` with which the model answers a torque times exp(at tau), by its compensator
    alone; ArithmeticError if other states must move, too."""
    size = len(model.states)
    places = [model.states.index(name) for name in COMPENSATOR]
    unknown = sympy.symbols("z0:3")
    state = sympy.zeros(size, 1)
    for place, each in zip(places, unknown, strict=True):
        state[place] = each
    pushed = model.inputs[:, :3] * sympy.Matrix(torque)
    found = sympy.solve(list((at * sympy.eye(size) - model.matrix) * state - pushed), unknown)
    if not found:
        raise ArithmeticError("model: a constant dipole must move the compensator alone")
    return state.subs(found)


def numerator(model: Model, output: str, torque) -> sympy.Expr:
    """Numerator of the transfer function from a torque to a state for b = 0."""
    matrix, pushed = (
        model.matrix.subs(b, 0),
        (model.inputs[:, :3] * sympy.Matrix(torque)).subs(b, 0),
    )
    at = model.states.index(output)
    places = next(x for x in matrix.connected_components() if at in x)
    part = (s * sympy.eye(len(places)) - matrix.extract(places, places)).as_mutable()
    part[:, places.index(at)] = pushed.extract(places, [0])
    of_polynomials = DomainMatrix.from_Matrix(part)
    return of_polynomials.domain.to_sympy(of_polynomials.det())


def characteristic_factors(model: Model) -> list[tuple[tuple[str, ...], sympy.Poly]]:
    """(States, characteristic polynomial in s) of the parts of a model for b = 0, whose product is
    that of the model."""
    matrix, found = model.matrix.subs(b, 0), []
    for places in matrix.strongly_connected_components():
        names = tuple(sorted((model.states[i] for i in places), key=model.states.index))
        found.append((names, matrix.extract(places, places).charpoly(s)))
    return sorted(found, key=lambda part: model.states.index(part[0][0]))
