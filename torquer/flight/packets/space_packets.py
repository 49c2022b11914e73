"""CCSDS space packets with the secondary headers of PUS-C, and their time code.

A space packet (CCSDS 133.0-B) is a primary header of 6 bytes, then its data field: here always a
secondary header (ECSS-E-ST-70-41C, 7.4.3.1 and 7.4.4.1), the data of a service, and a CRC-16/CCITT
with initial value 0xFFFF over everything before it. All numbers of the headers are big-endian.

telecommand   ack flags, service, subtype, source id u16
telemetry     time reference status, service, subtype, message type counter u16, destination id u16,
              time (7 bytes)

Times are CDS (CCSDS 301.0-B) with their preamble 0x40: days u16 since 1958-01-01, milliseconds of
the day u32. On-board time begins in 2010, so that a smaller number of days means one after the
16 bits have wrapped, in 2137: every time that a u32 of seconds holds is unambiguous.
"""

from __future__ import annotations

import struct
from datetime import date
from typing import NamedTuple

from torquer.flight.packets.security import crc16

#: Type bit of the primary header, its flag of a secondary header, sequence flags of a packet that
#: is not a segment; greatest application process identifier, which idle packets have.
_TELECOMMAND, _SECONDARY, _UNSEGMENTED, IDLE_APID = 0x1000, 0x0800, 0xC000, 0x7FF
#: Sequence counts have 14 bits, message type counters 16.
COUNTS, COUNTERS = 2**14, 2**16
_PRIMARY, _SECONDARY_TC, _SECONDARY_TM = (struct.Struct(f) for f in (">HHH", ">BBBH", ">BBBHH"))
PRIMARY_BYTES = _PRIMARY.size
_CRC = struct.Struct(">H")
_PUS_C = 2
_CDS = struct.Struct(">BHI")
_CDS_PREAMBLE = 0x40
TIME_BYTES = _CDS.size
_DAY_S, _LATEST_S = 86400, 2**32 - 1
#: Days from the epoch of CDS to that of on-board time.
_EPOCH_DAYS = (date(2010, 1, 1) - date(1958, 1, 1)).days


class Malformed(ValueError):
    """A packet that is none; `reason`: 'length', 'checksum', 'version', 'apid', 'time', ..."""

    def __init__(self, reason: str):
        super().__init__(reason)
        self.reason = reason


class Telecommand(NamedTuple):
    """A request to a service. `ack`: which reports it asks for, see `ACCEPTANCE`, `COMPLETION`."""

    apid: int
    sequence: int
    ack: int
    service: int
    subtype: int
    source: int
    data: bytes

    def packed(self) -> bytes:
        """The packet."""
        second = _SECONDARY_TC.pack(_PUS_C << 4 | self.ack, self.service, self.subtype, self.source)
        return _close_packet(_TELECOMMAND | self.apid, self.sequence, second + self.data)


class Telemetry(NamedTuple):
    """A report of a service. `time_s`: when it was made, since 2010-01-01."""

    apid: int
    sequence: int
    service: int
    subtype: int
    counter: int
    destination: int
    time_s: int
    data: bytes

    def packed(self) -> bytes:
        """The packet; its time reference status is 0: not stated."""
        second = _SECONDARY_TM.pack(
            _PUS_C << 4, self.service, self.subtype, self.counter, self.destination
        )
        return _close_packet(self.apid, self.sequence, second + cds(self.time_s) + self.data)


#: Ack flags of a telecommand: acceptance and completion of the execution.
ACCEPTANCE, COMPLETION = 0b1000, 0b0001


def _close_packet(identification: int, count: int, content: bytes) -> bytes:
    """Primary header, content, CRC. The length field is one less than what follows it."""
    length = len(content) + _CRC.size - 1
    packet = _PRIMARY.pack(_SECONDARY | identification, _UNSEGMENTED | count, length) + content
    return packet + _CRC.pack(crc16(packet))


def packet_size(header: bytes | bytearray) -> int:
    """Bytes of the packet that begins with this primary header."""
    return PRIMARY_BYTES + 1 + (header[4] << 8 | header[5])


def request_id(packet: bytes) -> bytes:
    """The four bytes by which reports name a telecommand: ECSS-E-ST-70-41C, 8.1.2.1."""
    return packet[:4]


def read_telecommand(packet: bytes, apid: int) -> Telecommand:
    """A telecommand to an application process; `Malformed` for anything else."""
    count = _check_packet(packet, _TELECOMMAND, apid, _SECONDARY_TC.size)
    first, service, subtype, source = _SECONDARY_TC.unpack_from(packet, PRIMARY_BYTES)
    data = packet[PRIMARY_BYTES + _SECONDARY_TC.size : -_CRC.size]
    return Telecommand(apid, count, first & 0xF, service, subtype, source, data)


def read_telemetry(packet: bytes, apid: int) -> Telemetry:
    """A report of an application process; `Malformed` for anything else."""
    count = _check_packet(packet, 0, apid, _SECONDARY_TM.size + TIME_BYTES)
    _, service, subtype, counter, destination = _SECONDARY_TM.unpack_from(packet, PRIMARY_BYTES)
    at = PRIMARY_BYTES + _SECONDARY_TM.size
    time_s, _ = read_cds(packet[at : at + TIME_BYTES])
    data = packet[at + TIME_BYTES : -_CRC.size]
    return Telemetry(apid, count, service, subtype, counter, destination, time_s, data)


def _check_packet(packet: bytes, kind: int, apid: int, second: int) -> int:
    """Sequence count of a packet that is what it must be. `second`: bytes of secondary header."""
    if len(packet) < PRIMARY_BYTES + second + _CRC.size or len(packet) != packet_size(packet):
        raise Malformed("length")
    if crc16(packet):
        raise Malformed("checksum")
    identification, sequence, _ = _PRIMARY.unpack_from(packet)
    flags = identification & ~IDLE_APID, sequence & _UNSEGMENTED, packet[PRIMARY_BYTES] >> 4
    if flags != (kind | _SECONDARY, _UNSEGMENTED, _PUS_C):
        raise Malformed("version")
    if identification & IDLE_APID != apid:
        raise Malformed("apid")
    return sequence & ~_UNSEGMENTED


def is_telecommand(packet: bytes) -> bool:
    """Whether a primary header is there that says so: then the packet has a request ID."""
    return len(packet) >= PRIMARY_BYTES and packet[0] >> 4 == _TELECOMMAND >> 12


def is_idle(packet: bytes) -> bool:
    """Whether it only fills a frame."""
    return len(packet) >= PRIMARY_BYTES and (packet[0] << 8 | packet[1]) & IDLE_APID == IDLE_APID


def cds(time_s: int) -> bytes:
    """The time code of a time [s since 2010-01-01], from 0 to 2^32 - 1."""
    days, rest_s = divmod(time_s, _DAY_S)
    return _CDS.pack(_CDS_PREAMBLE, _EPOCH_DAYS + days & 0xFFFF, rest_s * 1000)


def read_cds(code: bytes) -> tuple[int, int]:
    """Whole seconds since 2010-01-01, at most 2^32 - 1, and milliseconds; `Malformed` if none."""
    if len(code) != _CDS.size:
        raise Malformed("length")
    preamble, days, ms = _CDS.unpack(code)
    if preamble != _CDS_PREAMBLE or ms >= _DAY_S * 1000:
        raise Malformed("time")
    time_s = (days - _EPOCH_DAYS) % 2**16 * _DAY_S + ms // 1000
    return min(time_s, _LATEST_S), ms % 1000
