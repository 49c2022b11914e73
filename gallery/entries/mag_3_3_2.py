"""MAG Figs. 3.3.2 to 3.3.7: nutation damping, spin-up, reorientation by relays, at 60 and 10 deg.

As in the text: direct dipole, gravity, relays of 0.8, 0.1 (with 0.2 for the nutation) and
0.8 A m^2, the target (1, 1, 0) in Y, the initial rates. Not given, and taken here: body axes on Y
at the start, at the ascending node; a radius of 6850 km, as in MAG 3.1; readings every second,
nutation damping from the rate, m = m0 sign((omega x B).e3); a wanted spin of 10 deg/s, as in MAG
3.6; greatest errors of direction (1 deg, 0.5 deg) as three standard deviations; a nutation that
counts as damped below 20 deg (held for a minute). Attitude, way to measure and limit were chosen,
of several tried, as those that come near the text's times of damping; what others give is noted.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from gallery.drawing import BLUE, GREEN, RED, label, new_figure
from gallery.entry import Answer, Entry, Grade, Verdict, chosen, near, within
from gallery.spinning import Course, course_of
from torquer.computer.laws.recommended import standard_scheme
from torquer.computer.scheme import stage_starts_s
from torquer.scenario.load import scenario_from_data
from torquer.simulation.setup.simulate import simulate

INERTIA, SPIN_DEG_S = [0.011, 0.011, 0.02], 10.0
INCLINATIONS = (60.0, 10.0)
SEEDS = range(41)
#: Times printed as about a round number of 500 s.
ROUND_S, ROUNDED = 250.0, "(to the nearest 500)"
#: Gains that stand for the relays of 0.8 A m^2 in further runs.
LINEAR_DAMPING, LINEAR_POINTING = 1e5, 1e7
OTHER_TARGETS = ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
#: A reorientation counts as done below this angle [deg].
DONE_DEG = 10.0


@dataclass(frozen=True)
class Case:
    """What is chosen of the run: attitude (3-2-1) to a frame, way to measure, limit, errors.

    `damping_gain`, `pointing_gain`: gains of those two laws in place of the text's relays.
    """

    euler_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    reference: str = "inertial"
    kind: str = "nutation_damping_rate"
    damped_deg: float = 20.0
    seed: int = 0
    target: tuple[float, float, float] = (1.0, 1.0, 0.0)
    damping_gain: float | None = None
    pointing_gain: float | None = None


CHOSEN = Case()
#: Other choices that were tried.
OTHERS = {
    "damped below 15 deg": Case(damped_deg=15.0),
    "rates from two readings of the field": Case(kind="nutation_damping"),
    "body axes on the orbital ones": Case(reference="orbital"),
}


def scenario(inclination_deg: float, case: Case = CHOSEN):
    """The text's run."""
    damping, pointing = {"relay_dipole_a_m2": 0.8}, {"relay_dipole_a_m2": 0.8}
    if case.damping_gain is not None:
        damping = {"gain_a_m2_s_per_t": case.damping_gain}
    if case.pointing_gain is not None:
        pointing = {"gain_a_m2_per_n_m_s_t": case.pointing_gain}
    law = standard_scheme(
        target=list(case.target), inertia_kg_m2=INERTIA, spin_deg_s=SPIN_DEG_S,
        nutation_damping={"kind": case.kind, **damping}, spin_up={"relay_dipole_a_m2": 0.1},
        reorientation=pointing, during_spin_up={"kind": case.kind, "relay_dipole_a_m2": 0.2},
        damped={"nutation_below_deg": case.damped_deg, "for_s": 60.0},
    )  # fmt: skip
    third = math.radians(0.5) / 3.0
    return scenario_from_data({
        "start": "2012-01-01T00:00:00Z", "seed": case.seed,
        "orbit": {"kind": "circular", "radius_km": 6850.0, "inclination_deg": inclination_deg},
        "environment": {"field": {"kind": "direct_dipole"}, "earth_rotation": "sidereal"},
        "spacecraft": {"body": {"inertia_kg_m2": INERTIA}, "coils": {"limit_a_m2": 0.8},
                       "magnetometer": {"noise_nt": third * 30_000.0},
                       "attitude_sensor": {"noise_deg": 1.0 / 3.0}},
        "initial": {"euler_deg": list(case.euler_deg), "reference": case.reference,
                    "rate_deg_s": [math.degrees(x) for x in (0.1, 0.1, 0.01)]},
        "control": {"law": law, "sample_s": 1.0},
        "simulation": {"duration_s": 12000.0, "record_s": 5.0},
    })  # fmt: skip


