"""The imbalance of wheels as a cause of a pointing budget."""

import numpy as np

from torquer.analysis.causes import RANDOM, Cause
from torquer.analysis.pointing.predicted import Effect, no_error, wheel_speeds
from torquer.analysis.pointing.setting import Setting
from torquer.base.limits import RequestError
from torquer.design.requests import PointingRequest
from torquer.theory.three_axis.effects import Spread
from torquer.theory.three_axis.imbalance import ABOVE, FAST, shaken

_G_MM2, _G_MM, _MM = 1e-9, 1e-6, 1e-3


def imbalance(setting: Setting, request: PointingRequest) -> tuple[Cause, Effect | str] | None:
    """The cause and its effect, or why it has none; None where no imbalance is given.

    RequestError for an imbalance of a satellite without wheels.
    """
    dynamic, static = request.dynamic_imbalance_g_mm2, request.static_imbalance_g_mm
    if dynamic is None and static is None:
        return None
    if setting.scenario.spacecraft.wheels is None:
        key = "dynamic_imbalance_g_mm2" if dynamic else "static_imbalance_g_mm"
        raise RequestError(key, "must be left out for a satellite without wheels")
    cause = Cause("imbalance", "wheels: imbalance", RANDOM, "")
    return cause, _effect(setting, request)


def _effect(setting: Setting, request: PointingRequest) -> Effect | str:
    wheels, loop = setting.scenario.spacecraft.wheels, setting.loop
    speeds = wheel_speeds(setting)
    if speeds is None:
        return "the momentum alone does not tell the speeds of so many wheels"
    is_slow = np.abs(speeds[setting.first :]) < ABOVE * _bandwidth_rad_s(setting)
    if not FAST.holds(float(is_slow.mean(axis=0).max())):
        return f"{FAST.name}, {FAST.must}: {FAST.why}"
    sizes = (
        _G_MM2 * (request.dynamic_imbalance_g_mm2 or 0.0),
        _G_MM * (request.static_imbalance_g_mm or 0.0),
        _MM * (request.wheel_distance_mm or 0.0),
    )
    inertia = np.array(setting.hold.body.inertia)
    covariance = shaken(inertia, wheels.array().axes, *sizes)
    count, none = len(loop.t_s), no_error(len(loop.t_s))
    windows = count // setting.size
    spread = Spread(np.tile(covariance, (count, 1, 1)), np.zeros((windows, 3, 3)))
    return Effect(none._replace(spread=spread), none)


def _bandwidth_rad_s(setting: Setting) -> float:
    """The loop's greatest natural frequency [rad/s], by the spring of its law."""
    hold = setting.hold
    stiffness = hold.inverse_inertia @ setting.loop.gains[0, :, :3]
    return float(np.sqrt(np.abs(np.linalg.eigvals(stiffness)).max()))
