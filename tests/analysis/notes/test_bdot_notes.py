"""Notes on B-dot and its relatives: rates beyond sampling and lag, gains, the coils' own dipole."""

import math

import numpy as np
import pytest
from spellings import TLE

from torquer import simulate
from torquer.analysis.notes import bdot_notes as bdot_module
from torquer.analysis.notes.bdot_notes import as_flown, as_tumbling
from torquer.analysis.notes.notes import write_notes
from torquer.compile import engine
from torquer.theory.slow.detumbling import detumbling_time_s, mean_turning_rad_s
from torquer.theory.slow.gains import bdot_greatest_gain, damping_efficiency, sampling_limit_rad_s

WINDOW = {"control.sample_s": 3.0, "control.measure_s": 6.0, "control.actuate_s": 3.0,
          "simulation.step_s": 0.5}  # fmt: skip
HELD = {"control.sample_s": 2.0, "spacecraft.coils.lag_s": 0.5}


def law(kind="bdot", gain=3e5, **more):
    return {"control.law": {"kind": kind, "gain_a_m2_s_per_t": gain, **more}}


def rate(deg_s):
    return {"initial.rate_deg_s": [0.0, deg_s, 0.0]}


@pytest.fixture
def notes_with(make):
    """Notes of the plain scenario with changes, but for those on the length of the step."""
    return lambda *changes: [
        note
        for note in write_notes(make({k: v for each in changes for k, v in each.items()}))
        if "within one step" not in note and "RK4 with a step of" not in note
    ]


def test_rate_above_limit_is_reported_with_the_rate_it_reaches(notes_with):
    assert notes_with(law()) == []
    (note,) = notes_with(law(), WINDOW, rate(31.0))
    assert note == (
        "the initial rate of 31 deg/s is above the 30 deg/s that B-dot can brake with differences "
        "over 3 s held for 3 s: the law will drive the rotation, a steady one up to 90 deg/s"
    )
    assert notes_with(law(), WINDOW, rate(25.0)) == []
    (note,) = notes_with(law(), WINDOW, rate(95.0))
    assert note.endswith(": the law will not stop the rotation")


def test_the_lag_of_the_coils_counts(notes_with):
    """A rate that B-dot brakes with coils without lag, and drives with these."""
    (note,) = notes_with(law(), HELD, rate(40.0))
    assert note == (
        "the initial rate of 40 deg/s is above the 36.2 deg/s that B-dot can brake with "
        "differences over 2 s held for 2 s by coils with a lag of 0.5 s: the law will drive the "
        "rotation, a steady one up to 113 deg/s"
    )
    assert notes_with(law(), HELD, rate(30.0)) == []


def test_near_the_limit_the_braking_that_is_left_is_reported(notes_with):
    (note,) = notes_with(law(), HELD, rate(35.0))
    left = 100.0 * damping_efficiency(math.radians(35.0), 2.0, 2.0, 0.5)
    assert "35 deg/s is near the 36.2 deg/s that B-dot can brake" in note
    assert note.endswith(f": {left:.2g} % of its damping is left, perhaps none for a nutating body")


@pytest.mark.parametrize(
    ("kind", "words"),
    [("bdot", "differences over 2 s held"), ("bdot_rate", "readings held"),
     ("bdot_derivative", "readings held"), ("bdot_model", "readings held")],
)  # fmt: skip
def test_every_form_of_b_dot_has_its_limit(notes_with, kind, words):
    limit = sampling_limit_rad_s(2.0 if kind == "bdot" else 0.0, 2.0, 0.5)
    (note,) = notes_with(law(kind), HELD, rate(1.02 * math.degrees(limit)))
    assert f"above the {math.degrees(limit):.3g} deg/s that B-dot can brake with {words}" in note
    assert notes_with(law(kind), HELD, rate(0.8 * math.degrees(limit))) == []


