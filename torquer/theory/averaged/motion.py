"""Averaged motion of a case as plain data: times, limit motions, sampling, gains for a time."""

import math
from dataclasses import replace

import numpy as np

from torquer.base.strict_json import finite_or_none
from torquer.environment.field.averaged import cone_angle
from torquer.theory.averaged.case import POINTED, AveragedCase
from torquer.theory.averaged.conditions import FAST, STILL_FAST, check_case, judge_case
from torquer.theory.averaged.equations import EQUATIONS, INTEGRALS
from torquer.theory.averaged.flights import Flights, find_starts, fly
from torquer.theory.slow.comparison import resonances
from torquer.theory.slow.equilibria import (
    Equilibrium,
    evolution_rates,
    find_equilibria,
    tends_to,
)
from torquer.theory.slow.evolution.model import Slow
from torquer.theory.slow.evolution.sdot import capture_phase, final_momentum, sun_angle
from torquer.theory.slow.gain_and_time import (
    GOALS,
    Start,
    Times,
    design_table,
    gain_at,
    gain_for,
)
from torquer.theory.slow.gains import bdot_greatest_gain, damping_efficiency
from torquer.theory.slow.slow_motion import evolve
from torquer.theory.validity import PRECESSION

_TURN = 2.0 * math.pi
#: Harmonics of the laws here: 2 in the precession angle, 4 in u; none depends on phi.
_HARMONICS = int(PRECESSION.least)
#: Multiples of the gain in a design table; small parameters of one without a gain.
_PARTS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)
_EPS = (0.003, 0.01, 0.03, 0.1, 0.3)
#: Angle to the end of the motion [deg] at which a momentum counts as captured by the Sun.
_CAPTURED_DEG = 5.0


def motion_data(
    case: AveragedCase, part: float, revolutions: float | None = None
) -> tuple[dict, dict]:
    """The averaged motion as plain data, and the slow motions behind it by name.

    `part`: target fraction of the initial value, up to which times count. `revolutions`: length of
    the motions; without it somewhat more than the median time.
    """
    constants, spinner = case.constants, case.spinner
    check_case(case)
    starts = find_starts(case, part)
    times, flights = _times(starts), fly(case, part, _given(case), starts)
    points = tends_to(find_equilibria(evolution_rates(case.evolution, constants)))
    start = None if case.rho is None else Slow(1.0, case.rho, case.sigma, case.theta)
    turns = _turns(times, constants.eps)
    length = revolutions or _length(turns)
    motions = _motions(case, length)
    answer = {
        "law": case.law,
        "gain": case.gain,
        "orbit": {
            "inclination_deg": spinner.inclination_deg,
            "period_s": case.period_s,
            "strength_nt": 1e9 * spinner.strength_t,
            "p": constants.moments[0],
            "cone_deg": math.degrees(cone_angle(math.radians(spinner.inclination_deg))),
        },
        "satellite": {
            "transverse_kg_m2": spinner.transverse_kg_m2,
            "axial_kg_m2": spinner.axial_kg_m2,
            "momentum_n_m_s": spinner.momentum_n_m_s,
            "theta_deg": math.degrees(case.theta),
            "rho_deg": None if case.rho is None else math.degrees(case.rho),
            "eta": list(spinner.eta),
        },
        "eps": constants.eps,
        "verdict": judge_case(case, part, flights).data() | _flown(flights),
        "quantity": GOALS[case.law].name,
        "part": part,
        "revolutions": turns,
        "seconds": {k: v and v * case.period_s for k, v in turns.items()},
        "course_revolutions": length,
        "tends_to": [
            {"description": _describe(case, each), "length_rate": each.length_rate}
            for each in points
        ],
        "sun": _sun_data(case),
        "equations": list(EQUATIONS[case.law]),
        "first_integrals": [
            {"name": name, "formula": formula, "at_start": _value(case, name, start),
             "drift": _drift(motions, name)}
            for name, formula in INTEGRALS[case.law].items()
        ],
        "sampling": sampling_data(case),
        "notes": [*case.notes, *sampling_notes(case), *_caveats(motions), *_warnings(case)],
    }  # fmt: skip
    return answer, motions


