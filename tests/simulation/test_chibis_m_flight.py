"""The flight software's modes of Chibis-M flown: boot to science, S-dot sessions, turns, losses."""

from pathlib import Path

import numpy as np
import pytest
from flight_losses import OUTCOMES, PAGE, STRIKES, ending
from scipy.spatial.transform import Rotation

from torquer import Flight, load_scenario, simulate
from torquer.campaign.faults.kinds import find_faults
from torquer.compile import engine
from torquer.scenario.change import with_values

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
EXAMPLE = Path(__file__).parents[2] / "examples" / "chibis_m_flight.toml"
HOUR_S = 3600.0


def scenario(hours, **changes):
    """The example, so long, with values of some keys."""
    return with_values(load_scenario(EXAMPLE), {"simulation.duration_s": hours * HOUR_S, **changes})


def states(result, region):
    """The state of a region at each record."""
    variable = result[f"mode_{region}"]
    return np.array(variable.attrs["flag_meanings"].split())[variable.values.astype(int)]


def began(result, region, state):
    """Times at which a region was in a state and had not been at the record before [s]."""
    there = states(result, region) == state
    return result.time.values[there & ~np.concatenate([[False], there[:-1]])]


def angle_deg(a, b):
    """Angles between vectors, row by row."""
    a, b = (v / np.linalg.norm(v, axis=1)[:, None] for v in (a, b))
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.sum(a * b, axis=1)))


def sun_angles_deg(result):
    """Angles of the angular momentum and of the third axis to the Sun."""
    turn = Rotation.from_quat(result.q_body_to_inertial.values)
    inertia = np.array(load_scenario(EXAMPLE).control.modes.inertia_kg_m2)
    momentum = turn.apply(result.omega_body.values @ inertia)
    third = turn.apply([0.0, 0.0, 1.0])
    sun = result.sun_inertial.values
    return angle_deg(momentum, sun), angle_deg(third, sun)


def rate_deg_s(result):
    """Absolute rate."""
    return np.degrees(np.linalg.norm(result.omega_body.values, axis=1))


def estimate_error_deg(result):
    """Angle between the estimated attitude and the true one."""
    true = Rotation.from_quat(result.q_body_to_inertial.values)
    q = result.q_estimated.values
    known = np.isfinite(q[:, 0])
    error = np.full(len(q), np.nan)
    error[known] = np.degrees((true[known].inv() * Rotation.from_quat(q[known])).magnitude())
    return error


@pytest.fixture(scope="module")
def boot():
    """From the release on."""
    return simulate(scenario(5.0))


def test_from_boot_to_science(boot):
    """SDOT Figs 3.22 to 3.24: safe mode, B-dot, TRIAD and wheels, Kalman filter."""
    first = [
        began(boot, "determination", state)[0]
        for state in ("sdot", "bdot", "waiting", "triad", "kalman_mag_dss", "kalman_mag_wrate")
    ]
    assert first[0] == 0.0 and 120.0 <= first[1] <= 140.0 and (np.diff(first) > 0.0).all()
    acquired, science = (began(boot, "stabilisation", s) for s in ("acquisition", "science"))
    assert first[3] <= acquired[0] <= first[3] + 20.0
    assert science[0] - acquired[-1] < 1500.0  # as long as the source lets it last
    late = boot.time.values >= science[0]
    assert set(states(boot, "stabilisation")[late]) == {"science"}
    assert set(states(boot, "determination")[late]) == {"kalman_mag_dss", "kalman_mag_wrate"}
    assert set(states(boot, "actuators")) == {"stb_tw"}
    for guard in ("magnetometer", "gyro", "sun", "coils", "coil_x", "coil_y", "coil_z", "capture"):
        assert not boot[f"mode_{guard}"].values.any()


def test_before_acquisition_coils_work_alone(boot):
    acquired = began(boot, "stabilisation", "acquisition")[0]
    before = boot.time.values < acquired
    assert np.abs(boot.torque_command_body.values[before]).max() == 0.0
    assert np.abs(boot.command_body.values[before]).max() > 1.0
    science = states(boot, "stabilisation") == "acquisition"
    assert np.abs(boot.command_body.values[science][1:]).max() == 0.0  # 3X: wheels alone


