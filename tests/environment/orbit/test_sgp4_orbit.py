"""SGP4 orbits: against the package itself and skyfield, and every check of an element set."""

import pickle
from datetime import timedelta
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import sgp4
from sgp4.api import Satrec, jday
from skyfield.api import EarthSatellite, load

from torquer.base.explain import ScenarioError
from torquer.base.time import parse_utc
from torquer.environment.earth.rotation import teme_to_gcrf
from torquer.environment.orbit import Sgp4
from torquer.environment.orbit.numerical import tle_epoch
from torquer.environment.orbit.sgp4 import checksum

CHIBIS = (
    "1 38051U 11062C   12058.91450162  .00007227  00000-0  32146-3 0  1024",
    "2 38051  51.6521 324.5583 0011559   6.4829  88.0894 15.22465494  5160",
)
#: The first test case of the revised SGP4 report: state at the epoch, km and km/s.
VANGUARD = (
    "1 00005U 58002B   00179.78495062  .00000023  00000-0  28098-4 0  4753",
    "2 00005  34.2682 348.7242 1859667 331.7664  19.3264 10.82419157413667",
)
START = "2012-03-04T10:31:47Z"
TIMES = np.arange(0.0, 3600.0, 50.0)


def test_state_equals_the_published_verification_case():
    epoch = parse_utc("2000-01-01T00:00:00Z") + timedelta(days=178.78495062)
    r, v = Sgp4(tle=VANGUARD).state([0.0, 360.0 * 60.0], epoch)
    expected_r = [[7022.46529266, -1400.08296755, 0.03995155],
                  [-7154.03120202, -3783.17682504, -3536.19412294]]  # fmt: skip
    expected_v = [[1.893841015, 6.405893759, 4.534807250],
                  [4.741887409, -4.151817765, -2.093935425]]  # fmt: skip
    assert np.abs(r / 1e3 - expected_r).max() < 1e-4  # the epoch is rounded to a microsecond
    assert np.abs(v / 1e3 - expected_v).max() < 1e-7


def test_state_equals_the_package_one_by_one():
    r, v = Sgp4(tle=CHIBIS).state(TIMES, START)
    satellite = Satrec.twoline2rv(*CHIBIS)
    for k in (0, 17, 71):
        moment = parse_utc(START) + timedelta(seconds=TIMES[k])
        day, fraction = jday(*moment.timetuple()[:6])
        code, r_km, v_km_s = satellite.sgp4(day, fraction)
        assert code == 0
        assert np.abs(r[k] - 1e3 * np.array(r_km)).max() < 1e-2
        assert np.abs(v[k] - 1e3 * np.array(v_km_s)).max() < 1e-5


def test_state_in_gcrf_equals_skyfield():
    # UT1 = UTC, as here: TT - UT1 = 32.184 s + 34 leap seconds
    scale = load.timescale(builtin=True, delta_t=32.184 + 34.0)
    satellite = EarthSatellite(*CHIBIS, "Chibis-M", scale)
    seconds = 47.0 + TIMES
    theirs = satellite.at(scale.utc(2012, 3, 4, 10, 31, seconds))
    r, v = Sgp4(tle=CHIBIS).state(TIMES, START)
    turn = teme_to_gcrf(TIMES, START)
    assert np.abs((turn @ r[..., None])[..., 0] - theirs.position.m.T).max() < 0.1
    assert np.abs((turn @ v[..., None])[..., 0] - theirs.velocity.m_per_s.T).max() < 1e-3


def test_velocity_is_the_derivative_of_position():
    orbit = Sgp4(tle=CHIBIS)
    before, after = (orbit.state(TIMES + s, START)[0] for s in (-1.0, 1.0))
    # SGP4's velocity leaves out slow terms of its own theory
    assert np.abs((after - before) / 2.0 - orbit.state(TIMES, START)[1]).max() < 0.1


def test_rate_period_and_frame():
    orbit = Sgp4(tle=CHIBIS)
    assert orbit.rate_rad_s(START) == pytest.approx(15.22465494 * 2 * np.pi / 86400.0, rel=1e-14)
    assert orbit.period_s == pytest.approx(86400.0 / 15.22465494, rel=1e-14)
    assert orbit.frame == "TEME"