@pytest.mark.parametrize(
    ("magnetometer", "times", "words"),
    [
        ({"sample_s": 0.5, "delay_s": 0.5}, (2.0, 2.0, 0.5, 0.5), "2 s, 0.5 s old, held for 2 s"),
        ({"sample_s": 2.0, "delay_s": 1.0}, (2.0, 2.0, 0.5, 2.0), "2 s, 2 s old, held for 2 s"),
        ({"sample_s": 4.0}, (4.0, 4.0, 0.5, 0.0), "4 s held for 4 s"),
        ({"sample_s": 1.0}, (2.0, 2.0, 0.5, 0.0), "2 s held for 2 s"),
        ({"sample_s": 3.0}, (3.0, 4.0, 0.5, 1.0), "3 s, 1 s old, held for 4 s"),
    ],
)
def test_the_magnetometers_own_rate_and_delay_count(notes_with, magnetometer, times, words):
    """Readings every 3 s, control every 2 s: at 4 s the one of 3 s is known, held until 6 s."""
    own = {"spacecraft.magnetometer": magnetometer, "simulation.step_s": 0.5}
    limit = math.degrees(sampling_limit_rad_s(*times))
    (note,) = notes_with(law(), HELD, own, rate(1.02 * limit))
    assert f"above the {limit:.3g} deg/s that B-dot can brake with differences over {words}" in note
    assert notes_with(law(), HELD, own, rate(0.8 * limit)) == []


def test_late_readings_in_a_measurement_window(notes_with):
    """Readings every 3 s reach the computer 2 s later: at the window's end, 6 s, those of 0 and
    3 s are known."""
    own = {"spacecraft.magnetometer": {"sample_s": 3.0, "delay_s": 2.0}}
    limit = math.degrees(sampling_limit_rad_s(3.0, 3.0, 0.0, 3.0))
    (note,) = notes_with(law(), WINDOW, own, rate(1.02 * limit))
    assert "differences over 3 s, 3 s old, held for 3 s" in note


def test_mode_laws_are_reported_by_name_with_their_greatest_gain(make, notes_with):
    """The first works at the start; the gain of the second is set, and its command multiplied."""
    least = float(make().spacecraft.body.principal()[0][0])
    greatest = bdot_greatest_gain(least, 5e-5, 2.0, lag_s=0.5)

    def modes(gain, factor):
        to_second = [{"to": "second", "at_most_s": 60.0}]
        states = {
            "first": {"laws": ["first"], "transitions": to_second},
            "second": {"laws": {"second": factor}, "set": {"second.gain": gain}, "final": True},
        }
        laws = {name: law()["control.law"] for name in states}
        control = {"laws": laws, "modes": {"states": states}, "sample_s": 2.0}
        return {"control": control, "spacecraft.coils.lag_s": 0.5}

    rated, gained = notes_with(modes(0.26 * greatest, 4.0), rate(40.0))
    assert rated.startswith("first: the initial rate of 40 deg/s is above the 36.2 deg/s")
    assert gained.startswith(f"second: the gain of {1.04 * greatest:.3g} A m^2 s/T is above")
    assert notes_with(modes(0.24 * greatest, 4.0), rate(10.0)) == []


@pytest.mark.parametrize("kind", ["nutation_damping", "nutation_damping_rate",
                                  "nutation_damping_derivative"])  # fmt: skip
def test_nutation_damping_gets_a_note_about_precession(notes_with, kind):
    round_body = {"spacecraft.body.inertia_kg_m2": [2.0, 2.0, 1.0], "simulation.step_s": 0.5}
    limit = sampling_limit_rad_s(2.0 if kind == "nutation_damping" else 0.0, 2.0, 0.5)
    spin = {"initial.rate_deg_s": [0.0, 0.0, 2.0 * 1.02 * math.degrees(limit)]}  # L/A: half of it
    (note,) = notes_with(law(kind), HELD, round_body, spin)
    assert note.startswith(f"the initial precession of {1.02 * math.degrees(limit):.3g} deg/s is ")
    assert note.endswith(": the law will drive the nutation")
    spin = {"initial.rate_deg_s": [0.0, 0.0, 1.6 * math.degrees(limit)]}
    assert notes_with(law(kind), HELD, round_body, spin) == []


def test_only_the_first_laws_of_a_scheme_are_reported(notes_with):
    first = {"kind": "bdot", "gain_a_m2_s_per_t": 1e4}
    until = {"until": {"at_most_s": 100.0}}
    scheme = {"control.law": {"kind": "scheme", "stages": [{"laws": [first], **until}]}}
    assert len(notes_with(scheme, HELD, rate(40.0))) == 1
    stages = [{"laws": [{"kind": "off"}], **until}, {"laws": [first]}]
    assert notes_with({"control.law": {"kind": "scheme", "stages": stages}}, HELD, rate(40.0)) == []