def test_filters_are_switched_at_shadow_entry_and_exit(boot):
    """SDOT Figs 3.25 and 3.26: the gyro drifts in the shadow; in the light all is soon good."""
    t, dark = boot.time.values, boot.sunlit_fraction.values == 0.0
    enters = t[1:][dark[1:] & ~dark[:-1]][-1]
    leaves = t[1:][~dark[1:] & dark[:-1] & (t[1:] > enters)][0]
    error, filters = estimate_error_deg(boot), states(boot, "determination")
    shadow = (t > enters + 20.0) & (t < leaves)
    assert set(filters[shadow]) == {"kalman_mag_wrate"}
    assert set(filters[(t > leaves + 20.0) & (t < leaves + 600.0)]) == {"kalman_mag_dss"}
    light = (t > leaves + 120.0) & (t < leaves + 600.0)
    assert error[light].max() < 0.3 and 1.0 < error[shadow].max() < 10.0


# Starts whose ends are far from any limit; the text gives none.
# Shares of random ones, at the times that it states: gallery SDOT-3.27.
@pytest.mark.parametrize(
    ("euler_deg", "part", "momentum_deg", "axis_deg"),
    [
        ([-107.0, -43.0, 90.0], 1.0, 180.0, 180.0),  # 9 November 2013: Figs 3.27 and 3.28
        ([40.0, -70.0, 110.0], 0.5, 0.0, 180.0),  # 14 November: Figs 3.29 and 3.30
        ([40.0, -70.0, 110.0], 1.0, 0.0, 0.0),  # 18 November: Figs 3.31 and 3.32
    ],
)
def test_s_dot_session_ends_as_one_of_three_flown_ones(euler_deg, part, momentum_deg, axis_deg):
    """Momentum and axis along the Sun's line, either way round, and a momentum that stays."""
    silent = [{"kind": "silent", "from_s": 0.0}]
    result = simulate(
        scenario(
            2.5,
            **{
                "spacecraft.magnetometer.failures": silent,
                "initial.euler_deg": euler_deg,
                "initial.rate_deg_s": [1.2 * part, -1.6 * part, 0.8 * part],
            },
        )
    )
    assert set(states(result, "determination")) == {"sdot"}
    assert set(states(result, "stabilisation")) == {"safe"}
    t, (momentum, axis) = result.time.values, sun_angles_deg(result)
    last = t > 2.0 * HOUR_S
    assert np.abs(momentum[last] - momentum_deg).max() < 10.0
    assert np.abs(axis[last] - axis_deg).max() < 25.0
    rate = rate_deg_s(result)
    assert np.ptp(rate[last]) < 0.3 * rate[last].mean() and 0.2 < rate[last].mean() < rate[0]
    assert np.abs(result.torque_command_body.values).max() == 0.0


def flown(scenario, commands):
    """The result of a flight; `commands`: functions of flight and inputs, called at times [s]."""
    flight = Flight(scenario, keeps_computer=True)
    while (inputs := flight.read()) is not None:
        if inputs.t_s in commands:
            commands[inputs.t_s](flight, inputs)
        flight.command()
    return flight.result()


def test_fast_180_deg_turn_within_15_min_holds_one_axis():
    """The worst case: from where it is to the opposite direction; then for a revolution."""
    at_s, opposite = 9960.0, []

    def turn(flight, inputs):
        third = Rotation.from_quat(inputs.estimate.q_body_to_inertial).apply([0.0, 0.0, 1.0])
        opposite.append(-third)
        for law in ("turn", "one_axis"):
            flight.set_parameter(f"{law}.sun", 0.0)
            flight.set_parameter(f"{law}.target", (-third).tolist())
        flight.command_mode("stabilisation", "point2dir")

    result = flown(scenario(4.5), {at_s: turn})
    t = result.time.values
    third = Rotation.from_quat(result.q_body_to_inertial.values).apply([0.0, 0.0, 1.0])
    off = angle_deg(third, np.broadcast_to(opposite[0], third.shape))
    assert off[t == at_s] > 179.0
    assert off[(t > at_s + 900.0) & (t < at_s + 5400.0)].max() < 3.0
    assert began(result, "stabilisation", "point2dir").tolist() == [at_s + 10.0]
    (held,) = began(result, "stabilisation", "one_axis")
    assert held - at_s < 900.0
    assert set(states(result, "stabilisation")[t > held]) == {"one_axis"}


def test_switched_off_nothing_works_until_the_ground_commands_another_state():
    commands = {
        7000.0: lambda flight, _: flight.command_mode("determination", "aos_off"),
        7600.0: lambda flight, _: flight.set_flag("anomaly", True),
        7700.0: lambda flight, _: flight.set_flag("anomaly", False),
        8000.0: lambda flight, _: flight.command_mode("determination", "sdot"),
    }
    result = flown(scenario(2.6), commands)
    t = result.time.values
    off = (t > 7010.0) & (t < 8000.0)
    assert set(states(result, "determination")[off]) == {"aos_off"}
    assert set(states(result, "actuators")[off]) == {"stb_00"}
    assert np.abs(result.command_body.values[off]).max() == 0.0
    assert np.abs(result.torque_command_body.values[off]).max() == 0.0
    assert began(result, "determination", "bdot")[-1] == pytest.approx(8120.0, abs=20.0)
    assert states(result, "actuators")[-1] == "stb_tw"


