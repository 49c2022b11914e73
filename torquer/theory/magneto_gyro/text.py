"""The text's linear models as printed, row by row, against those derived from its laws.

The rows are MGS's, in its letters; a prime is d/dtau. Where a definition of the text does not lead
to its rows, the corrected one is used, and the rows that do not follow from the printed one are
named. Needs sympy.
"""

import re
from typing import NamedTuple

import sympy
from sympy.parsing.sympy_parser import (
    convert_xor,
    implicit_multiplication,
    parse_expr,
    standard_transformations,
)

from torquer.theory.magneto_gyro.derivation import INPUTS, Model, order_12, order_15, pitch_inertia

_RULES = (*standard_transformations, convert_xor, implicit_multiplication)


class Definition(NamedTuple):
    """A definition of the text that its rows contradict: as printed, corrected, and what stands for
    its symbols, by name, in rows that are written with the printed one."""

    printed: str
    corrected: str
    instead: dict[str, str]


class Text(NamedTuple):
    """A model of the text: equations, the inputs that they abbreviate, definitions to correct."""

    equations: tuple[str, ...]
    inputs: dict[str, str]
    definitions: tuple[Definition, ...]


class Row(NamedTuple):
    """An equation of the text, the one that follows from the law, and text less law: 0 if the same.

    `corrections`: indices of the definitions with which, as printed, it would not follow.
    """

    printed: str
    derived: str
    difference: sympy.Expr
    corrections: tuple[int, ...]


STAGE_1 = Text(
    (
        "phi'' + (2 h + k b^2) phi - (h - 2) chi' = eps_t + k b theta + n b X + R1",
        "(h - 2) phi' + chi'' + [2 h + k (1 + b^2)] chi - n Y + n b Z = eps_s + R2",
        "omega^2 chi + Y' - Y1 = R3",
        "-2 xi omega^3 chi + Y1' + omega^2 Y + 2 xi omega Y1 = R4",
        "lambda theta'' + k theta + n X = eps_y + k b phi + R5",
        "-omega^2 theta + X' - X1 - Z = -omega^2 b phi + R6",
        "2 xi omega^3 theta + omega^2 X + X1' + 2 xi omega X1 - Z1 = 2 xi omega^3 b phi + R7",
        "X + Z' - Z1 = omega^2 b chi + R8",
        "X1 + omega^2 Z + Z1' + 2 xi omega Z1 = -2 xi omega^3 b chi + R9",
    ),
    {
        "R1": "k b d_s - n b (d_t + b d_y)/(1 + b^2)",
        "R2": "k (d_y - b d_t)",
        "R3": "omega^2 d_y",
        "R4": "-2 xi omega^3 d_y",
        "R5": "-k d_s + n (d_t + b d_y)/(1 + b^2)",
        "R6": "omega^2 d_s",
        "R7": "-2 xi omega^3 d_s",
        "R8": "omega^2 d_t",
        "R9": "-2 xi omega^3 d_t",
    },
    (
        Definition("k = K/(J nu0^2)", "k = K/[(1 + b^2) J nu0^2]", {"k": "k (1 + b^2)"}),
        Definition("n = N/(J nu0)", "n = N/[(1 + b^2) J nu0]", {"n": "n (1 + b^2)"}),
    ),
)
STAGE_2 = Text(
    (
        "phi'' + 2 h phi - (h - 2) chi' "
        "= eps_t + b n2 theta' + b d2 theta + b n2 Y2 + b d2 Y1 - b Y4",
        "(h - 2 + n1) phi' + d1 phi + chi'' + n3 chi' + (2 h + d3) chi + n1 X2 + d1 X1 + n3 Z2 "
        "+ d3 Z1 - Z3 = eps_s + b Y3",
        "X2' + 2 h X1 - (h - 2) Z2 + k6 Z1 = -eps_t + b Y4 - k6 d_y",
        "-X2 + X1' + k5 Z1 = -k5 d_y",
        "(h - 2) X2 + Z2' + (2 h + k4) Z1 + Z3 = -eps_s - b Y3 - k4 d_y",
        "-Z2 + Z1' + k3 Z1 = -k3 d_y",
        "-e3 Z1 + Z3' = e3 d_y",
        "lambda theta'' + n2 theta' + d2 theta + n2 Y2 + d2 Y1 - Y4 = eps_y",
        "lambda Y2' + k2 Y1 + Y4 = -eps_y + k2 d_s - b k2 phi",
        "-Y2 + Y1' + k1 Y1 = k1 d_s - b k1 phi",
        "-e1 Y1 + Y3' + Y4 = -e1 d_s + b e1 phi",
        "-e2 Y1 - Y3 + Y4' = -e2 d_s + b e2 phi",
    ),
    {},
    (
        Definition(
            "k_i = K_i/(J nu0), i = 1, 3, 5", "k_i = K_i/nu0",
            {name: f"{name}/J" for name in ("k1", "k3", "k5")},
        ),
        Definition(
            "Y1 = (estimate of theta) + theta", "Y1 = (estimate of theta) - theta",
            {"Y1": "Y1 + 2 theta", "Y1'": "Y1' + 2 theta'"},
        ),
    ),
)  # fmt: skip
TEXTS = {12: STAGE_1, 15: STAGE_2}


