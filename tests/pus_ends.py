"""Both ends of PUS-C for tests, without a flight: a user on the ground, a process on board."""

import datetime

from fastcrc import crc16
from packet_cases import CHIBIS, ODD
from spacepackets.ccsds.time import CdsShortTimestamp

from torquer.flight.packets.dictionary import ACKNOWLEDGE, Dictionary
from torquer.flight.packets.frames import HEADER_BYTES, Uplink
from torquer.flight.packets.pus import ApplicationProcess
from torquer.flight.packets.pus_user import User
from torquer.flight.packets.reasons import REJECTIONS, Reason

APID, SOURCE = 77, 1
_ODD_COMMAND = {"module": "adc", "fields": (ACKNOWLEDGE, *ODD.fields)}
#: Chibis-M's packets, and one with every type that they do not use, both ways.
SATELLITE = Dictionary(
    name="A satellite",
    modules=CHIBIS.modules,
    down={**CHIBIS.down, "odd": ODD},
    up={**CHIBIS.up, "odd": ODD.model_copy(update=_ODD_COMMAND)},
)
UPLINK = Uplink(SATELLITE)


def process(dictionary=SATELLITE, apid=APID):
    """The end on board, with the codes of the flight software."""
    severities = {int(reason): int(reason.severity) for reason in Reason}
    return ApplicationProcess(dictionary, apid, REJECTIONS, severities)


def user(dictionary=SATELLITE):
    """The end on the ground."""
    return User(dictionary, APID)


def stamp(time_s):
    """The time code of on-board seconds, by another package."""
    begin = datetime.datetime(2010, 1, 1, tzinfo=datetime.UTC)
    return CdsShortTimestamp.from_datetime(begin + datetime.timedelta(seconds=time_s)).pack()


def with_crc(packet):
    """A packet whose last two bytes are the CRC that it should have, by another package."""
    return bytes(packet[:-2]) + crc16.ibm_3740(bytes(packet[:-2])).to_bytes(2, "big")


def reframed(packet, time_s, code, data):
    """A historical frame of packed data."""
    head = 0xAABBCCDD.to_bytes(4, "little") + time_s.to_bytes(4, "little")
    head += bytes([packet.id, code, 0, 0, 0, 0]) + len(data).to_bytes(2, "little")
    assert len(head) == HEADER_BYTES
    return head + data


def key(frame):
    """By what an answer names a command."""
    return frame.packet.id, frame.module, frame.time_s, frame.request


def judged(board, packet, code=0):
    """What comes out of a telecommand packet, all commands judged with one code."""
    found = []
    for frame in board.feed(packet):
        found.append(frame)
        board.judged(frame.raw, key(frame), code)
    return found


def answer(frame, code=0, dictionary=SATELLITE):
    """The frame of the answer of a module to a command."""
    data = bytes([frame.packet.id, frame.module, code == 0, code])
    data += frame.time_s.to_bytes(4, "little") + bytes(4) + frame.request.to_bytes(4, "little")
    return reframed(dictionary.down["acknowledgement"], 9, 0, data)