def test_in_manual_mode_the_ground_keeps_it_where_it_is():
    """Safe mode is not left in manual mode; an anomaly ends the manual mode."""

    def manual(flight, _):
        flight.command_mode("supervisor", "manual")
        flight.command_mode("determination", "sdot")

    commands = {
        6000.0: manual,
        8000.0: lambda flight, _: flight.set_flag("anomaly", True),
        8600.0: lambda flight, _: flight.set_flag("anomaly", False),
    }
    result = flown(scenario(2.5), commands)
    t = result.time.values
    safe = (t > 6000.0) & (t <= 8600.0)
    assert set(states(result, "determination")[safe]) == {"sdot"}
    assert set(states(result, "stabilisation")[safe & (t > 6010.0)]) <= {"safe", "safe_spin_up"}
    assert began(result, "supervisor", "automatic")[-1] == pytest.approx(8000.0, abs=11.0)
    assert began(result, "determination", "bdot")[-1] == pytest.approx(8600.0, abs=11.0)


def test_successive_wheel_losses_end_in_s_dot_keeping_the_sun():
    """The end of Chibis-M's wheels: one of a pair is missed by nobody, the second ends science."""
    failures = [
        {"wheel": 0, "time_s": 6000.0, "noticed_after_s": 10.0},
        {"wheel": 1, "time_s": 7000.0, "noticed_after_s": 10.0},
    ]
    broken = scenario(10.0, **{"spacecraft.wheels.failures": failures})
    result = flown(broken, {7010.0: lambda flight, _: flight.set_flag("wheel_x_lost", True)})
    t = result.time.values
    science = (t > 5600.0) & (t < 7000.0)
    assert set(states(result, "stabilisation")[science]) == {"science"}
    after = t > 7020.0
    assert set(states(result, "actuators")[after]) == {"stb_0t"}
    assert np.abs(result.torque_command_body.values[after]).max() == 0.0
    last = t > 8.0 * HOUR_S
    assert set(states(result, "stabilisation")[last]) <= {"safe", "safe_spin_up"}
    momentum, axis = sun_angles_deg(result)
    assert axis[last].max() < 40.0 and momentum[last].max() < 30.0
    assert rate_deg_s(result)[last].max() < 2.0


def page_cells():
    """Outcomes of the page, by fault and mode: the word, the number and its unit."""
    rows = [line.strip("| ").split(" | ") for line in PAGE.read_text("utf-8").splitlines()]
    return {
        (row[0], mode): cell.split()
        for row in rows
        if len(row) == 1 + len(STRIKES) and row[0] not in ("fault", "---")
        for mode, cell in zip(STRIKES, row[1:], strict=True)
    }


def test_every_loss_in_every_mode_ends_safe_or_better():
    """None in a rate above that of the release by more than the last moments of a fault made."""
    faults, cells = find_faults(load_scenario(EXAMPLE)), page_cells()
    assert {fault for fault, _ in cells} == {"none", *(fault.name for fault in faults)}
    assert {word for word, *_ in cells.values()} <= {*OUTCOMES}
    rates = [float(value) for _, value, unit in cells.values() if unit == "deg/s"]
    assert max(rates) < 2.5
    for (fault, mode), (word, *_) in cells.items():
        if fault.startswith(("gyro", "none", "computer")) or ("dead" in fault and "coil" in fault):
            assert word in ("science", "coarse", "1X"), (fault, mode)


@pytest.mark.parametrize(
    ("fault", "mode"),
    [
        ("none", "1X"),
        ("gyro silent", "science"),
        ("Sun sensors silent", "B-dot"),
        ("magnetometer stuck", "safe"),
        ("coil 1 dead", "science, shadow"),
    ],
)
def test_the_page_shows_what_is_flown(fault, mode):
    """Of faults whose outcome is far from any limit."""
    faults = {each.name: each for each in find_faults(load_scenario(EXAMPLE))}
    found, shown = ending(faults.get(fault), mode), page_cells()[fault, mode]
    assert (found.outcome, found.unit) == (shown[0], shown[2])
    assert found.value == pytest.approx(float(shown[1]), rel=0.5)
