"""What `torquer theory` tells of a sampled law: what it brakes, and how strong it may be."""

import math

from torquer.cli import theory_text as text
from torquer.cli.theory_options import Question
from torquer.theory.gains import bdot_greatest_gain, damping_efficiency, sampling_limit_rad_s


def sampling_told(asked: Question) -> dict | None:
    """The answer as plain data; None where the sampling is not known."""
    if asked.sampling is None:
        return None
    times, rate = asked.sampling[:3], _rate(asked)
    return {
        **asked.sampling._asdict(),
        "limit_deg_s": math.degrees(sampling_limit_rad_s(*times)),
        "rate_deg_s": math.degrees(rate),
        "efficiency": float(damping_efficiency(rate, *times)),
        "greatest_gain": _greatest_gain(asked),
    }


def _rate(asked: Question) -> float:
    """Rate [rad/s] that the law is to brake: of the body, of its precession in nutation damping."""
    spinner = asked.spinner
    across = spinner.momentum_n_m_s / spinner.transverse_kg_m2
    if asked.law == "nutation_damping":
        return across
    along = spinner.momentum_n_m_s / spinner.axial_kg_m2
    return math.hypot(across * math.sin(asked.theta), along * math.cos(asked.theta))


def _greatest_gain(asked: Question) -> float | None:
    spinner, sampling = asked.spinner, asked.sampling
    if asked.law != "bdot" or sampling is None:
        return None
    return bdot_greatest_gain(
        min(spinner.transverse_kg_m2, spinner.axial_kg_m2), spinner.strength_t, sampling.hold_s,
        difference_s=sampling.difference_s, lag_s=sampling.lag_s, measure_s=sampling.measure_s,
    )  # fmt: skip


def sampling_lines(asked: Question) -> list[str]:
    """The same in words."""
    told = sampling_told(asked)
    if told is None or asked.sampling is None:
        return []
    what = "precession" if asked.law == "nutation_damping" else "rotation"
    lines = [
        f"with {asked.sampling.in_words} it brakes a {what} of up to {told['limit_deg_s']:.3g} "
        f"deg/s; at the first {told['rate_deg_s']:.3g} deg/s with "
        f"{100.0 * told['efficiency']:.3g} % of the ideal braking"
    ]
    if told["greatest_gain"] is not None:
        lines.append(
            "in a field of B0 slow motion is stable up to a gain of the law of "
            f"{told['greatest_gain']:.3g} {text.UNITS[asked.law]}"
        )
    return lines


def sampling_notes(asked: Question) -> list[str]:
    """A note where the first rate is beyond what is braked: the averaged motion is not that."""
    told = sampling_told(asked)
    if told is None or told["rate_deg_s"] <= told["limit_deg_s"]:
        return []
    return ["the sampled law does not brake the first rate: the averages do not hold"]
