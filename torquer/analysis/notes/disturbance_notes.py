"""What the author of disturbance torques and Sun sensors should know before the run."""

import math
from collections.abc import Iterator

import numpy as np

from torquer.analysis.budget import coil_reach
from torquer.analysis.notes.assess import assess
from torquer.scenario.spec import Scenario
from torquer.spacecraft.sensors.sun_sensor import BlindZone, SunSensors

#: Strength of the field in low orbits [T], about.
_FIELD_T = 4e-5
#: Half field of view [deg] below which a Sun sensor is no cosine detector.
_COSINE_DEG = 75.0
#: A turn of readings [deg] that is no longer small.
_LARGE_BIAS_DEG = 5.0
#: Turn [rad] within the time constant of an energy sink, and part of the inertia that it has, from
#: where on it is no fast and small damper.
_LATE, _LARGE_DAMPER = 0.3, 0.2


def disturbance_notes(scenario: Scenario) -> list[str]:
    """Notes on disturbance torques and Sun sensors, one line each."""
    notes = [*assess({"the Sun sensors": _sensor_notes}, scenario.spacecraft.sun_sensors)]
    return notes if scenario.disturbance is None else [*notes, *assess(_CHECKS, scenario)]


def _reach_a_m2(scenario: Scenario) -> float | None:
    """Length of the coils' greatest dipoles along the body axes; None without coils."""
    coils = scenario.spacecraft.coils
    return None if coils is None else float(np.linalg.norm(coil_reach(coils)))


def _constant_notes(scenario: Scenario) -> Iterator[str]:
    torque, reach = math.hypot(*scenario.disturbance.constant_torque_n_m), _reach_a_m2(scenario)
    if reach is not None and torque > reach * _FIELD_T:
        yield (
            f"the constant torque of {torque:.3g} N m exceeds what the coils can give in a field "
            f"of {_FIELD_T:g} T, {reach * _FIELD_T:.2g} N m"
        )


def _dipole_notes(scenario: Scenario) -> Iterator[str]:
    dipole, reach = scenario.disturbance.residual_dipole, _reach_a_m2(scenario)
    if dipole is None:
        return
    size = math.hypot(*dipole.constant_a_m2) + math.hypot(*dipole.amplitude_a_m2)
    if size == 0.0:
        yield "disturbance.residual_dipole has no effect: its dipoles are zero"
    elif reach is not None and size > reach:
        yield (
            f"the residual dipole of up to {size:.3g} A m^2 exceeds the coils' greatest, "
            f"{reach:.3g} A m^2"
        )


def _light_notes(scenario: Scenario) -> Iterator[str]:
    light = scenario.disturbance.solar_pressure
    if light is None:
        return
    parts = light.parts or scenario.spacecraft.aerodynamics.parts
    if not any(any(part.centre_m) for part in parts):
        yield (
            "disturbance.solar_pressure gives no torque with the parts as given: each has its "
            "centre (centre_m) at the centre of mass; a campaign may shift them"
        )


def _eddy_notes(scenario: Scenario) -> Iterator[str]:
    """A damping time that no satellite has."""
    eddies, body = scenario.disturbance.eddy_currents, scenario.spacecraft.body
    if eddies is None:
        return
    greatest = float(np.abs(eddies.damping_n_m_s_per_t2).max())
    if greatest == 0.0:
        yield "disturbance.eddy_currents has no effect: its damping is zero"
        return
    time_s = float(body.principal()[0][0]) / (greatest * _FIELD_T**2)
    if time_s < scenario.orbit.period_s:
        yield (
            f"eddy currents brake the rotation within about {time_s:.2g} s, less than a "
            "revolution; in real satellites this takes days to years (damping_n_m_s_per_t2)"
        )


