"""The orbit by which passes are predicted: files of elements, scenarios, their age."""

import pytest
from station_skies import CHIBIS, HOUR_MS, START_MS, TARUSA

from torquer.base.explain import ScenarioError
from torquer.ground.elements import orbit_from_file, orbit_of
from torquer.ground.file import SatelliteTable, load_ground
from torquer.ground.passes import find_passes, ms_of
from torquer.scenario.load import load_scenario

LINK = "udp:127.0.0.1:10315"
#: The second satellite is a neighbour with another number.
OTHER = (
    "1 00005U 58002B   00179.78495062  .00000023  00000-0  28098-4 0  4753",
    "2 00005  34.2682 348.7242 1859667 331.7664  19.3264 10.82419157413667",
)


@pytest.fixture
def tle(tmp_path):
    path = tmp_path / "chibis.tle"
    path.write_text("\n".join(["CHIBIS-M", *CHIBIS, "VANGUARD", *OTHER]) + "\n", encoding="utf-8")
    return path


def passes_of(known):
    return find_passes(known.around, {"t": TARUSA}, START_MS, START_MS + 24 * HOUR_MS)


@pytest.mark.parametrize("called", ["38051", "chibis-m"])
def test_a_satellite_is_chosen_by_name_or_number(tle, called):
    known = orbit_from_file(tle, START_MS, called)
    assert known.elements.called == "38051 CHIBIS-M"
    assert known.elements.epoch_ms == pytest.approx(ms_of("2012-02-27T21:56:52.94Z", "t"), abs=5)
    assert len(passes_of(known)) == 6


def test_a_file_of_several_satellites_needs_a_name(tle):
    with pytest.raises(ScenarioError, match=r"^elements: .*satellite: must name one of the file's"):
        orbit_from_file(tle, START_MS)


def test_the_age_of_elements_and_what_it_does(tle):
    ages = [0.0, 1.0, 5.0, 30.0]
    found = [orbit_from_file(tle, round(START_MS + 24 * HOUR_MS * age), "38051") for age in ages]
    errors = [each.elements.error_s for each in found]
    assert errors == sorted(errors)
    # 3 km a day at 7.6 km/s are 0.4 s a day; drag adds to it with the square of the age
    assert errors[1] == pytest.approx(0.4 * found[1].elements.age_days, rel=0.3)
    assert errors[3] > 10.0 * errors[2]
    assert "may be early or late" not in found[1].text
    assert found[3].text == (
        f"SGP4 with elements of 38051 CHIBIS-M, 30.1 days old, of chibis.tle: the satellite "
        f"may be early or late by {errors[3]:.0f} s"
    )
    before = orbit_from_file(tle, START_MS - 24 * HOUR_MS, "38051")
    assert "0.9 days ahead" in before.text and before.elements.age_days < 0.0


def test_elements_come_before_the_scenario(tle):
    scenario = load_scenario("examples/chibis_m_day.toml")
    table = SatelliteTable(link=LINK)
    by_scenario = orbit_of(table, scenario, START_MS)
    assert by_scenario.elements is None
    assert by_scenario.text == f"that of the scenario {scenario.name}"
    both = table.model_copy(update={"elements": tle, "elements_of": "38051"})
    assert orbit_of(both, scenario, START_MS).elements.called == "38051 CHIBIS-M"
    assert orbit_of(table, None, START_MS) is None


def test_a_missing_or_wrong_file_gets_one_line(tmp_path):
    with pytest.raises(ScenarioError) as missing:
        orbit_from_file(tmp_path / "none.tle", START_MS)
    assert str(missing.value).startswith("elements: must be a file that can be read; received ")
    assert "\n" not in str(missing.value) and "none.tle" in str(missing.value)
    wrong = tmp_path / "wrong.tle"
    wrong.write_text(CHIBIS[0][:-1] + "9\n" + CHIBIS[1] + "\n", encoding="utf-8")
    with pytest.raises(
        ScenarioError, match=r"^elements: wrong.tle line 1: checksum must be 4; received 9"
    ):
        orbit_from_file(wrong, START_MS)


# The ground file


def load(tmp_path, text):
    path = tmp_path / "ground.toml"
    path.write_text(text, encoding="utf-8")
    return load_ground(path)


def test_stations_and_frequencies_are_declared_once(tmp_path):
    file = load(
        tmp_path,
        f"""
        [satellites.s]
        link = "{LINK}"
        elements = "s.tle"
        downlink_hz = 435.2e6
        uplink_hz = 145.9e6
        [satellites.s.downlink]
        bit_s = 9600.0
        [stations.tarusa]
        latitude_deg = 54.73
        longitude_deg = 37.18
        horizon_deg = [[0.0, 3.0], [180.0, 5.0]]
        [stations.pole]
        latitude_deg = -90.0
        longitude_deg = 0.0
        """,
    )
    table = file.satellites["s"]
    assert (table.downlink_hz, table.uplink_hz, table.downlink.bit_s) == (435.2e6, 145.9e6, 9600.0)
    assert table.elements == tmp_path / "s.tle"
    assert list(file.stations) == ["tarusa", "pole"]
    assert file.stations["tarusa"].horizon_deg == ((0.0, 3.0), (180.0, 5.0))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("latitude_deg = 91.0\nlongitude_deg = 0.0", "stations.a.latitude_deg: must be less than"),
        ("longitude_deg = 0.0", "stations.a.latitude_deg: must be given; received nothing"),
        ("latitude_deg = 1.0\nlongitude_deg = 0.0\nheight_m = 1.0",
         "stations.a.height_m: must be a known key"),
        ("latitude_deg = 1.0\nlongitude_deg = 0.0\nhorizon_deg = [[9.0, 1.0], [5.0, 1.0]]",
         "stations.a.horizon_deg: must have azimuths that increase; received 5 after 9"),
    ],
)  # fmt: skip
def test_a_wrong_station_gets_one_line(tmp_path, text, message):
    with pytest.raises(ScenarioError) as refused:
        load(tmp_path, f'[satellites.s]\nlink = "{LINK}"\n[stations.a]\n{text}\n')
    assert str(refused.value).startswith(message) and "\n" not in str(refused.value)


@pytest.mark.parametrize("keys", [{"downlink_hz": 0.0}, {"uplink_hz": -1.0}])
def test_frequencies_are_positive(keys):
    with pytest.raises(ScenarioError, match="link_hz: must be greater than 0"):
        SatelliteTable(link=LINK, **keys)