def design_data(case: AveragedCase, part: float, revolutions: float | None = None) -> dict:
    """Times over gains as plain data, and the gain with which `part` of the initial value is
    reached in a number of revolutions."""
    check_case(case)
    evolution, spinner, starts = case.evolution, case.spinner, find_starts(case, part)
    times = _times(starts)
    gains = [case.gain * x for x in _PARTS] if case.gain else [
        gain_at(evolution, spinner, eps) for eps in _EPS
    ]  # fmt: skip
    rows = design_table(evolution, spinner, times, gains)
    flights = [fly(case, part, gain, starts) for gain in gains]
    judged = [judge_case(replace(case, gain=gain), part, each)
              for gain, each in zip(gains, flights, strict=True)]  # fmt: skip
    wanted = None if revolutions is None else gain_for(evolution, spinner, times, revolutions)
    return {
        "law": case.law,
        "quantity": GOALS[case.law].name,
        "part": part,
        "period_s": case.period_s,
        "theta_deg": math.degrees(case.theta),
        "rho_deg": None if case.rho is None else math.degrees(case.rho),
        "rows": [
            {"gain": row.gain, "eps": row.eps, "revolutions": _numbers(row.revolutions),
             "verdict": verdict.data() | _flown(each)}
            for row, verdict, each in zip(rows, judged, flights, strict=True)
        ],
        "wanted_revolutions": revolutions,
        "gain_for_it": wanted and _numbers(wanted),
        "sampling": sampling_data(case),
        "notes": [*case.notes, *sampling_notes(case)],
    }  # fmt: skip


def _times(starts: tuple[Start, Start, Start]) -> Times:
    """Slow times to a fraction of the initial value."""
    return Times(*(start.slow for start in starts))


def _flown(flights: Flights) -> dict:
    median = finite_or_none(flights.needed)
    each = [flight.data() for flight in flights.each]
    return {"line": flights.line(), "flown_revolutions": median, "flown": each}


def _given(case: AveragedCase) -> float:
    """The gain of a case that has one."""
    if case.gain is None:
        raise ValueError("gain: must be given; received nothing")
    return case.gain


def _length(turns: dict) -> float:
    """Revolutions to compute: somewhat more than the median time, or ten."""
    median = turns["median"]
    return 10.0 if median is None else 1.3 * median


def _motions(case: AveragedCase, revolutions: float) -> dict:
    """Slow motions from the given direction, or from several, by name."""
    u = np.linspace(0.0, _TURN * revolutions, 400)
    some = (20.0, 60.0, 90.0, 120.0, 150.0) if case.law in POINTED else (10.0, 30.0, 50.0, 70.0,
                                                                           85.0)  # fmt: skip
    starts = np.radians(some) if case.rho is None else [case.rho]
    return {
        f"rho₀ {math.degrees(rho):.3g}°": evolve(
            case.evolution, case.constants, Slow(1.0, float(rho), case.sigma, case.theta), u
        )
        for rho in starts
    }


def _drift(motions: dict, name: str) -> float | None:
    """Largest drift of a first integral; None where it is undefined or infinite."""
    known = [motion.drift.get(name, math.nan) for motion in motions.values()]
    known = [x for x in known if math.isfinite(x)]
    return max(known, default=None)


def _caveats(motions: dict) -> list[str]:
    """Caveats of the motions, each once."""
    return list(dict.fromkeys(note for motion in motions.values() for note in motion.notes))


def _turns(times: Times, eps: float) -> dict:
    """Revolutions; None for never."""
    return _numbers(Times(*(s / (_TURN * eps) for s in times)))


