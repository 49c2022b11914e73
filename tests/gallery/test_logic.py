"""The driver of mode tables: thresholds, times, ways, and what is known."""

import math

import pytest

from gallery.logic import Logic, cause_of, draw_table, turning_point, ways
from torquer.computer.modes.graph import find_edges
from torquer.computer.modes.spec import Modes

MODES = Modes.model_validate({
    "axis": [0, 0, 1],
    "attitude": {"reference": "inertial"},
    "regions": {
        "spin": {"states": {
            "slow": {"transitions": [{"to": "fast", "when": {"signal": "rate_deg_s", "above": 2.5},
                                      "for_s": 7}]},
            "fast": {"transitions": [{"to": "slow", "at_most_s": 20}]},
        }},
        "aim": {"states": {
            "off": {"transitions": [{"to": "on", "when": {"signal": "axis_to_sun_deg",
                                                           "below": 33.0}}]},
            "on": {"transitions": [{"to": "off", "when": {"signal": "sun_in_view",
                                                          "below": 0.5}}]},
        }},
    },
})  # fmt: skip


def test_a_threshold_is_found_to_a_millionth():
    assert turning_point(lambda x: x < math.pi, 0.0, 10.0) == pytest.approx(math.pi, abs=1e-5)
    assert turning_point(lambda x: x > 0.3, 1.0, 0.0) == pytest.approx(0.3, abs=1e-6)
    with pytest.raises(ValueError, match="must be kept at 0 only; received True there and True"):
        turning_point(lambda x: True, 0.0, 1.0)


def test_what_is_known_reaches_the_table():
    def spin(rate):
        return Logic(MODES)(20, rate_deg_s=rate).now("spin")

    assert turning_point(lambda r: spin(r) == "slow", 0.0, 9.0) == pytest.approx(2.5, abs=1e-4)

    def aim(angle):
        return Logic(MODES)(3, sun_deg=angle).now("aim")

    assert turning_point(lambda a: aim(a) == "off", 90.0, 1.0) == pytest.approx(33.0, abs=1e-3)
    seen = Logic(MODES)(3, sun_deg=5.0)
    assert seen.now("aim") == "on" and seen(2, sun_deg=None).now("aim") == "off"


def test_times_are_those_of_the_table():
    made = Logic(MODES)(2)
    assert made.lasts_s("spin", 50, rate_deg_s=3.0) == pytest.approx(7.0, abs=1.0)
    assert made.lasts_s("spin", 50, rate_deg_s=3.0) == pytest.approx(20.0, abs=1.0)
    assert made.lasts_s("spin", 50, rate_deg_s=1.0) == math.inf


def test_ways_and_their_causes():
    assert ways(MODES.regions["spin"]) == {("slow", "fast"), ("fast", "slow")}
    causes = [cause_of(e.transition) for r in MODES.regions.values() for e in find_edges(r)]
    assert causes == ["rate", "time", "Sun", "Sun"]


def test_a_drawn_table_has_every_state():
    (axes,) = draw_table(MODES, "A title").axes
    shown = [text.get_text() for text in axes.texts]
    assert {"slow", "fast", "off", "on", "spin", "aim"} <= set(shown)