def test_a_name_line_blank_lines_and_one_text_are_accepted():
    plain = Sgp4(tle=CHIBIS)
    assert Sgp4(tle=("CHIBIS-M", *CHIBIS)) == plain
    assert Sgp4(tle="\nCHIBIS-M\n" + "  \n".join(CHIBIS) + "\n") == plain
    assert pickle.loads(pickle.dumps(plain)) == plain
    assert Sgp4(**plain.model_dump()) == plain


def changed(line: str, column: int, text: str) -> str:
    """The line with text from a column (from 1) on, and its checksum set right."""
    head = (line[: column - 1] + text + line[column - 1 + len(text) :])[:68]
    return head + str(checksum(head))


def refusal(*lines) -> str:
    with pytest.raises(ScenarioError) as error:
        Sgp4(tle=lines)
    return str(error.value).replace("tle: tle line", "tle line")


ONE, TWO = CHIBIS


@pytest.mark.parametrize(
    ("lines", "message"),
    (
        ((ONE[:-1] + "5", TWO), "tle line 1: checksum must be 4; received 5"),
        ((ONE, TWO[:-1] + "1"), "tle line 2: checksum must be 0; received 1"),
        (
            (ONE[:60] + ONE[61:], TWO),
            "tle line 1: must have 69 columns; received 68, and columns 54-61 are not the drag "
            "term: ' 32146- '",
        ),
        (
            (ONE[:-1], TWO),
            "tle line 1: must have 69 columns; received 68, without the checksum (column 69), "
            "which would be 4; orbit.without_checksums = true does without",
        ),
        (
            (ONE, TWO[:-1]),
            "tle line 2: must have 69 columns; received 68, without the checksum (column 69), "
            "which would be 0; orbit.without_checksums = true does without",
        ),
        (
            (ONE[:63], TWO),
            "tle line 1: must have 69 columns; received 63, without the element set number "
            "(columns 65-68) and the checksum (column 69)",
        ),
        (
            (ONE, TWO[:66]),
            "tle line 2: must have 69 columns; received 66, without the revolution number "
            "(columns 64-68) and the checksum (column 69)",
        ),
        (
            (ONE[:9] + ONE[10:-1], TWO),
            "tle line 1: must have 69 columns; received 67, and columns 10-17 are not the "
            "designator: '1062C   '",
        ),
        ((ONE, TWO[:7]), "tle line 2: must have 69 columns; received 7, without the inclination "),
        ((TWO, ONE), "tle line 1: column 1 must hold the line number; received '2'"),
        ((ONE, "3" + TWO[1:]), "tle line 2: column 1 must hold the line number; received '3'"),
        (
            (ONE, changed(TWO, 9, "51.6521 ")),
            "tle line 2: columns 9-16 must hold the inclination; received '51.6521 '",
        ),
        ((ONE, changed(TWO, 17, "9")), "tle line 2: column 17 must be blank; received '9'"),
        (
            (ONE, changed(TWO, 27, "0.00115")),
            "tle line 2: columns 27-33 must hold the eccentricity; received '0.00115'",
        ),
        (
            (changed(ONE, 19, "1205x.91450162"), TWO),
            "tle line 1: columns 19-32 must hold the epoch; received '1205x.91450162'",
        ),
        (
            (changed(ONE, 54, " 32146e3"), TWO),
            "tle line 1: columns 54-61 must hold the drag term; received ' 32146e3'",
        ),
        (
            (ONE, changed(TWO, 3, "38052")),
            "tle: catalogue number must be the same in both lines; received '38051' and '38052'",
        ),
        (
            (ONE, changed(TWO, 9, "181.0000")),
            "tle line 2: inclination must lie in 0..180; received 181",
        ),
        (
            (ONE, changed(TWO, 44, "360.5000")),
            "tle line 2: mean anomaly must lie in 0..360; received 360.5",
        ),
        (
            (changed(ONE, 19, "12000.50000000"), TWO),
            "tle line 1: epoch day must lie in 1..367; received 0.5",
        ),
        (
            (ONE, changed(TWO, 53, " 0.00000000")),
            "tle line 2: mean motion must be positive; received 0 rev/day",
        ),
        (
            (ONE, changed(TWO, 53, " 0.00100000")),
            "tle: its orbit must stay within 1500000 km of the Earth's centre, its Hill sphere; "
            "received one that goes out to 4.22899e+06 km",
        ),
        ((ONE,), "tle: must have two lines, or three with a name; received 1"),
    ),
)
def test_a_bad_element_set_is_one_clear_line(lines, message):
    first = refusal(*lines).splitlines()[0]
    assert first.startswith(message) if message.endswith(" ") else first == message


