"""Limits of parameters are those of the keys that they stand for."""

import math
from pathlib import Path
from typing import ClassVar, Literal, NamedTuple

import pytest
from pydantic import Field, ValidationError

import torquer
from torquer.computer.blocks.law import Law
from torquer.computer.blocks.limits import FREE, Limits
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


def test_a_law_of_ones_own_and_a_changed_one_have_none():
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
    except ValidationError as error:
        return any(each["loc"][:1] == (key,) for each in error.errors())
    return False