def run(inclination_deg: float, case: Case = CHOSEN):
    """(Course, starts of the three stages [s])."""
    result = simulate(scenario(inclination_deg, case))
    return course_of(result, case.target), stage_starts_s(result)


def stages_of(inclination_deg: float):
    """Per seed: length of damping and of spin-up [s], axis to target then and 1000 s on [deg]."""
    rows = []
    for seed in SEEDS:
        course, starts = run(inclination_deg, Case(seed=seed))
        begun = course.at(starts[2], "axis"), course.at(starts[2] + 1000.0, "axis")
        rows.append((*np.diff(starts), *begun))
    return np.array(rows)


def by_other_choices() -> str:
    """Length of the damping where one thing is chosen otherwise, in words; medians of five."""
    parts = []
    for name, case in OTHERS.items():
        found = []
        for inclination_deg in INCLINATIONS:
            cases = [replace(case, seed=seed) for seed in range(5)]
            ends = [run(inclination_deg, each)[1][1] for each in cases]
            median = float(np.median(np.where(np.isnan(ends), np.inf, ends)))
            found.append(f"{median:.0f}" if math.isfinite(median) else "over 12000")
        parts.append(f"{name}, {found[0]} and {found[1]} s")
    return "; ".join(parts)


def stuck(damping_gain=None, tries: int = 12) -> list[int]:
    """How many of some attitudes have not ended the damping after 12 000 s, by inclination."""
    cases = [Case((37.0 * k, 70.0 * math.sin(k), 53.0 * k), damping_gain=damping_gain)
             for k in range(1, tries + 1)]  # fmt: skip
    return [sum(math.isnan(run(i, case)[1][1]) for case in cases) for i in INCLINATIONS]


def pointed(inclination_deg: float, **keys) -> tuple[float, float]:
    """Axis to target when the reorientation begins and 1000 s on [deg], medians of nine seeds."""
    rows = []
    for seed in range(9):
        case = Case(seed=seed, **keys)
        course, starts = run(inclination_deg, case)
        rows.append([course.at(starts[2] + wait, "axis") for wait in (0.0, 1000.0)])
    return tuple(np.median(rows, axis=0))