def test_orbital_frame_rate_counts_as_an_absolute_one(notes_with):
    """Along the orbit normal, X2, the orbital rate adds; the other way it takes off."""
    limit = math.degrees(sampling_limit_rad_s(2.0, 2.0, 0.5))
    frame = {"initial.euler_deg": [0.0] * 3, "initial.reference": "orbital",
             "initial.rate_relative_to": "orbital"}  # fmt: skip
    for sign, side in ((1.0, "above"), (-1.0, "near")):
        (note,) = notes_with(law(), HELD, frame, rate(sign * limit))
        assert f"deg/s is {side} the" in note


def test_too_low_gain_is_reported_from_one_e_fold_daily(make, notes_with):
    least = float(make().spacecraft.body.principal()[0][0])
    weakest = least / (86400.0 * 5e-5**2)
    (note,) = notes_with(law(gain=1.01 * weakest))
    assert "at most 0.12 % of the coils' limit" in note and "with 24 h allowed" in note
    (note,) = notes_with(law(gain=0.99 * weakest))
    assert note.startswith(f"the gain of {0.99 * weakest:.3g} A m^2 s/T takes 24.2 h or more")
    (note,) = notes_with(law(gain=1.01 * weakest), WINDOW)  # coils act for a third of the time
    assert "takes 71.3 h or more" in note


def test_designs_take_a_day_a_revolution_or_what_is_left(make):
    """Of an orbit that SGP4 ends 4568 s after the start, and half an hour before 2030."""
    decaying = {"start": "2022-12-12T16:40:00Z", "orbit": {"kind": "sgp4", "tle": TLE},
                "environment.field": {"kind": "igrf14"}, **law()}  # fmt: skip
    scenario = make(decaying)
    left, flown = (f(scenario, scenario.control.law).fields_t for f in (as_tumbling, as_flown))
    assert np.array_equal(left, flown)
    plain = make({"environment.field": {"kind": "igrf14"}, **law()})
    day, run = (f(plain, plain.control.law).fields_t for f in (as_tumbling, as_flown))
    assert day.max() / day.min() > run.max() / run.min() > 1.0
    last = make({"start": "2029-12-31T23:30:00Z", **law(), "environment.field": {"kind": "igrf14"}})
    assert (as_tumbling(last, last.control.law).fields_t > 1e-5).all()


def test_gain_that_idles_the_coils_and_brakes_late_is_noted(make, notes_with):
    """Ten times the gain is ten times as fast here: the coils stay below their limits."""
    goal = {"simulation.duration_s": 18000.0, "mission": {"rate_below_deg_s": 0.3}}
    scenario = make(law(gain=1e5) | goal)
    omega = np.radians(scenario.initial.rate_deg_s)
    case = as_flown(scenario, scenario.control.law)
    needed_s = detumbling_time_s(case, 1e5, float(np.linalg.norm(omega)), math.radians(0.3))
    assert needed_s > 18000.0
    (note,) = notes_with(law(gain=1e5), goal)
    assert f"takes about {needed_s / 3600.0:.3g} h to brake to 0.3 deg/s, with 5 h allowed" in note
    assert notes_with(law(gain=1e6), goal) == []


@pytest.mark.parametrize(
    ("changes", "times"),
    [
        ({}, {"hold_s": 1.0}),
        (HELD, {"hold_s": 2.0, "lag_s": 0.5}),
        (WINDOW | {"spacecraft.coils.lag_s": 2.0}, {"hold_s": 3.0, "lag_s": 2.0, "measure_s": 6.0}),
    ],
)
@pytest.mark.parametrize("kind", ["bdot", "bdot_rate"])
def test_too_high_a_gain_is_reported(make, notes_with, changes, times, kind):
    least = float(make().spacecraft.body.principal()[0][0])
    difference_s = changes.get("control.sample_s", 1.0) if kind == "bdot" else 0.0
    greatest = bdot_greatest_gain(least, 5e-5, difference_s=difference_s, **times)
    assert notes_with(law(kind, 0.99 * greatest), changes) == []
    (note,) = notes_with(law(kind, 1.01 * greatest), changes)
    assert note.startswith(f"the gain of {1.01 * greatest:.3g} A m^2 s/T is above {greatest:.3g}, ")
    assert note.endswith("overshoots in a field of 50000 nT")
    assert ("by coils with a lag" in note) == ("lag_s" in times)