def derive_model(order: int) -> Model:
    """The model of an order, derived."""
    return order_12() if order == 12 else order_15()


def compare_rows(order: int) -> list[Row]:
    """The text's equations, and R1 to R9 of order 12, against the derived model of that order."""
    text, model = TEXTS[order], derive_model(order)
    inputs = {sympy.Symbol(name): _parse(value) for name, value in text.inputs.items()}
    rows = []
    for equation in text.equations:
        left, right = map(_parse, equation.split(" = "))
        residual = left - right
        rows.append(
            Row(
                equation,
                _derive(equation, model),
                _difference(residual, inputs, model),
                tuple(
                    i
                    for i, each in enumerate(text.definitions)
                    if _difference(_with(each, residual, inputs), inputs, model) != 0
                ),
            )
        )
    return rows


def _with(definition: Definition, residual, inputs):
    """A row written with the printed definition, in the corrected one's symbols."""
    instead = {sympy.Symbol(name): _parse(value) for name, value in definition.instead.items()}
    return residual.subs(inputs).subs(instead, simultaneous=True)


def _difference(residual, inputs, model: Model):
    """Left less right side of a row, with the derivatives of the model."""
    states = sympy.Matrix([sympy.Symbol(name) for name in model.states])
    slopes = model.matrix * states + model.inputs * sympy.Matrix(INPUTS)
    derivatives = {
        sympy.Symbol(name + "'"): slope
        for name, slope in zip(model.states, slopes, strict=True)
        if name + "'" not in model.states
    }
    return sympy.factor(sympy.cancel(sympy.expand(residual.subs(inputs).subs(derivatives))))


def _derive(equation: str, model: Model) -> str:
    """The derived equation for the highest derivative of a row of the text."""
    left = equation.split(" = ")[0]
    named = [name for name in model.states if name + "'" not in model.states]
    (name,) = [x for x in named if re.search(rf"(?<![\w']){re.escape(x)}'(?!')", left)]
    i = model.states.index(name)
    times = pitch_inertia if name in ("theta'", "Y2") else sympy.Integer(1)
    terms = [
        (sympy.factor(times * factor), of)
        for factor, of in (
            *zip(model.matrix[i, :], model.states, strict=True),
            *zip(model.inputs[i, :], map(str, INPUTS), strict=True),
        )
        if factor != 0
    ]
    before = "" if times == 1 else "lambda "
    return f"{before}{name}' = {in_words(terms)}"


def in_words(terms) -> str:
    """A sum of (factor, name) as the text writes it."""
    found = ""
    for factor, name in terms:
        minus = sympy.sympify(factor).could_extract_minus_sign()
        size = formula(-factor if minus else factor, product=True)
        sign = (" - " if minus else " + ") if found else ("-" if minus else "")
        found += f"{sign}{'' if size == '1' else size + ' '}{name}"
    return found


def formula(expression, product: bool = False) -> str:
    """An expression in the text's way: products by spaces; a sum in brackets as a factor."""
    shown = str(sympy.factor(expression)).replace("**", "^")
    shown = re.sub(r"(?<=[\w)])\*(?=[\w(])", " ", shown)
    bare = re.sub(r"\([^()]*\)", "", shown)
    return f"({shown})" if product and re.search(r" [+-] ", bare) else shown


def _parse(text: str):
    """A side of an equation as an expression in symbols named as in it."""
    names = dict.fromkeys(re.findall(r"[A-Za-z]\w*'*", text))
    places = {name: f"v{i}" for i, name in enumerate(names)}
    plain = re.sub(r"[A-Za-z]\w*'*", lambda found: places[found[0]], text)
    plain = plain.replace("[", "(").replace("]", ")")
    symbols = {place: sympy.Symbol(name) for name, place in places.items()}
    return parse_expr(plain, local_dict=symbols, transformations=_RULES)
