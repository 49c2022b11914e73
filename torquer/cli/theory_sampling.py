"""Sampled laws in `torquer theory`: the rate they can damp and the largest stable gain."""

import math

from torquer.cli import theory_text as text
from torquer.cli.theory_options import AveragedCase
from torquer.theory.gains import bdot_greatest_gain, damping_efficiency, sampling_limit_rad_s


def sampling_data(case: AveragedCase) -> dict | None:
    """The analysis as plain data; None without sampling."""
    if case.sampling is None:
        return None
    times, rate = case.sampling.times, _rate(case)
    return {
        **case.sampling._asdict(),
        "limit_deg_s": math.degrees(sampling_limit_rad_s(*times)),
        "rate_deg_s": math.degrees(rate),
        "efficiency": float(damping_efficiency(rate, *times)),
        "greatest_gain": _greatest_gain(case),
    }


def _rate(case: AveragedCase) -> float:
    """Rate [rad/s] to be damped: of the body, or of its precession in nutation damping."""
    spinner = case.spinner
    across = spinner.momentum_n_m_s / spinner.transverse_kg_m2
    if case.law == "nutation_damping":
        return across
    along = spinner.momentum_n_m_s / spinner.axial_kg_m2
    return math.hypot(across * math.sin(case.theta), along * math.cos(case.theta))


def _greatest_gain(case: AveragedCase) -> float | None:
    spinner, sampling = case.spinner, case.sampling
    if case.law != "bdot" or sampling is None or not sampling.is_in_step:
        return None
    return bdot_greatest_gain(
        min(spinner.transverse_kg_m2, spinner.axial_kg_m2), spinner.strength_t, sampling.hold_s,
        difference_s=sampling.difference_s, lag_s=sampling.lag_s, measure_s=sampling.measure_s,
    )  # fmt: skip


def sampling_lines(case: AveragedCase) -> list[str]:
    """The analysis in words."""
    found = sampling_data(case)
    if found is None or case.sampling is None:
        return []
    what = "precession" if case.law == "nutation_damping" else "rotation"
    lines = [
        f"with {case.sampling.in_words} it damps {what} up to {found['limit_deg_s']:.3g} "
        f"deg/s; at the initial {found['rate_deg_s']:.3g} deg/s with "
        f"{100.0 * found['efficiency']:.3g} % of the ideal damping"
    ]
    if found["greatest_gain"] is not None:
        lines.append(
            "in a field of B0 slow motion is stable up to a gain of "
            f"{found['greatest_gain']:.3g} {text.UNITS[case.law]}"
        )
    return lines


def sampling_notes(case: AveragedCase) -> list[str]:
    """A note where the initial rate exceeds the limit: averaging is not valid there."""
    found = sampling_data(case)
    if found is None or found["rate_deg_s"] <= found["limit_deg_s"]:
        return []
    return ["the sampled law does not damp the initial rate: averaging is not valid"]
