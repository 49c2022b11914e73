"""XTCE of another satellite as a dictionary, and one line for what a dictionary cannot hold."""

import struct

import pytest

from torquer.flight.packets.codec import decoder
from torquer.flight.packets.dictionary import DictionaryError
from torquer.flight.packets.xtce_import import read_xtce

HEADER = (("VERSION", 3), ("TYPE", 1), ("SEC_HDR_FLG", 1), ("PKT_APID", 11), ("SEQ_FLGS", 2),
          ("SRC_SEQ_CTR", 14), ("PKT_LEN", 16))  # fmt: skip


def integer(name, bits, inside="", more="", **keys):
    attributes = "".join(f' {key}="{value}"' for key, value in keys.items())
    return (
        f'<xtce:IntegerParameterType name="{name}">{more}<xtce:IntegerDataEncoding '
        f'sizeInBits="{bits}"{attributes}>{inside}</xtce:IntegerDataEncoding>'
        "</xtce:IntegerParameterType>"
    )


def curve(*coefficients):
    terms = "".join(
        f'<xtce:Term coefficient="{c}" exponent="{k}"/>' for k, c in enumerate(coefficients)
    )
    return (f"<xtce:DefaultCalibrator><xtce:PolynomialCalibrator>{terms}"
            "</xtce:PolynomialCalibrator></xtce:DefaultCalibrator>")  # fmt: skip


VOLT = "<xtce:UnitSet><xtce:Unit>V</xtce:Unit></xtce:UnitSet>"
TYPES = {
    "SecondsType": integer("SecondsType", 32),
    "VoltType": integer("VoltType", 12, curve(0.5, -0.25), VOLT),
    "TempType": integer("TempType", 12, curve(1, 2, 0.5), encoding="twosComplement"),
    "ModeType": '<xtce:EnumeratedParameterType name="ModeType"><xtce:IntegerDataEncoding '
    'sizeInBits="3"/><xtce:EnumerationList><xtce:Enumeration value="1" label="SAFE"/>'
    '<xtce:Enumeration value="5" label="SUN"/><xtce:Enumeration value="6" label="SUN"/>'
    "</xtce:EnumerationList></xtce:EnumeratedParameterType>",
    "LitType": '<xtce:BooleanParameterType name="LitType" zeroStringValue="DARK" '
    'oneStringValue="LIT"><xtce:IntegerDataEncoding sizeInBits="1"/></xtce:BooleanParameterType>',
    "RateType": '<xtce:FloatParameterType name="RateType"><xtce:FloatDataEncoding '
    'sizeInBits="32" byteOrder="leastSignificantByteFirst"/></xtce:FloatParameterType>',
    "TextType": '<xtce:StringParameterType name="TextType"><xtce:StringDataEncoding>'
    "<xtce:SizeInBits><xtce:Fixed><xtce:FixedValue>40</xtce:FixedValue></xtce:Fixed></xtce:SizeInBits>"
    "</xtce:StringDataEncoding></xtce:StringParameterType>",
}  # fmt: skip
PARAMETERS = {
    "OnboardSeconds": "SecondsType", "EPS.BusVoltage": "VoltType", "TEMP": "TempType",
    "mode": "ModeType", "lit": "LitType", "rate_x": "RateType", "rate_y": "RateType",
    "rate_z": "RateType", "2ndName": "TextType",
}  # fmt: skip
ENTRIES = (
    "EPS.BusVoltage", "TEMP", "mode",
    ("lit", '<xtce:LocationInContainerInBits referenceLocation="previousEntry"><xtce:FixedValue>4'
            "</xtce:FixedValue></xtce:LocationInContainerInBits>"),
    "rate_x", "rate_y", "rate_z", "2ndName",
)  # fmt: skip
COMPARED = (
    '<xtce:ComparisonList><xtce:Comparison parameterRef="VERSION" value="0"/>'
    '<xtce:Comparison parameterRef="PKT_APID" value="1025"/></xtce:ComparisonList>'
)


def entry(each):
    name, inside = each if isinstance(each, tuple) else (each, "")
    return f'<xtce:ParameterRefEntry parameterRef="{name}">{inside}</xtce:ParameterRefEntry>'


