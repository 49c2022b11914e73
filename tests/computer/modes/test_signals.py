"""Signals: their values and units, and when they are unknown."""

import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from flown_modes import Flown, Z, reading, spinning
from known import record_of
from scipy.spatial.transform import Rotation

from torquer.computer.inputs import ReadingTimes
from torquer.computer.interface import SENSORS, UNKNOWN_ESTIMATE
from torquer.computer.modes import signals
from torquer.computer.modes.signals import NUMBER_OF, SIGNALS, UNITS, signal_value
from torquer.maths.geometry.quaternion import rotate_inverse

J = ((1.0, 0.1, 0.0), (0.1, 1.2, -0.05), (0.0, -0.05, 1.5))
AXIS, TARGET = (0.0, 0.6, 0.8), (2.0, -1.0, 2.0)
OMEGA, Q, SUN = (0.01, -0.02, 0.05), (0.5, -0.5, 0.1, math.sqrt(0.49)), (0.36, 0.48, 0.8)
NOISE = {"magnetometer_noise_nt": 100, "sun_noise_deg": 0.2, "gyro_noise_deg_s": 0.02,
         "rate_tolerance_deg_s": 0.06}  # fmt: skip
STATES = {"a": {"transitions": [{"to": "b", "at_most_s": 5.0}]}, "b": {}}


def value(name, inputs, index=0, flown=None, **keys):
    """A signal in its own unit."""
    if flown is None:
        flown = Flown(**{"axis": AXIS, "target": TARGET, "inertia_kg_m2": J,
                         "attitude": {"euler_deg": EULER}, "noise": NOISE,
                         "flags": ["raised"], **keys},
                      states=STATES)  # fmt: skip
        flown.state.checks["turning"] = (9.0, 30.0, *Z, *OMEGA, np.dot(OMEGA, OMEGA))
    flown.state.flags[:1] = 1.0
    found = signal_value(NUMBER_OF[name], flown.table, flown.state, record_of(inputs), index)
    return found / UNITS[SIGNALS[name].unit]


def degrees(a, b):
    a, b = np.array(a), np.array(b)
    return math.degrees(math.acos(a @ b / np.linalg.norm(a) / np.linalg.norm(b)))


#: A place on an orbit, the orbital frame there and its rate, by their definitions.
R, V, EULER = (7e6, -1e5, 2e5), (300.0, 4e3, 6.3e3), (40.0, -20.0, 110.0)
NORMAL = np.cross(R, V)
TURNING = NORMAL / np.dot(R, R)
ORBITAL = Rotation.from_matrix(np.column_stack([
    np.cross(NORMAL, R) / np.linalg.norm(np.cross(NORMAL, R)),
    NORMAL / np.linalg.norm(NORMAL), np.array(R) / np.linalg.norm(R)]))  # fmt: skip
BODY = Rotation.from_quat(Q)
WANTED = ORBITAL * Rotation.from_euler("ZYX", EULER, degrees=True)
MOMENTUM = np.array(J) @ OMEGA
TARGET_BODY = rotate_inverse(Q, TARGET)
READ = ReadingTimes(1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0)
SEEN = reading(
    10.0, place=(R, V), sun=SUN, sunlit_fraction=0.25, b=(3e-5, 0.0, -4e-5), wheels=(0.0, 0.3, 0.4),
    read_at=READ,
    omega_body_rad_s=OMEGA, q_body_to_inertial=Q, sigma_rad=math.radians(0.3),
)  # fmt: skip
EXPECTED = {
    "rate_deg_s": math.degrees(math.hypot(*OMEGA)),
    "spin_deg_s": math.degrees(np.dot(AXIS, OMEGA)),
    "nutation_deg": min(degrees(AXIS, MOMENTUM), 180.0 - degrees(AXIS, MOMENTUM)),
    "momentum_rate_deg_s": math.degrees(np.linalg.norm(MOMENTUM)) / (3.7 / 3.0),
    "axis_to_target_deg": degrees(AXIS, TARGET_BODY),
    "momentum_to_target_deg": degrees(MOMENTUM, TARGET_BODY),
    "attitude_error_deg": math.degrees((WANTED.inv() * BODY).magnitude()),
    "attitude_rate_deg_s": math.degrees(np.linalg.norm(OMEGA - BODY.inv().apply(TURNING))),
    "axis_to_sun_deg": degrees(AXIS, SUN),
    "sun_in_view": 1.0,
    "sunlit_fraction": 0.25,
    "field_nt": 5e4,
    "wheel_momentum_n_m_s": 0.5,
    "estimate_age_s": 10.0,
    "estimate_sigma_deg": 0.3,
    "estimate_doubts": 0.0,
    "reading_age_s": 9.0,
    "sensor_suspected": 0.0,
    "coil_suspected": 0.0,
    "coils_reversed": 0.0,
    "turn_deg_s": math.degrees(math.hypot(*OMEGA)),
    "flag": 1.0,
    "time_s": 10.0,
    "time_in_state_s": math.inf,
    "entries": 0.0,
    "in_state": 1.0,
}


