"""MAG Figs. 3.5.3, 3.5.4: UniSat-5 by the standard and by the proposed scheme.

As in the text: the orbit, IGRF, gravity, air, coils of 1 A m^2, rates, the wanted spin, gains
k2 = k3 = 5e6 and k4 = k5 = 1e5; k4 is in N m/T^2, so the reorientation's L is taken over |L_f|. The
proposed scheme joins nutation damping with the law of k5, the first preliminary one. Not given, and
taken here: a cube of 0.5 m with its centre 1 cm off, June 2012, a start at perigee at the ascending
node, readings every second, damping that goes on during the spin-up and is done when the axis has
been within 5 deg of the momentum for a minute, as the package has it (or after 30 000 s).

'Error of 19.6 deg' and 'spin of 10 deg/s' leave open which end of the axis is meant, and which way
it turns: the target is run 19.6 and 160.4 deg from the end about which the satellite is spun up,
with the initial spin and against it, each from attitudes drawn at random.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from gallery.drawing import BLUE, RED, label, new_figure
from gallery.entry import Answer, Entry, Grade, Verdict, chosen, graded, near, within
from gallery.spinning import aside, course_of
from torquer.computer.laws.recommended import DAMPED, recommended_scheme, standard_scheme
from torquer.computer.scheme import stage_starts_s
from torquer.scenario.load import scenario_from_data
from torquer.simulation.setup.simulate import simulate
from torquer.spacecraft.parts import box

PRINTED = [[1.49, 0.054, 0.0442], [0.054, 1.51, 0.0], [0.0442, 0.0, 1.56]]
DIAGONAL = [1.49, 1.51, 1.56]
K2, K3, K4, K5 = 5e6, 5e6, 1e5, 1e5
SPIN_DEG_S = 10.0
SCHEMES = ("standard", "proposed")
#: Angle of the target [deg] to the end of the axis that is spun up, which end (1: axis 3).
READINGS = {
    "19.6 deg": (19.6, 1.0),
    "160.4 deg": (160.4, 1.0),
    "19.6 deg, against the initial spin": (19.6, -1.0),
    "160.4 deg, against the initial spin": (160.4, -1.0),
}
#: A cube of 0.5 m whose centre lies 1 cm from the centre of mass.
BODY = box((0.5, 0.5, 0.5), (0.01, 0.0, 0.0))
#: An inclination for which the recommended scheme has three stages.
_LOW_DEG = 10.0
#: Number of attitudes, with an azimuth of the target each.
TRIES = 12


@dataclass(frozen=True)
class Case:
    """A run: angle of the target to the spun end of the axis, that end (1 or -1), attitude.

    `azimuth_deg`: where the target is about axis 3; `euler_deg`: turns 3-2-1 from the inertial
    axes; `printed`: with the tensor as printed, not its diagonal.
    """

    away_deg: float = 19.6
    end: float = 1.0
    azimuth_deg: float = 225.0
    euler_deg: tuple = (0.0, 0.0, 0.0)
    printed: bool = False

    @property
    def inertia(self) -> list:
        """The tensor, as printed or its diagonal."""
        return PRINTED if self.printed else DIAGONAL

    @property
    def target(self) -> list[float]:
        """The target in the inertial frame."""
        start = Rotation.from_euler("ZYX", self.euler_deg, degrees=True)
        return (self.end * start.apply(aside(self.away_deg, self.azimuth_deg))).tolist()


#: Of fifty attitudes with the target at 160.4 deg, the one that comes nearest to 106 and 85 deg.
FITTED = Case(160.4, 1.0, 46.3, (-36.3, 13.0, 56.3))


def scheme(case: Case, name: str) -> dict:
    """The law of either scheme, as data."""
    damping = {"kind": "nutation_damping_rate", "gain_a_m2_s_per_t": K2}
    wanted = 1.56 * math.radians(SPIN_DEG_S)
    standard = {
        "target": case.target,
        "inertia_kg_m2": case.inertia,
        "spin_deg_s": SPIN_DEG_S,
        "nutation_damping": damping,
        "spin_up": {"gain_a_m2_per_t": K3},
        "reorientation": {"gain_a_m2_per_n_m_s_t": K4 / wanted},
        "during_spin_up": damping,
        "axis": [0.0, 0.0, case.end],
        "damped": {**DAMPED, "at_most_s": 30_000.0},
    }
    if name == "standard":
        return standard_scheme(**standard)
    law = recommended_scheme(_LOW_DEG, preliminary={"gain_a_m2_per_t": K5}, **standard)
    if name == "proposed":
        law["stages"][0]["laws"][1]["kind"] = "preliminary_1"
    return law


def scenario(case: Case, name: str):
    """The text's run."""
    return scenario_from_data({
        "start": "2012-06-01T00:00:00Z",
        "orbit": {"kind": "kepler", "perigee_altitude_km": 300.0, "apogee_altitude_km": 450.0,
                  "inclination_deg": 50.0},
        "environment": {"atmosphere": {"kind": "gost", "f107": 125.0, "ap": 10.0}},
        "spacecraft": {"body": {"inertia_kg_m2": case.inertia}, "coils": {"limit_a_m2": 1.0},
                       "aerodynamics": {"parts": [face.model_dump() for face in BODY]}},
        "initial": {"rate_deg_s": [6.0, 6.0, 6.0], "euler_deg": list(case.euler_deg)},
        "control": {"law": scheme(case, name), "sample_s": 1.0},
        # fixed steps: in the air adaptive ones are half as long, and the entry would take 2.8 times
        # as long; its numbers would be the same to a thousandth
        "simulation": {"revolutions": 25.0, "step_s": 1.0, "record_s": 20.0,
                       "integrator": "splitting"},
    })  # fmt: skip


