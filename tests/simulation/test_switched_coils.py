"""Coils with drivers in flight: steps, errors, pulse-width modulation; bits, energy, attitude."""

import numpy as np
import pytest
from integrators import INTEGRATORS
from scipy.spatial.transform import Rotation

from torquer import Law, ScenarioError, resume, simulate
from torquer.analysis.spin_up import limit_text
from torquer.compile import engine
from torquer.simulation.lanes.group import why_not_in_lanes
from torquer.simulation.setup.run import prepare
from torquer.simulation.setup.size import estimate_size
from torquer.theory.averaged.sampling import sampling_by_differences

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")

WANTED = (0.3, -0.9, 1.6)
COILS = {"limit_a_m2": 2.0, "power_at_limit_w": 4.0}  # 1 W/(A m^2)^2
SHORT = {"duration_s": 60.0, "record_s": 1.0, "step_s": 1.0}


def flown(make, coils, wanted=lambda t_s: WANTED, **changes):
    """Result of a law that asks for a dipole, and what the computer knew."""
    seen = []

    def ask(inputs, parameters, memory):
        seen.append(inputs)
        return wanted(inputs.t_s)

    given = {"simulation": SHORT, "spacecraft.coils": COILS | coils}
    given |= {"control": {"law": {"kind": "off"}}} | changes
    return simulate(make(given), Law("ask", ask, compiled=False)), seen


def steps_of(integrator, **times):
    """Keys of a simulation by an integrator."""
    steps = {} if integrator == "auto" else {"step_s": 1.0}
    return {"integrator": integrator} | steps | times


def turned(one, other):
    """Angle [rad] between the last attitudes of two results."""
    first, second = (
        Rotation.from_quat(each["q_body_to_inertial"].values[-1]) for each in (one, other)
    )
    return float((first.inv() * second).magnitude())


def test_steps_and_dead_bands_act_and_the_computer_does_not_know(make):
    result, seen = flown(make, {"resolution_a_m2": 0.25, "dead_band_a_m2": (0.4, 0.4, 0.4)})
    assert np.array_equal(result.dipole_body.values, np.tile((0.0, -1.0, 1.5), (61, 1)))
    believed = np.array([inputs.coil_dipole_body_a_m2 for inputs in seen[1:]])
    assert np.array_equal(believed, np.tile(WANTED, (len(believed), 1)))
    assert float(result.coil_energy) == pytest.approx(60.0 * (1.0 + 2.25), rel=1e-12)


def test_errors_are_drawn_at_every_command_and_by_the_seed(make):
    result, _ = flown(make, {"random_error": 0.05})
    factors = result.dipole_body.values[:-1] / WANTED
    assert len(np.unique(factors)) == factors.size
    assert np.abs(factors - 1.0).max() < 0.3
    again, _ = flown(make, {"random_error": 0.05})
    other, _ = flown(make, {"random_error": 0.05}, seed=3)
    assert np.array_equal(result.dipole_body.values, again.dipole_body.values)
    assert not np.array_equal(result.dipole_body.values, other.dipole_body.values)


def test_an_error_lasts_until_the_next_command(make):
    """Failures that begin meanwhile act on the dipole as it is given."""
    failures = [{"coil": 2, "kind": "reversed", "from_s": 3.0, "until_s": 5.0}]
    control = {"law": {"kind": "off"}, "sample_s": 10.0}
    seen_each_s = {"spacecraft.gyro": {"sample_s": 1.0}}  # instants at which coils may fail
    coils = {"random_error": 0.05, "failures": failures}
    result, _ = flown(make, coils, control=control, **seen_each_s)
    dipole = result.dipole_body.values
    assert np.array_equal(np.unique(dipole[:10, 0]), dipole[:1, 0])
    assert np.array_equal(dipole[3:5, 2], -dipole[:2, 2])
    assert np.array_equal(dipole[5:10, 2], np.tile(dipole[0, 2], 5))
    assert dipole[10, 2] != dipole[0, 2]


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_modulation_tends_to_the_mean_dipole(make, integrator):
    """The error of the attitude is in proportion to the period, with every integrator."""
    simulation = steps_of(integrator, duration_s=300.0, record_s=10.0)
    mean, _ = flown(make, {}, simulation=simulation)
    errors = [
        turned(mean, flown(make, {"pwm_period_s": period}, simulation=simulation)[0])
        for period in (1.0, 0.5, 0.25, 0.125, 0.0625)
    ]
    slopes = np.diff(np.log(errors)) / np.diff(np.log([1.0, 0.5, 0.25, 0.125, 0.0625]))
    assert np.all(slopes > 0.9), (errors, slopes)
    off, _ = flown(make, {}, wanted=lambda t_s: (0.0, 0.0, 0.0), simulation=simulation)
    assert errors[-1] < 1e-3 * turned(mean, off)