def test_archived_lines_without_a_checksum_are_right_with_the_digit_that_is_stated():
    archived = (
        "1 00058U 60013A   97142.85906518  .00000093  00000-0 +10762-4 0  274",
        "2 00058 028.3286 356.4726 0164991 158.6392 202.1128 13.4602145880282",
    )
    faults = refusal(*archived).splitlines()
    ends = [fault.partition("which would be ")[2].partition(";")[0] for fault in faults]
    assert len(faults) == 2 and all(len(end) == 1 for end in ends)
    orbit = Sgp4(tle=[line + end for line, end in zip(archived, ends, strict=True)])
    height_km = np.linalg.norm(orbit.state([0.0], tle_epoch(orbit))[0]) / 1e3 - 6378.0
    assert 900.0 < height_km < 1300.0
    unchecked = Sgp4(tle=archived, without_checksums=True)
    assert unchecked.tle == orbit.tle
    assert Sgp4.model_validate(unchecked.model_dump()) == unchecked


@pytest.mark.parametrize("ends", [(67, 68), (68, 69), (60, 60)])
def test_lines_without_checksums_end_before_them(ends):
    lines = [line[:end] for line, end in zip(CHIBIS, ends, strict=True)]
    received = f"received {ends[0]} and {ends[1]}"
    with pytest.raises(ValueError, match=f"lines of 68 columns .*; {received}"):
        Sgp4(tle=lines, without_checksums=True)


def test_slips_of_other_columns_are_found_without_checksums():
    first, second = (line[:68] for line in CHIBIS)
    with pytest.raises(ValueError, match="columns 9-16 must hold the inclination"):
        Sgp4(tle=(first, second[:8] + "x" + second[9:]), without_checksums=True)


@pytest.mark.parametrize(
    "text",
    ["0.00000200", " 0.0000020", "0.000002  ", " 0.000002 ", "-0.0000020", "+0.0000020",
     " .00000200", "  .000002 "],
)  # fmt: skip
def test_a_mean_motion_derivative_with_a_zero_is_taken(text):
    """As the package takes it, which does not need it for its states."""
    line = changed(ONE, 34, text)
    package = Satrec.twoline2rv(line, TWO)
    rev_per_day2 = package.ndot * 1440.0**2 / (2.0 * np.pi)
    assert rev_per_day2 == pytest.approx(float(text), rel=1e-6)
    as_published = Sgp4(tle=CHIBIS).state(TIMES, START)
    assert np.array_equal(Sgp4(tle=(line, TWO)).state(TIMES, START), as_published)


@pytest.mark.parametrize(
    "text", ["0000002000", " 0.000.002", "          ", " 0,0000020", "0.00 00200"]
)
def test_what_is_no_derivative_is_refused(text):
    assert "columns 34-43 must hold the mean motion derivative" in refusal(
        changed(ONE, 34, text), TWO
    )


