"""Passive magnets of a body: permanent magnets, and hysteresis rods, which remember their field.

A permanent magnet turns the body along the field; rods of a soft material, magnetised by the field
along them, follow it late and so take energy from the rotation. Their flux is a function of the
path of the field, not of its rate.
"""

import math
from typing import NamedTuple

import numpy as np
from pydantic import Field, model_validator

from torquer.base.conventions import MU_0_H_M
from torquer.base.spec import Spec, Vector, unit_vector
from torquer.compile.engine import inlined, records
from torquer.maths.geometry.vec3 import add_scaled, as_vector, cross, dot
from torquer.spacecraft.disturbance.held import FOR_EVER

#: Constants of a rod, or of several alike: axis; coercive field Hc; steepness k of the limiting
#: curves; dipole at 2/pi of saturation; q and p of the slope within them.
ROD = np.dtype(
    [
        (name, np.float64)
        for name in (
            "axis_x", "axis_y", "axis_z", "coercive_a_m", "steepness_m_a", "dipole_a_m2",
            "least_slope", "power",
        )
    ]
)  # fmt: skip
#: What a rod remembers: the field H along it [A/m], and by what part of Hc its flux is behind: it
#: has the flux of the mean curve at H - lag Hc. On the limiting curves the lag is 1 and -1.
ROD_STATE = np.dtype([("field_a_m", np.float64), ("lag", np.float64)])
#: Substeps with an exponent p other than 2, for which there is no closed form.
_SUBSTEPS = 8
#: Share of the way to the limiting curve from where on it is followed as that curve is.
_NEXT_TO_ONE = 1.0 - 1e-12


class Magnets(NamedTuple):
    """Magnets for kernels: dipole of the permanent ones [A m^2, body]; `ROD` of each rod.

    `hold_steps`: after so many steps at most the rods' memory is brought up to date; `memory`:
    `ROD_STATE` of each rod, () where it is kept elsewhere.
    """

    dipole_a_m2: tuple
    rods: np.ndarray
    hold_steps: int
    memory: np.ndarray | tuple = ()


@inlined
def _pace(rod, y):
    """dy/dx of the share tanh y, which is smooth up to the limiting curve: (1 - s^p)/(1 - s^2)."""
    share = math.tanh(y)
    if share > _NEXT_TO_ONE:
        return 0.5 * rod.power
    return (1.0 - share**rod.power) / (1.0 - share * share)


@inlined
def share_after(rod, share, way):
    """Share of the way from one limiting curve to the other, after the field went on.

    `share`: before; `way`: of the field, >= 0, in units of 2 Hc. ds/dx = (1 - q)(1 - s^p), which
    p = 2 turns into the addition theorem of tanh.
    """
    x = (1.0 - rod.least_slope) * way
    if rod.power == 2.0:
        t = math.tanh(x)
        return min((share + t) / (1.0 + share * t), 1.0)
    y, h = math.atanh(min(max(share, 0.0), _NEXT_TO_ONE)), x / _SUBSTEPS
    for _ in range(_SUBSTEPS):
        k1 = _pace(rod, y)
        k2 = _pace(rod, y + 0.5 * h * k1)
        k3 = _pace(rod, y + 0.5 * h * k2)
        k4 = _pace(rod, y + h * k3)
        y += h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
    return math.tanh(y)


@inlined
def lag_after(rod, start, field_a_m):
    """Lag of a rod whose field went straight from that of `start` to this one [A/m].

    T. Flatley, D. Henretty, 'A magnetic hysteresis model' (1995): dB/dH = B'(q + (1 - q) s^p),
    with the slope B' of the limiting curves B = 2/pi Bs atan(k (H -+ Hc)) at the same flux, and
    s = (H - H_L)/(2 Hc) from the curve that the field moves away from. With the field u at which
    the mean curve has the flux, du/dH = q + (1 - q) s^p and s = (1 +- (H - u)/Hc)/2.
    """
    way = field_a_m - start.field_a_m
    sign = 1.0 if way >= 0.0 else -1.0
    share = 0.5 * (1.0 + sign * start.lag)
    after = share_after(rod, share, sign * way / (2.0 * rod.coercive_a_m))
    return sign * (2.0 * after - 1.0)


@inlined
def rod_axis(rods, k):
    """Axis of rod k in the body."""
    rod = rods[k]
    return (rod.axis_x, rod.axis_y, rod.axis_z)


@inlined
def field_along(rods, k, b_body):
    """Field H [A/m] along rod k in a field B [T]."""
    return dot(rod_axis(rods, k), b_body) / MU_0_H_M


@inlined
def rod_dipole(rods, memory, k, b_body):
    """Dipole [A m^2] of rod k along its axis: its volume times B/mu0."""
    rod, field = rods[k], field_along(rods, k, b_body)
    lag = lag_after(rod, memory[k], field)
    return rod.dipole_a_m2 * math.atan(rod.steepness_m_a * (field - rod.coercive_a_m * lag))


@inlined
def magnet_torque(magnets, local_body, omega_body):
    """Torque [N m, body] of permanent magnets and rods: their dipoles times the field.

    The field of the magnets at the rods, and of rods at each other, is left out.
    """
    b, rods, m = local_body.b_t, magnets.rods, magnets.dipole_a_m2
    for k in range(rods.shape[0]):
        m = add_scaled(m, rod_dipole(rods, magnets.memory, k, b), rod_axis(rods, k))
    return cross(m, b)


@inlined
def with_rods(magnets, memory):
    """The magnets with what their rods remember."""
    return Magnets(magnets.dipole_a_m2, magnets.rods, magnets.hold_steps, memory)


