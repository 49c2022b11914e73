"""How a run was made, as lines of a table."""

import json

import numpy as np

from torquer.report.flown_wheels import hardware_lines
from torquer.report.view import View


def setting(view: View) -> list[tuple[str, str]]:
    """How the run was made: label and value."""
    scenario, attrs = view.scenario, view.result.attrs
    control, simulation = scenario.control, scenario.simulation
    height = 1e-3 * view.values("altitude")
    held = "dipole" if view.wheels is None else "wheels' torque"
    if view.wheels is not None and view.has_coils:
        held = "dipole and wheels' torque"
    cycle = f"reading every {control.sample_s:g} s, {held} held for as long"
    if control.measure_s > 0.0:
        cycle = (
            f"{control.measure_s:g} s measurement, a reading every {control.sample_s:g} s, "
            f"then {control.actuate_s:g} s actuation"
        )
    degree = getattr(scenario.environment.field, "degree", None)
    return [
        ("Ended", attrs["ended"]),
        ("Start", f"{scenario.start:%Y-%m-%d %H:%M:%S} UTC"),
        (
            "Orbit",
            f"{scenario.orbit.kind}, height {height.min():.0f} to {height.max():.0f} km, "
            f"revolution {view.revolution_s / 60.0:.2f} min",
        ),
        ("Eclipse", f"{np.mean(view.values('lit') < 0.5):.0%} of the time"),
        ("Field", scenario.environment.field.kind + (f" to degree {degree}" if degree else "")),
        *_wheels(view),
        *_laws(view),
        ("Cycle", cycle),
        (
            "Integration",
            f"{simulation.integrator}, step {simulation.step_s:g} s, "
            f"record every {simulation.record_s:g} s",
        ),
        ("Seed", attrs["seed"]),
    ]


def _wheels(view: View) -> list[tuple[str, str]]:
    return [] if view.wheels is None else hardware_lines(view.wheels.spec)


def _laws(view: View) -> list[tuple[str, str]]:
    """The law, or those of coils and wheels; how they run."""
    attrs, rows = view.result.attrs, []
    both = view.wheels is not None
    for name, of_what in (("law", "coils"), ("wheel_law", "wheels")):
        if name not in attrs or (both and name == "law" and not view.has_coils):
            continue
        parameters = json.loads(attrs[f"{name}_parameters"])
        given = ", ".join(f"{key} = {value:g}" for key, value in parameters.items())
        label = f"Law of the {of_what}" if both else "Law"
        rows += [
            (label, f"{attrs[name]} ({given})" if given else attrs[name]),
            ("  runs as" if both else "Law runs as", attrs[f"{name}_runs_as"]),
        ]
    return rows
