"""Notes are advice: none of them ends a run, and none needs more than the run itself does."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from conftest import PLAIN, changed
from spellings import TLE

from torquer.analysis.notes import notes, orbit_notes
from torquer.analysis.notes.assess import UNEXPECTED, assess
from torquer.analysis.notes.notes import write_notes
from torquer.environment.along_orbit import OrbitEnvironment
from torquer.scenario.load import check_orbit_environment, load_scenario, scenario_from_data

EXAMPLES = sorted((Path(__file__).parents[3] / "examples").glob("*.toml"))
B_DOT = {"kind": "bdot", "gain_a_m2_s_per_t": 2e4}
SMALL = {"body": {"inertia_kg_m2": [0.03, 0.03, 0.01]}, "coils": {"limit_a_m2": 0.2}}
REST = {
    "spacecraft": SMALL,
    "environment": {"field": {"kind": "igrf14"}},
    "initial": {"rate_deg_s": [5.0, 3.0, -2.0]},
    "control": {"law": B_DOT, "sample_s": 1.0},
    "simulation": {"duration_s": 3000.0, "record_s": 10.0},
}
#: It ends before SGP4 does: 26 minutes later the elements have decayed.
LAST_HOUR = {"start": "2022-12-12T16:40:00Z", "orbit": {"kind": "sgp4", "tle": TLE}}


def given(changes):
    return scenario_from_data(changed(PLAIN, REST | changes))


def unassessed(scenario):
    return [note for note in write_notes(scenario) if "could not be assessed" in note]


def test_a_note_that_fails_is_a_note(monkeypatch):
    def breaks(scenario):
        yield "first"
        raise TypeError("no such key\nsecond line")

    def refuses(scenario):
        raise ValueError("must be otherwise")

    checks = {"the first": breaks, "the second": refuses, "the third": lambda scenario: ["third"]}
    monkeypatch.setattr(notes, "_CHECKS", checks)
    assert write_notes(given({})) == [
        "first",
        f"the first could not be assessed: {UNEXPECTED} TypeError (no such key)",
        "the second could not be assessed: must be otherwise",
        "third",
    ]


def test_an_interrupt_is_no_note():
    def interrupted():
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        list(assess({"it": interrupted}))


def test_what_overflows_within_a_note_says_nothing(recwarn):
    assert list(assess({"it": lambda: [f"{np.float64(1e308) * 10.0:g}"]})) == ["inf"]
    assert not recwarn


@pytest.mark.parametrize("kind", ["bdot", "bdot_rate", "nutation_damping"])
def test_a_run_that_ends_before_its_orbit_is_valid(kind):
    scenario = given(LAST_HOUR | {"control.law": B_DOT | {"kind": kind}})
    check_orbit_environment(scenario)
    assert unassessed(scenario) == []
    beyond = scenario.replace("simulation.duration_s", 6000.0)
    with pytest.raises(ValueError, match="sgp4: no orbit at t = 46"):
        check_orbit_environment(beyond)
    assert any("the time that the law takes" in note for note in unassessed(beyond)) == (
        kind.startswith("bdot")
    )


@pytest.mark.parametrize(
    ("field", "start"),
    [("igrf14", "2029-12-31T23:30:00Z"), ("wmm2025", "2029-12-31T23:30:00Z")],
)
def test_half_an_hour_before_the_field_model_ends_is_enough(field, start):
    last = {"start": start, "environment.field.kind": field, "simulation.duration_s": 1800.0}
    scenario = given(last)
    check_orbit_environment(scenario)
    assert unassessed(scenario) == []


@pytest.fixture
def asked(monkeypatch):
    """Times at which the orbit and the models along it are asked for."""
    times, state, dates = [], OrbitEnvironment.state, OrbitEnvironment.check_dates

    def noted_state(self, t_s):
        times.extend(np.ravel(t_s))
        return state(self, t_s)

    def noted_dates(self, *times_s):
        times.extend(times_s)
        return dates(self, *times_s)

    monkeypatch.setattr(OrbitEnvironment, "state", noted_state)
    monkeypatch.setattr(OrbitEnvironment, "check_dates", noted_dates)
    return times


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_notes_look_at_the_run_alone(asked, path):
    for duration_s in (None, 100.0):
        scenario = load_scenario(path)
        if duration_s is not None and scenario.mission is None:
            record = min(scenario.simulation.record_s, duration_s)
            short = {"duration_s": duration_s, "record_s": record}
            own = scenario.simulation.model_dump(exclude_unset=True) | {"revolutions": None}
            try:
                scenario = scenario.model_copy(update={"simulation": own | short})
            except ValueError:  # failures, say, that would be after the end
                continue
        asked.clear()
        assert unassessed(scenario) == []
        assert asked and min(asked) >= 0.0 and max(asked) <= scenario.length_s


# ------------------------------------------------------------------ orbits


ROUND = {"kind": "circular", "inclination_deg": 51.6}
OVAL = {"kind": "kepler", "inclination_deg": 51.6}
STATE = {"kind": "state_vector", "velocity_km_s": [0.0, 7.84, 0.0]}


def about_orbit(orbit, words, changes=()):
    """The notes with a word, on an orbit."""
    found = write_notes(given({"orbit": orbit, **dict(changes)}))
    return [note for note in found if words in note]


@pytest.mark.parametrize(
    ("orbit", "low"),
    [
        (ROUND | {"altitude_km": 100.0}, "altitude is 100 km"),
        (ROUND | {"radius_km": 6478.137}, "altitude is 100 km"),
        (OVAL | {"perigee_altitude_km": 100.0, "apogee_altitude_km": 300.0}, "perigee's altitude"),
        (OVAL | {"semi_major_axis_km": 6578.137, "eccentricity": 0.0152}, "perigee's altitude"),
        ({"kind": "numerical", "start": ROUND | {"altitude_km": 110.0}}, "altitude is 110 km"),
        ({"kind": "numerical", "start": STATE | {"position_km": [6480.0, 0.0, 0.0]}},
         "altitude is"),
        (ROUND | {"radius_km": 6878.137}, ""),
        (OVAL | {"perigee_altitude_km": 200.0, "apogee_altitude_km": 300.0}, ""),
        ({"kind": "numerical", "start": STATE | {"position_km": [6600.0, 0.0, 0.0]}}, ""),
        ({"kind": "bench", "latitude_deg": 50.0}, ""),
    ],
)  # fmt: skip
def test_a_low_perigee_is_noted_however_it_is_given(orbit, low):
    found = about_orbit(orbit, "below 120 km")
    assert len(found) == bool(low) and all(low in note for note in found)


@pytest.mark.parametrize(
    ("orbit", "words"),
    [
        (OVAL | {"perigee_altitude_km": 5e5, "apogee_altitude_km": 5.5e5},
         "perigee's altitude is 500000 km, far beyond the geostationary orbit's 35786 km, or is it "
         "500 km in metres?"),
        (OVAL | {"perigee_altitude_km": 500.0, "apogee_altitude_km": 5.5e5},
         "apogee's altitude is 550000 km, beyond the Moon, which would change such an orbit, or is "
         "it 550 km in metres?"),
        (ROUND | {"radius_km": 506378.137}, "altitude is 500000 km, far beyond"),
        (OVAL | {"semi_major_axis_km": 506378.137, "eccentricity": 0.0}, "altitude is 500000 km"),
        (OVAL | {"perigee_altitude_km": 1000.0, "apogee_altitude_km": 1.5e5}, ""),
        (ROUND | {"radius_km": 42164.0}, ""),
    ],
)  # fmt: skip
def test_heights_in_metres_are_noted_however_they_are_given(orbit, words):
    found = [note for note in about_orbit(orbit, "orbit: the ") if "altitude is" in note]
    assert len(found) == bool(words) and all(words in note for note in found)


@pytest.mark.parametrize(
    "orbit",
    [
        ROUND | {"radius_km": 6900.0},
        OVAL | {"semi_major_axis_km": 6900.0, "eccentricity": 0.001},
        {"kind": "numerical", "start": ROUND | {"altitude_km": 500.0}},
        {"kind": "numerical", "start": OVAL | {"semi_major_axis_km": 6900.0, "eccentricity": 0.0}},
    ],
)
def test_an_inclination_in_radians_is_noted_in_every_orbit(orbit):
    place = "start" if orbit["kind"] == "numerical" else ""
    tilted = orbit | ({place: orbit[place] | {"inclination_deg": 0.9}} if place else
                      {"inclination_deg": 0.9})  # fmt: skip
    assert len(about_orbit(tilted, "or is it 51.6 deg in radians?")) == 1
    assert about_orbit(orbit, "in radians") == []


SUN_SYNCHRONOUS = {"kind": "circular", "altitude_km": 600.0, "inclination_deg": 97.79}


def long_runs(orbit, words, days=60.0):
    length = {"simulation": {"duration_s": days * 86400.0, "record_s": 600.0}}
    return about_orbit(orbit, words, {"control.law": {"kind": "off"}, **length})


def test_two_months_on_two_body_orbits_are_noted_with_what_is_left_out():
    (note,) = long_runs(SUN_SYNCHRONOUS, "precess")
    assert "the plane by 0.99 deg a day, 59 deg in this run" in note
    assert long_runs(SUN_SYNCHRONOUS, "precess", 5.0) == []
    numerical = {"kind": "numerical", "start": SUN_SYNCHRONOUS}
    assert long_runs(numerical | {"degree": 2}, "precess", 15.0) == []
    (note,) = long_runs(numerical | {"degree": 0}, "precess", 15.0)
    assert "a numerical orbit of degree 0" in note
    bench = {"kind": "bench", "latitude_deg": 50.0}
    assert long_runs(bench, "precess") == []
    drifting = {"kind": "drifting", "altitude_km": 500.0, "ltan_h": 10.5}
    assert long_runs(drifting, "precess") == []
    (note,) = long_runs(drifting | {"altitude_km": 400.0}, "drag would take")
    assert "an orbit of kind 'drifting' has no drag" in note


def test_a_local_time_that_does_not_stay_is_noted_with_its_drift():
    """An orbit at 51.6 deg: its node goes back 5 deg a day, and the Sun on by 1 deg, 4 min each."""
    orbit = {"kind": "drifting", "altitude_km": 500.0, "ltan_h": 10.5}
    assert about_orbit(orbit, "local time") == []
    (note,) = about_orbit(orbit | {"inclination_deg": 51.6}, "local time")
    node = 2.06474e14 * 6878.137**-3.5 * math.cos(math.radians(51.6))  # deg a day, a in km
    a_day = -4.0 * (node + 0.985647)
    found = re.search(r"drifts by (\S+) min a day, 30 min in (\S+) h;", note)
    assert float(found[1]) == pytest.approx(a_day, rel=0.003)
    assert float(found[2]) / 24.0 == pytest.approx(30.0 / abs(a_day), rel=0.005)
    assert note.endswith("left out, it is the 97.402 deg of a Sun-synchronous orbit")
    assert about_orbit(orbit | {"inclination_deg": 97.4}, "local time") == []
    (note,) = about_orbit(orbit | {"inclination_deg": 98.5}, "local time")
    assert "drifts by +" in note
    by_node = {"kind": "drifting", "altitude_km": 500.0, "raan_deg": 5.0, "inclination_deg": 51.6}
    assert about_orbit(by_node, "local time") == []
    high = orbit | {"altitude_km": 20000.0, "inclination_deg": 98.0}
    (note,) = about_orbit(high, "local time")
    assert note.endswith("no orbit of this height is Sun-synchronous")


@pytest.mark.parametrize(
    ("inclination", "parts"),
    [(63.435, ["plane"]), (90.0, ["perigee"]), (51.6, ["plane", "perigee"])],
)
def test_the_apsides_turn_too(inclination, parts):
    """The plane of a polar orbit stays, and so does the perigee at the critical inclination."""
    orbit = OVAL | {"perigee_altitude_km": 500.0, "apogee_altitude_km": 1500.0,
                    "inclination_deg": inclination}  # fmt: skip
    (note,) = long_runs(orbit, "precess")
    assert [part for part in ("plane", "perigee") if f"the {part} by" in note] == parts


def test_precession_is_as_fast_as_in_a_numerical_orbit():
    """The turn that the note states against the flight under J2 itself."""
    (note,) = long_runs(SUN_SYNCHRONOUS, "precess")
    orbit = {"kind": "numerical", "start": SUN_SYNCHRONOUS, "degree": 2}
    environment = given({"orbit": orbit}).orbit_environment()
    r, v = environment.state(np.array([0.0, 10 * 86400.0]))
    normal = np.cross(r, v)
    nodes = np.degrees(np.arctan2(normal[:, 0], -normal[:, 1]))
    assert abs(float(note.split("the plane by ")[1].split()[0])) == pytest.approx(
        (nodes[1] - nodes[0]) / 10.0, rel=0.02
    )


def test_a_descent_that_is_left_out_is_noted():
    """Vallado's table at 300 km: 2.4e-11 kg/m^3, so 2.4e-11 sqrt(mu a) 0.02 = 0.025 m/s."""
    (note,) = long_runs(ROUND | {"altitude_km": 300.0}, "no drag", 15.0)
    assert "at a height of 300 km drag would take about 32 km" in note
    assert "all of its height" in long_runs(ROUND | {"radius_km": 6628.137}, "no drag", 60.0)[0]
    assert long_runs(ROUND | {"altitude_km": 300.0}, "no drag", 5.0) == []
    assert long_runs(SUN_SYNCHRONOUS, "no drag") == []
    start = ROUND | {"altitude_km": 300.0}
    drag = {"mass_kg": 10.0, "area_m2": 0.1, "atmosphere": {"kind": "exponential"}}
    assert len(long_runs({"kind": "numerical", "start": start}, "no drag", 15.0)) == 1
    assert long_runs({"kind": "numerical", "start": start, "drag": drag}, "no drag", 15.0) == []


