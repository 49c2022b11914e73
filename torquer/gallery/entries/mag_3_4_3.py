"""MAG Figs. 3.4.3, 3.4.4: the first preliminary reorientation together with nutation damping.

Not given, and taken here: the body diag(1.5, 1.5, 1.56), coils of 1 A m^2 and the inclination of
50 deg of MAG 3.6, a circular orbit of 6850 km as in MAG 3.1, four azimuths of the target.

Where both laws are used their sum is zero, for any field, when e3 x (omega - (k5/k2) l_f) = 0: a
steady precession about the target at the rate k5/k2. A body with spin omega3 has one at the
angle of cos theta = C omega3 / (A k5/k2); it has none, and comes to the target, if
k5/k2 < (C/A) omega3. No body has C > 2 A: k5 = k2 s^-1 would need more than 28 deg/s of spin.
"""

import math

import numpy as np

from torquer.gallery.drawing import BLUE, GREEN, RED, label, new_figure
from torquer.gallery.entry import Answer, Entry, Verdict, within
from torquer.gallery.spinning import aside, course_of
from torquer.scenario.load import scenario_from_data
from torquer.simulation.simulate import simulate

INERTIA, RATE_DEG_S = [1.5, 1.5, 1.56], 10.0
K2 = 5e6
#: Readings of the printed k5, and the gain that MAG 3.6 has for k4 [A m^2/T].
READINGS = {"k5 = 5e6": 5e6, "k5 = 1e6": 1e6, "k5 = 5e5": 5e5}
AZIMUTHS_DEG = (0.0, 90.0, 180.0, 270.0)


def scenario(k5: float, azimuth_deg: float = 0.0):
    """The text's run; body axes on the inertial ones, the target 12 deg off the third."""
    laws = [{"kind": "nutation_damping_rate", "gain_a_m2_s_per_t": K2},
            {"kind": "preliminary_1", "gain_a_m2_per_t": k5}]  # fmt: skip
    return scenario_from_data({
        "start": "2012-03-01T00:00:00Z",
        "orbit": {"kind": "circular", "radius_km": 6850.0, "inclination_deg": 50.0},
        "spacecraft": {"body": {"inertia_kg_m2": INERTIA}, "coils": {"limit_a_m2": 1.0}},
        "initial": {"rate_deg_s": [RATE_DEG_S] * 3},
        "control": {"law": {"kind": "scheme", "target": aside(12.0, azimuth_deg),
                            "stages": [{"laws": laws}]}, "sample_s": 1.0},
        "simulation": {"revolutions": 20.0, "step_s": 1.0, "record_s": 20.0,
                       "integrator": "splitting"},
    })  # fmt: skip


def course(k5: float, azimuth_deg: float = 0.0):
    """The course of a run."""
    return course_of(simulate(scenario(k5, azimuth_deg)), aside(12.0, azimuth_deg))


def precession_deg(k5: float) -> float:
    """Angle of the steady precession about the target; 0 if there is none."""
    cosine = INERTIA[2] * math.radians(RATE_DEG_S) / (INERTIA[0] * k5 / K2)
    return math.degrees(math.acos(min(cosine, 1.0)))


def compute() -> Answer:
    """Twenty revolutions under three readings of the gain."""
    runs = {name: [course(k5, a) for a in AZIMUTHS_DEG] for name, k5 in READINGS.items()}
    checks = []
    for name, courses in runs.items():
        worst = max(c.end("axis") for c in courses)
        checks.append(within(f"{name}: axis to the target at the end, farthest of four",
                             "brought to the target", worst, high=2.0, unit="deg"))  # fmt: skip
        fast = max(c.end("across") for c in courses)
        checks.append(within(f"{name}: rate across the axis at the end", "nutation is damped",
                             fast, high=0.5, unit="deg/s"))  # fmt: skip
    figure, (upper, lower) = new_figure(
        "Preliminary law 1 with nutation damping (MAG Figs. 3.4.3, 3.4.4)", 2, 5.6
    )
    for (name, courses), colour in zip(runs.items(), (RED, GREEN, BLUE), strict=True):
        revolutions = courses[0].time_s / scenario(1.0).orbit.period_s
        upper.plot(revolutions, courses[0].axis, color=colour, lw=0.8, label=name)
        lower.plot(revolutions, courses[0].across, color=colour, lw=0.8)
    label(upper, "", "axis to target [deg]")
    label(lower, "revolutions", "rate across axis [deg/s]", legend=False)
    for panel in (upper, lower):
        panel.set_xlim(0.0, 10.0)
        panel.set_ylim(bottom=0.0)
    found = ", ".join(f"{np.mean([c.end('axis') for c in cs]):.1f}" for cs in runs.values())
    predicted = ", ".join(f"{precession_deg(k5):.1f}" for k5 in READINGS.values())
    note = (
        "The two laws cancel in a precession about the target at the rate k5/k2, at the angle "
        "arccos(C omega3 k2 / (A k5)). "
        f"For the three readings that is {predicted} deg; the runs end at {found} deg. With k5 "
        "equal to k2 per second no body can come out of it: C/A would have to be above 5.7."
    )
    return Answer(tuple(checks), {"": figure}, note)


ENTRY = Entry(
    ids=("MAG-3.4.3", "MAG-3.4.4"),
    compute=compute,
    declared=Verdict.DIFFERS,
    reason=(
        "with the printed k2 = 5e6 and k5 read as 5e6 the two laws hold one another in a "
        "precession about the target, whatever the body, which the text does not give; with "
        "k5 = 5e5, the gain that MAG 3.6 has for the same action, both succeed. (k5 = 1e6, the "
        "other reading of the damaged print, needs C/A > 1.15)"
    ),
)
