"""Limits in a dictionary: what they give, one line for each mistake, and XTCE both ways."""

import pytest
from lxml import etree
from packet_cases import CHIBIS

from torquer.flight.packets.alarm_limits import alarm_in_words
from torquer.flight.packets.dictionary import DictionaryError, Field, load_dictionary
from torquer.flight.packets.dictionary_text import dictionary_toml
from torquer.flight.packets.xtce import xtce
from torquer.flight.packets.xtce_import import read_xtce

XTCE = "{http://www.omg.org/spec/XTCE/20180204}"
MODE = '{ name = "mode", type = "u8", labels = ["OFF", "ON"], description = "x" }'
BITS = '{ name = "bits", type = "u8", bits = ["hot", "cold"], description = "x", ALARM }'
NUMBER = '{ name = "a", type = "i16", unit = "V", description = "x", ALARM }'
HEAD = 'name = "Cube"\nmodules = { obc = 1 }\n'
HOUSE = '[down.house]\nid = 1\ndescription = "d"\nfields = [{MODE}, {FIELD}]\n'
STATE = '{ name = "s", type = "u8", count = 2, description = "x" }'
STATES = f'[down.modes]\nid = 2\ndescription = "d"\nfields = [{STATE}]\n'


def text(field, alarm, more=""):
    return HEAD + HOUSE.replace("{MODE}", MODE).replace(
        "{FIELD}", field.replace("ALARM", alarm)
    ) + more  # fmt: skip


def load(tmp_path, *arguments):
    path = tmp_path / "cube.toml"
    path.write_text(text(*arguments), encoding="utf-8")
    return load_dictionary(path)


def by_mode(mode, states='["ON"]', more="limits = [0, 1]"):
    return f'alarm = {{ by_mode = [{{ mode = "{mode}", states = {states}, {more} }}] }}'


PLACE = r"down\.house\.fields\[1\]"
MISTAKES = {
    "low above high": (
        NUMBER, "alarm = { critical = [3, 1] }",
        rf"{PLACE}\.critical: must be \[least, greatest\]; received \[3\.0, 1\.0\]"),
    "infinite": (NUMBER, "limits = [-inf, 1]",
                 rf"{PLACE}\.limits\[0\]: must be a finite number; received -inf"),
    "no number": (NUMBER, "alarm = { critical = [0, nan] }",
                  rf"{PLACE}\.alarm\.critical\[1\]: must be a finite number; received nan"),
    "warning after the alarm": (
        NUMBER, "limits = [0, 9], alarm = { critical = [0, 8] }",
        rf"{PLACE}\.critical: must enclose limits, \[0\.0, 9\.0\]; received \[0\.0, 8\.0\]"),
    "of a mode the other way": (
        NUMBER, by_mode("house.mode", more="limits = [2, 1]"),
        rf"{PLACE}\.alarm\.by_mode\[0\]\.limits: must be \[least, greatest\]; received"),
    "unknown mode": (NUMBER, by_mode("house.mod"),
                     rf"{PLACE}\.alarm\.by_mode\[0\]\.mode: must be packet\.number of telemetry .*"
                     r"received 'house\.mod'"),
    "mode without labels": (NUMBER, by_mode("house.a"), r"received 'house\.a'"),
    "region without the packet of regions": (NUMBER, by_mode("sun"), "received 'sun'"),
    "unknown state": (NUMBER, by_mode("house.mode", '["ON", "O"]'),
                      rf"{PLACE}\.alarm\.by_mode\[0\]\.states: must be of OFF, ON; received 'O'"),
    "state twice": (NUMBER, by_mode("house.mode", '["ON", "ON"]'), "must differ from each other"),
    "no state": (NUMBER, by_mode("house.mode", "[]"), r"states: must not be empty; received \[\]"),
    "no samples": (NUMBER, "alarm = { samples = 0 }", r"alarm\.samples: must be greater than"),
    "too many samples": (NUMBER, "alarm = { samples = 1001 }", r"alarm\.samples: must be less"),
    "unknown key": (NUMBER, "alarm = { criticl = [0, 1] }",
                    r"alarm\.criticl: must be a known key; received \[0, 1\]"),
    "value of a number": (NUMBER, 'alarm = { values = { hot = "alarm" } }',
                          rf"{PLACE}\.alarm\.values: must be left out without labels and bits"),
    "unknown bit": (BITS, 'alarm = { values = { wet = "alarm" } }',
                    rf"{PLACE}\.alarm\.values: must be one of hot, cold, any; received 'wet'"),
    "unknown severity": (BITS, 'alarm = { values = { hot = "bad" } }',
                         r"alarm\.values\.hot: must be 'warning' or 'alarm'; received 'bad'"),
    "range of bytes": (NUMBER.replace("i16", "bytes"), "alarm = { critical = [0, 1] }",
                       rf"{PLACE}\.alarm: must have no ranges but of numbers"),
    "of a command": (NUMBER, "limits = [0, 1]",
                     r"up\.go\.fields\[0\]\.alarm: must not be given for commands",
                     '[up.go]\nid = 2\nmodule = "obc"\ndescription = "d"\nfields = [{ name = "v", '
                     'type = "u8", description = "x", alarm = { critical = [0, 1] } }]'),
}  # fmt: skip


