"""What sampled B-dot brakes: the simulator against the formula, the multipliers and the docs."""

import math
from pathlib import Path

import numpy as np
import pytest
from bdot_loop import growth
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation
from slow_cases import slow_after

from torquer import simulate
from torquer.compile import engine
from torquer.theory.slow.gains import damping_efficiency, driven_rate_rad_s, sampling_limit_rad_s

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")

PAGE = Path(__file__).parents[2] / "docs/theory/sampled-bdot.md"
#: Laws that take differences.
DIFFERENCES = ("bdot", "nutation_damping")


def rows():
    """Rows of the page's table: law, times, and the numbers stated."""
    lines = PAGE.read_text(encoding="utf-8").splitlines()
    cells = [[x.strip() for x in line.strip("|").split("|")] for line in lines if line[:1] == "|"]
    return [(c[0].strip("`"), *map(float, c[1:])) for c in cells if c[0].startswith("`bdot")]


ROWS = rows()


def times_of(law, sample_s, measure_s, actuate_s, lag_s):
    """(difference, hold, lag, off) of a cycle."""
    return (sample_s if law in DIFFERENCES else 0.0), actuate_s, lag_s, measure_s


def turning(make, case, changes):
    """A run in a field that stands still along J3: averaged field, equatorial orbit."""
    law, sample_s, measure_s, actuate_s, lag_s = case
    window = {"measure_s": measure_s, "actuate_s": actuate_s} if measure_s else {}
    coils = {"limit_a_m2": changes.pop("limit", 1e9), "lag_s": lag_s}
    cycles = changes.pop("cycles")
    return simulate(make({
        "orbit.inclination_deg": 0.0,
        "environment.gravity_gradient": False,
        "spacecraft.body.inertia_kg_m2": changes.pop("inertia", [1.0, 1.0, 1.0]),
        "spacecraft.coils": coils | {"saturation": changes.pop("saturation", "scale")},
        "spacecraft.magnetometer": changes.pop("magnetometer", {}),
        "initial": changes.pop("initial"),
        "control": {
            "law": {"kind": law, "gain_a_m2_s_per_t": changes.pop("gain")},
            "sample_s": sample_s, **window,
        },
        "simulation": {
            "duration_s": cycles * (measure_s + actuate_s), "step_s": sample_s / 40.0,
            "record_s": measure_s + actuate_s, "integrator": "splitting",
        },
    }))  # fmt: skip


def lost(make, case, rate, cycles, tilt=0.0, **changes):
    """What a sphere loses of its rate once the coils' lag has forgotten the start [rad/s]."""
    first = int(40.0 * case[4] / (case[2] + case[3])) + 2
    axis = math.degrees(rate) * np.array([math.cos(tilt), 0.0, math.sin(tilt)])
    initial = {"euler_deg": [0.0, 0.0, 17.0], "rate_deg_s": axis.tolist()}
    run = turning(make, case, {"initial": initial, "cycles": first + cycles, **changes})
    size = np.linalg.norm(run.omega_body.values, axis=1)
    return size[first] - size[-1]


def limit_by_runs(make, case, cycles, age_s=0.0, **changes):
    """Rate [deg/s] at which a run neither brakes nor drives, by bisection."""
    about = sampling_limit_rad_s(*times_of(*case)[:3], age_s)
    found = brentq(
        lambda w: lost(make, case, w, cycles, **changes), 0.5 * about, 1.5 * about, xtol=1e-7
    )
    return math.degrees(found)


WEAK = {"gain": 1.0, "cycles": 50}
SATURATED = {"gain": 1e12, "limit": 1e-3, "cycles": 800}


def test_the_table_holds_what_was_asked_for():
    assert len(ROWS) >= 12
    assert {0.0, 0.1, 0.5, 2.0} <= {row[4] for row in ROWS}
    assert any(row[1:4] == (3.0, 6.0, 3.0) for row in ROWS)  # the window of Chibis-M
    assert {row[0] for row in ROWS} == {"bdot", "bdot_rate"}


@pytest.mark.parametrize("row", slow_after(4, ROWS), ids=lambda row: " ".join(map(str, row[:5])))
def test_formula_multipliers_and_runs_agree_with_the_table(make, row):
    case, answer = row[:5], row[5:]
    times = times_of(*case)
    limit = sampling_limit_rad_s(*times[:3])
    by_multipliers = brentq(lambda w: growth(w, 1e-7, *times), 0.85 * limit, 1.12 * limit)
    runs = (limit_by_runs(make, case, **changes) for changes in (WEAK, SATURATED))
    found = (math.degrees(limit), math.degrees(by_multipliers), *runs)
    assert found == pytest.approx(answer, abs=0.0051)  # two decimals
    assert found == pytest.approx([found[0]] * 4, rel=1e-4)


@pytest.mark.parametrize("saturation", ["clip", "relay"])
@pytest.mark.parametrize(
    "case", slow_after(1, [("bdot", 2.0, 0.0, 2.0, 0.5), ("bdot", 3.0, 6.0, 3.0, 0.5)])
)
def test_direction_changing_coils_keep_the_limit_on_average(make, case, saturation):
    found = limit_by_runs(make, case, **SATURATED | {"cycles": 2000}, saturation=saturation)
    assert found == pytest.approx(
        math.degrees(sampling_limit_rad_s(*times_of(*case)[:3])), rel=3e-3
    )


@pytest.mark.parametrize("tilt_deg", [20.0, 60.0])
def test_sphere_has_the_same_limit_at_any_angle_to_field(make, tilt_deg):
    case = ("bdot", 2.0, 0.0, 2.0, 0.5)
    found = limit_by_runs(make, case, **WEAK, tilt=math.radians(tilt_deg))
    assert found == pytest.approx(math.degrees(sampling_limit_rad_s(2.0, 2.0, 0.5)), rel=1e-5)


