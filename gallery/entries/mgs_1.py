"""MGS, stage 1: from tip-off to rest in the orbital frame, by the field and its derivative."""

import numpy as np

from gallery.drawing import BLUE, COLOURS, RED, label, level, new_figure
from gallery.entry import Answer, Entry, Verdict, chosen, consistent, share, uncertain, within
from gallery.gyro import CAPTURE, NEARLY, RATE, STAGE_1_ALONE, Flown, fly, tip_off

STARTS, ORBITS, LATE = 24, 12.0, 10.0
#: Rates [deg/s] above the frequency of the filters, and just below it.
FAST, NEARLY_FAST = 8.0, 5.5


def greatest_turn() -> float:
    """Greatest |C|/B^2 over nu0 along 15 orbits, C = B x dB/dt."""
    flown = fly(NEARLY, 15.0)
    b, t = flown.result["b_inertial"].values, flown.result["time"].values
    c = np.cross(b, np.gradient(b, t, axis=0))[1:-1]
    return float(np.max(np.linalg.norm(c, axis=1) / np.sum(b[1:-1] ** 2, axis=1)) / RATE)


def left_over(rate_deg_s: float) -> float:
    """Rate after six orbits over that at release."""
    flown = fly({**tip_off(3, rate_deg_s), **STAGE_1_ALONE}, 6.0)
    rates = np.linalg.norm(flown.result["omega_body"].values, axis=1)
    return float(rates[-1] / rates[0])


def compute() -> Answer:
    """Flights of stage 1 alone from many starts, and from rates near those of its filters."""
    flights = [fly({**tip_off(k), **STAGE_1_ALONE}, ORBITS) for k in range(STARTS)]
    late = [each.orbits > LATE for each in flights]
    calm = [bool(f.rate_deg_s[rows].max() < 0.01) for f, rows in zip(flights, late, strict=True)]
    error = max(f.angle_deg[rows].max() for f, rows in zip(flights, late, strict=True))
    times = [each.stays_below(20.0) for each in flights]
    checks = (
        within("greatest rate at which the field turns along 15 orbits, over nu0",
               "does not exceed about 3", greatest_turn(), high=3.5),
        chosen(share(f"part of the starts, of {STARTS} at 3 deg/s, below 0.01 deg/s in the orbital "
                     f"frame after {LATE:g} orbits", "damping without gyros", calm, low=1.0)),
        uncertain(chosen(within("the last of them stays within 20 deg of pointing after",
                                "the axes are brought together", max(times), high=LATE,
                                unit="orbits")), 0.02),
        chosen(within(f"greatest error after {LATE:g} orbits", "comparatively small", error,
                      high=5.0, unit="deg")),
        consistent(within("released at 5.5 deg/s, filters of 5.63 deg/s: rate after 6 orbits over "
                          "the first", "independent model: falls slowly", left_over(NEARLY_FAST),
                          high=0.9)),
        consistent(within("released at 8 deg/s: the same", "independent model: grows",
                          left_over(FAST), low=1.0)),
    )  # fmt: skip
    note = (
        f"Stage 1 alone, K/(J nu0^2) = {CAPTURE.angle_gain:g}, N/(J nu0) = {CAPTURE.rate_gain:g}, "
        "filters of 0.0982 rad/s, from any attitude and 3 deg/s about any axis: within 20 deg "
        f"after {min(times):.1f} to {max(times):.1f} orbits. Most of the rest is due to the "
        "satellite's own dipole of 11 A m^2 (MGS-12). The text has no condition on the rate: above "
        "the frequency of the filters their output changes its sign, and stage 1 spins the "
        "satellite up."
    )
    return Answer(checks, {"": picture(flights[:5], fly({**tip_off(3, FAST), **STAGE_1_ALONE}, 6))},
                  note)  # fmt: skip


def picture(flights: list[Flown], fast: Flown):
    """Rates and errors of some flights; a release that is too fast."""
    figure, (upper, lower) = new_figure("MGS, stage 1 alone", 2, 5.4, sharex=True)
    for number, each in enumerate(flights):
        name = "3 deg/s, five starts" if number == 0 else None
        colour = COLOURS[number + 1] if number else BLUE
        upper.plot(each.orbits, each.rate_deg_s, color=colour, lw=1.0, label=name)
        lower.plot(each.orbits, each.angle_deg, color=colour, lw=1.0)
    upper.plot(fast.orbits, fast.rate_deg_s, color=RED, lw=1.8, ls="--", label="8 deg/s")
    level(upper, 5.63, "filters")
    upper.set_yscale("log")
    lower.set_yscale("log")
    label(upper, "", "rate [deg/s]")
    label(lower, "orbits", "error of pointing [deg]", legend=False)
    lower.set_xlim(0.0, ORBITS)
    return figure


ENTRY = Entry(
    ids=("MGS-1",),
    compute=compute,
    declared=Verdict.CHOSEN,
    reason=(
        "the source prints no satellite, gains or numbers: a satellite of two tonnes and gains of "
        "ours. Above the frequency of its filters stage 1 does not damp, which the text leaves out"
    ),
    slow=True,
)