@pytest.mark.parametrize("name", SIGNALS)
def test_a_signal_has_its_value(name):
    assert value(name, SEEN) == pytest.approx(EXPECTED[name], rel=1e-12)


@pytest.mark.parametrize("name", SIGNALS)
def test_the_checker_knows_what_a_signal_is_computed_from(name):
    """Without that part of the estimate it is unknown; its value is within its range."""
    low, high = SIGNALS[name].range
    assert low <= value(name, SEEN) <= high
    parts = {"attitude": "q_body_to_inertial", "rate": "omega_body_rad_s", "sigma": "sigma_rad"}
    for part, field in parts.items():
        without = getattr(UNKNOWN_ESTIMATE, field)
        inputs = SEEN._replace(estimate=SEEN.estimate._replace(**{field: without}))
        assert math.isnan(value(name, inputs)) == (part in SIGNALS[name].estimated)


#: A copy of the module with one more signal, in which all are evaluated by number.
WITH_ONE_MORE = """
import importlib.util, sys
from types import SimpleNamespace as N
from torquer.compile.engine import records
from torquer.computer.interface import SUN_SENSORS, nothing_known
spec = importlib.util.spec_from_file_location("with_one_more", sys.argv[1])
module = importlib.util.module_from_spec(spec)
spec.loader.exec_module(module)
known = records(nothing_known())[0]
known.t_s, known.readings[SUN_SENSORS, :3] = 7.0, (0.0, 0.6, 0.8)
known.estimate_omega_x, known.estimate_omega_y, known.estimate_omega_z = 0.1, 0.0, -0.3
known.estimate_q_x, known.estimate_q_y, known.estimate_q_z = 0.0, 0.0, 0.0
known.estimate_q_w = 1.0
table = N(axis=(0.0, 0.0, 1.0), inertia_kg_m2=(1.0, 1.0, 2.0, 0.0, 0.0, 0.0),
          wheel_momentum_n_m_s=(0.0, 0.0, 0.0), target=(1.0, 0.0, 0.0), target_is_sun=0.0)
for name in ("spin_deg_s", "nutation_deg", "axis_to_sun_deg", "spin_size_deg_s", "time_s"):
    arguments = table, None, known, 0
    by_number = module.signal_value(module.NUMBER_OF[name], *arguments)
    print(name, by_number, module.SIGNALS[name].function(*arguments))
"""


@pytest.mark.parametrize("before", ['    "nutation_deg": Signal(', "}  # fmt: skip\nNUMBER_OF"])
def test_a_signal_is_one_function_and_one_line(before, tmp_path):
    """Wherever its line stands: in the middle or at the end."""
    text = Path(signals.__file__).read_text(encoding="utf-8")
    function = (
        "@inlined\ndef spin_size(table, state, k, index):\n"
        "    return abs(dot(table.axis, read_inputs(k).estimate.omega_body_rad_s))\n\n\n"
    )
    line = '    "spin_size_deg_s": Signal(spin_size, "deg/s", ("axis",), estimated=_RATE),\n'
    assert text.count(before) == text.count("class Signal(") == 1
    text = text.replace("class Signal(", function + "class Signal(").replace(before, line + before)
    copy, script = tmp_path / "with_one_more.py", tmp_path / "evaluate.py"
    copy.write_text(text, encoding="utf-8")
    script.write_text(WITH_ONE_MORE, encoding="utf-8")
    plain = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    run = subprocess.run(
        [sys.executable, script, copy], env=plain, capture_output=True, text=True, check=True
    )
    found = [row.split() for row in run.stdout.splitlines()]
    assert len({own for _, _, own in found}) == len(found) == 5
    assert all(by_number == own for _, by_number, own in found)


