"""Notes on Kalman filters."""

import pytest
from filter_cases import DYNAMICS, GYRO, SCENARIO

from torquer.analysis.notes.filter_notes import filter_notes
from torquer.scenario.load import scenario_from_data


@pytest.mark.parametrize(
    ("estimator", "sample_s", "noted"),
    [(DYNAMICS, 5.0, True), (DYNAMICS, 1.0, False), (GYRO, 5.0, False)],
)
def test_a_far_turn_between_readings_is_noted_without_a_gyro(estimator, sample_s, noted):
    craft = SCENARIO["spacecraft"]
    slow = craft | {"magnetometer": craft["magnetometer"] | {"sample_s": sample_s, "delay_s": 0.0}}
    data = {**SCENARIO, "spacecraft": slow, "initial": {"rate_deg_s": [0.0, 1.5, 0.0]}}
    notes = filter_notes(
        scenario_from_data(data | {"control": {"law": {"kind": "off"}, "estimator": estimator}})
    )
    assert len(notes) == noted and all("turns by 7.5 deg at the initial rate" in x for x in notes)


@pytest.mark.parametrize(
    ("estimator", "windows", "expected"),
    [
        (GYRO, {"measure_s": 2.0, "actuate_s": 6.0}, True),
        (GYRO, {"measure_s": 2.0, "actuate_s": 1.0}, False),
        (GYRO, {}, False),
        (DYNAMICS, {"measure_s": 2.0, "actuate_s": 6.0}, False),
    ],
)
def test_uneven_steps_of_a_filter_with_a_gyro_are_reported(estimator, windows, expected):
    control = {"law": {"kind": "off"}, "estimator": estimator, **windows}
    notes = filter_notes(scenario_from_data({**SCENARIO, "control": control}))
    assert len(notes) == expected and all("steps of 1 and of 6 s" in note for note in notes)