def document(types=TYPES, entries=ENTRIES, compared=COMPARED, more="", system=""):
    """An XTCE document: the primary header, a secondary one that inherits it, a packet of both."""
    header = "".join(integer(f"{name}Type", bits) for name, bits in HEADER)
    parameters = {name: f"{name}Type" for name, _ in HEADER} | PARAMETERS
    listed = "".join(
        f'<xtce:Parameter name="{name}" parameterTypeRef="/Bird/{kind}"'
        + (' shortDescription="the &quot;bus&quot;"' if name == "EPS.BusVoltage" else "")
        + "/>"
        for name, kind in parameters.items()
    )
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<!-- of another satellite -->
<xtce:SpaceSystem name="Bird" xmlns:xtce="http://www.omg.org/space/xtce">{system}
<xtce:TelemetryMetaData>
<xtce:ParameterTypeSet>{header}{"".join(types.values())}</xtce:ParameterTypeSet>
<xtce:ParameterSet>{listed}</xtce:ParameterSet>
<xtce:ContainerSet>
<xtce:SequenceContainer name="CCSDSPacket" abstract="true"><xtce:EntryList>
{"".join(entry(name) for name, _ in HEADER)}</xtce:EntryList></xtce:SequenceContainer>
<xtce:SequenceContainer name="Second" abstract="true"><xtce:EntryList>
<xtce:ParameterRefEntry parameterRef="OnboardSeconds"/></xtce:EntryList>
<xtce:BaseContainer containerRef="CCSDSPacket"/></xtce:SequenceContainer>
<xtce:SequenceContainer name="HouseKeeping" shortDescription="all of it"><xtce:EntryList>
{"".join(map(entry, entries))}</xtce:EntryList><xtce:BaseContainer containerRef="Second">
<xtce:RestrictionCriteria>{compared}</xtce:RestrictionCriteria></xtce:BaseContainer>
</xtce:SequenceContainer>{more}</xtce:ContainerSet>
</xtce:TelemetryMetaData></xtce:SpaceSystem>"""


@pytest.fixture
def read(tmp_path):
    def from_text(text, *packets):
        (tmp_path / "bird.xml").write_text(text, encoding="utf-8")
        return read_xtce(tmp_path / "bird.xml", packets)

    return from_text


def test_document_of_another_satellite_becomes_a_dictionary(read):
    found = read(document())
    assert (found.link, found.dictionary.name, found.notes) == ("space_packets", "Bird", ())
    (packet,) = found.dictionary.down.values()
    assert (packet.name, packet.id, packet.description) == ("house_keeping", 1025, "all of it")
    assert packet.names == ("onboard_seconds", "eps_bus_voltage", "temp", "mode", "lit",
                            "rate_x", "rate_y", "rate_z", "n_2nd_name")  # fmt: skip
    fields = {field.name: field for field in packet.fields}
    assert fields["eps_bus_voltage"].description == "the 'bus' (EPS.BusVoltage)"
    assert (fields["eps_bus_voltage"].unit, fields["rate"].count) == ("V", 3)
    assert fields["mode"].texts == {1: "SAFE", 5: "SUN", 6: "SUN (6)"}
    assert fields["temp"].unknown == "none"


def test_bytes_of_another_satellite_are_read_by_it(read):
    (packet,) = read(document()).dictionary.down.values()
    bits = format(4, "012b") + format(-2 % 2**12, "012b") + "101" + "0000" + "1"
    data = struct.pack(">I", 7) + int(bits, 2).to_bytes(4, "big")
    data += struct.pack("<fff", 0.5, 1.5, -2.5) + b"torqu"
    values = (7, 0.5 - 0.25 * 4, 1 - 4 + 2.0, 5, 1, 0.5, 1.5, -2.5, b"torqu")
    assert decoder(packet)(data) == values


def test_only_the_containers_that_are_wanted_need_be_readable(read):
    bad = ('<xtce:SequenceContainer name="Bad"><xtce:EntryList><xtce:ArrayParameterRefEntry '
           'parameterRef="TEMP"/></xtce:EntryList></xtce:SequenceContainer>')  # fmt: skip
    with pytest.raises(DictionaryError, match="SequenceContainer Bad: must have parameters and"):
        read(document(more=bad))
    assert list(read(document(more=bad), "HouseKeeping").dictionary.down) == ["house_keeping"]
    with pytest.raises(DictionaryError, match=r"packet: must be one of CCSDS.*; rec.* None"):
        read(document(), "None")


def test_container_within_a_container_is_read_in_its_place(read):
    part = ('<xtce:SequenceContainer name="Part" abstract="true"><xtce:EntryList>'
            f'{entry("OnboardSeconds")}</xtce:EntryList></xtce:SequenceContainer>')  # fmt: skip
    text = document(entries=("mode",), more=part)
    text = text.replace(entry("mode"), '<xtce:ContainerRefEntry containerRef="Part"/>')
    (packet,) = read(text).dictionary.down.values()
    assert packet.names == ("onboard_seconds", "onboard_seconds_2")


def nested(count, times):
    """Containers, each of which has the next one in it so many times, and the last one `mode`."""
    inside = [f'<xtce:ContainerRefEntry containerRef="C{k + 1}"/>' * times for k in range(count)]
    return "".join(
        f'<xtce:SequenceContainer name="C{k}" abstract="true"><xtce:EntryList>{each}'
        "</xtce:EntryList></xtce:SequenceContainer>"
        for k, each in enumerate([*inside, entry("mode")])
    )


@pytest.mark.parametrize(
    ("count", "times", "message"),
    [(500, 1, "be within at most 32 containers"), (30, 2, "have at most 4000 entries; rec.* more")],
)
def test_containers_within_containers_take_neither_time_nor_memory(read, count, times, message):
    text = document(entries=("mode",), more=nested(count, times))
    text = text.replace(entry("mode"), '<xtce:ContainerRefEntry containerRef="C0"/>', 1)
    with pytest.raises(DictionaryError, match=message):
        read(text)


def one(kind, inside, group="Integer", **keys):
    """The document with another type in place of `TempType`."""
    attributes = "".join(f' {key}="{value}"' for key, value in keys.items())
    text = (f'<xtce:{group}ParameterType name="TempType"{attributes}>{inside}'
            f"</xtce:{group}ParameterType>")  # fmt: skip
    return document(TYPES | {"TempType": text if kind is None else kind})


ENCODING = '<xtce:IntegerDataEncoding sizeInBits="12"/>'
SPLINE = (
    "<xtce:IntegerDataEncoding sizeInBits='12'><xtce:DefaultCalibrator>"
    "<xtce:SplineCalibrator/></xtce:DefaultCalibrator></xtce:IntegerDataEncoding>"
)
REFUSED = {
    "spline": (one(None, SPLINE), "TempType: must have a Polynomial.*; .* SplineCal"),
    "context": (one(integer("TempType", 12, "<xtce:ContextCalibratorList/>"), ""),
                "IntegerParameterType TempType: must be encoded without it; .* ContextCalib"),
    "wide": (one(integer("TempType", 65), ""), "must have 1 to 64 bits, .*; received 65"),
    "float 48": (one(None, '<xtce:FloatDataEncoding sizeInBits="48"/>', "Float"),
                 "must have 1 to 64 bits, a float 16, 32 or 64; received 48"),
    "1750A": (one(None, '<xtce:FloatDataEncoding encoding="MILSTD_1750A"/>', "Float"),
              "must be encoded as IEEE754 or IEEE754_1985; received MILSTD_1750A"),
    "BCD": (one(integer("TempType", 12, encoding="BCD"), ""), "must be encoded as uns.* BCD"),
    "bits": (one(integer("TempType", 12, bitOrder="leastSignificantBitFirst"), ""),
             "must have bitOrder mostSignificantBitFirst; received leastSignificantBitFirst"),
    "order": (one(integer("TempType", 16, byteOrder="middle"), ""), "a byteOrder .* middle"),
    "constant": (one(integer("TempType", 12, curve(3)), ""), "depends on the raw .*a constant"),
    "coefficient": (one(integer("TempType", 12, curve("x", 1)), ""), "have numbers; .*'x'"),
    "infinite": (one(integer("TempType", 12, curve(0, "inf")), ""), "scale: must be .*inf"),
    "time": (one(None, ENCODING, "AbsoluteTime"), "be one of Integer, .* AbsoluteTimeParameterTy"),
    "base": (one(None, ENCODING, baseType="ModeType"), "complete in itself; .* a baseType"),
    "size": (one(None, "<xtce:BinaryDataEncoding><xtce:SizeInBits><xtce:DynamicValue/>"
                       "</xtce:SizeInBits></xtce:BinaryDataEncoding>", "Binary"),
             "must have a fixed size of whole bytes; received another bits"),
    "ranges": (document(TYPES | {"ModeType": TYPES["ModeType"].replace(
        'value="1"', 'value="1" maxValue="3"')}), "an Enumeration for each number; .* maxValue 3"),
    "entries": (document().replace(
        entry("mode"), '<xtce:ParameterRefEntry parameterRef="mode"><xtce:IncludeCondition/>'
        "</xtce:ParameterRefEntry>"), "HouseKeeping: must have entries without conditions .* Incl"),
    "start": (document().replace("previousEntry", "containerStart"), "bits after the previousEn"),
    "no id": (document(compared=""), "HouseKeeping: must be told by a Comparison of the APID"),
    "other id": (document(compared=COMPARED.replace("VERSION", "mode")),
                 "HouseKeeping: must be told by comparisons of its header; received mode"),
    "greater": (document(compared=COMPARED.replace("/>", ' comparisonOperator=">"/>', 1)),
                "must be told by Comparisons with ==; received >"),
    "algorithm": (document(compared="<xtce:CustomAlgorithm/>"), "Comparisons .* CustomAlgorithm"),
    "label": (document(compared=COMPARED.replace("1025", "HK")), "by a whole number; .* 'HK'"),
    "apid": (document(compared=COMPARED.replace("1025", "3000")),
             "HouseKeeping: must be told by an id of 0 to 2046; received 3000"),
    "idle": (document(compared=COMPARED.replace("1025", "2047")), "of 0 to 2046; received 2047"),
    "labels": (document(TYPES | {"ModeType": TYPES["ModeType"].replace('"5"', '"6"')}),
               "ModeType: must have one label for each value; received SUN and SUN"),
    "parameter": (document(entries=("mode", "nothing")), "refer to parameters .*; rec.* nothing"),
    "type": (document({k: v for k, v in TYPES.items() if k != "LitType"}),
             "Parameter lit: must have a type of the file; received LitType"),
    "circle": (document().replace('containerRef="CCSDSPacket"', 'containerRef="HouseKeeping"'),
               "must not be part of itself; received "),
    "bits left": (document(entries=("mode",)), "HouseKeeping: fields: must fill whole bytes"),
    "nested": (document(system='<xtce:SpaceSystem name="Part"/>'), "SpaceSystem Part: must hold"),
    "none": ('<SpaceSystem name="x"/>', "ContainerSet: must have packets with .*; received none"),
    "other": ("<packets/>", "XTCE: must begin with SpaceSystem; received packets"),
    "no XML": ("name = 1", "must be XML that can be read; received an error"),
    "entities": ('<!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/passwd">]><a>&b;</a>',
                 "must be XML without declarations of types and entities; received <!"),
    "laughs": ('<!DOCTYPE a [<!ENTITY b "ha"><!ENTITY c "&b;&b;">]><a>&c;</a>', "XML without dec"),
    "unknown": ("<SpaceSystem>&b;</SpaceSystem>", "must be XML that can be read; .*entity"),
}  # fmt: skip


@pytest.mark.parametrize(("text", "message"), REFUSED.values(), ids=REFUSED)
def test_what_a_dictionary_cannot_hold_gets_one_line_with_its_name(read, text, message):
    with pytest.raises(DictionaryError, match=rf"\Abird\.xml: .*{message}") as error:
        read(text)
    assert len(str(error.value).splitlines()) == 1


def test_file_that_is_not_there_or_no_text(tmp_path):
    (tmp_path / "other.xml").write_bytes(b"\xff\xfe<\0")
    with pytest.raises(DictionaryError, match=r"other.xml: must be XML .*; received: not UTF-8"):
        read_xtce(tmp_path / "other.xml")
    with pytest.raises(DictionaryError, match=r"FILE: must be readable; received .*No such file"):
        read_xtce(tmp_path / "none.xml")


def test_alarms_that_are_left_out_are_told(read):
    alarm = ("<xtce:DefaultAlarm><xtce:StaticAlarmRanges><xtce:WarningRange minInclusive='1' "
             "maxInclusive='9'/>{}</xtce:StaticAlarmRanges></xtce:DefaultAlarm>")  # fmt: skip
    for more, notes in (("", 0), ("<xtce:CriticalRange minInclusive='0'/>", 1)):
        text = TYPES["TempType"].replace(
            "</xtce:IntegerParam", alarm.format(more) + "</xtce:IntegerParam"
        )
        found = read(document(TYPES | {"TempType": text}))
        (field,) = (f for f in found.dictionary.down["house_keeping"].fields if f.name == "temp")
        assert field.limits == (1.0, 9.0) and len(found.notes) == notes
