"""SGP4 orbits: against the package itself and skyfield, and every check of an element set."""

import pickle
from datetime import timedelta

import numpy as np
import pytest
from sgp4.api import Satrec, jday
from skyfield.api import EarthSatellite, load

from torquer.base.time import parse_utc
from torquer.environment.earth.rotation import teme_to_gcrf
from torquer.environment.orbit import Sgp4
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
    with pytest.raises(ValueError) as error:
        Sgp4(tle=lines)
    return error.value.errors()[0]["msg"].removeprefix("Value error, ")


ONE, TWO = CHIBIS


@pytest.mark.parametrize(
    ("lines", "message"),
    (
        ((ONE[:-1] + "5", TWO), "tle line 1: checksum must be 4; received 5"),
        ((ONE, TWO[:-1] + "1"), "tle line 2: checksum must be 0; received 1"),
        ((ONE[:60] + ONE[61:], TWO), "tle line 1: must have 69 columns; received 68"),
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
            "orbit: must stay within 1500000 km of the Earth's centre, its Hill sphere; received "
            "one that goes out to 4.22899e+06 km",
        ),
        ((ONE,), "tle: must have two lines, or three with a name; received 1"),
    ),
)
def test_a_bad_element_set_is_one_clear_line(lines, message):
    assert refusal(*lines).splitlines()[0] == message


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


def test_the_start_must_carry_a_zone():
    with pytest.raises(ValueError, match="must be a time with a zone"):
        Sgp4(tle=CHIBIS).state([0.0], "2012-03-04T10:31:47")