def test_an_orbit_that_does_not_last_is_noted_however_short_the_run():
    """From 200 km it is a day or two, from 250 km a week; satellites at 350 km stay for months."""
    (note,) = long_runs(ROUND | {"altitude_km": 200.0}, "no drag", 0.1)
    assert "down from 200 km within about 24 h:" in note
    assert long_runs(ROUND | {"altitude_km": 350.0}, "no drag", 0.1) == []


ISS = (
    "1 25544U 98067A   24080.50000000  .00016717  00000-0  10270-3 0  9002",
    "2 25544  51.6400 208.9163 0006317  69.9862  25.2906 15.49560000    05",
)


def with_checksums(lines):
    from torquer.environment.orbit.sgp4 import checksum

    return [f"{line[:68]}{checksum(line)}" for line in lines]


@pytest.mark.parametrize(
    ("start", "days", "words"),
    [
        ("2024-03-21T00:00:00Z", 1.0, ""),
        ("2024-04-11T12:00:00Z", 1.0, "the start is 22 days after the epoch"),
        ("2024-03-21T00:00:00Z", 20.0, "the end is 20 days after the epoch"),
        ("2024-02-20T12:00:00Z", 1.0, "the start is 29 days before the epoch"),
    ],
)
@pytest.mark.parametrize("kind", ["sgp4", "numerical"])
def test_old_elements_are_noted_at_both_ends(kind, start, days, words):
    elements = {"kind": "sgp4", "tle": with_checksums(ISS)}
    orbit = elements if kind == "sgp4" else {"kind": "numerical", "start": elements, "degree": 2}
    length = {"simulation": {"duration_s": days * 86400.0, "record_s": 600.0}}
    found = about_orbit(orbit, "epoch of the two-line", {"start": start, **length})
    assert len(found) == bool(words) and all(words in note for note in found)


def test_every_check_of_orbits_has_its_words():
    assert all(what.startswith("the ") for what in orbit_notes._CHECKS)
