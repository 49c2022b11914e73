"""Gains for three axes by coils alone, from the satellite, its orbit and its coils.

The formula of the averaged theory gives the first pair: the least k_a with the greatest degree, k
as great as the coils allow. The second pair is the best of the exact sampled system, found on grids
(`search`), within the same limit of the coils, B (2 k_a + n k) linear_range <= m: an error of the
linear range, at a rate of that angle per 1/n, asks for no more. The greatest degree alone may lie
next to instability: a gain margin is asked for, too. The third is no pair, but the periodic
linear-quadratic regulator for such errors and dipoles.
"""

import contextlib
import math
from dataclasses import dataclass, replace

import numpy as np

from torquer.base.rows import degrees_text
from torquer.computer.blocks.law import Law
from torquer.computer.laws.three_axis import ThreeAxis
from torquer.theory.three_axis.averaged import (
    channel_factors,
    mean_damping,
    mean_projection,
    plateau_edge,
)
from torquer.theory.three_axis.feedback import attitude_keys, lqr_law
from torquer.theory.three_axis.floquet import exact_stability
from torquer.theory.three_axis.hold import AttitudeHold
from torquer.theory.three_axis.margins import (
    Margins,
    degrees_with_margin,
    find_margins,
    scaled_family,
)
from torquer.theory.three_axis.periodic_lqr import Weights, periodic_lqr
from torquer.theory.three_axis.response import (
    Noise,
    Offsets,
    PointingError,
    pointing_error,
)
from torquer.theory.three_axis.sampled import Cycle, SampledHold, sampled_family
from torquer.theory.three_axis.search import Best, greatest
from torquer.theory.validity import Doubt, Limit, Verdict, judge, within

WEAK_CONTROL = Limit(
    "strength K = k mu_max/n of the fastest channel", most=1.0,
    why="the averaged degree is too high: the formula is not followed further",
    of="gains of a three-axis hold by the formula",
    shown="Floquet multipliers at 30 deg: the averaged degree is a tenth too high",
)  # fmt: skip
#: Of the axis about which coils act least, in the mean over the orbit.
FIELD_TURNS = Limit(
    "the field's turning in the body: part of a torque about its mean direction that coils give",
    1e-6, why="the field does not turn along this orbit: coils cannot act about it",
    of="gains of a three-axis hold",
    shown="the torque of coils, which is across the field: of a fixed field one angle stays free",
    refuses=True,
)  # fmt: skip
LINEAR_RANGE = Limit("linear_range_deg", 0.0, 90.0, open=True)
LIMIT = Limit("limit_a_m2", 0.0, open=True)
GAIN_MARGIN = Limit("gain_margin", 1.0, 100.0)
#: Strengths K of the fastest channel, and k_a over that of the formula, that are tried.
_STRENGTHS, _RATIOS = (0.02, 20.0), (0.05, 50.0)
_GRID, _SPACING = 31, 2e-3
#: Cycles of a revolution in the search; with more of them the gains are practically the same.
_CYCLES = 250
#: Part of the initial error at which a motion counts as settled.
SETTLED = 0.02
RATE, ANGLE = "rate_gain", "angle_gain"
#: Harmonics of the regulator's gains, and weights of its dipole, over the limit, that are tried.
HARMONICS = 2
WEIGHTS = 10.0 ** np.arange(0.0, -4.1, -0.5)
_ALONE = np.empty((1, 0))
STABLE = Limit(
    "degree of the sampled loop [1/rad]", 0.0, open=True, why="the loop is unstable",
    of="error and margins of a three-axis hold", shown="Floquet multipliers of the loop itself",
)  # fmt: skip
#: Notes: relative difference of exact and averaged degree; error of the moments.
_AVERAGES_OFF, _LITTLE_INERTIA = 0.1, 0.05


@dataclass(frozen=True)
class Candidate:
    """A law and what it comes to.

    Degrees [1/rad of u]: `degree` of the sampled loop, `continuous_degree`, `averaged_degree` of
    the equations averaged over u. `settling_s`: time to 2 % of a small error, infinite if unstable.
    `margins`, `error`: None if unstable. `verdict`: whether theory and coils keep their range;
    `notes`: of what else to beware.
    """

    law: Law
    degree: float
    continuous_degree: float
    averaged_degree: float
    settling_s: float
    margins: Margins | None
    error: PointingError | None
    verdict: Verdict
    notes: tuple[str, ...]