def test_integrators_agree_on_what_is_switched(make):
    """Also with a lag, and periods that are no multiple of the step."""
    coils = {"pwm_period_s": 0.37, "lag_s": 0.05}
    times = {"duration_s": 300.0, "record_s": 10.0}
    ends = [flown(make, coils, simulation=steps_of(i, **times))[0] for i in INTEGRATORS]
    assert max(turned(ends[0], end) for end in ends[1:]) < 1e-6
    energies = [float(end.coil_energy) for end in ends]
    assert energies == pytest.approx([energies[0]] * len(energies), rel=1e-9)


def test_a_pulse_that_comes_later_brakes_less(make):
    """A law of differences, in a body that turns by 110 deg a period: short pulses from the reading
    on brake, those just before the next reading drive the rotation."""
    changed = {}
    for place in ("begin", "middle", "end"):
        scenario = make({
            "spacecraft.coils": {"limit_a_m2": 0.5, "pwm_period_s": 1.0, "pwm_place": place},
            "spacecraft.body.inertia_kg_m2": [0.01, 0.01, 0.01],
            "initial.rate_deg_s": [0.0, 0.0, 110.0],
            "control": {"law": {"kind": "bdot", "gain_a_m2_s_per_t": 3e3}, "sample_s": 1.0},
            "simulation": {"duration_s": 200.0, "record_s": 10.0},
        })  # fmt: skip
        omega = simulate(scenario)["omega_body"].values
        changed[place] = np.linalg.norm(omega[-1]) - np.linalg.norm(omega[0])
    assert changed["begin"] < 0.0 < changed["end"]
    assert changed["begin"] < changed["middle"] < changed["end"]


@pytest.mark.parametrize(
    ("place", "limit_deg_s"), [("begin", 180.0), ("middle", 90.0), ("end", 60.0)]
)
def test_short_pulses_brake_up_to_the_limit_of_their_place(make, place, limit_deg_s):
    """Below it they brake, above it they drive; whole periods brake up to 90 deg/s."""
    changed = []
    for part in (0.93, 1.07):
        rate = part * limit_deg_s
        scenario = make({
            "spacecraft.coils": {"limit_a_m2": 50.0, "pwm_period_s": 1.0, "pwm_place": place},
            "spacecraft.body.inertia_kg_m2": [0.01, 0.01, 0.01],
            "initial.rate_deg_s": [0.0, 0.0, rate],
            "control": {"law": {"kind": "bdot", "gain_a_m2_s_per_t": 3e3}, "sample_s": 1.0},
            "simulation": {"duration_s": 100.0, "record_s": 10.0},
        })  # fmt: skip
        omega = simulate(scenario)["omega_body"].values
        changed.append(np.linalg.norm(omega[-1]) - np.linalg.norm(omega[0]))
    assert changed[0] < 0.0 < changed[1]
    whole, short = sampling_by_differences(scenario).limits_rad_s
    assert np.degrees([whole, short]) == pytest.approx([90.0, limit_deg_s])
    text = limit_text(scenario, limit_deg_s)
    assert ("by short pulses" in text) == (place != "middle")
    assert text.endswith("up to 90 deg/s" if place == "middle" else f"up to {limit_deg_s:g} deg/s")


def test_the_energy_is_the_share_of_time_times_the_power_at_the_limit(make):
    result, _ = flown(make, {"pwm_period_s": 0.1})
    shares = np.abs(WANTED) / 2.0
    assert float(result.coil_energy) == pytest.approx(60.0 * 4.0 * shares.sum(), rel=1e-6)
    mean, _ = flown(make, {})
    assert float(mean.coil_energy) == pytest.approx(60.0 * 4.0 * (shares**2).sum(), rel=1e-9)
    assert float(result.peak_coil_dipole) == 2.0


def test_with_a_lag_dipoles_rise_and_fall_to_the_same_mean(make):
    """Of a square wave through a lag: the mean is kept, the energy is that of its square."""
    lag_s, period_s, share = 0.03, 0.1, 0.5
    result, _ = flown(
        make, {"pwm_period_s": period_s, "lag_s": lag_s}, lambda t_s: (0.0, 0.0, 2.0 * share)
    )
    # the periodic answer to a wave that is on for half of each period
    left = np.exp(-share * period_s / lag_s)
    high = 2.0 / (1.0 + left)
    t = (np.arange(20000) + 0.5) / 20000 * share * period_s
    rising = 2.0 + (high * left - 2.0) * np.exp(-t / lag_s)
    falling = high * np.exp(-t / lag_s)
    power = 0.5 * (np.mean(rising**2) + np.mean(falling**2))
    assert float(result.coil_energy) == pytest.approx(60.0 * power, rel=2e-3)
    assert float(result.peak_coil_dipole) == pytest.approx(high, rel=1e-3)


def test_readings_see_the_instant_and_the_computer_the_mean(make):
    """Where the period divides the time between readings, coils are off then."""
    sensor = {"spacecraft.magnetometer": {"coil_disturbance_nt_per_a_m2": 1e4}}
    result, seen = flown(make, {"pwm_period_s": 0.25}, **sensor)
    quiet, _ = flown(make, {"pwm_period_s": 0.25})
    assert np.array_equal(result["b_measured"].values, quiet["b_measured"].values)
    assert np.array_equal(result.dipole_body.values, np.zeros((61, 3)))
    believed = np.array([inputs.coil_dipole_body_a_m2 for inputs in seen[1:]])
    assert np.array_equal(believed, np.tile(WANTED, (len(believed), 1)))