#: Magnetometers at rates of their own, and the age of their readings at control steps every 2 s.
LATE = [
    ({"sample_s": 0.5, "delay_s": 0.5}, 0.5),
    ({"sample_s": 2.0, "delay_s": 0.5}, 2.0),
    ({"sample_s": 0.2, "delay_s": 0.15}, 0.2),
    ({"sample_s": 1.0}, 0.0),
]


@pytest.mark.parametrize(("magnetometer", "age_s"), LATE)
@pytest.mark.parametrize("lag_s", slow_after(1, [0.5, 0.0]))
def test_late_readings_turn_the_damping_by_their_age(make, magnetometer, age_s, lag_s):
    case, rate = ("bdot", 2.0, 0.0, 2.0, lag_s), math.radians(12.0)
    late, ideal = (
        lost(make, case, rate, **WEAK, magnetometer=sampled) for sampled in (magnetometer, {})
    )
    times = times_of(*case)[:3]
    expected = damping_efficiency(rate, *times, age_s) / damping_efficiency(rate, *times)
    assert late / ideal == pytest.approx(expected, rel=1e-4)
    found = limit_by_runs(make, case, **WEAK, age_s=age_s, magnetometer=magnetometer)
    limit = sampling_limit_rad_s(*times, age_s)
    assert found == pytest.approx(math.degrees(limit), rel=1e-4)


def test_sphere_above_limit_is_driven_to_the_next_sign_change(make):
    """40 deg/s, sampled every 2 s, lag 0.5 s: what a formula without lag calls safe."""
    case = ("bdot", 2.0, 0.0, 2.0, 0.5)
    initial = {"rate_deg_s": [40.0, 0.0, 0.0]}
    run = turning(make, case, {
        "initial": initial, "cycles": 16000, "gain": 2e4, "limit": 0.2, "inertia": [0.005] * 3,
    })  # fmt: skip
    rate = np.linalg.norm(run.omega_body.values, axis=1)
    assert math.radians(40.0) < sampling_limit_rad_s(2.0, 2.0)
    assert rate[-1] == pytest.approx(driven_rate_rad_s(2.0, 2.0, 0.5), rel=0.01)


def nutating(share, polar_deg, rate, to_field_deg):
    """Axisymmetric body, C/A = share; its momentum at an angle to the field."""
    polar, away = math.radians(polar_deg), math.radians(to_field_deg)
    omega = rate * np.array([math.sin(polar), 0.0, math.cos(polar)])
    momentum = np.array([1.0, 1.0, share]) * omega
    wanted = np.array([math.sin(away), 0.0, math.cos(away)])
    turn, _ = Rotation.align_vectors([wanted], [momentum])
    initial = {"quaternion": turn.as_quat().tolist(), "rate_deg_s": np.degrees(omega).tolist()}
    return omega, momentum, initial


@pytest.mark.parametrize("share", [0.33, 1.7])
@pytest.mark.parametrize("to_field_deg", [90.0, 30.0])
def test_power_is_the_sum_over_frequencies_of_the_passing_field(make, share, to_field_deg):
    """Not a sphere: -k sum E(f) |dB/dt|^2 over the lines of the field as the body sees it."""
    case, gain = ("bdot", 2.0, 0.0, 2.0, 0.5), 1.0
    omega, momentum, initial = nutating(share, 50.0, math.radians(25.0), to_field_deg)
    precession, c = np.linalg.norm(momentum), momentum[2] / np.linalg.norm(momentum)
    spin = omega[2] * (1.0 - share)
    across, along = 0.5 * math.sin(math.radians(to_field_deg)) ** 2, 1.0 - c * c
    lines = (
        (across * (1 + c) ** 2 / 2, spin + precession),
        (across * (1 - c) ** 2 / 2, spin - precession),
        (across * along, precession),
        (math.cos(math.radians(to_field_deg)) ** 2 * along, spin),
    )
    run = turning(make, case, {
        "initial": initial, "cycles": 3000, "gain": gain, "inertia": [1.0, 1.0, share],
    })  # fmt: skip
    b2 = np.sum(run.b_body.values[0] ** 2)
    energy = 0.5 * run.omega_body.values**2 @ np.array([1.0, 1.0, share])
    power = (energy[-1] - energy[10]) / (run.time.values[-1] - run.time.values[10])
    expected = -gain * b2 * sum(p * f**2 * damping_efficiency(f, 2.0, 2.0, 0.5) for p, f in lines)
    assert power == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize(
    ("law", "share"), [("nutation_damping", 0.5), ("nutation_damping_rate", 1.6)]
)
def test_nutation_damping_ends_where_the_precession_is_at_the_limit(make, law, share):
    case = (law, 2.0, 0.0, 2.0, 0.5)
    limit = sampling_limit_rad_s(*times_of(*case)[:3])

    def gained(part):
        _, momentum, _ = nutating(share, 30.0, 1.0, 70.0)
        rate = part * limit / np.linalg.norm(momentum)
        _, _, initial = nutating(share, 30.0, rate, 70.0)
        run = turning(make, case, {
            "initial": initial, "cycles": 2000, "gain": 1.0, "inertia": [1.0, 1.0, share],
        })  # fmt: skip
        across = np.sum(run.omega_body.values[:, :2] ** 2, axis=1)
        return across[-1] - across[20]

    assert brentq(gained, 0.8, 1.2, xtol=1e-5) == pytest.approx(1.0, abs=1e-3)