def run(case: Case, name: str):
    """(Course, starts of the three stages [s])."""
    result = simulate(scenario(case, name))
    return course_of(result, case.end * np.array(case.target)), stage_starts_s(result)


def numbers(case: Case, name: str):
    """Axis before the last stage [deg], time until the momentum stays within 10 deg of the target
    [s], axis at the end [deg]."""
    course, starts = run(case, name)
    return course.at(starts[2], "axis"), course.last_above("momentum", 10.0), course.end("axis")


def over_attitudes(away_deg: float, end: float) -> np.ndarray:
    """`numbers` `[scheme, attitude, 3]`; the same attitudes for every reading."""
    azimuths = np.random.default_rng(5).uniform(0.0, 360.0, TRIES)
    turns = Rotation.random(TRIES, random_state=5).as_euler("ZYX", degrees=True)
    cases = [Case(away_deg, end, float(azimuth), tuple(map(float, turn)))
             for azimuth, turn in zip(azimuths, turns, strict=True)]  # fmt: skip
    return np.array([[numbers(case, name) for case in cases] for name in SCHEMES])


def compute() -> Answer:
    """Twelve attitudes in every reading; what was fitted; the tensor as printed."""
    found = {reading: over_attitudes(*of) for reading, of in READINGS.items()}
    standard, proposed = found["19.6 deg"]
    fitted = [numbers(FITTED, name) for name in (*SCHEMES, "second")]
    printed = [numbers(Case(printed=True), name) for name in SCHEMES]
    before = "axis before the last stage"
    checks = (
        graded(near(f"19.6 deg: standard, {before}, greatest", "106", standard[:, 0].max(), "deg",
                    printed="about 106 deg"), Grade.OPEN),
        graded(near(f"19.6 deg: proposed, {before}, greatest", "85", proposed[:, 0].max(), "deg",
                    printed="about 85 deg"), Grade.OPEN),
        chosen(near(f"160.4 deg, fitted: standard, {before}", "106", fitted[0][0], "deg",
                    printed="about 106 deg")),
        chosen(near(f"160.4 deg, fitted: proposed, {before}", "85", fitted[1][0], "deg",
                    printed="about 85 deg")),
        *claims("19.6 deg", found["19.6 deg"]),
        *claims("160.4 deg", found["160.4 deg"]),
        within("tensor as printed: axis at the end, either scheme", "some degrees",
               max(row[2] for row in printed), high=9.5, unit="deg"),
    )  # fmt: skip
    note = (
        f"Axis before the last stage over {TRIES} attitudes (standard; proposed), by the angle of "
        f"the target to the end that is spun up. {in_words(found)}. The fitted case was picked of "
        "fifty for both printed errors at once: it only shows that they can be reached. With "
        f"the second preliminary law it has {fitted[2][0]:.0f} deg. With the tensor as printed the "
        f"axis of greatest inertia lies {principal_tilt_deg():.1f} deg from the third one, which "
        f"ends {printed[0][2]:.1f} deg from the target by the standard scheme and "
        f"{printed[1][2]:.1f} deg by the proposed one."
    )
    return Answer(checks, figures(), note)


