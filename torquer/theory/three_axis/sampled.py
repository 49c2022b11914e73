"""A held attitude under the computer's cycle: sample, hold, coils off while the field is measured.

From one command to the next the linear equations are solved for unit inputs; a cycle is then

    x_next = Phi x + Gamma m + Lambda t + phi,  m = G (x + noise),

with the dipole m, held for part of the cycle, a constant torque t, and the disturbances phi. The
cycle is shortened or stretched so that a whole number fits into the period (by less than half of
one in as many as there are).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from torquer.base import validate
from torquer.compile.engine import inlined, kernel, released
from torquer.computer.blocks.law import Law
from torquer.maths.geometry.vec3 import put_matrix
from torquer.theory.periodic.floquet import degree_of_stability, multipliers
from torquer.theory.three_axis.floquet import (
    STAGES,
    advance,
    gain_tables,
    room,
    set_identity,
    stage_points,
)
from torquer.theory.three_axis.hold import AttitudeHold
from torquer.theory.validity import Limit, within

HOLD_S = Limit("hold_s", 0.0, open=True)
OFF_S = Limit("off_s", 0.0)
#: Longest step of the integration [rad of u].
_STEP = 2.0 * math.pi / 32.0
#: Steps tabulated at a time.
_CHUNK = 2000
#: Columns of a cycle's inputs: dipole, torque, disturbances.
_DIPOLE, _TORQUE, _REFERENCE, _RESIDUAL = slice(0, 3), slice(3, 6), 6, 7
SOURCES = ("gravity and gyroscopic torque", "residual dipole", "air")


class Cycle(NamedTuple):
    """The dipole is commanded from a reading and held for `hold_s`; then the coils are off."""

    hold_s: float
    off_s: float = 0.0

    @classmethod
    def of_control(cls, control) -> "Cycle":
        """The cycle of a scenario's control table."""
        if control.measure_s > 0.0:
            return cls(control.actuate_s, control.measure_s)
        return cls(control.sample_s)


@kernel
def advance_cycles(slopes, inputs, h, steps, work, y, out):
    """Solutions `[cycles, 6, columns]` over cycles of two parts; `steps` and `h` of each part.

    The nodes of all follow one another; y `[6, columns]`: room.
    """
    node = 0
    for cycle in range(out.shape[0]):
        set_identity(y)
        for part in range(2):
            for _ in range(steps[part]):
                advance(slopes, inputs, node, h[part], work, y)
                node += STAGES
        put_matrix(out[cycle], y)


@inlined
def _add_product(out, first, matrix, rows, y, skipped, size):
    """out = out + matrix `[rows, size]` times y from its row `skipped`; 6 columns."""
    for r in range(rows):
        for k in range(size):
            for c in range(6):
                out[first + r, c] += matrix[r, k] * y[skipped + k, c]


@released
def cycle_transitions(free, drive, tables, weights, work, out):
    """Monodromy matrices `[points, 6, 6]` of the loop.

    `free` `[cycles, 6, 6]`, `drive` `[cycles, 6, 3]`; G = first of the tables
    `[1 + m, cycles, 3, 6]` + weights `[points, m]` times the others. `work`: room `[12, 6]`.
    """
    for point in range(weights.shape[0]):
        y = out[point]
        set_identity(y)
        for cycle in range(free.shape[0]):
            for r in range(3):
                for k in range(6):
                    gain = tables[0, cycle, r, k]
                    for j in range(weights.shape[1]):
                        gain += weights[point, j] * tables[1 + j, cycle, r, k]
                    work[9 + r, k] = gain
            for r in range(9):
                for c in range(6):
                    work[r, c] = 0.0
            _add_product(work, 6, work[9:], 3, y, 0, 6)
            _add_product(work, 0, free[cycle], 6, y, 0, 6)
            _add_product(work, 0, drive[cycle], 6, work, 6, 3)
            for r in range(6):
                for c in range(6):
                    y[r, c] = work[r, c]