@dataclass(frozen=True)
class ThreeAxisDesign:
    """Three laws: scalar gains by the formula, and by search, and the regulator.

    `search`: certificate of the second, in logarithms of k and of k_a over the formula's;
    `strengths`: K of the first two; `weight`: of the regulator's dipole, over the coils' limit.
    """

    formula: Candidate
    refined: Candidate
    regulator: Candidate
    search: Best
    strengths: tuple[float, float]
    weight: float

    @property
    def candidates(self) -> dict[str, Candidate]:
        """All of them by name."""
        return {"formula": self.formula, "refined": self.refined, "regulator": self.regulator}

    def _repr_html_(self) -> str:
        """In notebooks: a row for each law; a dash where it is unstable."""
        from html import escape

        head = ("law", "degree, 1/rad", "settling, h", "steady error, deg", "verdict", "notes")
        rows = [head, *(_gain_row(name, each) for name, each in self.candidates.items())]
        cells = ("".join(f"<td>{escape(cell)}</td>" for cell in row) for row in rows)
        return f"<table>{''.join(f'<tr>{row}</tr>' for row in cells)}</table>"


def _gain_row(name: str, each: Candidate) -> tuple[str, ...]:
    """A law's numbers for people."""
    settling = f"{each.settling_s / 3600.0:.3g}" if math.isfinite(each.settling_s) else "-"
    said = "; ".join(each.verdict.lines()), "; ".join(each.notes)
    return name, f"{each.degree:.3g}", settling, error_text(each.error), *said


def error_text(error: PointingError | None) -> str:
    """The greatest error [deg] for people: no number beyond the linear range, and none of rounding
    where nothing disturbs the satellite."""
    if error is None:
        return "-"
    degrees = math.degrees(error.greatest_rad)
    return degrees_text(degrees) if error.is_linear else "beyond"


@dataclass(frozen=True)
class DesignTask:
    """What gains are designed for: a sampled hold (of its law the attitude alone counts), the
    coils' limit [A m^2] for errors up to `linear_range_deg`, the factor of the dipole
    that must leave it stable, disturbances."""

    sampled: SampledHold
    limit_a_m2: float
    linear_range_deg: float = 10.0
    gain_margin: float = 2.0
    constant_torque_n_m: tuple = (0.0, 0.0, 0.0)
    noise: Noise | None = None
    offsets: Offsets | None = None

    def __post_init__(self):
        within(LIMIT, self.limit_a_m2)
        within(LINEAR_RANGE, self.linear_range_deg)
        within(GAIN_MARGIN, self.gain_margin)

    def error_of(self, sampled: SampledHold, limit_a_m2: float = math.inf) -> PointingError:
        """Steady error of a loop under these disturbances."""
        torque, errors = self.constant_torque_n_m, (self.noise, self.offsets)
        return pointing_error(sampled, torque, *errors, limit_a_m2)

    def with_gains(self, rate_gain: float, angle_gain: float) -> SampledHold:
        """The sampled hold by the three-axis law with these gains."""
        law = ThreeAxis(
            rate_gain_n_m_s_per_t2=rate_gain,
            angle_gain_n_m_per_t2=angle_gain,
            **attitude_keys(self.sampled.hold),
        ).law()
        return self.sampled.with_law(law)


@dataclass(frozen=True)
class _Scales:
    """Channel factors, times the part of the time with a dipole; orbital rate; greatest
    2 k_a + n k; k_a over k^2 of the formula."""

    mu: np.ndarray
    n: float
    allowed: float
    edge: float

    @property
    def strength(self) -> float:
        """K of the fastest channel for k = 1."""
        return float(self.mu.max()) / self.n

    def formula(self) -> tuple[float, float]:
        """k and k_a on the plateau's edge, as great as the coils and averaging allow."""
        c, n = 2.0 * self.edge, self.n
        k = 2.0 * self.allowed / (n + math.sqrt(n * n + 4.0 * c * self.allowed))
        k = min(k, WEAK_CONTROL.most / self.strength)
        return k, self.edge * k * k


