"""Models of the magneto-gyroscopic system in symbols: rows of the text, polynomials, astatism."""

import numpy as np
import pytest

from torquer.computer.laws.magneto_gyro.stage_2 import Stage2Gains
from torquer.theory.magneto_gyro.frozen import (
    frozen_1,
    frozen_1_inputs,
    frozen_2,
    frozen_2_inputs,
)

sympy = pytest.importorskip("sympy")
from torquer.theory.magneto_gyro import astatism, derivation as derived, text  # noqa: E402

NUMBERS = {derived.h: 6.46, derived.pitch_inertia: 0.595, derived.b: 0.37}
CRAFT = {"stiffness": 6.46, "pitch_inertia": 0.595, "b": 0.37}
STAGE_1 = {derived.k: 1.7, derived.n: 2.3, derived.xi: 0.6, derived.omega: 3.1}
GAINS = np.random.default_rng(2).normal(size=15).tolist()
STAGE_2 = dict(zip(derived.GAINS, GAINS, strict=True))


@pytest.fixture(scope="module")
def models():
    """Both models, by their order."""
    return {12: derived.order_12(), 15: derived.order_15()}


def in_numbers(matrix, values):
    return np.array(matrix.subs({**NUMBERS, **values}), dtype=float)


def test_derived_model_of_order_12_matches_the_numeric_one(models):
    found, gains = models[12], tuple(STAGE_1.values())
    want = frozen_1(*gains, **CRAFT)
    assert in_numbers(found.matrix, STAGE_1) == pytest.approx(want, abs=1e-12)
    want = frozen_1_inputs(*gains, pitch_inertia=0.595, b=0.37)
    assert in_numbers(found.inputs, STAGE_1) == pytest.approx(want, abs=1e-12)


def test_derived_model_of_order_15_matches_the_numeric_one(models):
    assert tuple(map(str, derived.GAINS)) == Stage2Gains._fields
    found = models[15]
    want = frozen_2(Stage2Gains(*GAINS), **CRAFT)
    assert in_numbers(found.matrix, STAGE_2) == pytest.approx(want, abs=1e-12)
    assert want.size == 225
    want = frozen_2_inputs(Stage2Gains(*GAINS), pitch_inertia=0.595)
    assert in_numbers(found.inputs, STAGE_2) == pytest.approx(want, abs=1e-12)


@pytest.mark.parametrize("order", [12, 15])
def test_law_yields_every_printed_row_given_corrected_definitions(order):
    rows = text.compare_rows(order)
    assert [row.printed for row in rows if row.difference != 0] == []
    for number in range(2):  # as printed, each definition spoils a row at least
        assert any(number in row.corrections for row in rows)


def test_the_definitions_falsify_the_rows_that_have_their_symbols():
    corrections = [[i for i, row in enumerate(text.compare_rows(order))
               if number in row.corrections]
              for order in (12, 15) for number in (0, 1)]  # fmt: skip
    assert corrections[:2] == [[0, 1, 4], [0, 1, 4]]  # k and n: both channels, not the filters
    assert corrections[2] == [3, 5, 9]  # k5, k3, k1
    assert corrections[3] == [0, 7, 8, 9, 10, 11]  # wherever the estimate of pitch stands


@pytest.mark.parametrize(
    ("order", "printed", "wrong"),
    [(12, "- n Y + n b Z", "- n Y - n b Z"), (15, "+ k6 Z1", "- k6 Z1"), (12, "R8", "R9")],
)
def test_a_wrong_sign_or_input_is_noticed(monkeypatch, order, printed, wrong):
    given = text.TEXTS[order]
    changed = tuple(each.replace(printed, wrong) for each in given.equations)
    monkeypatch.setitem(text.TEXTS, order, given._replace(equations=changed))
    noticed = [row.printed for row in text.compare_rows(order) if row.difference != 0]
    assert noticed == [each for each in changed if each not in given.equations] != []


@pytest.mark.parametrize(("order", "values"), [(12, STAGE_1), (15, STAGE_2)])
def test_the_factors_are_those_of_the_characteristic_polynomial(models, order, values):
    at = {**NUMBERS, **values, derived.b: 0.0}
    product = np.ones(1)
    for names, part in astatism.characteristic_factors(models[order]):
        numbers = [float(x) for x in part.as_expr().subs(at).as_poly(astatism.s).all_coeffs()]
        assert len(numbers) == len(names) + 1
        product = np.polymul(product, numbers)
    want = np.poly(np.array(models[order].matrix.subs(at), dtype=float)).real
    assert product == pytest.approx(want, rel=1e-9)


def test_stage_1_needs_a_positive_h_by_its_last_coefficient(models):
    """2 h omega^2 (2 h + k): negative just below h = 0."""
    _, axis = astatism.characteristic_factors(models[12])[0]
    h, k, omega = derived.h, derived.k, derived.omega
    assert sympy.expand(axis.eval(0) - 2 * h * omega**2 * (2 * h + k)) == 0


def test_pitch_axis_separates_in_turning_axes_at_h_of_2(models):
    """One of phi and chi is neither driven by the other nor by the coils, nor seen."""
    model = models[15]
    at = model.states.index
    row = model.matrix[at("phi'"), :].subs({derived.b: 0, derived.h: 2})
    assert [name for name, x in zip(model.states, row, strict=True) if x != 0] == ["phi"]


def test_a_constant_dipole_moves_the_compensator_alone(models):
    """With any gains and any b: the transfer functions of the angles have zeros there."""
    for torque, at in ((astatism.ALONG_PITCH, 0), (astatism.ACROSS_PITCH, sympy.I)):
        state = astatism.answer(models[15], torque, at)
        moved = {name for name, x in zip(models[15].states, state, strict=True) if x != 0}
        assert moved and moved <= set(astatism.COMPENSATOR)
        driven = models[15].inputs[:, :3] * sympy.Matrix(torque)
        left = at * state - models[15].matrix * state - driven
        assert left.applyfunc(sympy.expand) == sympy.zeros(15, 1)


def test_a_constant_torque_about_t_moves_more(models):
    """No dipole makes a torque about t' for b = 0: it is not compensated."""
    with pytest.raises(ArithmeticError, match="must move the compensator alone"):
        astatism.answer(models[15], (1, 0, 0), 0)


def test_transfer_function_to_pitch_vanishes_at_orbital_rate(models):
    above = astatism.numerator(models[15], "theta", astatism.ACROSS_PITCH)
    s = astatism.s
    assert sympy.rem(above, s**2 + 1, s) == 0
    assert sympy.expand(above.subs(s, 0)) != 0
