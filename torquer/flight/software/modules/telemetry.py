"""Values of the packets that describe the satellite as a whole."""

from __future__ import annotations

import math
from collections.abc import Sequence

from torquer.flight.software.modules.state_vector import newest_state

DEG = 180.0 / math.pi
#: Unknown numbers of packets: the lowest raw number, which the encoder would take for NaN, too,
#: but not as fast.
_UNIT = -32768 * 3.051850947599719e-5
_NO_Q = (_UNIT,) * 4
_NO_RATE = (-(2.0**31) * 1e-5,) * 3
_UNKNOWN, _MOST = -327.68, 327.67
#: State of a region that the mode table does not have.
_NO_REGION = 255
#: Numbers that the packet `calibration` has room for.
_CALIBRATED = 12
#: Devices with a power switch, in the order of their bits.
DEVICES = ("coils", "wheels", "gyro", "mag", "sun")


def beacon(core) -> tuple:
    """Values of the packet `beacon`."""
    aos, stb, svr = core.status("aos"), core.status("stb"), core.status("svr")
    flags = aos.get("sunlit", 0) + 2 * aos.get("works", 0) + 4 * stb.get("works", 0)
    return (
        aos.get("mode", 0),
        stb.get("mode", 0),
        svr.get("mode", 0),
        flags,
        power_bits(core),
        core.reboots,
        min(core.log.total, 255),
    )


def extended_values(core) -> tuple:
    """Values of the packet `extended`; also of `stored`."""
    inputs, aos, stb, svr = core.inputs, core.status("aos"), core.status("stb"), core.status("svr")
    dipole, torque = core.commanded
    sun = inputs.sun_body
    in_view = 8 if sun[0] or sun[1] or sun[2] else 0
    flags = aos.get("sunlit", 0) + 2 * aos.get("works", 0) + 4 * stb.get("works", 0) + in_view
    flags += 16 * stb.get("spun_up", 0)
    b, gyro, e = inputs.b_body_t, inputs.omega_body_rad_s, inputs.estimate
    return (
        aos.get("mode", 0),
        stb.get("mode", 0),
        svr.get("mode", 0),
        stb.get("actuators", 0),
        flags,
        bits(wrong) if any(wrong := (*e.isolated, *e.isolated_units)) else 0,
        svr.get("rate_class", 0),
        svr.get("angle_class", 0),
        *_attitude(newest_state(core)),
        _within(e.sigma_rad * DEG),
        _within(core.t_s - e.t_s),
        b[0] * 1e9,
        b[1] * 1e9,
        b[2] * 1e9,
        gyro[0] * DEG,
        gyro[1] * DEG,
        gyro[2] * DEG,
        *sun,
        *inputs.wheel_momentum_body_n_m_s,
        *dipole,
        *torque,
        core.now_ms,
    )


def _attitude(state) -> tuple:
    """Attitudes and rates of a state vector."""
    if state is None:
        return (*_NO_Q, *_NO_Q, *_NO_RATE, *_NO_RATE)
    q_o, q_i, w_o, w_i = state[1], state[2], state[3], state[4]
    return (
        *(q_o if q_o[0] == q_o[0] else _NO_Q),
        *(q_i if q_i[0] == q_i[0] else _NO_Q),
        *((w_o[0] * DEG, w_o[1] * DEG, w_o[2] * DEG) if w_o[0] == w_o[0] else _NO_RATE),
        *((w_i[0] * DEG, w_i[1] * DEG, w_i[2] * DEG) if w_i[0] == w_i[0] else _NO_RATE),
    )


def _within(value: float) -> float:
    """A number in the range of its field; unknown and infinite ones are its lowest."""
    if not math.isfinite(value):
        return _UNKNOWN
    return value if value <= _MOST else _MOST


def bits(truths) -> int:
    """Truths as bits, the first the lowest."""
    return sum(1 << place for place, truth in enumerate(truths) if truth)


def power_bits(core) -> int:
    """Power switches of the devices."""
    return bits(core.status(device).get("power", device in core.modules) for device in DEVICES)


def calibration(core, module: str, numbers: Sequence[float]) -> tuple[str, tuple]:
    """The packet `calibration` of a driver, of as many numbers as it has room for."""
    found = numbers[:_CALIBRATED]
    rest = [0.0] * (_CALIBRATED - len(found))
    return "calibration", (core.dictionary.modules[module], len(found), *found, *rest)


def states(core) -> tuple[int, ...]:
    """Values of the packet `modes`: as many regions as it has room for."""
    now, room = core.modes, core.dictionary.down["modes"].fields[0].count
    numbers = [known.index(now[name]) for name, known in core.regions[:room]]
    return (*numbers, *[_NO_REGION] * (room - len(numbers)))


def devices(core) -> tuple:
    """Values of the packet `devices`."""
    found = [core.status(device) for device in DEVICES]
    return (
        power_bits(core),
        bits(device.get("lost", 0) for device in found),
        *(device.get("polls", 0) for device in found),
        *(device.get("errors", 0) for device in found),
    )
