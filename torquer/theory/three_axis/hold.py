"""A satellite at the attitude that a law is to hold: its linear equations along the orbit.

With the state x = (theta, w) of `linearise`, u = n t as the time and the dipole m [A m^2]

    theta' = w,  w' = A(u) x + C(u) m + f(u),  m = G(u) x.

A and f come from the very kernel of Euler's equations that the simulation runs, G from the law's.
A, f and the field are tabulated along the orbit. The law has exact readings; it must have no memory
and ask for nothing at the wanted attitude.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar, NamedTuple

import numpy as np

from torquer.base.conventions import EARTH_RATE_RAD_S
from torquer.computer.blocks.law import Law
from torquer.environment.along_orbit import OrbitEnvironment
from torquer.environment.earth.gravity import gravity_gradient_vector
from torquer.environment.table import Table, build_proven
from torquer.spacecraft.aerodynamics import Aerodynamics, aerodynamic_force_and_torque
from torquer.spacecraft.body import Body, Rigid
from torquer.theory.three_axis.linearise import (
    Instants,
    Reference,
    free_slopes,
    law_slopes,
    read_table,
    wanted_motion,
)
from torquer.theory.validity import Limit, within

#: A law whose slopes change more than this with the step, relative to the greatest, is not smooth.
_SMOOTH = 1e-7
#: Bound on the relative error of the table, and the unit in which it holds the field [T].
_TABLE, _FIELD_UNIT = 1e-10, 3e-5
#: Field models that do not turn with the Earth: one revolution is their period.
_FIXED_FIELDS = ("averaged", "direct_dipole")
REVOLUTIONS = Limit("revolutions", 1)


class Free(NamedTuple):
    """The motion without control at points of u: A `[n, 3, 6]`, C `[n, 3, 3]` [1/(A m^2)], f
    `[n, 3]`; field in the body `[n, 3]` [T]."""

    slopes: np.ndarray
    drive: np.ndarray
    forcing: np.ndarray
    b_body_t: np.ndarray


@dataclass(frozen=True)
class AttitudeHold:
    """A law that holds an attitude, the body, and the environment along its orbit.

    For the three-axis law, an inertial reference and no gravity gradient its linear equations are
    those of the text. Source: MAG (4.3.3).

    The law's parameters must have `orbital` and `q_wanted`, as those of `control.pointing` have.
    `revolutions`: after how many the field is taken to repeat; left out, one for a field that does
    not turn with the Earth, else those of about a sidereal day.
    """

    law: Law
    body: Body
    orbit_environment: OrbitEnvironment
    aerodynamics: Aerodynamics | None = None
    revolutions: int | None = None

    #: What the law asks for.
    answers: ClassVar[str] = "dipole"

    def __post_init__(self):
        law = self.law
        if not {"orbital", "q_wanted"} <= law.values().keys():
            raise ValueError(
                f"law {law.name}: must hold an attitude (parameters orbital and q_wanted); "
                f"received {', '.join(law.values()) or 'none'}"
            )
        if law.answers != self.answers or len(law.first_memory()):
            raise ValueError(
                f"law {law.name}: must answer with a {self.answers} and have no memory for linear "
                f"theory; received one with {len(law.first_memory())} cells that answers with a "
                f"{law.answers}"
            )
        if self.revolutions is None:
            object.__setattr__(self, "revolutions", self._usual_revolutions())
        within(REVOLUTIONS, self.revolutions)
        if self.revolutions != int(self.revolutions):
            raise ValueError(f"revolutions: must be a whole number; received {self.revolutions:g}")

    def _usual_revolutions(self) -> int:
        if self.orbit_environment.environment.field.kind in _FIXED_FIELDS:
            return 1
        day = 2.0 * math.pi / EARTH_RATE_RAD_S
        return max(1, round(day / self.orbit_environment.orbit.period_s))

    @classmethod
    def of_scenario(cls, scenario, law: Law | None = None, revolutions: int | None = None):
        """The satellite of a scenario under its only law, or under another."""
        laws = list(scenario.control.named().laws.values())
        if law is None and len(laws) != 1:
            raise ValueError(f"control: must have one law; received {len(laws)}")
        if scenario.spacecraft.wheels is not None:
            raise ValueError("spacecraft.wheels: must be left out for magnetic control alone")
        craft, law = scenario.spacecraft, law or laws[0].law()
        return cls(law, craft.body, scenario.orbit_environment(), craft.aerodynamics, revolutions)

    def with_law(self, law: Law) -> "AttitudeHold":
        """The satellite under another law; tables are kept if that holds the same attitude."""
        made = replace(self, law=law)
        if np.allclose(
            [*made.reference.q_wanted, made.reference.orbital],
            [*self.reference.q_wanted, self.reference.orbital],
            rtol=0.0,
            atol=1e-12,
        ):
            made.__dict__["_table"] = self._table
        return made

    def with_parameters(self, **values) -> "AttitudeHold":
        """The satellite under its law with other parameters."""
        return self.with_law(self.law.with_parameters(**values))

    def with_inertia(self, inertia_kg_m2) -> "AttitudeHold":
        """The satellite with another inertia tensor; the law keeps its own."""
        body = self.body.model_copy(update=self.body.keys_with_inertia(inertia_kg_m2))
        return replace(self, body=body)

    @property
    def rate_rad_s(self) -> float:
        """Orbital rate n [rad/s]."""
        return 2.0 * math.pi / self.orbit_environment.orbit.period_s

    @property
    def period(self) -> float:
        """Span of u after which the field is taken to repeat."""
        return 2.0 * math.pi * self.revolutions

    @cached_property
    def rigid(self) -> Rigid:
        """Constants of Euler's equations, without the air."""
        return self.body.pack()

    @cached_property
    def reference(self) -> Reference:
        """What the law holds."""
        values = self.law.values()
        q = tuple(float(x) for x in values["q_wanted"])
        return Reference(float(values["orbital"]), q, self.rate_rad_s)

    def instants(self, u) -> Instants:
        """What there is along the orbit at points of u, from the start on."""
        around, t_s = self.orbit_environment, np.asarray(u, dtype=np.float64) / self.rate_rad_s
        r, v = around.state(t_s)
        gravity = gravity_gradient_vector(r) * float(around.environment.gravity_gradient)
        b = around.sample(t_s)[:, 3:6]
        return Instants(t_s, r, v, b, np.zeros_like(r), gravity)

    def _field_rate(self, at: Instants) -> np.ndarray:
        """Rate of change of the field [T/s] along the orbit, from what it is a second later."""
        around = self.orbit_environment
        half, whole = (around.sample(t)[:, 3:6] for t in (at.t_s + 0.5, at.t_s + 1.0))
        return 4.0 * half - whole - 3.0 * at.b_t

    def gains(self, at: Instants) -> np.ndarray:
        """G `[n, 3, 6]` [A m^2]: slopes of the law's dipole; ValueError if it has none."""
        slopes, rest = self.slopes_and_rest(at)
        if np.abs(rest).max() > 1e-9 * np.abs(slopes).max():
            raise ValueError(
                f"law {self.law.name}: must ask for no dipole at the wanted attitude for linear "
                f"theory; received one of {np.linalg.norm(rest, axis=1).max():.3g} A m^2"
            )
        return slopes

    def slopes_and_rest(self, at: Instants) -> tuple[np.ndarray, np.ndarray]:
        """Slopes `[n, 3, 6]` of what the law asks for, and what it asks for at the wanted attitude
        `[n, 3]`; ValueError for a law without slopes."""
        slopes, rest = np.empty((at.t_s.size, 3, 6)), np.empty((at.t_s.size, 3))
        law, at = self.law, at._replace(b_rate_t_s=self._field_rate(at))
        packed = law.compile(), law.pack(), law.first_memory()
        by_wheels = self.answers == "torque"
        change = law_slopes(*packed, by_wheels, self.reference, at, slopes, rest)
        size = np.abs(slopes).max()
        if not (np.all(np.isfinite(slopes)) and change <= _SMOOTH * size):
            raise ValueError(
                f"law {law.name}: must be smooth about the wanted attitude for linear theory; "
                f"received one whose slopes are not numbers, or change by {change / size:.2g} "
                "with the step"
            )
        return slopes, rest

    def free(self, u) -> Free:
        """The motion without control at points of u within the period, from the table."""
        t_s, table = np.asarray(u, dtype=np.float64) / self.rate_rad_s, self._table
        rows = np.empty((t_s.size, table.coefficients.shape[2]))
        read_table(table, t_s, rows)
        b = _FIELD_UNIT * rows[:, 21:]
        drive = self.inverse_inertia @ self.torque_of_answer(b) / self.rate_rad_s**2
        return Free(rows[:, :18].reshape(-1, 3, 6), drive, rows[:, 18:21], b)

    def torque_of_answer(self, b_body_t) -> np.ndarray:
        """Torque [N m] per unit of what the law asks for `[n, 3, 3]`: of a dipole m x B."""
        b, torque = b_body_t, np.zeros((len(b_body_t), 3, 3))
        torque[:, [0, 1, 2], [1, 2, 0]] = b[:, [2, 0, 1]]
        torque[:, [1, 2, 0], [0, 1, 2]] = -b[:, [2, 0, 1]]
        return torque

    @cached_property
    def _table(self) -> Table:
        """A, f and the field along the orbit."""
        span_s = self.period / self.rate_rad_s
        self.orbit_environment.check_dates(0.0, span_s)
        whole = (slice(0, 24),)
        first_s = self.orbit_environment.segment_s
        return build_proven(self._free_rows, span_s, first_s, _TABLE, whole).table

    def _free_rows(self, t_s) -> np.ndarray:
        """What is tabulated `[n, 24]`: A, f, field in the body in a unit of its size."""
        at = self.instants(t_s * self.rate_rad_s)
        slopes, rest = np.empty((t_s.size, 3, 6)), np.empty((t_s.size, 3))
        free_slopes(self.rigid, self.reference, at, slopes, rest)
        b = self.to_body(at, at.b_t) / _FIELD_UNIT
        return np.hstack([slopes.reshape(-1, 18), rest, b])

    @cached_property
    def inverse_inertia(self) -> np.ndarray:
        """Inverse of the inertia tensor [1/(kg m^2)]."""
        return np.linalg.inv(np.array(self.body.inertia))

    def to_body(self, at: Instants, vectors) -> np.ndarray:
        """Inertial vectors `[n, 3]` in the axes of a body that is held exactly."""
        q, rates = np.empty((at.t_s.size, 4)), np.empty((at.t_s.size, 3))
        wanted_motion(self.reference, at, q, rates)
        axis, t = -q[:, :3], 2.0 * np.cross(-q[:, :3], vectors)
        return vectors + q[:, 3:] * t + np.cross(axis, t)

    def readout(self, at: Instants) -> np.ndarray:
        """How errors of the readings, turn [rad] and rate over n, enter the state as the law reads
        it `[n, 6, 6]`: with a wrong attitude the reference's own rate is taken off wrongly, too."""
        q, rates = np.empty((at.t_s.size, 4)), np.empty((at.t_s.size, 3))
        wanted_motion(self.reference, at, q, rates)
        matrices = np.tile(np.eye(6), (at.t_s.size, 1, 1))
        for k, each in enumerate(np.eye(3)):
            matrices[:, 3:, k] = -np.cross(rates / self.rate_rad_s, each)
        return matrices

    def air_torque(self, at: Instants) -> np.ndarray:
        """Aerodynamic torque `[n, 3]` [N m] on a body that is held exactly."""
        if self.aerodynamics is None:
            return np.zeros((at.t_s.size, 3))
        surface = self.aerodynamics.pack()
        flows = self.to_body(at, self.orbit_environment.flow(at.t_s))
        return np.array([aerodynamic_force_and_torque(surface, tuple(f))[1] for f in flows])


def affine_gains(hold: AttitudeHold, at: Instants, corners: Mapping[str, tuple[float, float]]):
    """Tables of G for parameters in which the law's slopes are affine: constant part, then one per
    name; None if they are not. `corners`: least and greatest value of each."""
    low = {name: low for name, (low, _) in corners.items()}
    base = hold.with_parameters(**low).gains(at)
    tables = [base]
    for name, (least, most) in corners.items():
        slope = (hold.with_parameters(**{**low, name: most}).gains(at) - base) / (most - least)
        tables.append(slope)
        tables[0] = tables[0] - least * slope
    for part in (1.0, 0.37):
        there = {n: a + part * (b - a) for n, (a, b) in corners.items()}
        true = hold.with_parameters(**there).gains(at)
        made = tables[0] + sum(v * t for v, t in zip(there.values(), tables[1:], strict=True))
        if np.abs(made - true).max() > 1e-9 * np.abs(true).max():
            return None
    return np.array(tables)