def test_a_signal_that_is_not_there_is_unknown():
    flown = Flown(states=STATES)
    assert math.isnan(signal_value(len(SIGNALS), flown.table, flown.state, record_of(SEEN), 0))


def test_nutation_is_that_of_the_axis_line():
    """A spin backwards about the axis has none either."""
    for sign in (1.0, -1.0):
        inputs = reading(omega_body_rad_s=[sign * x for x in np.linalg.solve(J, AXIS)])
        assert value("nutation_deg", inputs) == pytest.approx(0.0, abs=1e-6)


def test_small_angles_are_not_lost_in_rounding():
    off = math.radians(1e-9)
    inputs = reading(sun=(math.sin(off), 0.0, math.cos(off)))
    assert value("axis_to_sun_deg", inputs, axis=Z) == pytest.approx(1e-9, rel=1e-9)
    inputs = reading(sun=(math.sin(off), 0.0, -math.cos(off)))
    assert 180.0 - value("axis_to_sun_deg", inputs, axis=Z) == pytest.approx(1e-9, rel=1e-4)


def test_the_target_may_be_the_sun():
    assert value("axis_to_target_deg", SEEN, target="sun") == value("axis_to_sun_deg", SEEN)
    assert math.isnan(value("axis_to_target_deg", reading(**spinning(1.0)), target="sun"))


def test_what_cannot_be_decided_is_unknown():
    """Angles without the Sun, at rest, or without an estimate; never a number made up."""
    blind = reading(**spinning(1.0))._replace(estimate=UNKNOWN_ESTIMATE)
    unknown = "rate_deg_s spin_deg_s nutation_deg axis_to_target_deg momentum_to_target_deg"
    others = ("sunlit_fraction", "axis_to_sun_deg", "estimate_sigma_deg")
    for name in (*unknown.split(), *others):
        assert math.isnan(value(name, blind)), name
    resting = reading(omega_body_rad_s=(0.0, 0.0, 0.0))
    assert math.isnan(value("nutation_deg", resting)) and value("rate_deg_s", resting) == 0.0
    assert value("sun_in_view", blind) == 0.0


def test_before_the_first_reading_and_estimate_their_age_is_infinite():
    blind = reading(7.0, read_at=ReadingTimes(*[-math.inf] * 6))
    blind = blind._replace(estimate=UNKNOWN_ESTIMATE)
    assert value("estimate_age_s", blind) == value("reading_age_s", blind, 3) == math.inf


@pytest.mark.parametrize("sensor", range(len(SENSORS)))
def test_every_sensor_has_its_own_age(sensor):
    assert value("reading_age_s", SEEN, sensor) == 10.0 - READ[sensor]


@pytest.mark.parametrize("sensor", range(len(SENSORS)))
def test_the_estimator_doubts_one_sensor(sensor):
    isolated = tuple(float(k == sensor) for k in range(len(SENSORS)))
    inputs = SEEN._replace(estimate=SEEN.estimate._replace(isolated=isolated))
    assert [value("estimate_doubts", inputs, k) for k in range(len(SENSORS))] == list(isolated)


def test_time_in_state_and_entries_count_from_the_entry():
    flown = Flown(axis=AXIS, target=TARGET, inertia_kg_m2=J, states=STATES)
    flown.states([reading(t) for t in (1.0, 3.0, 6.0)])
    assert value("time_in_state_s", reading(8.0), 0, flown) == 2.0
    assert [value("entries", reading(8.0), i, flown) for i in (0, 1)] == [1.0, 1.0]
    assert [value("in_state", reading(8.0), i, flown) for i in (0, 1)] == [0.0, 1.0]


def test_every_signal_says_what_it_is_and_names_its_unit():
    endings = {"deg/s": "_deg_s", "deg": "_deg", "s": "_s", "nT": "_nt", "N m s": "_n_m_s"}
    for name, signal in SIGNALS.items():
        assert signal.docs and signal.unit in UNITS
        assert name.endswith(endings.get(signal.unit, ""))