def _numbers(times: Times) -> dict:
    return {name: finite_or_none(x) for name, x in times._asdict().items()}


def _value(case, name, start) -> float | None:
    """A first integral where the direction is known and no logarithm of zero is needed."""
    if start is None:
        return None
    with np.errstate(all="ignore"):
        return finite_or_none(case.evolution.integrals[name](start, case.constants))


def _warnings(case: AveragedCase) -> list[str]:
    """Resonances, and until when averaging is valid."""
    notes, eps, spinner = [], case.constants.eps, case.spinner
    precession = spinner.eta[1]
    slow = Slow(1.0, case.rho or 1.0, case.sigma, case.theta)
    near = [n for n in resonances(spinner, slow, greatest=_HARMONICS, width=max(0.05, eps))
            if n[0] == 0 and 0 < abs(n[1]) <= 2]  # fmt: skip
    if near and FAST.holds(precession):
        _, b, c = near[0]
        notes.append(f"near resonance: {b} x precession {c:+d} x orbital rate is about zero")
    if case.law in ("bdot", "sdot") and precession > STILL_FAST.least:
        notes.append(
            f"averaging is valid until the precession drops to {STILL_FAST.least:g} orbital rates, "
            f"at l = {STILL_FAST.least / precession:.2g}"
        )
    return notes


def sampling_data(case: AveragedCase) -> dict | None:
    """The analysis as plain data; None without sampling."""
    if case.sampling is None:
        return None
    times, rate = case.sampling.times, case.damped_rate_rad_s
    return {
        **case.sampling._asdict(),
        "limit_deg_s": math.degrees(case.sampling.limit_rad_s),
        "rate_deg_s": math.degrees(rate),
        "efficiency": float(damping_efficiency(rate, *times)),
        "greatest_gain": _greatest_gain(case),
    }


def _greatest_gain(case: AveragedCase) -> float | None:
    spinner, sampling = case.spinner, case.sampling
    if case.law != "bdot" or sampling is None or not sampling.is_in_step:
        return None
    return bdot_greatest_gain(
        min(spinner.transverse_kg_m2, spinner.axial_kg_m2), spinner.strength_t, sampling.hold_s,
        difference_s=sampling.difference_s, lag_s=sampling.lag_s, measure_s=sampling.measure_s,
    )  # fmt: skip


def sampling_notes(case: AveragedCase) -> list[str]:
    """A note where the initial rate exceeds the limit: averaging is not valid there."""
    found = sampling_data(case)
    if found is None or found["rate_deg_s"] <= found["limit_deg_s"]:
        return []
    return ["the sampled law does not damp the initial rate: averaging is not valid"]


def _describe(case: AveragedCase, point: Equilibrium) -> str:
    """An equilibrium in words: relative to the Sun for S-dot, else relative to the cone axis."""
    if case.law != "sdot" or point.rho is None:
        return point.description.replace("third axis", "cone axis")
    there = Slow(1.0, point.rho, point.sigma or 0.0, 0.0)
    side = "towards" if sun_angle(there, case.constants) < 0.5 * math.pi else "away from"
    return f"momentum {side} the Sun, {point.description.partition(', ')[2].rpartition(', ')[2]}"


def _sun_data(case: AveragedCase) -> dict | None:
    """Where S-dot brings a momentum of known direction, and when; None for other cases."""
    if case.law != "sdot" or case.rho is None:
        return None
    start, constants = Slow(1.0, case.rho, case.sigma, case.theta), case.constants
    phase = capture_phase(start, constants, math.radians(_CAPTURED_DEG))
    slowest = constants.eps * min(1.0, constants.ratio)
    return {
        "gamma_deg": math.degrees(float(sun_angle(start, constants))),
        "final_momentum": float(final_momentum(start, constants)),
        "captured_deg": _CAPTURED_DEG,
        "revolutions_at_most": phase / (2.0 * math.pi * slowest),
    }
