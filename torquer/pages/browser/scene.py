"""What a page draws of a satellite apart from its telemetry, by the models of its scenario."""

from __future__ import annotations

import math
from datetime import UTC, datetime
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from torquer.scenario.spec import Scenario, Spacecraft

#: Points of the orbit that are drawn.
_POINTS = 121


def scene(spacecraft: Spacecraft) -> dict:
    """Edges of the box that stands for the body, and fields of view of its sensors; body axes.

    The box has the moments of inertia of the body if it is uniform; its size is right only where
    the mass is known.
    """
    return {
        "size_m": size_m(spacecraft),
        "sensors": [*_sun_sensors(spacecraft), *_earth(spacecraft)],
    }


def size_m(spacecraft: Spacecraft) -> list[float]:
    """Edges of a uniform box with the moments of inertia of the body [m]; of 1 kg without mass."""
    x, y, z = np.diagonal(np.array(spacecraft.body.inertia)).tolist()
    mass = spacecraft.body.total_mass_kg() or 1.0
    squares = (y + z - x, z + x - y, x + y - z)
    longest = max(squares)
    return [math.sqrt(6.0 * max(square, 1e-3 * longest) / mass) for square in squares]


def _sun_sensors(spacecraft: Spacecraft) -> list[dict]:
    sensors = spacecraft.sun_sensors
    if sensors is None:
        return []
    fields = sensors.half_field_deg
    halves = fields if isinstance(fields, tuple) else (fields,) * len(sensors.axes)
    return [
        _cone(f"Sun sensor {number}", "sun", axis, half)
        for number, (axis, half) in enumerate(zip(sensors.axes, halves, strict=True))
    ]


def _earth(spacecraft: Spacecraft) -> list[dict]:
    sensor = spacecraft.horizon_sensor
    if sensor is None or sensor.axis is None or sensor.half_field_deg is None:
        return []
    return [_cone("horizon sensor", "earth", sensor.axis, sensor.half_field_deg)]


def _cone(name: str, kind: str, axis, half_angle_deg: float) -> dict:
    return {"name": name, "kind": kind, "axis": list(axis), "half_angle_deg": half_angle_deg}


def orbit(scenario: Scenario, time_ms: int) -> dict:
    """Position, field and Sun at a time [ms since 1970, UTC], and one revolution around it.

    Inertial axes: km, T, unit vector. ValueError where a model ends.
    """
    around = scenario.orbit_environment()
    t_s = (datetime.fromtimestamp(time_ms / 1e3, UTC) - scenario.start).total_seconds()
    half = 0.5 * scenario.orbit.period_s
    times = np.linspace(t_s - half, t_s + half, _POINTS)
    track, _ = around.state(times)
    now = np.array([t_s])
    r, v = around.state(now)
    sun = around.sun(now)[0] - r[0]
    return {
        "position_km": (r[0] / 1e3).tolist(),
        "track_km": (track / 1e3).round(1).tolist(),
        "sun": (sun / np.linalg.norm(sun)).tolist(),
        "field_t": around.field(now, r, v)[0].tolist(),
        "sunlit": float(around.sunlit_fraction(now, r)[0]),
    }
