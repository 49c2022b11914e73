"""SDOT Figs. 3.22 to 3.26: acquisition of Chibis-M, and its Kalman filters in light and shadow.

The figures are telemetry; their values are lost. What the text says of them is checked on many
starts, and one day is drawn as they are.
"""

import numpy as np

from gallery import chibis_m
from gallery.chibis_m import ACQUISITION, BDOT, MAG_DSS, MAG_WRATE, SCIENCE, TRIAD, Course
from gallery.drawing import BLUE, GREEN, GREY, ORANGE, RED, SKY, label, new_figure
from gallery.entry import Answer, Entry, Verdict, chosen, lost, share, uncertain, within
from torquer.scenario.load import scenario_from_data

STARTS, HOURS = 24, 12.0
#: Time [s] after a change of sensors until the filter is called converged.
SETTLED_S = 300.0
_COLOURS = {BDOT: GREY, chibis_m.WAITING: SKY, TRIAD: ORANGE, MAG_DSS: GREEN, MAG_WRATE: BLUE}
_NAMES = {BDOT: "B-dot", chibis_m.WAITING: "B-dot, waiting for the Sun", TRIAD: "TRIAD",
          MAG_DSS: "Kalman MAG + DSS", MAG_WRATE: "Kalman MAG + WRATE"}  # fmt: skip


def compute() -> Answer:
    """Order of the stages, accuracy in light and shadow, convergence after it, and what drifts."""
    courses = [chibis_m.flown(chibis_m.a_start(k, HOURS)) for k in range(STARTS)]
    calm = {"bias_deg_s": [0.0, 0.0, 0.0], "bias_drift_deg_s_sqrt_s": 0.0}
    steady = [chibis_m.flown(chibis_m.a_start(k, HOURS, calm)) for k in range(STARTS)]
    day = chibis_m.flown(scenario_from_data(chibis_m.day()))
    light, shadow, still = errors(courses, MAG_DSS), errors(courses, MAG_WRATE), errors(
        steady, MAG_WRATE)  # fmt: skip
    held = np.concatenate([c.error_deg[settled(c, MAG_DSS)] for c in courses])
    again = np.concatenate([convergence_s(c) for c in courses])
    longest = max(c.longest_s(c.stabilisation, ACQUISITION) for c in courses)
    checks = (
        chosen(share(f"part of the starts, of {STARTS}, that go from B-dot to TRIAD and wheels to "
                     "the Kalman filters", "B-dot, TRIAD with wheels, Kalman",
                     [in_order(c) for c in courses], low=1.0)),
        chosen(within("longest acquisition by wheels", "up to 1500 s", longest, high=1500.0,
                      unit="s")),
        uncertain(chosen(within("error of the filter in the light, 95 %", "high accuracy: < 1 deg",
                                percentile(light), high=1.0, unit="deg")), 0.02),
        uncertain(chosen(within("error of the attitude in the light, 95 %",
                                "wheels hold better than 1 deg (MAG)", percentile(held),
                                high=1.0, unit="deg")), 0.05),
        uncertain(chosen(within("error of the filter in the shadow over that in the light",
                                "noticeably worse", percentile(shadow) / percentile(light),
                                low=3.0)), 1.5),
        uncertain(lost("error of the filter in the shadow, 95 %", percentile(shadow), "deg"), 0.2),
        uncertain(chosen(within("from the shadow's end until the filter is within 1 deg, 95 %",
                                "fast", percentile(again), high=120.0, unit="s")), 15.0),
        uncertain(chosen(within("error in the shadow without bias and drift of the gyros, "
                                "over that with them", "caused by the drift of the gyros' bias",
                                percentile(still) / percentile(shadow), high=0.5)), 0.1),
    )  # fmt: skip
    began, aimed = (np.median([c.first_s(c.stabilisation, s) for c in courses]) / 60.0
                    for s in (ACQUISITION, SCIENCE))  # fmt: skip
    note = (
        f"{STARTS} starts of {HOURS:.0f} h: node, attitude, 2 to 6 deg/s and seed drawn. In the "
        f"median the wheels start after {began:.0f} min and fine pointing after {aimed:.0f} min. "
        f"Errors are those {SETTLED_S:.0f} s after a change of sensors in the light and later, "
        "and of all the time in the shadow. The filter's return within 1 deg is of the "
        f"{again.size} of {sum(map(shadow_ends, courses))} ends of a shadow at which the sensors "
        "see the Sun within a minute. Chosen: gyro bias of 0.027 deg/s and drift of 1e-4 "
        "deg/s in a second, 500 nT per A m^2 of coil field at the magnetometer (the coils rest "
        "while it is read), 0.02 N m s per wheel. The rate is low when two field readings have "
        "said so for 5 min: they show its part across the field only."
    )
    figures = {"acquisition": acquisition(day), "shadow": light_and_shadow(day)}
    return Answer(checks, figures, note)


def in_order(course: Course) -> bool:
    """Whether the states were first entered in the text's order, and all of them."""
    first = [course.first_s(course.determination, s) for s in (BDOT, TRIAD)]
    first.append(min(course.first_s(course.determination, s) for s in (MAG_DSS, MAG_WRATE)))
    first.append(course.first_s(course.stabilisation, SCIENCE))
    wheels = course.first_s(course.stabilisation, ACQUISITION)
    return bool(np.all(np.diff(first) > 0.0) and np.isfinite(first[-1])
                and abs(wheels - first[1]) <= 60.0)  # fmt: skip