@pytest.mark.parametrize("case", MISTAKES.values(), ids=MISTAKES)
def test_mistakes_get_one_line(tmp_path, case):
    field, alarm, message, *more = case
    with pytest.raises(DictionaryError, match=message) as error:
        load(tmp_path, field, alarm, *more)
    assert len(str(error.value).splitlines()) == 1


def test_one_value_may_be_all_that_is_in_order(tmp_path):
    field = load(tmp_path, NUMBER, "limits = [0, 0]").down["house"].fields[1]
    assert field.limits == (0.0, 0.0)


def test_regions_are_checked_once_they_are_known(tmp_path):
    found = load(tmp_path, NUMBER, by_mode("sun", '["lost"]'), STATES)
    found.check_alarms({"sun": ["seen", "lost"]})
    for regions, received in (({"sun": ["seen"]}, "'lost'"), ({}, "'sun'")):
        with pytest.raises(ValueError, match=f"received {received}"):
            found.check_alarms(regions)


def test_limits_in_words():
    house = {field.name: field for field in CHIBIS.down["extended"].fields}
    words = {name: alarm_in_words(field.limits, field.alarm) for name, field in house.items()}
    assert words["omega"] == "-30 to 30; alarm beyond -60 to 60; 3 samples"
    assert words["flags"] == "alarm coils_off" and words["torque"] == ""
    assert words["omega_orbital"] == "3 samples; extended.stb_mode SCIENCE: -0.4 to 0.4"


def test_the_text_of_a_dictionary_has_its_limits(tmp_path):
    alarm = 'alarm = { latched = true, samples = 2, values = { hot = "alarm", any = "warning" } }'
    found = load(tmp_path, BITS, alarm)
    path = tmp_path / "again.toml"
    path.write_text(dictionary_toml(found), encoding="utf-8")
    assert load_dictionary(path) == found


def test_xtce_states_what_it_can(tmp_path):
    alarm = by_mode("house.mode").replace("{ by", "{ critical = [-9, 9], samples = 4, by")
    found = load(tmp_path, NUMBER, f"limits = [-5, 5], {alarm}")
    root = etree.fromstring(xtce(found).encode())
    (kind,) = root.xpath("//*[@name='house__a_type']")
    (default,) = kind.iter(f"{XTCE}DefaultAlarm")
    ranges = [(each.tag.removeprefix(XTCE), *each.attrib.values()) for each in default[0]]
    assert ranges == [("WarningRange", "-5", "5"), ("CriticalRange", "-9", "9")]
    assert default.get("minViolations") == "4"
    (context,) = kind.iter(f"{XTCE}ContextAlarm")
    (comparison,) = context.iter(f"{XTCE}Comparison")
    assert dict(comparison.attrib) == {"parameterRef": "house__mode", "value": "ON"}
    assert [each.tag.removeprefix(XTCE) for each in context] == [
        "StaticAlarmRanges",
        "ContextMatch",
    ]


def test_xtce_brings_all_of_it_back(tmp_path):
    path = tmp_path / "cube.xml"
    path.write_text(xtce(CHIBIS), encoding="utf-8")
    found = read_xtce(path)
    assert found.dictionary.down == CHIBIS.down
    assert not [note for note in found.notes if "alarms" in note]


@pytest.mark.parametrize(
    ("more", "read", "notes"),
    [
        ("<CriticalRange minInclusive='0' maxInclusive='9'/>", (0.0, 9.0), 0),
        ("<CriticalRange minInclusive='2' maxInclusive='9'/>", None, 1),
        ("<CriticalRange minInclusive='0' maxInclusive='9' rangeForm='inside'/>", None, 1),
        ("<SevereRange minInclusive='0' maxInclusive='9'/>", None, 1),
    ],
)
def test_alarms_of_other_xtce(tmp_path, more, read, notes):
    found = xtce(load(tmp_path, NUMBER, "limits = [1, 8]"))
    (warning,) = [line.strip() for line in found.splitlines() if "<WarningRange" in line]
    path = tmp_path / "other.xml"
    path.write_text(found.replace(warning, warning + more), encoding="utf-8")
    imported = read_xtce(path)
    field = imported.dictionary.down["house"].fields[1]
    assert field.limits == (1.0, 8.0) and (field.alarm and field.alarm.critical) == read
    assert len([note for note in imported.notes if "alarms" in note]) == notes


def test_labels_that_are_alarms_come_from_other_xtce(tmp_path):
    alarm = 'labels = ["GOOD", "BAD"], alarm = { values = { BAD = "alarm" } }'
    lines = xtce(load(tmp_path, NUMBER.replace("i16", "u8"), alarm)).splitlines()
    path = tmp_path / "other.xml"
    path.write_text("\n".join(x for x in lines if 'name="alarm"' not in x), encoding="utf-8")
    field = read_xtce(path).dictionary.down["house"].fields[1]
    assert field.alarm.values == {"BAD": "alarm"}


def test_alarm_of_xtce_that_is_none_gets_one_line(tmp_path):
    found = xtce(load(tmp_path, NUMBER, "alarm = { samples = 2 }"))
    path = tmp_path / "other.xml"
    path.write_text(found.replace('{"samples":2}', '{"samples":-2}'), encoding="utf-8")
    with pytest.raises(DictionaryError, match="must have its own keys") as error:
        read_xtce(path)
    assert len(str(error.value).splitlines()) == 1


def test_a_field_checks_its_limits_by_itself():
    with pytest.raises(ValueError, match="must be of numbers"):
        Field(name="a", type="bytes", limits=(0, 1), description="x")
