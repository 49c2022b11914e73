"""FIELD Fig. 10: accuracy near the gravity-gradient attitude, with errors, four field models.

Axes. FIELD's orbital frame is up, motion, normal, and its (2.16) wants B > A for gravity to hold
pitch. The moments as printed, 5750 up, 2450 along the motion, 4000 normal, have B < A: like-named
axes do not stay together without control, nor with any gain that is tried. They are run so, and in
the only stable order as well: the least up, the middle one along the motion, the greatest normal.

Gain: not printed for this figure. That of Fig. 8 is run too, and others from 1e7 to 5e12. The gain
of the comparison was fixed before any model was compared: the one whose own pitch offset by (2.16)
is the greatest initial angle, 6 deg, which the text calls near.

Also chosen here: errors and the constant torque alike on all axes, readings and the random torque
new every second, accuracy as the 95th percentile over the second half of the run (a greatest
value would depend on a single draw, and grow with the run's length), 'similar' as within a
third of IGRF's: what a preliminary design keeps in hand, and the text has simple models for that.
"""

import math
from dataclasses import dataclass

import numpy as np

from gallery.drawing import label, new_figure
from gallery.entry import Answer, Entry, Grade, Verdict, graded, lost, within
from gallery.four_models import (
    MODELS,
    NODES_DEG,
    START,
    TURNING_WITH_THE_EARTH,
    by_node,
    draw,
)
from gallery.theory.pitch_wheel import PitchWheel, pitch_offset_direct_dipole
from torquer.scenario.load import scenario_from_data
from torquer.simulation.setup.simulate import simulate

ALTITUDE_KM, INCLINATION_DEG = 1000.0, 82.5
FIRST_ANGLES_DEG, FIRST_RATE_PER_S = (6.0, 3.0, 2.0), 1e-4
#: Moments about (up, motion, normal).
PRINTED, STABLE = (5750.0, 2450.0, 4000.0), (2450.0, 4000.0, 5750.0)
GAIN_OF_FIG_8 = 5e11
#: Gains that are tried with either order of the moments.
GAINS = (1e7, 1e8, 1e9, 5e9, 2e10, 1e11, GAIN_OF_FIG_8, 5e12)
EARLY = 3.0
LOW, HIGH = 0.75, 4.0 / 3.0
#: A body that is farther than this from an attitude is not near it, whatever near means.
LOST_DEG = 45.0


@dataclass(frozen=True)
class Course:
    """Greatest angle between like-named axes, of the body and of the wanted attitude."""

    revolutions: np.ndarray
    angle_deg: np.ndarray

    @property
    def accuracy_deg(self) -> float:
        """95th percentile over the second half of the run."""
        late = self.revolutions > 0.5 * self.revolutions[-1]
        return float(np.percentile(self.angle_deg[late], 95.0))


def scenario(law, model, node_deg=0.0, *, moments=STABLE, wheel_n_m_s=0.0, revolutions=60.0):
    """FIELD's case of section 3 with its errors; body axes 1, 2, 3 are those of X.

    X is (motion, normal, up): FIELD's turns 1-3-2 are 3-2-1 here. `moments` are about (up,
    motion, normal); `law` is a scenario's section.
    """
    up, motion, normal = moments
    rate = math.degrees(FIRST_RATE_PER_S)
    return scenario_from_data({
        "start": START,
        "orbit": {"kind": "circular", "altitude_km": ALTITUDE_KM,
                  "inclination_deg": INCLINATION_DEG, "raan_deg": node_deg},
        "environment": {"field": MODELS[model], "earth_rotation": "sidereal"},
        "spacecraft": {
            "body": {"inertia_kg_m2": [motion, normal, up],
                     "wheel_momentum_n_m_s": [0.0, wheel_n_m_s, 0.0]},
            "coils": {"limit_a_m2": 250.0},
            "attitude_sensor": {"error_deg": [1.0, 1.0, 1.0], "noise_deg": 2.0},
            "gyro": {"bias_deg_s": [0.01, 0.01, 0.01], "noise_deg_s": 0.001},
        },
        "disturbance": {"constant_torque_n_m": [1e-4, 1e-4, 1e-4], "random_torque_n_m": 4e-4,
                        "random_hold_s": 1.0},
        "initial": {"euler_deg": list(FIRST_ANGLES_DEG), "sequence": "321", "reference": "orbital",
                    "rate_deg_s": [rate, rate, rate], "rate_relative_to": "orbital"},
        "control": {"law": law, "sample_s": 1.0},
        "simulation": {"revolutions": revolutions, "record_s": 10.0},
    })  # fmt: skip


def course(run, pitch_deg=0.0) -> Course:
    """Simulate; the wanted attitude is the orbital frame, turned by `pitch_deg` about the normal
    (from up towards the motion).
    """
    from scipy.spatial.transform import Rotation

    result = simulate(run)
    up, velocity = result["position_inertial"].values, result["velocity_inertial"].values
    normal = np.cross(up, velocity)
    frame = np.stack([np.cross(normal, up), normal, up], axis=-1)
    frame /= np.linalg.norm(frame, axis=1, keepdims=True)
    wanted = frame @ Rotation.from_euler("y", pitch_deg, degrees=True).as_matrix()
    body = Rotation.from_quat(result["q_body_to_inertial"].values).as_matrix()
    cosines = np.clip(np.sum(wanted * body, axis=1), -1.0, 1.0)
    angle = np.degrees(np.arccos(cosines.min(axis=1)))
    return Course(result["time"].values / run.orbit.period_s, angle)


