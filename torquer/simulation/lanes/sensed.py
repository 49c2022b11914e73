"""Which sensors members side by side need not read: those at whose readings no law looks.

A member leaves its motion, and what laws remember. The errors of a sensor are keyed by its own
readings, so leaving it out changes no bit of these.
"""

from collections.abc import Iterable

import numpy as np

from torquer.base.user_source import attributes_read
from torquer.computer.blocks.law import Law
from torquer.simulation.loop.timetable import DELIVER, READ, Timetable
from torquer.spacecraft.sensors.devices import DEVICES

_ALL = frozenset(device.name for device in DEVICES)
#: Sensors by the word with which laws say that they need them.
_BY_NEED = {"rate": "gyro", "attitude": "attitude_sensor"} | {
    device.need or device.name: device.name for device in DEVICES
}
#: Sensors behind each part of a law's inputs; of any other part it may be all of them.
_BEHIND: dict[str, frozenset[str]] = {
    "t_s": frozenset(),
    "ephemeris": frozenset(),
    "coil_dipole_body_a_m2": frozenset(),
    "estimate": frozenset({"gyro", "attitude_sensor"}),
    **{device.given: frozenset({device.name}) for device in DEVICES},
}


def same_timetable(one: Timetable, other: Timetable) -> bool:
    """Whether two members read their sensors and control at the same instants."""
    same = one.cycle_steps == other.cycle_steps and one.late == other.late
    return same and np.array_equal(one.rows, other.rows)


def looked_at(law: Law) -> frozenset[str]:
    """Names of sensors at which a law may look.

    One of the package at those that it needs, by test; one of the user's at those that its text
    names, or at all if that does not tell.
    """
    needed = frozenset(device for need, device in _BY_NEED.items() if need in law.needs)
    if law.is_built_in:
        return needed
    used = attributes_read(law.function)
    return needed.union(*(_BEHIND.get(name, _ALL) for name in ({"all"} if used is None else used)))


def without_unread(timetable: Timetable, laws: Iterable[Law]) -> Timetable:
    """A timetable without the readings at which none of the laws looks.

    Its instants stay: the motion between them is found in the same steps. What several devices or a
    device that takes the place of another read is read in any case, and so are the tachometers,
    after which torques are shared.
    """
    kept = frozenset({"tachometers"}).union(*map(looked_at, laws))
    unread = sum(
        (READ | DELIVER) << row
        for row, device in enumerate(DEVICES)
        if device.name not in kept and not device.integrates
    )
    rows = timetable.rows.copy()
    rows["actions"] &= ~unread
    return timetable._replace(rows=rows)
