"""What a mission looks at, held by wheels: nadir, Sun, velocity, ground, a fixed direction.

One axis of the body points to a target, and a second one as near as can be to another, so that the
attitude is whole. The law follows rate and angular acceleration of this reference, and it turns to
it by slews within limits of rate and acceleration: when it begins to work, when the reference
jumps (a place on the ground rises or sets; a command names another target), and after a pause from
which the body comes back elsewhere. The limits are those of a slew relative to the reference, whose
own motion comes on top.
"""

import math
from typing import Annotated, ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from torquer.base.spec import Inertia, unit_vector
from torquer.compile.engine import inlined, kernel
from torquer.computer.blocks.law import OF_SATELLITE, Law
from torquer.computer.blocks.parameters import (
    AnyNumbers,
    InertiaNumbers,
    OnOff,
    Share,
    UnitNumbers,
)
from torquer.computer.informed import MODEL_SUN, PLACE
from torquer.computer.laws.bdot import GAP, shortest_with
from torquer.computer.laws.guidance import (
    Slew,
    Steered,
    ahead,
    slewing,
)
from torquer.computer.laws.held import Attitude
from torquer.computer.laws.law_spec import LawSpec
from torquer.computer.laws.pointing import (
    deviation,
    reference_acceleration,
    reference_motion,
    short_way,
)
from torquer.computer.laws.targets import (
    NO_TARGETS,
    NUMBERS,
    Aim,
    Targets,
    reference_along,
    reference_of,
)
from torquer.computer.laws.wheel_lyapunov import carried_torque
from torquer.maths.geometry.frames import dcm_orbital_to_inertial, ecef_from_geodetic
from torquer.maths.geometry.quaternion import (
    conjugate,
    from_dcm,
    multiply,
    put_quaternion,
    read_quaternion,
    rotate,
    rotate_inverse,
    to_rotation_vector,
)
from torquer.maths.geometry.vec3 import (
    add,
    add_scaled,
    as_matrix,
    as_symmetric,
    as_vector,
    norm,
    put_vector,
    read_vector,
    scale,
    sub,
    sym_vec,
)

Target = Literal["nadir", "sun", "velocity", "orbit_normal", "ground"]
#: Pairs of targets whose attitude is at rest in the orbital frame, whatever the eccentricity.
_IN_ORBIT = {("nadir", "orbit_normal"), ("orbit_normal", "nadir"), ("nadir", "velocity")}
_ZERO = (0.0, 0.0, 0.0)
#: Half the turn [rad] from what was foreseen that makes a slew: less is left to the spring.
_JUMP = 0.01
_NO_SLEW = {
    "has_call": 0.0, "called_s": 0.0, "shortest_s": 0.0, "q_reference": (0.0, 0.0, 0.0, 1.0),
    "omega_reference": _ZERO, "alpha_reference": _ZERO, "slew_start_s": 0.0, "slew_turn": _ZERO,
    "slew_rate": _ZERO, "q_commanded": (0.0, 0.0, 0.0, 1.0),
}  # fmt: skip


class WheelTrackingParameters(NamedTuple):
    """kappa, zeta, both targets, axes made of both to the body (quaternion), J, gravity, limits.

    `place` [m, Earth-fixed]; `to_ecef`: inertial to Earth-fixed axes (rows) at the start of the
    run; `least_sine`: of the elevation; `rate` [rad/s], `acceleration` [rad/s^2] of slews.
    """

    bandwidth: float
    damping: float
    first: Aim
    second: Aim
    q_axes: UnitNumbers
    inertia: InertiaNumbers
    gravity: OnOff
    rate: float
    acceleration: float
    place: AnyNumbers
    least_sine: Share
    to_ecef: tuple


@inlined
def _is_elsewhere(p, q):
    """Whether one attitude differs from another by more than the spring is left."""
    turn = multiply(conjugate(p), q)
    return norm((turn[0], turn[1], turn[2])) > _JUMP


@inlined
def _begin_slew(memory, reference, now, t_s):
    """A slew from what is steered now to the reference."""
    relative = rotate_inverse(now.q, sub(now.omega, reference.omega))
    put_vector(memory.slew_turn, to_rotation_vector(multiply(conjugate(reference.q), now.q)))
    put_vector(memory.slew_rate, relative)
    memory.slew_start_s = t_s


@inlined
def _slewing(p, memory, reference, t_s):
    slew = Slew(read_vector(memory.slew_turn), read_vector(memory.slew_rate))
    return slewing(reference, slew, p.rate, p.acceleration, t_s - memory.slew_start_s)


@inlined
def _expected(memory, interval_s):
    """The reference that the last call foresaw."""
    omega, alpha = read_vector(memory.omega_reference), read_vector(memory.alpha_reference)
    return ahead(Steered(read_quaternion(memory.q_reference), omega, alpha), interval_s)


