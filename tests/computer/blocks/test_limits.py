"""Limits of parameters are those of the keys that they stand for."""

import math
from pathlib import Path
from typing import ClassVar, Literal, NamedTuple, get_type_hints

import pytest
from law_examples import EXAMPLES as EXAMPLES_OF_LAWS, of_scenario
from pydantic import Field

import torquer
from torquer.computer.blocks.adapter import flat
from torquer.computer.blocks.law import Law
from torquer.computer.blocks.limits import FREE, Limits
from torquer.computer.blocks.parameters import AnyNumber, OnOff, UnitNumbers
from torquer.computer.laws import BUILT_IN
from torquer.computer.laws.bdot import Bdot, bdot_difference
from torquer.computer.laws.law_spec import LawSpec
from torquer.simulation.setup.prepare import make_blocks

EXAMPLES = Path(__file__).parents[3] / "examples"
NAMES = ("chibis_m_flight", "magneto_gyro", "safe_mode", "spinner_modes", "residual_dipole")


class Numbers(NamedTuple):
    """Those of `Law`, in the order of its keys."""

    turned: float
    back: float
    of_two: float
    square: float
    absent: float
    pair: tuple
    shape: float


class Declared(NamedTuple):
    """Those of `Law` that say themselves what they may be."""

    turned: float
    on: OnOff
    axis: UnitNumbers
    free: AnyNumber
    inner: tuple


class Inner(NamedTuple):
    """A record in the record."""

    on: OnOff


class Example(LawSpec):
    """A law whose parameters stand for its keys in many ways."""

    kind: Literal["example"] = "example"
    kernel: ClassVar = bdot_difference
    turned_deg: float = Field(default=90.0, gt=0.0, lt=180.0)
    back_s: float = Field(default=2.0, gt=1.0, le=8.0)
    first: float = Field(default=0.5, ge=0.0)
    second: float = Field(default=3.0, ge=0.0)
    size: float = Field(default=3.0, gt=0.0)
    rate_deg_s: float | None = Field(default=None, gt=0.0)
    pair: tuple[float, float] = (1.0, 0.0)

    def parameters(self) -> Numbers:
        return Numbers(
            math.radians(self.turned_deg), -4.0 * self.back_s, self.first * self.second,
            self.size**2, self.rate_deg_s or 0.0, self.pair, 7.0,
        )  # fmt: skip


def test_a_limit_goes_with_the_unit_of_its_number():
    turned, back, *others = Example().law().limits
    assert turned == Limits(0.0, math.pi, 1, 1)
    assert back == Limits(-32.0, -4.0, 0, 1)
    assert others == [FREE] * 6


@pytest.mark.parametrize("value", [0.5, 90.0, 179.5])
def test_limits_do_not_depend_on_the_value(value):
    assert Example(turned_deg=value).law().limits[0] == Limits(0.0, math.pi, 1, 1)


def test_a_key_that_is_given_limits_its_number():
    assert Example(rate_deg_s=2.0).law().limits[4] == Limits(1e-15, 1e6)


def test_a_number_that_is_no_keys_has_the_limits_of_its_field():
    given = Declared(90.0, 1.0, (0.0, 0.0, 1.0), 7.0, Inner(0.0))
    limits = Law("declared", bdot_difference, given).limits
    assert limits == (FREE, Limits(0, 1), *[Limits(-1, 1)] * 3, FREE, Limits(0, 1))
    beyond = given._replace(on=2.0, axis=(0.0, 0.0, -1.5))
    limits = Law("declared", bdot_difference, beyond).limits
    assert limits[1:5] == (Limits(0, 2), Limits(-1, 1), Limits(-1, 1), Limits(-1.5, 1))


def a_law(**options):
    """A law of one's own."""

    @torquer.law(parameters={"gain": 1.0, "axis": (0.0, 0.0, 1.0)}, compiled=False, **options)
    def own(inputs, parameters, memory):
        return (0.0, 0.0, 0.0)

    return own


def test_a_law_of_ones_own_declares_limits():
    law = a_law(limits={"axis": (-1.0, 1.0), "gain": (0, math.inf)})
    assert law.limits == (Limits(0.0), *[Limits(-1.0, 1.0)] * 3)
    assert law.with_parameters(gain=0.0).limits == law.limits
    for name, value in (("gain", -1e-300), ("axis", (0.0, 2.0, 0.0))):
        must = f"law own: parameter {name} must be at least"
        with pytest.raises(ValueError, match=must):
            law.with_parameters(**{name: value})


def test_so_does_an_estimator():
    @torquer.estimator(parameters={"share": 0.5}, limits={"share": (0.0, 1.0)}, compiled=False)
    def own(inputs, parameters, memory):
        return torquer.Estimate(0.0, (0, 0, 0, 1), (0, 0, 0), (0, 0, 0), 0.0, 0.0)

    assert own.limits == (Limits(0.0, 1.0),)
    with pytest.raises(ValueError, match=r"estimator own: parameter share must be .* at most 1"):
        own.with_parameters(share=1.5)


