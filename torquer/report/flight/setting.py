"""Settings of a run as rows of a table."""

import numpy as np

from torquer.analysis.budget import models_as_plain
from torquer.base.language import Message, joined, message
from torquer.report.common.keys import changed_keys, in_one_line
from torquer.report.flight.view import View
from torquer.spacecraft.actuators.reaction_wheels import ReactionWheels

#: What entries of `View.laws` are called at the beginning of a line.
LABELS = {"law": "Law", "estimator": "Estimator"}


def setting(view: View) -> list[tuple[str, str]]:
    """Settings of the run: label and value."""
    scenario, attrs = view.scenario, view.result.attrs
    simulation = scenario.simulation
    altitude_km = 1e-3 * view.values("altitude")
    field = scenario.environment.field
    kind, degree = field.kind, getattr(field, "degree", None)
    return [
        (message("Ended"), _ended(attrs)),
        (message("Start"), f"{scenario.start:%Y-%m-%d %H:%M:%S} UTC"),
        (
            message("Orbit"),
            message(
                "{kind}, altitude {low:.0f} to {high:.0f} km, period {period:.2f} min",
                kind=scenario.orbit.kind,
                low=altitude_km.min(),
                high=altitude_km.max(),
                period=view.revolution_s / 60.0,
            ),
        ),
        (
            message("Eclipse"),
            message("{share:.0%} of the time", share=np.mean(view.values("sunlit_fraction") < 0.5)),
        ),
        (
            message("Field"),
            message("{kind} to degree {degree}", kind=kind, degree=degree) if degree else kind,
        ),
        *_models(view),
        *(hardware_lines(view.wheels.spec) if view.wheels is not None else ()),
        *_laws(view),
        (message("Cycle"), _cycle(view)),
        (
            message("Integration"),
            message(
                "{method}, record every {record:g} s",
                method=simulation.in_words,
                record=simulation.record_s,
            ),
        ),
        (message("Seed"), attrs["seed"]),
    ]


def _ended(attrs) -> Message:
    """How the run ended, and by which condition."""
    ended = message(attrs["ended"])
    if "ended_by" not in attrs:
        return ended
    return message("{ended}, by {condition}", ended=ended, condition=attrs["ended_by"])


def _cycle(view: View) -> Message:
    """When the computer measures and commands."""
    control = view.scenario.control
    if control.measure_s > 0.0:
        cycle = message(
            "{measure:g} s measurement, sampled every {sample:g} s, then {actuate:g} s actuation",
            measure=control.measure_s,
            sample=control.sample_s,
            actuate=control.actuate_s,
        )
        if not control.control_while_actuating:
            return cycle
        return message("{cycle}, with control steps during actuation", cycle=cycle)
    held = message("dipole") if view.wheels is None else message("wheel torque")
    if view.wheels is not None and view.has_coils:
        held = message("dipole and wheel torque")
    return message(
        "sample every {sample:g} s, {held} held in between", sample=control.sample_s, held=held
    )


def _models(view: View) -> list[tuple[str, str]]:
    """How far the models on board are from the truth."""
    if (models := view.scenario.model_errors()) is None:
        return []
    off = models_as_plain(models)
    words = message(
        "field off by {field_nt:.3g} nT, {angle_deg:.2g} deg; position by {position_km:.3g} km "
        "(rms)",
        **{key: off[key] for key in ("field_nt", "angle_deg", "position_km")},
    )
    return [(message("Models on board"), words)]


def _laws(view: View) -> list[tuple[str, str]]:
    """Laws and estimators, and how they are executed."""
    rows: list[tuple[str, str]] = []
    for key, law in view.laws.items():
        kind = LABELS[view.kind_of(key)]
        label = message(kind)
        if key != kind.lower():
            label = message("{kind} {key}", kind=kind, key=key)
        given = in_one_line(_keys(view, key, law))
        rows.append((label, f"{law['name']} ({given})" if given else law["name"]))
        if len(view.laws) == 1 or law["runs_as"] != "compiled":
            rows.append((message("{label} runs as", label=label), message(law["runs_as"])))
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
        message(
            "momentum up to {momentum} N m s at {speed:g} rpm",
            momentum=_each(spec.momentum_limit_n_m_s),
            speed=spec.speed_limit_rpm,
        ),
        message("torque up to {torque} N m", torque=_each(spec.torque_limit_n_m)),
    ]
    if spec.coulomb_friction_n_m or spec.viscous_friction_n_m_s:
        top = spec.viscous_friction_n_m_s * spec.speed_limit_rad_s
        friction = spec.coulomb_friction_n_m
        described.append(
            message(
                "friction {friction:.3g} N m, {fastest:.3g} N m at top speed",
                friction=friction,
                fastest=friction + top,
            )
        )
    sharing = {"minimax": message("minimax"), "least_squares": message("least squares")}
    shared = sharing[spec.allocation]
    if spec.minimum_speed_fraction:
        shared = message(
            "{sharing}, speeds kept above {share:.0%} of the limit where possible",
            sharing=shared,
            share=spec.minimum_speed_fraction,
        )
    lines: list[tuple[str, str]] = [
        (message("Wheels"), joined(", ", described)),
        (message("Torque allocation"), shared),
    ]
    failures = [message("wheel {number} from the start", number=k) for k in spec.lost]
    failures += map(_failure, spec.failures)
    return [*lines, (message("Wheel failures"), joined("; ", failures))] if failures else lines


def _failure(failure) -> Message:
    """Which wheel fails when, and when it is noticed."""
    told_of = message("wheel {number} at {time:g} s", number=failure.wheel, time=failure.time_s)
    if not failure.noticed_after_s:
        return told_of
    return message(
        "{failure}, detected {later:g} s later", failure=told_of, later=failure.noticed_after_s
    )


def _each(values) -> str:
    """One number, or one per wheel."""
    return " / ".join(f"{v:g}" for v in np.atleast_1d(values))