def _sink_notes(scenario: Scenario) -> Iterator[str]:
    """A damper that is not fast, or not small."""
    sink, body = scenario.disturbance.energy_sink, scenario.spacecraft.body
    if sink is None:
        return
    damper = float(np.linalg.eigvalsh(sink.damper())[-1])
    if damper == 0.0:
        yield "disturbance.energy_sink has no effect: its damper has no inertia"
        return
    moments, omega = body.principal()[0], scenario.motion_at_start()[4:]
    momentum = np.array(body.inertia) @ omega + body.wheel_momentum_n_m_s
    late = float(np.linalg.norm(momentum)) / float(moments[0]) * sink.time_constant_s
    if late > _LATE:
        yield (
            f"disturbance.energy_sink is for a damper that follows at once: at the start the body "
            f"turns by up to {late:.2g} rad within its time_constant_s of "
            f"{sink.time_constant_s:g} s, and the damping is overstated"
        )
    if damper > _LARGE_DAMPER * float(moments[0]):
        yield (
            f"disturbance.energy_sink is for a small damper: its {damper:.3g} kg m^2 are "
            f"{100.0 * damper / float(moments[0]):.0f} % of the body's least moment of inertia"
        )


def _unmodelled_notes(scenario: Scenario) -> Iterator[str]:
    torque = scenario.disturbance.unmodelled
    if torque is None:
        return
    sizes = (torque.constant_n_m, torque.harmonic_1_n_m, torque.harmonic_2_n_m)
    if not any(sizes):
        yield "disturbance.unmodelled has no effect: its sizes are zero"
        return
    if torque.hold_s >= scenario.length_s:
        yield (
            f"the unmodelled torque does not jump: its coefficients are held for "
            f"{torque.hold_s:g} s, as long as the run or longer"
        )
    # three components each; sine and cosine share a variance between them
    usual = math.sqrt(3.0) * math.hypot(*sizes)
    moments = scenario.spacecraft.body.principal()[0]
    rate = scenario.orbit.rate_rad_s(scenario.start)
    gravity = 1.5 * rate**2 * float(moments[2] - moments[0])
    if usual > gravity:
        yield (
            f"the unmodelled torque is {usual:.2g} N m (RMS), beyond the greatest gravity-gradient "
            f"torque of {gravity:.2g} N m; SDOT, section 3.2, has a third to a half of that"
        )


def _sensor_notes(sensors: SunSensors | None) -> Iterator[str]:
    if sensors is None:
        return
    fields = sensors.half_fields_deg()
    for k, axis in enumerate(sensors.axes):
        if any(_covers(zone, k, axis, fields[k], len(fields)) for zone in sensors.blind_zones):
            yield f"Sun sensor {k} sees nothing: its field of view is within a blind zone"
    worst = float(np.linalg.norm(np.atleast_2d(sensors.bias_deg), axis=1).max())
    if worst > _LARGE_BIAS_DEG:
        yield f"a Sun sensor's bias of {worst:.3g} deg is more than a small mounting error"
    if sensors.albedo > 0.0 and fields.min() < _COSINE_DEG:
        yield (
            "spacecraft.sun_sensors.albedo is for cosine detectors on all sides, and their fields "
            f"of view are wider than +-{fields.min():.3g} deg: sensors that resolve the Sun's disc "
            "are not misled by the Earth"
        )


def _covers(zone: BlindZone, sensor: int, axis, half_field_deg: float, count: int) -> bool:
    """Whether a blind zone covers all of a sensor's field."""
    if sensor not in zone.of(count):
        return False
    apart = math.degrees(math.acos(min(1.0, max(-1.0, float(np.dot(zone.axis, axis))))))
    return apart + half_field_deg <= zone.half_angle_deg


_CHECKS = {
    "the constant torque": _constant_notes,
    "the residual dipole": _dipole_notes,
    "the pressure of sunlight": _light_notes,
    "the eddy currents": _eddy_notes,
    "the energy sink": _sink_notes,
    "the unmodelled torque": _unmodelled_notes,
}