def test_a_coil_that_is_always_on_is_one_that_is_not_switched(make):
    """Commands of the limit, or none: nothing is left to switch but the periods' beginnings."""
    always = {"wanted": lambda t_s: (2.0, 0.0, -2.0)}
    switched, _ = flown(make, {"pwm_period_s": 1.0}, **always)
    plain, _ = flown(make, {}, **always)
    assert turned(switched, plain) < 1e-12
    assert float(switched.coil_energy) == pytest.approx(float(plain.coil_energy), rel=1e-12)


def test_failures_act_on_the_mean(make):
    failures = [{"coil": 2, "kind": "dead", "from_s": 30.0}]
    result, _ = flown(make, {"pwm_period_s": 0.1, "failures": failures})
    shares = np.abs(WANTED) / 2.0
    expected = 30.0 * 4.0 * shares.sum() + 30.0 * 4.0 * shares[:2].sum()
    assert float(result.coil_energy) == pytest.approx(expected, rel=1e-6)


def test_wheels_may_die_while_coils_are_switched(make):
    """A motor that dies between two control steps dies at its time with adaptive steps, too."""
    wheels = {"layout": {"kind": "orthogonal"}, "momentum_limit_n_m_s": 1.0,
              "torque_limit_n_m": 0.02, "failures": [{"wheel": 1, "time_s": 33.0}]}  # fmt: skip
    hold = {"kind": "wheel_pd", "bandwidth_rad_s": 0.05, "reference": "inertial",
            "inertia_kg_m2": [1.0, 1.2, 1.5]}  # fmt: skip
    laws = {"hold": hold, "unload": {"kind": "unloading", "gain_per_s": 1e-3}}
    scenario = {
        "spacecraft.coils": COILS | {"pwm_period_s": 0.3}, "spacecraft.wheels": wheels,
        "control": {"laws": laws, "sample_s": 10.0},
        "initial": {"rate_deg_s": [0.1, 0.5, -0.3]},
    }  # fmt: skip
    times = {"duration_s": 100.0, "record_s": 10.0}
    adaptive = simulate(make(scenario | {"simulation": times}))
    fixed = simulate(make(scenario | {"simulation": times | {"step_s": 0.05}}))
    assert turned(adaptive, fixed) < 1e-4
    well = scenario | {"spacecraft.wheels": wheels | {"failures": []}, "simulation": times}
    assert turned(adaptive, simulate(make(well))) > 1e-3


DRIVERS = {
    "errors": {"random_error": 0.05, "resolution_a_m2": 0.1},
    "modulated": {"pwm_period_s": 0.3, "lag_s": 0.05, "random_error": 0.05},
}


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("name", DRIVERS)
def test_bits_do_not_depend_on_where_a_run_is_split(make, name, integrator):
    simulation = steps_of(integrator, duration_s=120.0, record_s=4.0)
    scenario = make({
        "spacecraft.coils": COILS | DRIVERS[name], "simulation": simulation,
        "control": {"law": {"kind": "bdot", "gain_a_m2_s_per_t": 1e6}, "sample_s": 2.0},
    })  # fmt: skip
    whole = simulate(scenario)
    part = simulate(scenario, until_s=22.0)
    for until_s in (23.0, 71.0, 120.0):
        part = resume(part, until_s=until_s)
    assert part.identical(whole)


def test_the_stated_computing_time_counts_the_switchings(make):
    plain = estimate_size(make({"spacecraft.coils": COILS})).computing_s
    for period_s in (0.1, 0.01):
        coils = COILS | {"pwm_period_s": period_s}
        more = estimate_size(make({"spacecraft.coils": coils})).computing_s - plain
        length_s = make({"spacecraft.coils": COILS}).length_s
        assert more == pytest.approx(1e-7 * 4 * length_s / period_s, rel=0.01)


def test_switched_coils_are_not_flown_in_lanes(make):
    law = {"kind": "bdot", "gain_a_m2_s_per_t": 1e6}
    run = prepare(make({"spacecraft.coils": COILS | {"pwm_period_s": 0.5}, "control.law": law}))
    assert why_not_in_lanes(run) == "they have coils driven by pulse-width modulation"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"control": {"law": {"kind": "off"}, "sample_s": 0.5}, "simulation.step_s": 0.5},
         "spacecraft.coils.pwm_period_s: must not exceed the 0.5 s for which a command is held; "
         "received 1 s"),
        ({"environment.table_tolerance": 0.0}, "environment.table_tolerance: must be above 0 with "
         "spacecraft.coils.pwm_period_s, whose switchings fall between the steps; received 0"),
    ],
)  # fmt: skip
def test_what_cannot_be_switched_is_refused(make, changes, message):
    with pytest.raises(ScenarioError) as found:
        make({"spacecraft.coils": COILS | {"pwm_period_s": 1.0}} | changes)
    assert message in str(found.value)