def test_the_coils_own_dipole_in_the_readings_is_reported(notes_with):
    disturbed = {"spacecraft.magnetometer.coil_disturbance_nt_per_a_m2": 500.0}
    strong = law(gain=2e5)
    (note,) = notes_with(strong, disturbed)  # k c / d = 2e5 * 5e-7 / 1
    assert note == (
        "the magnetometer reads the coils' own dipole: 0.1 of it returns in the next command, "
        "which the limit stated for B-dot does not include"
    )
    assert notes_with(strong, disturbed, WINDOW) == []  # off, and without lag
    (note,) = notes_with(law(gain=2e6), disturbed, WINDOW, {"spacecraft.coils.lag_s": 3.0})
    back = (np.exp(-1.0) - np.exp(-2.0)) / 3.0  # between the last two readings, 3 s and 6 s late
    assert f"own dipole: {2e6 * 5e-7 * back:.2g} of it" in note
    assert notes_with(strong, disturbed, WINDOW, {"spacecraft.coils.lag_s": 1e-3}) == []
    assert notes_with(law("bdot_derivative", 2e5), disturbed) == []
    assert notes_with(law("bdot_rate", 2e5), disturbed, rate(10.0)) == []  # k c omega
    assert "own dipole: 0.087 of it" in notes_with(law("bdot_rate", 1e6), disturbed, rate(10.0))[0]


def spectrum(polar, share, rate_rad_s):
    """(weight, frequency) of a field normal to the momentum, in an axisymmetric body in nutation.

    C/A = `share`; the rate is at the angle `polar` to the axis. The attitude is a turn by the
    precession about the momentum and one by the body's own spin about its axis.
    """
    along, across = rate_rad_s * np.cos(polar), rate_rad_s * np.sin(polar)
    momentum = np.hypot(across, share * along)
    c, spin = share * along / momentum, along * (1.0 - share)
    return ((1 + c) ** 2 / 2, spin + momentum), ((1 - c) ** 2 / 2, spin - momentum), (
        1 - c * c, momentum
    )  # fmt: skip


def test_what_is_reported_as_safe_is_braked_in_nutation_too():
    """At 0.85 of the limit every axisymmetric body loses energy, whatever its nutation."""
    least = math.inf
    for times in ((2.0, 2.0, 0.0), (2.0, 2.0, 0.5), (0.0, 2.0, 0.5), (1.0, 6.0, 0.0)):
        for share in (1e-3, 0.01, 0.1, 0.3, 0.6, 0.9, 1.3, 1.7, 2.0):
            for polar in np.radians(np.arange(1.0, 90.0, 2.0)):
                parts = spectrum(polar, share, 0.85 * sampling_limit_rad_s(*times))
                power = sum(p * f**2 * damping_efficiency(f, *times) for p, f in parts)
                least = min(least, power / sum(p * f**2 for p, f in parts))
    assert 0.0 < least < 0.05  # so the margin is not a wasteful one


def test_coils_that_follow_no_command_have_no_gain_limit(notes_with):
    """Beyond 1e9 holds the map of a cycle is rounding: no note on the gain, and no error either."""
    slow = {"spacecraft.coils.lag_s": 1e10, "initial.rate_deg_s": [0.0, 0.0, 0.0]}
    (note,) = notes_with(law(), slow)
    assert note.startswith("spacecraft.coils.lag_s of 1e+10 s is longer than the 1 s")


def test_nutation_damping_precession_includes_the_wheel_momentum(notes_with):
    wheels = {"layout": {"kind": "orthogonal"}, "momentum_limit_n_m_s": 20.0,
              "torque_limit_n_m": 0.1, "speed_limit_rpm": 6000.0,
              "initial_speed_rpm": [0.0, 0.0, 360.0]}  # fmt: skip
    body = {"spacecraft.body.inertia_kg_m2": [2.0, 2.0, 1.0], "simulation.step_s": 0.1}
    rest = {"initial.rate_deg_s": [0.0, 0.0, 0.0], "spacecraft.wheels": wheels}
    (note,) = [
        n for n in notes_with(law("nutation_damping"), HELD, body, rest) if "precession" in n
    ]
    assert note.startswith(f"the initial precession of {math.degrees(1.2 / 2.0):.3g} deg/s is near")