@kernel
def delayed_transition(free, drive, gains, waiting, work, y):
    """Monodromy matrix into y `[n, n]`, n = 6 + 3 late, of a loop whose commands wait.

    State: x, then the dipoles under way, `late` of them. Room: `waiting` `[late, 3, n]`, a ring in
    which a command takes the place of the one that is due, and `work` `[12, n]`.
    """
    late, x, moved, pushed = waiting.shape[0], y[:6], work[:6], work[6:]
    set_identity(y)
    for k in range(late):
        put_matrix(waiting[k], y[6 + 3 * k : 9 + 3 * k])
    for cycle in range(free.shape[0]):
        place = waiting[cycle % late]
        np.dot(free[cycle], x, moved)
        np.dot(drive[cycle], place, pushed)
        np.dot(gains[cycle], x, place)
        put_matrix(x, moved)
        x += pushed
    for k in range(late):
        put_matrix(y[6 + 3 * k : 9 + 3 * k], waiting[(free.shape[0] + k) % late])


class Maps(NamedTuple):
    """Cycles of a hold: Phi `[n, 6, 6]`, Gamma and Lambda `[n, 6, 3]`, disturbances
    `[n, 6, sources]` (`SOURCES`), field in the body at the command `[n, 3]` [T]; cycle length
    [s]."""

    free: np.ndarray
    dipole: np.ndarray
    torque: np.ndarray
    disturbed: np.ndarray
    b_body_t: np.ndarray
    cycle_s: float


