"""FIELD (2.16): the pitch at which B-dot's drag and the gravity gradient balance, polar orbit.

The text has no numbers here. The satellite is that of section 3 with its wheel, its moments in
the order that gravity holds (see FIELD-10), and a gain that leaves about a degree, small enough
for the small-parameter method, whose second power is then a hundred times less.
"""

import math

import numpy as np

from gallery.drawing import MODEL_COLOURS, label, level, new_figure
from gallery.entries.field_10 import ALTITUDE_KM, STABLE
from gallery.entry import Answer, Entry, consistent, near
from gallery.four_models import MODELS, START
from gallery.theory.pitch_wheel import (
    PITCH,
    PitchWheel,
    pitch_offset_averaged_polar,
    pitch_offset_direct_dipole,
    pitch_wheel_response,
)
from torquer.scenario.load import scenario_from_data
from torquer.simulation.setup.simulate import simulate

GAIN_A_M2_S_PER_T, WHEEL_N_M_S, REVOLUTIONS = 1e8, 10.0, 10.0
PREDICTED = {"direct dipole": pitch_offset_direct_dipole, "averaged": pitch_offset_averaged_polar}
THEORY = {"direct dipole": "direct_dipole", "averaged": "averaged"}


def satellite(inclination_deg=90.0) -> PitchWheel:
    """The satellite, as the theory takes it."""
    return PitchWheel(inertia_kg_m2=STABLE, wheel_momentum_n_m_s=WHEEL_N_M_S,
                      gain_a_m2_s_t=GAIN_A_M2_S_PER_T, altitude_km=ALTITUDE_KM,
                      inclination_deg=inclination_deg)  # fmt: skip


def scenario(model, pitch_rad):
    """The full equations from the predicted pitch, without errors; body axes as in X."""
    up, motion, normal = STABLE
    return scenario_from_data({
        "start": START,
        "orbit": {"kind": "circular", "altitude_km": ALTITUDE_KM, "inclination_deg": 90.0},
        "environment": {"field": MODELS[model], "earth_rotation": "sidereal"},
        "spacecraft": {"body": {"inertia_kg_m2": [motion, normal, up],
                                "wheel_momentum_n_m_s": [0.0, WHEEL_N_M_S, 0.0]},
                       "coils": {"limit_a_m2": 250.0}},
        "initial": {"euler_deg": [0.0, math.degrees(pitch_rad), 0.0], "sequence": "321",
                    "reference": "orbital", "rate_deg_s": [0.0, 0.0, 0.0],
                    "rate_relative_to": "orbital"},
        "control": {"law": {"kind": "bdot_derivative", "gain_a_m2_s_per_t": GAIN_A_M2_S_PER_T},
                    "sample_s": 1.0},
        "simulation": {"revolutions": REVOLUTIONS, "record_s": 10.0},
    })  # fmt: skip


def course(model):
    """Revolutions, and pitch [deg] forward of the radius vector, of the full equations."""
    from scipy.spatial.transform import Rotation

    run = scenario(model, PREDICTED[model](satellite()))
    result = simulate(run)
    up, velocity = result["position_inertial"].values, result["velocity_inertial"].values
    axis = Rotation.from_quat(result["q_body_to_inertial"].values).apply([0.0, 0.0, 1.0])
    ahead = np.cross(np.cross(up, velocity), up)
    along = np.sum(axis * ahead, axis=1) / np.linalg.norm(ahead, axis=1)
    upwards = np.sum(axis * up, axis=1) / np.linalg.norm(up, axis=1)
    return result["time"].values / run.orbit.period_s, np.degrees(np.arctan2(along, upwards))


def compute() -> Answer:
    """Formulas, the small-parameter method, and the full equations over 10 revolutions."""
    here = satellite()
    formula = {model: math.degrees(of(here)) for model, of in PREDICTED.items()}
    runs = {model: course(model) for model in PREDICTED}
    mean = {model: float(pitch[:-1].mean()) for model, (_, pitch) in runs.items()}
    method = [pitch_wheel_response(here, THEORY[model]).offset[PITCH] for model in PREDICTED]
    ratio = "0.8889"
    checks = (
        near("direct dipole over averaged, small-parameter method", ratio, method[0] / method[1],
             printed="8/9"),
        near("direct dipole over averaged, full equations", "0.889",
             mean["direct dipole"] / mean["averaged"], printed="8/9"),
        near("direct dipole: mean pitch of the full equations over the formula's", "1.00",
             mean["direct dipole"] / formula["direct dipole"], printed="(2.16)"),
        consistent(near("averaged: mean pitch of the full equations over the formula's", "1.00",
                        mean["averaged"] / formula["averaged"],
                        printed="its formula, lost in the text")),
    )  # fmt: skip
    note = (
        f"Formulas: {formula['direct dipole']:.4f} deg (direct dipole), "
        f"{formula['averaged']:.4f} deg (averaged), forward for a gain that damps. The averaged "
        "field is stronger and leaves the greater pitch, as the text says. The text gives the "
        "averaged formula for the polar orbit only; at other inclinations the small-parameter "
        "method has it (lower panel)."
    )
    return Answer(checks, {"": picture(runs, formula)}, note)


def picture(runs, formula):
    """Pitch of the full equations; below, the offset by the method against inclination."""
    figure, (upper, lower) = new_figure("Pitch offset under B-dot (FIELD (2.16))", 2, 6.4)
    inclinations = np.arange(2.5, 90.1, 2.5)
    for model, (revolutions, pitch) in runs.items():
        upper.plot(revolutions, pitch, color=MODEL_COLOURS[model], lw=1.2, label=model)
        level(upper, formula[model], f"{formula[model]:.3f} deg")
        offsets = [
            math.degrees(each.epsilon * pitch_wheel_response(each, THEORY[model]).offset[PITCH])
            for each in map(satellite, inclinations)
        ]
        lower.plot(inclinations, offsets, color=MODEL_COLOURS[model], lw=1.3, label=model)
    label(upper, "revolutions on the polar orbit", "pitch [deg]")
    upper.set(xlim=(0.0, REVOLUTIONS), ylim=(0.8, 1.15))
    label(lower, "inclination [deg]", "steady pitch [deg]", legend=False)
    lower.set(xlim=(0.0, 90.0), ylim=(0.0, None))
    return figure


ENTRY = Entry(ids=("FIELD-2.16",), compute=compute)