def test_all_faults_of_an_element_set_are_reported_at_once():
    first, second = ONE[:-1] + "5", TWO[:16] + "9" + TWO[17:-1] + "1"
    assert refusal(first, second).splitlines() == [
        "tle line 1: checksum must be 4; received 5",
        "tle line 2: column 17 must be blank; received '9'",
        f"tle line 2: checksum must be {checksum(second)}; received 1",
    ]
    assert refusal(ONE + "  extra", TWO[:-1] + "1").splitlines() == [
        "tle line 1: must have 69 columns; received 76, with 'extra' beyond them",
        "tle line 2: checksum must be 0; received 1",
    ]
    off = changed(changed(TWO, 9, "181.0000"), 44, "360.5000")
    assert refusal(ONE, off).splitlines() == [
        "tle line 2: inclination must lie in 0..180; received 181",
        "tle line 2: mean anomaly must lie in 0..360; received 360.5",
    ]


def test_lines_must_be_text():
    with pytest.raises(ValueError, match="tle: must be lines of text; received 5"):
        Sgp4(tle=5)


def test_decay_is_an_error_with_its_time_and_meaning():
    # heavy drag at a low perigee: the theory ends with a decayed orbit
    low = (changed(ONE, 54, " 99999-1"), changed(TWO, 53, "16.40000000"))
    expected = r"^sgp4: no orbit at t = \d.* s \(2012-.*\): error \d, \w+"
    with pytest.raises(ValueError, match=expected):
        Sgp4(tle=low).state(np.arange(0.0, 40 * 86400.0, 3600.0), "2012-02-28T00:00:00Z")


#: A last set before re-entry, with a drag term that holds for hours.
REENTERED = (
    "1 55897U 22151AAV 25058.12407234  .09435527  24934+0  44853-1 0  9999",
    "2 55897  98.5849 110.9278 0014449 269.2407  90.7207 15.92146194 26688",
)


def away(lines, days):
    """The error of a state so many days after the epoch of an element set."""
    orbit = Sgp4(tle=lines)
    with pytest.raises(ValueError) as caught:
        orbit.state([0.0], tle_epoch(orbit) + timedelta(days=days))
    return str(caught.value)


def code_of(lines, days):
    satellite = Satrec.twoline2rv(*lines)
    code, r_km, _ = satellite.sgp4(satellite.jdsatepoch, satellite.jdsatepochF + days)
    return code, np.linalg.norm(r_km)


def test_a_place_far_off_the_orbit_is_refused_though_sgp4_has_no_error():
    code, radius_km = code_of(REENTERED, 21.778)
    assert code == 0 and radius_km > 1e10
    text = away(REENTERED, 21.778)
    assert text.startswith("sgp4: no orbit at t = 0 s (2025-03-20T21:38:59")
    assert text.endswith(
        "km from the Earth's centre, and the orbit of the elements has 6664.77 to 6684.06 km: they "
        "do not hold at this time"
    )


@pytest.mark.parametrize("days", [3.78, -4.2])
def test_a_place_near_the_orbit_is_refused_once_the_orbit_has_ended(days):
    """SGP4's axis is a square, which grows again after the satellite has come down."""
    code, radius_km = code_of(REENTERED, days)
    assert code == 0 and 0.8 * 6664.0 < radius_km < 1.2 * 6684.0
    assert "on the way from the epoch of the elements there is none at t = " in away(
        REENTERED, days
    )


@pytest.mark.parametrize("days", [0.0, 0.5, -0.5])
def test_states_near_the_epoch_of_a_last_set_are_taken(days):
    orbit = Sgp4(tle=REENTERED)
    r, _ = orbit.state([0.0, 600.0], tle_epoch(orbit) + timedelta(days=days))
    assert np.abs(np.linalg.norm(r, axis=1) / 6.67e6 - 1.0).max() < 0.02


def verification_cases():
    """Element sets of SGP4's own test, with their minutes, by catalogue number."""
    text = Path(sgp4.__file__).with_name("SGP4-VER.TLE").read_text().splitlines()
    for first, second in pairwise(text):
        if first.startswith("1 ") and second.startswith("2 "):
            start, end, step = (float(each) for each in second[69:].split())
            lines = tuple(line[:68] + str(checksum(line)) for line in (first, second[:69]))
            yield lines, np.arange(start, end + 0.1, step) * 60.0


