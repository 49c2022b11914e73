"""MAG Figs. 3.4.3, 3.4.4: the first preliminary reorientation together with nutation damping.

As in the text: IGRF, 12 deg from the target, 10 deg/s about each axis, k2 = 5e6 A m^2 s/T,
k5 = 1e6 A m^2/T. Not given, and taken here: coils of 1 A m^2 and the inclination of 50 deg of
MAG 3.6, a circular orbit of 6850 km as in MAG 3.1, four azimuths of the target; and the body.

The sum of both laws is zero, for any field, when e3 x (omega - (k5/k2) l_f) = 0: a steady
precession about the target at the rate k5/k2. A body with spin omega3 has one at the angle of
cos theta = C omega3 / (A k5/k2); it has none, and comes to the target, if k5/k2 < (C/A) omega3:
for C/A above 1.146. Of the two axisymmetric bodies of MAG 3 that of 3.3 has 1.82, that of 3.6 1.04.
"""

import math

import numpy as np

from gallery.drawing import BLUE, GREY, RED, label, new_figure
from gallery.entry import Answer, Entry, Verdict, chosen, consistent, near, within
from gallery.spinning import aside, course_of
from torquer.scenario.load import scenario_from_data
from torquer.simulation.setup.simulate import simulate

#: Bodies of MAG 3 (that of 3.6 without its products and the difference of A and B).
BODIES = {"body of MAG 3.3": (0.011, 0.011, 0.02), "body of MAG 3.6": (1.5, 1.5, 1.56)}
RATE_DEG_S, K2, K5 = 10.0, 5e6, 1e6
AZIMUTHS_DEG = (0.0, 90.0, 180.0, 270.0)
#: Ratios C/A that are run besides those of the two bodies, with A = 1.5 kg m^2.
RATIOS = (0.8, 0.9, 1.0, 1.1, 1.18, 1.25, 1.4, 1.6, 1.8)


def scenario(inertia, azimuth_deg: float = 0.0):
    """The text's run; body axes on the inertial ones, the target 12 deg off the third."""
    laws = [{"kind": "nutation_damping_rate", "gain_a_m2_s_per_t": K2},
            {"kind": "preliminary_1", "gain_a_m2_per_t": K5}]  # fmt: skip
    return scenario_from_data({
        "start": "2012-03-01T00:00:00Z",
        "orbit": {"kind": "circular", "radius_km": 6850.0, "inclination_deg": 50.0},
        "spacecraft": {"body": {"inertia_kg_m2": list(inertia)}, "coils": {"limit_a_m2": 1.0}},
        "initial": {"rate_deg_s": [RATE_DEG_S] * 3},
        "control": {"law": {"kind": "scheme", "target": aside(12.0, azimuth_deg),
                            "stages": [{"laws": laws}]}, "sample_s": 1.0},
        "simulation": {"revolutions": 20.0, "record_s": 20.0},
    })  # fmt: skip


def course(inertia, azimuth_deg: float = 0.0):
    """The course of a run."""
    return course_of(simulate(scenario(inertia, azimuth_deg)), aside(12.0, azimuth_deg))


def precession_deg(ratio):
    """Angle of the steady precession about the target, of a body's C/A; 0 if there is none."""
    cosine = np.asarray(ratio) * math.radians(RATE_DEG_S) * K2 / K5
    return np.degrees(np.arccos(np.minimum(cosine, 1.0)))


def compute() -> Answer:
    """Twenty revolutions of two bodies; the angle that is left against C/A."""
    runs = {name: [course(body, a) for a in AZIMUTHS_DEG] for name, body in BODIES.items()}
    left = [course((1.5, 1.5, 1.5 * ratio)).end("axis") for ratio in RATIOS]
    small, large = runs.values()
    stays = np.array([c.end("axis") for c in large])
    away = np.max(np.abs(left - precession_deg(RATIOS)))
    cancel = f"{precession_deg(1.56 / 1.5):.2f}"
    checks = (
        chosen(within("body of MAG 3.3: axis to the target at the end, farthest of four",
                      "brought to the target", max(c.end("axis") for c in small), high=2.0,
                      unit="deg")),
        chosen(within("body of MAG 3.3: rate across the axis at the end", "nutation is damped",
                      max(c.end("across") for c in small), high=0.5, unit="deg/s")),
        consistent(near("body of MAG 3.6: axis to the target at the end", cancel, stays.mean(),
                        "deg", printed=f"arccos of C omega3 k2 / (A k5): {cancel} deg")),
        consistent(within("nine bodies: angle left from that of the precession, farthest",
                          "the same, 0 where there is none", away, high=1.0, unit="deg")),
    )  # fmt: skip
    note = (
        "k2 = 5e6 and k5 = 1e6 cancel in a precession about the target at the rate k5/k2, at the "
        "angle arccos(C omega3 k2 / (A k5)), if C/A is below 1.146. The lower panel has it, and "
        f"runs of nine bodies. The body of MAG 3.6 ends {stays.mean():.2f} deg off with "
        f"{large[0].end('across'):.1f} deg/s across its axis, from all four azimuths."
    )
    return Answer(checks, {"": picture(runs, left)}, note)


def picture(runs, left):
    """Angle and rate of the two bodies; below, what is left against C/A."""
    title = "Preliminary law 1 with nutation damping (MAG Figs. 3.4.3, 3.4.4)"
    figure, (angle, rate, last) = new_figure(title, 3, 7.4)
    for (name, courses), colour in zip(runs.items(), (BLUE, RED), strict=True):
        revolutions = courses[0].time_s / scenario(BODIES[name]).orbit.period_s
        angle.plot(revolutions, courses[0].axis, color=colour, lw=0.8, label=name)
        rate.plot(revolutions, courses[0].across, color=colour, lw=0.8)
    ratio = np.linspace(0.75, 1.9, 400)
    last.plot(ratio, precession_deg(ratio), color=GREY, lw=1.3, label="steady precession")
    last.plot(RATIOS, left, "o", color=BLUE, ms=5, label="runs of 20 revolutions")
    label(angle, "", "axis to target [deg]")
    label(rate, "revolutions", "rate across [deg/s]", legend=False)
    label(last, "C/A", "axis at the end [deg]")
    for panel in (angle, rate):
        panel.set(xlim=(0.0, 10.0), ylim=(0.0, None))
    last.set(xlim=(0.75, 1.9), ylim=(0.0, 50.0))
    return figure


ENTRY = Entry(
    ids=("MAG-3.4.3", "MAG-3.4.4"),
    compute=compute,
    declared=Verdict.CHOSEN,
    reason=(
        "the text gives no body, and with these gains the body decides: that of MAG 3.3 was "
        "chosen, with which both succeed. They do for C/A above 1.146; below it, as with the body "
        "of MAG 3.6 (1.04), the two laws cancel in a precession about the target"
    ),
    slow=True,
)
