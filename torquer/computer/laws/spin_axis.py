"""What the laws of a spin-stabilised satellite share: the spin axis, its coil, the target.

The spin axis e3 is a unit vector in the body, by default its third axis; one coil is wound about
it. Instead of a gain a law may have a relay: the coil is fully on, in the sense that the law asks
for. (The relay mode of the coils themselves does the same at their limits; a law's own relay lets
each stage of a scheme have its own dipole.)
"""

from typing import ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from torquer.base.spec import unit_vector
from torquer.compile.engine import inlined
from torquer.computer.blocks.parameters import NotNegative, OnOff, UnitNumbers
from torquer.computer.laws.law_spec import LawSpec
from torquer.maths.geometry.quaternion import rotate_inverse
from torquer.maths.geometry.vec3 import scale


class AxisParameters(NamedTuple):
    """Gain, relay dipole [A m^2] (0: none), spin axis in the body."""

    gain: NotNegative
    relay: NotNegative
    axis: UnitNumbers


class PointedParameters(NamedTuple):
    """Gain, relay, axis; 1 to point to the Sun, or else the target in the inertial frame."""

    gain: NotNegative
    relay: NotNegative
    axis: UnitNumbers
    sun: OnOff
    target: UnitNumbers


@inlined
def switch(parameters, wanted_a_m2):
    """Dipole [A m^2] for a coil: the wanted one, or with a relay the relay's with its sign."""
    if parameters.relay > 0.0:
        return parameters.relay * np.sign(wanted_a_m2)
    return wanted_a_m2


@inlined
def one_coil(parameters, wanted_a_m2):
    """Dipole [A m^2] of the coil about the spin axis alone; zero if none is wanted."""
    return scale(switch(parameters, wanted_a_m2), parameters.axis)


@inlined
def target_body(inputs, parameters):
    """Unit vector to the target in the body; zeros while the target is a Sun that is not seen."""
    if parameters.sun == 1.0:
        return inputs.sun_body
    return rotate_inverse(inputs.estimate.q_body_to_inertial, parameters.target)


class AboutAxis(LawSpec):
    """A law with a gain or a relay, and a spin axis."""

    axis: unit_vector("axis") = (0.0, 0.0, 1.0)
    """Spin axis in the body, of any length; one coil is wound about it."""
    relay_dipole_a_m2: float | None = Field(default=None, gt=0.0)
    """Dipole of a relay in place of a gain: the coil is fully on, with the sign that the law asks
    for.
    """
    #: The key that holds the law's gain: its unit differs from law to law.
    gain_key: ClassVar[str] = ""

    @model_validator(mode="after")
    def _gain_or_relay(self):
        gain, relay = getattr(self, self.gain_key), self.relay_dipole_a_m2
        if (gain is None) == (relay is None):
            received = "neither" if gain is None else "both"
            raise ValueError(
                f"{self.gain_key}, relay_dipole_a_m2: one of the two must be given; "
                f"received {received}"
            )
        return self

    def parameters(self) -> AxisParameters:
        """Gain (1 under a relay, which asks for the sign only), relay, axis."""
        gain, relay = getattr(self, self.gain_key), self.relay_dipole_a_m2
        given = (1.0 if gain is None else gain, 0.0 if relay is None else relay)
        return AxisParameters(*given, self.axis)


class Pointed(AboutAxis):
    """A law that also has a target: a direction in the inertial frame, or 'sun'.

    The Sun is taken from the Sun sensors; nothing is done while they do not see it. Another
    direction is brought to the body by the measured attitude.
    """

    target: Literal["sun"] | unit_vector("target")
    """Direction in the inertial frame to which the axis is turned, or 'sun'."""

    #: What the law needs besides what shows its target.
    always_needs: ClassVar[frozenset[str]] = frozenset({"magnetometer"})

    @property
    def needs(self) -> frozenset[str]:
        """The Sun sensors, or the attitude to find another target by."""
        return self.always_needs | {"sun" if self.target == "sun" else "attitude"}

    def parameters(self) -> PointedParameters:
        """Gain, relay, axis, whether to point to the Sun, target."""
        sun = self.target == "sun"
        target = (0.0, 0.0, 0.0) if sun else self.target
        return PointedParameters(*super().parameters(), float(sun), target)