@inlined
def _follow(inputs, p, memory, reference):
    """Begin a slew where one is needed."""
    t_s, q = inputs.t_s, inputs.estimate.q_body_to_inertial
    interval_s = t_s - memory.called_s
    expected = _expected(memory, interval_s)
    steered, _ = _slewing(p, memory, expected, t_s)
    pause = memory.shortest_s > 0.0 and interval_s > GAP * memory.shortest_s
    if memory.has_call == 0.0 or (pause and _is_elsewhere(steered.q, q)):
        omega = rotate(q, inputs.estimate.omega_body_rad_s)
        _begin_slew(memory, reference, Steered(q, omega, (0.0, 0.0, 0.0)), t_s)
    elif _is_elsewhere(expected.q, reference.q):
        _begin_slew(memory, reference, steered, t_s)
    if memory.has_call == 1.0:
        memory.shortest_s = shortest_with(memory.shortest_s, interval_s)
    memory.has_call, memory.called_s = 1.0, t_s


@inlined
def _torque(inputs, p, steered):
    """That by which the body turns as steered, with spring and damper."""
    error, relative = deviation(inputs, (0.0, 0.0, 0.0, 1.0), steered.q, steered.omega)
    m = carried_torque(inputs, p.inertia, steered.omega, steered.alpha, p.gravity)
    wanted = scale(-2.0 * p.damping * p.bandwidth, relative)
    wanted = add_scaled(wanted, -2.0 * p.bandwidth * p.bandwidth, short_way(error))
    return add(m, sym_vec(p.inertia, wanted))


class AtRestParameters(NamedTuple):
    """kappa, zeta, 1 for the orbital frame, attitude in it, J, gravity."""

    bandwidth: float
    damping: float
    orbital: OnOff
    q_wanted: UnitNumbers
    inertia: InertiaNumbers
    gravity: OnOff


@kernel
def wheel_tracking_at_rest(inputs, parameters, memory):
    """`wheel_tracking` once its slew is over, at targets that are at rest in a frame."""
    p = parameters
    q, turning = reference_motion(inputs, p.orbital)
    turned = reference_acceleration(inputs, p.orbital)
    return _torque(inputs, p, Steered(multiply(q, p.q_wanted), turning, turned))


@kernel
def wheel_tracking(inputs, parameters, memory):
    """Torque on the body M = (that by which it turns as steered) - J (2 zeta kappa w + kappa^2 d).

    w the rate relative to what is steered, d twice the vector part of the turn from it, the short
    way round: errors about all axes have s^2 + 2 zeta kappa s + kappa^2 while they are small.
    """
    p = parameters
    reference = reference_of(inputs, p)
    _follow(inputs, p, memory, reference)
    put_quaternion(memory.q_reference, reference.q)
    put_vector(memory.omega_reference, reference.omega)
    put_vector(memory.alpha_reference, reference.alpha)
    steered, memory.slew_left_rad = _slewing(p, memory, reference, inputs.t_s)
    put_quaternion(memory.q_commanded, steered.q)
    return _torque(inputs, p, steered)