def settled(course: Course, state: int) -> np.ndarray:
    """Records in fine pointing and a state of the determination.

    In the light those at which it has lasted for a while.
    """
    there = (course.determination == state) & (course.stabilisation == SCIENCE)
    if state == MAG_WRATE:
        return there & (course.sunlit_fraction < 0.5)
    entered = np.concatenate([[True], np.diff(course.determination) != 0])
    since = course.t_s - np.maximum.accumulate(np.where(entered, course.t_s, 0.0))
    return there & (since >= SETTLED_S)


def errors(courses: list[Course], state: int) -> np.ndarray:
    """Errors of the estimate [deg], all starts together."""
    return np.concatenate([c.estimate_error_deg[settled(c, state)] for c in courses])


def convergence_s(course: Course) -> np.ndarray:
    """Times from shadow to an error below 1 deg, infinite if it stays above.

    Of the shadows at whose end the satellite points finely and the sensors see the Sun within a
    minute.
    """
    dark = course.sunlit_fraction < 0.5
    ends = np.flatnonzero(dark[:-1] & ~dark[1:]) + 1
    good = course.estimate_error_deg < 1.0
    seen = [k for k in ends if MAG_DSS in course.determination[k : k + 6]
            and course.stabilisation[k] == SCIENCE]  # fmt: skip
    found = [course.t_s[k:][good[k:]] for k in seen]
    return np.array([t[0] - course.t_s[k] if t.size else np.inf
                     for k, t in zip(seen, found, strict=True)])  # fmt: skip


def shadow_ends(course: Course) -> int:
    """How often the satellite comes out of the shadow in fine pointing."""
    lit = course.sunlit_fraction >= 0.5
    return int(np.sum(lit[1:] & ~lit[:-1] & (course.stabilisation[1:] == SCIENCE)))


def percentile(values, percent: float = 95.0) -> float:
    """Percentile."""
    return float(np.percentile(values, percent))


def in_modes(axes, course: Course, hours, values, width=1.0, rows=slice(None)) -> None:
    """Components over time, the determination as shades behind."""
    top = axes.get_ylim()
    for state, colour in _COLOURS.items():
        there = course.determination[rows] == state
        there[1:] |= there[:-1]  # a state lasts until the record that shows the next one
        axes.fill_between(hours[rows], 0.0, 1.0, where=there, color=colour, alpha=0.22, lw=0.0,
                          step="post", transform=axes.get_xaxis_transform(),
                          label=_NAMES[state] if there.any() else None)  # fmt: skip
    lines = (BLUE, "x"), (RED, "y"), ("#222222", "z")
    for component, (colour, name) in zip(values[rows].T, lines, strict=False):
        axes.plot(hours[rows], component, color=colour, lw=width, label=f"about {name}")
    axes.set(xlim=(hours[rows][0], hours[rows][-1]), ylim=top)


def angles_of(course: Course) -> np.ndarray:
    """Estimated turn vector from the orbital frame [deg]."""
    turn = np.degrees(course.estimated_turn.as_rotvec())
    return np.where(course.known[:, None], turn, np.nan)


def acquisition(course: Course):
    """Figs. 3.22 to 3.24: estimated angles and rate, gyro, in the first hours."""
    figure, axes = new_figure("Acquisition of Chibis-M (SDOT Figs. 3.22 to 3.24)", 3, 7.0,
                              sharex=True)  # fmt: skip
    hours = course.t_s / 3600.0
    rows = slice(0, int(np.searchsorted(hours, 3.0)))
    shown = ((angles_of(course), 180.0, "estimated turn [deg]"),
             (course.estimated_rate_deg_s, 1.0, "estimated rate [deg/s]"),
             (course.gyro_deg_s, 5.0, "gyro [deg/s]"))  # fmt: skip
    for each, (values, most, name) in zip(axes, shown, strict=True):
        each.set_ylim(-most, most)
        in_modes(each, course, hours, values, rows=rows)
        label(each, "time [h]" if each is axes[-1] else "", name, legend=each is axes[0], columns=3)
    return figure


def light_and_shadow(course: Course):
    """Figs. 3.25, 3.26: estimated angles and rate, and the filter's true error."""
    figure, axes = new_figure("Kalman filters in light and shadow (SDOT Figs. 3.25, 3.26)", 3, 7.0,
                              sharex=True)  # fmt: skip
    hours = course.t_s / 3600.0
    rows = slice(*(int(np.searchsorted(hours, h)) for h in (10.0, 15.0)))
    shown = ((angles_of(course), "estimated turn [deg]"),
             (course.estimated_rate_deg_s, "estimated rate [deg/s]"))  # fmt: skip
    for each, (values, name) in zip(axes, shown, strict=False):
        most = 1.08 * np.nanmax(np.abs(values[rows]))
        each.set_ylim(-most, most)
        in_modes(each, course, hours, values, rows=rows)
        label(each, "", name, legend=each is axes[0], columns=3)
    error = course.estimate_error_deg
    axes[2].set_ylim(0.0, 1.1 * np.nanmax(error[rows]))
    in_modes(axes[2], course, hours, error[:, None], rows=rows)
    label(axes[2], "time [h]", "error of the estimate [deg]", legend=False)
    return figure


ENTRY = Entry(
    ids=("SDOT-3.22", "SDOT-3.23", "SDOT-3.24", "SDOT-3.25", "SDOT-3.26"),
    compute=compute,
    declared=Verdict.CHOSEN,
    reason="the text prints no noise of the gyros' bias, elements or gains; they are chosen",
    slow=True,
)