def compute() -> Answer:
    """Forty-one runs at each inclination, which differ in the sensors' errors; medians."""
    rows = {i: stages_of(i) for i in INCLINATIONS}
    high, low = (np.median(rows[i], axis=0) for i in INCLINATIONS)
    slow, linear = stuck(), stuck(LINEAR_DAMPING)
    otherwise = pointed(60.0, pointing_gain=LINEAR_POINTING)
    other_targets = {target: pointed(10.0, target=target) for target in OTHER_TARGETS}
    checks = (
        chosen(near("60 deg: nutation damping", "1500", high[0], "s", ROUND_S,
                    f"about 1500 s {ROUNDED}")),
        chosen(near("60 deg: spin-up", "1000", high[1], "s", ROUND_S, f"about 1000 s {ROUNDED}")),
        within("60 deg: axis to the target after 1000 s of reorientation",
               "reoriented in about 1000 s", high[3], high=DONE_DEG, unit="deg"),
        chosen(near("10 deg: nutation damping", "5000", low[0], "s", 2.0 * ROUND_S,
                    "about 5000 s (to the nearest 1000)")),
        chosen(near("10 deg: spin-up", "1000", low[1], "s", ROUND_S,
                    f"almost all of it in 1000 s {ROUNDED}")),
        within("10 deg: axis to the target after 1000 s of reorientation",
               "reorientation goes very slowly", low[3], low=45.0, unit="deg"),
    )  # fmt: skip
    spread = {i: (rows[i][:, 2], rows[i][:, 3]) for i in INCLINATIONS}
    parts = " ".join(
        f"At {i:.0f} deg it begins at {a.min():.0f} to {a.max():.0f} deg and is at {b.min():.0f} "
        f"to {b.max():.0f} deg 1000 s later."
        for i, (a, b) in spread.items()
    )
    note = (
        f"Damping at 60 and 10 deg with one choice changed: {by_other_choices()}. The angle at "
        f"which the reorientation begins depends on the sensor errors. {parts} Of twelve other "
        f"initial attitudes {slow[0]} had not ended the damping after 12 000 s at 60 deg and "
        f"{slow[1]} at 10 deg; with a linear law of {LINEAR_DAMPING:g} A m^2 s/T in place of the "
        f"relay {linear[0]} and {linear[1]}. With a linear reorientation of {LINEAR_POINTING:g} "
        f"1/(s T^2) at 60 deg the axis comes from {otherwise[0]:.0f} to {otherwise[1]:.0f} deg in "
        "1000 s. Other targets at 10 deg, angle at the start and 1000 s on: "
        + ", ".join(f"{t} {a:.0f} and {b:.0f} deg" for t, (a, b) in other_targets.items())
        + "."
    )
    return Answer(checks, figures(), note)


def figures() -> dict:
    """The two runs with seed 0, all stages one after another."""
    made = {}
    for inclination_deg, numbers in zip(INCLINATIONS, ("3.3.2-3.3.4", "3.3.5-3.3.7"), strict=True):
        course, starts = run(inclination_deg)
        name = f"{inclination_deg:.0f}"
        title = f"Three stages by relays, i = {name} deg (MAG Figs. {numbers})"
        made[name], axes = new_figure(title, 3, 7.0)
        draw(axes, course, starts)
        for panel in axes:
            panel.set_xlim(0.0, starts[2] + 3000.0)
    return made


def draw(axes, course: Course, starts) -> None:
    """Rates, nutation, and the axis to the target; stages apart."""
    axes[0].plot(course.time_s, course.across, color=RED, lw=1.1, label="across the axis")
    axes[0].plot(course.time_s, course.spin, color=BLUE, lw=1.1, label="about the axis")
    axes[1].plot(course.time_s, course.nutation, color=GREEN, lw=0.9)
    axes[2].plot(course.time_s, course.axis, color=BLUE, lw=0.9)
    label(axes[0], "", "rate [deg/s]")
    label(axes[1], "", "axis to momentum [deg]", legend=False)
    label(axes[2], "time [s]", "axis to target [deg]", legend=False)
    axes[0].set_ylim(0.0, 25.0)
    axes[1].set_ylim(0.0, 90.0)
    axes[2].set_ylim(0.0, 180.0)
    for panel in axes:
        for start in starts[1:]:
            panel.axvline(start, color="#555555", lw=0.9, ls=(0, (4, 3)))
    for start, text in zip(starts, ("damping", "spin-up", "reorientation"), strict=True):
        axes[2].annotate(text, (start, 180.0), xytext=(3, -11), textcoords="offset points",
                         fontsize=9, color="#444444")  # fmt: skip


ENTRY = Entry(
    ids=tuple(f"MAG-3.3.{n}" for n in range(2, 8)),
    compute=compute,
    declared=Verdict.DIFFERS,
    grade=Grade.OPEN,
    reason=(
        "the times of spin-up are reproduced. Those of damping depend on the attitude and the "
        "limit, which the text does not give; chosen in view of the printed ones, they come near "
        "5000 s but are 1907 s where 1500 s are printed. The reorientation is not reproduced: at "
        "60 deg it is not complete after 1000 s, by the relay or by a linear law. At 10 deg this "
        "target, across the field, is approached quickly, and only one along the field slowly (MAG "
        "(3.3.2) as printed has p for p cos^2 rho + q sin^2 rho in the fast one)"
    ),
    slow=True,
)
