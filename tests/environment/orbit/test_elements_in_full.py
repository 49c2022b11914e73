"""Files of elements: all digits count, every number is checked, what is not needed may lack."""

import json

import numpy as np
import pytest
from environment.orbit.orbit_files import ISS, START, times
from environment.orbit.test_from_file import omm_fields, orbit_of, refused, second
from sgp4.api import WGS72, Satrec

INSTANTS = times(1200.0)


@pytest.mark.parametrize("end", ("\n", "\r\n", "  \n", " \r\n\r\n"))
@pytest.mark.parametrize("begin", ("", "   ", "\t"))
def test_lines_of_elements_may_be_indented(tmp_path, begin, end):
    text = "".join(f"{begin}{line}{end}" for line in ("ISS", *ISS.tle))
    orbit = orbit_of(tmp_path, "a.tle", text, satellite=25544.0)
    assert np.array_equal(orbit.state(INSTANTS, START), ISS.state(INSTANTS, START))


def test_a_number_beyond_five_digits_has_a_letter_in_two_lines(tmp_path):
    text = "\n".join([*ISS.tle, *second("A0001")])
    orbit = orbit_of(tmp_path, "a.tle", text, satellite=100001)
    assert orbit.elements(START).orbit.tle[0][2:7] == "A0001"


def message_of(**values) -> str:
    """JSON of an OMM; None leaves a keyword out."""
    fields = {name: str(x) for name, x in omm_fields().items()} | values
    return json.dumps([{name: x for name, x in fields.items() if x is not None}])


@pytest.mark.parametrize(
    "epoch",
    ("2025-07-01T12:00:00", "2025-07-01T12:00:00Z", "2025-182T12:00:00.000", "2025-182T12:00:00z"),
)
def test_epochs_of_messages_in_all_forms_are_the_same(tmp_path, epoch):
    orbit = orbit_of(tmp_path, "a.json", message_of(EPOCH=epoch))
    assert orbit.elements(START).epoch == START
    assert np.abs(orbit.state(INSTANTS, START)[0] - ISS.state(INSTANTS, START)[0]).max() < 1e-4


def test_all_digits_of_a_message_count(tmp_path):
    """As SGP4 itself has them, of an epoch between columns of two lines, too."""
    given = {
        "EPOCH": "2025-07-01T12:00:00.123456", "INCLINATION": "51.63704321987",
        "RA_OF_ASC_NODE": "240.00001234567", "ARG_OF_PERICENTER": "-269.99998765432",
        "MEAN_ANOMALY": "270.00004321", "ECCENTRICITY": "0.00020001234", "BSTAR": "1.48001234e-4",
        "MEAN_MOTION": "15.5000000012345",
    }  # fmt: skip
    orbit = orbit_of(tmp_path, "a.json", message_of(**given))
    satellite = Satrec()
    turn = np.pi / 180.0
    satellite.sgp4init(
        WGS72, "i", 1, 27575.5 + 0.123456 / 86400.0, 1.48001234e-4, 0.0, 0.0, 0.00020001234,
        90.00001234568 * turn, 51.63704321987 * turn, 270.00004321 * turn,
        15.5000000012345 * 2.0 * np.pi / 1440.0, 240.00001234567 * turn,
    )  # fmt: skip
    for t_s in (0.0, 3600.0):
        code, r_km, v_km_s = satellite.sgp4_tsince((t_s - 0.123456) / 60.0)
        r, v = orbit.state([t_s], START)
        assert code == 0 and np.abs(r[0] - 1e3 * np.array(r_km)).max() < 1e-4
        assert np.abs(v[0] - 1e3 * np.array(v_km_s)).max() < 1e-7
    rounded = orbit_of(tmp_path, "b.json", message_of(**given | {"INCLINATION": "51.6370"}))
    apart = orbit.state(INSTANTS, START)[0] - rounded.state(INSTANTS, START)[0]
    assert 3.0 < np.linalg.norm(apart, axis=1).max() < 10.0  # 0.43e-4 degrees


def test_what_sgp4_does_not_need_may_be_left_out(tmp_path):
    unused = ("MEAN_MOTION_DOT", "MEAN_MOTION_DDOT", "ELEMENT_SET_NO", "REV_AT_EPOCH",
              "CLASSIFICATION_TYPE", "EPHEMERIS_TYPE", "NORAD_CAT_ID")  # fmt: skip
    orbit = orbit_of(tmp_path, "a.json", message_of(**dict.fromkeys(unused)))
    assert np.abs(orbit.state([0.0], START)[0] - ISS.state([0.0], START)[0]).max() < 1e-4


@pytest.mark.parametrize("prefix", ("", "ndm:"))
def test_xml_may_have_a_namespace(tmp_path, prefix):
    body = "".join(f"<{k}>{v}</{k}>" for k, v in omm_fields().items())
    space = f'xmlns{prefix and ":ndm"}="urn:ccsds:schema:ndmxml"'
    text = (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<ndm {space}><{prefix}omm><body><segment>'
        f"<metadata>{body}</metadata></segment></body></{prefix}omm></ndm>"
    )
    orbit = orbit_of(tmp_path, "a.xml", text)
    assert np.abs(orbit.state([0.0], START)[0] - ISS.state([0.0], START)[0]).max() < 1e-4


@pytest.mark.parametrize(
    ("key", "value", "message"),
    (
        ("ECCENTRICITY", "-0.1", "must lie in 0..0.9999999; received -0.1"),
        ("ECCENTRICITY", "1", "must lie in 0..0.9999999; received 1"),
        ("ECCENTRICITY", "NaN", "must be a finite number; received 'NaN'"),
        ("INCLINATION", "181", "must lie in 0..180; received 181"),
        ("MEAN_MOTION", "0", "must lie in 0.0046..17.1; received 0"),
        ("MEAN_MOTION", "18", "must lie in 0.0046..17.1; received 18"),
        ("RA_OF_ASC_NODE", "400", "must lie in -360..360; received 400"),
        ("ARG_OF_PERICENTER", None, "must be given; received none"),
        ("MEAN_ANOMALY", "x", "must be a finite number; received 'x'"),
        ("BSTAR", "inf", "must be a finite number; received 'inf'"),
        ("BSTAR", "1e400", "must be a finite number; received '1e400'"),
        ("MEAN_MOTION_DOT", "nan", "must be a finite number; received 'nan'"),
    ),
)
def test_every_number_of_a_message_is_checked_by_its_keyword(tmp_path, key, value, message):
    assert refused(tmp_path, message_of(**{key: value}), "a.json") == (
        f"file: a.json: ISS (ZARYA): {key} {message}"
    )


def test_a_message_has_lines_and_units(tmp_path):
    text = "COMMENT\nCCSDS_OMM_VERS = 2.0\n" + "\n".join(
        f"{k} = {v}" for k, v in omm_fields().items()
    )
    line = text.split("INCLINATION")[0].count("\n") + 1
    good, bad = (text.replace("INCLINATION = 51.637", f"INCLINATION = 51.637 [{unit}]")
                 for unit in ("deg", "rad"))  # fmt: skip
    assert orbit_of(tmp_path, "a.omm", good).frame == "TEME"
    assert refused(tmp_path, bad, "a.omm") == (
        f"file: a.omm line {line}: INCLINATION must be in deg; received 'rad'"
    )