def _scales(task: DesignTask, b_body) -> _Scales:
    hold = task.sampled.hold
    duty = task.sampled.cycle.hold_s / sum(task.sampled.cycle)
    mu = duty * channel_factors(hold.body.inertia, mean_damping(b_body))
    field = np.linalg.norm(b_body, axis=1).max()
    allowed = task.limit_a_m2 / (field * math.radians(task.linear_range_deg))
    return _Scales(mu, hold.rate_rad_s, allowed, float(plateau_edge(mu, 1.0)))


def least_held(b_body_t) -> float:
    """Part of a torque that coils give in the mean, about the axis where it is least; fields
    `[n, 3]` [T] at equidistant instants, body axes."""
    return max(0.0, float(np.linalg.eigvalsh(mean_projection(b_body_t))[0]))


def coarser(sampled: SampledHold) -> SampledHold:
    """The sampled hold with a cycle long enough for a quick search."""
    least_s = 2.0 * math.pi / sampled.hold.rate_rad_s / _CYCLES
    factor = max(1.0, least_s / sum(sampled.cycle))
    cycle = Cycle(sampled.cycle.hold_s * factor, sampled.cycle.off_s * factor)
    return replace(sampled, cycle=cycle)


def design_gains(task: DesignTask) -> ThreeAxisDesign:
    """Gains by the formula, the best of the exact sampled system, and the periodic regulator.

    ValueError where the field does not turn in the body; ArithmeticError where no gains are found.
    """
    quick = coarser(task.with_gains(1.0, 1.0))
    judge((FIELD_TURNS, least_held(quick.maps.b_body_t)))
    scales = _scales(task, quick.maps.b_body_t)
    first, best = scales.formula(), _search(task, quick, scales)
    k = math.exp(best.point[0])
    pairs = first, (k, math.exp(best.point[1]) * scales.edge * k * k)
    strengths = pairs[0][0] * scales.strength, pairs[1][0] * scales.strength
    regulator, weight = _regulator(task, quick)
    laws = *(task.with_gains(*pair).hold.law for pair in pairs), regulator
    one, two, three = (assess(task, law, quick) for law in laws)
    return ThreeAxisDesign(one, two, three, best, strengths, weight)


def regulator_of(task: DesignTask, hold: AttitudeHold, weight: float) -> Law:
    """The periodic regulator of errors of the linear range, and of dipoles of that part of the
    coils' limit. ArithmeticError where there is none."""
    angle = math.radians(task.linear_range_deg)
    weights = Weights(angle, angle, weight * task.limit_a_m2)
    return lqr_law(hold, periodic_lqr(hold, weights, 1e-6), HARMONICS)


def _regulator(task: DesignTask, quick: SampledHold) -> tuple[Law, float]:
    """The regulator of errors of the linear range, with the weight of the dipole, of some up to the
    coils' limit, that has the least steady error of those that settle half as fast as any.

    One whose steady error saturates the coils counts only where all do: its verdict says so.
    """
    found: list[tuple[bool, float, float, Law, float]] = []
    for part in WEIGHTS:
        with contextlib.suppress(ArithmeticError):  # too fast for the steps, or not stable
            law = regulator_of(task, quick.hold, part)
            found.append((*_merits(task, quick, law), law, float(part)))
    if not found:
        raise ArithmeticError(
            "design: a periodic regulator must make the sampled loop stable with a gain margin of "
            f"{task.gain_margin:g}; none was found"
        )
    found = [each for each in found if each[0] == min(saturates for saturates, *_ in found)]
    fast = [each for each in found if each[2] >= 0.5 * max(each[2] for each in found)]
    return min(fast, key=lambda each: (each[1], -each[2]))[3:]


