"""A flight with several sensors of a kind: telemetry names the one that is judged wrong."""

from contextlib import closing

import pytest
from exported_netcdf import read_exported
from onboard_ground import Ground
from unit_cases import SIDE, two_magnetometers

from torquer.flight.packets.bits import in_words
from torquer.flight.packets.received import as_tables
from torquer.flight.packets.station import Station
from torquer.flight.software.core import Core
from torquer.flight.software.software import load_software
from torquer.ground.archive import Archive
from torquer.ground.export import export_archive
from torquer.ground.recording import import_recording


@pytest.fixture(scope="module")
def ground():
    """A flight of two minutes, of which the second one has a stuck magnetometer."""
    made = Ground(Core(two_magnetometers()))
    made.tick(times=1000)
    return made


def test_packets_name_the_stuck_magnetometer(ground):
    field = ground.dictionary.down["extended"].fields[5]
    words = [in_words(field, values["isolated"]) for values in ground.named("extended")]
    assert set(words[:55]) == {"none"} and set(words[75:]) == {"side"}


def test_tables_name_the_bits(ground):
    station = Station(ground.core.software)
    frames = [(0.0, frame) for sent in ground.sent for frame in station.receive(sent)]
    isolated = as_tables(frames)["extended"]["isolated"]
    meanings = isolated.attrs["flag_meanings"].split()
    assert meanings[-2:] == ["panel", "side"] and isolated.attrs["flag_masks"][-1] == SIDE
    assert isolated.values[-1] == SIDE


@pytest.mark.parametrize("scenario", [two_magnetometers(), None], ids=["named", "not named"])
def test_exports_of_archives_name_the_bits_as_far_as_the_ground_knows(ground, tmp_path, scenario):
    (tmp_path / "downlink.bin").write_bytes(b"".join(ground.sent))
    link = load_software().for_satellite(scenario)
    with closing(Archive(tmp_path / "sat.sqlite", link.dictionary)) as archive:
        counts = import_recording(link, tmp_path / "downlink.bin", archive)
    assert counts["lost_bytes"] == 0 and counts["new"] > 120
    export_archive(tmp_path / "sat.sqlite", tmp_path, packets=["extended"])
    isolated = read_exported(tmp_path / "extended.nc")["isolated"]
    assert isolated.values[-1] == SIDE
    about = isolated.attrs
    masks = dict(zip(about["flag_meanings"].split(), about["flag_masks"].tolist(), strict=True))
    assert masks["gyro"] == 4 and masks.get("side") == (scenario and SIDE)


def test_an_archive_goes_on_when_the_names_are_known(ground, tmp_path):
    path = tmp_path / "sat.sqlite"
    for dictionary in (load_software().dictionary, ground.dictionary):
        with closing(Archive(path, dictionary)) as archive:
            assert archive.dictionary == dictionary