def courses(run_of, pitch_deg=0.0) -> dict[str, list[Course]]:
    """By model: `pick_run(model, node_deg)` at each node, or one where it plays no part."""
    return {
        model: [
            course(run_of(model, node), pitch_deg)
            for node in (NODES_DEG if model in TURNING_WITH_THE_EARTH else (0,))
        ]
        for model in MODELS
    }


def comparison(runs) -> tuple[tuple, np.ndarray]:
    """(Checks of the simple models against IGRF, node by node; accuracies [model, node] deg)."""
    accuracy = by_node(runs, lambda run: run.accuracy_deg)
    ratios = np.median(accuracy / accuracy[0], axis=1)
    checks = tuple(
        graded(within(f"accuracy with the {model} over that with IGRF, median of the nodes",
                      "simplified models can in general be used", ratio, LOW, HIGH), Grade.OPEN)
        for model, ratio in list(zip(runs, ratios, strict=True))[1:]
    )  # fmt: skip
    median = lost("accuracy with IGRF, median of the nodes", np.median(accuracy[0]), "deg")
    return (*checks, median), accuracy


def ranges(runs, accuracy) -> str:
    """Accuracies by model, over the nodes."""
    return ", ".join(
        f"{model} {found.min():.1f} to {found.max():.1f}"
        for model, found in zip(runs, accuracy, strict=True)
    )


def law_of(gain) -> dict:
    """B-dot from the model on board, with estimated attitude and rate."""
    return {"kind": "bdot_model", "gain_a_m2_s_per_t": float(gain)}


def chosen_gain() -> float:
    """The gain whose pitch offset by (2.16) is the greatest initial angle."""
    one = PitchWheel(inertia_kg_m2=STABLE, gain_a_m2_s_t=1.0, altitude_km=ALTITUDE_KM,
                     inclination_deg=INCLINATION_DEG)  # fmt: skip
    return math.radians(max(FIRST_ANGLES_DEG)) / pitch_offset_direct_dipole(one)


def best_of_models(moments, gain) -> float:
    """Accuracy [deg] of the best model at the first node."""
    return min(
        course(scenario(law_of(gain), model, moments=moments)).accuracy_deg for model in MODELS
    )


def over_gains(moments) -> dict[float, float]:
    """`best_of_models` by gain."""
    return {gain: best_of_models(moments, gain) for gain in GAINS}


def compute() -> Answer:
    """60 revolutions of four models at 12 nodes; the printed moments, the gain of Fig. 8."""
    gain = chosen_gain()
    runs = courses(lambda model, node: scenario(law_of(gain), model, node))
    similar, accuracy = comparison(runs)
    near = "motion near the required attitude"
    printed, stable = over_gains(PRINTED), over_gains(STABLE)
    checks = (
        *similar,
        within(f"moments in the printed order, accuracy with the best model and the best of "
               f"{len(GAINS)} gains", near, min(printed.values()), high=LOST_DEG, unit="deg"),
        graded(within("gain of Fig. 8, stable order, accuracy with the best model", near,
                      stable[GAIN_OF_FIG_8], high=LOST_DEG, unit="deg"), Grade.OPEN),
    )  # fmt: skip
    held = ", ".join(f"{gain:g}" for gain, angle in stable.items() if angle < LOST_DEG)
    early = by_node(runs, early_deg)
    early_ratios = np.median(early / early[0], axis=1)[1:]
    note = (
        f"Accuracy: 95th percentile of the angle over revolutions 30 to 60, deg, over the nodes: "
        f"{ranges(runs, accuracy)}. Over the first {EARLY:g} revolutions the same percentile is "
        f"{early_ratios.min():.2f} to {early_ratios.max():.2f} of IGRF's: there the curves are "
        f"closer. The text does not give these, which were chosen here: the gain ({gain:.3g}, "
        "by (2.16)), the order "
        "of the moments (2450 up, 4000 along the motion, 5750 normal), errors and constant torque "
        "alike on all axes. Further the random torque held for a second, the node and the "
        "date, the length of the run. The measure, its limits and the gain were fixed before the "
        f"models were compared. Of gains from {GAINS[0]:g} to {GAINS[-1]:g} those of {held} "
        f"keep the attitude in the stable order, under the best model."
    )
    return Answer(checks, {"": picture(runs)}, note)


def early_deg(run) -> float:
    """95th percentile of the angle [deg] over the first revolutions."""
    return float(np.percentile(run.angle_deg[run.revolutions < EARLY], 95.0))


def picture(runs):
    """The first 20 revolutions at the first node."""
    figure, (axes,) = new_figure("Accuracy near the gravity-gradient attitude (FIELD Fig. 10)")
    draw(axes, runs, lambda run: run.angle_deg)
    label(axes, "revolutions", "greatest angle between axes [deg]")
    axes.set_xlim(0.0, 20.0)
    axes.set_ylim(bottom=0.0)
    return figure


ENTRY = Entry(
    ids=("FIELD-10",),
    compute=compute,
    declared=Verdict.DIFFERS,
    grade=Grade.REFUTED,
    reason=(
        "with the moments in the printed order none of the gains tried, from 1e7 to 5e12, keeps "
        "the attitude, and in the stable order the body tumbles with the gain of Fig. 8 (the text "
        "prints no other), as with all from 5e9 on. With a gain that keeps it, the three simple "
        "models agree with one another, but the error under IGRF is twice as large. Its quadrupole "
        "excites the body once a revolution, near the pitch frequency of 0.90; the tilted dipole "
        "does so an eighth as much, the direct one not at all. In the first revolutions all are "
        "closer"
    ),
    slow=True,
)
