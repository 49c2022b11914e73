"""The models in symbols as text, by sympy: rows, polynomials, why a dipole leaves no error."""

import sympy

from torquer.theory.magneto_gyro import astatism
from torquer.theory.magneto_gyro.text import (
    TEXTS,
    Row,
    compare_rows,
    derive_model,
    formula,
    in_words,
)


def model_data(order: int) -> dict:
    """The model of an order: rows of text and law, definitions, factors, constant dipole."""
    text, model = TEXTS[order], derive_model(order)
    found = {
        "rows": [_row(row) for row in compare_rows(order)],
        "inputs": text.inputs,
        "definitions": [{"text": x.printed, "law": x.corrected} for x in text.definitions],
        "factors": [
            {"states": list(names), "polynomial": polynomial(part)}
            for names, part in astatism.characteristic_factors(model)
        ],
    }
    if order == 15:
        found["constant_dipole"] = _constant_dipole(model)
    return found


def _row(row: Row) -> dict:
    return {
        "text": row.printed,
        "law": row.derived,
        "difference": formula(row.difference),
        "corrected": [i + 1 for i in row.corrections],
    }


def polynomial(part: sympy.Poly) -> str:
    """A polynomial in s from its highest power on."""
    terms = []
    for (power,), factor in part.terms():
        name = {0: "", 1: "s"}.get(power, f"s^{power}")
        terms.append((factor, name) if name else (factor, "1"))
    return in_words(terms).removesuffix(" 1")


def _constant_dipole(model) -> list[str]:
    """Why it leaves no error, in lines."""
    lines = ["a dipole fixed in the body: the model answers by its compensator alone"]
    for words, torque, at in (
        ("along pitch, a constant torque", astatism.ALONG_PITCH, sympy.Integer(0)),
        ("across pitch, a torque that turns with nu0", astatism.ACROSS_PITCH, sympy.I),
    ):
        state = astatism.answer(model, torque, at)
        moved = (
            f"{name} = {formula(state[model.states.index(name)]).replace('I', 'i')}"
            for name in astatism.COMPENSATOR
        )
        lines.append(f"  {words}: {', '.join(moved)}; all else 0, for any gains and b")
    for output, torque in (("chi", astatism.ALONG_PITCH), ("theta", astatism.ACROSS_PITCH)):
        above = astatism.numerator(model, output, torque)
        zeros = [words for words, at in (("0", 0), ("+-i", sympy.I))
                 if sympy.expand(above.subs(astatism.s, at)) == 0]  # fmt: skip
        lines.append(f"  for b = 0 the transfer function to {output} has zeros at {zeros[0]}")
    return lines