@pytest.mark.parametrize(
    ("inclination", "told"), [(0.0, True), (15.0, True), (30.0, False), (97.5, False)]
)
def test_an_orbit_along_which_the_field_hardly_turns(notes_with, inclination, told):
    """The mean over directions says 16 h at 0 deg, where 7 of 8 flights last over 48 h."""
    day = {"simulation.duration_s": 86400.0}
    orbit = {"orbit": {"kind": "circular", "altitude_km": 500.0, "inclination_deg": inclination}}
    found = [note for note in notes_with(law(), orbit, day) if "field hardly turns" in note]
    assert len(found) == told
    short = {"simulation.duration_s": 600.0}
    assert not any("hardly turns" in note for note in notes_with(law(), orbit, short))


@pytest.mark.parametrize(
    ("below", "told"), [(0.03, True), (0.1, True), (0.14, False), (0.3, False)]
)
def test_a_rate_below_the_fields_own_turning_is_not_kept(notes_with, below, told):
    """At 97.5 deg the field turns by 0.125 deg/s on average: B-dot brakes relative to it."""
    orbit = {"orbit": {"kind": "circular", "altitude_km": 500.0, "inclination_deg": 97.5},
             "environment.field": {"kind": "igrf14"}}  # fmt: skip
    mission = {"mission": {"rate_below_deg_s": below}, "simulation.duration_s": 86400.0}
    found = [note for note in notes_with(law(), orbit, mission) if "hardly be kept" in note]
    assert len(found) == told
    if told:
        assert found[0] == (
            f"mission.rate_below_deg_s of {below:g} deg/s will hardly be kept: B-dot brakes "
            "relative to the field, and keeps the rate near the field's turning, here 0.13 deg/s "
            "on average"
        )


def test_a_field_at_rest_has_no_turning_to_stay_near(make):
    """Of one field vector the rate of turning is zero, and every wanted rate lies above it."""
    scenario = make({**law(), "mission": {"rate_below_deg_s": 0.1}})
    with pytest.MonkeyPatch.context() as patched:
        for field in (np.full((300, 3), 2e-5), np.zeros((300, 3))):
            patched.setattr(bdot_module, "_fields_inertial_t", lambda *_, b=field: b)
            with np.errstate(invalid="ignore"):
                assert list(bdot_module._turning_notes(scenario)) == []


def test_the_mean_turning_of_a_field():
    """Of one that turns evenly it is its rate, whatever its strength."""
    turned = 2e-3 * 10.0 * np.arange(200)
    field = np.stack([np.cos(turned), np.sin(turned), 0.0 * turned], axis=1)
    field *= (3e-5 * (1.0 + 0.3 * np.sin(turned)))[:, None]
    assert mean_turning_rad_s(field, 10.0) == pytest.approx(2e-3)


@pytest.mark.skipif(not engine.COMPILED, reason="whole flights: minutes without JIT")
@pytest.mark.parametrize("inclination", [0.0, 30.0, 97.0])
def test_bdot_keeps_a_satellite_near_the_fields_turning(make, inclination):
    """The trial of the bound: from a slow start, the mean rate from the ninth revolution on."""
    orbit = {"kind": "circular", "altitude_km": 500.0, "inclination_deg": inclination}
    scenario = make({
        "orbit": orbit, "environment.field": {"kind": "igrf14"}, **law(gain=3e4),
        "spacecraft.body": {"inertia_kg_m2": [0.05, 0.04, 0.03]}, "control.sample_s": 2.0,
        "spacecraft.coils": {"limit_a_m2": 0.2}, "initial.rate_deg_s": [0.2, 0.05, 0.02],
        "simulation": {"duration_s": 16.0 * 5677.0, "record_s": 30.0},
    })  # fmt: skip
    rate = np.linalg.norm(simulate(scenario)["omega_body"].values, axis=1)
    along, times = scenario.orbit_environment(), np.arange(0.0, 86400.0, 30.0)
    turning = mean_turning_rad_s(along.field(times, *along.state(times)), 30.0)
    assert 0.94 < rate[len(rate) // 2 :].mean() / turning < 3.1