class WheelTracking(LawSpec):
    """Attitude that follows targets, by wheels, with slews within limits."""

    kind: Literal["wheel_tracking"] = "wheel_tracking"
    kernel: ClassVar = wheel_tracking
    memory: ClassVar = _NO_SLEW
    log: ClassVar = {"slew_left_rad": "rad", "q_commanded": "1"}
    steers: ClassVar = "q_commanded"
    answers: ClassVar = "torque"
    satellite: ClassVar = ("to_ecef",)
    axis: unit_vector("axis")
    """Axis in the body to be turned to the target."""
    target: Target | unit_vector("target")
    """'nadir' (the Earth's centre), 'sun', 'velocity', 'orbit_normal' (the orbital angular
    momentum), 'ground' (a place on the Earth), or a direction in the inertial frame. A place out of
    sight is replaced by the nadir. Directions are of the ephemeris on board.
    """
    second_axis: unit_vector("second_axis")
    """Another axis in the body, which is turned about the first as near to the second target as can
    be; where both targets lie along one line, to a fixed direction.
    """
    second_target: Target | unit_vector("second_target")
    """Target of the second axis, as `target`."""
    latitude_deg: Annotated[float, Field(ge=-90.0, le=90.0)] | None = None
    """Geodetic latitude of the place on the ground."""
    longitude_deg: Annotated[float, Field(ge=-360.0, le=360.0)] | None = None
    """Longitude of the place to the east."""
    height_m: Annotated[float, Field(ge=-500.0, le=9000.0)] = 0.0
    """Height of the place above the ellipsoid WGS84."""
    least_elevation_deg: Annotated[float, Field(ge=0.0, lt=90.0)] = 0.0
    """Elevation of the satellite above the place's horizon from which on the place is in sight."""
    bandwidth_rad_s: float = Field(gt=0.0)
    """Natural frequency kappa of the closed loop."""
    damping: float = Field(default=1.0, gt=0.0)
    """Damping ratio zeta; 1 for the shortest time without overshoot."""
    greatest_rate_deg_s: float = Field(gt=0.0)
    """Greatest rate of a slew, relative to the reference. One that begins at more than half of it,
    with a body that turns so, exceeds it while it brakes.
    """
    greatest_acceleration_deg_s2: float = Field(gt=0.0)
    """Greatest angular acceleration of a slew, relative to the reference."""
    inertia_kg_m2: Inertia
    """Inertia of the body with its wheels, as the law knows it: three moments or 3x3."""
    gravity_feedforward: bool = True
    """Whether the wheels take on the gravity torque of the attitude and position known on board."""

    @property
    def targets(self) -> tuple:
        """Both targets."""
        return self.target, self.second_target

    @model_validator(mode="after")
    def _an_attitude(self):
        for key, one, other in (
            ("second_axis", self.axis, self.second_axis),
            ("second_target", *self.targets),
        ):
            same = one == other
            if not isinstance(one, str) and not isinstance(other, str):
                same = np.linalg.norm(np.cross(one, other)) < 1e-3
            if same:
                first = key.removeprefix("second_")
                raise ValueError(
                    f"{key}: must not lie along the {first}, which leaves the turn about it open; "
                    f"received {other if isinstance(other, str) else list(other)}"
                )
        return self

    @model_validator(mode="after")
    def _a_place(self):
        given = {"latitude_deg": self.latitude_deg, "longitude_deg": self.longitude_deg}
        for key, value in given.items():
            if "ground" in self.targets and value is None:
                raise ValueError(f"{key}: must be given for the target 'ground'; received none")
            if "ground" not in self.targets and value is not None:
                raise ValueError(
                    f"{key}: must be left out unless a target is 'ground'; received {value:g}"
                )
        return self

    @property
    def needs(self) -> frozenset[str]:
        """Attitude, rate, tachometers; of the ephemeris what the targets need, or gravity."""
        found = frozenset({"attitude", "rate", "tachometers"})
        found |= MODEL_SUN if "sun" in self.targets else set()
        named = {target for target in self.targets if isinstance(target, str)} - {"sun"}
        return found | PLACE if named or self.gravity_feedforward else found

    def held(self) -> Attitude:
        """What the targets give."""
        p = self.parameters()
        targets = Targets(**{name: getattr(p, name) for name in Targets._fields})
        return Attitude(False, (0.0, 0.0, 0.0, 1.0), targets._replace(to_ecef=()))

    def at_rest(self) -> Law | None:
        """The law between slews, which remembers nothing: for linear theory.

        None for targets that are at rest in neither the orbital nor the inertial frame.
        """
        orbital = self.targets in _IN_ORBIT
        if not orbital and any(isinstance(each, str) for each in self.targets):
            return None
        r, v = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
        targets = self.held().targets._replace(to_ecef=NO_TARGETS.to_ecef)
        q, _ = reference_along(targets, [0.0], [r], [v], [r])
        wanted = tuple(q[0].tolist())
        if orbital:
            wanted = multiply(conjugate(from_dcm(dcm_orbital_to_inertial(r, v))), wanted)
        p = self.parameters()
        parameters = AtRestParameters(
            p.bandwidth, p.damping, float(orbital), wanted, p.inertia, p.gravity
        )
        return Law(
            "wheel_tracking_at_rest", wheel_tracking_at_rest, parameters, (), {}, self.needs,
            spec=self, answers="torque", waits_for=self.needs,
        )  # fmt: skip

    def parameters(self) -> WheelTrackingParameters:
        """Gains, targets, axes, inertia, limits, place."""
        normal = np.cross(self.axis, self.second_axis)
        normal /= np.linalg.norm(normal)
        axes = (self.axis, np.cross(normal, self.axis), normal)
        first, second = (
            Aim(NUMBERS[each], _ZERO) if isinstance(each, str) else Aim(0.0, each)
            for each in self.targets
        )
        place = np.radians((self.latitude_deg or 0.0, self.longitude_deg or 0.0))
        return WheelTrackingParameters(
            self.bandwidth_rad_s,
            self.damping,
            first,
            second,
            from_dcm(as_matrix(axes)),
            as_symmetric(self.inertia_kg_m2),
            float(self.gravity_feedforward),
            math.radians(self.greatest_rate_deg_s),
            math.radians(self.greatest_acceleration_deg_s2),
            as_vector(ecef_from_geodetic(*place, self.height_m)),
            math.sin(math.radians(self.least_elevation_deg)),
            OF_SATELLITE["to_ecef"],
        )
