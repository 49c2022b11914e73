"""Which single faults nothing in a mode table can notice: by what its conditions observe."""

import pytest

from torquer.analysis.notes.fault_notes import fault_lines, unnoticed_faults
from torquer.computer.interface import SENSORS
from torquer.computer.modes.signals import SIGNALS
from torquer.scenario.load import scenario_from_data

ALL = "silent, stuck, zeros"


def scenario_with(conditions, control=None, **sensors):
    """A satellite with these sensors whose modes have one transition for each condition."""
    transitions = [{"to": "b", "when": condition} for condition in conditions]
    states = {"a": {"laws": ["damping"], "transitions": transitions}, "b": {"final": True}}
    modes = {"states": states, "axis": [0, 0, 1], "target": "sun", "inertia_kg_m2": [1, 1, 1]}
    return scenario_from_data(
        {
            "start": "2026-01-01T00:00:00Z",
            "orbit": {"kind": "circular", "altitude_km": 500.0, "inclination_deg": 52.0},
            "spacecraft": {
                "body": {"inertia_kg_m2": [1, 1, 1]}, "coils": {"limit_a_m2": 1.0}, **sensors
            },
            "initial": {"rate_deg_s": [1, 0, 0]},
            "control": {
                "laws": {"damping": {"kind": "bdot", "gain_a_m2_s_per_t": 1e4}},
                "modes": modes, **(control or {}),
            },
            "simulation": {"duration_s": 600.0, "step_s": 1.0},
        }
    )  # fmt: skip


GYRO, SUN = {"gyro": {}}, {"sun_sensors": {"axes": [[0, 0, 1]], "half_field_deg": 60.0}}
FAST, SLOW = {"signal": "rate_deg_s", "above": 3.0}, {"signal": "rate_deg_s", "below": 0.5}
OLD_FIELD = {"signal": "reading_age_s", "sensor": "magnetometer", "above": 30.0}
OLD_GYRO = {"signal": "reading_age_s", "sensor": "gyro", "above": 30.0}
NO_FIELD, STRONG = {"signal": "field_nt", "below": 5e3}, {"signal": "field_nt", "above": 9e4}
NO_SUN = {"signal": "sun_in_view", "below": 0.5}
SPIN_AXIS = {"signal": "momentum_to_target_deg", "above": 90.0}
LATE = {"signal": "time_s", "above": 300.0}
BY_FIELD = {"estimator": {"kind": "rate_from_field"}}


@pytest.mark.parametrize(
    ("conditions", "control", "sensors", "at_all", "by_motion"),
    [
        ([LATE], None, GYRO,
         [f"magnetometer {ALL}", f"gyro {ALL}", "coils dead, reversed, stuck on"], []),
        ([FAST], None, GYRO, [f"gyro {ALL}"],
         [f"magnetometer {ALL}", "coils dead, reversed, stuck on"]),
        ([FAST, SLOW, OLD_GYRO], None, GYRO, ["gyro stuck, zeros"],
         [f"magnetometer {ALL}", "coils dead, reversed, stuck on"]),
        ([OLD_FIELD, NO_FIELD], None, {},
         ["magnetometer stuck", "coils dead, reversed, stuck on"], []),
        ([STRONG], None, {}, [f"magnetometer {ALL}", "coils dead, reversed, stuck on"], []),
        ([NO_SUN], None, SUN,
         [f"magnetometer {ALL}", "Sun sensors silent, stuck", "coils dead, reversed, stuck on"],
         []),
        # the axis of the momentum, by the gyro, against the Sun: one shows the other
        ([SPIN_AXIS], None, GYRO | SUN | {"attitude_sensor": {}}, [],
         [f"magnetometer {ALL}", "coils dead, reversed, stuck on"]),
        ([FAST], BY_FIELD, {}, [f"magnetometer {ALL}"], ["coils dead, reversed, stuck on"]),
    ],
)  # fmt: skip
def test_what_cannot_be_noticed(conditions, control, sensors, at_all, by_motion):
    found = unnoticed_faults(scenario_with(conditions, control, **sensors))
    assert found == (at_all, by_motion)


def test_without_modes_nothing_is_said():
    data = scenario_with([LATE], None).replace("control.modes", None)
    assert fault_lines(data) == []


def test_as_lines():
    lines = fault_lines(scenario_with([FAST], None, **GYRO))
    assert lines == [
        f"no condition of the modes can notice: gyro {ALL}",
        f"noticed at most by the motion that follows: magnetometer {ALL}; "
        "coils dead, reversed, stuck on",
    ]


def test_signals_observe_known_devices():
    known = {*SENSORS, "coils", "rate", "attitude", "estimator", "sensor"}
    for name, signal in SIGNALS.items():
        assert signal.sources <= known, name