def _merits(task: DesignTask, quick: SampledHold, law: Law) -> tuple[bool, float, float]:
    """Whether the steady error alone saturates the coils; this error [rad], noise included; degree
    of the sampled loop. ArithmeticError without the gain margin."""
    sampled = quick.with_law(law)
    factors = np.array([[1.0], [task.gain_margin**0.5], [task.gain_margin]])
    degrees = scaled_family(sampled).degrees(factors)
    if not (degrees > 0.0).all():
        raise ArithmeticError("design: the loop must be stable with its gain margin; it is not")
    error = task.error_of(sampled)
    saturates = bool(np.abs(error.dipoles_a_m2).max() > task.limit_a_m2)
    return saturates, round(error.rms_rad, 9), float(degrees[0])


def _search(task: DesignTask, quick: SampledHold, scales: _Scales) -> Best:
    """Greatest degree over ln k and ln of k_a over the formula's, within the coils' limit."""
    unit = scales.n / scales.mu.max()
    low = np.log([_STRENGTHS[0] * unit, _RATIOS[0]])
    high = np.log([_STRENGTHS[1] * unit, _RATIOS[1]])

    def gains(points):
        k = np.exp(points[:, 0])
        return np.stack([k, np.exp(points[:, 1]) * scales.edge * k * k], axis=1)

    least, most = gains(np.array([low, high]))
    corners = {name: (least[j], most[j]) for j, name in enumerate((RATE, ANGLE))}
    made = sampled_family(quick, corners)

    def degrees(points):
        pairs = gains(points)
        allowed = 2.0 * pairs[:, 1] + scales.n * pairs[:, 0] <= scales.allowed
        found = np.full(len(pairs), -np.inf)
        found[allowed] = degrees_with_margin(made, pairs[allowed], task.gain_margin)
        return found

    try:
        return greatest(degrees, low, high, _GRID, _SPACING)
    except ArithmeticError:
        raise ArithmeticError(
            f"design: gains must make the loop stable with a gain margin of {task.gain_margin:g} "
            f"within the coils' limit of {task.limit_a_m2:g} A m^2; no such gains were found"
        ) from None


def assess(task: DesignTask, law: Law, quick: SampledHold | None = None) -> Candidate:
    """What a law comes to that holds the attitude of the task: any one without memory, smooth about
    that attitude. `quick`: the hold with a coarser cycle, whose tables are used again."""
    sampled = task.sampled.with_law(law)
    quick = coarser(sampled) if quick is None else quick.with_law(law)
    hold, exact = sampled.hold, exact_stability(sampled.hold, 1e-9)
    degree = float(sampled_family(sampled).degrees(_ALONE)[0])
    margins = error = None
    if degree > 0.0:
        margins = find_margins(quick)
        error = task.error_of(sampled, task.limit_a_m2)
    degrees = degree, exact.degree, exact.averaged_degree
    settling_s = settling_time_s(hold, degree)
    return Candidate(
        law, *degrees, settling_s, margins, error, _judge(degree, error), _notes(degrees, margins)
    )


def _judge(degree: float, error: PointingError | None) -> Verdict:
    """The verdict on the loop and its error."""
    return Verdict((Doubt(STABLE, degree, STABLE.why),)) if error is None else error.verdict


def _notes(degrees, margins: Margins | None) -> tuple[str, ...]:
    """Of what to beware: the averages, the moments."""
    _, exact, averaged = degrees
    found = []
    if margins is None and exact > 0.0:
        found.append(f"with a continuous dipole it is stable, to a degree of {exact:.2g}")
    if averaged > 0.0 and abs(exact / averaged - 1.0) > _AVERAGES_OFF:
        found.append(
            f"the averaged equations do not hold: their degree is {averaged:.2g} per rad, the "
            f"exact one {exact:.2g}"
        )
    if margins is not None and margins.inertia < _LITTLE_INERTIA:
        found.append(
            f"moments of inertia wrong by {100.0 * max(margins.inertia, 0.01):.0f} % may make the "
            "loop unstable"
        )
    return tuple(found)


def settling_time_s(hold: AttitudeHold, degree: float) -> float:
    """Time [s] in which a small error falls to 2 % at a degree of stability [1/rad of u]."""
    return math.log(1.0 / SETTLED) / (degree * hold.rate_rad_s) if degree > 0.0 else math.inf