@dataclass(frozen=True)
class SampledHold:
    """A hold under a cycle; `residual_a_m2`: constant dipole of the satellite in body axes."""

    hold: AttitudeHold
    cycle: Cycle
    residual_a_m2: tuple = (0.0, 0.0, 0.0)

    def __post_init__(self):
        within(HOLD_S, self.cycle.hold_s)
        within(OFF_S, self.cycle.off_s)
        validate.finite("residual_a_m2", self.residual_a_m2, (3,))
        span_s = self.hold.period / self.hold.rate_rad_s
        if sum(self.cycle) > span_s:
            raise ValueError(
                f"cycle: must not be longer than the {self.hold.revolutions} revolutions after "
                f"which the field repeats, {span_s:.6g} s; received {sum(self.cycle):.6g} s"
            )

    def with_law(self, law: Law) -> "SampledHold":
        """The sampled hold under another law; cycles are kept if that holds the same attitude."""
        made = replace(self, hold=self.hold.with_law(law))
        if made.hold._table is self.hold._table:
            made.__dict__["maps"] = self.maps
        return made

    @property
    def count(self) -> int:
        """Cycles in a period."""
        span_s = self.hold.period / self.hold.rate_rad_s
        return round(span_s / sum(self.cycle))

    @cached_property
    def starts(self) -> np.ndarray:
        """u of the commands `[n]`."""
        return np.arange(self.count) * (self.hold.period / self.count)

    @cached_property
    def maps(self) -> Maps:
        """The cycles, solved for unit inputs."""
        length = self.hold.period / self.count
        parts = length * np.array(self.cycle) / sum(self.cycle)
        steps = np.array([math.ceil(part / _STEP) for part in parts], dtype=np.int64)
        h = parts / np.maximum(steps, 1)
        size = max(1, _CHUNK // int(steps.sum()))
        chunks = [self.starts[i : i + size] for i in range(0, self.count, size)]
        pieces = [self._solve(starts, parts[0], h, steps) for starts in chunks]
        solved, b = (np.concatenate(column) for column in zip(*pieces, strict=True))
        blocks = (slice(0, 6), slice(6, 9), slice(9, 12))
        free, dipole, torque = (np.ascontiguousarray(solved[:, :, k]) for k in blocks)
        # the air's torque as it is in the middle of the cycle
        air = self.hold.air_torque(self.hold.instants(self.starts + 0.5 * length))
        disturbed = np.concatenate([solved[:, :, 12:], torque @ air[:, :, None]], axis=2)
        return Maps(free, dipole, torque, disturbed, b, length / self.hold.rate_rad_s)

    def _solve(self, starts, held, h, steps) -> tuple[np.ndarray, np.ndarray]:
        """Solutions over cycles, with the columns of all inputs; field at the commands."""
        hold = self.hold
        first = stage_points(h[0], steps[0])
        offsets = np.concatenate([first, held + stage_points(h[1], steps[1])])
        free = hold.free((starts[:, None] + offsets).ravel())
        on = np.tile(np.arange(len(offsets)) < len(first), len(starts))
        inverse = hold.inverse_inertia / hold.rate_rad_s**2
        inputs = np.empty((len(on), 3, 8))
        inputs[:, :, _DIPOLE] = free.drive * on[:, None, None]
        inputs[:, :, _TORQUE] = inverse
        inputs[:, :, _REFERENCE] = free.forcing
        inputs[:, :, _RESIDUAL] = free.drive @ np.array(self.residual_a_m2)
        columns = 6 + inputs.shape[2]
        out = np.empty((len(starts), 6, columns))
        work, y = room(columns), np.empty((6, columns))
        advance_cycles(free.slopes, inputs, h, steps, work, y, out)
        return out, free.b_body_t[:: len(offsets)]

    @cached_property
    def readout(self) -> np.ndarray:
        """How errors of the readings enter the state at the commands `[n, 6, 6]`."""
        return self.hold.readout(self.hold.instants(self.starts))

    def gains(self, corners: Mapping | None = None) -> np.ndarray | None:
        """Tables of G at the commands `[1 + m, n, 3, 6]`, as `floquet.gain_tables`."""
        return gain_tables(self.hold, self.hold.instants(self.starts), corners)


@dataclass(frozen=True)
class SampledFamily:
    """Monodromy matrices of a sampled hold for any values of some parameters of its law.

    `tables` `[1 + m, n, 3, 6]` of G at the commands.
    """

    sampled: SampledHold
    corners: Mapping[str, tuple[float, float]]
    tables: np.ndarray | None

    @property
    def hold(self) -> AttitudeHold:
        """The hold without its cycle."""
        return self.sampled.hold

    def monodromies(self, values) -> np.ndarray:
        """Matrices `[points, n, n]` for values `[points, m]`, in the order of the corners."""
        values = np.asarray(values, dtype=np.float64)
        if self.tables is None:
            return np.concatenate([self._linearised_for(row) for row in values])
        maps, out = self.sampled.maps, np.empty((len(values), 6, 6))
        work = np.empty((12, 6))
        cycle_transitions(maps.free, maps.dipole, self.tables, values, work, out)
        return out

    def _linearised_for(self, row) -> np.ndarray:
        there = self.hold.with_parameters(**dict(zip(self.corners, row.tolist(), strict=True)))
        gains = there.gains(there.instants(self.sampled.starts))[None]
        return SampledFamily(self.sampled, {}, gains).monodromies(np.empty((1, 0)))

    def degrees(self, values) -> np.ndarray:
        """Degrees of stability [1/rad of u] for values `[points, m]`; minus infinity where the
        motion grows beyond floats."""
        found = degree_of_stability(multipliers(self.monodromies(values)), self.hold.period)
        return np.where(np.isnan(found), -np.inf, found)


def sampled_family(sampled: SampledHold, corners: Mapping | None = None) -> SampledFamily:
    """The family of a sampled hold whose parameters vary within corners (least, greatest)."""
    corners = {name: (float(a), float(b)) for name, (a, b) in (corners or {}).items()}
    return SampledFamily(sampled, corners, sampled.gains(corners))


def delayed_degree(sampled: SampledHold, late: int) -> float:
    """Degree of stability [1/rad of u] if every command waits for `late` whole cycles, one or more.

    Its cost goes with the square of `late`.
    """
    within(Limit("late", 1), late)
    maps, n = sampled.maps, 6 + 3 * late
    y, waiting, work = np.empty((n, n)), np.empty((late, 3, n)), np.empty((12, n))
    delayed_transition(maps.free, maps.dipole, sampled.gains()[0], waiting, work, y)
    return float(degree_of_stability(multipliers(y), sampled.hold.period))