def test_signals_name_an_observation_or_read_modes_and_clock_only():
    devices = {*SENSORS, "coils", "rate", "attitude", "sensor", "estimator"}
    for name, signal in SIGNALS.items():
        assert signal.sources <= devices, name
    inner = {name for name, signal in SIGNALS.items() if not signal.sources}
    assert inner == {
        *("sunlit_fraction", "time_s", "time_in_state_s", "entries", "in_state", "flag")
    }


@pytest.mark.parametrize(
    ("cells", "sensor", "suspected"),
    [({"failed_s": 0.0}, 2, 1.0), ({"blamed_s": -100.0}, 2, 1.0), ({"blamed_s": -111.0}, 2, 0.0)],
)
def test_a_suspicion_lasts_for_two_minutes(cells, sensor, suspected):
    flown = Flown(inertia_kg_m2=J, noise=NOISE, states=STATES)
    for name, at_s in cells.items():
        flown.state.sensors[name][sensor] = at_s
    found = [value("sensor_suspected", SEEN, i, flown) for i in range(6)]
    assert found == [suspected if i == sensor else 0.0 for i in range(6)]


def test_coil_is_suspected_where_its_effect_is_surely_too_small():
    """Three reversed coils are a magnetometer of the wrong sign; a dipole always there is none."""
    flown = Flown(inertia_kg_m2=J, noise=NOISE, states=STATES)
    now = flown.state.checks[0]

    def suspected(effects, sigma, always=0.0):
        now["effect"][:3], now["effect"][3], now["greatest"] = effects, always, 3.2
        now["covariance"][:] = np.eye(6) * sigma**2
        coils = [value("coil_suspected", SEEN, i, flown) for i in range(3)]
        others = (
            value("sensor_suspected", SEEN, 0, flown),
            value("coils_reversed", SEEN, 0, flown),
        )
        return *coils, *others

    assert suspected((1.0, 0.05, -1.0), 0.2) == (0.0, 1.0, 1.0, 0.0, 0.0)
    assert suspected((1.0, 0.15, -1.0), 0.2) == (0.0, 0.0, 1.0, 0.0, 0.0)
    assert suspected((-1.0, -1.0, -1.0), 0.4) == (0.0, 0.0, 0.0, 1.0, 1.0)
    assert suspected((-1.0, -1.0, -1.0), 0.6) == (1.0, 1.0, 1.0, 0.0, 1.0)
    assert suspected((-1.0, -1.0, -1.0), 0.9) == (0.0, 0.0, 0.0, 0.0, 0.0)
    assert suspected((1.0, 1.0, 1.0), 0.1, always=1.2) == (1.0, 0.0, 0.0, 0.0, 0.0)
    assert suspected((1.0, 1.0, 1.0), 0.1, always=0.9) == (0.0, 0.0, 0.0, 0.0, 0.0)


def test_an_inertial_attitude_needs_no_place():
    """Its signals are known without an orbit; those of an orbital one are not."""
    inertial = {"reference": "inertial", "euler_deg": EULER}
    away = Rotation.from_euler("ZYX", EULER, degrees=True).inv() * BODY
    here = reading(10.0, omega_body_rad_s=OMEGA, q_body_to_inertial=Q)
    error = value("attitude_error_deg", here, attitude=inertial)
    assert error == pytest.approx(math.degrees(away.magnitude()), rel=1e-12)
    rate = value("attitude_rate_deg_s", here, attitude=inertial)
    assert rate == pytest.approx(EXPECTED["rate_deg_s"], rel=1e-12)
    assert math.isnan(value("attitude_error_deg", here))
    assert math.isnan(value("attitude_rate_deg_s", here))


def test_both_quaternions_of_an_attitude_have_the_same_error():
    other = SEEN._replace(estimate=SEEN.estimate._replace(q_body_to_inertial=tuple(-x for x in Q)))
    for name in ("attitude_error_deg", "attitude_rate_deg_s"):
        assert value(name, other) == value(name, SEEN)


def test_signals_of_an_attitude_need_one():
    way = {"to": "b", "when": {"signal": "attitude_error_deg", "below": 5.0}}
    with pytest.raises(ValueError, match="attitude: must be given for the signal attitude_error"):
        Flown(states={"a": {"transitions": [way]}, "b": {"final": True}})
