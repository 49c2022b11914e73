"""What the author of a mode table should know before the run."""

from torquer.computer.interface import SENSORS
from torquer.computer.modes.check import faults, findings
from torquer.computer.modes.finding import Facts, Finding
from torquer.scenario.spec import Scenario

#: Kinds of estimators that do not state how good they are.
_WITHOUT_SIGMA = ("attitude_sensor", "rate_from_field", "law", "none")


def mode_notes(scenario: Scenario) -> list[str]:
    """Faults that the checker finds in the modes, one line each."""
    modes = scenario.control.named().modes
    found = faults(modes, mode_facts(scenario)) if modes else []
    return [f"modes: {finding.message}" for finding in found]


def mode_findings(scenario: Scenario) -> list[Finding]:
    """All findings of the checker on the modes; none for laws that always work."""
    modes = scenario.control.named().modes
    return findings(modes, mode_facts(scenario)) if modes else []


def mode_facts(scenario: Scenario) -> Facts:
    """What the checker of mode tables is to know of a scenario."""
    control = scenario.control
    specs, laws = control.named().laws, control.named().known_laws()
    estimators = {"estimator": control.estimator, **control.estimators}
    gives = {name: _given_by(spec) for name, spec in estimators.items()}
    needs = frozenset().union(*(law.needs for law in laws.values()))
    sensors = set(SENSORS)
    if "search_coil" not in needs and len(laws) == len(specs):
        sensors.remove("search_coil")
    if scenario.spacecraft.wheels is None:
        sensors.remove("tachometers")
    if scenario.spacecraft.sun_cells is None:
        sensors.remove("sun_cells")
    return Facts(
        step_s=control.sample_s,
        kinds={name: spec.kind for name, spec in specs.items()},
        drives={name: _driven_by(law) for name, law in laws.items() if specs[name].kind != "off"},
        gives={"attitude_sensor": frozenset({"attitude", "rate"}), "none": frozenset(), **gives},
        sensors=frozenset(sensors),
    )


def _driven_by(law) -> frozenset[str]:
    driven = {"coils": law.drives_coils, "wheels": law.drives_wheels}
    return frozenset(key for key, does in driven.items() if does)


def _given_by(spec) -> frozenset[str]:
    """What an estimator gives, `sigma` included."""
    return spec.gives if spec.kind in _WITHOUT_SIGMA else spec.gives | {"sigma"}