def test_all_places_of_sgp4s_own_test_are_taken():
    """But for those with an error code, and for one set (33333) that is no orbit."""
    taken = 0
    for lines, t_s in verification_cases():
        if lines[0][2:7] in ("33333", "33334"):  # perigee within the Earth; apogee beyond the Moon
            continue
        orbit = Sgp4(tle=lines)
        codes = np.array([code_of(lines, t / 86400.0)[0] for t in t_s])
        first = np.argmax(codes != 0) if codes.any() else len(t_s)
        orbit.state(t_s[:first], tle_epoch(orbit))
        taken += first
    assert taken > 500


def test_the_start_must_carry_a_zone():
    with pytest.raises(ValueError, match="must be a time with a zone"):
        Sgp4(tle=CHIBIS).state([0.0], "2012-03-04T10:31:47")


def test_an_instant_is_one_place_whether_a_run_began_before_a_leap_second_or_after():
    """At the end of 2016: 01:00 is 7201 s after 23:00. It was 7.7 km off."""
    epoch = ("1 25544U 98067A   16366.50000000  .00001000  00000-0  20000-4 0  9990",
             "2 25544  51.6400 100.0000 0005000  50.0000 310.0000 15.54000000    05")  # fmt: skip
    lines = [line[:68] + str(checksum(line)) for line in epoch]
    orbit = Sgp4(tle=lines)
    early, _ = orbit.state([7201.0], "2016-12-31T23:00:00Z")
    late, _ = orbit.state([0.0], "2017-01-01T01:00:00Z")
    assert np.linalg.norm(early - late) < 1e-3
    before, _ = orbit.state([0.0], "2016-12-31T23:00:00Z")
    satellite = Satrec.twoline2rv(*lines)
    _, r_km, _ = satellite.sgp4(satellite.jdsatepoch, satellite.jdsatepochF + 11.0 / 24.0)
    assert before[0] == pytest.approx(1e3 * np.array(r_km), abs=1e-3)


def test_a_leap_second_is_a_place_of_its_own():
    lines = ("1 25544U 98067A   16366.50000000  .00001000  00000-0  20000-4 0  9990",
             "2 25544  51.6400 100.0000 0005000  50.0000 310.0000 15.54000000    05")  # fmt: skip
    orbit = Sgp4(tle=[line[:68] + str(checksum(line)) for line in lines])
    (within, _), (before, _), (after, _) = (
        orbit.state([0.0], f"{day}Z")
        for day in ("2016-12-31T23:59:60", "2016-12-31T23:59:59", "2017-01-01T00:00:00")
    )
    ahead, _ = orbit.state([1.0, 2.0], "2016-12-31T23:59:59Z")
    assert np.linalg.norm(ahead[0] - within) < 1e-3 and np.linalg.norm(ahead[1] - after) < 1e-3
    assert 7e3 < np.linalg.norm(within - before) < 8e3 > np.linalg.norm(after - within) > 7e3


def drifting_elements(drag):
    lines = (f"1 25544U 98067A   24001.50000000  .00000000  00000-0  {drag} 0  9990",
             "2 25544  51.6400 100.0000 0005000  50.0000 310.0000 15.54000000    05")  # fmt: skip
    return Sgp4(tle=[line[:68] + str(checksum(line)) for line in lines])


@pytest.mark.parametrize(("drag", "lasts_days"), [("20000-4", 800), ("20000-3", 250)])
def test_elements_too_old_to_tell_the_place_are_refused(drag, lasts_days):
    """Half a revolution is not known: with ten times the drag after a third of the time."""
    orbit = drifting_elements(drag)
    day_s, ages = 86400.0, np.arange(10, 2000, 10)
    epoch = "2024-01-01T12:00:00Z"
    refused = []
    for age in ages.tolist():
        try:
            orbit.state([age * day_s], epoch)
        except ValueError as error:
            refused.append((age, str(error)))
    first, message = refused[0]
    assert lasts_days / 2 < first < lasts_days * 2
    assert f"no orbit at t = {first * day_s:.6g} s (" in message
    assert (
        f"{first} days from the epoch of the elements their error is half a revolution" in message
    )
    assert "take elements of about this time" in message
    assert [age for age, _ in refused] == [age for age in ages if age >= first]
