"""Reason codes of commands and events, as both ends of a link know them."""

from enum import IntEnum
from typing import Self


class Severity(IntEnum):
    """Severity of an event, numbered as the event reports of ECSS-E-ST-70-41C, 8.5.2."""

    INFORMATIVE = 1
    LOW = 2
    MEDIUM = 3
    HIGH = 4


_INFO, _, _MEDIUM, _HIGH = Severity


class Reason(IntEnum):
    """What became of a command, or what happened; below 32 answers to commands. One byte."""

    doc: str
    severity: Severity

    def __new__(cls, value: int, doc: str, severity: Severity = Severity.LOW) -> Self:
        member = int.__new__(cls, value)
        member._value_ = value
        member.doc, member.severity = doc, severity
        return member

    DONE = 0, "executed", _INFO
    UNKNOWN = 1, "no such command"
    LENGTH = 2, "wrong length of the data"
    MODULE = 3, "not a command of the module it is addressed to, or no such module"
    VALUE = 4, "a value out of its range"
    QUEUE_FULL = 5, "dropped from a full queue"
    MODE = 6, "not possible in this mode"
    STATE = 7, "not possible in this state of the module"
    TIME = 8, "an execution time that cannot be kept"
    CHECKSUM = 9, "wrong checksum"
    LATE = 10, "received after its execution time"
    NOT_AVAILABLE = 11, "the device or the data are not there"
    REJECTED = 12, "not authentic, received before, or not a command of this key"
    FAILED = 13, "the execution failed"
    WAITING = 14, "received: waits for its execution time", _INFO
    CANCELLED = 15, "cancelled on board", _INFO

    BOOTED = 32, "the software has started; argument: reboot counter", _INFO
    READY = 33, "all modules have started", _INFO
    SETTINGS_MISSING = 34, "no settings in the memory: defaults are used"
    SETTINGS_DAMAGED = 35, "settings that cannot be read: defaults are used", _MEDIUM
    FILE_MISSING = 36, "a file of the memory is missing, main and reserve", _MEDIUM
    FILE_DAMAGED = 37, "a file of the memory is damaged, main and reserve", _MEDIUM
    RESERVE_USED = 38, "a file was read from the reserve file system"
    FILE_NOT_WRITTEN = 39, "a file system did not take a file", _MEDIUM
    KEPT_OFF = 46, "a module is kept off, for it reset the computer; argument: how often", _HIGH
    DEFAULTS_USED = 47, "defaults are used after resets, whatever the memory holds", _MEDIUM
    FILE_REPAIRED = 45, "a copy of a file was missing, damaged or old, and was written again", _INFO
    TIME_LOST = 40, "no saved time: the clock starts at 2010-01-01", _MEDIUM
    TIME_SET = 41, "the clock was set or shifted; argument: by how much [ms]", _INFO
    WATCHDOG = 42, "a module has not fed the watchdog; argument: its id", _HIGH
    REBOOT = 43, "the software reboots", _INFO
    MODULE_FAILED = 44, "a module ended its step with an error", _MEDIUM
    STALE_STATE = 48, "the state vector is out of date"
    STATE_LOST = 49, "no state vector", _MEDIUM
    MODE_CHANGED = 50, "a mode was changed", _INFO
    SENSOR_SILENT = 51, "a sensor has not answered; argument: its number", _MEDIUM
    SENSOR_ODD = 52, "a sensor reads what cannot be; argument: its number", _MEDIUM
    COIL_FAILED = 53, "a coil does not do what it is commanded; argument: its number", _HIGH
    WHEEL_FAILED = 54, "a wheel does not do what it is commanded; argument: its number", _HIGH
    ACTUATORS_CHANGED = 55, "another configuration of actuators", _INFO
    KEY_CLOSED = 56, "a key is refused: its counter is lost; argument: the key's index", _HIGH
    COUNTER_NOT_KEPT = 57, "refused: the counter could not be stored; argument: key's index", _HIGH
    KEY_CHANGED = 58, "commands have a new key; argument: its number", _INFO
    SPUN_UP = 60, "the satellite spins faster and faster: its coils are off for a while", _HIGH
    OVER_CURRENT = 61, "a device draws too much and was switched off; argument: its id", _HIGH
    TEMPERATURE = 62, "a temperature beyond its limits; argument: id of the device", _MEDIUM
    POWER_CHANGED = 63, "a power switch; argument: id of the device, plus 256 if it is on", _INFO
    FROM_RESERVE = 64, "the reserve file system is used after resets", _HIGH
    UPDATED = 66, "settings of an update are in use; argument: its number", _INFO
    PLAN_LOST = 65, "commands of the plan cannot be read any more", _HIGH


#: Reason codes by why a link rejects a packet.
REJECTIONS = {
    "unknown": Reason.UNKNOWN,
    "length": Reason.LENGTH,
    "module": Reason.MODULE,
    "cut": Reason.REJECTED,
    "checksum": Reason.CHECKSUM,
    "version": Reason.UNKNOWN,
    "apid": Reason.MODULE,
    "value": Reason.VALUE,
    "time": Reason.TIME,
}

#: Why frames and packets of a recording are left out, in words.
LEFT_OUT = {
    "repeated": "came before in the recording",
    "archived": "are in the archive already, or came twice",
    "checksum": "have a wrong checksum",
    "mac": "have a wrong MAC: forged, or made with another key",
    "spacecraft": "are of another spacecraft",
    "apid": "are of another application process",
    "spi": "name a key that is not known",
    "length": "state another length than their packet has",
    "segmented": "are segments of longer packets",
    "unknown": "have an id that the dictionary does not have",
    "status": "have a status that there is not",
    "module": "are of another module",
    "version": "are of another version of space packets",
    "time": "have a time that is none",
    "value": "have a value that cannot be",
    "cut": "are cut off by the next frame or the end",
    "kiss_cut": "are cut off within a KISS frame by an end of the recording",
    "kiss_length": "have a KISS frame of another length than stated",
    "text": "are not read, though almost text in hexadecimal",
    "foreign": "are authentic, but without packets in them",
    "torn": "are incomplete: a part is missing",
    "ambiguous": "are in doubt: their parts could belong to several, counters began again",
}

#: First words of these reasons for one alone.
_ALONE = {"are": "is", "have": "has", "state": "states", "name": "names"}


def left_out_as(reason: str, count: int) -> str:
    """Why so many were left out, in words that follow their number."""
    verb, _, rest = LEFT_OUT[reason].partition(" ")
    return f"{_ALONE.get(verb, verb) if count == 1 else verb} {rest}"


_DOCS = {int(reason): reason.doc for reason in Reason}


def describe_code(code: int) -> str:
    """A reason code in words; those of other software as they are."""
    return _DOCS.get(code, f"code {code}")