@pytest.mark.parametrize(
    ("limits", "must"),
    [
        ({"other": (0, 1)}, "limits must be of one of: gain, axis; received 'other'"),
        ({"gain": 3.0}, "limits of gain must be two numbers"),
        ({"gain": (2.0, 0.0)}, "limits of gain must be two numbers"),
        ({"gain": (math.nan, 0.0)}, "limits of gain must be two numbers"),
        ({"gain": (0.0, "x")}, "limits of gain must be two numbers"),
        ({"gain": (2.0, 3.0)}, "parameter gain must be at least 2, at most 3; received 1"),
    ],
)
def test_limits_that_are_none_are_refused(limits, must):
    with pytest.raises(ValueError, match=f"law own: {must}"):
        a_law(limits=limits)


@pytest.mark.parametrize("kind", sorted(set(EXAMPLES_OF_LAWS) - {"off", "user"}))
def test_each_number_of_a_law_of_the_package_has_limits_or_says_that_it_needs_none(kind):
    law = BUILT_IN[kind](kind=kind, **EXAMPLES_OF_LAWS[kind]).law().filled(of_scenario)
    assert law.values() and not undeclared(law)


@pytest.mark.parametrize("name", ["chibis_m_flight", "safe_mode", "which_sensors"])
def test_so_has_each_of_an_estimator(name):
    blocks = make_blocks(torquer.load_scenario(EXAMPLES / f"{name}.toml")).estimators.values()
    assert any(each.values() for each in blocks)
    assert not [number for each in blocks for number in undeclared(each)]


def undeclared(block) -> list[tuple[str, Limits]]:
    """Numbers set in flight that any value may be given to, and no type of a field says so."""
    first = block.pack().tolist()
    assert all(map(Limits.hold, block.limits, first))
    numbers = zip(of_fields(block.parameters), block.limits, strict=True)
    fixed = {k for name in block.fixed for k in range(*span(*block.places()[name]))}
    return [
        (name, limits)
        for k, ((name, is_declared), limits) in enumerate(numbers)
        if limits == FREE and not is_declared and k not in fixed
    ]


def span(first: int, count: int) -> tuple[int, int]:
    """First place and the one after the last."""
    return first, first + count


def of_fields(record: tuple) -> list[tuple[str, bool]]:
    """Name of the field of each number, and whether its type declares limits."""
    found, hints = [], get_type_hints(type(record), include_extras=True)
    for name, value in zip(record._fields, record, strict=True):
        if hasattr(value, "_fields"):
            found += of_fields(value)
        else:
            found += [(name, hasattr(hints[name], "__metadata__"))] * len(flat(value))
    return found


def test_a_law_that_declares_none_and_a_changed_one_have_none():
    assert Law("own", bdot_difference, {"gain": 1.0}).limits == (FREE,)
    law = Bdot(gain_a_m2_s_per_t=1e5).law()
    assert law.limits != (FREE,) and law.with_parameters(gain=-1.0).limits == (FREE,)


@pytest.mark.parametrize(
    ("limits", "inside", "outside", "words"),
    [
        (Limits(0.0, 2.0), (0.0, 2.0), (-5e-324, 2.1, math.nan), "at least 0, at most 2"),
        (Limits(0.0, 2.0, 1, 1), (5e-324, 1.9), (0.0, 2.0), "above 0, below 2"),
        (FREE, (-1e308, 1e308), (math.nan,), ""),
    ],
)
def test_what_is_within_limits(limits, inside, outside, words):
    assert all(map(limits.hold, inside)) and not any(map(limits.hold, outside))
    assert str(limits) == words


@pytest.mark.parametrize("name", NAMES)
def test_a_scenario_may_have_what_may_be_set(name):
    """Keys whose number is the same in SI: at a limit the law validates, beside it it does not."""
    scenario, tried = torquer.load_scenario(EXAMPLES / f"{name}.toml"), 0
    for block in make_blocks(scenario).laws.values():
        first = block.pack().tolist()
        assert all(limits.hold(value) for limits, value in zip(block.limits, first, strict=True))
        for key, value in block.spec if block.spec else ():
            is_one = isinstance(value, float) and value != 0.0 and first.count(value) == 1
            limits = block.limits[first.index(value)] if is_one else FREE
            if math.isinf(limits.least):
                continue
            sides = (
                (limits.least, math.inf, limits.above),
                (limits.greatest, -math.inf, limits.below),
            )
            for limit, inwards, is_barred in sides:
                inside = math.nextafter(limit, inwards) if is_barred else limit
                outside = limit if is_barred else math.nextafter(limit, limit - inwards)
                assert not is_refused(block.spec, key, inside), (block.name, key, inside)
                assert is_refused(block.spec, key, outside), (block.name, key, outside)
                tried += 1
    assert tried > 1


def is_refused(spec, key: str, value: float) -> bool:
    """Whether a spec refuses a key by itself."""
    try:
        spec.model_copy(update={key: value})
    except torquer.ScenarioError as error:
        return any(line.startswith((f"{key}:", f"{key}[")) for line in str(error).split("\n"))
    return False
