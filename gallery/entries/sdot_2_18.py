"""SDOT (2.18): the final momentum against simulations of the run of Fig. 3.11.

(2.18) is of the averaged motion; a run depends on the argument of latitude at its start, which is
not printed. So runs from 24 start arguments are flown at several gains, at the text's initial rate
and at ten times that rate. Why the scatter falls more slowly than the gain at the text's rate is
tried with k B0/L0 held, see `sdot_resonance`.
"""

import numpy as np

from gallery.drawing import BLUE, COLOURS, GREY, RED, label, level, new_figure, shaded_map
from gallery.entry import (
    Answer,
    Entry,
    Grade,
    Verdict,
    consistent,
    near,
    sampled,
    share,
    uncertain,
    within,
)
from gallery.sdot_resonance import passage
from gallery.sdot_runs import SUN, Run, averaged_case, start_arguments
from torquer.theory.slow.evolution import sdot
from torquer.theory.slow.evolution.model import Slow

GAINS, COUNT = (60.0, 20.0, 6.0), 24
RATES = {"text's rates": 1.0, "ten times the rates": 10.0}
#: A passage at df/du resolves a frequency to sqrt(2 pi df/du), 0.3 to 0.5 omega0 here. (A limit of
#: 0.2, set before that estimate, was missed at twice the rates: 3.79.)
PASSAGE = 0.3
#: Initial rates over the text's, and gains at the text's rates, for the trial with k B0/L0 held.
FASTER, HELD = (1.0, 2.0, 2.5, 3.0, 10.0), (6.0, 2.0)


def final_momenta(faster: float) -> np.ndarray:
    """Final momentum along the Sun over the initial one `[gain, start]`."""
    return np.array([
        [Run(gain, start, faster).course().along[-1] for start in start_arguments(COUNT, 180.0)]
        for gain in GAINS
    ])  # fmt: skip


def order_of(values, gains=GAINS) -> float:
    """Exponent of the gain in numbers that fall with it."""
    return float(np.polyfit(np.log(gains), np.log(values), 1)[0])


def resonance(runs: dict) -> tuple:
    """Checks of the trial: `runs[rate][gain]` with k B0/L0 held."""
    order = [order_of([each.scatter[-1] for each in runs[rate]], HELD) for rate in FASTER]
    slow, twice, between, *fast = (runs[rate][-1] for rate in FASTER)
    first = "k B0/L0 held: order of the scatter in k, "
    second = "scatter of the first integral (2.13), end over first orbit, "
    third = "frequency over omega0 when half of that growth is done, "
    return (
        uncertain(consistent(within(first + "3 and 10 times the rates, least", "1", min(order[3:]),
                                    0.95, 1.05)), 5e-3),
        uncertain(consistent(within(first + "text's rates", "below 1", order[0], 0.5, 0.9)), 2e-2),
        uncertain(consistent(within(second + "3 and 10 times the rates, greatest", "1",
                                    max(each.growth for each in fast), 0.97, 1.03)), 5e-3),
        uncertain(consistent(within(second + "text's rates", "above 1", slow.growth, low=1.5)),
                  0.1),
        *(uncertain(consistent(near(third + name, resonant, run.grown_at, tolerance=PASSAGE)), 0.05)
          for name, resonant, run in (("text's rates", "2", slow), ("twice the rates", "4", twice),
                                      ("2.5 times the rates", "4", between))),
    )  # fmt: skip


def compute() -> Answer:
    """Means with standard errors, scatter, and their orders in the gain."""
    case, start = averaged_case(GAINS[0])
    formula = float(sdot.final_momentum(start, case))
    found = {name: final_momenta(faster) for name, faster in RATES.items()}
    mean = {name: each.mean(axis=1) for name, each in found.items()}
    scatter = {name: each.std(axis=1, ddof=1) for name, each in found.items()}
    slow, fast = RATES
    bias = np.abs(mean[fast] - formula)
    runs = {rate: [passage(rate * gain, rate) for gain in HELD] for rate in FASTER}
    checks = (
        uncertain(sampled(within("k = 60: mean over start arguments, over (2.18)",
                                 "agrees practically exactly", mean[slow][0] / formula, 0.98, 1.02),
                          scatter[slow][0] / COUNT**0.5 / formula), 2e-3),
        share(f"k = 60: share of {COUNT} start arguments within 5 % of (2.18)",
              "agrees practically exactly", np.abs(found[slow][0] / formula - 1.0) < 0.05, low=0.9),
        uncertain(consistent(within("ten times the rates: order of mean less (2.18)", "above 1",
                                    order_of(bias), 1.2, 2.3)), 5e-2),
        *resonance(runs),
    )  # fmt: skip
    figures = {"gains": picture(found, formula), "map": side_map(case, start),
               "resonance": growth_picture(runs)}  # fmt: skip
    return Answer(checks, figures, note(found, mean, scatter, formula) + trial_note(runs))


def note(found, mean, scatter, formula) -> str:
    """Every mean with its standard error, as of start arguments drawn at random."""
    text = []
    for name in RATES:
        parts = (
            f"k = {gain:g}: {m:.4f} ± {s / COUNT**0.5:.4f} ({low:.3f} to {high:.3f})"
            for gain, m, s, low, high in zip(
                GAINS, mean[name], scatter[name], found[name].min(axis=1),
                found[name].max(axis=1), strict=True,
            )
        )  # fmt: skip
        text.append(f"{name[0].upper()}{name[1:]}: " + ", ".join(parts))
    return (
        f"(2.18) gives {formula:.4f} of the initial momentum. Means over {COUNT} even start "
        "arguments with the standard error that as many drawn at random would have, and the "
        f"range. {'. '.join(text)}. The momentum turns to the Sun from the half-space v.L > 0, "
        "v = (p S1, p S2, q S3), and away from it else. "
    )


