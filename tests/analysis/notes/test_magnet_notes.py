"""What `torquer validate` tells of hysteresis rods and permanent magnets."""

import math

import pytest

from torquer.analysis.notes.magnet_notes import demagnetising_factor, magnet_notes
from torquer.analysis.notes.notes import write_notes

#: A rod of CSSWE, the published one.
ROD = {
    "axis": [0, 1, 0],
    "length_m": 0.095,
    "diameter_m": 0.001,
    "coercive_a_m": 12.0,
    "remanence_t": 0.004,
    "saturation_t": 0.025,
}
LONG = {"spacecraft.permanent_magnet_a_m2": [0.29, 0.0, 0.0]}


def with_rod(make, more, **keys):
    return make(more | {"spacecraft.hysteresis_rods": [ROD | keys]})


def test_a_published_rod_and_a_known_volume_need_no_note(make):
    assert magnet_notes(with_rod(make, LONG)) == [] == magnet_notes(make())
    volume = {key: ROD[key] for key in ROD if key not in ("length_m", "diameter_m")}
    flown = make({"spacecraft.hysteresis_rods": [volume | {"volume_m3": 7.5e-8}]})
    assert magnet_notes(flown) == []


@pytest.mark.parametrize(
    ("keys", "expected"),
    (
        ({"length_m": 95.0}, ".length_m of 95 is longer than any: is it in metres?"),
        ({"diameter_m": 1.0}, ".diameter_m of 1 is not below length_m of 0.095: is this a rod"),
        ({"diameter_m": 0.095}, ".diameter_m of 0.095 is not below length_m of 0.095"),
        ({"remanence_t": 0.35, "saturation_t": 0.74},
         " has a loop 14 times as steep as the poles of a rod of this length and thickness"),
        ({"axis": [2, 0.5, 0]}, " lies along permanent_magnet_a_m2, which would saturate it"),
        ({"axis": [-1, 0, 0]}, " lies along permanent_magnet_a_m2, which would saturate it"),
    ),
)  # fmt: skip
def test_slips_are_told_by_key(make, keys, expected):
    flown = with_rod(make, LONG, **keys)
    (found,) = magnet_notes(flown)
    assert found.startswith(f"spacecraft.hysteresis_rods[0]{expected}")
    assert found in write_notes(flown)


def test_a_rod_lies_along_no_magnet_that_is_not_there(make):
    assert magnet_notes(with_rod(make, {}, axis=[1, 0, 0])) == []


def test_the_demagnetising_factor_is_that_of_an_ellipsoid():
    """A sphere has 1/3; J. A. Osborn's table (1945) has 0.02029 for 10, 0.000430 for 100."""
    assert demagnetising_factor(1.0001) == pytest.approx(1.0 / 3.0, abs=1e-4)
    assert demagnetising_factor(10.0) == pytest.approx(0.02029, abs=1e-5)
    assert demagnetising_factor(100.0) == pytest.approx(0.000430, abs=1e-6)
    assert demagnetising_factor(1e4) == pytest.approx((math.log(2e4) - 1.0) / 1e8, rel=1e-6)
