"""Nutation damping: B-dot with the coil about the spin axis alone.

MAG 3.1. The torque has no part along the axis: the spin stays, what turns across it is braked.
The fast-rotation forms of MAG hold for spins well above the orbital rate.
"""

from typing import ClassVar, Literal

from pydantic import Field

from torquer.compile.engine import kernel
from torquer.computer.laws.bdot import PREVIOUS_READING, bdot_derivative, bdot_difference, bdot_rate
from torquer.computer.laws.spin_axis import AboutAxis, one_coil
from torquer.maths.geometry.vec3 import dot


@kernel
def nutation_damping_derivative(inputs, parameters, memory):
    """m = -k (dB/dt . e3) e3, the field's rate in the body read directly. Source: MAG (3.1.1)."""
    wanted = bdot_derivative(inputs, parameters, memory)
    return one_coil(parameters, dot(wanted, parameters.axis))


@kernel
def nutation_damping_rate(inputs, parameters, memory):
    """m = k ((omega x B) . e3) e3 from gyro and magnetometer; for fast rotation."""
    wanted = bdot_rate(inputs, parameters, memory)
    return one_coil(parameters, dot(wanted, parameters.axis))


@kernel
def nutation_damping_difference(inputs, parameters, memory):
    """m = -k ((B - B_before) . e3) / (t - t_before) e3; memory as that of `bdot_difference`."""
    wanted = bdot_difference(inputs, parameters, memory)
    return one_coil(parameters, dot(wanted, parameters.axis))


class _NutationDamping(AboutAxis):
    """Nutation damping; the gain in A m^2 s/T (the same as N m s/T^2)."""

    gain_a_m2_s_per_t: float | None = Field(default=None, gt=0.0)
    """Gain of the law; A m^2 s/T is the same as N m s/T^2. Either it or `relay_dipole_a_m2` is
    given.
    """
    gain_key: ClassVar = "gain_a_m2_s_per_t"


class NutationDamping(_NutationDamping):
    """On-board nutation damping: finite difference of two magnetometer readings."""

    kind: Literal["nutation_damping"] = "nutation_damping"
    kernel: ClassVar = nutation_damping_difference
    memory: ClassVar = PREVIOUS_READING
    needs: ClassVar = frozenset({"magnetometer"})


class NutationDampingRate(_NutationDamping):
    """Nutation damping from gyro and magnetometer."""

    kind: Literal["nutation_damping_rate"] = "nutation_damping_rate"
    kernel: ClassVar = nutation_damping_rate
    needs: ClassVar = frozenset({"magnetometer", "rate"})


class NutationDampingDerivative(_NutationDamping):
    """Nutation damping from a direct reading of the field's rate of change (search coil)."""

    kind: Literal["nutation_damping_derivative"] = "nutation_damping_derivative"
    kernel: ClassVar = nutation_damping_derivative
    needs: ClassVar = frozenset({"search_coil"})