@inlined
def remember_field(magnets, memory, b_body):
    """Bring the rods' memory up to date with the field [T, body] of now; `magnets`: () for none."""
    if len(magnets) == 0:
        return
    for k in range(magnets.rods.shape[0]):
        field = field_along(magnets.rods, k, b_body)
        lag = lag_after(magnets.rods[k], memory[k], field)
        memory[k].field_a_m, memory[k].lag = field, lag


@inlined
def next_memory(magnets, step, last):
    """The step at which the rods' memory is brought up to date next, `last` at the latest."""
    if len(magnets) == 0:
        return last
    return min(last, step - step % magnets.hold_steps + magnets.hold_steps)


def first_memory(magnets: Magnets | tuple[()], b_body) -> np.ndarray:
    """Memory of rods that were demagnetised before the field [T, body] of the start came."""
    memory = records(np.zeros(len(magnets.rods) if magnets else 0, ROD_STATE))
    remember_field(magnets, memory, as_vector(b_body))
    return memory


class HysteresisRods(Spec):
    """Rods of a soft magnetic material that are alike and lie along one axis.

    The model of T. Flatley and D. Henretty (1995). Field, remanence and saturation are the
    *apparent* ones of the rod as it is: its own poles weaken the field within it, so that
    its loop is far flatter than that of the material. A rod 95 mm long and 1 mm thick of a
    material with 0.35 T has a remanence of some mT. Measure a rod, or take a published one of the
    same length and thickness.
    """

    axis: unit_vector("axis")
    """Direction of the rods in the body, of any length."""
    count: int = Field(default=1, ge=1)
    """How many there are."""
    volume_m3: float | None = Field(default=None, gt=0.0)
    """Volume of one rod; left out: from `length_m` and `diameter_m`."""
    length_m: float | None = Field(default=None, gt=0.0)
    """Length, for the volume."""
    diameter_m: float | None = Field(default=None, gt=0.0)
    """Diameter, for the volume."""
    coercive_a_m: float = Field(gt=0.0)
    """Apparent coercive field Hc: the field that takes a saturated rod's flux to zero."""
    remanence_t: float = Field(gt=0.0)
    """Apparent remanence Br: the flux that is left of saturation without a field."""
    saturation_t: float = Field(gt=0.0)
    """Saturation Bs."""
    least_slope: float = Field(default=0.0, ge=0.0, lt=1.0)
    """Slope of the flux after the field turns, as part of that of the limiting curves: q0 of the
    paper. It makes small loops narrower."""
    power: float = Field(default=2.0, ge=1.0, le=10.0)
    """Exponent p by which the slope grows towards that of the limiting curve."""

    @model_validator(mode="after")
    def _is_a_rod(self):
        sizes = (self.length_m, self.diameter_m)
        received = "both" if self.volume_m3 else "neither"
        if (self.volume_m3 is None) == (sizes == (None, None)):
            raise ValueError(
                "volume_m3: either it or length_m and diameter_m must be given; received "
                f"{received}"
            )
        if self.volume_m3 is None and None in sizes:
            missing = "length_m" if self.length_m is None else "diameter_m"
            raise ValueError(
                f"{missing}: must be given with the other size of the rod; received none"
            )
        if self.remanence_t >= self.saturation_t:
            raise ValueError(
                f"remanence_t: must be below saturation_t, {self.saturation_t:g} T; received "
                f"{self.remanence_t:g}"
            )
        return self

    def all_volume_m3(self) -> float:
        """Volume of all the rods."""
        one = self.volume_m3
        if one is None:
            one = 0.25 * math.pi * self.diameter_m**2 * self.length_m
        return self.count * one

    def row(self) -> tuple[float, ...]:
        """The rods as one of `ROD`."""
        steepness = math.tan(0.5 * math.pi * self.remanence_t / self.saturation_t)
        greatest = self.all_volume_m3() * self.saturation_t / MU_0_H_M
        return (
            *self.axis,
            self.coercive_a_m,
            steepness / self.coercive_a_m,
            2.0 / math.pi * greatest,
            self.least_slope,
            self.power,
        )


class MagnetKeys(Spec):
    """The passive magnets of a satellite."""

    permanent_magnet_a_m2: Vector = (0.0, 0.0, 0.0)
    """Dipole of permanent magnets in body axes, which turn it along the field; left out: none."""
    hysteresis_rods: tuple[HysteresisRods, ...] = ()
    """Soft magnetic rods, which damp the rotation; left out: none."""
    hysteresis_step_s: float | None = Field(default=None, gt=0.0)
    """Interval after which at the latest the rods' memory is brought up to date: within it their
    flux follows the field as if that did not turn back. Left out: 1 s, or `simulation.step_s`."""

    @model_validator(mode="after")
    def _step_is_of_rods(self):
        if self.hysteresis_step_s is not None and not self.hysteresis_rods:
            raise ValueError(
                "hysteresis_step_s: must be left out without hysteresis_rods; received "
                f"{self.hysteresis_step_s:g} s"
            )
        return self

    def has_magnets(self) -> bool:
        """Whether there are permanent magnets or rods."""
        return any(self.permanent_magnet_a_m2) or bool(self.hysteresis_rods)

    def pack_magnets(self, hold_steps: int) -> Magnets | tuple[()]:
        """Magnets for kernels, whose memory is kept elsewhere; () for none."""
        if not self.has_magnets():
            return ()
        rods = np.array([rods.row() for rods in self.hysteresis_rods], ROD)
        steps = hold_steps if len(rods) else FOR_EVER
        return records(Magnets(as_vector(self.permanent_magnet_a_m2), rods, steps))