def claims(reading: str, rows) -> list:
    """Checks of what the text says of both schemes, by the median of the attitudes."""
    (before, time_s, end), (helped, sooner_s, its_end) = rows.transpose(0, 2, 1)
    return [
        within(f"{reading}: axis before the last stage, proposed over standard, median",
               "a smaller error is left to the last stage", np.median(helped / before), high=1.0),
        within(f"{reading}: time to 10 deg, proposed over standard, median", "takes less time",
               np.median(sooner_s / time_s), high=1.0),
        within(f"{reading}: axis at the end, farthest", "some degrees",
               max(end.max(), its_end.max()), high=9.5, unit="deg"),
    ]  # fmt: skip


def in_words(found) -> str:
    """Ranges of the errors before the last stage, by reading."""
    return ". ".join(
        f"{reading}: " + "; ".join(f"{x.min():.0f} to {x.max():.0f} deg" for x in rows[:, :, 0])
        for reading, rows in found.items()
    )


def principal_tilt_deg() -> float:
    """Angle between the axis of greatest inertia of the printed tensor and the third axis."""
    axes = np.linalg.eigh(np.array(PRINTED))[1]
    return float(np.degrees(np.arccos(abs(axes[2, 2]))))


def figures() -> dict:
    """Both schemes: the target at 19.6 deg, the fitted case, the tensor as printed."""
    panels_of = {"at 19.6 deg": Case(), "fitted, 160.4 deg": FITTED,
                 "19.6 deg, J printed": Case(printed=True)}  # fmt: skip
    figure, panels = new_figure("UniSat-5, standard and proposed scheme (MAG 3.6)", 3, 7.6)
    for panel, (name, case) in zip(panels, panels_of.items(), strict=True):
        for each, colour in zip(SCHEMES, (RED, BLUE), strict=True):
            course, starts = run(case, each)
            panel.plot(course.time_s / 3600.0, course.axis, color=colour, lw=0.8, label=each)
            panel.axvline(starts[2] / 3600.0, color=colour, lw=1.0, ls=(0, (4, 3)))
        panel.set(xlim=(0.0, 28.0), ylim=(0.0, 180.0), yticks=range(0, 181, 60))
        label(panel, "", f"axis to target [deg]\n{name}", legend=panel is panels[0])
    panels[-1].set_xlabel("time [h]", fontsize=10)
    panels[0].annotate("dashed: reorientation begins", (1.0, 1.0), xycoords="axes fraction",
                       xytext=(0, 4), textcoords="offset points", ha="right", fontsize=9,
                       color="#555555")  # fmt: skip
    return {"": figure}


ENTRY = Entry(
    ids=("MAG-3.5.3", "MAG-3.5.4"),
    compute=compute,
    declared=Verdict.DIFFERS,
    grade=Grade.REFUTED,
    reason=(
        "in 106 and 85 deg. With the target 19.6 deg from the end that is spun up, as the text "
        "reads, the standard scheme leaves up to 73 deg to the last stage in twelve attitudes. "
        "The momentum starts 34 to 73 deg from such a target. With 160.4 deg, or with "
        "19.6 deg and a spin against the initial one, both numbers lie in the range of the "
        "attitudes that were run; the text gives none. The proposed scheme leaves less and takes "
        "less time, as in the text. The final error is some degrees for the diagonal part of the "
        "tensor only. With the printed tensor the axis of greatest inertia lies 39.7 deg from the "
        "axis to be pointed, and the final error is that angle"
    ),
    slow=True,
)
