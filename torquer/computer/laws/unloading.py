"""Unloading of wheels by coils: the field takes away the momentum that the wheels have gathered.

The coils brake the wheels' momentum as B-dot brakes the body: across the field only, which must
turn for all of it to go. The wheels' own law takes the coils' torque on, and so sheds momentum.

When they work is a policy: all the time; from one size of the excess on, until it is below another;
or on parts of the orbit alone, where their torque and their field disturb nothing.
"""

import math
from typing import ClassVar, Literal, NamedTuple

from pydantic import Field, model_validator

from torquer.base.spec import Vector
from torquer.compile.engine import inlined, kernel
from torquer.computer.blocks.parameters import AnyNumber, MomentumNumbers, NotNegative, Share
from torquer.computer.informed import PLACE
from torquer.computer.laws.law_spec import LawSpec
from torquer.environment.field.averaged import argument_of_latitude
from torquer.maths.geometry.vec3 import cross, dot, norm, scale, sub


class UnloadingParameters(NamedTuple):
    """k [1/s], dead band, begin [N m s], h_0 [N m s, body], windows: centre [rad], sine of half.

    A sine of 1 is that of no windows: everywhere.
    """

    gain: float
    dead_band: float
    begin: NotNegative
    wanted_momentum: MomentumNumbers
    centre: AnyNumber
    half_sine: Share


@inlined
def _in_window(inputs, p):
    """Whether the satellite is on a part of the orbit where the coils may work."""
    if p.half_sine == 1.0:
        return True
    r = inputs.ephemeris.r_inertial_m
    u = argument_of_latitude(r, cross(r, inputs.ephemeris.v_inertial_m_s))
    return abs(math.sin(u - p.centre)) <= p.half_sine


@kernel
def unloading(inputs, parameters, memory):
    """m = -(k/B^2) B x (h - h_0) [A m^2]: its torque is -k times what of h - h_0 is across B.

    h the wheels' momentum. No field, h - h_0 below the dead band or not yet so large as to begin,
    or outside the windows: no dipole.
    """
    p, b = parameters, inputs.b_body_t
    excess = sub(inputs.wheel_momentum_body_n_m_s, p.wanted_momentum)
    square, size = dot(b, b), norm(excess)
    if size < p.dead_band:
        memory.works = 0.0
    elif size >= p.begin:
        memory.works = 1.0
    if square == 0.0 or memory.works == 0.0 or not _in_window(inputs, p):
        return (0.0, 0.0, 0.0)
    return scale(-p.gain / square, cross(b, excess))


class Unloading(LawSpec):
    """Unloading of wheels by coils (momentum dumping, desaturation)."""

    kind: Literal["unloading"] = "unloading"
    kernel: ClassVar = unloading
    memory: ClassVar = {"works": 0.0}
    momentum_key: ClassVar = "wanted_momentum_n_m_s"
    gain_per_s: float = Field(gt=0.0)
    """Gain k: the momentum across the field decays as exp(-k t)."""
    wanted_momentum_n_m_s: Vector = (0.0, 0.0, 0.0)
    """Momentum that the wheels are to keep, in body axes."""
    dead_band_n_m_s: float = Field(default=0.0, ge=0.0)
    """The coils are off while the wheels' momentum is closer than this to the wanted one."""

    begin_n_m_s: float | None = Field(default=None, gt=0.0)
    """The coils begin only when the momentum is so far from the wanted one, and then work until it
    is within the dead band; left out: at the dead band.
    """
    window_deg: float | None = Field(default=None, gt=0.0, lt=90.0)
    """The coils work only within this angle along the orbit of `window_centre_deg` and of the point
    opposite; left out: everywhere.
    """
    window_centre_deg: float = Field(default=0.0, ge=-360.0, le=360.0)
    """Argument of latitude of the middle of the windows: 0 for the nodes, 90 for the highest
    latitudes.
    """

    @model_validator(mode="after")
    def _begins_above_the_dead_band(self):
        if self.begin_n_m_s is not None and self.begin_n_m_s < self.dead_band_n_m_s:
            raise ValueError(
                f"begin_n_m_s: must be at least dead_band_n_m_s = {self.dead_band_n_m_s:g}; "
                f"received {self.begin_n_m_s:g}"
            )
        return self

    @property
    def needs(self) -> frozenset[str]:
        """Magnetometer and tachometers; the ephemeris for windows."""
        found = frozenset({"magnetometer", "tachometers"})
        return found if self.window_deg is None else found | PLACE

    def parameters(self) -> UnloadingParameters:
        """Gain, dead band, wanted momentum, windows."""
        begin = self.begin_n_m_s
        return UnloadingParameters(
            self.gain_per_s,
            self.dead_band_n_m_s,
            self.dead_band_n_m_s if begin is None else begin,
            self.wanted_momentum_n_m_s,
            math.radians(self.window_centre_deg),
            1.0 if self.window_deg is None else math.sin(math.radians(self.window_deg)),
        )