def trial_note(runs: dict) -> str:
    """What the trial with k B0/L0 held shows."""
    order = [order_of([each.scatter[-1] for each in runs[rate]], HELD) for rate in FASTER]
    last = [runs[rate][-1] for rate in FASTER]
    fell = ", ".join(f"{each.frequency[0]:.1f} to {each.frequency[-1]:.1f}" for each in last)
    return (
        "At the text's rate the scatter falls more slowly than the gain. Then k is taken in "
        "proportion to the rate, so that k B0/L0 is 0.023 and 0.008 and only the rotation over the "
        f"orbital rate changes. Its order in k is {', '.join(f'{x:.2f}' for x in order)} at "
        f"{', '.join(f'{x:g}' for x in FASTER)} times the text's rates. From the first orbit "
        f"to the end it grows by factors of {', '.join(f'{each.growth:.2f}' for each in last)}. "
        "The part of the rate across the momentum turns, in inertial axes, with the precession and "
        "with the precession less twice the nutation. The scatter grows where the latter, which "
        "falls with the momentum, passes 4 or 2 omega0, resonances with the field's products (2u "
        f"and 4u). It falls from {fell} omega0: at 3 and 10 times the rates it does not come down "
        "to 4."
    )


def growth_picture(runs: dict):
    """Scatter of the first integral over the lower frequency of the rate, at the initial rates."""
    figure, (axes,) = new_figure("S-dot: scatter of the first integral, k B0/L₀ = 0.008",
                                 height=3.8)  # fmt: skip
    for colour, (rate, (*_, each)) in zip(COLOURS, runs.items(), strict=False):
        name = "text's rates" if rate == 1.0 else f"{rate:g} times"
        axes.plot(each.frequency, each.scatter / each.scatter[0], color=colour, lw=1.4, label=name)
        axes.plot(each.frequency[-1], each.growth, "o", color=colour, ms=5)
    for frequency in (2.0, 4.0):
        axes.axvline(frequency, color=GREY, lw=0.9, ls=(0, (5, 3)), zorder=1.5)
    ticks = (2, 3, 4, 6, 10, 20)
    axes.set(xscale="log", xlim=(32.0, 1.3), ylim=(0.8, None))
    axes.set_xticks(ticks, [f"{x}" for x in ticks])
    axes.minorticks_off()
    label(axes, "precession less twice the nutation, over omega0, falling; dot: the end",
          "scatter over that of the first orbit", columns=5)  # fmt: skip
    return figure


def picture(found, formula):
    """Final momenta of all runs by the gain."""
    figure, panels = new_figure("S-dot: final momentum and (2.18)", 2, 5.4, sharex=True)
    for axes, (name, each) in zip(panels, found.items(), strict=True):
        for gain, values in zip(GAINS, each, strict=True):
            axes.plot(np.full(COUNT, gain), values, "o", color=BLUE, ms=4, alpha=0.5, mew=0)
        mean, error = each.mean(axis=1), each.std(axis=1, ddof=1) / COUNT**0.5
        axes.errorbar(np.array(GAINS) * 1.06, mean, error, fmt="s", color=RED, ms=5, capsize=4,
                      label="mean and its standard error")  # fmt: skip
        level(axes, formula, "(2.18)")
        axes.set(xscale="log", xlim=(5.0, 90.0), ylim=(0.28, 0.8), xticks=GAINS,
                 xticklabels=[f"{g:g}" for g in GAINS])  # fmt: skip
        axes.minorticks_off()
        label(axes, "", f"L / L₀, {name}", legend=axes is panels[0])
    panels[-1].set_xlabel("gain k [N m s/T]", fontsize=10)
    return figure


def side_map(case, start):
    """Final momentum by the initial direction: above zero towards the Sun."""
    rho, sigma = np.linspace(0.0, 180.0, 181), np.linspace(-180.0, 180.0, 181)
    grid = np.radians(np.meshgrid(sigma, rho, indexing="ij"))
    end = sdot.final_momentum(Slow(1.0, grid[1], grid[0], 0.0), case)
    figure, (axes,) = new_figure("S-dot: final momentum by the first direction, 51.7 deg",
                                 height=4.4)  # fmt: skip
    levels = [x for x in np.round(np.arange(-0.8, 0.81, 0.2), 1) if x != 0.0]
    shaded_map(axes, sigma, rho, end, levels, "final momentum / L₀, below 0 away from the Sun",
               signed=True)  # fmt: skip
    axes.contour(sigma, rho, end.T, levels=[0.0], colors="#222222", linewidths=2.2)
    there = np.degrees([np.arctan2(SUN[1], SUN[0]), np.arccos(SUN[2])])
    marks = {"Sun": there, "Fig. 3.11": np.degrees([start.sigma, start.rho])}
    for (name, place), drop in zip(marks.items(), (5, -12), strict=True):
        axes.plot(*place, "o", color="#222222", ms=6)
        axes.annotate(name, place, xytext=(6, drop), textcoords="offset points",
                      fontsize=10)  # fmt: skip
    label(axes, "azimuth sigma from the node [deg]", "rho from the cone axis [deg]", legend=False)
    axes.set(xticks=range(-180, 181, 60), yticks=range(0, 181, 30))
    return figure


ENTRY = Entry(
    ids=("SDOT-2.18",),
    compute=compute,
    declared=Verdict.DIFFERS,
    grade=Grade.OPEN,
    reason=(
        "the mean over the argument of latitude at the start is that of (2.18), to its standard "
        "error. A single run of Fig. 3.11 is not: its k B0/(omega0 C) is 1, and final momenta "
        "range from 0.32 to 0.74 of the initial one. The scatter falls with the gain"
    ),
    slow=True,
)
