"""Settings of a run as rows of a table."""

import numpy as np

from torquer.analysis.budget import models_as_plain
from torquer.report.common.keys import changed_keys, in_one_line
from torquer.report.flight.view import View
from torquer.spacecraft.actuators.reaction_wheels import ReactionWheels


def setting(view: View) -> list[tuple[str, str]]:
    """Settings of the run: label and value."""
    scenario, attrs = view.scenario, view.result.attrs
    control, simulation = scenario.control, scenario.simulation
    altitude_km = 1e-3 * view.values("altitude")
    held = "dipole" if view.wheels is None else "wheel torque"
    if view.wheels is not None and view.has_coils:
        held = "dipole and wheel torque"
    cycle = f"sample every {control.sample_s:g} s, {held} held in between"
    if control.measure_s > 0.0:
        cycle = (
            f"{control.measure_s:g} s measurement, sampled every {control.sample_s:g} s, "
            f"then {control.actuate_s:g} s actuation"
        )
        if control.control_while_actuating:
            cycle += ", with control steps during actuation"
    degree = getattr(scenario.environment.field, "degree", None)
    return [
        ("Ended", attrs["ended"] + (f", by {attrs['ended_by']}" if "ended_by" in attrs else "")),
        ("Start", f"{scenario.start:%Y-%m-%d %H:%M:%S} UTC"),
        (
            "Orbit",
            f"{scenario.orbit.kind}, altitude {altitude_km.min():.0f} to "
            f"{altitude_km.max():.0f} km, period {view.revolution_s / 60.0:.2f} min",
        ),
        ("Eclipse", f"{np.mean(view.values('sunlit_fraction') < 0.5):.0%} of the time"),
        ("Field", scenario.environment.field.kind + (f" to degree {degree}" if degree else "")),
        *_models(view),
        *(hardware_lines(view.wheels.spec) if view.wheels is not None else ()),
        *_laws(view),
        ("Cycle", cycle),
        (
            "Integration",
            f"{simulation.in_words}, record every {simulation.record_s:g} s",
        ),
        ("Seed", attrs["seed"]),
    ]


def _models(view: View) -> list[tuple[str, str]]:
    """How far the models on board are from the truth."""
    if (models := view.scenario.model_errors()) is None:
        return []
    off = models_as_plain(models)
    field = f"field off by {off['field_nt']:.3g} nT, {off['angle_deg']:.2g} deg"
    return [("Models on board", f"{field}; position by {off['position_km']:.3g} km (rms)")]


def _laws(view: View) -> list[tuple[str, str]]:
    """Laws and estimators, and how they are executed."""
    rows = []
    for key, law in view.laws.items():
        kind = view.kind_of(key).capitalize()
        label = kind if key == kind.lower() else f"{kind} {key}"
        given = in_one_line(_keys(view, key, law))
        rows.append((label, f"{law['name']} ({given})" if given else law["name"]))
        if len(view.laws) == 1 or law["runs_as"] != "compiled":
            rows.append((f"{label} runs as", law["runs_as"]))
    return rows


def _keys(view: View, key: str, law: dict) -> dict:
    """Keys of a law or estimator in the scenario; of a user's law, the parameters flown."""
    spec = view.spec_of(key)
    own = "parameters" in type(spec).model_fields
    return law["parameters"] if own else changed_keys(spec)


def hardware_lines(spec: ReactionWheels) -> list[tuple[str, str]]:
    """Label and value for a table: the wheels, their allocation, their failures."""
    given = spec.layout.model_dump(exclude={"kind", "axes", "count"})
    angles = ", ".join(f"{k.removesuffix('_deg')} {v:.4g} deg" for k, v in given.items())
    kind = spec.layout.kind.replace("_", " ")
    layout = f"{kind} ({angles})" if angles else kind
    described = [
        f"{len(spec.layout.rows())}: {layout}",
        f"momentum up to {_each(spec.momentum_limit_n_m_s)} N m s at {spec.speed_limit_rpm:g} rpm",
        f"torque up to {_each(spec.torque_limit_n_m)} N m",
    ]
    if spec.coulomb_friction_n_m or spec.viscous_friction_n_m_s:
        top = spec.viscous_friction_n_m_s * spec.speed_limit_rad_s
        friction = spec.coulomb_friction_n_m
        described.append(f"friction {friction:.3g} N m, {friction + top:.3g} N m at top speed")
    sharing = {"minimax": "minimax", "least_squares": "least squares"}[spec.allocation]
    if spec.minimum_speed_fraction:
        sharing += (
            f", speeds kept above {spec.minimum_speed_fraction:.0%} of the limit where possible"
        )
    lines = [("Wheels", ", ".join(described)), ("Torque allocation", sharing)]
    failures = [f"wheel {k} from the start" for k in spec.lost]
    failures += [
        f"wheel {f.wheel} at {f.time_s:g} s"
        + (f", detected {f.noticed_after_s:g} s later" if f.noticed_after_s else "")
        for f in spec.failures
    ]
    return [*lines, ("Wheel failures", "; ".join(failures))] if failures else lines


def _each(values) -> str:
    """One number, or one per wheel."""
    return " / ".join(f"{v:g}" for v in np.atleast_1d(values))
