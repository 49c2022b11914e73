"""Rows of a summary: those without a number say why, or are left out where nothing is wrong."""

import pytest

from torquer.analysis.summary import summary_rows


@pytest.mark.parametrize(("energy_j", "shown"), [(12.5, "12.5 J"), (0.0, "0 J"), (None, None)])
def test_energy_of_coils_without_a_power_is_left_out(energy_j, shown):
    rows = dict(summary_rows({"coil_energy_j": energy_j, "coil_full_power_s": 20.0}, verdict=False))
    assert rows.get("Coil energy") == shown
    assert len(rows) == (1 if shown is None else 2)


def test_what_was_not_reached_still_says_so():
    rows = dict(summary_rows({"wheel_momentum_limit_reached_at_s": None}, verdict=False))
    assert rows == {"First wheel saturated at": "not reached in this run"}
